//! Reports and tool tables that CADs write next to drill files: units, digits, tool sizes, hole counts.
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

const MOST_ROWS: usize = 1_000;

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

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Row {
    pub(super) diameter: Option<Length>,
    pub(super) plated: Option<bool>,
    pub(super) holes: Option<u32>,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Companion {
    pub(super) stated: Stated,
    /// Rows by tool number, with the index of their heading. A tool can have several rows, one per part of
    /// the report.
    tools: BTreeMap<u32, Vec<(usize, Row)>>,
    /// Headings that name a file; a report on several files has one for each.
    headings: Vec<String>,
    /// True: about routing; false: about drilling; none: about both.
    routing: Option<bool>,
    /// About all drill files of the folder.
    of_folder: bool,
}

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

pub(super) fn read(text: &[u8]) -> Companion {
    let mut found = Companion {
        routing: if holds(text, "NC ROUTE") { Some(true) } else { holds(text, "NC DRILL").then_some(false) },
        of_folder: holds(text, "INTEGER-PLACES")
            || holds(text, "NC ROUTE Log")
            || holds(text, "NC DRILL Log"),
        ..Companion::default()
    };
    // These reports describe apertures and the photoplotter, whose number format differs from the drill
    // file's.
    let plotter = holds(text, "GAPFile") || holds(text, "Photoplotter Info File");
    if plotter && !holds(text, "Drill Station Info File") {
        return found;
    }
    let mut rows: Vec<(u32, Size, (usize, Row))> = Vec::new();
    let (mut integer, mut dec) = (None, None);
    // A report may describe the photoplotter first, with another number format: skip that part.
    let from = if holds(text, "NC Drill Setup") { "NC Drill Setup" } else { "" };
    for line in lines(text).skip_while(|line| !holds(line.text, from)) {
        let line = line.text.trim_ascii();
        if let Some((code, size, row)) = row(line).filter(|_| rows.len() < MOST_ROWS) {
            rows.push((code, size, (found.headings.len(), row)));
            continue;
        }
        if names_file(line) && found.headings.len() < MOST_ROWS {
            found.headings.push(String::from_utf8_lossy(line).to_ascii_lowercase());
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
    for (code, size, (heading, row)) in rows {
        let diameter = size.length(found.stated.units).filter(|&length| length > Length::ZERO);
        found.tools.entry(code).or_default().push((heading, Row { diameter, ..row }));
    }
    found
}

/// True if a line names the file that the following rows are about.
fn names_file(line: &[u8]) -> bool {
    let ends = [".drl", ".txt", ".xln", ".drd", ".nc", ".exc", ".tap"];
    holds(line, "file") && ends.iter().any(|end| holds(line, end))
}

impl Companion {
    pub(super) fn is_without_tools(&self) -> bool {
        self.tools.is_empty()
    }

    pub(super) fn tool_codes(&self) -> impl Iterator<Item = u32> {
        self.tools.keys().copied()
    }

    /// The rows of a tool for the drill file `drill`: those below a heading with the file's name if there are
    /// any, else all.
    pub(super) fn tool(&self, code: u32, drill: &str) -> Vec<Row> {
        let rows = self.tools.get(&code).map_or(&[][..], Vec::as_slice);
        let name = base(drill).to_ascii_lowercase();
        let own = |heading: usize| {
            let heading = heading.checked_sub(1).and_then(|at| self.headings.get(at));
            heading.is_some_and(|heading| heading.contains(&name))
        };
        let named: Vec<Row> = rows.iter().filter(|(heading, _)| own(*heading)).map(|(_, row)| *row).collect();
        let is_named = self.headings.iter().any(|heading| heading.contains(&name));
        if is_named { named } else { rows.iter().map(|(_, row)| *row).collect() }
    }

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

    /// True if this report (file `own`) is about the drill file `drill`. A report on a whole folder counts
    /// only if the folder has `one_board`; otherwise it isn't clear which board it is about.
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

/// Digits from a resolution like `1/10000 Inch`, or from a picture like `3V3`.
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

/// The folder of a path, including the archive that it is in.
pub(super) fn folder(name: &str) -> &str {
    name.rfind(['/', '\\']).map_or("", |at| &name[..at])
}

pub(super) fn base(name: &str) -> &str {
    name.rfind(['/', '\\']).map_or(name, |at| &name[at + 1..])
}

/// The file name without its extension.
pub(super) fn stem(name: &str) -> &str {
    let base = base(name);
    base.rfind('.').map_or(base, |at| &base[..at])
}

/// The file name up to its first point, if the name has several words.
fn front_stem(name: &str) -> &str {
    let base = base(name);
    base.find('.').map_or(base, |at| &base[..at])
}

/// A size; its unit can be missing.
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

fn row(line: &[u8]) -> Option<(u32, Size, Row)> {
    let mut depth = false;
    let mut counted = None;
    let mut words: Vec<&[u8]> = Vec::new();
    let all: Vec<&[u8]> =
        line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).take(24).collect();
    for (at, word) in all.iter().enumerate() {
        // `(34 holes) (with 2 slots)`: the 34 include the slots.
        let holes = all.get(at + 1).is_some_and(|next| starts(next, "hole"));
        counted = counted.or(word.strip_prefix(b"(").filter(|_| holes).and_then(whole));
        depth |= word.starts_with(b"(");
        if !depth {
            words.push(word);
        }
        depth &= !word.ends_with(b")");
    }
    words.truncate(16);
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
    let holes =
        counted.or_else(|| rest.iter().find_map(|word| whole(word.strip_suffix(b"x").unwrap_or(word))));
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

/// `0.3mm`, `12mil`, `23.33 Mil` or `0.0320`. Also returns how many of the following words it used.
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

/// A unit by name, and the decimal places to shift to get inches (3 for mil).
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
    fn report_rows_of_every_shape_are_read() {
        for (line, units, want) in [
            ("T1 0.300000mm  362x [-52.07 | 18.4]", None, (1, 300_000, Some(362), None)),
            (
                "T1      0.2mm (8mil)   Round   4171   PTH   7006.69mm (275.85inch)",
                None,
                (1, 200_000, Some(4171), Some(true)),
            ),
            ("1     23.33 Mil     248", None, (1, 592_582, Some(248), None)),
            ("0.0150  T01", Some(Units::Inch), (1, 381_000, None, None)),
            ("T1  0.80mm  0.0315\"  (34 holes)  (with 2 slots)", None, (1, 800_000, Some(34), None)),
            ("T2  1.00mm  0.0394\"  (1 hole)", None, (2, 1_000_000, Some(1), None)),
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
    fn allegro_parameters_give_units_digits_and_zeros() {
        let found = read(b"INTEGER-PLACES  3\r\nDECIMAL-PLACES 5\r\nOUTPUT-UNITS ENGLISH\r\nSUPPRESS-LEAD-ZEROES NO\r\nSUPPRESS-TRAIL-ZEROES  NO\r\n");
        let digits = super::super::Digits { integer: 3, decimal: 5 };
        assert_eq!(
            found.stated,
            Stated { units: Some(Units::Inch), digits: Some(digits), zeros: Some(Zeros::None) }
        );
    }
}
