//! Reports and tables that CAD programs write beside drill files: units, digits, tool sizes, hole counts.
//!
//! Comes in: the text of a report, names of files. Goes out: a [`Companion`] and which drill files it speaks of. Does not
//! know how the drill file itself is written.
//!
//! ```text
//! T1 0.300000mm  362x            1     23.33 Mil     248            0.0150  T01
//! └┬┘ └───┬────┘ └─┬┘            └┬    └───┬───┘     └┬┘            └─┬──┘  └┬┘
//! code   size    holes          code     size       holes           size   code
//! ```

use super::excellon::Stated;
use super::excellon::hints::{Hint, digits_in, format_words, plating};
use super::number::{Decimal, decimal};
use super::text::{holds, lines, starts};
use super::{Digits, Units, Zeros};
use crate::units::Length;
use std::collections::BTreeMap;

/// Rows taken from one report.
const MOST_ROWS: usize = 1_000;

/// Words that tell a report.
const MARKS: [&str; 12] = [
    "EXCELLON DRILL FILE GENERATION",
    "NCDrill File Report",
    "INTEGER-PLACES",
    "NC ROUTE Log",
    "NC DRILL Log",
    "TOOL INFORMATION FILE",
    "GAPFile",
    "Tool table",
    "DRILL REPORT",
    "Drill Station Info File",
    "Photoplotter Info File",
    "DRILL LIST  *****",
];

/// A tool in a report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Row {
    pub(super) diameter: Option<Length>,
    pub(super) plated: Option<bool>,
    pub(super) holes: Option<u32>,
}

/// What a report says.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Companion {
    pub(super) stated: Stated,
    pub(super) tools: BTreeMap<u32, Row>,
    /// Speaks of routing, or of drilling; none: of both.
    routing: Option<bool>,
    /// Speaks of the whole folder.
    of_folder: bool,
}

/// Whether a text is a report.
pub(super) fn is_report(text: &[u8]) -> bool {
    let said = |line: &[u8]| !line.starts_with(b";") && MARKS.iter().any(|mark| holds(line, mark));
    if lines(text).any(|line| said(line.text.trim_ascii())) {
        return true;
    }
    let (mut rows, mut others) = (0, 0);
    for line in lines(text).take(100).filter(|line| !line.text.trim_ascii().is_empty()) {
        let line = line.text.trim_ascii();
        if starts(line, "T") && row(line).is_some() {
            rows += 1;
        } else if !line.starts_with(b";") {
            others += 1;
        }
    }
    rows > 0 && rows >= others
}

/// Reads a report.
pub(super) fn read(text: &[u8]) -> Companion {
    let mut found = Companion {
        routing: if holds(text, "NC ROUTE") { Some(true) } else { holds(text, "NC DRILL").then_some(false) },
        of_folder: holds(text, "INTEGER-PLACES")
            || holds(text, "NC ROUTE Log")
            || holds(text, "NC DRILL Log"),
        ..Companion::default()
    };
    // These speak of apertures and of the photoplotter, whose numbers are other ones than those of the drill file.
    let plotter = holds(text, "GAPFile") || holds(text, "Photoplotter Info File");
    if plotter && !holds(text, "Drill Station Info File") {
        return found;
    }
    let mut rows: Vec<(u32, Size, Row)> = Vec::new();
    let (mut integer, mut dec) = (None, None);
    // A report may describe the photoplotter first; its format is another one.
    let from = if holds(text, "NC Drill Setup") { "NC Drill Setup" } else { "" };
    for line in lines(text).skip_while(|line| !holds(line.text, from)) {
        let line = line.text.trim_ascii();
        if let Some(found) = row(line).filter(|_| rows.len() < MOST_ROWS) {
            rows.push(found);
            continue;
        }
        if holds(line, "format") || holds(line, "units") || starts(line, "unit") {
            found.format_line(line);
        }
        if starts(line, "zero suppress") {
            let zeros = if holds(line, "lead") { Some(Zeros::Leading) } else { None };
            found.stated.zeros =
                zeros.or(holds(line, "trail").then_some(Zeros::Trailing)).or(found.stated.zeros);
        }
        let number =
            line.split(u8::is_ascii_whitespace).next_back().and_then(decimal).map(|(number, _)| number);
        if starts(line, "INTEGER-PLACES") {
            integer = number;
        } else if starts(line, "DECIMAL-PLACES") {
            dec = number;
        } else if starts(line, "SUPPRESS-LEAD") && line.ends_with(b"YES") {
            found.stated.zeros = Some(Zeros::Leading);
        } else if starts(line, "SUPPRESS-TRAIL") && line.ends_with(b"YES") {
            found.stated.zeros = Some(Zeros::Trailing);
        } else if starts(line, "SUPPRESS-TRAIL") && line.ends_with(b"NO") {
            found.stated.zeros.get_or_insert(Zeros::None);
        }
    }
    let digit =
        |number: Option<Decimal>| number.and_then(|n| u8::try_from(n.mantissa).ok()).filter(|&n| n <= 9);
    if let (Some(integer), Some(decimal)) = (digit(integer), digit(dec)) {
        found.stated.digits = Some(Digits { integer, decimal });
    }
    for (code, size, row) in rows {
        let diameter = size.length(found.stated.units).filter(|&length| length > Length::ZERO);
        found.tools.insert(code, Row { diameter, ..row });
    }
    found
}

impl Companion {
    fn format_line(&mut self, line: &[u8]) {
        for hint in format_words(line) {
            match hint {
                Hint::Units(units) => self.stated.units = Some(units),
                Hint::Digits(digits) => self.stated.digits = Some(digits),
                Hint::Zeros(zeros) => self.stated.zeros = Some(zeros),
                _ => {}
            }
        }
        if let Some(digits) = digits_in(line).or_else(|| steps(line)) {
            self.stated.digits = Some(digits);
        }
    }

    /// Whether this report, called `own`, speaks of the drill file called `drill`. One that is of a whole folder does only where
    /// that holds `one_board`: whose report it is nobody knows otherwise.
    pub(super) fn speaks_of(
        &self,
        own: &str,
        text: &[u8],
        drill: &str,
        routes: bool,
        one_board: bool,
    ) -> bool {
        if folder(own) != folder(drill) || self.routing.is_some_and(|routing| routing != routes) {
            return false;
        }
        let base = base(drill);
        self.of_folder && one_board
            || stem(own) == stem(drill)
            || front_stem(own) == front_stem(drill)
            || holds(text, base)
    }
}

/// Digits of a step such as `1/10000 Inch`, or of a picture such as `3V3`.
fn steps(line: &[u8]) -> Option<Digits> {
    let parts = || line.split(|&byte| b" \t,:=".contains(&byte));
    let picture = parts().find_map(|part| match *part {
        [before @ b'0'..=b'9', b'V' | b'v', behind @ b'0'..=b'9'] => {
            Some(Digits { integer: before - b'0', decimal: behind - b'0' })
        }
        _ => None,
    });
    let step = parts().find_map(|part| part.strip_prefix(b"1/1"));
    let zeros = step.filter(|zeros| (1..=6).contains(&zeros.len()) && zeros.iter().all(|byte| *byte == b'0'));
    let integer = if holds(line, "inch") { 2 } else { 3 };
    picture.or(zeros.map(|zeros| Digits { integer, decimal: zeros.len() as u8 }))
}

/// The folder part of a name, with the archive it is in.
pub(super) fn folder(name: &str) -> &str {
    name.rfind(['/', '\\']).map_or("", |at| &name[..at])
}

/// The last part of a name.
pub(super) fn base(name: &str) -> &str {
    name.rfind(['/', '\\']).map_or(name, |at| &name[at + 1..])
}

/// The last part of a name without its ending.
pub(super) fn stem(name: &str) -> &str {
    let base = base(name);
    base.rfind('.').map_or(base, |at| &base[..at])
}

/// The name up to its first point, if that is more than a word.
fn front_stem(name: &str) -> &str {
    let base = base(name);
    base.find('.').map_or(base, |at| &base[..at])
}

/// A size, perhaps without units.
#[derive(Clone, Copy, Debug)]
struct Size {
    number: Decimal,
    units: Option<Units>,
}

impl Size {
    fn length(self, units: Option<Units>) -> Option<Length> {
        self.number.length(self.units.or(units)?)
    }
}

/// A tool row, in any of the three shapes.
fn row(line: &[u8]) -> Option<(u32, Size, Row)> {
    let words: Vec<&[u8]> = line
        .split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty() && !word.starts_with(b"("))
        .take(16)
        .collect();
    let (code, size, rest) = match words.as_slice() {
        [first, second, rest @ ..] if tool_code(first).is_some() => {
            let (size, used) = size(second, rest.first().copied(), false)?;
            (tool_code(first)?, size, rest.get(used..)?)
        }
        [first, second, rest @ ..] if tool_code(second).is_some() => {
            (tool_code(second)?, size(first, None, false)?.0, rest)
        }
        [first, second, unit, rest @ ..] => (whole(first)?, size(second, Some(*unit), true)?.0, rest),
        _ => return None,
    };
    let holes = rest.iter().find_map(|word| whole(word.strip_suffix(b"x").unwrap_or(word)));
    let plated = rest.iter().find_map(|word| plating(word));
    Some((code, size, Row { diameter: None, plated, holes }))
}

fn tool_code(word: &[u8]) -> Option<u32> {
    whole(word.strip_prefix(b"T").or(word.strip_prefix(b"t"))?)
}

fn whole(word: &[u8]) -> Option<u32> {
    let (number, used) = decimal(word)?;
    (used == word.len() && !number.point).then(|| u32::try_from(number.mantissa).ok()).flatten()
}

/// `0.3mm`, `12mil`, `23.33 Mil` or `0.0320`; with how many of the following words it took.
fn size(word: &[u8], next: Option<&[u8]>, unit_needed: bool) -> Option<(Size, usize)> {
    let (number, used) = decimal(word)?;
    let unit = word.get(used..)?;
    let (named, took) = match (named_unit(unit), next.and_then(named_unit)) {
        (Some(named), _) => (Some(named), 0),
        (None, Some(named)) if unit.is_empty() => (Some(named), 1),
        _ if unit.is_empty() && !unit_needed => (None, 0),
        _ => return None,
    };
    Some(match named {
        Some((units, shift)) => {
            let number = Decimal { decimals: number.decimals + shift, ..number };
            (Size { number, units: Some(units) }, took)
        }
        None => (Size { number, units: None }, took),
    })
}

/// A unit by name, and how many places further the point stands in inches.
fn named_unit(word: &[u8]) -> Option<(Units, u8)> {
    match word.to_ascii_lowercase().as_slice() {
        b"mm" => Some((Units::Mm, 0)),
        b"mil" | b"mils" => Some((Units::Inch, 3)),
        b"inch" | b"in" | b"\"" => Some((Units::Inch, 0)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_every_shape() {
        for (line, units, want) in [
            ("T1 0.300000mm  362x [-52.07 | 18.4]", None, (1, 300_000, Some(362), None)),
            (
                "T1      0.2mm (8mil)   Round   4171   PTH   7006.69mm (275.85inch)",
                None,
                (1, 200_000, Some(4171), Some(true)),
            ),
            ("1     23.33 Mil     248", None, (1, 592_582, Some(248), None)),
            ("0.0150  T01", Some(Units::Inch), (1, 381_000, None, None)),
            ("T01\t0.508mm (0-15) Non-Plated", None, (1, 508_000, None, Some(false))),
            ("T02 0.0400", Some(Units::Inch), (2, 1_016_000, None, None)),
        ] {
            let (code, size, row) = row(line.as_bytes()).unwrap();
            let nm = size.length(units).unwrap().nm();
            assert_eq!((code, nm, row.holes, row.plated), want, "{line}");
        }
        for line in ["Layer Pair : Top to Bottom", "D10 ROUND 4.00", "Totals 427", "G00X1", ""] {
            assert!(row(line.as_bytes()).is_none(), "{line}");
        }
    }

    #[test]
    fn allegro_parameters() {
        let found = read(b"INTEGER-PLACES  3\r\nDECIMAL-PLACES 5\r\nOUTPUT-UNITS ENGLISH\r\nSUPPRESS-LEAD-ZEROES NO\r\nSUPPRESS-TRAIL-ZEROES  NO\r\n");
        let digits = super::super::Digits { integer: 3, decimal: 5 };
        assert_eq!(
            found.stated,
            Stated { units: Some(Units::Inch), digits: Some(digits), zeros: Some(Zeros::None) }
        );
    }
}
