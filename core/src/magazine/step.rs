//! The 24 steps of a tool change, in the order of the paper, and the sensor states required before and after
//! each.
//! ```text
//!  old tool   1 Z up  2 foot up  3 X  4 Y  5 Z down  6 clamp opens  7 wait  8 Z up  9 pause  10 put back?
//!  new tool  11 Z up 12 pause   13 X 14 Y 15 Z down 16 clamp closes 17 wait 18 Z up 19 pause  20 taken?
//!  job       21 Z up 22 pause   23 foot ready  24 back to the job's position
//! ```
//!
//! The paper lowers the foot at step 23. Here the foot is lowered at each hole, so step 23 only checks that
//! it is up.
//!
//! Inputs are bit sets.

use crate::code;
use crate::diagnostic::Diagnostic;
use crate::job::Input;
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ChangeStep {
    /// Spindle off, Z up.
    RaiseZ,
    RaiseFoot,
    XToOld,
    YToOld,
    /// Z down to the height of the tool in its slot.
    LowerToOld,
    OpenClamp,
    WaitOpen,
    /// Z up; the tool stays in its slot.
    RaiseFromOld,
    /// X and Y to the pause position.
    PauseWithout,
    CheckPutBack,
    RaiseBeforeNew,
    /// X and Y to the pause position, before the new tool is fetched.
    PauseBeforeNew,
    XToNew,
    YToNew,
    /// Z down to the height of the tool in its slot.
    LowerToNew,
    CloseClamp,
    WaitClosed,
    /// Z up, with the tool.
    RaiseFromNew,
    /// X and Y to the pause position, with the new tool.
    PauseWithNew,
    CheckTaken,
    /// Z up, before the job continues.
    RaiseAtEnd,
    /// X and Y to the pause position, before the job continues.
    PauseAtEnd,
    FootReady,
    /// Back to where the job continues.
    GoOn,
}

/// Required input states, as bit sets. Inputs that the machine lacks are not checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Looks {
    pub on: u32,
    pub off: u32,
}

impl Looks {
    const fn and_on(self, input: Input) -> Self {
        Self { on: self.on | input.bit(), ..self }
    }

    const fn and_off(self, input: Input) -> Self {
        Self { off: self.off | input.bit(), ..self }
    }

    /// The first input in the wrong state, and its state. Only inputs in `told` are checked.
    pub fn wrong(self, told: u32, inputs: u32) -> Option<(Input, bool)> {
        let (missing, there) = (self.on & told & !inputs, self.off & told & inputs);
        Input::ALL.into_iter().find_map(|input| match (missing & input.bit(), there & input.bit()) {
            (0, 0) => None,
            (missing, _) => Some((input, missing == 0)),
        })
    }
}

const NOTHING: Looks = Looks { on: 0, off: 0 };

/// The spindle holds a tool in a closed clamp.
const HOLDS: Looks = NOTHING.and_on(Input::ToolHeld).and_off(Input::ClampOpen);

const EMPTY: Looks = NOTHING.and_off(Input::ToolHeld);

impl ChangeStep {
    pub const ALL: [Self; 24] = [
        Self::RaiseZ,
        Self::RaiseFoot,
        Self::XToOld,
        Self::YToOld,
        Self::LowerToOld,
        Self::OpenClamp,
        Self::WaitOpen,
        Self::RaiseFromOld,
        Self::PauseWithout,
        Self::CheckPutBack,
        Self::RaiseBeforeNew,
        Self::PauseBeforeNew,
        Self::XToNew,
        Self::YToNew,
        Self::LowerToNew,
        Self::CloseClamp,
        Self::WaitClosed,
        Self::RaiseFromNew,
        Self::PauseWithNew,
        Self::CheckTaken,
        Self::RaiseAtEnd,
        Self::PauseAtEnd,
        Self::FootReady,
        Self::GoOn,
    ];

    /// Number in the paper, 1 … 24.
    pub fn number(self) -> usize {
        self as usize + 1
    }

    /// Message key of the name.
    pub const fn sentence_key(self) -> &'static str {
        match self {
            Self::RaiseZ => "change.raise_z",
            Self::RaiseFoot => "change.raise_foot",
            Self::XToOld => "change.x_to_old",
            Self::YToOld => "change.y_to_old",
            Self::LowerToOld => "change.lower_to_old",
            Self::OpenClamp => "change.open_clamp",
            Self::WaitOpen => "change.wait_open",
            Self::RaiseFromOld => "change.raise_from_old",
            Self::PauseWithout => "change.pause_without",
            Self::CheckPutBack => "change.check_put_back",
            Self::RaiseBeforeNew => "change.raise_before_new",
            Self::PauseBeforeNew => "change.pause_before_new",
            Self::XToNew => "change.x_to_new",
            Self::YToNew => "change.y_to_new",
            Self::LowerToNew => "change.lower_to_new",
            Self::CloseClamp => "change.close_clamp",
            Self::WaitClosed => "change.wait_closed",
            Self::RaiseFromNew => "change.raise_from_new",
            Self::PauseWithNew => "change.pause_with_new",
            Self::CheckTaken => "change.check_taken",
            Self::RaiseAtEnd => "change.raise_at_end",
            Self::PauseAtEnd => "change.pause_at_end",
            Self::FootReady => "change.foot_ready",
            Self::GoOn => "change.go_on",
        }
    }

    /// Required before the step. Every step also needs a closed cover and compressed air.
    pub const fn before(self) -> Looks {
        let looks = match self {
            Self::XToOld | Self::YToOld => HOLDS,
            Self::LowerToOld => HOLDS.and_off(Input::PlaceTaken),
            Self::XToNew | Self::YToNew => EMPTY.and_on(Input::ClampOpen),
            Self::LowerToNew => EMPTY.and_on(Input::ClampOpen).and_on(Input::PlaceTaken),
            _ => NOTHING,
        };
        looks.and_off(Input::CoverOpen).and_on(Input::Air)
    }

    /// Required after the step.
    pub const fn after(self) -> Looks {
        match self {
            Self::RaiseFoot | Self::FootReady => NOTHING.and_off(Input::FootDown),
            Self::YToOld => HOLDS.and_off(Input::PlaceTaken),
            Self::WaitOpen => NOTHING.and_on(Input::ClampOpen),
            Self::RaiseFromOld => EMPTY.and_on(Input::PlaceTaken),
            Self::CheckPutBack => EMPTY,
            Self::YToNew => EMPTY.and_on(Input::PlaceTaken),
            Self::WaitClosed => NOTHING.and_off(Input::ClampOpen),
            Self::RaiseFromNew => HOLDS.and_off(Input::PlaceTaken),
            Self::PauseWithNew | Self::CheckTaken | Self::PauseAtEnd | Self::GoOn => HOLDS,
            _ => NOTHING,
        }
    }

    /// The alarm for `input`, which has the wrong state at this step.
    pub fn alarm(self, (input, is_on): (Input, bool)) -> Diagnostic {
        let code = match (input, is_on) {
            (Input::CoverOpen, _) => code!("magazine.cover_open"),
            (Input::Air, _) => code!("magazine.no_air"),
            (Input::FootDown, _) => code!("magazine.foot_down"),
            (Input::ClampOpen, true) => code!("magazine.clamp_open"),
            (Input::ClampOpen, false) => code!("magazine.clamp_closed"),
            (Input::PlaceTaken, true) => code!("magazine.place_taken"),
            (Input::PlaceTaken, false) => code!("magazine.place_empty"),
            (_, true) => code!("magazine.tool_still_held"),
            (_, false) => code!("magazine.no_tool"),
        };
        Diagnostic::error(code).with("step", self.number()).with("steps", Self::ALL.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::locale;

    #[test]
    fn change_steps_are_ordered_and_named_in_every_language() {
        for (at, step) in ChangeStep::ALL.into_iter().enumerate() {
            assert_eq!(step.number(), at + 1);
            let names: Vec<String> =
                ["en", "pl", "zh"].map(|lang| locale::text(lang, step.sentence_key(), &[])).to_vec();
            assert!(names.iter().all(|name| !name.is_empty() && !name.contains("change.")), "{names:?}");
            assert!(names[0] != names[1] && names[0] != names[2], "{names:?}");
        }
    }

    #[test]
    fn every_sensor_check_refuses_with_its_own_text() {
        let all = Input::ALL.into_iter().fold(0, |all, input| all | input.bit());
        let mut seen = std::collections::BTreeSet::new();
        for step in ChangeStep::ALL {
            for looks in [step.before(), step.after()] {
                assert_eq!(looks.on & looks.off, 0, "{step:?}");
                assert_eq!(looks.wrong(all, looks.on), None, "{step:?}");
                for input in Input::ALL {
                    let turned = looks.on ^ input.bit();
                    let expected = (looks.on | looks.off) & input.bit() != 0;
                    let found = looks.wrong(all, turned);
                    assert_eq!(
                        found,
                        expected.then_some((input, looks.off & input.bit() != 0)),
                        "{step:?} {input:?}"
                    );
                    assert_eq!(looks.wrong(all & !input.bit(), turned), None, "nobody tells of it");
                    let Some(wrong) = found else { continue };
                    let why = step.alarm(wrong);
                    let message = why.message("en");
                    assert!(message.contains(&format!("{} of 24", step.number())), "{message}");
                    assert!(!why.advice("en").is_empty());
                    seen.insert(why.code.clone());
                }
            }
        }
        assert_eq!(seen.len(), 9, "{seen:?}");
    }
}
