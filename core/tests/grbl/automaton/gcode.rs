//! G-code of the simulated controller: parses the words of a line, checks them against each other and
//! executes them.

use super::{Automaton, BLOCKS, Block, Lock, Modal, RAPID_MM};

const AXES: [(usize, char); 3] = [(0, 'X'), (1, 'Y'), (2, 'Z')];

struct Said<'a> {
    words: &'a [(char, f64)],
    modal: Modal,
    dwells: bool,
    /// The line sets a coordinate system (G10).
    writes: bool,
    of_machine: bool,
    fetches: bool,
}

impl Said<'_> {
    fn value(&self, letter: char) -> Option<f64> {
        self.words.iter().find(|(name, _)| *name == letter).map(|(_, value)| *value)
    }

    fn has(&self, word: (char, f64)) -> bool {
        self.words.contains(&word)
    }

    fn moves(&self) -> bool {
        AXES.into_iter().any(|(_, axis)| self.value(axis).is_some())
    }

    fn probes(&self) -> bool {
        self.words.iter().any(|(letter, number)| *letter == 'G' && (38.0..39.0).contains(number))
    }

    /// Spindle words take effect only after all earlier moves have ended.
    fn switches(&self) -> bool {
        self.words.iter().any(|(letter, _)| matches!(letter, 'M' | 'S'))
    }

    fn unit_mm(&self) -> f64 {
        if self.modal.inches { 25.4 } else { 1.0 }
    }
}

impl Automaton {
    pub(super) fn gcode(&mut self, words: &[(char, f64)]) -> Result<bool, u16> {
        let said = self.read(words)?;
        if said.has(('G', 49.0)) {
            self.length = 0.0;
        }
        if said.has(('G', 92.1)) {
            self.shift = [0.0; 3];
        }
        let waits = said.dwells || said.writes || said.probes() && self.probing.is_none() || said.switches();
        if (waits && !self.queue.is_empty()) || self.queue.len() >= BLOCKS {
            return Ok(false);
        }
        if said.dwells {
            let waits_ms = said.value('P').filter(|p| *p >= 0.0).ok_or(28_u16)? * 1e3;
            self.dwell_ms = if self.check { 0.0 } else { waits_ms };
        } else if self.fetches(&said) {
            return Ok(true);
        } else if said.writes {
            self.write_zero(&said)?;
        } else if let Some(done) = said.probes().then(|| self.answer_of_probe(&said)).flatten() {
            return Ok(done);
        } else if said.moves() && !self.go_to(&said)? {
            return Ok(false);
        }
        self.modal = said.modal;
        Ok(true)
    }

    fn read<'a>(&self, words: &'a [(char, f64)]) -> Result<Said<'a>, u16> {
        let modal = self.modal.clone();
        let mut said = Said { words, modal, dwells: false, writes: false, of_machine: false, fetches: false };
        let mut motions = 0;
        for (letter, number) in words {
            match (letter, (number * 10.0).round() as i64) {
                ('G', 0 | 10 | 20 | 30 | 382 | 383) => {
                    motions += 1;
                    said.modal.motion = if *number > 38.0 { 1 } else { *number as u32 };
                }
                ('G', 40) => said.dwells = true,
                ('M', 60) if self.rack.is_some() => said.fetches = true,
                ('G', 430) | ('T' | 'H', _) if self.rack.is_some() => {}
                ('G', 530) => said.of_machine = true,
                ('G', 100) => said.writes = true,
                ('G', 170 | 490 | 921 | 940) => {}
                ('G', 200) => said.modal.inches = true,
                ('G', 210) => said.modal.inches = false,
                ('G', code @ 540..=590) if code % 10 == 0 => said.modal.zero = (code / 10 - 54) as usize,
                ('G', 900) => said.modal.relative = false,
                ('G', 910) => said.modal.relative = true,
                ('M', 30 | 40 | 50) => said.modal.spindle = *number as u32,
                ('M', 70) if !self.has_mist => return Err(20),
                ('M', 70 | 80 | 90) => {}
                // Pauses and program end: no effect in check mode.
                ('M', 0 | 10 | 20 | 300) => {}
                ('F', _) => said.modal.feed = *number,
                ('S', _) => said.modal.speed = *number,
                ('X' | 'Y' | 'Z' | 'I' | 'J' | 'P' | 'L', _) => {}
                _ => return Err(20),
            }
        }
        match () {
            () if motions > 1 || (motions > 0 && (said.dwells || said.writes)) => Err(21),
            () if said.of_machine && said.modal.motion > 1 => Err(30),
            () if said.modal.zero > 5 => Err(29),
            () => Ok(said),
        }
    }

    /// Selects a tool or makes the changer fetch it. Returns `true` if that completes the line.
    fn fetches(&mut self, said: &Said<'_>) -> bool {
        let Some(rack) = self.rack else { return false };
        if let Some(tool) = said.value('T') {
            self.tool = tool as u32;
        }
        if let Some(tool) = said.value('H') {
            self.length = rack(tool as u32);
        }
        if said.fetches {
            (self.tool_mm, self.dwell_ms) = (rack(self.tool), 400.0);
            self.fetched_turning |= self.modal.spindle != 5;
            self.fetched.push(self.tool);
        }
        said.fetches
    }

    fn write_zero(&mut self, said: &Said<'_>) -> Result<(), u16> {
        // L20 gives the position of the tool in the new coordinates, L2 gives the zero itself.
        let here = match said.value('L') {
            Some(2.0) => false,
            Some(20.0) => true,
            _ => return Err(20),
        };
        let place = said.value('P').filter(|p| (1.0..=6.0).contains(p)).ok_or(29_u16)? as usize - 1;
        for (axis, letter) in AXES {
            let Some(mm) = said.value(letter).map(|value| value * said.unit_mm()) else { continue };
            let length = if axis == 2 { self.length } else { 0.0 };
            let here_mm = self.planned[axis] - self.shift[axis] - length - mm;
            self.zeros[place][axis] = if here { here_mm } else { mm };
        }
        self.zero_due = 0;
        Ok(())
    }

    /// Result of the running probe, or the reason why no probe starts; `None` if it starts now.
    fn answer_of_probe(&mut self, said: &Said<'_>) -> Option<bool> {
        let Some(met) = self.probing else {
            self.must_meet = said.has(('G', 38.2));
            if !self.touches() {
                return None;
            }
            self.lock = Lock::Alarm;
            self.say("ALARM:4");
            return Some(true);
        };
        if !self.queue.is_empty() {
            return Some(false);
        }
        self.probing = None;
        let place = if met { self.latched } else { self.at };
        let words = self.words(place);
        self.probed = format!("[PRB:{words}:{}]", u8::from(met));
        self.say(&self.probed.clone());
        if self.must_meet && !met {
            self.lock = Lock::Alarm;
            self.say("ALARM:5");
        }
        Some(true)
    }

    /// Plans a move. Returns `false` if the line has to wait for the end of a move.
    fn go_to(&mut self, said: &Said<'_>) -> Result<bool, u16> {
        let modal = &said.modal;
        if modal.motion > 0 && modal.feed <= 0.0 {
            return Err(22);
        }
        if modal.motion < 2 && (said.value('I').is_some() || said.value('J').is_some()) {
            return Err(36);
        }
        let to = self.place_of(said);
        let has_soft_limits = self.settings.iter().any(|row| row.0 == 20 && row.1 != 0.0);
        if has_soft_limits && to.iter().any(|mm| !(-300.0..=0.0).contains(mm)) {
            self.is_stopped(2);
            return Ok(false);
        }
        if self.check {
            return Ok(true);
        }
        let per_ms = if modal.motion == 0 { RAPID_MM } else { (modal.feed / 60_000.0).min(RAPID_MM) };
        let probes = said.probes();
        self.queue.push_back(Block { to, per_ms, probes, by_hand: false });
        self.planned = to;
        if probes {
            (self.probing, self.modal) = (Some(false), modal.clone());
        }
        Ok(!probes)
    }

    fn place_of(&self, said: &Said<'_>) -> [f64; 3] {
        let zero = self.zeros[said.modal.zero];
        let mut to = self.planned;
        for (axis, letter) in AXES {
            let Some(mm) = said.value(letter).map(|value| value * said.unit_mm()) else { continue };
            let length = if axis == 2 { self.length } else { 0.0 };
            let zero_mm = zero[axis] + self.shift[axis] + length;
            to[axis] = match () {
                () if said.of_machine => mm,
                () if said.modal.relative => to[axis] + mm,
                () => mm + zero_mm,
            };
        }
        to
    }
}
