//! Values of the parameters of an elementary action.
//!
//! ```text
//!            AX,AY ●  halfway
//!               ╭─╯ ╰─╮
//!       start  ●   +   ●  X,Y      I,J from the start to the centre +; CX,CY the centre itself
//!                                  R the radius; CR the same, negative over 180°; P the opening angle
//! ```

use super::arcs::{Curve, Tip};
use super::dialect::{NumberStyle, Rapids};
use super::names::HEAD;
use super::sheet::Value;
use crate::geometry::Point;
use crate::job::Program;
use crate::locale;
use crate::units::Length;
use std::f64::consts::PI;

const LONGEST_WORD: usize = 60;

/// An elementary action: start, end, and state.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Action {
    pub(super) from: Tip,
    pub(super) to: Tip,
    /// Height after a drill cycle.
    pub(super) lift: Length,
    pub(super) curve: Option<Curve>,
    pub(super) feed_um_per_s: u32,
    pub(super) wait_us: u32,
    pub(super) rpm: u32,
    pub(super) bit: u32,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Frame<'a> {
    pub(super) program: &'a Program,
    pub(super) name: &'a str,
    pub(super) numbers: &'a NumberStyle,
    pub(super) shift: [Length; 2],
    /// Height down to which the tool descends as a rapid; `None`: at feed all the way.
    pub(super) fall_to: Option<Length>,
    pub(super) change_at: Length,
    pub(super) tools: &'a [u32],
    /// Number of the file in the order of execution.
    pub(super) file: usize,
    pub(super) rapids: Rapids,
    /// Longest line of the header, in characters.
    pub(super) head_width: usize,
    pub(super) head: &'a [String],
}

impl Frame<'_> {
    /// `at` rounded to the digits of X and Y.
    pub(super) fn written(&self, at: Point) -> Point {
        let digits = |name: &str, length: Length| Length::from_nm(self.numbers.of(name).rounded(length.nm()));
        let [x, y] = self.shift;
        Point::new(digits("X", at.x + x) - x, digits("Y", at.y + y) - y)
    }

    pub(super) fn value(&self, action: &Action, name: &str) -> Value {
        let bit = self.program.bits.get(action.bit as usize);
        let diameter = bit.map_or(Length::ZERO, |bit| bit.diameter);
        let millionths = |count: u32| i64::from(count) * 1_000_000;
        let number = match name {
            "H" => self.program.safe_height.nm(),
            "HC" => self.change_at.nm(),
            "A" => self.fallen(action).nm(),
            "U" => action.lift.nm(),
            "B" => action.from.height.nm(),
            "F" => i64::from(action.feed_um_per_s) * 60_000,
            "V" => i64::from(action.feed_um_per_s) * 1_000,
            "S" => millionths(action.rpm),
            "W" => i64::from(action.wait_us),
            "T" => millionths(number_of(self.tools, action.bit)),
            "FILE" => millionths(u32::try_from(self.file).unwrap_or(u32::MAX)),
            "RF" => millionths(self.rapids.over_mm_per_min),
            "RZ" => millionths(self.rapids.up_mm_per_min),
            "D" => diameter.nm(),
            "TR" => diameter.nm() / 2,
            "BIT" => {
                return Value::Word(word(&bit.map_or_else(String::new, |bit| bit.title(locale::FALLBACK))));
            }
            HEAD => {
                let lines = self.head.iter().flat_map(|line| folded(&word(line), self.head_width));
                return Value::Lines(lines.collect());
            }
            "JOB" => return Value::Word(word(&self.program.name)),
            "PROGRAM" => return Value::Word(self.name.to_owned()),
            _ => self.place(action, name),
        };
        Value::Number(number)
    }

    /// Height at which a descending tool changes from rapid to feed: within the move.
    fn fallen(&self, action: &Action) -> Length {
        let from = action.from.height;
        self.fall_to.unwrap_or(from).min(from).max(action.to.height)
    }

    /// Positions and distances in nanometres, and the opening angle.
    fn place(&self, action: &Action, name: &str) -> i64 {
        let [x, y] = self.shift;
        let shifted = |at: Point| (at.x + x, at.y + y);
        let rounded = |name: &str, length: Length| self.numbers.of(name).rounded(length.nm());
        let (to, from) = (shifted(action.to.at), shifted(action.from.at));
        // Relative values count from the rounded start, so that rounding errors don't add up.
        let (from_x, from_y) = (rounded("X", from.0), rounded("Y", from.1));
        match name {
            "X" => return to.0.nm(),
            "Y" => return to.1.nm(),
            "Z" => return action.to.height.nm(),
            "DX" => return rounded("X", to.0) - from_x,
            "DY" => return rounded("Y", to.1) - from_y,
            "DZ" => return rounded("Z", action.to.height) - rounded("Z", action.from.height),
            _ => {}
        }
        let Some(curve) = action.curve else { return 0 };
        let (centre, middle) = (shifted(curve.centre), curve.along(0.5));
        let radius = Length::from_mm(curve.radius()).nm();
        match name {
            "AX" => (middle.at.x + x).nm(),
            "AY" => (middle.at.y + y).nm(),
            "AZ" => middle.height.nm(),
            "I" => centre.0.nm() - from_x,
            "J" => centre.1.nm() - from_y,
            "CX" => centre.0.nm(),
            "CY" => centre.1.nm(),
            "R" => radius,
            "CR" if curve.turn() > PI => -radius,
            "CR" => radius,
            "P" => libm::round(curve.turn().to_degrees() * 1e6) as i64,
            _ => 0,
        }
    }
}

pub(super) fn number_of(tools: &[u32], bit: u32) -> u32 {
    tools.get(bit as usize).copied().unwrap_or(bit.saturating_add(1))
}

fn folded(line: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in line.split(' ') {
        let mut rest = word.to_owned();
        while let Some(last) = lines.last_mut() {
            let room = width.saturating_sub(last.len() + usize::from(!last.is_empty()));
            if rest.len() <= room {
                last.push_str(if last.is_empty() { "" } else { " " });
                last.push_str(&rest);
                break;
            }
            if last.is_empty() {
                let end = rest.split_off(width.clamp(1, rest.len()));
                last.push_str(&rest);
                rest = end;
            }
            lines.push(String::new());
        }
    }
    lines
}

/// Text that every controller accepts: letters, digits, `-_.,:+` and spaces.
fn word(text: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || "-_.,:+ ".contains(c) { c } else { '_' };
    text.replace('°', " deg").chars().take(LONGEST_WORD).map(plain).collect()
}
