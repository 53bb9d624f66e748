//! Plain lists of holes: columns of coordinates with a diameter beside them or in a heading above.
//!
//! Comes in: text. Goes out: a [`DrillFile`] with tools made from the diameters, and diagnostics. Does not know Excellon.
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
use std::collections::BTreeMap;

pub(super) use super::columns::is_placement;

/// Different diameters taken from one list.
const MOST_TOOLS: usize = 1_000;

/// Whether a text is a list: nothing but headings, groups and rows of holes.
pub(super) fn is_list(text: &[u8]) -> bool {
    let columns = Columns::of(text);
    let mut all: Vec<Row> = lines(text).take(200).map(|line| columns.row(line.text)).collect();
    all.pop(); // the last line looked at may be cut
    let count = |want: fn(&Row) -> bool| all.iter().filter(|row| want(row)).count();
    let holes = count(|row| matches!(row, Row::Hole(..)));
    holes > 0 && count(|row| matches!(row, Row::Other)) * 10 < holes
}

/// A list read.
pub(super) struct List {
    pub(super) drill: DrillFile,
    pub(super) units: Units,
    pub(super) units_by: Source,
    pub(super) diagnostics: Vec<Diagnostic>,
}

/// Reads a list. The error is the diagnostic why nothing of it is kept.
pub(super) fn read(name: &str, text: &[u8], person: &Overrides) -> Result<List, Diagnostic> {
    let columns = Columns::of(text);
    let (mut units, mut units_by) =
        stated_units(text, &columns).map_or((Units::Mm, Source::Default), |u| (u, Source::Header));
    if units_by == Source::Default
        && let Some(shaped) = units_by_sizes(&sizes(text, &columns))
    {
        (units, units_by) = (shaped, Source::Shape);
    }
    if let Some(chosen) = person.units {
        (units, units_by) = (chosen, Source::Person);
    }
    let mut reader = Reader {
        name,
        units,
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
        findings.whole(Diagnostic::warning("drill.columns_by_shape"));
    }
    match units_by {
        Source::Shape => {
            findings.whole(Diagnostic::warning("drill.units_by_sizes").with("reading", units.name()));
        }
        Source::Default => {
            findings.whole(Diagnostic::error("drill.units_unknown").with("reading", units.name()));
        }
        _ => {}
    }
    Ok(List { drill: reader.out, units, units_by, diagnostics: findings.finish() })
}

fn stated_units(text: &[u8], columns: &Columns) -> Option<Units> {
    lines(text).take(200).find_map(|line| {
        let headed = matches!(columns.row(line.text), Row::Heading | Row::Other);
        let words = || line.text.split(|byte| !byte.is_ascii_alphabetic());
        let named = |name: &str| words().any(|word| starts(word, name));
        if !headed {
            None
        } else if named("inch") {
            Some(Units::Inch)
        } else {
            (named("millimet") || named("metric") || words().any(|word| word.eq_ignore_ascii_case(b"mm")))
                .then_some(Units::Mm)
        }
    })
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
    findings: Findings,
    out: DrillFile,
    tools: BTreeMap<Option<i64>, u16>,
    /// Tool of the heading in force, its line, the count it promised and the hits before it.
    group: Option<(u16, u32, Option<u32>, usize)>,
}

impl Reader<'_> {
    fn line(&mut self, line: Line<'_>, columns: &Columns) -> Result<(), Diagnostic> {
        match columns.row(line.text) {
            Row::Blank | Row::Heading => {}
            Row::Other => self.findings.at(Severity::Error, "drill.list_row", line.number, 1, line.text),
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
        match (x.length(self.units), y.length(self.units)) {
            (Some(x), Some(y)) => self.out.hits.push(Hit { at: Point::new(x, y), line: line.number, tool }),
            _ => self.findings.at(Severity::Error, "drill.out_of_range", line.number, 1, line.text),
        }
        if self.out.hits.len() >= MOST_HITS {
            return Err(self.refusal("drill.too_many_hits", line.number).with("most", MOST_HITS));
        }
        Ok(())
    }

    fn refusal(&self, code: &str, line: u32) -> Diagnostic {
        Diagnostic::error(code).at(self.name, line, 1)
    }

    /// The tool of this diameter; numbers are given in the order of first use.
    fn tool(&mut self, size: Option<Decimal>, line: Line<'_>) -> Result<u16, Diagnostic> {
        let diameter = size.and_then(|size| size.length(self.units)).filter(|length| length.nm() > 0);
        let key = diameter.map(|length| length.nm());
        if let Some(&tool) = self.tools.get(&key) {
            return Ok(tool);
        }
        if self.tools.len() >= MOST_TOOLS {
            return Err(self.refusal("drill.too_many_tools", line.number).with("most", MOST_TOOLS));
        }
        let tool = self.out.tools.len() as u16;
        let code = u32::from(tool) + 1;
        if diameter.is_none() {
            let diagnostic = Diagnostic::error("drill.tool_without_diameter").at(self.name, line.number, 1);
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
                let diagnostic = Diagnostic::warning("drill.count_differs").at(self.name, line, 1);
                self.findings.push(diagnostic.with("found", found).with("promised", promised));
            }
        }
    }
}
