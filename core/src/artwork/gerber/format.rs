//! The number format: units, digits, omitted zeros, and absolute or incremental coordinates.

use super::Reader;
use super::words::{At, Block, fields};
use crate::artwork::number::{Reading, Scale};
use crate::artwork::text::holds;
use crate::artwork::{Digits, Overrides, Units, Zeros};
use crate::code;
use crate::diagnostic::Severity;

#[derive(Clone, Debug, Default)]
pub(super) struct Format {
    pub(super) units: Option<Units>,
    /// Units before any statement: those stated further down, else inches.
    ahead: Option<Units>,
    /// Units at the first coordinate, if stated.
    first: Option<Units>,
    pub(super) unstated: bool,
    pub(super) digits: Option<Digits>,
    pub(super) zeros: Option<Zeros>,
    /// `%FS` was read.
    stated: bool,
    /// Coordinates are relative to the last point.
    pub(super) incremental: bool,
    /// The conversion of coordinates, once the digits are known.
    scale: Option<Scale>,
}

impl Format {
    /// For a layer that starts with `head`. The user's statements apply where the layer has none.
    pub(super) fn new(head: &[u8], person: &Overrides) -> Self {
        let Overrides { units, digits, zeros, .. } = *person;
        let mut format = Self { ahead: units.or(units_ahead(head)), digits, zeros, ..Self::default() };
        format.rescale();
        format
    }

    fn rescale(&mut self) {
        let (units, zeros) = (self.size_units(), self.zeros.unwrap_or(Zeros::Leading));
        self.scale = self.digits.map(|digits| Scale::new(Reading { units, digits, zeros }));
    }

    pub(super) fn size_units(&self) -> Units {
        self.stated_units().unwrap_or(Units::Inch)
    }

    fn stated_units(&self) -> Option<Units> {
        self.units.or(self.ahead)
    }

    /// The conversion of the next coordinate, if known; also records the units of the first.
    pub(super) fn scale_here(&mut self) -> Option<Scale> {
        let scale = self.scale?;
        self.first = self.first.or(self.stated_units());
        self.unstated |= self.stated_units().is_none();
        Some(scale)
    }

    /// Units of the whole layer: those of its first coordinate, else any stated ones.
    pub(super) fn layer_units(&self) -> Option<Units> {
        self.first.or(self.units).or(self.ahead)
    }
}

impl Reader {
    /// `IN` or `MM` after `MO`.
    pub(super) fn units(&mut self, rest: &[u8], block: &Block<'_>) {
        match rest {
            b"IN" => self.set_units(Units::Inch, block.at),
            b"MM" => self.set_units(Units::Mm, block.at),
            _ => self.tell(Severity::Error, code!("gerber.bad_units"), block.at, block.text),
        }
    }

    /// Sets the units. A second, different statement applies from there on.
    pub(super) fn set_units(&mut self, units: Units, at: At) {
        let before = self.format.units.replace(units);
        if before.is_some_and(|before| before != units) {
            self.tell_once(Severity::Warning, code!("gerber.units_change"), at, units.name().as_bytes());
        }
        self.format.rescale();
    }

    /// `LAX24Y24` after `FS`; also accepts the obsolete N, G, D and M fields.
    pub(super) fn format(&mut self, rest: &[u8], block: &Block<'_>) {
        let zeros =
            if rest.iter().take(2).any(|&byte| byte == b'T') { Zeros::Trailing } else { Zeros::Leading };
        // Zero omission and notation, then letters with digits.
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
            self.tell(Severity::Warning, code!("gerber.bad_format"), block.at, block.text);
        }
        self.format.incremental = rest.iter().take(2).any(|&byte| byte == b'I');
        let Some(digits) = x else { return };
        if self.format.stated {
            let same = (self.format.zeros, self.format.digits) == (Some(zeros), Some(digits));
            let severity = if same { Severity::Note } else { Severity::Warning };
            self.tell(severity, code!("gerber.format_again"), block.at, block.text);
        }
        (self.format.stated, self.format.zeros, self.format.digits) = (true, Some(zeros), Some(digits));
        self.format.rescale();
    }
}

/// Units stated near the start.
fn units_ahead(head: &[u8]) -> Option<Units> {
    let stated = |word: &str, units| holds(head, word).then_some(units);
    stated("MOIN*", Units::Inch)
        .or_else(|| stated("MOMM*", Units::Mm))
        .or_else(|| stated("G70", Units::Inch))
        .or_else(|| stated("G71", Units::Mm))
}
