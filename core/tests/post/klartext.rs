//! A reader of Heidenhain Klartext: blocks counted from 0, arcs around CC, helices by CP.

use super::seen::{By, Seen};

#[derive(Default)]
struct State {
    at: [f64; 3],
    centre: Option<[f64; 2]>,
    rpm: f64,
    seen: Vec<Seen>,
    name: String,
    ended: bool,
    length: bool,
    /// Z has not moved since the tool length became active.
    z_open: bool,
}

/// Height of machine zero above the board in mm: higher than anything that is written.
const REFERENCE: f64 = 100.0;

fn number(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| format!("{text:?} is no number"))
}

fn signed(text: &str) -> Result<f64, String> {
    if text.starts_with(['+', '-']) { number(text) } else { Err(format!("{text:?} has no sign")) }
}

pub(crate) fn read(text: &str, safe: f64) -> Result<Vec<Seen>, String> {
    let mut state = State { at: [0.0, 0.0, safe], ..State::default() };
    for (index, line) in text.lines().enumerate() {
        let (count, block) = line.split_once(' ').ok_or_else(|| format!("{line:?}"))?;
        if count != index.to_string() {
            return Err(format!("block {index} is numbered {count}"));
        }
        let words: Vec<&str> = block.split_whitespace().collect();
        state.block(&words, index).map_err(|why| format!("{line:?}: {why}"))?;
    }
    if state.ended { Ok(state.seen) } else { Err("no END PGM".to_owned()) }
}

impl State {
    fn block(&mut self, words: &[&str], index: usize) -> Result<(), String> {
        if (index == 0) != (words.first() == Some(&"BEGIN")) || self.ended {
            return Err("BEGIN is first and END last".to_owned());
        }
        match words {
            ["BEGIN", "PGM", name, "MM"] => self.name = (*name).to_owned(),
            ["END", "PGM", name, "MM"] => {
                self.ended = true;
                return if *name == self.name { Ok(()) } else { Err("another name".to_owned()) };
            }
            [comment, ..] if comment.starts_with(';') => {}
            ["M3"] => self.seen.push(Seen::Spindle(self.rpm)),
            ["M5"] => self.seen.push(Seen::Spindle(0.0)),
            ["M30"] | ["CYCL", "DEF", "9.0", "DWELL", "TIME"] => {}
            ["CYCL", "DEF", "9.1", "DWELL", time] => self.seen.push(Seen::Wait(number(time)?)),
            ["TOOL", "CALL", speed] => self.rpm = number(speed.strip_prefix('S').ok_or("no S")?)?,
            ["TOOL", "CALL", tool, "Z", speed] => {
                self.rpm = number(speed.strip_prefix('S').ok_or("no S")?)?;
                self.seen.push(Seen::Bit(number(tool)? as u32));
                (self.length, self.z_open) = (true, true);
            }
            ["CC", x, y] => {
                let x = signed(x.strip_prefix('X').ok_or("no X")?)?;
                self.centre = Some([x, signed(y.strip_prefix('Y').ok_or("no Y")?)?]);
            }
            ["L", "Z+0", "R0", "FMAX", "M91"] => {
                let to = [self.at[0], self.at[1], REFERENCE];
                self.at = to;
                self.seen.push(Seen::Move { to, feed: None });
            }
            ["L", rest @ ..] => {
                self.goes(rest)?;
                let (to, feed, _) = self.rest(rest)?;
                self.at = to;
                self.seen.push(Seen::Move { to, feed });
            }
            ["C", rest @ ..] => {
                let (to, feed, sense) = self.rest(rest)?;
                self.arc(to, feed, sense.ok_or("no sense")?)?;
            }
            ["CP", angle, height, rest @ ..] => {
                let angle = signed(angle.strip_prefix("IPA").ok_or("no IPA")?)?;
                let height = signed(height.strip_prefix("IZ").ok_or("no IZ")?)?;
                let (_, feed, sense) = self.rest(rest)?;
                let ccw = sense.ok_or("no sense")?;
                if ccw != (angle > 0.0) {
                    return Err("angle and sense differ".to_owned());
                }
                let [x, y] = self.centre.ok_or("no CC")?;
                let (sin, cos) = (libm::sin(angle.to_radians()), libm::cos(angle.to_radians()));
                let (dx, dy) = (self.at[0] - x, self.at[1] - y);
                let to = [x + dx * cos - dy * sin, y + dx * sin + dy * cos, self.at[2] + height];
                self.arc(to, feed, ccw)?;
            }
            _ => return Err("not known".to_owned()),
        }
        Ok(())
    }

    /// Z may move only with a tool length, and must move before X and Y after a new one.
    fn goes(&mut self, words: &[&str]) -> Result<(), String> {
        let says = |letters: &[char]| words.iter().any(|word| word.starts_with(letters));
        if says(&['Z']) && !self.length {
            return Err("Z goes somewhere without the tool's length".to_owned());
        }
        if says(&['X', 'Y']) && self.z_open {
            return Err("X and Y go somewhere before Z under the new tool's length".to_owned());
        }
        self.z_open &= !says(&['Z']);
        Ok(())
    }

    fn arc(&mut self, to: [f64; 3], feed: Option<f64>, ccw: bool) -> Result<(), String> {
        let centre = self.centre.take().ok_or("no CC")?;
        let feed = feed.ok_or("an arc at rapid speed")?;
        self.at = to;
        self.seen.push(Seen::Arc { to, by: By::Centre(centre, ccw), feed });
        Ok(())
    }

    /// Coordinates, direction, R0 and feed, in this order.
    #[allow(clippy::type_complexity)]
    fn rest(&self, words: &[&str]) -> Result<([f64; 3], Option<f64>, Option<bool>), String> {
        let (mut to, mut feed, mut sense, mut r0) = (self.at, None, None, false);
        let mut said = false;
        for word in words {
            let (letter, text) = word.split_at(1);
            match (letter, *word) {
                ("X", _) => to[0] = signed(text)?,
                ("Y", _) => to[1] = signed(text)?,
                ("Z", _) => to[2] = signed(text)?,
                (_, "DR-") => sense = Some(false),
                (_, "DR+") => sense = Some(true),
                (_, "R0") => r0 = true,
                (_, "FMAX") => said = true,
                ("F", _) => (feed, said) = (Some(number(text)?), true),
                _ => return Err(format!("{word} is not known")),
            }
        }
        if said && r0 { Ok((to, feed, sense)) } else { Err("no R0 or F".to_owned()) }
    }
}
