//! Aperture definitions: `10C,0.8`, `11R,1.5X1.2X0.6`, `12O,…`, `13P,1X6X30`, `14ROUNDRECT,…`.

use super::Reader;
use super::macros::Macros;
use super::object::{Aperture, Form, Opening};
use super::words::{Block, plain};
use crate::artwork::Units;
use crate::artwork::number::{Decimal, decimal};
use crate::code;
use crate::diagnostic::Severity;
use crate::units::Length;
use std::collections::BTreeMap;

const MOST_APERTURES: usize = 10_000;
const FINEST: usize = 9;
/// Maximum D-code.
const HIGHEST_CODE: i64 = 1_000_000_000;
const MOST_CORNERS: i64 = 1_000;
const MOST_PARAMETERS: usize = 1_000;
const LARGEST: Length = Length::from_um(2_000_000);

#[derive(Clone, Debug, Default)]
pub(super) struct Apertures {
    /// Index of the aperture by D-code.
    codes: BTreeMap<u32, u32>,
    pub(super) macros: Macros,
}

impl Reader {
    /// `D10`: selects an aperture.
    pub(super) fn select(&mut self, number: Decimal, block: &Block<'_>) {
        let code = u32::try_from(number.mantissa).ok();
        self.graphics.aperture = code.and_then(|code| self.apertures.codes.get(&code)).copied();
        if self.graphics.aperture.is_none() {
            self.tell_once(Severity::Error, code!("gerber.aperture_undefined"), block.at, block.text);
        }
    }

    /// Parses `D10C,0.8`, without the `AD`.
    pub(super) fn aperture_definition(&mut self, rest: &[u8], block: &Block<'_>) {
        let code = rest.strip_prefix(b"D").and_then(decimal);
        let code = code.filter(|(number, _)| (0..=HIGHEST_CODE).contains(&number.mantissa) && !number.point);
        let Some((number, used)) = code.filter(|_| self.out.apertures.len() < MOST_APERTURES) else {
            self.tell(Severity::Error, code!("gerber.bad_aperture"), block.at, block.text);
            return;
        };
        let text = rest.get(1 + used..).unwrap_or_default();
        let (name, fields) = match text.iter().position(|&byte| byte == b',') {
            Some(at) => (text.get(..at).unwrap_or_default(), text.get(at + 1..).unwrap_or_default()),
            None => (text, [].as_slice()),
        };
        let fields = fields.split(|&byte| byte == b'X' || byte == b'x').map(<[u8]>::trim_ascii);
        let fields: Vec<Option<Decimal>> =
            fields.filter(|field| !field.is_empty()).take(MOST_PARAMETERS).map(size).collect();
        let numbers: Option<Vec<Decimal>> = fields.into_iter().collect();
        let units = self.format.size_units();
        let name = name.trim_ascii();
        let made = match (name, &numbers) {
            (b"C" | b"R" | b"O" | b"P", Some(numbers)) => standard(name, numbers, units),
            (_, Some(numbers)) => self.macro_aperture(name, numbers, units, block).map(|form| (form, None)),
            _ => None,
        };
        // Keep the code even without a shape: its objects are counted, but have no area.
        let Some((form, opening)) = made else {
            self.tell(Severity::Error, code!("gerber.bad_aperture"), block.at, block.text);
            return;
        };
        let (width, height) = sides(&form);
        if width.min(height) == Length::ZERO && !matches!(form, Form::Circle { .. }) {
            self.tell(Severity::Warning, code!("gerber.aperture_empty"), block.at, block.text);
        }
        let bursts = match opening {
            Some(Opening::Round(diameter)) => diameter >= width.min(height),
            Some(Opening::Rectangle(across, up)) => across >= width || up >= height,
            None => false,
        };
        if bursts {
            self.tell(Severity::Warning, code!("gerber.aperture_hole"), block.at, block.text);
        }
        let function = self.attributes.aperture_function();
        let aperture =
            Aperture { code: number.mantissa as u32, form, opening, function, repeated: 1, depth: 0 };
        self.define(aperture, block);
    }

    pub(super) fn define(&mut self, aperture: Aperture, block: &Block<'_>) {
        let index = self.out.apertures.len() as u32;
        if self.apertures.codes.insert(aperture.code, index).is_some() {
            self.tell_once(Severity::Note, code!("gerber.aperture_again"), block.at, block.text);
        }
        self.out.apertures.push(aperture);
    }
}

/// Width and height of a standard shape; for other shapes the largest allowed size.
fn sides(form: &Form) -> (Length, Length) {
    match *form {
        Form::Circle { diameter } | Form::Polygon { diameter, .. } => (diameter, diameter),
        Form::Rectangle { width, height } | Form::Obround { width, height } => (width, height),
        _ => (LARGEST, LARGEST),
    }
}

/// A size. Decimals finer than a nanometre, as in computed sizes, are cut off.
fn size(field: &[u8]) -> Option<Decimal> {
    let point = field.iter().position(|&byte| byte == b'.').unwrap_or(field.len());
    let (front, fine) = field.split_at_checked(point + 1 + FINEST).unwrap_or((field, &[]));
    let read = decimal(front).filter(|&(_, used)| used == front.len() && fine.iter().all(u8::is_ascii_digit));
    read.map(|(number, _)| number)
}

/// A standard aperture and its opening; none if its numbers are invalid.
fn standard(name: &[u8], numbers: &[Decimal], units: Units) -> Option<(Form, Option<Opening>)> {
    let length = |index: usize| {
        numbers.get(index)?.length(units).filter(|size| (Length::ZERO..=LARGEST).contains(size))
    };
    let opening = |first: usize| match (length(first), length(first + 1)) {
        (Some(width), Some(height)) => Some(Opening::Rectangle(width, height)),
        (Some(diameter), None) => Some(Opening::Round(diameter)),
        _ => None,
    };
    let some = |opening: Option<Opening>| opening.filter(|opening| *opening != Opening::Round(Length::ZERO));
    let most = match name {
        b"C" => 3,
        b"P" => 5,
        _ => 4,
    };
    if numbers.len() > most {
        return None;
    }
    let (form, first) = match name {
        b"C" => (Form::Circle { diameter: length(0)? }, 1),
        b"R" => (Form::Rectangle { width: length(0)?, height: length(1)? }, 2),
        b"O" => (Form::Obround { width: length(0)?, height: length(1)? }, 2),
        _ => {
            let corners =
                numbers.get(1).filter(|n| n.decimals == 0 || plain(**n) == libm::round(plain(**n)))?;
            let corners = plain(*corners) as i64;
            if !(3..=MOST_CORNERS).contains(&corners) {
                return None;
            }
            let turn_deg = numbers.get(2).map_or(0.0, |number| plain(*number));
            (Form::Polygon { diameter: length(0)?, corners: corners as u32, turn_deg }, 3)
        }
    };
    Some((form, some(opening(first))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::artwork::Overrides;

    fn forms(definitions: &str) -> Vec<Form> {
        let text = format!("%FSLAX33Y33*%%MOIN*%{definitions}M02*");
        let (gerber, _) = super::super::read("t", text.as_bytes(), &Overrides::default());
        gerber.apertures.into_iter().map(|aperture| aperture.form).collect()
    }

    #[test]
    fn aperture_definitions_use_the_units_of_the_file() {
        let um = Length::from_um;
        assert_eq!(
            forms(
                "%ADD10C,0.1*%%ADD11R,0.10000000000000000000001X.2*%%ADD12O,0.2X0.1X0.05*%%ADD13P,0.1X6X-30.5*%"
            ),
            [
                Form::Circle { diameter: um(2_540) },
                Form::Rectangle { width: um(2_540), height: um(5_080) },
                Form::Obround { width: um(5_080), height: um(2_540) },
                Form::Polygon { diameter: um(2_540), corners: 6, turn_deg: -30.5 },
            ]
        );
    }

    #[test]
    fn invalid_aperture_definitions_are_dropped() {
        for text in ["C", "C,", "C,-1", "R,1", "P,5X2", "P,5X1000000000", "C,1e3", "NOSUCH,1", "C,9999"] {
            assert_eq!(forms(&format!("%ADD10{text}*%")), [], "{text}");
        }
    }
}
