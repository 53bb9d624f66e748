//! Translates a segment for the adapter: runs of its axes, how it may brake, and which sensors must stay
//! off meanwhile.
//!
//! ```text
//! axes of the stream    X  Y  Z1 Z2         a run of several axes becomes one run of each
//! axes of the adapter   0  1  2  3
//! ```
//!
//! Ticks, machine steps.

use annulus_core::job::{Input, Stage};
use annulus_core::machine;
use annulus_core::pins::Motors;
use annulus_core::steps::{PARTS, Segment};
use annulus_link::AXES;
use annulus_link::chunk::LONGEST;
use annulus_link::cutter::Rule;
use annulus_link::run::{HALF, Run};

/// Share of an axis's braking limit that a hold uses. If the plan brakes at the same moment, both together
/// reach one and a half times the limit.
const SHARE: f64 = 0.5;

/// Shortest and longest hold, in ticks from full feed to a stop: 2 ms, and the room in a tail.
const RESTS: (f64, f64) = (2e4, 1.6e7);

/// Runs of each adapter axis, in order of time.
pub(super) fn runs(segment: &Segment) -> [Vec<Run>; AXES] {
    std::array::from_fn(|axis| {
        let own = segment.runs.iter().filter(|run| run.axes >> axis & 1 == 1 && run.count > 0);
        own.map(|run| Run {
            forward: run.forward,
            count: run.count,
            interval: run.interval,
            fraction: run.fraction,
            change: run.change,
            phase: HALF,
        })
        .collect()
    })
}

/// How to cut `segment` into chunks so that a hold stays within the limits of the motors.
pub(super) fn rule(segment: &Segment, motors: &Motors) -> Rule {
    let mut longest = RESTS.0;
    for run in &segment.runs {
        let shortest = run.parts_before(0).min(run.parts_before(run.count.saturating_sub(1))).max(1);
        let speed = PARTS as f64 / shortest as f64;
        for axis in (0..machine::AXES).filter(|axis| run.axes >> axis & 1 == 1) {
            longest = longest.max(speed / (SHARE * motors.braking_steps_per_tick2[axis]));
        }
    }
    // As long as possible: the chunk header is most of the bytes of a slow chunk. A chunk too long for a
    // frame is cut shorter.
    Rule { ticks: LONGEST, ..Rule::resting_within(longest.min(RESTS.1) as u32) }
}

/// Sensors that must stay off during the whole segment, one bit each. These are the limit switches in the
/// direction of motion. The contact sensor is included if X or Y moves off the board without intending to
/// touch.
pub(super) fn guard(segment: &Segment) -> u32 {
    const ENDS: [[Input; 2]; 3] =
        [[Input::XMin, Input::XMax], [Input::YMin, Input::YMax], [Input::ZBottom, Input::ZTop]];
    let mut guard = 0;
    for run in &segment.runs {
        for axis in (0..machine::AXES).filter(|axis| run.axes >> axis & 1 == 1) {
            guard |= ENDS[axis.min(2)][usize::from(run.forward)].bit();
            if axis < 2 && !matches!(segment.stage, Stage::Mill | Stage::Touch) {
                guard |= Input::Contact.bit();
            }
        }
    }
    guard & !segment.gate.map_or(0, |gate| gate.input.bit())
}

/// Two axis sets: the axes that move in `segment`, and those whose last step counts down.
pub(super) fn last_steps(segment: &Segment) -> (u8, u8) {
    let last = |(moves, down): (u8, u8), run: &annulus_core::steps::Run| {
        (moves | run.axes, if run.forward { down & !run.axes } else { down | run.axes })
    };
    segment.runs.iter().fold((0, 0), last)
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::job::{Mark, Switching};
    use annulus_core::machine::virtual_drill;
    use annulus_core::steps;
    use annulus_link::FULL_RATE;
    use annulus_link::adapter::{OUTPUTS_AT_LAST_US, OUTPUTS_US};
    use annulus_link::chunk::{LONGEST_TAIL, stopping};

    fn segment(stage: Stage, runs: Vec<steps::Run>) -> Segment {
        let (mark, effect) = (Mark::Prepare, Switching::None);
        Segment { leg: 0, mark, stage, duration_ticks: 0, runs, effect, gate: None, end: [0; machine::AXES] }
    }

    #[test]
    fn path_runs_are_split_by_axis_and_guard_sensors_ahead() {
        let even = steps::Run::even;
        let both = segment(Stage::Travel, vec![even(0b01, true, 500, 3), even(0b10, false, 600, 2)]);
        let of = runs(&both);
        assert_eq!((of[0].len(), of[1].len(), of[2].len()), (1, 1, 0));
        assert_eq!((of[0][0].count, of[0][0].forward, of[1][0].interval), (3, true, 600));
        assert_eq!(guard(&both), Input::XMax.bit() | Input::YMin.bit() | Input::Contact.bit());
        let milled = Segment { stage: Stage::Mill, ..both };
        assert_eq!(guard(&milled), Input::XMax.bit() | Input::YMin.bit());
        let spindles = segment(Stage::Retract, vec![even(0b1100, true, 500, 3), even(0b1100, false, 500, 1)]);
        assert_eq!(runs(&spindles).map(|own| own.len()), [0, 0, 2, 2]);
        assert_eq!(last_steps(&spindles), (0b1100, 0b1100));
    }

    #[test]
    fn hold_brakes_with_half_acceleration_and_fits_a_tail() {
        let motors = Motors::of(&virtual_drill());
        // 150 mm/s at 80 steps/mm and 2,000 mm/s²: 75 ms with all of it.
        let fast = segment(Stage::Travel, vec![steps::Run::even(1, true, 833, 100)]);
        let wanted = FULL_RATE * 1024 / 1_500_600;
        assert!(
            i32::from(rule(&fast, &motors).fall).abs_diff(wanted as i32) <= 1,
            "{:?}",
            rule(&fast, &motors)
        );
        let slow = Motors { braking_steps_per_tick2: [1e-15; machine::AXES], ..motors };
        assert!(stopping(rule(&fast, &slow).fall) <= LONGEST_TAIL);
        // Even at the gentlest hold after a lost connection, motion stops before the spindle does.
        let patience_ticks = f64::from(OUTPUTS_AT_LAST_US - OUTPUTS_US) * 10.0;
        assert!(patience_ticks > f64::from(stopping(rule(&fast, &slow).fall)));
    }
}
