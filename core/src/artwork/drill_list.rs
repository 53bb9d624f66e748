//! Plain lists of holes: columns of coordinates, with the diameter in a column or in a heading above.
//!
//! ```text
//! X;Y;D               UNITS INCH          (see [`super::columns`])
//! -5,080;0,000;0,8    DRILL 0.0320 COUNT 36
//!                       -0.2000,0.0000
//! ```

use super::columns::{Columns, Row};
use super::drill::{DrillFile, Hit, ToolEntry};
use super::excellon::{MOST_HITS, units_by_sizes};
use super::findings::Findings;
use super::number::Decimal;
use super::text::{Line, lines, starts};
use super::{Overrides, Source, Units};
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::Point;
use crate::units::Length;
use crate::{code, error, warning};
use std::collections::BTreeMap;

pub(super) use super::columns::is_placement;

const MOST_TOOLS: usize = 1_000;

/// True if a text has only headings, groups and rows of holes.
pub(super) fn is_list(text: &[u8]) -> bool {
    let columns = Columns::of(text);
    let mut all: Vec<Row> = lines(text).take(200).map(|line| columns.row(line.text)).collect();
    all.pop(); // the last line looked at may be cut
    let title = |row: &&Row| columns.headed && !matches!(row, Row::Hole(..));
    let count = |want: fn(&Row) -> bool| all.iter().skip_while(title).filter(|row| want(row)).count();
    let holes = count(|row| matches!(row, Row::Hole(..)));
    holes > 0 && count(|row| matches!(row, Row::Other)) * 10 < holes
}

pub(super) struct List {
    pub(super) drill: DrillFile,
    pub(super) units: Units,
    pub(super) units_by: Source,
    pub(super) diagnostics: Vec<Diagnostic>,
}

/// Reads a list. Fails with the reason why nothing is usable.
pub(super) fn read(name: &str, text: &[u8], person: &Overrides) -> Result<List, Diagnostic> {
    let columns = Columns::of(text);
    let named = named_units(text, &columns);
    let by_sizes = || units_by_sizes(&sizes(text, &columns));
    let (units, mils, units_by) = match (person.units, &named) {
        (Some(chosen), _) => (chosen, false, Source::Person),
        (None, &Named::One(units, mils, by)) => (units, mils, by),
        (None, Named::Several) => (by_sizes().unwrap_or(Units::Mm), false, Source::Default),
        (None, Named::Nothing) => match by_sizes() {
            Some(shaped) => (shaped, false, Source::Shape),
            None => (Units::Mm, false, Source::Default),
        },
    };
    let mut reader = Reader {
        name,
        units,
        mils,
        findings: Findings::new(name),
        out: DrillFile::default(),
        tools: BTreeMap::new(),
        group: None,
    };
    for line in lines(text) {
        reader.line(line, &columns)?;
    }
    reader.end_of_group();
    let mut findings = reader.findings;
    if columns.unsure {
        findings.whole(warning!("drill.columns_by_shape"));
    }
    match units_by {
        Source::Shape => {
            findings.whole(warning!("drill.units_by_sizes", reading = units.name()));
        }
        Source::Default => {
            let several = matches!(named, Named::Several);
            let code = if several { code!("drill.units_several") } else { code!("drill.units_unknown") };
            findings.whole(Diagnostic::error(code).with("reading", units.name()));
        }
        _ => {}
    }
    Ok(List { drill: reader.out, units, units_by, diagnostics: findings.finish() })
}

enum Named {
    Nothing,
    /// The units, whether the numbers are thousandths of them, and the evidence.
    One(Units, bool, Source),
    /// The list contradicts itself.
    Several,
}

/// The units named in cells, headings and lines that start with a unit; else in other lines; else in
/// comments. The first of these with a unit decides.
fn named_units(text: &[u8], columns: &Columns) -> Named {
    let mut said = [[false; 3]; 3];
    for line in lines(text).take(2_000).map(|line| line.text.trim_ascii()) {
        let row = columns.row(line);
        let cells = matches!(row, Row::Hole(..));
        let comment = line.first().is_some_and(|byte| b";#!/".contains(byte));
        let begins = ["UNIT", "METRIC", "INCH", "MM", "MIL"].iter().any(|word| starts(line, word));
        let names = cells || begins || super::columns::names_columns(line);
        let level = if comment { 2 } else { usize::from(!names) };
        let words = || line.split(|byte| !byte.is_ascii_alphabetic());
        let is = |name: &str| words().any(|word| word.eq_ignore_ascii_case(name.as_bytes()));
        let begin = |name: &str| words().any(|word| starts(word, name));
        let mm = is("mm") || begin("millimet") || begin("metric");
        let mil = is("mil") || is("mils") || is("thou");
        let inch = begin("inch") || is("zoll") || level == 0 && is("in");
        if let Some(said) = said.get_mut(level) {
            for (said, now) in said.iter_mut().zip([mm, inch, mil]) {
                *said |= now;
            }
        }
    }
    let Some((level, said)) = said.into_iter().enumerate().find(|(_, said)| said.contains(&true)) else {
        return Named::Nothing;
    };
    let by = if level == 2 { Source::Comment } else { Source::Header };
    match said {
        [true, false, false] => Named::One(Units::Mm, false, by),
        [false, true, false] => Named::One(Units::Inch, false, by),
        [false, false, true] => Named::One(Units::Inch, true, by),
        _ => Named::Several,
    }
}

fn sizes(text: &[u8], columns: &Columns) -> Vec<Decimal> {
    lines(text)
        .take(2_000)
        .filter_map(|line| match columns.row(line.text) {
            Row::Group(size, _) => Some(size),
            Row::Hole(_, _, size) => size,
            _ => None,
        })
        .collect()
}

struct Reader<'a> {
    name: &'a str,
    units: Units,
    mils: bool,
    findings: Findings,
    out: DrillFile,
    tools: BTreeMap<Option<i64>, u16>,
    /// Tool of the current group heading, its line, the stated count, and the number of hits before it.
    group: Option<(u16, u32, Option<u32>, usize)>,
}

impl Reader<'_> {
    fn line(&mut self, line: Line<'_>, columns: &Columns) -> Result<(), Diagnostic> {
        match columns.row(line.text) {
            Row::Blank | Row::Heading => {}
            Row::Other if columns.headed && self.out.hits.is_empty() => {}
            Row::Other => {
                self.findings.at(Severity::Error, code!("drill.list_row"), line.number, 1, line.text);
            }
            Row::Group(size, count) => {
                self.end_of_group();
                let tool = self.tool(Some(size), line)?;
                self.group = Some((tool, line.number, count, self.out.hits.len()));
            }
            Row::Hole(x, y, size) => self.hole([x, y], size, line)?,
        }
        Ok(())
    }

    fn hole(
        &mut self,
        [x, y]: [Decimal; 2],
        size: Option<Decimal>,
        line: Line<'_>,
    ) -> Result<(), Diagnostic> {
        let tool = match (size, self.group) {
            (Some(size), _) => self.tool(Some(size), line)?,
            (None, Some((tool, ..))) => tool,
            (None, None) => self.tool(None, line)?,
        };
        match (self.length(x), self.length(y)) {
            (Some(x), Some(y)) => self.out.hits.push(Hit { at: Point::new(x, y), line: line.number, tool }),
            _ => self.findings.at(Severity::Error, code!("drill.out_of_range"), line.number, 1, line.text),
        }
        if self.out.hits.len() >= MOST_HITS {
            return Err(self.refusal(code!("drill.too_many_hits"), line.number).with("most", MOST_HITS));
        }
        Ok(())
    }

    fn length(&self, number: Decimal) -> Option<Length> {
        let shift = if self.mils { 3 } else { 0 };
        Decimal { decimals: number.decimals.saturating_add(shift), ..number }.length(self.units)
    }

    fn refusal(&self, code: &str, line: u32) -> Diagnostic {
        Diagnostic::error(code).at(self.name, line, 1)
    }

    /// The tool of this diameter; new tools are numbered in the order of first use.
    fn tool(&mut self, size: Option<Decimal>, line: Line<'_>) -> Result<u16, Diagnostic> {
        let diameter = size.and_then(|size| self.length(size)).filter(|length| length.nm() > 0);
        let key = diameter.map(|length| length.nm());
        if let Some(&tool) = self.tools.get(&key) {
            return Ok(tool);
        }
        if self.tools.len() >= MOST_TOOLS {
            return Err(self.refusal(code!("drill.too_many_tools"), line.number).with("most", MOST_TOOLS));
        }
        let tool = self.out.tools.len() as u16;
        let code = u32::from(tool) + 1;
        if diameter.is_none() {
            let diagnostic = error!("drill.tool_without_diameter", ..).at(self.name, line.number, 1);
            self.findings.push(diagnostic.with("tool", format!("T{code}")).with("holes", "?"));
        }
        self.out.tools.push(ToolEntry { code, diameter, plated: None, line: line.number });
        self.tools.insert(key, tool);
        Ok(tool)
    }

    fn end_of_group(&mut self) {
        if let Some((_, line, Some(promised), before)) = self.group.take() {
            let found = self.out.hits.len() - before;
            if found != promised as usize {
                let diagnostic = warning!("drill.count_differs", ..).at(self.name, line, 1);
                self.findings.push(diagnostic.with("found", found).with("promised", promised));
            }
        }
    }
}
