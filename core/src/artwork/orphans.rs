//! Layers that may be copper without clear evidence, or whose side isn't known: used, or asked about, but
//! never dropped silently.
//!
//! ```text
//!   its pads are those of a known copper, but wider ─▶ mask
//!   both sides have their copper                    ─▶ left out: the user accepts it
//!   one side has no copper                          ─▶ used for it, and asked
//!   two layers for two sides, indistinguishable     ─▶ asked
//! ```

use super::companion::base;
use super::layer_shape::{SAME_SHARE, Shape, WIDER_MM};
use super::names::is_end_of_path;
use super::role::{Contradiction, Ground, Layers, Row};
use super::{Artwork, FileRead, Role, Side};
use crate::diagnostic::{Diagnostic, Severity};
use crate::{code, note};

/// Codes of questions about a layer. The user answers one by setting the layer's role.
pub(super) const QUESTIONS: [&str; 11] = [
    code!("set.side_disputed"),
    code!("set.only_copper"),
    code!("set.pads_alone"),
    code!("set.misses_holes"),
    code!("set.drawn_as_opening"),
    code!("set.side_guessed"),
    code!("set.side_by_pads"),
    code!("set.side_unknown"),
    code!("set.copper_left_out"),
    code!("set.better_layer"),
    code!("set.two_layers"),
];

/// One side's pads must fit better by this share than the other's.
const CLEARLY_SHARE: f64 = 0.2;

impl Artwork {
    /// Sets the role of the layer `name` as stated by the user. No effect on files that are not layers.
    pub fn say_role(&mut self, name: &str, role: Role, side: Option<Side>) {
        let layers = self.files.iter_mut().filter(|file| file.gerber.is_some() && file.name == name);
        for file in layers {
            (file.role, file.side) = (role, side);
            file.reason = note!("kind.person");
            file.diagnostics.retain(|said| !QUESTIONS.contains(&said.code.as_str()));
        }
    }
}

fn file<'l>(layers: &'l Layers, row: &Row) -> Option<&'l FileRead> {
    layers.get(row.index)?.as_ref()
}

fn asked(file: &mut FileRead, severity: Severity, code: &str) {
    let side = file.side.map_or("", Side::name);
    let question = Diagnostic::new(severity, code).at(&file.name, 0, 0).with("file", base(&file.name));
    file.diagnostics.push(question.with("side", side).with("role", file.role.name()));
}

/// A layer that lost its side to a better one, whose shape is `winner`.
pub(super) fn lost(file: &mut FileRead, row: &Row, winner: Option<&Shape>) {
    let shapes = row.shape.as_ref().zip(winner);
    if shapes.is_some_and(|(own, winner)| own.covers(winner)) {
        return set_opening(file, shapes);
    }
    file.role = Role::Other;
    let left =
        shapes.is_some_and(|(own, winner)| own.may_be_copper(own.has_holes, true) && !own.is_same(winner));
    let (severity, code) = if left {
        (Severity::Error, code!("set.copper_left_out"))
    } else {
        (Severity::Note, code!("set.better_layer"))
    };
    asked(file, severity, code);
}

/// Sets a pads-only layer over copper to mask if it has openings at the holes or wider pads, else to paste.
fn set_opening(file: &mut FileRead, shapes: Option<(&Shape, &Shape)>) {
    let is_mask = shapes.is_some_and(|(own, copper)| own.opens_holes(copper));
    file.role = if is_mask { Role::Mask } else { Role::Paste };
    file.reason = note!("kind.gerber_shape", role = file.role.name()).with("found", base(&file.name));
}

/// Determines the side of layers that may be copper, or asks.
pub(super) fn settle(layers: &mut Layers, rows: &mut [Row]) {
    reclassify_misnamed(layers, rows);
    openings(layers, rows);
    let open: Vec<usize> =
        (0..rows.len()).filter(|&at| rows.get(at).is_some_and(|row| is_open(layers, rows, row))).collect();
    for &at in &open {
        let Some(row) = rows.get(at) else { continue };
        let kin: Vec<&Row> =
            open.iter().filter_map(|&at| rows.get(at)).filter(|other| other.is_kin(row)).collect();
        let (side, severity, code) = answer(layers, rows, row, &kin);
        if let Some(file) = layers.get_mut(row.index).and_then(Option::as_mut) {
            if code != code!("set.copper_left_out") {
                (file.role, file.side) = (Role::Copper, side);
            }
            asked(file, severity, code);
        }
    }
    unsure(layers, rows);
}

/// Changes a layer named copper to mask or paste if it covers the pads of an unnamed layer that is drawn like
/// copper.
fn reclassify_misnamed(layers: &mut Layers, rows: &[Row]) {
    let is = |layers: &Layers, row: &Row, role: Role| file(layers, row).is_some_and(|file| file.role == role);
    for row in rows.iter().filter(|row| row.ground <= Ground::Names) {
        let Some(shape) = row.shape.as_ref().filter(|_| is(layers, row, Role::Copper)) else { continue };
        let copper = rows.iter().filter(|other| other.is_kin(row) && other.ground == Ground::Nothing);
        let copper = copper.filter(|other| is(layers, other, Role::Other));
        let mut copper = copper.filter_map(|other| other.shape.as_ref()).filter(|other| other.joined);
        let Some(copper) = copper.find(|copper| shape.covers(copper)) else { continue };
        if let Some(file) = layers.get_mut(row.index).and_then(Option::as_mut) {
            set_opening(file, Some((shape, copper)));
        }
    }
}

/// Changes unknown layers that cover copper to mask or paste.
fn openings(layers: &mut Layers, rows: &[Row]) {
    for row in rows {
        let Some(shape) = row.shape.as_ref().filter(|_| row.ground == Ground::Nothing) else { continue };
        let copper = rows.iter().filter(|other| other.index != row.index && other.is_kin(row));
        let copper = copper.filter(|other| {
            file(layers, other).is_some_and(|file| matches!(file.role, Role::Copper | Role::Other))
        });
        let mut copper = copper.filter_map(|other| other.shape.as_ref()).filter(|other| other.joined);
        let Some(copper) = copper.find(|copper| shape.covers(copper)) else { continue };
        if let Some(file) =
            layers.get_mut(row.index).and_then(Option::as_mut).filter(|file| file.role == Role::Other)
        {
            set_opening(file, Some((shape, copper)));
        }
    }
}

/// True for copper without a side, and for a layer that may be copper without evidence.
fn is_open(layers: &Layers, rows: &[Row], row: &Row) -> bool {
    let Some(own) = file(layers, row) else { return false };
    if own.role == Role::Copper {
        return own.side.is_none();
    }
    let Some(shape) = row.shape.as_ref().filter(|_| !matches!(own.role, Role::Outline | Role::Drill)) else {
        return false;
    };
    if own.diagnostics.iter().any(|said| QUESTIONS.contains(&said.code.as_str())) {
        return false;
    }
    // If the board has copper, or a layer drawn like it, pads alone are weak evidence.
    let mut others = rows.iter().filter(|other| other.is_kin(row) && other.index != row.index);
    let known = others.any(|other| {
        let is_joined =
            other.ground == Ground::Nothing && other.shape.as_ref().is_some_and(|shape| shape.joined);
        let role = file(layers, other).map(|file| file.role);
        role == Some(Role::Copper) || role == Some(Role::Other) && is_joined
    });
    match row.ground {
        Ground::Attribute => false,
        Ground::Nothing => own.role == Role::Other && shape.may_be_copper(shape.has_holes, known),
        Ground::Names | Ground::Content if own.role != Role::Other => false,
        // A name that means something else is believed if the board has copper.
        _ => !known && shape.joined && shape.has_holes && shape.under_holes_share >= SAME_SHARE,
    }
}

/// The side of a layer, one of `open` without a side, and the message about it.
fn answer(layers: &Layers, rows: &[Row], row: &Row, open: &[&Row]) -> (Option<Side>, Severity, &'static str) {
    let taken = |side: Side| {
        let mut others = rows.iter().filter(|other| other.is_kin(row) && other.index != row.index);
        others.any(|other| {
            let is_open = open.iter().any(|open| open.index == other.index);
            !is_open
                && file(layers, other)
                    .is_some_and(|file| (file.role, file.side) == (Role::Copper, Some(side)))
        })
    };
    let free: Vec<Side> = [Side::Top, Side::Bottom].into_iter().filter(|&side| !taken(side)).collect();
    let fits = by_pads(layers, rows, row).filter(|side| free.contains(side));
    let others_fit =
        || open.iter().filter(|other| other.index != row.index).map(|other| by_pads(layers, rows, other));
    // A name can give the side even if the role is unknown.
    let named = file(layers, row).and_then(|file| file.side);
    match (free.as_slice(), open.len(), fits) {
        ([], ..) => (None, Severity::Error, code!("set.copper_left_out")),
        _ if named.is_some_and(|side| free.contains(&side)) => {
            (named, Severity::Error, code!("set.side_guessed"))
        }
        (_, 1, Some(side)) => (Some(side), Severity::Warning, code!("set.side_by_pads")),
        (_, 2, Some(side)) if others_fit().all(|other| other.is_some_and(|other| other != side)) => {
            (Some(side), Severity::Warning, code!("set.side_by_pads"))
        }
        ([side], 1, None) => (Some(*side), Severity::Error, code!("set.side_guessed")),
        (_, 1, None) => (Some(Side::Top), Severity::Error, code!("set.only_copper")),
        _ => (None, Severity::Error, code!("set.side_unknown")),
    }
}

/// The side whose masks and paste fit the layer's pads clearly better than the other side's. Ignores pads
/// with holes, because these are on both sides.
fn by_pads(layers: &Layers, rows: &[Row], row: &Row) -> Option<Side> {
    let shape = row.shape.as_ref()?;
    let share = |side: Side| {
        let of_side = |other: &&Row| {
            file(layers, other)
                .is_some_and(|file| matches!(file.role, Role::Mask | Role::Paste) && file.side == Some(side))
        };
        let openings = rows.iter().filter(|other| other.is_kin(row)).filter(of_side);
        let shapes =
            openings.filter_map(|other| other.shape.as_ref()).filter(|other| !other.is_drawn_as_copper());
        shapes.filter_map(|other| other.surface_share(shape)).reduce(f64::min)
    };
    // Without holes, surface pads cannot be distinguished from through-hole pads.
    let alone = |share: f64| shape.has_holes && share >= SAME_SHARE;
    match (share(Side::Top), share(Side::Bottom)) {
        (Some(top), None) if alone(top) => Some(Side::Top),
        (None, Some(bottom)) if alone(bottom) => Some(Side::Bottom),
        (Some(top), Some(bottom)) if top >= bottom + CLEARLY_SHARE => Some(Side::Top),
        (Some(top), Some(bottom)) if bottom >= top + CLEARLY_SHARE => Some(Side::Bottom),
        _ => None,
    }
}

/// Asks about sides that are only guessed from a name, unless there is one such layer for each side, or the
/// pads confirm it.
fn unsure(layers: &mut Layers, rows: &[Row]) {
    let guessed = |layers: &Layers, row: &Row, of: Side| {
        row.unsure && file(layers, row).is_some_and(|file| (file.role, file.side) == (Role::Copper, Some(of)))
    };
    for row in rows {
        let Some(side) = file(layers, row).and_then(|file| file.side) else { continue };
        if !guessed(layers, row, side) || by_pads(layers, rows, row) == Some(side) {
            continue;
        }
        let other = if side == Side::Top { Side::Bottom } else { Side::Top };
        let count =
            |of: Side| rows.iter().filter(|other| other.is_kin(row) && guessed(layers, other, of)).count();
        let is_pair = side != Side::Inner && (count(side), count(other)) == (1, 1);
        if let Some(file) = layers.get_mut(row.index).and_then(Option::as_mut).filter(|_| !is_pair) {
            asked(file, Severity::Error, code!("set.side_guessed"));
        }
    }
}

/// Reports layers named copper whose drawing contradicts it. Silent for a mask or paste if its side has other
/// copper.
pub(super) fn report_contradictions(layers: &mut Layers, rows: &[Row]) {
    for row in rows {
        let Some(contradiction) = row.contradiction else { continue };
        let has = |side: Side| {
            let mut kin = rows.iter().filter(|other| other.index != row.index && other.is_kin(row));
            kin.any(|other| {
                file(layers, other).is_some_and(|file| (file.role, file.side) == (Role::Copper, Some(side)))
            })
        };
        let is_used = file(layers, row).is_some_and(|file| file.role == Role::Copper);
        let code = match contradiction {
            Contradiction::PadsAlone => is_used.then_some(code!("set.pads_alone")),
            Contradiction::MissesHoles => is_used.then_some(code!("set.misses_holes")),
            Contradiction::Nothing => Some(code!("set.copper_left_out")),
            Contradiction::Opening(side) => {
                let is_taken = side.map_or_else(|| has(Side::Top) && has(Side::Bottom), has);
                (!is_taken && !is_used).then_some(code!("set.drawn_as_opening"))
            }
        };
        if let Some((file, code)) = layers.get_mut(row.index).and_then(Option::as_mut).zip(code) {
            asked(file, Severity::Error, code);
        }
    }
}

/// Reports layers drawn like copper but named differently, unless a copper layer has the same drawing.
pub(super) fn report_unused_copper(layers: &mut Layers, rows: &[Row]) {
    for row in rows.iter().filter(|row| row.ground < Ground::Attribute) {
        let Some(shape) = row.shape.as_ref().filter(|shape| shape.is_drawn_as_copper()) else { continue };
        let has = |side: Side| {
            let mut kin = rows.iter().filter(|other| other.is_kin(row));
            kin.any(|other| {
                file(layers, other).is_some_and(|file| (file.role, file.side) == (Role::Copper, Some(side)))
            })
        };
        let has_both = has(Side::Top) && has(Side::Bottom);
        let is_other = |file: &FileRead| {
            let asked = file.diagnostics.iter().any(|said| QUESTIONS.contains(&said.code.as_str()));
            // With the copper of both sides known, a drill layer or an outline with pads is no lost copper.
            let is_believed =
                matches!(file.role, Role::Outline | Role::Drill) && (has_both || file.drill.is_some());
            !asked && file.role != Role::Copper && !is_believed
        };
        let is_known = |copper: &Shape| {
            let (share, wider_mm) = shape.compared(copper);
            shape.is_same(copper) || share >= SAME_SHARE && wider_mm >= WIDER_MM
        };
        let copper =
            rows.iter().filter(|other| file(layers, other).is_some_and(|file| file.role == Role::Copper));
        if copper.filter_map(|other| other.shape.as_ref()).any(is_known) {
            continue;
        }
        if let Some(file) = layers.get_mut(row.index).and_then(Option::as_mut).filter(|file| is_other(file)) {
            asked(file, Severity::Error, code!("set.copper_left_out"));
        }
    }
}

/// Reports copper whose side is disputed between two reasons.
pub(super) fn report_disputed_sides(layers: &mut Layers, rows: &[Row]) {
    // If there is a layer 0, numbers don't count from 1.
    let from_zero = |row: &Row| rows.iter().any(|other| other.number == Some(0) && other.is_kin(row));
    let disputed = |row: &&Row| row.is_disputed || row.is_numbered_otherwise && !from_zero(row);
    for row in rows.iter().filter(disputed) {
        let file = layers.get_mut(row.index).and_then(Option::as_mut);
        if let Some(file) = file.filter(|file| file.role == Role::Copper && file.side.is_some()) {
            asked(file, Severity::Error, code!("set.side_disputed"));
        }
    }
}

/// Shortens file names in questions to the unique end of the path.
pub(super) fn shorten_names(layers: &mut Layers) {
    let names: Vec<String> = layers.iter().flatten().map(|file| file.name.clone()).collect();
    for file in layers.iter_mut().flatten() {
        let own = unique_end(&file.name, &names);
        let questions = file.diagnostics.iter_mut().filter(|said| QUESTIONS.contains(&said.code.as_str()));
        for (_, value) in questions.flat_map(|said| &mut said.args).filter(|(key, _)| key == "file") {
            own.clone_into(value);
        }
    }
}

fn unique_end<'n>(name: &'n str, names: &[String]) -> &'n str {
    let starts = name.rmatch_indices(['/', '\\']).map(|(at, _)| at + 1);
    let mut ends = starts.filter_map(|at| name.get(at..));
    let is_alone = |end: &&str| names.iter().filter(|other| is_end_of_path(other, end)).count() < 2;
    ends.find(is_alone).unwrap_or(name)
}
