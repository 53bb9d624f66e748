//! Axis speeds of a table of dynamics, and conflicts with the machine's settings.
//!
//! ```text
//! steps/s  71   125   250   500      states 0 … 3 of Arendt's table at 500 interrupts per second
//!           |    |     |     |
//!           |    `- a speed limit below a state's rate disables that state and all above it: a warning
//!           `- a speed limit below the rate of state 0 is impossible: refused
//! ```
//!
//! The table sets the speed of an axis; `max_speed`, `motion.down_speed` and the feed only limit it to slower
//! states. The motors can't follow rates above `drive.max_step_rate`. The virtual drill accepts them anyway,
//! to show the lost steps.

use super::dynamics::{self, period, state_within, top};
use super::{Axis, DriveKind, Machine, Output};
use crate::diagnostic::Diagnostic;
use crate::{code, warning};

/// Limits are reported in 0.1 µm/s, rounded so that they can be typed.
const SAID_PARTS: f64 = 1e4;

/// Tolerance for rounding, as a share of a speed.
const ROUNDING_SHARE: f64 = 1e-9;

impl Machine {
    pub fn step_hz(&self, state: usize) -> f64 {
        let state = i32::try_from(state).unwrap_or(i32::MAX);
        f64::from(self.interrupt_hz.max(1)) / f64::from(period(&self.dynamics, state))
    }

    /// Fastest state with `axis` not above `speed_mm_per_s`; 0 if even that is too fast.
    pub fn fastest_state(&self, axis: &Axis, speed_mm_per_s: f64) -> usize {
        state_within(
            &self.dynamics,
            f64::from(self.interrupt_hz.max(1)),
            speed_mm_per_s * axis.scale.steps_per_mm(),
        )
    }

    /// Highest pulse rate, steps per second: the limit of the drives. With a table, the virtual drill may
    /// exceed it, to show the lost steps.
    pub fn pulse_hz(&self) -> u32 {
        let tried = self.drive == DriveKind::Table && self.output == Output::Virtual;
        if tried { self.max_step_hz.max(self.interrupt_hz) } else { self.max_step_hz }
    }
}

/// Settings that limit the table, with their axes and values in mm/s.
fn speeds(machine: &Machine) -> [(&'static str, &Axis, f64); 4] {
    let Machine { x, y, z, down, .. } = machine;
    [
        ("x.max_speed", x, x.max_speed_mm_per_s),
        ("y.max_speed", y, y.max_speed_mm_per_s),
        ("z.max_speed", z, z.max_speed_mm_per_s),
        ("motion.down_speed", z, down.max_speed_mm_per_s),
    ]
}

/// True if the machine uses a table, and that table is valid.
fn has_table(machine: &Machine) -> bool {
    machine.drive == DriveKind::Table && dynamics::check(&machine.dynamics).is_ok()
}

/// Highest step rate of any axis, steps per second.
fn fastest_hz(machine: &Machine) -> f64 {
    let axes = [&machine.x, &machine.y, &machine.z];
    let states = axes.map(|axis| machine.fastest_state(axis, axis.max_speed_mm_per_s));
    states.into_iter().map(|state| machine.step_hz(state)).fold(0.0, f64::max)
}

/// Errors: speeds below the slowest state; on hardware, steps too fast for the motors.
pub(super) fn refusals(machine: &Machine) -> Vec<Diagnostic> {
    if !has_table(machine) {
        return Vec::new();
    }
    let error = |code: &str, key: &str, value: f64, bound: f64| {
        Diagnostic::error(code).with("key", key).with("value", value).with("bound", bound)
    };
    let feed = ("stroke.feed", &machine.z, machine.process.feed_mm_per_s);
    let touch = ("stroke.touch_speed", &machine.z, machine.process.touch_mm_per_s);
    let slow = speeds(machine).into_iter().chain([feed, touch]).filter_map(|(key, axis, speed)| {
        let slowest = machine.step_hz(0) / axis.scale.steps_per_mm();
        let said = libm::ceil(slowest * SAID_PARTS) / SAID_PARTS;
        (speed < slowest * (1.0 - ROUNDING_SHARE))
            .then(|| error(code!("machine.slower_than_table"), key, speed, said))
    });
    let mut diagnostics: Vec<Diagnostic> = slow.collect();
    let (fastest, most) = (fastest_hz(machine), f64::from(machine.max_step_hz));
    if fastest > most && machine.output != Output::Virtual {
        diagnostics.push(error(code!("machine.table_too_fast"), "drive.interrupt_frequency", fastest, most));
    }
    diagnostics
}

/// Warnings: a spindle speed above the spindle's limit; with a table, disabled states and steps too fast for
/// the motors.
pub fn warnings(machine: &Machine) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::from_iter(spindle_bounded(machine));
    if has_table(machine) {
        diagnostics.extend(of_table(machine));
    }
    diagnostics
}

fn spindle_bounded(machine: &Machine) -> Option<Diagnostic> {
    let (wanted, gets) = (machine.process.spindle_rpm, machine.process.usual_rpm());
    let why = || warning!("machine.speed_above_most", key = "spindle.speed", ..);
    (gets < wanted).then(|| why().with("value", wanted).with("bound", gets))
}

fn of_table(machine: &Machine) -> Vec<Diagnostic> {
    let top = top(&machine.dynamics);
    let cut = speeds(machine).into_iter().filter_map(|(key, axis, speed)| {
        let state = machine.fastest_state(axis, speed);
        let whole = libm::ceil(machine.step_hz(top) / axis.scale.steps_per_mm() * SAID_PARTS) / SAID_PARTS;
        let diagnostic = warning!("machine.table_cut", key = key, value = speed, ..);
        let diagnostic = diagnostic.with("rate", libm::round(machine.step_hz(state))).with("bound", whole);
        (state < top).then(|| diagnostic.with("fastest", libm::round(machine.step_hz(top))))
    });
    let mut diagnostics: Vec<Diagnostic> = cut.collect();
    let (fastest, most) = (fastest_hz(machine), f64::from(machine.max_step_hz));
    if fastest > most {
        let diagnostic = warning!("machine.table_loses_steps", ..);
        let diagnostic =
            diagnostic.with("key", "drive.interrupt_frequency").with("value", machine.interrupt_hz);
        diagnostics.push(diagnostic.with("rate", libm::round(fastest)).with("bound", most));
    }
    diagnostics
}

#[cfg(test)]
mod tests {
    use super::super::{Value, apply, lab, presets};
    use super::*;

    fn number(key: &str, value: f64) -> (String, Value) {
        (key.to_owned(), Value::Number(value))
    }

    fn codes(diagnostics: &[Diagnostic]) -> Vec<&str> {
        diagnostics.iter().map(|diagnostic| diagnostic.code.as_str()).collect()
    }

    #[test]
    fn table_speed_above_the_maximum_is_a_warning() {
        for (most, told) in [(29_999.0, true), (30_000.0, false), (0.0, false), (1.0, true)] {
            let machine =
                apply(&super::super::virtual_drill(), &[number("spindle.max_speed", most)]).unwrap();
            assert_eq!(codes(&warnings(&machine)) == ["machine.speed_above_most"], told, "{most}");
        }
    }

    #[test]
    fn presets_use_their_whole_table() {
        for (name, machine) in presets() {
            assert_eq!(codes(&warnings(&machine)), Vec::<&str>::new(), "{name}");
        }
    }

    #[test]
    fn interrupts_too_fast_for_motors_warn_or_are_refused() {
        // (interrupts per second, true if more than the 580 steps that the motors follow)
        for (interrupts, too_many) in [(500.0, false), (580.0, false), (581.0, true), (600.0, true)] {
            let change = number("drive.interrupt_frequency", interrupts);
            let tried = apply(&lab(), std::slice::from_ref(&change)).unwrap();
            let expected: &[&str] = if too_many { &["machine.table_loses_steps"] } else { &[] };
            assert_eq!(codes(&warnings(&tried)), expected, "{interrupts}");
            let state = tried.fastest_state(&tried.x, tried.x.max_speed_mm_per_s);
            assert_eq!(state, 3, "no state is left out at {interrupts}");
            let card = Machine { output: Output::Card, ..lab() };
            let refusals = apply(&card, &[change]).err().unwrap_or_default();
            assert_eq!(codes(&refusals).contains(&"machine.table_too_fast"), too_many, "{refusals:?}");
        }
    }

    #[test]
    fn lower_speed_drops_table_states_with_a_warning() {
        // (setting, mm/s, remaining highest step rate at 500 interrupts per second)
        let rows =
            [("x.max_speed", 100.0, 250.0), ("y.max_speed", 30.0, 125.0), ("motion.down_speed", 4.0, 125.0)];
        for (key, speed, left) in rows {
            let machine = apply(&lab(), &[number(key, speed)]).unwrap();
            let found = warnings(&machine);
            assert_eq!(codes(&found), ["machine.table_cut"], "{key}");
            let message = found[0].message("en");
            assert!(message.contains(key) && message.contains(&format!("{left}")), "{message}");
        }
    }

    #[test]
    fn speed_below_the_slowest_state_is_refused_with_the_minimum() {
        // State 0 makes 500/7 steps per second: 1.5119 mm/s of Z, 15.119 mm/s of X.
        for (key, speed, refused) in [
            ("stroke.feed", 0.5, true),
            ("stroke.feed", 1.0, true),
            ("stroke.feed", 1.5, true),
            ("stroke.feed", 1.512, false),
            ("stroke.feed", 2.0, false),
            ("x.max_speed", 15.0, true),
            ("x.max_speed", 15.2, false),
            ("motion.down_speed", 1.0, true),
        ] {
            let found = apply(&lab(), &[number(key, speed)]).err().unwrap_or_default();
            let slow = found.iter().find(|why| why.code == "machine.slower_than_table");
            assert_eq!(slow.is_some(), refused, "{key} {speed}: {found:?}");
            assert!(slow.is_none_or(|why| why.message("en").contains(key)), "{found:?}");
        }
        let why = apply(&lab(), &[number("stroke.feed", 0.5)]).unwrap_err();
        assert!(why[0].message("en").contains("1.512 mm/s"), "{}", why[0].message("en"));
    }
}
