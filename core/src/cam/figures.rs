//! Statistics of a planned job's holes: tools and their sizes, distance and time of the drills' travel.
//!
//! ```text
//!   zero ●┄┄┄▶ o┄▶ o┄▶ o┄┄┄▶ ● zero      travel of one drill: the rapids of its legs, from the work zero
//!                                        over its holes back to the work zero, for the next tool change
//! ```
//!
//! Before: the holes of every drill in file order. After: as planned. Toolpaths for milled slots and holes
//! have no order in the file and are not included.
//!
//! Lengths in mm, times in s.

use super::toolpaths::{BitTask, HoleOrSlot, Planned};
use crate::geometry::Point;
use crate::job::Bit;
use crate::units::Length;
use std::collections::{BTreeMap, BTreeSet};

/// Statistics of the holes and slots of one planned side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figures {
    /// Sizes by tool, in order of use.
    pub rows: Vec<SizeRow>,
    /// Travel of the drills in file order, mm: for each from the work zero over its holes back to the work
    /// zero.
    pub travel_before_mm: f64,
    /// Travel as planned, mm.
    pub travel_after_mm: f64,
    /// Time of the travel in file order, s.
    pub hop_time_before_s: f64,
    /// Time as planned, s.
    pub hop_time_after_s: f64,
    pub iterations: u64,
}

/// One hole size of the files, and its tool.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SizeRow {
    /// Number of the tool in order of use, from 1, as in the program.
    pub n: usize,
    /// Size in the files.
    pub size: Length,
    pub bit: Bit,
    pub holes: usize,
    pub slots: usize,
    /// Number of toolpaths; 0 if it drills.
    pub toolpaths: usize,
}

/// The statistics of `planned`. `rapid_time` returns the seconds from one position to another.
pub fn figures(planned: &Planned, rapid_time: &dyn Fn(Point, Point) -> f64) -> Figures {
    let mut figures =
        Figures { iterations: planned.parts.iter().map(|part| part.iterations).sum(), ..Figures::default() };
    let tasks: Vec<&BitTask> = planned.parts.iter().flat_map(|part| &part.tasks).collect();
    // As in the program: a tool in the spindle is not requested again.
    for (n, tasks) in (1..).zip(tasks.chunk_by(|a, b| a.bit == b.bit)) {
        figures.rows.extend(rows(n, tasks, planned));
        let after: Vec<(u32, Point)> = tasks
            .iter()
            .flat_map(|task| task.drill_cycles.iter().filter_map(|stroke| Some((stroke.hole?, stroke.at))))
            .collect();
        if after.is_empty() {
            continue;
        }
        let mut before = after.clone();
        before.sort_unstable();
        let straight = |a: Point, b: Point| a.distance_mm(b);
        figures.travel_before_mm += round(planned.origin, &before, &straight);
        figures.travel_after_mm += round(planned.origin, &after, &straight);
        figures.hop_time_before_s += round(planned.origin, &before, rapid_time);
        figures.hop_time_after_s += round(planned.origin, &after, rapid_time);
    }
    figures
}

fn round(zero: Point, holes: &[(u32, Point)], cost: &dyn Fn(Point, Point) -> f64) -> f64 {
    let stops = holes.iter().map(|(_, at)| *at).chain([zero]);
    stops.fold((zero, 0.0), |(here, sum), to| (to, sum + cost(here, to))).1
}

/// The sizes that tool `n` makes with `tasks`, ascending.
fn rows(n: usize, tasks: &[&BitTask], planned: &Planned) -> Vec<SizeRow> {
    let Some(bit) = tasks.first().map(|task| &task.bit) else { return Vec::new() };
    let hole = |hole: u32| planned.board.holes.get(hole as usize).and_then(|hole| hole.diameter);
    let slot = |slot: u32| planned.board.slots.get(slot as usize).and_then(|slot| slot.width);
    let mut by_size: BTreeMap<Length, SizeRow> = BTreeMap::new();
    let mut row = |size: Length, add: &dyn Fn(&mut SizeRow)| {
        let empty = || SizeRow { n, size, bit: bit.clone(), holes: 0, slots: 0, toolpaths: 0 };
        add(by_size.entry(size).or_insert_with(empty));
    };
    let drill_cycles = tasks.iter().flat_map(|task| &task.drill_cycles);
    drill_cycles.filter_map(|stroke| hole(stroke.hole?)).for_each(|size| row(size, &|row| row.holes += 1));
    let mut seen: BTreeSet<HoleOrSlot> = BTreeSet::new();
    for shape in tasks.iter().flat_map(|task| &task.toolpaths).filter_map(|way| way.clears) {
        let (size, holes, slots) = match shape {
            HoleOrSlot::Hole(number) => (hole(number), 1, 0),
            HoleOrSlot::Slot(number) => (slot(number), 0, 1),
        };
        let Some(size) = size else { continue };
        let new = usize::from(seen.insert(shape));
        row(size, &|row| {
            row.toolpaths += 1;
            row.holes += holes * new;
            row.slots += slots * new;
        });
    }
    by_size.into_values().collect()
}
