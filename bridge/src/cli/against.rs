//! Compares two versions of a board: `inspect NEW --against OLD`.
//!
//! Unreadable content never fails the comparison: its own inspection reports it.

use super::{ReadingArgs, Refusal, files, mm, rounded, sentence};
use annulus_core::board::changes::{BoardChanges, Changed, ChangedCopper, Fate, changes};
use annulus_core::board::{Board, Hole, Slot};
use annulus_core::geometry::{Bounds, Point};
use serde_json::{Value, json};
use std::fmt::Display;
use std::path::PathBuf;

/// Changes from the board at `old` to the board at `new`, as JSON and as text.
pub(crate) fn compare(
    new: &[PathBuf],
    old: &[PathBuf],
    reading: &ReadingArgs,
) -> Result<(Value, String), Refusal> {
    let found = changes(&board(old, reading)?, &board(new, reading)?);
    let mut text = String::new();
    if found.may_be_another() {
        text += &(sentence("changes.another", &[]) + "\n");
    }
    if found.is_none() {
        text += &(sentence("changes.none", &[]) + "\n");
    }
    for (key, args) in found.lines() {
        let args: Vec<_> = args.iter().map(|(name, value)| (*name, value as &dyn Display)).collect();
        text += &(sentence(key, &args) + "\n");
    }
    for hole in &found.holes {
        text += &format!("  {}\n", hole_line(hole));
    }
    Ok((object(&found), text))
}

/// The whole board at `paths`, as far as it can be read.
fn board(paths: &[PathBuf], reading: &ReadingArgs) -> Result<Board, Refusal> {
    files::read_board(paths, reading).map(|read| read.board(true).0)
}

fn object(found: &BoardChanges) -> Value {
    json!({
        "same": found.is_none(),
        "may_be_another_board": found.may_be_another(),
        "shift_mm": place(found.shift),
        "unchanged": found.same,
        "holes": found.holes.iter().map(|one| changed(one, hole)).collect::<Vec<_>>(),
        "slots": found.slots.iter().map(|one| changed(one, slot)).collect::<Vec<_>>(),
        "copper": found.copper.iter().map(copper).collect::<Vec<_>>(),
        "outline": found.outline.map(|boxes| json!({ "before_mm": boxes[0].map(corners), "now_mm": boxes[1].map(corners) })),
        "nets": found.nets,
    })
}

fn place(at: Point) -> [f64; 2] {
    [mm(at.x), mm(at.y)]
}

/// Left, low, right and high.
pub(super) fn corners(bounds: Bounds) -> [f64; 4] {
    [bounds.min.x, bounds.min.y, bounds.max.x, bounds.max.y].map(mm)
}

fn word(fate: Fate) -> &'static str {
    match fate {
        Fate::Added => "added",
        Fate::Gone => "gone",
        Fate::Moved => "moved",
        Fate::Resized => "resized",
        Fate::Replated => "replated",
    }
}

/// A changed hole or slot, each version written by `one`.
fn changed<T>(changed: &Changed<T>, one: impl Fn(&T) -> Value) -> Value {
    let (before, now) = (changed.before.as_ref().map(&one), changed.now.as_ref().map(&one));
    json!({ "change": changed.fate, "before": before, "now": now })
}

fn hole(hole: &Hole) -> Value {
    json!({ "at_mm": place(hole.at), "diameter_mm": hole.diameter.map(mm), "plated": hole.plated })
}

fn slot(slot: &Slot) -> Value {
    let path: Vec<_> = slot.path.iter().map(|at| place(*at)).collect();
    json!({ "path_mm": path, "width_mm": slot.width.map(mm), "plated": slot.plated })
}

fn copper(side: &ChangedCopper) -> Value {
    json!({
        "side": side.face.name(),
        "added_mm2": rounded(side.added_mm2),
        "gone_mm2": rounded(side.gone_mm2),
        "islands_before": side.islands[0],
        "islands_now": side.islands[1],
    })
}

/// `moved  0.800 mm  X 1.000 Y 2.000 → X 3.000 Y 2.000`.
fn hole_line(changed: &Changed<Hole>) -> String {
    let at = |hole: &Hole| format!("X {:.3} Y {:.3}", hole.at.x.mm(), hole.at.y.mm());
    let size = |hole: &Hole| hole.diameter.map_or("?".to_owned(), |length| format!("{:.3} mm", length.mm()));
    let said = |hole: &Hole| format!("{}  {}", size(hole), at(hole));
    let both = match (&changed.before, &changed.now) {
        (Some(before), Some(now)) => format!("{} → {}", said(before), said(now)),
        (Some(one), None) | (None, Some(one)) => said(one),
        (None, None) => String::new(),
    };
    format!("{:<9}{both}", word(changed.fate))
}
