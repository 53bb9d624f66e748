//! The table of work commands: name, the paper's name, arguments with unit and range. Parser, page and manual
//! use it. The locale tables hold descriptions under [`Word::sentence_key`].

use crate::job::Input;
use crate::units::Length;
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Axes {
    /// Z first, then X, then Y.
    All,
    X,
    Y,
    Z,
}

impl Axes {
    const NAMES: [&'static str; 4] = ["ALL", "X", "Y", "Z"];
    const EVERY: [Self; 4] = [Self::All, Self::X, Self::Y, Self::Z];

    /// Axes in the order of homing: 0 X, 1 Y, 2 Z.
    pub const fn in_order(self) -> &'static [usize] {
        match self {
            Self::All => &[2, 0, 1],
            Self::X => &[0],
            Self::Y => &[1],
            Self::Z => &[2],
        }
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WorkCommand {
    /// Move X and Y by motor steps.
    MoveBy {
        dx: i64,
        dy: i64,
    },
    /// Move to a position from the work zero.
    MoveTo {
        x: Length,
        y: Length,
    },
    /// Down through the board: to the lower switch if the machine has one, else by counted steps.
    DrillDown,
    /// Up to the safe height.
    DrillUp,
    /// To the limit switches.
    Home {
        axes: Axes,
    },
    Park,
    Wait {
        ms: u32,
    },
    /// Wait for the level of an input.
    WaitInput {
        input: Input,
        /// Wait until it is on, else until it is off.
        on: bool,
        /// Longest wait, in ms; then the queue stops with an alarm.
        timeout_ms: u32,
    },
    Output {
        name: String,
        on: bool,
        /// If set, the output switches back after this time, in ms.
        pulse_ms: Option<u32>,
    },
    Spindle {
        /// In rpm; 0 is off.
        rpm: u32,
    },
    Repeat {
        /// Repetitions, from 1.
        times: u32,
    },
    /// Rows up to the matching `END` that run only when called.
    Sub {
        name: String,
    },
    Call {
        name: String,
    },
    End,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ArgumentValue {
    /// An integer in the argument's unit.
    Whole(i64),
    Mm(Length),
    Text(String),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ArgumentKind {
    /// An integer from … to ….
    Whole(i64, i64),
    /// Millimetres from … to …, with at most six decimals.
    Mm(i64, i64),
    Choice(&'static [&'static str]),
    /// A letter, then letters, digits or `_`, at most 32 in total.
    Name,
}

#[derive(Clone, Copy, Debug)]
pub struct Argument {
    /// Name in error messages.
    pub name: &'static str,
    /// Unit of its numbers; empty for words.
    pub unit: &'static str,
    pub kind: ArgumentKind,
    /// May be omitted.
    pub optional: bool,
}

impl Argument {
    pub fn sentence_key(&self) -> String {
        format!("queue.argument.{}", self.name.to_lowercase())
    }
}

#[derive(Clone, Copy, Debug)]
pub struct Word {
    /// Printed name.
    pub name: &'static str,
    /// Other accepted spellings, those of the paper first.
    pub aliases: &'static [&'static str],
    pub arguments: &'static [Argument],
    make: fn(&[ArgumentValue]) -> WorkCommand,
    split: fn(&WorkCommand) -> Option<Vec<ArgumentValue>>,
}

impl Word {
    pub fn sentence_key(&self) -> String {
        format!("queue.word.{}", self.name.to_lowercase())
    }

    /// The command with these values, which must have the right types and ranges.
    pub(super) fn command(&self, values: &[ArgumentValue]) -> WorkCommand {
        (self.make)(values)
    }

    pub fn find(name: &str) -> Option<&'static Self> {
        WORDS.iter().find(|word| word.spellings().any(|other| other.eq_ignore_ascii_case(name)))
    }

    /// Every accepted spelling, the printed name first.
    pub fn spellings(&self) -> impl Iterator<Item = &'static str> {
        std::iter::once(self.name).chain(self.aliases.iter().copied())
    }
}

impl WorkCommand {
    /// The table row and the values of the command.
    pub fn split(&self) -> (&'static Word, Vec<ArgumentValue>) {
        let mut rows = WORDS.iter().filter_map(|word| (word.split)(self).map(|values| (word, values)));
        rows.next().unwrap_or((&WORDS[WORDS.len() - 1], Vec::new()))
    }
}

/// Input names, in the order of [`Input::ALL`].
pub(super) const INPUTS: [&str; Input::ALL.len()] = [
    "X_MIN",
    "X_MAX",
    "Y_MIN",
    "Y_MAX",
    "Z_TOP",
    "Z_BOTTOM",
    "CONTACT",
    "FOOT_DOWN",
    "CLAMP_OPEN",
    "TOOL_HELD",
    "PLACE_TAKEN",
    "COVER_OPEN",
    "AIR",
    "X_INDEX",
    "Y_INDEX",
    "Z_INDEX",
];
pub(super) const STATES: [&str; 2] = ["OFF", "ON"];

fn whole(values: &[ArgumentValue], at: usize) -> i64 {
    if let Some(ArgumentValue::Whole(whole)) = values.get(at) { *whole } else { 0 }
}
fn count(values: &[ArgumentValue], at: usize) -> u32 {
    u32::try_from(whole(values, at)).unwrap_or(0)
}
fn mm(values: &[ArgumentValue], at: usize) -> Length {
    if let Some(ArgumentValue::Mm(length)) = values.get(at) { *length } else { Length::ZERO }
}
fn text(values: &[ArgumentValue], at: usize) -> String {
    if let Some(ArgumentValue::Text(text)) = values.get(at) { text.clone() } else { String::new() }
}
fn choice(values: &[ArgumentValue], at: usize, words: &[&str]) -> usize {
    let text = text(values, at);
    words.iter().position(|word| *word == text).unwrap_or(0)
}
fn said(word: &str) -> ArgumentValue {
    ArgumentValue::Text(word.to_owned())
}
fn state(on: bool) -> ArgumentValue {
    said(STATES[usize::from(on)])
}

const fn argument(name: &'static str, unit: &'static str, kind: ArgumentKind) -> Argument {
    Argument { name, unit, kind, optional: false }
}

const STEPS: ArgumentKind = ArgumentKind::Whole(-1_000_000, 1_000_000);
const PLACE: ArgumentKind = ArgumentKind::Mm(-2_000, 2_000);
const TIMES: ArgumentKind = ArgumentKind::Whole(1, 10_000);
const ON_OFF: Argument = argument("state", "", ArgumentKind::Choice(&STATES));
const CALLED: Argument = argument("name", "", ArgumentKind::Name);

macro_rules! word {
    ($name:literal, $aliases:expr, $arguments:expr, $values:ident => $make:expr, $pattern:pat => $split:expr) => {
        Word {
            name: $name,
            aliases: &$aliases,
            arguments: &$arguments,
            make: |$values| $make,
            split: |command| if let $pattern = command { Some($split) } else { None },
        }
    };
}

/// All commands, in the order of the menu.
pub const WORDS: &[Word] = &[
    word!("MOVE_BY", ["KMD_GOTOdXdY"], [argument("dX", "steps", STEPS), argument("dY", "steps", STEPS)],
        v => WorkCommand::MoveBy { dx: whole(v, 0), dy: whole(v, 1) },
        WorkCommand::MoveBy { dx, dy } => vec![ArgumentValue::Whole(*dx), ArgumentValue::Whole(*dy)]),
    word!("MOVE_TO", ["KMD_GOTO_X_Y"], [argument("X", "mm", PLACE), argument("Y", "mm", PLACE)],
        v => WorkCommand::MoveTo { x: mm(v, 0), y: mm(v, 1) },
        WorkCommand::MoveTo { x, y } => vec![ArgumentValue::Mm(*x), ArgumentValue::Mm(*y)]),
    word!("DRILL_DOWN", ["KMD_WIERTLO_DOL"], [], _v => WorkCommand::DrillDown, WorkCommand::DrillDown => Vec::new()),
    word!("DRILL_UP", ["KMD_WIERTLO_GORA"], [], _v => WorkCommand::DrillUp, WorkCommand::DrillUp => Vec::new()),
    word!("HOME", ["KMD_INICJALIZACJA"], [argument("axes", "", ArgumentKind::Choice(&Axes::NAMES))],
        v => WorkCommand::Home { axes: Axes::EVERY[choice(v, 0, &Axes::NAMES)] },
        WorkCommand::Home { axes } => vec![said(Axes::NAMES[*axes as usize])]),
    word!("PARK", [], [], _v => WorkCommand::Park, WorkCommand::Park => Vec::new()),
    word!("WAIT", [], [argument("ms", "ms", ArgumentKind::Whole(0, 600_000))],
        v => WorkCommand::Wait { ms: count(v, 0) },
        WorkCommand::Wait { ms } => vec![ArgumentValue::Whole(i64::from(*ms))]),
    word!("WAIT_INPUT", [],
    [argument("input", "", ArgumentKind::Choice(&INPUTS)), ON_OFF, argument("timeout", "ms", ArgumentKind::Whole(1, 600_000))],
    v => WorkCommand::WaitInput {
        input: Input::ALL[choice(v, 0, &INPUTS)],
        on: choice(v, 1, &STATES) == 1,
        timeout_ms: count(v, 2),
    },
    WorkCommand::WaitInput { input, on, timeout_ms } => vec![
        said(INPUTS[*input as usize]), state(*on), ArgumentValue::Whole(i64::from(*timeout_ms)),
    ]),
    word!("OUTPUT", [],
    [CALLED, ON_OFF, Argument { name: "pulse", unit: "ms", kind: ArgumentKind::Whole(1, 10_000), optional: true }],
    v => WorkCommand::Output {
        name: text(v, 0),
        on: choice(v, 1, &STATES) == 1,
        pulse_ms: v.get(2).map(|_| count(v, 2)),
    },
    WorkCommand::Output { name, on, pulse_ms } => {
        let mut values = vec![said(name), state(*on)];
        values.extend(pulse_ms.map(|ms| ArgumentValue::Whole(i64::from(ms))));
        values
    }),
    word!("SPINDLE", [], [argument("rpm", "rpm", ArgumentKind::Whole(0, 300_000))],
        v => WorkCommand::Spindle { rpm: count(v, 0) },
        WorkCommand::Spindle { rpm } => vec![ArgumentValue::Whole(i64::from(*rpm))]),
    word!("REPEAT", [], [argument("times", "", TIMES)],
        v => WorkCommand::Repeat { times: count(v, 0) },
        WorkCommand::Repeat { times } => vec![ArgumentValue::Whole(i64::from(*times))]),
    word!("CALL", [], [CALLED],
        v => WorkCommand::Call { name: text(v, 0) }, WorkCommand::Call { name } => vec![said(name)]),
    word!("SUB", [], [CALLED],
        v => WorkCommand::Sub { name: text(v, 0) }, WorkCommand::Sub { name } => vec![said(name)]),
    word!("END", [], [], _v => WorkCommand::End, WorkCommand::End => Vec::new()),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::locale;

    #[test]
    fn queue_words_have_texts_and_unique_names() {
        let mut names = Vec::new();
        for word in WORDS {
            let key = word.sentence_key();
            assert!(locale::lookup("en", &key).is_some(), "no sentence {key}");
            names.extend(word.spellings().map(str::to_lowercase));
            for argument in word.arguments {
                let key = argument.sentence_key();
                assert!(locale::lookup("en", &key).is_some(), "no sentence {key}");
            }
        }
        let count = names.len();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), count, "two words share a name");
    }

    #[test]
    fn split_commands_are_restored() {
        let rows = [
            WorkCommand::MoveBy { dx: -3, dy: 9 },
            WorkCommand::MoveTo { x: Length::from_mm(1.5), y: Length::from_mm(-2.25) },
            WorkCommand::DrillDown,
            WorkCommand::DrillUp,
            WorkCommand::Home { axes: Axes::Y },
            WorkCommand::Park,
            WorkCommand::Wait { ms: 7 },
            WorkCommand::WaitInput { input: Input::ZBottom, on: true, timeout_ms: 900 },
            WorkCommand::Output { name: "lamp".into(), on: true, pulse_ms: Some(40) },
            WorkCommand::Output { name: "lamp".into(), on: false, pulse_ms: None },
            WorkCommand::Spindle { rpm: 20_000 },
            WorkCommand::Repeat { times: 3 },
            WorkCommand::Call { name: "hole".into() },
            WorkCommand::Sub { name: "hole".into() },
            WorkCommand::End,
        ];
        for command in rows {
            let (word, values) = command.split();
            assert_eq!(word.command(&values), command);
        }
    }
}
