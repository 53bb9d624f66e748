//! Drill cycles without overlap of XY and spindles, measured from the machine's moves.
//!
//! ```text
//! XY       ███ rapid ███|settle|                                   |███ next rapid
//! spindle                      | approach ▒▒ feed | rest | up ▒▒▒▒ |
//!          release   arrive  ready = start  contact bottom  clear  top
//! ```
//!
//! A plunge that ends on a sensor is assumed to end at the counted depth.

use super::coordination::{Cycle, SpindleTimes, Stroked};
use super::timeline::{Move, Timeline};
use super::writer::timeline;
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::geometry::Point;
use crate::job::{Command, Leg, Mark, Program, Stage};
use crate::machine::Machine;
use crate::units::{Length, TICK_HZ};

/// Bisections for the time of a height: more than the digits of an `f64`.
const HALVINGS: u32 = 60;

const FARTHEST_MM: f64 = 1e6;

/// Result.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OneByOne {
    /// Events of every hole; one spindle represents all.
    pub cycles: Vec<Cycle>,
    pub times: SpindleTimes,
    /// The machine's moves.
    pub timeline: Timeline,
}

/// Drills holes at the distances `hops_mm`, from rest over the work zero, with the machine's process
/// parameters.
pub fn one_by_one(machine: &Machine, hops_mm: &[[f64; 2]]) -> Result<OneByOne, Diagnostic> {
    let program = program(machine, hops_mm)?;
    let timeline = timeline(&program, machine)?;
    let clear_mm = machine.overlap.clear_mm.min(machine.process.safe_height.mm());
    let clear = clear_mm / timeline.mm_per_step[2];
    let mut cycles: Vec<Cycle> = Vec::with_capacity(hops_mm.len());
    for moves in timeline.moves.chunk_by(|a, b| a.leg == b.leg) {
        let mut cycle = read(moves, clear);
        cycle.cycle_s = cycles.last().map(|before| cycle.clear_s - before.clear_s);
        cycles.push(cycle);
    }
    let first = cycles.first().and_then(|cycle| cycle.spindles.first()).copied().unwrap_or_default();
    let times = SpindleTimes {
        down_s: first.bottom_s - first.start_s,
        up_s: first.top_s - first.up_start_s,
        contact_s: first.contact_s - first.start_s,
        leave_s: first.clear_s - first.up_start_s,
        dwell_bottom_s: first.up_start_s - first.bottom_s,
        ..SpindleTimes::default()
    };
    Ok(OneByOne { cycles, times, timeline })
}

fn program(machine: &Machine, hops_mm: &[[f64; 2]]) -> Result<Program, Diagnostic> {
    let process = &machine.process;
    let micros = |value: f64| libm::round(value * 1e3).clamp(0.0, f64::from(u32::MAX)) as u32;
    let bottom = Length::ZERO - process.board_thickness - process.breakthrough;
    let mut to = Point::default();
    let mut legs = Vec::with_capacity(hops_mm.len());
    for (index, hop) in (0..).zip(hops_mm) {
        if let Some(wrong) = hop.iter().find(|way| !(way.is_finite() && way.abs() <= FARTHEST_MM)) {
            return Err(error!("motion.bad_length", value = wrong));
        }
        let way = Point::from_mm(hop[0], hop[1]);
        to = Point::new(to.x + way.x, to.y + way.y);
        let feed_um_per_s = micros(process.feed_mm_per_s).max(1);
        let commands = vec![
            Command::Rapid { to },
            Command::Plunge { to: bottom, feed_um_per_s, gate: None },
            Command::Dwell { us: micros(process.dwell_bottom_ms) },
            Command::Retract { to: process.safe_height },
        ];
        legs.push(Leg { mark: Mark::Hole(index), commands });
    }
    Ok(Program {
        name: String::new(),
        machine: String::new(),
        origin: Point::default(),
        bits: Vec::new(),
        spindles: u8::MAX,
        safe_height: process.safe_height,
        legs,
        accepted: Vec::new(),
    })
}

/// Events of the hole of `moves`; the clear height is `clear` steps over the board.
fn read(moves: &[Move], clear: f64) -> Cycle {
    let second = |tick: u64| tick as f64 / TICK_HZ as f64;
    let began_s = moves.first().map_or(0.0, |first| second(first.start_tick));
    let mut cycle = Cycle { release_s: began_s, arrive_s: began_s, ready_s: began_s, ..Cycle::default() };
    let mut z: Option<Stroked> = None;
    for planned in moves {
        let (from_s, to_s) =
            (second(planned.start_tick), second(planned.start_tick + planned.duration_ticks));
        match (planned.stage, &mut z) {
            (Stage::Travel, None) => (cycle.arrive_s, cycle.ready_s) = (to_s, to_s),
            (Stage::Dwell, None) => cycle.ready_s = to_s,
            (Stage::Approach | Stage::Drill, z) => {
                let stroked =
                    z.get_or_insert(Stroked { trigger_s: from_s, start_s: from_s, ..Stroked::default() });
                if planned.from[2] > 0 && planned.to[2] <= 0 {
                    stroked.contact_s = from_s + reached_s(planned, |height| height <= 0.0);
                }
                (stroked.bottom_s, stroked.up_start_s) = (to_s, to_s);
            }
            (Stage::Dwell, Some(stroked)) => stroked.up_start_s = to_s,
            (Stage::Retract, Some(stroked)) => {
                (stroked.up_start_s, stroked.top_s) = (from_s, to_s);
                stroked.clear_s = from_s + reached_s(planned, |height| height >= clear);
            }
            _ => {}
        }
    }
    let z = z.unwrap_or_default();
    Cycle { clear_s: z.clear_s, spindles: vec![z], ..cycle }
}

/// First time in `planned` at which Z, in steps over the board, satisfies `there`; the end if never. In
/// seconds.
fn reached_s(planned: &Move, there: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, planned.duration_ticks as f64 / TICK_HZ as f64);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if there(planned.at(middle)[2]) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Overlap, lab, virtual_drill};
    use crate::motion::rapid_time_s;

    #[test]
    fn lab_drill_hole_takes_the_time_of_its_table() {
        let machine = lab();
        let found = one_by_one(&machine, &[[10.0, 0.0], [5.0, 0.0], [0.0, 2.54]]).unwrap();
        assert_eq!(found.cycles.len(), 3);
        let mut before_s = 0.0;
        for (cycle, to) in found.cycles.iter().zip([(10.0, 0.0), (15.0, 0.0), (15.0, 2.54)]) {
            let z = cycle.spindles[0];
            // Each event follows the previous rest; a move rests 2 µs at its end.
            let order = [
                before_s,
                cycle.release_s,
                cycle.arrive_s,
                cycle.ready_s,
                z.start_s,
                z.contact_s,
                z.bottom_s,
                z.up_start_s,
                z.clear_s,
                z.top_s,
            ];
            assert!(order.windows(2).all(|two| two[0] <= two[1] + 1e-12), "{to:?}: {order:?}");
            assert_eq!((cycle.release_s, cycle.ready_s), (before_s, z.start_s));
            assert!((cycle.ready_s - cycle.arrive_s - 0.02).abs() < 1e-9, "settles 20 ms: {cycle:?}");
            before_s = z.top_s;
        }
        // From 10 to 15 mm are 24 steps of X; the table needs 21 more interrupts for its ramps (A.5 of the
        // reference).
        let hop = &found.cycles[1];
        let by_table = rapid_time_s(&machine, Point::from_mm(10.0, 0.0), Point::from_mm(15.0, 0.0));
        assert!((hop.arrive_s - hop.release_s - by_table).abs() < 3e-6, "{hop:?} {by_table}");
        assert_eq!(libm::round(by_table * 500.0), 45.0);
    }

    #[test]
    fn holes_without_overlap_take_equal_time() {
        let base = virtual_drill();
        let apart = Machine { overlap: Overlap { on: false, ..base.overlap }, ..base };
        let found = one_by_one(&apart, &[[5.0, 0.0], [5.0, 0.0]]).unwrap();
        let whole = found.cycles[1].spindles[0].top_s;
        assert!((whole - found.timeline.total_s()).abs() < 1e-9);
        assert!((found.cycles[1].cycle_s.unwrap() - 0.5 * whole).abs() < 1e-4, "both holes are alike");
    }

    #[test]
    fn impossible_moves_are_refused() {
        for wrong in [f64::NAN, f64::INFINITY, -2e6] {
            assert_eq!(one_by_one(&lab(), &[[wrong, 0.0]]).unwrap_err().code, "motion.bad_length");
        }
    }
}
