//! Plausibility of a drill file's dimensions: signs that its numbers were read at the wrong scale.
//!
//! ```text
//! read ten times too large      read ten times too small: the pitch shrinks, the tools don't
//!  o                       o      oooo
//!              o                  oooo
//! ```

use crate::artwork::drill::{Counts, DrillFile, ToolEntry};
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::units::Length;
use crate::{code, error};

/// Boards are smaller than this; no panel for such a machine is as wide.
const LARGE_MM: f64 = 700.0;
/// Boards with at least [`MANY`] holes are larger than this.
const SMALL_MM: f64 = 2.0;
const MANY: usize = 10;
/// Fewer overlapping holes are normal: two make a slot.
const FEW: usize = 3;
/// Range of tool diameters, mm.
const THINNEST_MM: f64 = 0.08;
const THICKEST_MM: f64 = 20.0;
/// Number of holes checked, from the start of the file.
const WINDOW: usize = 5_000;
/// Number of neighbours checked per hole.
const NEIGHBOURS: usize = 64;
/// Larger limits for the search for holes deep inside others.
const DEEP_WINDOW: usize = 100_000;
const DEEP_NEIGHBOURS: usize = 500;
/// Distance, in bits, between cells of one column in neighbouring rows.
const ROW_STEP: i64 = 10_368_889;
/// A row of holes bends by less, as a sine.
const TURN_SINE: f64 = 0.5;

/// The code for implausible dimensions; none if they are plausible.
pub(super) fn oddity(drill: &DrillFile) -> Option<&'static str> {
    let bounds = drill.centre_bounds()?;
    let size_mm = (bounds.max.x - bounds.min.x).mm().max((bounds.max.y - bounds.min.y).mm());
    if size_mm > LARGE_MM {
        Some(code!("drill.board_large"))
    } else if size_mm < SMALL_MM && drill.hits.len() >= MANY {
        Some(code!("drill.board_small"))
    } else {
        most_overlap(drill).then_some(code!("drill.holes_overlap"))
    }
}

/// Problems with the dimensions of a file whose reading is settled.
pub(in crate::artwork) fn faults(name: &str, drill: &DrillFile, reading: &str) -> Vec<Diagnostic> {
    let odd = oddity(drill).map(|code| odd(name, drill, code, reading, reading));
    odd.into_iter().chain(impossible(name, drill)).collect()
}

/// The diagnostic `code` for a file read as `reading` instead of `other`.
pub(super) fn odd(name: &str, drill: &DrillFile, code: &str, reading: &str, other: &str) -> Diagnostic {
    let size = drill.centre_bounds().map_or(String::new(), |bounds| {
        format!("{:.1} × {:.1} mm", (bounds.max.x - bounds.min.x).mm(), (bounds.max.y - bounds.min.y).mm())
    });
    let diagnostic = Diagnostic::error(code).at(name, 0, 0).with("reading", reading);
    diagnostic.with("other", other).with("size", size)
}

/// Errors for a tool of an impossible diameter, and for holes deep inside others.
pub(super) fn impossible(name: &str, drill: &DrillFile) -> Vec<Diagnostic> {
    let bit = impossible_bit(drill).map(|tool| {
        let size = tool.diameter.map_or(String::new(), |length| format!("{:.3}", length.mm()));
        let diagnostic = error!("drill.impossible_bit", ..).at(name, tool.line, 1);
        diagnostic.with("tool", format!("T{}", tool.code)).with("size", size)
    });
    let inside = holes_inside(drill).filter(|_| oddity(drill).is_none());
    let inside = inside.map(|(count, line)| error!("drill.holes_inside", count = count).at(name, line, 1));
    bit.into_iter().chain(inside).collect()
}

pub(super) fn impossible_bit(drill: &DrillFile) -> Option<&ToolEntry> {
    let used = drill.tools.iter().zip(drill.counts()).filter(|(_, counts)| *counts != Counts::default());
    let sized = |tool: &ToolEntry| {
        tool.diameter.is_none_or(|length| (THINNEST_MM..=THICKEST_MM).contains(&length.mm()))
    };
    used.map(|(tool, _)| tool).find(|tool| !sized(tool))
}

/// True if more than half of the holes overlap a neighbour. Holes drilled twice at one position don't count.
fn most_overlap(drill: &DrillFile) -> bool {
    let holes = sorted(sized(drill, WINDOW));
    let mut cut = vec![false; holes.len()];
    near(&holes, widest(&holes), NEIGHBOURS, |a, b, (one, other)| {
        if one.at.distance_mm(other.at) < 0.5 * (one.mm + other.mm) {
            for hole in [a, b] {
                cut.get_mut(hole).into_iter().for_each(|cut| *cut = true);
            }
        }
    });
    let count = cut.iter().filter(|cut| **cut).count();
    count >= FEW && 2 * count > holes.len()
}

/// The number of holes deep inside others, and the line of the first. Holes in a row don't count: they make a
/// slot.
///
/// ```text
///   (((((( a slot        ((●)) two sizes at one position, or a heap
/// ```
fn holes_inside(drill: &DrillFile) -> Option<(usize, u32)> {
    let holes = sized(drill, DEEP_WINDOW);
    let widest = widest(&holes);
    let holes = sorted(crowded(holes, widest / 2 + 1));
    let mut deep = vec![false; holes.len()];
    // For each hole, the position of the first hole that it is deep inside of.
    let mut beside: Vec<Option<Point>> = vec![None; holes.len()];
    near(&holes, widest, DEEP_NEIGHBOURS, |a, b, (one, other)| {
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

/// True if the directions from one position to two others are not along one line.
fn turns(from: Point, one: Point, other: Point) -> bool {
    let way = |to: Point| ((to.x - from.x).mm(), (to.y - from.y).mm());
    let ((ax, ay), (bx, by)) = (way(one), way(other));
    (ax * by - ay * bx).abs() > TURN_SINE * libm::sqrt((ax * ax + ay * ay) * (bx * bx + by * by))
}

/// A hole whose size is known.
#[derive(Clone, Copy, Debug)]
struct Round {
    at: Point,
    mm: f64,
    line: u32,
}

fn sized(drill: &DrillFile, most: usize) -> Vec<Round> {
    let size = |tool: u16| drill.tools.get(usize::from(tool)).and_then(|tool| tool.diameter).map(Length::mm);
    let sized = drill.hits.iter().take(most);
    let sized = sized.filter_map(|hit| Some(Round { at: hit.at, mm: size(hit.tool)?, line: hit.line }));
    sized.collect()
}

/// The holes by place; those that are drilled twice by bits of one size once.
fn sorted(mut holes: Vec<Round>) -> Vec<Round> {
    holes.sort_by(|a, b| a.at.cmp(&b.at).then(a.mm.total_cmp(&b.mm)));
    holes.dedup_by(|a, b| a.at == b.at && a.mm.to_bits() == b.mm.to_bits());
    holes
}

/// How wide the widest hole is, in nm.
fn widest(holes: &[Round]) -> i64 {
    holes.iter().map(|hole| Length::from_mm(hole.mm).nm()).max().unwrap_or(0).max(1)
}

/// Cells of the plane, each a bit that it may share with others far away.
struct Cells {
    words: Vec<u64>,
}

impl Cells {
    /// Enough words that few of `count` cells share a bit.
    fn for_about(count: usize) -> Self {
        Self { words: vec![0; (2 * count).next_power_of_two()] }
    }

    /// Where the bit of a cell is: of cells in a row, next to each other.
    fn bit(&self, (column, row): (i64, i64)) -> (usize, u64) {
        let bit = row.wrapping_mul(ROW_STEP).wrapping_add(column) as u64;
        ((bit / 64) as usize & (self.words.len() - 1), 1 << (bit % 64))
    }

    fn holds(&self, cell: (i64, i64)) -> bool {
        let (word, bit) = self.bit(cell);
        self.words.get(word).is_some_and(|word| word & bit != 0)
    }

    /// Notes a cell; whether it was noted before.
    fn note(&mut self, cell: (i64, i64)) -> bool {
        let (word, bit) = self.bit(cell);
        let Some(word) = self.words.get_mut(word) else { return false };
        let before = *word & bit != 0;
        *word |= bit;
        before
    }
}

/// The holes that have another one nearer than `reach`, in nm, and some that have none.
///
/// ```text
///   ┼───┼───┼───┼
///   │ o │   │   │     what is as near is in the same cell or in one of the eight about it
///   ┼───┼───┼───┼
/// ```
fn crowded(mut holes: Vec<Round>, reach: i64) -> Vec<Round> {
    let cell = |hole: &Round| (hole.at.x.nm().div_euclid(reach), hole.at.y.nm().div_euclid(reach));
    let [mut once, mut twice] = [(); 2].map(|()| Cells::for_about(holes.len()));
    for hole in &holes {
        if once.note(cell(hole)) {
            twice.note(cell(hole));
        }
    }
    let around = |(column, row): (i64, i64)| {
        (-1..=1).flat_map(move |up| (-1..=1).map(move |right| (column + right, row + up)))
    };
    holes.retain(|hole| {
        let own = cell(hole);
        twice.holds(own) || around(own).any(|cell| cell != own && once.holds(cell))
    });
    holes
}

/// Gives every pair of holes that may touch to `pair`, with their numbers, but of each hole only `most`.
///
/// ```text
///   │ o │ o │     strips as wide as the widest hole: only holes in the same or the next strip can touch
/// ```
fn near(holes: &[Round], widest: i64, most: usize, mut pair: impl FnMut(usize, usize, (Round, Round))) {
    let strip = |hole: &Round| hole.at.x.nm().div_euclid(widest);
    let mut rows: Vec<(i64, i64, usize)> =
        holes.iter().enumerate().map(|(index, hole)| (strip(hole), hole.at.y.nm(), index)).collect();
    rows.sort_unstable();
    let mut ahead = 0;
    for (at, &(strip, y, index)) in rows.iter().enumerate() {
        while rows.get(ahead).is_some_and(|row| (row.0, row.1) <= (strip + 1, y - widest)) {
            ahead += 1;
        }
        let touch = |of: i64, row: &&(i64, i64, usize)| row.0 == of && row.1 - y < widest;
        let own = rows.get(at + 1..).unwrap_or_default().iter().take_while(|row| touch(strip, row));
        let next = rows.get(ahead..).unwrap_or_default().iter().take_while(|row| touch(strip + 1, row));
        let Some(hole) = holes.get(index) else { continue };
        for &(_, _, other) in own.chain(next).take(most) {
            let Some(beside) = holes.get(other) else { continue };
            if (beside.at.x - hole.at.x).abs().nm() < widest {
                pair(index, other, (*hole, *beside));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::artwork::{FileRead, read_drill};
    use crate::diagnostic::Severity;
    use crate::geometry::Point;
    use crate::units::Length;
    use std::collections::BTreeSet;

    /// A grid of 5 × 4 holes of 0.8 mm; `pitch` in units of the last digit.
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
    fn stated_format_is_used_and_an_impossible_board_is_an_error() {
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
    fn unstated_format_is_chosen_by_plausible_board_size() {
        // Inch 3.5 without a statement: with 2.4 the board would be 1 m wide.
        let file = grid("M48\nINCH\nT1C0.0315\n%\n", 100_000);
        let bounds = file.drill.as_ref().unwrap().centre_bounds().unwrap();
        assert_eq!(bounds.max.x.mm(), 101.6);
        assert!(codes(&file, Severity::Error).contains(&"drill.read_by_measure"), "{:?}", file.diagnostics);
    }

    #[test]
    fn impossible_size_in_every_format_is_an_error() {
        // Two columns far apart, of holes that nearly touch: every reading is either too wide or makes them
        // overlap.
        let mut text = String::from("M48\nINCH\nT1C0.0315\n%\nT1\n");
        for hole in 0..20 {
            text.push_str(&format!("X{:08}Y{:08}\n", hole % 2 * 3_900_000, hole * 20));
        }
        let file = read_drill("wide.drl", format!("{text}M30\n").as_bytes());
        assert!(codes(&file, Severity::Error).contains(&"drill.board_large"), "{:?}", file.diagnostics);
    }

    #[test]
    fn crowded_holes_include_every_close_neighbour() {
        let mut chance = crate::chance::Chance::new(11);
        for (count, spread) in [(0, 1), (1, 1), (500, 400_000), (500, 20_000_000), (4_000, 90_000_000)] {
            let mut place = || Length::from_nm(chance.below(spread) as i64 - spread as i64 / 2);
            let holes: Vec<super::Round> = (0..count)
                .map(|line| super::Round { at: Point::new(place(), place()), mm: 0.4, line })
                .collect();
            let reach = 200_001;
            let found: BTreeSet<u32> =
                super::crowded(holes.clone(), reach).iter().map(|hole| hole.line).collect();
            let is_near = |one: &super::Round, other: &super::Round| {
                one.line != other.line && one.at.distance_mm(other.at) < 0.2
            };
            for hole in holes.iter().filter(|hole| holes.iter().any(|other| is_near(hole, other))) {
                assert!(found.contains(&hole.line), "{hole:?} of {count}");
            }
            assert!(spread < 90_000_000 || found.len() < count as usize / 5, "{}", found.len());
        }
    }

    #[test]
    fn touching_holes_are_found_once() {
        let mut chance = crate::chance::Chance::new(7);
        let mut place = || chance.below(20_000) as f64 / 1_000.0;
        let holes: Vec<super::Round> = (0..400)
            .map(|index| super::Round {
                at: crate::geometry::Point::from_mm(place(), place()),
                mm: 0.3 + 0.1 * f64::from(index % 9),
                line: 1,
            })
            .collect();
        let mut found = std::collections::BTreeSet::new();
        super::near(&holes, super::widest(&holes), 500, |a, b, (one, other)| {
            if one.at.distance_mm(other.at) < 0.5 * (one.mm + other.mm) {
                assert!(found.insert((a.min(b), a.max(b))), "{a} {b} twice");
            }
        });
        let touch =
            |a: usize, b: usize| holes[a].at.distance_mm(holes[b].at) < 0.5 * (holes[a].mm + holes[b].mm);
        let wanted = (0..400).flat_map(|a| (a + 1..400).map(move |b| (a, b))).filter(|&(a, b)| touch(a, b));
        assert_eq!(found, wanted.collect());
    }
}
