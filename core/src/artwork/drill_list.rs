//! Plain lists of holes: columns of coordinates with a diameter beside them or in a heading above.
//!
//! Comes in: text. Goes out: a [`DrillFile`] with tools made from the diameters, and remarks. Does not know Excellon.
//!
//! ```text
//! X;Y;D               UNITS INCH
//! -5,080;0,000;0,8    DRILL 0.0320 COUNT 36
//!                       -0.2000,0.0000
//! ```

use super::drill::{DrillFile, Hit, ToolEntry};
use super::excellon::{MOST_HITS, units_by_sizes};
use super::findings::Findings;
use super::number::{Decimal, decimal};
use super::text::{Line, holds, lines, starts};
use super::{Overrides, Source, Units};
use crate::geometry::Point;
use crate::remark::{Remark, Weight};
use std::collections::BTreeMap;

/// Different diameters taken from one list.
const MOST_TOOLS: usize = 1_000;

/// What a line of a list is.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Row {
    Blank,
    /// Names of columns, units, a title.
    Heading,
    /// `DRILL 0.0320 COUNT 36`: the diameter of what follows.
    Group(Decimal, Option<u32>),
    /// Two or three numbers.
    Numbers(Vec<Decimal>),
    /// Something else.
    Other,
}

/// Whether a text is a list: nothing but headings, groups and rows of two or three numbers.
pub(super) fn is_list(text: &[u8]) -> bool {
    let comma = decimal_comma(text);
    let mut all: Vec<Row> = lines(text).take(200).map(|line| row(line.text, comma)).collect();
    all.pop(); // the last line looked at may be cut
    let count = |want: fn(&Row) -> bool| all.iter().filter(|row| want(row)).count();
    let numbers = count(|row| matches!(row, Row::Numbers(_)));
    numbers > 0 && count(|row| matches!(row, Row::Other)) * 10 < numbers
}

/// A list with semicolons or tabs and no points uses decimal commas.
fn decimal_comma(text: &[u8]) -> bool {
    let numbers = || lines(text).take(200).filter(|line| line.text.iter().any(u8::is_ascii_digit));
    numbers().any(|line| line.text.contains(&b';')) && !numbers().any(|line| line.text.contains(&b'.'))
}

fn row(line: &[u8], comma: bool) -> Row {
    let line = line.trim_ascii();
    if line.is_empty() {
        return Row::Blank;
    }
    if line.first().is_some_and(|byte| b";#!/".contains(byte)) {
        return Row::Heading;
    }
    let text: Vec<u8> = line.iter().map(|&byte| if comma && byte == b',' { b'.' } else { byte }).collect();
    let parts: Vec<&[u8]> = text
        .split(|&byte| byte == b';' || byte == b',' || byte.is_ascii_whitespace())
        .filter(|part| !part.is_empty())
        .take(8)
        .collect();
    let number =
        |part: &&[u8]| decimal(part).filter(|(_, used)| *used == part.len()).map(|(number, _)| number);
    let numbers: Vec<Decimal> = parts.iter().filter_map(number).collect();
    if numbers.len() == parts.len() && (2..=3).contains(&numbers.len()) {
        return Row::Numbers(numbers);
    }
    let grouping = ["DRILL", "DIA", "SIZE", "TOOL", "HOLE"].iter().any(|word| starts(line, word));
    match (grouping, numbers.first()) {
        (true, Some(&size)) => {
            let count = numbers.get(1).and_then(|count| u32::try_from(count.mantissa).ok());
            Row::Group(size, count.filter(|_| holds(line, "COUNT") || holds(line, "QTY")))
        }
        _ if heading(line) => Row::Heading,
        _ => Row::Other,
    }
}

fn heading(line: &[u8]) -> bool {
    let words = ["DRILL", "UNIT", "HOLE", "END", "METRIC", "INCH", "MM", "LIST", "BOARD"];
    let columns = line.split(|byte| !byte.is_ascii_alphabetic()).filter(|part| !part.is_empty());
    words.iter().any(|word| starts(line, word)) || columns.take(2).eq([&b"X"[..], b"Y"]) || columns_xy(line)
}

fn columns_xy(line: &[u8]) -> bool {
    let mut columns = line.split(|byte| !byte.is_ascii_alphabetic()).filter(|part| !part.is_empty());
    let is = |part: Option<&[u8]>, name: &[u8]| part.is_some_and(|part| part.eq_ignore_ascii_case(name));
    is(columns.next(), b"x") && is(columns.next(), b"y")
}

/// A list read.
pub(super) struct List {
    pub(super) drill: DrillFile,
    pub(super) units: Units,
    pub(super) units_by: Source,
    pub(super) remarks: Vec<Remark>,
}

/// Reads a list. The error is the remark why nothing of it is kept.
pub(super) fn read(name: &str, text: &[u8], person: &Overrides) -> Result<List, Remark> {
    let comma = decimal_comma(text);
    let (mut units, mut units_by) =
        stated_units(text).map_or((Units::Mm, Source::Default), |u| (u, Source::Header));
    if units_by == Source::Default
        && let Some(shaped) = units_by_sizes(&sizes(text, comma))
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
        reader.line(line, comma)?;
    }
    reader.end_of_group();
    let mut findings = reader.findings;
    match units_by {
        Source::Shape => {
            findings.whole(Remark::new(Weight::Doubt, "drill.units_by_sizes").with("units", units.name()));
        }
        Source::Default => {
            findings.whole(Remark::new(Weight::Loss, "drill.units_unknown").with("units", units.name()));
        }
        _ => {}
    }
    Ok(List { drill: reader.out, units, units_by, remarks: findings.finish() })
}

fn stated_units(text: &[u8]) -> Option<Units> {
    lines(text).take(200).find_map(|line| {
        let headed = matches!(row(line.text, false), Row::Heading | Row::Other);
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

fn sizes(text: &[u8], comma: bool) -> Vec<Decimal> {
    lines(text)
        .take(2_000)
        .filter_map(|line| match row(line.text, comma) {
            Row::Group(size, _) => Some(size),
            Row::Numbers(numbers) => numbers.get(2).copied(),
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
    fn line(&mut self, line: Line<'_>, comma: bool) -> Result<(), Remark> {
        match row(line.text, comma) {
            Row::Blank | Row::Heading => {}
            Row::Other => self.findings.at(Weight::Loss, "drill.list_row", line.number, 1, line.text),
            Row::Group(size, count) => {
                self.end_of_group();
                let tool = self.tool(Some(size), line)?;
                self.group = Some((tool, line.number, count, self.out.hits.len()));
            }
            Row::Numbers(numbers) => self.hole(&numbers, line)?,
        }
        Ok(())
    }

    fn hole(&mut self, numbers: &[Decimal], line: Line<'_>) -> Result<(), Remark> {
        let [x, y, rest @ ..] = numbers else { return Ok(()) };
        let tool = match (rest.first(), self.group) {
            (Some(&size), _) => self.tool(Some(size), line)?,
            (None, Some((tool, ..))) => tool,
            (None, None) => self.tool(None, line)?,
        };
        match (x.length(self.units), y.length(self.units)) {
            (Some(x), Some(y)) => self.out.hits.push(Hit { at: Point::new(x, y), line: line.number, tool }),
            _ => self.findings.at(Weight::Loss, "drill.out_of_range", line.number, 1, line.text),
        }
        if self.out.hits.len() >= MOST_HITS {
            return Err(self.refusal("drill.too_many_hits", line.number).with("most", MOST_HITS));
        }
        Ok(())
    }

    fn refusal(&self, code: &str, line: u32) -> Remark {
        Remark::new(Weight::Loss, code).at(self.name, line, 1)
    }

    /// The tool of this diameter; numbers are given in the order of first use.
    fn tool(&mut self, size: Option<Decimal>, line: Line<'_>) -> Result<u16, Remark> {
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
            let remark =
                Remark::new(Weight::Loss, "drill.tool_without_diameter").at(self.name, line.number, 1);
            self.findings.push(remark.with("tool", format!("T{code}")).with("holes", "?"));
        }
        self.out.tools.push(ToolEntry { code, diameter, plated: None, line: line.number });
        self.tools.insert(key, tool);
        Ok(tool)
    }

    fn end_of_group(&mut self) {
        if let Some((_, line, Some(promised), before)) = self.group.take() {
            let found = self.out.hits.len() - before;
            if found != promised as usize {
                let remark = Remark::new(Weight::Doubt, "drill.count_differs").at(self.name, line, 1);
                self.findings.push(remark.with("found", found).with("promised", promised));
            }
        }
    }
}
