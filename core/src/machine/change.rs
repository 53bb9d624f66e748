//! Manual tool changes on machines that Annulus drives itself: position, height, and how tool lengths are
//! known.

use super::field::{NONE, PROBING, STEPS, Setting, YES_NO, fields, words};
use super::value::Value;
use super::value::ValueKind::Number;
use super::{Axis, Machine, Output, Steps, ToolChange};
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::units::Length;

pub(super) const LENGTHS_KEY: &str = "change.lengths";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HandChange {
    pub at: ChangeAt,
    /// Height of the tip over the board's surface, limited by the travel of Z.
    pub height: Length,
    pub lengths: Lengths,
    pub setter: ChangeSetter,
}

/// A tool setter: a pin or switch at a fixed height that closes the contact of every tool.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChangeSetter {
    /// True if the machine has one.
    pub on: bool,
    /// X and Y, machine coordinates.
    pub place: [Length; 2],
    /// Greatest distance down to find it.
    pub depth: Length,
}

impl Default for ChangeSetter {
    fn default() -> Self {
        Self { on: false, place: [Length::ZERO; 2], depth: Length::from_um(30_000) }
    }
}

impl Default for HandChange {
    fn default() -> Self {
        Self {
            at: ChangeAt::Park,
            height: Length::from_um(20_000),
            lengths: Lengths::Touch,
            setter: ChangeSetter::default(),
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ChangeAt {
    #[default]
    Park,
    /// The work zero.
    Zero,
}

/// How the length of a tool is known after a change.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lengths {
    /// Each tool is touched off on the board before it cuts.
    #[default]
    Touch,
    /// All tools are equally long, as the user declares.
    Equal,
}

impl Machine {
    /// Height over the board for tool changes: the setting, limited by Z's travel and never below the safe
    /// height.
    pub fn change_height(&self) -> Length {
        let room = self.z.max - self.process.surface;
        self.change.height.min(room).max(self.process.safe_height)
    }

    /// True if all tools are equally long: declared, or because the user doesn't change them.
    pub fn has_equal_lengths(&self) -> bool {
        self.change.lengths == Lengths::Equal || !self.is_changed_by_hand()
    }

    /// True if the user changes the tools.
    pub fn is_changed_by_hand(&self) -> bool {
        self.tool_change == ToolChange::Manual && !self.has_magazine()
    }

    /// Height of the tip for tool changes in machine steps, over a board with its surface at `surface_steps`.
    pub fn change_steps(&self, surface_steps: &Steps) -> i64 {
        // Above the rest position of homing, Z would reach its switch.
        let top = self.z.scale.steps(self.z.max - self.z.home_offset);
        (surface_steps[2] + self.z.scale.steps(self.change_height())).min(top)
    }
}

/// On a change to a real output, equal lengths must be declared again: the virtual drill's declaration isn't
/// inherited.
pub(super) fn settle(machine: &mut Machine, before: &Machine, changes: &[(String, Value)]) {
    let is_declared = changes.iter().any(|(key, _)| key == LENGTHS_KEY);
    if machine.output != Output::Virtual && machine.output != before.output && !is_declared {
        machine.change.lengths = Lengths::Touch;
    }
}

/// Problems with the tool setter of `machine`; an unused one may be anywhere.
pub(super) fn validate(machine: &Machine) -> Vec<Diagnostic> {
    let setter = machine.change.setter;
    let rows: [(&str, Length, &Axis); 2] =
        [("change.setter_x", setter.place[0], &machine.x), ("change.setter_y", setter.place[1], &machine.y)];
    let outside = rows.into_iter().filter(|(_, at, axis)| setter.on && !(axis.min..=axis.max).contains(at));
    outside
        .map(|(key, at, axis)| {
            let why = error!("machine.setter_out_of_reach", key = key, value = at.mm(), ..);
            why.with("low", axis.min.mm()).with("high", axis.max.mm())
        })
        .collect()
}

words!(ChangeAt: "park" => ChangeAt::Park, "zero" => ChangeAt::Zero);
words!(Lengths: "touch" => Lengths::Touch, "equal" => Lengths::Equal);

/// The section "change" of the settings table.
pub(super) const ROWS: &[Setting] = fields! { Machine;
    ("change.at", "", ChangeAt::KIND, STEPS, change.at)
    ("change.height", "mm", Number(0.0, 500.0), NONE, change.height)
    ("change.setter", "", YES_NO, PROBING.and(STEPS), change.setter.on)
    ("change.setter_x", "mm", Number(-2_000.0, 2_000.0), PROBING.and(STEPS), change.setter.place[0])
    ("change.setter_y", "mm", Number(-2_000.0, 2_000.0), PROBING.and(STEPS), change.setter.place[1])
    ("change.setter_depth", "mm", Number(1.0, 500.0), PROBING.and(STEPS), change.setter.depth)
    (LENGTHS_KEY, "", Lengths::KIND, PROBING.and(STEPS), change.lengths)
};

#[cfg(test)]
mod tests {
    use super::super::{apply, presets, virtual_drill};
    use super::*;

    fn changed(changes: &[(&str, &str)]) -> Machine {
        let all: Vec<_> =
            changes.iter().map(|(key, word)| ((*key).to_owned(), Value::Text((*word).to_owned()))).collect();
        apply(&virtual_drill(), &all).unwrap()
    }

    #[test]
    fn only_the_virtual_drill_has_equal_tool_lengths_by_default() {
        for (name, machine) in presets() {
            assert_eq!(machine.has_equal_lengths(), machine.output == Output::Virtual, "{name}");
        }
        let rows: [(&[(&str, &str)], Lengths); 4] = [
            (&[], Lengths::Equal),
            // A file from before this setting.
            (&[("machine.output", "parallel")], Lengths::Touch),
            (&[("machine.output", "parallel"), ("change.lengths", "equal")], Lengths::Equal),
            (&[("change.lengths", "equal"), ("machine.output", "parallel")], Lengths::Equal),
        ];
        for (changes, wanted) in rows {
            assert_eq!(changed(changes).change.lengths, wanted, "{changes:?}");
        }
    }

    #[test]
    fn change_height_is_limited_by_the_travel_of_z() {
        let mm = Length::from_mm;
        // Setting, top of Z, surface, safe height: change height over the board.
        let rows = [
            (20.0, 0.0, -30.0, 20.0),
            (20.0, 0.0, -12.0, 12.0),
            (0.0, 0.0, -30.0, 2.0),
            (45.0, 0.0, -30.0, 30.0),
        ];
        for (setting, top, surface, wanted) in rows {
            let mut machine = virtual_drill();
            (machine.change.height, machine.z.max, machine.process.surface) =
                (mm(setting), mm(top), mm(surface));
            assert_eq!(machine.change_height(), mm(wanted), "{setting} {surface}");
            assert!(machine.change_steps(&machine.on_surface()) <= machine.z.scale.steps(machine.z.max));
        }
    }
}
