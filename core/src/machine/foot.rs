//! The presser foot, which holds the board down during drilling.
//!
//! ```text
//! foot   ‾‾‾‾╲______________╱‾‾‾‾      time: from the output to the foot on the board, and back
//! bit    ‾‾‾‾‾‾‾‾╲____╱‾‾‾‾‾‾‾‾‾‾      plunge after the foot is down, XY after it is up
//! ```
//!
//! Only for holes: paths are milled with the foot up. Its sensor, if any, is an interlock.

use super::field::{BUILT, STREAM, Setting, YES_NO, fields};
use super::value::ValueKind::{Number, Text};
use super::{Machine, Output};
use crate::diagnostic::Diagnostic;
use crate::units::TICK_HZ;
use crate::{code, error};

#[derive(Clone, Debug, PartialEq)]
pub struct Foot {
    /// True if the machine has one.
    pub on: bool,
    /// Name of its output; on means down.
    pub output: String,
    /// Time to move down or up, in ms.
    pub time_ms: f64,
}

impl Default for Foot {
    /// None; times of a small cylinder.
    fn default() -> Self {
        Self { on: false, output: "foot".to_owned(), time_ms: 60.0 }
    }
}

impl Foot {
    pub fn ticks(&self) -> u64 {
        libm::ceil(self.time_ms * 1e-3 * TICK_HZ as f64) as u64
    }
}

/// The section "foot" of the settings table.
pub(super) const ROWS: &[Setting] = fields! { Machine;
    ("foot.on", "", YES_NO, STREAM.and(BUILT), foot.on)
    ("foot.output", "", Text(32), BUILT, foot.output)
    ("foot.time", "ms", Number(0.0, 5_000.0), STREAM.and(BUILT), foot.time_ms)
};

pub(super) fn not_named(machine: &Machine, key: &str, name: &str) -> Option<Diagnostic> {
    let known = machine.output_names();
    let why = || error!("machine.output_not_named", key = key, name = name, ..);
    (!known.iter().any(|own| own == name)).then(|| why().with("known", known.join(", ")))
}

pub(super) fn validate(machine: &Machine) -> Vec<Diagnostic> {
    if !machine.foot.on {
        return Vec::new();
    }
    let refuse = |code: &str| Diagnostic::error(code).with("key", "foot.on");
    let mut diagnostics = Vec::new();
    if machine.output == Output::Adapter {
        diagnostics.push(refuse(code!("machine.foot_beside_adapter")));
    } else {
        diagnostics.extend(not_named(machine, "foot.output", &machine.foot.output));
    }
    if machine.overlap.on {
        diagnostics.push(refuse(code!("machine.foot_with_overlap")));
    }
    diagnostics
}

#[cfg(test)]
mod tests {
    use super::super::{Value, apply, lab, virtual_drill};
    use super::*;

    #[test]
    fn impossible_foot_names_its_field() {
        let text = |text: &str| Value::Text(text.to_owned());
        let codes = |machine: &Machine, changes: &[(&str, Value)]| {
            let changes: Vec<_> =
                changes.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
            let refusals = apply(machine, &changes).err().unwrap_or_default();
            refusals.into_iter().map(|why| why.code).collect::<Vec<_>>()
        };
        let on = ("foot.on", text("yes"));
        let alone = ("overlap.on", text("no"));
        let card = ("machine.output", text("card"));
        let none = Vec::<String>::new();
        assert_eq!(codes(&virtual_drill(), std::slice::from_ref(&on)), ["machine.foot_with_overlap"]);
        assert_eq!(codes(&virtual_drill(), &[on.clone(), alone.clone()]), none);
        assert_eq!(codes(&lab(), &[on.clone(), card.clone()]), ["machine.output_not_named"]);
        let named = [
            on.clone(),
            card,
            ("card.output_names", text("foot")),
            ("card.outputs", Value::Numbers(vec![25.0])),
        ];
        assert_eq!(codes(&lab(), &named), none);
        let adapter = ("machine.output", text("adapter"));
        assert_eq!(codes(&virtual_drill(), &[on, alone, adapter]), ["machine.foot_beside_adapter"]);
    }
}
