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
    let size = |tool: u16| drill.tools.get(usize::from(tool)).and_then(|tool| tool.diameter).map(Length::mm);
    let sized = drill.hits.iter().take(WINDOW).filter_map(|hit| Some((hit.at, size(hit.tool)?)));
    let mut holes: Vec<_> = sized.collect();
    holes.sort_unstable_by_key(|&(at, _)| at);
    holes.dedup_by_key(|(at, _)| *at);
    let widest_mm = holes.iter().map(|(_, mm)| *mm).fold(0.0, f64::max);
    let mut cut = vec![false; holes.len()];
    for (index, (at, mm)) in holes.iter().enumerate() {
        for (other, (beside, other_mm)) in holes.iter().enumerate().skip(index + 1).take(NEIGHBOURS) {
            if (beside.x - at.x).mm() >= widest_mm {
                break;
            }
            if at.distance_mm(*beside) < 0.5 * (mm + other_mm) {
                for hole in [index, other] {
                    cut.get_mut(hole).into_iter().for_each(|cut| *cut = true);
                }
            }
        }
    }
    let count = cut.iter().filter(|cut| **cut).count();
    count >= FEW && 2 * count > holes.len()
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
