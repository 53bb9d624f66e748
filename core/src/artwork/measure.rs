//! What the measures of a drill file say against the way its numbers were read.
//!
//! ```text
//! read ten times too large      read ten times too small: the pitch shrinks, the bits do not
//!  o                       o      oooo
//!              o                  oooo
//! ```
//!
//! Comes in: a drill file, read. Goes out: why that can hardly be a board, if so. Knows no other reading.

use super::drill::{Counts, DrillFile, ToolEntry};
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::units::Length;

/// Boards are smaller: no panel that a drill like this takes is as wide.
const LARGE_MM: f64 = 700.0;
/// Boards with [`MANY`] holes are larger.
const SMALL_MM: f64 = 2.0;
/// So few holes prove nothing.
const MANY: usize = 10;
/// So few holes may overlap: two make a slot.
const FEW: usize = 3;
/// Between these, in mm, bits are.
const THINNEST_MM: f64 = 0.08;
const THICKEST_MM: f64 = 20.0;
/// Holes looked at, from the start of the file.
const WINDOW: usize = 5_000;
/// Neighbours of each that are looked at.
const NEIGHBOURS: usize = 64;
/// The same where holes deep inside of others are looked for.
const DEEP_WINDOW: usize = 100_000;
const DEEP_NEIGHBOURS: usize = 500;
/// A row of holes bends by less, as a sine.
const TURN_SINE: f64 = 0.5;

/// What is odd about the holes of a file, as the code of a diagnostic.
pub(super) fn oddity(drill: &DrillFile) -> Option<&'static str> {
    let bounds = drill.centre_bounds()?;
    let size_mm = (bounds.max.x - bounds.min.x).mm().max((bounds.max.y - bounds.min.y).mm());
    if size_mm > LARGE_MM {
        Some("drill.board_large")
    } else if size_mm < SMALL_MM && drill.hits.len() >= MANY {
        Some("drill.board_small")
    } else {
        most_overlap(drill).then_some("drill.holes_overlap")
    }
}

/// What is wrong with the measures of a file whose reading is settled.
pub(super) fn faults(name: &str, drill: &DrillFile, reading: &str) -> Vec<Diagnostic> {
    let odd = oddity(drill).map(|code| odd(name, drill, code, reading, reading));
    odd.into_iter().chain(impossible(name, drill)).collect()
}

/// Says what is odd about the holes of a file, read as `reading` and not as `other`.
pub(super) fn odd(name: &str, drill: &DrillFile, code: &str, reading: &str, other: &str) -> Diagnostic {
    let size = drill.centre_bounds().map_or(String::new(), |bounds| {
        format!("{:.1} × {:.1} mm", (bounds.max.x - bounds.min.x).mm(), (bounds.max.y - bounds.min.y).mm())
    });
    let diagnostic = Diagnostic::error(code).at(name, 0, 0).with("reading", reading);
    diagnostic.with("other", other).with("size", size)
}

/// Says of a tool that no bit is as thin or as thick, and of holes that lie deep inside of others.
pub(super) fn impossible(name: &str, drill: &DrillFile) -> Vec<Diagnostic> {
    let bit = impossible_bit(drill).map(|tool| {
        let size = tool.diameter.map_or(String::new(), |length| format!("{:.3}", length.mm()));
        let diagnostic = Diagnostic::error("drill.impossible_bit").at(name, tool.line, 1);
        diagnostic.with("tool", format!("T{}", tool.code)).with("size", size)
    });
    let inside = holes_inside(drill).filter(|_| oddity(drill).is_none());
    let inside = inside
        .map(|(count, line)| Diagnostic::error("drill.holes_inside").at(name, line, 1).with("count", count));
    bit.into_iter().chain(inside).collect()
}

/// The first tool with work whose size no bit has.
pub(super) fn impossible_bit(drill: &DrillFile) -> Option<&ToolEntry> {
    let used = drill.tools.iter().zip(drill.counts()).filter(|(_, counts)| *counts != Counts::default());
    let sized = |tool: &ToolEntry| {
        tool.diameter.is_none_or(|length| (THINNEST_MM..=THICKEST_MM).contains(&length.mm()))
    };
    used.map(|(tool, _)| tool).find(|tool| !sized(tool))
}

/// Whether more than half of the holes cut into another one beside them. Holes drilled twice in one place do not count.
fn most_overlap(drill: &DrillFile) -> bool {
    let holes = sized(drill, WINDOW);
    let mut cut = vec![false; holes.len()];
    near(&holes, NEIGHBOURS, |a, b, (one, other)| {
        if one.at.distance_mm(other.at) < 0.5 * (one.mm + other.mm) {
            for hole in [a, b] {
                cut.get_mut(hole).into_iter().for_each(|cut| *cut = true);
            }
        }
    });
    let count = cut.iter().filter(|cut| **cut).count();
    count >= FEW && 2 * count > holes.len()
}

/// How many holes lie deep inside of others, and the line of the first of them. Holes in a row make a slot: they do not count.
///
/// ```text
///   (((((( a slot        ((●)) two sizes in one place, or a heap
/// ```
fn holes_inside(drill: &DrillFile) -> Option<(usize, u32)> {
    let holes = sized(drill, DEEP_WINDOW);
    let mut deep = vec![false; holes.len()];
    // Where the first neighbour of its own size lies that a hole is deep inside of.
    let mut beside: Vec<Option<Point>> = vec![None; holes.len()];
    near(&holes, DEEP_NEIGHBOURS, |a, b, (one, other)| {
        if one.at.distance_mm(other.at) >= 0.5 * one.mm.max(other.mm) {
            return;
        }
        for (hole, from, to) in [(a, one.at, other.at), (b, other.at, one.at)] {
            let (Some(deep), Some(beside)) = (deep.get_mut(hole), beside.get_mut(hole)) else { continue };
            let first = *beside.get_or_insert(to);
            *deep |= one.mm.to_bits() != other.mm.to_bits() || turns(from, first, to);
        }
    });
    let found = || holes.iter().zip(&deep).filter(|(_, deep)| **deep).map(|(hole, _)| hole.line);
    Some((found().count(), found().min()?)).filter(|(count, _)| *count >= FEW)
}

/// Whether the ways from a place to two others are not along one line.
fn turns(from: Point, one: Point, other: Point) -> bool {
    let way = |to: Point| ((to.x - from.x).mm(), (to.y - from.y).mm());
    let ((ax, ay), (bx, by)) = (way(one), way(other));
    (ax * by - ay * bx).abs() > TURN_SINE * libm::sqrt((ax * ax + ay * ay) * (bx * bx + by * by))
}

/// A hole whose size is known.
#[derive(Clone, Copy)]
struct Round {
    at: Point,
    mm: f64,
    line: u32,
}

/// The first holes of a file that have a size, by place; those that are drilled twice by bits of one size once.
fn sized(drill: &DrillFile, most: usize) -> Vec<Round> {
    let size = |tool: u16| drill.tools.get(usize::from(tool)).and_then(|tool| tool.diameter).map(Length::mm);
    let sized = drill.hits.iter().take(most);
    let sized = sized.filter_map(|hit| Some(Round { at: hit.at, mm: size(hit.tool)?, line: hit.line }));
    let mut holes: Vec<Round> = sized.collect();
    holes.sort_by(|a, b| a.at.cmp(&b.at).then(a.mm.total_cmp(&b.mm)));
    holes.dedup_by(|a, b| a.at == b.at && a.mm.to_bits() == b.mm.to_bits());
    holes
}

/// Gives every pair of holes that may touch to `pair`, with their numbers, but of each hole only `most`.
fn near(holes: &[Round], most: usize, mut pair: impl FnMut(usize, usize, (Round, Round))) {
    let widest_mm = holes.iter().map(|hole| hole.mm).fold(0.0, f64::max);
    for (index, hole) in holes.iter().enumerate() {
        for (other, beside) in holes.iter().enumerate().skip(index + 1).take(most) {
            if (beside.at.x - hole.at.x).mm() >= widest_mm {
                break;
            }
            pair(index, other, (*hole, *beside));
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::artwork::{FileRead, read_drill};
    use crate::diagnostic::Severity;

    /// A grid of 5 × 4 holes of 0.8 mm, `pitch` last digits apart.
    fn grid(header: &str, pitch: u32) -> FileRead {
        let mut text = format!("{header}T1\n");
        for hole in 1..=20 {
            text.push_str(&format!("X{:08}Y{:08}\n", hole % 5 * pitch, hole / 5 * pitch));
        }
        read_drill("grid.drl", format!("{text}M30\n").as_bytes())
    }

    fn codes(file: &FileRead, severity: Severity) -> Vec<&str> {
        file.diagnostics
            .iter()
            .filter(|diagnostic| diagnostic.severity == severity)
            .map(|diagnostic| &*diagnostic.code)
            .collect()
    }

    #[test]
    fn what_the_file_states_is_believed_and_a_error_where_it_makes_no_board() {
        for (header, pitch, warning) in [
            ("M48\nMETRIC,000.000\nT1C0.8\n%\n", 2_540, None),
            ("M48\nMETRIC,000.000\nT1C0.8\n%\n", 254_000, Some("drill.board_large")),
            ("M48\nMETRIC,000.000\nT1C0.8\n%\n", 254, Some("drill.board_small")),
            ("M48\nMETRIC,000.000\nT1C0.8\n%\n", 700, Some("drill.holes_overlap")),
            ("M48\nMETRIC,000.000\nT1C0.8\n%\n", 810, None),
        ] {
            let file = grid(header, pitch);
            let width = file.drill.as_ref().unwrap().centre_bounds().unwrap().max.x;
            assert_eq!(width.nm(), i64::from(pitch) * 4_000, "{pitch}");
            let odd = ["drill.board_large", "drill.board_small", "drill.holes_overlap"];
            let found = codes(&file, Severity::Error).into_iter().find(|code| odd.contains(code));
            assert_eq!(found, warning, "{pitch}: {:?}", file.diagnostics);
        }
    }

    #[test]
    fn of_readings_that_nothing_states_one_that_makes_a_board_is_preferred() {
        // Inch 3.5 without a word about it: 2.4 would make a board of 1 m.
        let file = grid("M48\nINCH\nT1C0.0315\n%\n", 100_000);
        let bounds = file.drill.as_ref().unwrap().centre_bounds().unwrap();
        assert_eq!(bounds.max.x.mm(), 101.6);
        assert!(codes(&file, Severity::Error).contains(&"drill.read_by_measure"), "{:?}", file.diagnostics);
    }

    #[test]
    fn where_no_reading_makes_a_board_a_job_cannot_start_unseen() {
        // Two columns far apart, of holes that nearly touch: too wide, or else overlapping.
        let mut text = String::from("M48\nINCH\nT1C0.0315\n%\nT1\n");
        for hole in 0..20 {
            text.push_str(&format!("X{:08}Y{:08}\n", hole % 2 * 3_900_000, hole * 20));
        }
        let file = read_drill("wide.drl", format!("{text}M30\n").as_bytes());
        assert!(codes(&file, Severity::Error).contains(&"drill.board_large"), "{:?}", file.diagnostics);
    }
}
