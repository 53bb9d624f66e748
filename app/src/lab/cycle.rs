//! XY and spindles over time for a few holes: the speed of XY and the height of the tip. Moves nothing.
//!
//! ```text
//! rapid ─▶ profile ─┐
//! own stroke ───────┴▶ core: cycles ────┬▶ points of speed and height, times with and without overlap
//! no overlap: core: one by one, steps ──┘
//! ```

use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Law, Machine};
use annulus_core::motion::coordination::{Cycle, SpindleRules, cycle_s, cycles, sequential_s};
use annulus_core::motion::one_by_one::one_by_one;
use annulus_core::motion::profile::{MotionLaw, Profile, choose, plan};
use annulus_core::motion::{AxisMove, Limits, Motion, drill_cycles};
use annulus_core::steps::TICK_HZ;

pub const HOLES: usize = 4;

const POINTS: usize = 60;

#[derive(Clone, Debug, PartialEq)]
pub struct CycleShown {
    /// Speed of XY in mm/s over ms.
    pub speed: Vec<[f64; 2]>,
    /// Height of the tip above the board in mm over ms.
    pub height: Vec<[f64; 2]>,
    pub cycles: Vec<Cycle>,
    /// Height above which XY may move, mm.
    pub clear_mm: f64,
    /// Time per hole with overlap, s; none if the machine moves XY and Z one after the other.
    pub together_s: Option<f64>,
    /// Time per hole without overlap, s.
    pub apart_s: f64,
    /// With overlap: time from the start of a stroke until which it can still be stopped clear of the board,
    /// s.
    pub last_stop_s: Option<f64>,
    /// Number of spindles that drill at once.
    pub spindles: u32,
}

/// Some holes in a row along X, at a distance of `hop_mm`.
pub fn shown(machine: &Machine, hop_mm: f64) -> Result<CycleShown, Diagnostic> {
    if drill_cycles::overlaps(machine) { together(machine, hop_mm) } else { apart(machine, hop_mm) }
}

fn together(machine: &Machine, hop_mm: f64) -> Result<CycleShown, Diagnostic> {
    let limits = Limits::of_axis(machine, &machine.x);
    let shape = match machine.motion.plane {
        Law::Linear => MotionLaw::Linear,
        Law::SCurve => MotionLaw::SCurve,
        Law::Power => MotionLaw::Power(machine.motion.order),
        Law::Automatic => choose(hop_mm, limits)?.choice,
    };
    let hop = plan(shape, hop_mm, limits)?;
    let (times, down, up) = drill_cycles::own(machine, 2)?;
    let rules =
        SpindleRules { settle_s: machine.settle_ms * 1e-3, latency_s: machine.overlap.latency_ms * 1e-3 };
    let spindles = drill_cycles::own_times(machine)?;
    // All spindles wait for the slowest.
    let cycle_s = spindles.iter().map(|times| cycle_s(hop.duration_s(), rules, times)).fold(0.0, f64::max);
    let found = cycles(&[hop.duration_s(); HOLES], rules, &spindles)?;
    let top_mm = machine.process.safe_height.mm();
    let mut height = vec![[0.0, top_mm]];
    let mut speed = vec![[0.0, 0.0]];
    for cycle in &found {
        speed.extend(hop_points(&hop, cycle.release_s));
        let Some(stroke) = cycle.spindles.first() else { continue };
        height.extend(way(stroke.start_s, times.down_s, |t| top_mm - down.position_mm(t)));
        height.extend(way(stroke.up_start_s, times.up_s, |t| top_mm - down.length_mm() + up.position_mm(t)));
    }
    let end_ms = height.last().map_or(0.0, |point| point[0]);
    speed.push([end_ms, 0.0]);
    Ok(CycleShown {
        speed,
        height,
        cycles: found,
        clear_mm: machine.overlap.clear_mm,
        together_s: Some(cycle_s),
        apart_s: sequential_s(&[hop.duration_s()], rules, &spindles),
        last_stop_s: Some(drill_cycles::last_stop_s(machine, &down)?),
        spindles: machine.spindles.max(1),
    })
}

/// XY and spindles move one after the other: the machine's own moves, profiles or steps.
fn apart(machine: &Machine, hop_mm: f64) -> Result<CycleShown, Diagnostic> {
    // `one_by_one` would accept a negative distance; NaN makes it fail.
    let hop_mm = if hop_mm >= 0.0 { hop_mm } else { f64::NAN };
    let found = one_by_one(machine, &[[hop_mm, 0.0]; HOLES])?;
    let mm = found.timeline.mm_per_step;
    let mut height = vec![[0.0, machine.process.safe_height.mm()]];
    let mut speed = vec![[0.0, 0.0]];
    for planned in &found.timeline.moves {
        let from_s = planned.start_tick as f64 / TICK_HZ as f64;
        let duration_s = planned.duration_ticks as f64 / TICK_HZ as f64;
        height.extend(way(from_s, duration_s, |t| planned.at(t)[2] * mm[2]));
        for part in planned.parts.iter().filter(|part| part.moves(0)) {
            speed.extend(part_speed(part, from_s + part.start_s(), mm[0]));
        }
    }
    speed.push([1000.0 * found.timeline.total_s(), 0.0]);
    let last = found.cycles.last().and_then(|cycle| cycle.cycle_s);
    Ok(CycleShown {
        speed,
        height,
        clear_mm: machine.overlap.clear_mm,
        together_s: None,
        apart_s: last.unwrap_or(found.timeline.total_s()),
        last_stop_s: None,
        spindles: machine.spindles.max(1),
        cycles: found.cycles,
    })
}

/// Speed of a part of a move along one axis. For table steps: constant within each run of equal intervals.
fn part_speed(part: &AxisMove, from_s: f64, mm_per_step: f64) -> Vec<[f64; 2]> {
    match &part.motion {
        Motion::Line(stroke) => way(from_s, part.duration_s(), |t| stroke.speed(t)),
        Motion::Path(route) => way(from_s, part.duration_s(), |t| route.path.speed(t)),
        Motion::TableSteps(steps) => {
            let mut now_s = from_s;
            let mut points = vec![[1000.0 * from_s, 0.0]];
            for some in &steps.stretches {
                let interval_s = (u64::from(some.interval) * steps.interrupt_ticks) as f64 / TICK_HZ as f64;
                let end_s = now_s + interval_s * some.count as f64;
                let mm_per_s = mm_per_step / interval_s;
                points.extend([[1000.0 * now_s, mm_per_s], [1000.0 * end_s, mm_per_s]]);
                now_s = end_s;
            }
            points.push([1000.0 * now_s, 0.0]);
            points
        }
    }
}

fn hop_points(hop: &Profile, from_s: f64) -> Vec<[f64; 2]> {
    way(from_s, hop.duration_s(), |t| hop.speed(t))
}

fn way(from_s: f64, duration_s: f64, value: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
    let point = |k: usize| {
        let t = duration_s * k as f64 / (POINTS - 1) as f64;
        [1000.0 * (from_s + t), value(t)]
    };
    (0..POINTS).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::machine::{hobby_3018, lab, six_spindles, virtual_drill};

    #[test]
    fn every_preset_drills_without_xy_motion_while_down() {
        for machine in [virtual_drill(), lab(), hobby_3018(), six_spindles()] {
            let shown = shown(&machine, 5.0).unwrap();
            assert_eq!(shown.cycles.len(), HOLES);
            assert_eq!(shown.together_s.is_some(), machine.overlap.on, "{}", machine.name);
            assert_eq!(shown.last_stop_s.is_some(), machine.overlap.on, "{}", machine.name);
            assert!(shown.together_s.is_none_or(|one| one <= shown.apart_s + 1e-9), "{}", machine.name);
            assert!(shown.height.windows(2).all(|two| two[0][0] <= two[1][0] + 1e-6), "{}", machine.name);
            let low = shown.height.iter().filter(|point| point[1] < shown.clear_mm - 1e-6);
            for point in low {
                let moves = shown.cycles.iter().any(|cycle| {
                    let [from_ms, to_ms] = [1000.0 * cycle.release_s, 1000.0 * cycle.arrive_s];
                    point[0] > from_ms + 1e-6 && point[0] < to_ms - 1e-6
                });
                assert!(!moves, "{} at {} ms", machine.name, point[0]);
            }
        }
    }

    #[test]
    fn lab_drill_cycle_is_plotted_from_its_steps() {
        let shown = shown(&lab(), 5.0).unwrap();
        // At most one step per interrupt: 500 per second are 105.8 mm/s; the slowest are 71 per second.
        let fastest = shown.speed.iter().map(|point| point[1]).fold(0.0, f64::max);
        assert!((fastest - 500.0 * 25.4 / 120.0).abs() < 1e-6, "{fastest}");
        assert!(shown.speed.iter().any(|point| (point[1] - 500.0 / 7.0 * 25.4 / 120.0).abs() < 1e-6));
        assert!(shown.apart_s > 2.0 && shown.apart_s < 2.6, "{}", shown.apart_s);
        let lowest = shown.height.iter().map(|point| point[1]).fold(0.0, f64::min);
        assert!((lowest + 2.1).abs() < 0.02, "through the board: {lowest}");
    }

    #[test]
    fn invalid_rapid_distance_is_refused() {
        assert!(shown(&lab(), f64::NAN).is_err() && shown(&lab(), -1.0).is_err());
        assert!(shown(&virtual_drill(), f64::NAN).is_err());
        assert!(shown(&virtual_drill(), -1.0).is_err());
    }
}
