//! What is wrong in a playback, and when: marks on its time.
//!
//! Comes in: a [`Playback`], bits, how deep and where one may go. Goes out: [`Warning`]s in order of time, the first of every
//! kind in a leg. Does not know why anything is done.

use super::playback::Playback;
use super::swept::{Swept, swept};
use crate::geometry::{Bounds, Point};
use crate::job::{Bit, Cutter, Mark};
use crate::units::Length;

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fault {
    /// The head would leave the travel of the machine.
    Outside,
    /// The tip goes deeper than it may.
    TooDeep,
    /// The plane moves at rapid speed with the tip in the board.
    RapidInMaterial,
    /// Something is cut with no tool in, or milled with a drill.
    WrongTool,
}

/// Something wrong at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Warning {
    /// When it begins.
    pub at_s: f64,
    /// What.
    pub fault: Fault,
    /// The leg of the program.
    pub leg: u32,
    /// How deep the tip is then, mm.
    pub depth_mm: f64,
}

/// The most warnings that are made.
const MOST: usize = 500;

/// What is wrong in `playback`, whose program has these `bits`. `travel` is where the head can go in work coordinates, `deepest`
/// how far below the surface the tip may go.
pub fn warnings(playback: &Playback, bits: &[Bit], travel: Option<Bounds>, deepest: Length) -> Vec<Warning> {
    let timeline = playback.timeline();
    let mut found: Vec<Warning> = Vec::new();
    // Where the motors rest is up to half a step off what the program says.
    let step_mm = timeline.mm_per_step.iter().take(2).fold(0.0, |most: f64, step| most.max(step.abs()));
    let travel = travel.map(|travel| travel.grown(Length::from_mm(step_mm)));
    for planned in &timeline.moves {
        let bit = playback.bit_of_leg(planned.leg).and_then(|bit| bits.get(bit as usize));
        let begin_s = planned.start_tick as f64 / crate::units::TICK_HZ as f64;
        let end = |axis: usize| Length::from_mm(planned.to[axis] as f64 * timeline.mm_per_step[axis]);
        let beyond = travel.is_some_and(|travel| !travel.contains(Point::new(end(0), end(1))));
        let mut told = |fault, at_s, depth_mm| {
            let known = found.iter().rev().take_while(|one| one.leg == planned.leg);
            if found.len() < MOST && !known.into_iter().any(|one| one.fault == fault) {
                found.push(Warning { at_s, fault, leg: planned.leg, depth_mm });
            }
        };
        if beyond {
            told(Fault::Outside, begin_s, 0.0);
        }
        for one in swept(planned, &timeline.mm_per_step) {
            let depth_mm = -one.way.from_mm[2].min(one.way.to_mm[2]);
            for fault in faults(&one, bit, planned.mark, depth_mm > deepest.mm()) {
                told(fault, one.from_s, depth_mm);
            }
        }
    }
    found
}

fn faults(one: &Swept, bit: Option<&Bit>, mark: Mark, deep: bool) -> impl Iterator<Item = Fault> {
    let drill = bit.is_some_and(|bit| bit.cutter == Cutter::Drill);
    let sideways = one.way.from_mm[..2] != one.way.to_mm[..2] || one.way.shape != super::cuts::CutShape::Line;
    let wrong = bit.is_none() || (drill && sideways && !one.rapid && matches!(mark, Mark::Toolpath(_)));
    let rows = [(deep, Fault::TooDeep), (one.rapid, Fault::RapidInMaterial), (wrong, Fault::WrongTool)];
    rows.into_iter().filter(|row| row.0).map(|row| row.1)
}
