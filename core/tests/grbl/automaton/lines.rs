//! Lines of the simulated controller: `$` commands and jogs. All other lines go to the G-code interpreter.

use super::{Automaton, Block, Counts, Lock, Modal};

impl Automaton {
    pub(super) fn try_pending(&mut self) {
        let Some(line) = self.pending.clone() else { return };
        let text = String::from_utf8_lossy(&line).into_owned();
        match self.run(&text) {
            Ok(true) => {
                self.pending = None;
                if self.dwell_ms <= 0.0 {
                    self.say("ok");
                }
            }
            Ok(false) => {}
            Err(number) => {
                self.pending = None;
                self.say(&format!("error:{number}"));
            }
        }
    }

    fn run(&mut self, text: &str) -> Result<bool, u16> {
        if text.is_empty() {
            return Ok(true);
        }
        if let Some(rest) = text.strip_prefix('$') {
            return self.system(rest);
        }
        if self.lock == Lock::Alarm {
            return Err(9);
        }
        let words = words(text)?;
        self.gcode(&words)
    }

    /// A jog in mm, relative or to machine coordinates (G53).
    fn jog(&mut self, text: &str) -> Result<bool, u16> {
        if self.lock == Lock::Alarm {
            return Err(9);
        }
        if !self.queue.is_empty() && !self.jogs() {
            return Err(8);
        }
        if self.refuses_jogs {
            return Err(15);
        }
        let words = words(text)?;
        let value = |letter: char| words.iter().find(|(name, _)| *name == letter).map(|(_, value)| *value);
        let per_ms = value('F').ok_or(22_u16)? / 60_000.0;
        let is_a_place = words.contains(&('G', 53.0));
        for (axis, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            let Some(value) = value(letter) else { continue };
            self.planned[axis] = if is_a_place { value } else { self.planned[axis] + value };
        }
        self.queue.push_back(Block { to: self.planned, per_ms, probes: false, by_hand: true });
        Ok(true)
    }

    fn system(&mut self, rest: &str) -> Result<bool, u16> {
        if let Some(text) = rest.strip_prefix("J=") {
            return self.jog(text);
        }
        match rest {
            "" => self.say("[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]"),
            "$" => {
                for (number, value) in self.settings.clone() {
                    self.say(&format!("${number}={value:.3}"));
                }
            }
            "I" => {
                self.say("[VER:1.1h.20190830:]");
                self.say(if self.counts == Counts::FromThere { "[OPT:VZ,15,128]" } else { "[OPT:V,15,128]" });
            }
            "#" => {
                for (index, zero) in self.zeros.into_iter().enumerate() {
                    let words = self.words(zero);
                    self.say(&format!("[G{}:{words}]", 54 + index));
                }
                let shift = self.words(self.shift);
                self.say(&format!("[G92:{shift}]"));
                self.say(&format!("[TLO:{:.3}]", self.length));
                self.say(&self.probed.clone());
            }
            "G" => {
                let Modal { relative, motion, feed, speed, spindle, zero, inches } = self.modal.clone();
                let (distance, unit) = (if relative { 91 } else { 90 }, if inches { 20 } else { 21 });
                let (zero, feed) = (54 + zero, self.rate(feed));
                self.say(&format!(
                    "[GC:G{motion} G{zero} G17 G{unit} G{distance} G94 M{spindle} M9 T{} F{feed} S{speed:.0}]",
                    self.tool
                ));
            }
            "C" if !self.checks => return Err(3),
            "C" if self.check => {
                self.say("[MSG:Disabled]");
                self.say("ok");
                self.soft_reset();
                return Ok(false);
            }
            "C" if self.lock == Lock::Alarm || !self.queue.is_empty() => return Err(8),
            "C" => {
                self.check = true;
                self.say("[MSG:Enabled]");
            }
            "X" => {
                self.lock = Lock::None;
                self.say("[MSG:Caution: Unlocked]");
            }
            "H" => {
                if !self.queue.is_empty() {
                    return Err(8);
                }
                self.lock = Lock::None;
                self.home();
                self.dwell_ms = 1_000.0;
            }
            _ => self.set(rest)?,
        }
        Ok(true)
    }

    fn set(&mut self, text: &str) -> Result<(), u16> {
        let (number, value) = text.split_once('=').ok_or(3_u16)?;
        let (number, value) = (number.parse().map_err(|_| 3_u16)?, value.parse().map_err(|_| 2_u16)?);
        self.settings.retain(|(known, _)| *known != number);
        self.settings.push((number, value));
        self.zero_due = 0;
        Ok(())
    }
}

fn words(text: &str) -> Result<Vec<(char, f64)>, u16> {
    let mut found: Vec<(char, f64)> = Vec::new();
    let mut rest = text;
    while let Some(letter) = rest.chars().next() {
        if !letter.is_ascii_uppercase() {
            return Err(1);
        }
        let end = rest[1..]
            .find(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'))
            .map_or(rest.len(), |at| at + 1);
        let value = rest[1..end].parse().map_err(|_| 2_u16)?;
        if !matches!(letter, 'G' | 'M') && found.iter().any(|(name, _)| *name == letter) {
            return Err(25);
        }
        found.push((letter, value));
        rest = &rest[end..];
    }
    Ok(found)
}
