//! Readers for controllers whose programs consist of letters with numbers: RS-274 and its relatives. They
//! follow the controllers' manuals and are strict: an unknown word is an error.

use super::seen::{By, Seen};

#[derive(Clone, Copy, Debug)]
pub(crate) struct Rules {
    pub(crate) codes: &'static [&'static str],
    /// A semicolon begins a comment. Parentheses always enclose comments, except with Sinumerik.
    pub(crate) semicolon: bool,
    /// The letter of the pause in G4, and its unit in seconds.
    pub(crate) pause: (char, f64),
    /// Unit of P in G82, in seconds.
    pub(crate) cycle_pause: f64,
    pub(crate) longest: usize,
    /// Rapid moves use the last feed: every move must contain one.
    pub(crate) feed_in_every_move: bool,
    /// Coordinates must contain a decimal point.
    pub(crate) points: bool,
    pub(crate) numbered: Option<u64>,
}

#[derive(Default)]
struct State {
    at: [f64; 3],
    feed: Option<f64>,
    motion: u32,
    rpm: f64,
    on: bool,
    line_number: u64,
    seen: Vec<Seen>,
    ended: bool,
    no_length: bool,
    /// Z has not moved since the tool length became active.
    z_open: bool,
    incremental: bool,
    /// Height of rapid moves above the board in mm.
    safe: f64,
}

/// Height of the reference point of Z above the board in mm: higher than anything that is written.
const REFERENCE: f64 = 100.0;

fn words(line: &str) -> Result<Vec<(char, String)>, String> {
    let mut out: Vec<(char, String)> = Vec::new();
    for letter in line.chars().filter(|c| !c.is_whitespace()) {
        match out.last_mut() {
            _ if letter.is_ascii_uppercase() => out.push((letter, String::new())),
            Some((_, number)) if "+-.0123456789".contains(letter) => number.push(letter),
            _ => return Err(format!("{letter:?} in {line:?}")),
        }
    }
    Ok(out)
}

fn number(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| format!("{text:?} is no number"))
}

/// Number of the tool that a message requests: `put in tool 3`.
fn bit_in(text: &str) -> Option<u32> {
    let lower = text.to_lowercase();
    let behind = &lower[lower.find("put in tool ")? + 12..];
    behind.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

pub(crate) fn read(text: &str, safe: f64, rules: &Rules) -> Result<Vec<Seen>, String> {
    // On controllers with tool lengths, no length is active until one is selected.
    let no_length = rules.codes.contains(&"M6");
    let mut state = State { at: [0.0, 0.0, safe], safe, no_length, ..State::default() };
    for line in text.lines() {
        if line.len() > rules.longest {
            return Err(format!("{line:?} is too long"));
        }
        state.line(line, rules).map_err(|why| format!("{line:?}: {why}"))?;
    }
    if state.ended || !rules.codes.contains(&"M2") && !rules.codes.contains(&"M30") {
        Ok(state.seen)
    } else {
        Err("no end".to_owned())
    }
}

impl State {
    fn line(&mut self, line: &str, rules: &Rules) -> Result<(), String> {
        if line.trim().is_empty() || line == "%" || line.starts_with('O') {
            return Ok(());
        }
        if self.ended {
            return Err("behind the end".to_owned());
        }
        let mut rest = line.to_owned();
        if let Some(step) = rules.numbered {
            let (number, behind) = rest.split_once(' ').ok_or("no number")?;
            self.line_number += step;
            if number != format!("N{}", self.line_number) {
                return Err(format!("numbered {number}"));
            }
            rest = behind.to_owned();
        }
        // Comments: those that name a tool are requests to the user.
        let mut asked = None;
        if rules.semicolon {
            if let Some((code, comment)) = rest.clone().split_once(';') {
                (rest, asked) = (code.to_owned(), bit_in(comment));
            }
        } else {
            while let Some(open) = rest.find('(') {
                let close = rest[open..].find(')').ok_or("an open bracket")? + open;
                asked = bit_in(&rest[open..close]);
                rest.replace_range(open..=close, "");
            }
        }
        if let Some(message) = rest.strip_prefix("M117 ").map(str::to_owned) {
            let asked = bit_in(&message);
            self.z_open |= asked.is_some();
            self.seen.extend(asked.map(Seen::Bit));
            return Ok(());
        }
        if rules.codes.contains(&"CYCLE82") && self.siemens(&rest)? {
            return Ok(());
        }
        // A controller with M6 learns the tool from T.
        if !rules.codes.contains(&"M6") {
            self.z_open |= asked.is_some();
            self.seen.extend(asked.map(Seen::Bit));
        }
        self.words(&words(&rest)?, rules)
    }

    fn siemens(&mut self, line: &str) -> Result<bool, String> {
        if line.starts_with("MSG(") {
            return Ok(true);
        }
        // To the top, in machine coordinates and without a tool length.
        if line == "SUPA G0 Z0 D0" {
            (self.no_length, self.motion) = (true, 0);
            self.to([self.at[0], self.at[1], REFERENCE], None);
            return Ok(true);
        }
        let Some(inside) = line.strip_prefix("CYCLE82(").and_then(|rest| rest.strip_suffix(')')) else {
            return Ok(false);
        };
        let rows: Vec<&str> = inside.split(',').collect();
        let [back, reference, over, depth, relative, pause] = rows[..] else {
            return Err("six values".to_owned());
        };
        if !relative.is_empty() {
            return Err("a depth from the reference plane".to_owned());
        }
        let feed = self.feed.ok_or("no feed")?;
        let [back, start, depth] = [number(back)?, number(reference)? + number(over)?, number(depth)?];
        self.to([self.at[0], self.at[1], start], None);
        self.to([self.at[0], self.at[1], depth], Some(feed));
        if number(pause)? > 0.0 {
            self.seen.push(Seen::Wait(number(pause)?));
        }
        self.to([self.at[0], self.at[1], back], None);
        Ok(true)
    }

    fn to(&mut self, to: [f64; 3], feed: Option<f64>) {
        self.at = to;
        self.seen.push(Seen::Move { to, feed });
    }

    #[allow(
        clippy::too_many_lines,
        reason = "a reader written apart from the product, one letter after the other"
    )]
    fn words(&mut self, words: &[(char, String)], rules: &Rules) -> Result<(), String> {
        let value = |letter: char| -> Result<Option<f64>, String> {
            let mut found = words.iter().filter(|(known, _)| *known == letter);
            let first = found.next();
            if found.next().is_some() && !"GM".contains(letter) {
                return Err(format!("{letter} twice"));
            }
            first.map(|(_, text)| number(text)).transpose()
        };
        let codes: Vec<String> = words
            .iter()
            .filter(|(letter, _)| "GM".contains(*letter))
            .map(|(letter, text)| format!("{letter}{text}"))
            .collect();
        if let Some(unknown) = codes.iter().find(|code| !rules.codes.contains(&code.as_str())) {
            return Err(format!("{unknown} is not known"));
        }
        let has = |code: &str| codes.iter().any(|known| known == code);
        if rules.points
            && words.iter().any(|(letter, text)| "XYZIJRF".contains(*letter) && !text.contains('.'))
        {
            return Err("a number without its point".to_owned());
        }
        if has("G4") {
            let seconds = value(rules.pause.0)?.ok_or("no time")? * rules.pause.1;
            self.seen.push(Seen::Wait(seconds));
            return if words.len() == 2 { Ok(()) } else { Err("more than a pause".to_owned()) };
        }
        if rules.feed_in_every_move
            && (has("G0") || has("G1") || has("G2") || has("G3"))
            && value('F')?.is_none()
        {
            return Err("no feed".to_owned());
        }
        self.feed = value('F')?.or(self.feed);
        self.rpm = value('S')?.unwrap_or(self.rpm);
        if has("G91") {
            // A return to the reference point from the current position is the only permitted relative
            // move.
            let said: Vec<&str> = codes.iter().map(String::as_str).collect();
            let z = value('Z')?.filter(|way| *way == 0.0 && words.len() == 3);
            if said != ["G91", "G28"] || z.is_none() {
                return Err("G91 without G28 Z0".to_owned());
            }
            self.incremental = true;
            self.to([self.at[0], self.at[1], REFERENCE], None);
            return Ok(());
        }
        if has("G53") {
            // A machine coordinate, for this line only and with G0 or G1 only: to the top.
            if !has("G0") || value('Z')? != Some(0.0) || words.len() != 3 {
                return Err("G53 without G0 and Z0".to_owned());
            }
            self.motion = 0;
            self.to([self.at[0], self.at[1], REFERENCE], None);
            return Ok(());
        }
        self.incremental &= !has("G90");
        self.no_length |= has("G49") || has("M6");
        let taken = has("G43") || value('D')?.is_some();
        self.no_length &= !taken;
        self.z_open |= taken || has("M6");
        if has("M6") || (has("T") && !rules.codes.contains(&"M6")) {
            self.on = false;
        }
        if let Some(tool) = value('T')? {
            self.seen.push(Seen::Bit(tool as u32));
        }
        if has("M3") {
            self.on = true;
            self.seen.push(Seen::Spindle(self.rpm));
        }
        if has("M5") {
            self.on = false;
            self.seen.push(Seen::Spindle(0.0));
        }
        if has("M2") || has("M30") {
            self.ended = true;
        }
        if has("G80") {
            self.motion = 80;
        }
        for motion in [0, 1, 2, 3, 82] {
            if has(&format!("G{motion}")) {
                self.motion = motion;
            }
        }
        let mut to = self.at;
        let mut moves = false;
        for (axis, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            if let Some(place) = value(letter)? {
                (to[axis], moves) = (place, true);
            }
        }
        let centre = [value('I')?, value('J')?];
        if !moves && centre.iter().all(Option::is_none) {
            return Ok(());
        }
        if self.incremental {
            return Err("a move under G91".to_owned());
        }
        if self.no_length && value('Z')?.is_some() {
            return Err("Z goes somewhere without the tool's length".to_owned());
        }
        let goes = value('X')?.is_some() || value('Y')?.is_some();
        if self.z_open && goes {
            return Err("X and Y go somewhere before Z under the new tool's length".to_owned());
        }
        self.z_open = false;
        match self.motion {
            0 => self.to(to, None),
            1 => self.to(to, Some(self.feed.ok_or("no feed")?)),
            2 | 3 => self.arc(to, centre, value('X')?.is_some() || value('Y')?.is_some())?,
            82 => {
                self.cycle(to, value('R')?.ok_or("no R")?, value('P')?.ok_or("no P")? * rules.cycle_pause)?;
            }
            other => return Err(format!("a move under G{other}")),
        }
        Ok(())
    }

    fn arc(&mut self, to: [f64; 3], centre: [Option<f64>; 2], plane: bool) -> Result<(), String> {
        let [Some(i), Some(j)] = centre else { return Err("no centre".to_owned()) };
        if !plane {
            return Err("an arc without X and Y".to_owned());
        }
        let centre = [self.at[0] + i, self.at[1] + j];
        let radius = |at: [f64; 3]| libm::hypot(at[0] - centre[0], at[1] - centre[1]);
        let (first, last) = (radius(self.at), radius(to));
        // The tolerance of the strictest controller.
        if first == 0.0 || (first - last).abs() > 0.005_f64.min(0.001 * first).max(0.002_1) {
            return Err(format!("radius {first} at the start, {last} at the end"));
        }
        let feed = self.feed.ok_or("no feed")?;
        self.at = to;
        self.seen.push(Seen::Arc { to, by: By::Centre(centre, self.motion == 3), feed });
        Ok(())
    }

    /// Drill, wait, and rapid out to the previous Z (G98).
    fn cycle(&mut self, to: [f64; 3], start: f64, pause: f64) -> Result<(), String> {
        let before = self.at[2];
        if before > self.safe {
            return Err("G98 goes up to where the tool was changed after every hole".to_owned());
        }
        if before < start {
            return Err("the cycle begins under R".to_owned());
        }
        self.to([to[0], to[1], before], None);
        self.to([to[0], to[1], start], None);
        self.to(to, Some(self.feed.ok_or("no feed")?));
        if pause > 0.0 {
            self.seen.push(Seen::Wait(pause));
        }
        self.to([to[0], to[1], before], None);
        Ok(())
    }
}
