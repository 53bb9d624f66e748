//! What keys at a terminal are for while a job runs at a controller: overrides, pause, resume.
//!
//! Comes in: keys. Goes out: asks, and what became of them in words. Does not know a terminal.

use super::operator::{MOST_LINES, Operator};
use crate::cli::say;
use annulus_core::controller::{EngineAsk, EnginePhase, OverrideOf};

/// A press of a key makes it so many percent more or less.
const STEP_PERCENT: i16 = 10;
/// What is said of the keys.
const KEYS: &str = "Keys: + and - Feed override; ] and [ Spindle override; r Rapid override; 0 all as programmed; \
    space Pause, Resume; ? these keys; Ctrl-C stops.";

impl Operator {
    /// Says which keys there are.
    pub(super) fn tells_keys(&self) {
        if self.keys.is_some() {
            say(KEYS);
        }
    }

    /// Lines are wanted from now on, or keys again.
    pub(super) fn types(&mut self, lines: bool) {
        if let Some(keys) = &mut self.keys {
            keys.type_lines(lines);
        }
    }

    /// A key was pressed: a sign of a line where lines are wanted; else it does what it is for while a job runs.
    pub(super) fn pressed(&mut self, key: u8) {
        let Some(keys) = &mut self.keys else { return };
        if keys.types() {
            let line = keys.typed(key);
            if self.lines.len() < MOST_LINES {
                self.lines.extend(line);
            }
            return;
        }
        let phase = self.phase();
        if key == b' ' && self.stands() {
            return self.resumes();
        }
        if !matches!(phase, Some(EnginePhase::Running | EnginePhase::Holding | EnginePhase::Held)) {
            return;
        }
        match key {
            b'+' | b'=' => self.override_by(OverrideOf::Feed, STEP_PERCENT),
            b'-' => self.override_by(OverrideOf::Feed, -STEP_PERCENT),
            b']' => self.override_by(OverrideOf::Spindle, STEP_PERCENT),
            b'[' => self.override_by(OverrideOf::Spindle, -STEP_PERCENT),
            b'r' => {
                let next = match self.percent(OverrideOf::Rapid) {
                    100 => 50,
                    50 => 25,
                    _ => 100,
                };
                self.override_to(OverrideOf::Rapid, next);
            }
            b'0' => [OverrideOf::Feed, OverrideOf::Rapid, OverrideOf::Spindle]
                .into_iter()
                .for_each(|of| self.override_to(of, 100)),
            b' ' if phase == Some(EnginePhase::Running) => {
                say("Pause.");
                self.owner.ask(EngineAsk::Hold);
            }
            b' ' if phase == Some(EnginePhase::Held) => self.resumes(),
            b'?' => say(KEYS),
            _ => {}
        }
    }

    /// Whether a door or a button at the board itself holds it.
    pub(super) fn stands(&self) -> bool {
        self.now.as_ref().is_some_and(|now| now.stands)
    }

    pub(super) fn resumes(&self) {
        say("Resume.");
        self.owner.ask(EngineAsk::Resume);
    }

    /// Percent as they were asked for last, else as they are reported.
    fn percent(&mut self, of: OverrideOf) -> u16 {
        let row = of as usize;
        let reported = self.now.as_ref().map_or(100, |now| now.overrides[row]);
        let Some(keys) = &mut self.keys else { return reported };
        keys.wanted[row] = keys.wanted[row].filter(|wanted| *wanted != reported);
        keys.wanted[row].unwrap_or(reported)
    }

    fn override_by(&mut self, of: OverrideOf, step: i16) {
        let percent = self.percent(of).saturating_add_signed(step).clamp(10, 200);
        self.override_to(of, percent);
    }

    fn override_to(&mut self, of: OverrideOf, percent: u16) {
        let name = match of {
            OverrideOf::Feed => "Feed override",
            OverrideOf::Rapid => "Rapid override",
            OverrideOf::Spindle => "Spindle override",
        };
        say(format_args!("{name}: {percent} %."));
        if let Some(keys) = &mut self.keys {
            keys.wanted[of as usize] = Some(percent);
        }
        self.owner.ask(EngineAsk::Override { of, percent: percent as u8 });
    }

    /// An override was not taken: the next key goes by what is reported.
    pub(super) fn forgets_keys(&mut self) {
        if let Some(keys) = &mut self.keys {
            keys.wanted = [None; 3];
        }
    }
}
