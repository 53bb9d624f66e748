//! The commands of two letters that set things: format, units, polarity, mounts, the image.
//!
//! Comes in: blocks such as `FSLAX24Y24`. Goes out: the state, changed. Apertures, macros, copies and attributes are read
//! in files of their own.

use super::machine::Machine;
use super::words::Block;
use crate::artwork::number::{Decimal, decimal};
use crate::artwork::{Digits, Units, Zeros};
use crate::geometry::Point;
use crate::remark::Weight;
use crate::units::Length;

/// Names longer than this are cut off.
const LONGEST_NAME: usize = 80;
/// Scales of the image and of mounts, either way.
const MOST_SCALE: f64 = 100.0;
/// Degrees of a turn, either way.
const MOST_TURN: f64 = 3_600.0;

impl Machine {
    /// A command of two letters.
    pub(super) fn extended(&mut self, block: &Block<'_>) {
        let Some((code, rest)) = block.text.split_first_chunk::<2>() else { return };
        let rest = rest.trim_ascii();
        match code {
            b"AD" => self.aperture_definition(rest, block),
            b"AM" => self.macro_definition(rest, block),
            b"AB" => self.block_aperture(rest, block),
            b"SR" => self.step_and_repeat(rest, block),
            b"LP" if matches!(rest, b"C" | b"D") => self.clear = rest == b"C",
            b"LM" | b"LR" | b"LS" => self.set_mount(*code, rest, block),
            b"FS" => self.format(rest, block),
            b"MO" => match rest {
                b"IN" => self.set_units(Units::Inch, block.at),
                b"MM" => self.set_units(Units::Mm, block.at),
                _ => self.tell(Weight::Loss, "gerber.bad_units", block.at, block.text),
            },
            b"TF" | b"TA" | b"TO" | b"TD" => self.attribute(*code, rest, block.at),
            b"LN" | b"IN" => {
                let name = String::from_utf8_lossy(rest);
                let name: String = name.chars().filter(|c| !c.is_control()).take(LONGEST_NAME).collect();
                // Of several levels the first names the layer; the image's name stands in where none does.
                if code == b"LN" && !self.level_named || self.out.layer_name.is_none() {
                    self.level_named |= code == b"LN";
                    self.out.layer_name = Some(name);
                }
            }
            b"IP" if matches!(rest, b"POS" | b"NEG") => self.out.negative_image = rest == b"NEG",
            b"IF" => self.tell(Weight::Loss, "gerber.include", block.at, rest),
            b"OF" | b"SF" | b"MI" | b"IR" => self.place_image(*code, rest, block),
            // Which axis of the plotter is which. IJ centres the image on the film, PF names the film.
            b"AS" if rest == b"AXBY" => {}
            b"AS" if rest == b"AYBX" => {
                self.tell_once(Weight::Doubt, "gerber.axes_swapped", block.at, block.text);
            }
            b"IJ" if rest.iter().all(|byte| b"ABLC.+-".contains(byte) || byte.is_ascii_digit()) => {}
            b"PF" => {}
            b"IC" if matches!(rest, b"" | b"AS" | b"ASCII") => {}
            b"KO" => self.tell(Weight::Loss, "gerber.knockout", block.at, block.text),
            _ => self.tell_once(Weight::Doubt, "gerber.unknown_command", block.at, block.text),
        }
    }

    /// `LAX24Y24`, also with N, G, D and M fields that nobody needs.
    fn format(&mut self, rest: &[u8], block: &Block<'_>) {
        let zeros =
            if rest.iter().take(2).any(|&byte| byte == b'T') { Zeros::Trailing } else { Zeros::Leading };
        // How zeros are left out, how coordinates count, and then letters with digits.
        let (head, tail) = rest.split_at(rest.iter().position(|&byte| byte == b'X').unwrap_or(0));
        let known = matches!(head, [b'L' | b'T' | b'D', b'A' | b'I', ..] | [b'A' | b'I', ..]);
        let numbered = |text: &[u8]| fields(text, *b"NGXYZDM").is_some();
        let marks = head.get(head.len().min(2)..).unwrap_or_default();
        let odd = !known || !numbered(marks) || !numbered(tail);
        let digits = |axis: u8| {
            let at = rest.iter().position(|&byte| byte == axis)?;
            match rest.get(at + 1..at + 3)? {
                &[integer @ b'0'..=b'9', decimal @ b'0'..=b'9'] => {
                    Some(Digits { integer: integer - b'0', decimal: decimal - b'0' })
                }
                _ => None,
            }
        };
        let (x, y) = (digits(b'X'), digits(b'Y'));
        if x.is_none() || x != y || odd {
            self.tell(Weight::Doubt, "gerber.bad_format", block.at, block.text);
        }
        self.incremental = rest.iter().take(2).any(|&byte| byte == b'I');
        if let Some(digits) = x {
            if self.formatted {
                let same = (self.out.zeros, self.out.digits) == (Some(zeros), Some(digits));
                let weight = if same { Weight::Note } else { Weight::Doubt };
                self.tell(weight, "gerber.format_again", block.at, block.text);
            }
            self.formatted = true;
            self.out.zeros = Some(zeros);
            self.out.digits = Some(digits);
            self.rescale();
        }
    }

    /// `LMXY`, `LR90.0`, `LS0.8`.
    fn set_mount(&mut self, code: [u8; 2], rest: &[u8], block: &Block<'_>) {
        match (&code, number(rest)) {
            (b"LM", _) if matches!(rest, b"N" | b"X" | b"Y" | b"XY" | b"YX") => {
                (self.held.mirror_x, self.held.mirror_y) = (rest.contains(&b'X'), rest.contains(&b'Y'));
            }
            (b"LR", Some(turn)) if turn.abs() <= MOST_TURN => self.held.turn_deg = turn,
            (b"LS", Some(factor)) if is_scale(factor) => self.held.scale = factor,
            _ => self.tell(Weight::Loss, "gerber.bad_mount", block.at, block.text),
        }
        self.mount_index = None;
    }

    /// `OFA1.5B0`, `SFA1B1`, `MIA1B0`, `IR90`: gone from the format, found in old files.
    fn place_image(&mut self, code: [u8; 2], rest: &[u8], block: &Block<'_>) {
        let units = self.size_units();
        let known = fields(rest, *b"AB");
        let [a, b] = known.unwrap_or_default();
        let before = self.image;
        let understood = match &code {
            b"OF" => {
                let length = |n: Option<Decimal>| n.map_or(Some(Length::ZERO), |n| n.length(units));
                let offset = known.and(length(a).zip(length(b)));
                offset.map(|(x, y)| self.image.offset = Point::new(x, y))
            }
            b"MI" => {
                let on = |n: Option<Decimal>| n.is_some_and(|n| n.mantissa != 0);
                let known = known.filter(|both| both.iter().flatten().all(|n| matches!(n.mantissa, 0 | 1)));
                known.map(|_| (self.image.mirror_x, self.image.mirror_y) = (on(a), on(b)))
            }
            b"SF" => {
                let (a, b) = (a.map_or(1.0, plain), b.map_or(1.0, plain));
                (known.is_some() && a == b && is_scale(a)).then(|| self.image.scale = (a != 1.0).then_some(a))
            }
            _ => number(rest).filter(|turn| [0.0, 90.0, 180.0, 270.0].contains(turn)).map(|turn| {
                self.image.quarters = (turn / 90.0) as u8;
            }),
        };
        if understood.is_none() {
            self.tell(Weight::Loss, "gerber.image_place", block.at, block.text);
        } else if self.image != before {
            self.tell_once(Weight::Note, "gerber.image_moved", block.at, block.text);
        }
        self.mount_index = None;
    }
}

/// A number as it stands, and nothing else.
fn number(text: &[u8]) -> Option<f64> {
    decimal(text).filter(|(_, used)| *used == text.len()).map(|(number, _)| plain(number))
}

/// The numbers behind letters, each letter at most once and nothing else; none where there is anything else.
pub(super) fn fields<const COUNT: usize>(
    text: &[u8],
    letters: [u8; COUNT],
) -> Option<[Option<Decimal>; COUNT]> {
    let mut found = [None; COUNT];
    let mut rest = text.trim_ascii();
    while let Some((letter, behind)) = rest.split_first() {
        let slot = found.get_mut(letters.iter().position(|known| known == letter)?)?;
        let (number, used) = decimal(behind)?;
        if slot.replace(number).is_some() {
            return None;
        }
        rest = behind.get(used..)?.trim_ascii_start();
    }
    Some(found)
}

/// The value of a number as it stands.
pub(super) fn plain(number: Decimal) -> f64 {
    number.mantissa as f64 / libm::pow(10.0, f64::from(number.decimals))
}

fn is_scale(factor: f64) -> bool {
    (1.0 / MOST_SCALE..=MOST_SCALE).contains(&factor)
}
