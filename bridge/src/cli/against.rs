//! Compares two versions of a board: `inspect NEW --against OLD`.
//!
//! Unreadable content never fails the comparison: its own inspection reports it.

use super::{ReadingArgs, Refusal, files, rounded};
use annulus_core::board::changes::{BoardChanges, Changed, ChangedCopper, Fate, changes};
use annulus_core::board::{Board, BoardWanted, Hole, Slot, from_artwork_with};
use annulus_core::geometry::{Bounds, Point};
use annulus_core::locale;
use serde_json::{Value, json};
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
        text += &(locale::text("en", "changes.another", &[]) + "\n");
    }
    if found.is_none() {
        text += &(locale::text("en", "changes.none", &[]) + "\n");
    }
    for (key, args) in found.lines() {
        let args: Vec<_> = args.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        text += &(locale::text("en", key, &args) + "\n");
    }
    for hole in &found.holes {
        text += &format!("  {}\n", hole_line(hole));
    }
    Ok((object(&found), text))
}

/// The whole board at `paths`, as far as it can be read.
fn board(paths: &[PathBuf], reading: &ReadingArgs) -> Result<Board, Refusal> {
    let read = files::read_board(paths, reading)?;
    let wanted = BoardWanted { copper: true, aligned: read.said.aligned };
    Ok(from_artwork_with(&read.artwork, &read.used, wanted).0)
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
        "nets": {
            "added": found.nets.added,
            "gone": found.nets.gone,
            "renamed": found.nets.renamed,
        },
    })
}

fn place(at: Point) -> [f64; 2] {
    [rounded(at.x.mm()), rounded(at.y.mm())]
}

fn corners(bounds: Bounds) -> [f64; 4] {
    let ([left, low], [right, high]) = (place(bounds.min), place(bounds.max));
    [left, low, right, high]
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
    json!({ "change": word(changed.fate), "before": before, "now": now })
}

fn hole(hole: &Hole) -> Value {
    let size = hole.diameter.map(|length| rounded(length.mm()));
    json!({ "at_mm": place(hole.at), "diameter_mm": size, "plated": hole.plated })
}

fn slot(slot: &Slot) -> Value {
    let path: Vec<_> = slot.path.iter().map(|at| place(*at)).collect();
    json!({ "path_mm": path, "width_mm": slot.width.map(|length| rounded(length.mm())), "plated": slot.plated })
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
