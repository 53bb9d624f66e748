//! The numbers of the selection: every property as a field to read and type.
//!
//! ```text
//! one track     from X Y, to X Y, length, width, layer     several of a kind   shared values; else empty
//! one pad       X Y, shape, size, rotation, layer          several kinds       X and Y of their box
//! of a file     X Y, moved by, turned by
//! ```
//!
//! Lengths are whole nanometres, angles thousandths of a degree.

use super::Editor;
use super::typed::{degrees, length};
use crate::format::Unit;
use annulus_core::board::drawing::{
    Catch, Drawing, Edit, Entry, Id, Layer, NARROWEST, PadShape, Thing, WIDEST, put, renamed, whole_turn,
};
use annulus_core::geometry::Point;
use annulus_core::units::Length;
use std::collections::BTreeSet;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// X of a middle, of a node, or of the left edge of the box around several things.
    X,
    Y,
    /// X of a track's start.
    FromX,
    FromY,
    /// X of a track's end.
    ToX,
    ToY,
    /// Length of a track; read-only.
    Length,
    Width,
    Shape,
    Size,
    Turn,
    Diameter,
    Plated,
    Layer,
    Name,
    Group,
    /// X offset of an object from where its file draws it.
    ByX,
    ByY,
}

/// True if the field may have this length. Only widths and sizes have limits; the edit itself checks
/// positions.
pub fn may_be(field: Field, length: Length) -> bool {
    !field.is_size() || (NARROWEST..=WIDEST).contains(&length)
}

impl Field {
    pub const fn is_size(self) -> bool {
        matches!(self, Self::Width | Self::Size | Self::Diameter)
    }

    pub const fn word(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::FromX => "from_x",
            Self::FromY => "from_y",
            Self::ToX => "to_x",
            Self::ToY => "to_y",
            Self::Length => "length",
            Self::Width => "width",
            Self::Shape => "shape",
            Self::Size => "size",
            Self::Turn => "turn",
            Self::Diameter => "diameter",
            Self::Plated => "plated",
            Self::Layer => "layer",
            Self::Name => "name",
            Self::Group => "group",
            Self::ByX => "by_x",
            Self::ByY => "by_y",
        }
    }
}

/// The value of a field; none if the selected things differ.
#[derive(Clone, Debug, PartialEq)]
pub enum FieldValue {
    Length(Option<Length>),
    /// A derived length, read-only.
    Fixed(Option<Length>),
    /// An angle in thousandths of a degree.
    Turn(Option<i32>),
    Shape(Option<PadShape>),
    Layer(Option<Layer>),
    Flag(Option<bool>),
    Name(String),
    /// The group, or none for the top level, and all groups to choose from.
    Group(Option<Option<Id>>, Vec<(Id, String)>),
}

#[derive(Clone, Debug, PartialEq)]
pub struct FieldRow {
    pub field: Field,
    pub value: FieldValue,
}

fn shared<T: PartialEq>(mut values: impl Iterator<Item = T>) -> Option<T> {
    let first = values.next()?;
    values.all(|value| value == first).then_some(first)
}

pub fn rows(editor: &Editor) -> Vec<FieldRow> {
    let (drawing, ids) = (editor.drawing(), editor.ids());
    let row = |field, value| FieldRow { field, value };
    if editor.chosen.is_empty() {
        return vec![row(Field::Name, FieldValue::Name(drawing.name().to_owned()))];
    }
    let things: Vec<&Thing> = ids.iter().filter_map(|id| drawing.thing(*id)).collect();
    let mut rows = places(editor);
    let leaves: Vec<&Thing> = drawing.leaves(&ids).into_iter().filter_map(|id| drawing.thing(id)).collect();
    if let [Thing::Group { name }] = things.as_slice() {
        rows.insert(0, row(Field::Name, FieldValue::Name(name.clone())));
    }
    rows.extend(sizes(&leaves));
    rows.extend(of_files(editor, &rows));
    let groups = drawing.things().filter_map(|(id, entry)| match &entry.thing {
        Thing::Group { name } if !ids.contains(&id) => Some((id, name.clone())),
        _ => None,
    });
    let groups: Vec<(Id, String)> = groups.collect();
    if !groups.is_empty() {
        let own = shared(editor.chosen.iter().map(|catch| editor.group_of(*catch)));
        rows.push(row(Field::Group, FieldValue::Group(own, groups)));
    }
    rows
}

fn places(editor: &Editor) -> Vec<FieldRow> {
    let drawing = editor.drawing();
    let pair = |x: Field, y: Field, at: Option<Point>| {
        let value = |length: Option<Length>| FieldValue::Length(length);
        [
            FieldRow { field: x, value: value(at.map(|at| at.x)) },
            FieldRow { field: y, value: value(at.map(|at| at.y)) },
        ]
    };
    let one = editor.chosen.first().filter(|_| editor.chosen.len() == 1);
    let of_file = one.and_then(|catch| editor.place_of(*catch));
    let thing = one.and_then(|catch| if let Catch::Drawn(id) = catch { drawing.thing(*id) } else { None });
    match thing {
        _ if of_file.is_some() => Vec::from(pair(Field::X, Field::Y, of_file)),
        Some(Thing::Track { from, to, .. }) => {
            let (from, to) = (drawing.at(*from), drawing.at(*to));
            let mut rows = Vec::from(pair(Field::FromX, Field::FromY, from));
            rows.extend(pair(Field::ToX, Field::ToY, to));
            let length = from.zip(to).map(|(from, to)| Length::from_mm(from.distance_mm(to)));
            rows.push(FieldRow { field: Field::Length, value: FieldValue::Fixed(length) });
            rows
        }
        Some(Thing::Pad { node, .. } | Thing::Hole { node, .. }) => {
            Vec::from(pair(Field::X, Field::Y, drawing.at(*node)))
        }
        Some(Thing::Node { at }) => Vec::from(pair(Field::X, Field::Y, Some(*at))),
        _ if on_one_node(drawing, &editor.chosen).is_some() => {
            Vec::from(pair(Field::X, Field::Y, on_one_node(drawing, &editor.chosen)))
        }
        _ => {
            let bounds = editor.selection().bounds();
            Vec::from(pair(Field::X, Field::Y, bounds.map(|bounds| bounds.min)))
        }
    }
}

/// The node that all of `chosen` share, as a pad and its hole do.
fn on_one_node(drawing: &Drawing, chosen: &BTreeSet<Catch>) -> Option<Point> {
    let node = |catch: &Catch| match catch {
        Catch::Drawn(id) => match drawing.thing(*id)? {
            Thing::Pad { node, .. } | Thing::Hole { node, .. } => Some(*node),
            _ => None,
        },
        Catch::Imported(_) => None,
    };
    drawing.at(shared(chosen.iter().map(node))??)
}

fn sizes(leaves: &[&Thing]) -> Vec<FieldRow> {
    let mut rows = Vec::new();
    let widths: Vec<Length> = leaves
        .iter()
        .filter_map(|thing| if let Thing::Track { width, .. } = thing { Some(*width) } else { None })
        .collect();
    if !widths.is_empty() {
        rows.push(FieldRow { field: Field::Width, value: FieldValue::Length(shared(widths.into_iter())) });
    }
    let pads: Vec<(PadShape, Length, i32)> = leaves
        .iter()
        .filter_map(|thing| match thing {
            Thing::Pad { shape, size, turn_mdeg, .. } => Some((*shape, *size, *turn_mdeg)),
            _ => None,
        })
        .collect();
    if !pads.is_empty() {
        let (shape, size, turn) = (
            shared(pads.iter().map(|pad| pad.0)),
            shared(pads.iter().map(|pad| pad.1)),
            shared(pads.iter().map(|pad| pad.2)),
        );
        rows.push(FieldRow { field: Field::Shape, value: FieldValue::Shape(shape) });
        rows.push(FieldRow { field: Field::Size, value: FieldValue::Length(size) });
        // Rotation has no effect on a round pad.
        if pads.iter().any(|pad| pad.0 != PadShape::Circle) {
            rows.push(FieldRow { field: Field::Turn, value: FieldValue::Turn(turn) });
        }
    }
    let holes: Vec<(Length, bool)> = leaves
        .iter()
        .filter_map(|thing| match thing {
            Thing::Hole { diameter, plated, .. } => Some((*diameter, *plated)),
            _ => None,
        })
        .collect();
    if !holes.is_empty() {
        let (diameter, plated) =
            (shared(holes.iter().map(|hole| hole.0)), shared(holes.iter().map(|hole| hole.1)));
        rows.push(FieldRow { field: Field::Diameter, value: FieldValue::Length(diameter) });
        rows.push(FieldRow { field: Field::Plated, value: FieldValue::Flag(plated) });
    }
    let layers: Vec<Layer> = leaves.iter().filter_map(|thing| thing.layer()).collect();
    if !layers.is_empty() {
        rows.push(FieldRow { field: Field::Layer, value: FieldValue::Layer(shared(layers.into_iter())) });
    }
    rows
}

/// The offset of objects of files, if only such are selected. Also their rotation, if that is visible and no
/// field of a drawn thing shows one already.
fn of_files(editor: &Editor, rows: &[FieldRow]) -> Vec<FieldRow> {
    let finder = editor.finder();
    let one = |catch: &Catch| {
        let one = finder.imported().get(finder.object_of(*catch)? as usize)?;
        Some((one, editor.place_of(*catch)?, editor.turn_of(*catch)))
    };
    let all: Vec<_> = editor.chosen.iter().filter_map(one).collect();
    let mut fields = Vec::new();
    if !all.is_empty() && all.len() == editor.chosen.len() {
        let by = shared(all.iter().map(|(one, now, _)| Point::new(now.x - one.at.x, now.y - one.at.y)));
        fields.push(FieldRow { field: Field::ByX, value: FieldValue::Length(by.map(|by| by.x)) });
        fields.push(FieldRow { field: Field::ByY, value: FieldValue::Length(by.map(|by| by.y)) });
    }
    let is_said = rows.iter().any(|row| row.field == Field::Turn);
    let turns: Vec<i32> =
        all.iter().filter(|(one, ..)| one.has_angle()).map(|(_, _, turn_mdeg)| *turn_mdeg).collect();
    if !turns.is_empty() && !is_said {
        fields.push(FieldRow { field: Field::Turn, value: FieldValue::Turn(shared(turns.into_iter())) });
    }
    fields
}

impl Editor {
    /// Rotation relative to the file, in thousandths of a degree.
    fn turn_of(&self, catch: Catch) -> i32 {
        let placement = self.id_of(catch).and_then(|id| self.drawing().thing(id)?.placement());
        placement.unwrap_or_default().rotation_mdeg
    }
}

/// The edit that a typed value makes; none if the text can't be parsed.
pub fn edit(editor: &Editor, field: Field, text: &str, unit: Unit) -> Option<Edit> {
    let (drawing, ids) = (editor.drawing(), editor.ids());
    match field {
        Field::Name => {
            let group = ids.iter().find(|id| matches!(drawing.thing(**id), Some(Thing::Group { .. })));
            Some(renamed(drawing, group.copied(), text.trim()))
        }
        Field::Group => {
            let group = text.parse::<u32>().ok().map(Id);
            Some(editor.selection().regrouped(group))
        }
        Field::X | Field::Y | Field::ByX | Field::ByY => {
            let now = rows(editor).into_iter().find(|row| row.field == field)?.value;
            let FieldValue::Length(Some(now)) = now else { return None };
            let by = along(matches!(field, Field::X | Field::ByX), meant(text, unit, now)? - now);
            Some(editor.selection().moved(by))
        }
        Field::FromX | Field::FromY | Field::ToX | Field::ToY => {
            let Some(Thing::Track { from, to, .. }) = drawing.thing(*ids.first()?) else { return None };
            let node = if matches!(field, Field::FromX | Field::FromY) { *from } else { *to };
            let at = drawing.at(node)?;
            let at = match field {
                Field::FromX | Field::ToX => Point::new(meant(text, unit, at.x)?, at.y),
                _ => Point::new(at.x, meant(text, unit, at.y)?),
            };
            Some(put(drawing, node, Thing::Node { at }))
        }
        Field::Length => None,
        Field::Turn => {
            let turn_mdeg = degrees(text)?;
            let drawn = of_things(drawing, &ids, field, text, unit)?;
            Some(drawn.then(editor.selection().turned_to(turn_mdeg)))
        }
        _ => of_things(drawing, &ids, field, text, unit),
    }
}

/// The typed value, or `now` if the text still equals `now` as shown. Fields show fewer digits than the
/// drawing has, so an untouched field must not round its value.
fn meant(text: &str, unit: Unit, now: Length) -> Option<Length> {
    let typed = length(text, unit)?;
    Some(if length(&unit.short(now.mm()), unit) == Some(typed) { now } else { typed })
}

fn along(x: bool, by: Length) -> Point {
    if x { Point::new(by, Length::ZERO) } else { Point::new(Length::ZERO, by) }
}

fn of_things(drawing: &Drawing, ids: &BTreeSet<Id>, field: Field, text: &str, unit: Unit) -> Option<Edit> {
    let size = || length(text, unit);
    let new_size = matches!(field, Field::Width | Field::Size | Field::Diameter).then(size).flatten();
    let new_turn = (field == Field::Turn).then(|| degrees(text)).flatten();
    let new_shape = PadShape::ALL.into_iter().find(|shape| shape.word() == text);
    let new_layer = Layer::ALL.into_iter().find(|layer| layer.word() == text);
    let known = match field {
        Field::Turn => new_turn.is_some(),
        Field::Shape => new_shape.is_some(),
        Field::Layer => new_layer.is_some(),
        Field::Plated => matches!(text, "true" | "false"),
        _ => new_size.is_some(),
    };
    if !known {
        return None;
    }
    let mut edit = Edit::default();
    for id in drawing.leaves(ids) {
        let Some(Entry { thing, group }) = drawing.get(id) else { continue };
        let mut next = thing.clone();
        match (&mut next, field) {
            (Thing::Track { width, .. }, Field::Width) => *width = new_size?,
            (Thing::Track { layer, .. } | Thing::Pad { layer, .. }, Field::Layer) => *layer = new_layer?,
            (Thing::Pad { size, .. }, Field::Size) => *size = new_size?,
            (Thing::Pad { shape, turn_mdeg, .. }, Field::Shape) => {
                *shape = new_shape?;
                *turn_mdeg = whole_turn(*shape, *turn_mdeg);
            }
            (Thing::Pad { shape, turn_mdeg, .. }, Field::Turn) => *turn_mdeg = whole_turn(*shape, new_turn?),
            (Thing::Hole { diameter, .. }, Field::Diameter) => *diameter = new_size?,
            (Thing::Hole { plated, .. }, Field::Plated) => *plated = text == "true",
            _ => {}
        }
        if next != *thing {
            edit = edit.then(Edit::one(id, Some(Entry { thing: next, group: *group })));
        }
    }
    Some(edit)
}
