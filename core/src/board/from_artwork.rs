//! The board that chosen drill files and drill layers describe.
//!
//! Comes in: an [`Artwork`] and which of its files to use. Goes out: a [`Board`] and the remarks of those files. Knows
//! no words of any format; arcs become chords here.

use super::outline::{contours, nest, shut};
use super::{Board, Hole, Slot, copper};
use crate::artwork::{Artwork, DrillFile, FileRead, Role, ToolEntry};
use crate::geometry::{Bounds, Placement, Point, Segment, chords};
use crate::remark::{Remark, Weight};
use crate::units::Length;

/// How far a chord may be from its arc, in mm.
const CHORD_ERROR_MM: f64 = 0.005;
/// Copper may reach this far beyond the outline before the two are said to lie apart.
const OVERHANG: Length = Length::from_um(2_000);

/// What a board shall have besides its holes and its outline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// The copper of both sides, painted: this takes time. Then holes that do not lie on it are a doubt.
    pub copper: bool,
    /// Layers that do not share the copper's zero point moved to where they fit it. Nobody moves them unasked: a person is
    /// told of the shift and chooses.
    pub aligned: bool,
}

/// Makes the board of the files at `used`, without copper and with everything where its file puts it.
pub fn from_artwork(artwork: &Artwork, used: &[usize]) -> (Board, Vec<Remark>) {
    from_artwork_with(artwork, used, Wanted::default())
}

/// Makes the board of the files at `used`. What has neither holes nor copper among them adds nothing. The
/// remarks are those of the files used, and those of the board itself.
pub fn from_artwork_with(artwork: &Artwork, used: &[usize], wanted: Wanted) -> (Board, Vec<Remark>) {
    let mut board = Board::default();
    let mut remarks = Vec::new();
    for file in used.iter().filter_map(|&index| artwork.files.get(index)) {
        // A drill layer that a person takes for something else makes no holes.
        let Some(drill) = file.drill.as_ref().filter(|_| file.role == Role::Drill) else { continue };
        let source = board.sources.len() as u32;
        board.sources.push(file.name.clone());
        remarks.extend(file.remarks.iter().cloned());
        let (holes, slots) = (board.holes.len(), board.slots.len());
        add(&mut board, file, drill, source);
        let apart = shift(file);
        if let Some(by) = apart.filter(|_| wanted.copper && !wanted.aligned) {
            remarks.push(Remark { weight: Weight::Doubt, ..told("board.holes_shifted", &file.name, by) });
        }
        if let Some(by) = apart.filter(|_| wanted.aligned) {
            board.holes.iter_mut().skip(holes).for_each(|hole| hole.at = moved(hole.at, by));
            let points = board.slots.iter_mut().skip(slots).flat_map(|slot| &mut slot.path);
            points.for_each(|point| *point = moved(*point, by));
            remarks.push(told("board.moved", &file.name, by));
        }
    }
    board.slots.sort_by_key(|slot| (slot.source, slot.line));
    board.name = board.sources.first().map(|name| short(name)).unwrap_or_default();
    outline(&mut board, artwork, used, wanted, &mut remarks);
    if wanted.copper {
        copper::add(&mut board, artwork, used, &mut remarks);
        if board.holes.is_empty() && board.slots.is_empty() && !board.copper.is_empty() {
            remarks.push(Remark::new(Weight::Note, "board.no_holes"));
        }
    }
    (board, remarks)
}

/// What has to be added to the holes of a file so that they lie on the copper beside it; none where they do.
fn shift(file: &FileRead) -> Option<Point> {
    let (x, y) = file.evidence.as_ref()?.shift_mm?;
    Some(Point::from_mm(x, y))
}

fn moved(point: Point, by: Point) -> Point {
    Point::new(point.x + by.x, point.y + by.y)
}

fn told(code: &str, name: &str, by: Point) -> Remark {
    let mm = |length: Length| format!("{:+.3}", length.mm());
    Remark::new(Weight::Note, code).at(name, 0, 0).with("x", mm(by.x)).with("y", mm(by.y))
}

fn add(board: &mut Board, file: &FileRead, drill: &DrillFile, source: u32) {
    let nameless = ToolEntry { code: 0, diameter: None, plated: None, line: 0 };
    let tool = |index: u16| drill.tools.get(usize::from(index)).unwrap_or(&nameless);
    board.holes.reserve(drill.hits.len());
    for hit in &drill.hits {
        let tool = tool(hit.tool);
        let plated = tool.plated.or(file.plated);
        board.holes.push(Hole {
            at: hit.at,
            diameter: tool.diameter,
            plated,
            source,
            tool_code: tool.code,
            line: hit.line,
        });
    }
    let slot = |index: u16, path: Vec<Point>, line: u32| {
        let tool = tool(index);
        let plated = tool.plated.or(file.plated);
        Slot { path, width: tool.diameter, plated, source, tool_code: tool.code, line }
    };
    board.slots.extend(drill.slots.iter().map(|row| slot(row.tool, vec![row.from, row.to], row.line)));
    for route in &drill.routes {
        let mut path = vec![route.from];
        for segment in &route.segments {
            let from = path.last().copied().unwrap_or(route.from);
            match *segment {
                Segment::Line { to } => path.push(to),
                Segment::Arc { to, centre, clockwise } => {
                    path.extend(chords::arc(from, to, centre, clockwise, CHORD_ERROR_MM));
                }
            }
        }
        board.slots.push(slot(route.tool, path, route.line));
    }
}

/// The first outline layer whose lines close gives the outline. Lines of it that lead nowhere are remarked, and so is
/// copper beyond it: then outline and copper do not share their zero point. Where the holes do not either, and the same
/// shift puts the outline around the copper, it can be moved with them.
fn outline(board: &mut Board, artwork: &Artwork, used: &[usize], wanted: Wanted, remarks: &mut Vec<Remark>) {
    let layers = |role| artwork.files.iter().filter(move |file| file.role == role);
    for file in layers(Role::Outline) {
        let Some(gerber) = &file.gerber else { continue };
        let (mut closed, open) = contours(&gerber.strokes());
        closed.extend(gerber.contours().into_iter().map(shut));
        if open > 0 {
            let code = if closed.is_empty() { "board.outline_open" } else { "board.outline_rest" };
            remarks.push(Remark::new(Weight::Doubt, code).at(&file.name, 0, 0).with("count", open));
        }
        board.outline = nest(closed);
        let Some(bounds) = board.outline.bounds() else { continue };
        let copper = layers(Role::Copper).filter_map(|file| file.gerber.as_ref()?.centre_bounds());
        let Some(copper) = copper.reduce(|a, b| a.with(b.min).with(b.max)) else { return };
        let around = |by: Point| {
            let bounds = Bounds { min: moved(bounds.min, by), max: moved(bounds.max, by) }.grown(OVERHANG);
            bounds.contains(copper.min) && bounds.contains(copper.max)
        };
        if around(Point::default()) {
            return;
        }
        let mut shifts = used.iter().filter_map(|&index| shift(artwork.files.get(index)?));
        match shifts.find(|&by| around(by)) {
            Some(by) if wanted.aligned => {
                board.outline = Placement::shifted(by).region(&board.outline);
                remarks.push(told("board.moved", &file.name, by));
            }
            Some(by) => remarks.push(told("board.outline_shifted", &file.name, by)),
            None => remarks.push(Remark::new(Weight::Doubt, "board.outline_elsewhere").at(&file.name, 0, 0)),
        }
        return;
    }
}

/// A name for people: the last part of a path, without its ending.
fn short(name: &str) -> String {
    let base = name.rsplit(['/', '\\']).next().unwrap_or(name);
    base.rsplit_once('.').map_or(base, |(stem, _)| stem).to_owned()
}

impl Board {
    /// The box around all holes and slots at their full size; those without a size count as points.
    pub fn outer_bounds(&self) -> Option<Bounds> {
        let holes = self.holes.iter().map(|hole| (hole.at, hole.diameter));
        let slots = self.slots.iter().flat_map(|slot| slot.path.iter().map(|&point| (point, slot.width)));
        holes.chain(slots).fold(None, |bounds: Option<Bounds>, (point, size)| {
            let radius = Length::from_nm(size.map_or(0, |size| size.nm() / 2));
            let around = Bounds::of(point).grown(radius);
            Some(bounds.map_or(around, |bounds| bounds.with(around.min).with(around.max)))
        })
    }
}
