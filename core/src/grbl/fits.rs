//! Whether a job fits a controller, before anything moves: compares settings with the job's positions, feeds
//! and speeds.
//!
//! Lengths in mm.

use super::routine::{Bow, Course, Routine, RoutineAction, RoutineMove, Spindle, TipPlace};
use super::settings::{self, Values};
use crate::diagnostic::Diagnostic;
use crate::{error, warning};

/// Step rate of an 8-bit controller.
pub const MOST_STEPS_PER_S: f64 = 30_000.0;
/// Tolerance at the end of travel: one step, and rounding.
const SLACK_MM: f64 = 0.02;
/// Tolerance over an axis' largest feed before a warning.
const FEED_SLACK_FACTOR: f64 = 1.01;
/// Warn if cuts reach no more than this share of their feed.
const LEAST_FEED_SHARE: f64 = 0.5;
const AXES: [char; 3] = ['X', 'Y', 'Z'];

#[derive(Clone, Debug, PartialEq)]
pub struct MachineRange<'m> {
    pub values: &'m Values,
    /// Work zero in machine coordinates.
    pub zero_mm: [f64; 3],
    /// The machine was homed, so machine coordinates are valid.
    pub homed: bool,
    /// Lowest and highest position of X, Y and Z, machine coordinates, as found by homing.
    pub ends_mm: [Option<[f64; 2]>; 3],
    /// An 8-bit controller with a limited step rate.
    pub small: bool,
}

/// Problems, worst first.
pub fn compare(routine: &Routine, machine: &MachineRange<'_>) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    // In laser mode GRBL keeps moving while the spindle changes its speed.
    if settings::on(machine.values, 32) {
        found.push(error!("grbl.laser_mode"));
    }
    found.extend(step_rates(machine));
    found.extend(travel(routine, machine));
    found.extend(feeds(routine, machine));
    found.extend(accelerations(routine, machine));
    found.extend(speeds(routine, machine));
    if !settings::on(machine.values, 22) {
        found.push(warning!("grbl.no_homing"));
    }
    found
}

fn step_rates(machine: &MachineRange<'_>) -> Vec<Diagnostic> {
    let (Some(scale), Some(rate)) =
        (settings::axes(machine.values, 100), settings::axes(machine.values, 110))
    else {
        return vec![warning!("grbl.settings_unknown")];
    };
    let too_fast = |axis: &usize| machine.small && scale[*axis] * rate[*axis] / 60.0 > MOST_STEPS_PER_S;
    (0..3)
        .filter(too_fast)
        .map(|axis| {
            let most = MOST_STEPS_PER_S * 60.0 / scale[axis];
            let found = error!("grbl.steps_too_fast", axis = AXES[axis], ..);
            let found = found.with("rate", libm::round(scale[axis] * rate[axis] / 60.0));
            found.with("number", 110 + axis).with("most", libm::floor(most))
        })
        .collect()
}

fn travel(routine: &Routine, machine: &MachineRange<'_>) -> Vec<Diagnostic> {
    let (Some([low, high]), Some(travel)) = (routine.reach(), settings::axes(machine.values, 130)) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    for axis in 0..3 {
        let top = if axis == 2 { high[2].max(routine.safe) } else { high[axis] };
        let (low, high) = (low[axis].mm(), top.mm());
        if high - low > travel[axis] + SLACK_MM {
            let error = error!("grbl.too_large", axis = AXES[axis], ..);
            found.push(error.with("needs", round(high - low)).with("travel", round(travel[axis])));
            continue;
        }
        let Some(ends) = machine.ends_mm[axis].filter(|_| machine.homed) else { continue };
        let (from, to) = (low + machine.zero_mm[axis], high + machine.zero_mm[axis]);
        let past = (ends[0] - from).max(to - ends[1]);
        if past > SLACK_MM {
            let error = error!("grbl.out_of_travel", axis = AXES[axis], ..);
            found.push(error.with("past", round(past)).with("from", round(from)).with("to", round(to)));
        }
    }
    found
}

/// Axes that are slower than the cuts require: the controller slows the whole move down.
fn feeds(routine: &Routine, machine: &MachineRange<'_>) -> Vec<Diagnostic> {
    let Some(rates) = settings::axes(machine.values, 110) else { return Vec::new() };
    let asked = fastest_asked(routine);
    (0..3)
        .filter(|axis| asked[*axis] > rates[*axis] * FEED_SLACK_FACTOR)
        .map(|axis| {
            let found = warning!("grbl.slower_than_asked", axis = AXES[axis], ..);
            let found = found.with("feed", round(asked[axis])).with("number", 110 + axis);
            found.with("fastest", round(rates[axis]))
        })
        .collect()
}

/// Highest feed that cuts require of each axis, mm/min.
fn fastest_asked(routine: &Routine) -> [f64; 3] {
    let mut asked = [0.0_f64; 3];
    let mut at: Option<TipPlace> = None;
    for section in &routine.sections {
        for (index, action) in section.actions.iter().enumerate() {
            if index == section.approach {
                at = Some(section.entry);
            }
            let RoutineAction::Go(step) = action else { continue };
            if let Some(from) = at.filter(|_| step.course != Course::Rapid) {
                let shares = shares(from, step);
                (0..3).for_each(|axis| asked[axis] = asked[axis].max(step.feed_mm_per_min * shares[axis]));
            }
            at = Some(step.to);
        }
        at = Some(section.end());
    }
    asked
}

/// Axes that can't move, and axes that accelerate so slowly that no cut reaches half its feed. A tool that
/// rubs instead of cutting gets hot and breaks.
fn accelerations(routine: &Routine, machine: &MachineRange<'_>) -> Vec<Diagnostic> {
    let is_stuck = |axis: &u16| machine.values.get(&(120 + axis)).is_some_and(|mm_per_s2| *mm_per_s2 <= 0.0);
    let stuck = (0_u16..3).filter(is_stuck).map(|axis| {
        let found = error!("grbl.no_acceleration", ..);
        found.with("axis", AXES[usize::from(axis)]).with("number", 120 + axis)
    });
    let mut found: Vec<_> = stuck.collect();
    let Some(all) = settings::axes(machine.values, 120) else { return found };
    // A cut in XY accelerates like its slower axis.
    let slower = usize::from(all[1] < all[0]);
    for (axis, down) in [(slower, false), (2, true)] {
        let Some((feed, reached)) = quickest_cut(routine, all[axis], down) else { continue };
        if reached < feed * LEAST_FEED_SHARE {
            let slow = warning!("grbl.slow_to_speed", axis = AXES[axis], ..);
            let slow = slow.with("number", 120 + axis).with("value", round(all[axis]));
            found.push(slow.with("feed", round(feed)).with("reached", libm::round(reached)));
        }
    }
    found
}

/// Among vertical cuts or cuts in XY, the cut that gets nearest to its feed. Returns the feed and the speed
/// reached from standstill to standstill, mm/min. Cuts without a stop between them count as one; corners are
/// ignored.
fn quickest_cut(routine: &Routine, mm_per_s2: f64, down: bool) -> Option<(f64, f64)> {
    let mut best: Option<(f64, f64)> = None;
    for section in &routine.sections {
        let (mut at, mut length_mm) = (section.entry, 0.0);
        for action in section.actions.iter().skip(section.approach) {
            let RoutineAction::Go(step) = action else { continue };
            let (from, to) = (std::mem::replace(&mut at, step.to), step.to);
            let is_down = to[0] == from[0] && to[1] == from[1] && to[2] < from[2];
            if step.course == Course::Rapid || is_down != down {
                length_mm = 0.0;
                continue;
            }
            let way: [f64; 3] = core::array::from_fn(|axis| (to[axis] - from[axis]).mm());
            length_mm += libm::hypot(libm::hypot(way[0], way[1]), way[2]);
            let reached = (libm::sqrt(mm_per_s2 * length_mm) * 60.0).min(step.feed_mm_per_min);
            if best.is_none_or(|(feed, before)| reached * feed > before * step.feed_mm_per_min) {
                best = Some((step.feed_mm_per_min, reached));
            }
        }
    }
    best
}

/// Largest share of the feed on each axis, 0 to 1. An arc somewhere moves entirely along X or Y.
fn shares(from: TipPlace, step: &RoutineMove) -> [f64; 3] {
    let way: [f64; 3] = core::array::from_fn(|axis| libm::fabs((step.to[axis] - from[axis]).mm()));
    let (plane, is_arc) = match step.course {
        Course::Arc { centre, ccw } => (Bow::of(from, step.to, centre, ccw).length(), true),
        Course::Rapid | Course::Line => (libm::hypot(way[0], way[1]), false),
    };
    let length = libm::hypot(plane, way[2]);
    if length <= 0.0 {
        return [0.0; 3];
    }
    let [x, y] = if is_arc { [plane; 2] } else { [way[0], way[1]] };
    [x / length, y / length, way[2] / length]
}

fn speeds(routine: &Routine, machine: &MachineRange<'_>) -> Vec<Diagnostic> {
    let said =
        routine.sections.iter().flat_map(|section| &section.actions).filter_map(|action| match action {
            RoutineAction::Spindle { to: Spindle::On(speed) | Spindle::Back(speed), .. } => Some(*speed),
            _ => None,
        });
    let fastest = said.fold(0.0_f64, f64::max);
    let most = machine.values.get(&30).copied().unwrap_or(0.0);
    if most <= 0.0 || fastest <= most {
        return Vec::new();
    }
    vec![warning!("grbl.spindle_slower", speed = round(fastest), most = round(most))]
}

fn round(value: f64) -> f64 {
    // `+ 0.0` turns −0 into 0.
    libm::round(value * 100.0) / 100.0 + 0.0
}

#[cfg(test)]
mod tests {
    use super::super::gcode::read;
    use super::*;

    fn said(
        compares: fn(&Routine, &MachineRange<'_>) -> Vec<Diagnostic>,
        text: &str,
        values: &[(u16, f64)],
    ) -> Vec<String> {
        let values: Values = values.iter().copied().collect();
        let routine =
            read("a", &[("a.nc".to_owned(), format!("G21 G90 G94\nG0 Z2\nM3 S1\n{text}\nG0 Z2\nM2\n"))]);
        let machine = MachineRange {
            values: &values,
            zero_mm: [0.0; 3],
            homed: false,
            ends_mm: [None; 3],
            small: false,
        };
        let found = compares(&routine.unwrap(), &machine).into_iter();
        found
            .map(|found| found.args.into_iter().map(|(_, value)| value).collect::<Vec<_>>().join(" "))
            .collect()
    }

    #[test]
    fn feed_check_uses_each_axis_share() {
        let fastest = [(110, 1_000.0), (111, 2_000.0), (112, 300.0)];
        for (text, expected) in [
            ("G0 X1 Y1\nG1 Z-1 F300", vec![]),
            // A plunge feed that only X and Y can reach.
            ("G0 X1 Y1\nG1 Z-1 F600", vec!["Z 600 112 300"]),
            ("G0 X1 Y1\nG1 Z-1 F300\nG1 Y9 F1900", vec![]),
            ("G0 X1 Y1\nG1 Z-1 F300\nG1 X9 F1900", vec!["X 1900 110 1000"]),
            // At 45 degrees X has only its share of the feed.
            ("G0 X1 Y1\nG1 Z-1 F300\nG1 X9 Y9 F1400", vec![]),
            ("G0 X1 Y1\nG1 Z-1 F300\nG2 X9 Y1 I4 J0 F1400", vec!["X 1400 110 1000"]),
            // A steep helix.
            ("G0 X1 Y1\nG1 Z-0.1 F300\nG1 X2 Z-1.1 F600", vec!["Z 424.26 112 300"]),
        ] {
            assert_eq!(said(feeds, text, &fastest), expected, "{text}");
        }
    }

    #[test]
    fn unreachable_feed_is_a_warning_and_zero_acceleration_an_error() {
        let drilled = "G0 X1 Y1\nG1 Z-1.7 F600";
        let milled = "G0 X1 Y1\nG1 Z-0.1 F60\nG1 X5 F300\nG1 X9 Y9";
        for (text, [x, y, z], expected) in [
            (drilled, [100.0, 100.0, 100.0], vec![]),
            // Standstill to standstill over 3.7 mm, down from 2 mm over the board: at most 10 mm/s with 27
            // mm/s².
            (drilled, [100.0, 100.0, 6.5], vec!["Z 122 6.5 600 294"]),
            (drilled, [100.0, 100.0, 7.0], vec![]),
            (milled, [100.0, 0.4, 100.0], vec!["Y 121 0.4 300 137"]),
            (milled, [0.4, 100.0, 100.0], vec!["X 120 0.4 300 137"]),
            (drilled, [100.0, 0.0, -1.0], vec!["Y 121", "Z 122"]),
        ] {
            let settings = [(120, x), (121, y), (122, z)];
            assert_eq!(said(accelerations, text, &settings), expected, "{text} {x} {y} {z}");
        }
    }
}
