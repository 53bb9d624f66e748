//! Keys at a terminal while a controller runs a job: overrides, pause, resume.

use super::operator::{MOST_LINES, Operator};
use crate::cli::say;
use annulus_core::grbl::{EngineAsk, EnginePhase, OverrideOf};

/// Change of an override per key press, %.
const STEP_PERCENT: i16 = 10;
/// Help on the keys.
const KEYS: &str = "Keys: + and - Feed override; ] and [ Spindle override; r Rapid override; 0 all as programmed; \
    space Pause, Resume; ? these keys; Ctrl-C stops.";

impl Operator {
    /// Prints the help on the keys.
    pub(super) fn tells_keys(&self) {
        if self.keys.is_some() {
            say(KEYS);
        }
    }

    /// Switches between lines and keys.
    pub(super) fn types(&mut self, lines: bool) {
        if let Some(keys) = &mut self.keys {
            keys.type_lines(lines);
        }
    }

    /// Handles a key: adds it to the line if lines are read; otherwise runs its command during a job.
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
                self.station.ask(EngineAsk::Hold);
            }
            b' ' if phase == Some(EnginePhase::Held) => self.resumes(),
            b'?' => say(KEYS),
            _ => {}
        }
    }

    /// Returns `true` if a door or a button at the machine holds the job.
    pub(super) fn stands(&self) -> bool {
        self.now.as_ref().is_some_and(|now| now.stands)
    }

    pub(super) fn resumes(&self) {
        say("Resume.");
        self.station.ask(EngineAsk::Resume);
    }

    /// The last requested percentage, or the reported one.
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
        self.station.ask(EngineAsk::Override { of, percent: percent as u8 });
    }

    /// After a refused override, the next key starts from the reported values.
    pub(super) fn forgets_keys(&mut self) {
        if let Some(keys) = &mut self.keys {
            keys.wanted = [None; 3];
        }
    }
}
