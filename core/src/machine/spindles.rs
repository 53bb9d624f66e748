//! Differences between spindles that drill at once: depth, length of the bit, margin.
//!
//! ```text
//!          Z1        Z2        Z3           all tips start at the safe height and go down together
//!  safe ── │ ─────── │ ─────── │ ──
//!          │         │         │            Z2: a longer bit, so its axis is higher
//!  board ══╪═════════╪═════════╪══
//!          ▼         ▼         │            Z3: drills deeper
//!                              ▼
//! ```
//!
//! All values are differences, so zeros mean that all spindles are alike.

use super::value::Value;
use super::{AXES, Machine, Steps, StrokeEnd, axis_name};
use crate::code;
use crate::diagnostic::Diagnostic;
use crate::units::Length;

/// Differences of one spindle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OwnStroke {
    /// Extra depth in drilled holes.
    pub deeper: Length,
    /// Extra length of its bit over the bit of Z1.
    pub longer: Length,
    /// Extra time for XY to settle before the tip touches the board, ms.
    pub margin_ms: f64,
}

impl OwnStroke {
    /// Height of this spindle if the program moves to `height` in a hole with its bottom at `bottom`. Limited
    /// by the spindle's own bottom, which is never above the surface.
    pub fn height(&self, height: Length, bottom: Length) -> Length {
        let own = (bottom - self.deeper).min(Length::ZERO);
        if height <= bottom { own } else { height.max(own) }
    }
}

impl Machine {
    /// Differences of the spindle on `axis` of a stream.
    pub fn own(&self, axis: usize) -> OwnStroke {
        axis.checked_sub(2).and_then(|spindle| self.own.get(spindle)).copied().unwrap_or_default()
    }

    /// Machine steps of the spindles with their tips on the board's surface; X and Y are 0.
    pub fn on_surface(&self) -> Steps {
        let mut at = Steps::default();
        for axis in self.spindle_axes() {
            at[axis] = self.z.scale.steps(self.process.surface + self.own(axis).longer);
        }
        at
    }

    /// Machine steps of the spindles at the bottom of a hole with its common bottom at `bottom` over the
    /// board's surface.
    pub fn bottoms(&self, bottom: Length) -> Steps {
        let mut at = self.on_surface();
        for axis in self.spindle_axes() {
            at[axis] += self.z.scale.steps(self.own(axis).height(bottom, bottom));
        }
        at
    }

    /// Lowest tip with the axes at `place`, as steps of Z1. A height limit for all tips only needs to check
    /// this one.
    pub fn lowest(&self, place: &Steps) -> i64 {
        let surface = self.on_surface();
        let heights = self.spindle_axes().map(|axis| place[axis] - surface[axis]);
        surface[2] + heights.min().unwrap_or_default()
    }

    /// Distance from the tip of Z1 down to the lowest tip with level spindles, in steps.
    pub fn reach(&self) -> i64 {
        let surface = self.on_surface();
        self.spindle_axes().map(|axis| surface[axis] - surface[2]).max().unwrap_or_default()
    }

    pub fn spindle_axes(&self) -> std::ops::Range<usize> {
        2..2 + (self.spindles as usize).clamp(1, AXES - 2)
    }
}

/// A value of each spindle as a list; empty if all are zero.
pub(super) fn listed(machine: &Machine, number: fn(&OwnStroke) -> f64) -> Value {
    let numbers: Vec<f64> = machine.spindle_axes().map(|axis| number(&machine.own(axis))).collect();
    Value::Numbers(if numbers.iter().all(|number| *number == 0.0) { Vec::new() } else { numbers })
}

/// Sets a list; spindles beyond its end get zero.
pub(super) fn set_listed(machine: &mut Machine, value: &Value, set: fn(&mut OwnStroke, f64)) {
    let Value::Numbers(numbers) = value else { return };
    let numbers = numbers.iter().copied().chain(std::iter::repeat(0.0));
    machine.own.iter_mut().zip(numbers).for_each(|(own, number)| set(own, number));
}

pub(super) fn validate(machine: &Machine) -> Vec<Diagnostic> {
    let all = machine.spindle_axes().map(|axis| (axis, machine.own(axis)));
    let others: Vec<(usize, OwnStroke)> = all.filter(|(_, own)| *own != OwnStroke::default()).collect();
    others.into_iter().filter_map(|(axis, own)| refusal(machine, axis, &own)).collect()
}

/// The first reason why the spindle on `axis` cannot be `own`.
fn refusal(machine: &Machine, axis: usize, own: &OwnStroke) -> Option<Diagnostic> {
    let key = if own.longer != Length::ZERO { "spindle.longer" } else { "spindle.deeper" };
    let refuse = |code: &str, key: &str, value: Length, bound: Length| {
        let why = Diagnostic::error(code).with("key", key).with("spindle", axis_name(axis));
        Some(why.with("value", value.mm()).with("bound", bound.mm()))
    };
    if machine.spindles < 2 {
        let key = if own.margin_ms > 0.0 { "spindle.margin" } else { key };
        return refuse(code!("machine.only_spindle"), key, Length::ZERO, Length::ZERO);
    }
    if axis == 2 && own.longer != Length::ZERO {
        return refuse(code!("machine.first_is_measure"), "spindle.longer", own.longer, Length::ZERO);
    }
    let (z, process) = (&machine.z, &machine.process);
    if machine.stroke_end == StrokeEnd::Sensor && (own.longer, own.deeper) != (Length::ZERO, Length::ZERO) {
        return refuse(code!("machine.own_stroke_without_count"), key, Length::ZERO, Length::ZERO);
    }
    let (top, rests) = (process.surface + own.longer + process.safe_height, z.max - z.home_offset);
    if own.longer > Length::ZERO && top > rests {
        return refuse(code!("machine.spindle_too_long"), "spindle.longer", top, rests);
    }
    let depth = process.board_thickness + process.breakthrough + own.deeper;
    let bottom = process.surface + own.longer - depth;
    if bottom < z.min {
        let key = if own.deeper > Length::ZERO { "spindle.deeper" } else { "spindle.longer" };
        return refuse(code!("machine.spindle_too_deep"), key, bottom, z.min);
    }
    if depth <= Length::ZERO {
        return refuse(code!("machine.spindle_over_board"), "spindle.deeper", own.deeper, own.deeper - depth);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::super::{apply, read, six_spindles, virtual_drill};
    use super::*;

    fn list(key: &str, numbers: &[f64]) -> (String, Value) {
        (format!("spindle.{key}"), Value::Numbers(numbers.to_vec()))
    }

    #[test]
    fn spindle_lists_are_empty_if_all_are_equal() {
        let six = six_spindles();
        for key in ["deeper", "longer", "margin"] {
            let value = |machine: &Machine| {
                let own = format!("spindle.{key}");
                read(machine).into_iter().find(|(known, _)| *known == own).map(|(_, value)| value)
            };
            let none = Some(Value::Numbers(Vec::new()));
            assert_eq!(value(&six), none);
            let two = apply(&six, &[list(key, &[0.0, 0.2])]).unwrap();
            assert_eq!(value(&two), Some(Value::Numbers(vec![0.0, 0.2, 0.0, 0.0, 0.0, 0.0])));
            assert_eq!(apply(&two, &read(&two)).unwrap(), two);
            assert_eq!(apply(&two, &[list(key, &[])]).unwrap(), six);
        }
    }

    #[test]
    fn equal_spindles_do_not_change_the_fingerprint() {
        let six = six_spindles();
        let print = |changes: &[(String, Value)]| apply(&six, changes).unwrap().fingerprint();
        assert_eq!(print(&[list("deeper", &[0.0; 6]), list("margin", &[])]), six.fingerprint());
        assert_ne!(print(&[list("deeper", &[0.0, 0.1])]), six.fingerprint());
        assert_ne!(print(&[list("margin", &[0.0, 1.0])]), six.fingerprint());
        assert_eq!(
            print(&[list("longer", &[0.0, 0.1])]),
            six.fingerprint(),
            "as the board's surface is none"
        );
    }

    #[test]
    fn invalid_spindle_values_name_the_spindle() {
        let six = six_spindles();
        let (z, process) = (&six.z, &six.process);
        let high_mm = (z.max - z.home_offset - process.surface - process.safe_height).mm();
        let through_mm = (process.board_thickness + process.breakthrough).mm();
        let low_mm = (process.surface - z.min).mm() - through_mm;
        let row = |code: &'static str, key: &str, mm: f64| (code, list(key, &[0.0, 0.0, mm]));
        let rows = [
            ("", list("longer", &[0.0, high_mm, 0.0, -low_mm])),
            row("machine.spindle_too_long", "longer", high_mm + 0.01),
            row("machine.spindle_too_deep", "longer", -low_mm - 0.01),
            row("", "deeper", low_mm.min(20.0)),
            row("", "deeper", 0.01 - through_mm),
            row("machine.spindle_over_board", "deeper", -through_mm),
            ("machine.first_is_measure", list("longer", &[0.1])),
            row("machine.setting_range", "margin", -1.0),
        ];
        for (code, change) in rows {
            let refusals = apply(&six, std::slice::from_ref(&change)).err().unwrap_or_default();
            assert_eq!(refusals.first().map_or("", |why| &why.code), code, "{change:?}");
            if code.starts_with("machine.spindle") {
                let said = refusals[0].message("en");
                assert!(said.contains(&change.0) && said.contains("Z3"), "{said}");
            }
        }
        let lower = ("z.min".to_owned(), Value::Number((process.surface.mm() - through_mm) - 0.5));
        let deep = apply(&six, &[lower, list("deeper", &[0.0, 0.51])]).unwrap_err();
        assert_eq!(deep[0].code, "machine.spindle_too_deep");
        let sensor = [
            ("stroke.end".to_owned(), Value::Text("sensor".to_owned())),
            ("overlap.on".to_owned(), Value::Text("no".to_owned())),
            list("deeper", &[0.0, 0.1]),
        ];
        assert_eq!(apply(&six, &sensor).unwrap_err()[0].code, "machine.own_stroke_without_count");
        let alone = apply(&virtual_drill(), &[list("deeper", &[0.1])]).unwrap_err();
        assert_eq!(alone[0].code, "machine.only_spindle");
    }

    #[test]
    fn heights_refer_to_tool_tips() {
        let six = apply(&six_spindles(), &[list("longer", &[0.0, 1.0, -2.0])]).unwrap();
        let steps = |mm: f64| six.z.scale.steps(six.process.surface + Length::from_mm(mm));
        let surface = six.on_surface();
        assert_eq!(surface[2..5], [steps(0.0), steps(1.0), steps(-2.0)]);
        assert_eq!(six.lowest(&surface), surface[2]);
        let mut alike = Steps::default();
        six.spindle_axes().for_each(|axis| alike[axis] = steps(5.0));
        assert_eq!(six.lowest(&alike), steps(4.0));
        assert_eq!(six.reach(), steps(1.0) - steps(0.0));
    }

    #[test]
    fn each_spindle_stops_at_its_own_bottom() {
        let mm = Length::from_mm;
        let bottom = mm(-1.8);
        // Extra depth, height in the program, own height.
        let rows = [
            (0.0, -1.8, -1.8),
            (0.0, -0.5, -0.5),
            (0.3, -1.8, -2.1),
            (0.3, -0.5, -0.5),
            (0.3, 2.0, 2.0),
            (-1.0, -1.8, -0.8),
            (-1.0, -1.2, -0.8),
            (-1.0, -0.5, -0.5),
            (-3.0, -1.8, 0.0),
            (-3.0, 2.0, 2.0),
        ];
        for (deeper, height, own) in rows {
            let spindle = OwnStroke { deeper: mm(deeper), ..OwnStroke::default() };
            assert_eq!(spindle.height(mm(height), bottom), mm(own), "{deeper} {height}");
        }
    }
}
