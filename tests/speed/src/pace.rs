//! The drilling speed of a machine on a row of holes, compared with what its limits allow.

use annulus_core::geometry::Point;
use annulus_core::job::{Mark, Program};
use annulus_core::machine::{Law, Machine, MotionLaws};
use annulus_core::motion::bench::holes_at;
use annulus_core::motion::coordination::{SpindleRules, cycle_s};
use annulus_core::motion::{self, drill_cycles};

/// Number of holes in the row.
const HOLES: u32 = 101;

/// Time per hole, s.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// In the timeline.
    pub planned_s: f64,
    /// By formula, with the machine's profiles, settling, latency and margins.
    pub formula_s: f64,
    /// Lower bound: S-curves, without waits except for settling.
    pub bound_s: f64,
}

/// The pace of `machine` on a row of holes `pitch_mm` apart.
pub fn pace(machine: &Machine, pitch_mm: f64) -> Option<Pace> {
    let timeline = motion::timeline(&row(machine, pitch_mm), machine).ok()?;
    let bottoms: Vec<f64> = timeline
        .moves
        .iter()
        .filter_map(|planned| planned.drilled_tick())
        .map(|tick| tick as f64 / 1e7)
        .collect();
    let planned_s = (bottoms.last()? - bottoms.first()?) / f64::from(HOLES - 1);
    let hop =
        |machine: &Machine| motion::rapid_time_s(machine, Point::default(), Point::from_mm(pitch_mm, 0.0));
    let rules = |machine: &Machine| SpindleRules {
        settle_s: machine.settle_ms * 1e-3,
        latency_s: machine.overlap.latency_ms * 1e-3,
    };
    let formula_s = if machine.overlap.on {
        cycle_s(hop(machine), rules(machine), &drill_cycles::own(machine, 2).ok()?.0)
    } else {
        one_by_one_s(&timeline)
    };
    let mut free = machine.clone();
    free.motion = MotionLaws { plane: Law::SCurve, down: Law::SCurve, up: Law::SCurve, ..free.motion };
    (free.overlap.latency_ms, free.overlap.margin_ms, free.overlap.dwell_top_ms) = (0.0, 0.0, 0.0);
    let times = drill_cycles::own(&free, 2).ok()?.0;
    let bound_s = times.air_s().max(hop(&free) + rules(&free).settle_s) + times.board_s();
    Some(Pace { planned_s, formula_s, bound_s })
}

/// Time of one hole if moves never overlap: the sum of its parts.
fn one_by_one_s(timeline: &motion::Timeline) -> f64 {
    let middle = timeline.moves.iter().filter(|planned| planned.mark == Mark::Hole(HOLES / 2));
    middle
        .map(|planned| {
            let parts = planned.parts.iter().map(motion::AxisMove::duration_s).fold(0.0, f64::max);
            if planned.parts.is_empty() { planned.duration_ticks as f64 / 1e7 } else { parts }
        })
        .sum()
}

/// A row of holes.
fn row(machine: &Machine, pitch_mm: f64) -> Program {
    let place = |index: u32| Point::from_mm(f64::from(index + 1) * pitch_mm, 0.0);
    holes_at(machine, (0..HOLES).map(place))
}
