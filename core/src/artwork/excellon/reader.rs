//! Reads a drill program with a known number format, line by line; plain hits take a fast path. A line with a
//! fault has no effect and becomes an error; reading continues after it.

use super::block::{Block, Fault, Pair, sort};
use super::hints::{self, Hint};
use super::survey::{CommentTool, Survey};
use super::words::{Content, Word, parse};
use crate::artwork::Zeros;
use crate::artwork::drill::{DrillFile, Hit, Route, ToolEntry};
use crate::artwork::findings::Findings;
use crate::artwork::number::{Decimal, Reading, Scale, decimal};
use crate::artwork::text::line_end;
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::Point;
use crate::units::Length;
use crate::{code, error, note, warning};
use std::collections::BTreeMap;

pub const MOST_HITS: usize = 4_000_000;
pub(super) const MOST_REPEATED: usize = 1_000_000;
const MOST_MOVES: usize = 500_000;
const MOST_TOOLS: usize = 1_000;

/// Sizes and plating of tools by number, from another file.
pub(in crate::artwork) type ToolTable = BTreeMap<u32, (Option<Length>, Option<bool>)>;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    Drill,
    Rout,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Motion {
    Rapid,
    Straight,
    Clockwise,
    Counterclockwise,
}

/// A pattern that is being recorded or repeated (M25 … M01, M02, M08).
#[derive(Clone, Copy, Debug)]
pub(super) struct Pattern {
    /// Start index in hits, slots and routes.
    pub(super) from: [usize; 3],
    /// End index, after M01.
    pub(super) to: Option<[usize; 3]>,
    /// Offset of the last copy.
    pub(super) shift: Point,
}

#[derive(Clone, Copy)]
pub(in crate::artwork) struct Task<'a> {
    pub(in crate::artwork) name: &'a str,
    pub(in crate::artwork) text: &'a [u8],
    pub(in crate::artwork) reading: Reading,
    pub(in crate::artwork) survey: &'a Survey,
    pub(in crate::artwork) table: &'a ToolTable,
}

pub(super) struct Reader<'a> {
    pub(super) task: &'a Task<'a>,
    /// Next byte, and the number of its line.
    index: usize,
    pub(super) line: u32,
    /// The current reading; a units statement can change it.
    pub(super) reading: Reading,
    pub(super) stated: Option<crate::artwork::Units>,
    pub(super) scale: Scale,
    pub(super) findings: Findings,
    pub(super) out: DrillFile,
    /// Index in the tool table by tool number.
    pub(super) codes: BTreeMap<u32, u16>,
    /// The current tool; none before the first one, or after an unreadable tool word.
    pub(super) tool: Option<u16>,
    pub(super) at: Point,
    pub(super) zero: Point,
    pub(super) incremental: bool,
    pub(super) header: bool,
    pub(super) mode: Mode,
    pub(super) motion: Motion,
    pub(super) route: Option<Route>,
    pub(super) pattern: Option<Pattern>,
    pub(super) repeated: usize,
    pub(super) moves: usize,
    pub(super) section_plated: Option<bool>,
    pub(super) next_plated: Option<bool>,
    /// A stop (M00 or M02) was read.
    pub(super) stopped: bool,
    /// The amount drilled at the last stop for a tool, if tools change at stops.
    by_stops: Option<usize>,
    pub(super) ended: bool,
}

/// Reads a drill program. Fails with the reason why nothing is usable.
pub(in crate::artwork) fn read(task: &Task<'_>) -> Result<(DrillFile, Vec<Diagnostic>), Diagnostic> {
    let mut reader = Reader::new(task);
    while reader.index < task.text.len() {
        if reader.plain_hits() {
            continue;
        }
        let (end, next) = line_end(task.text, reader.index);
        let line = task.text.get(reader.index..end).unwrap_or_default();
        reader.index = next;
        reader.line(line)?;
        reader.check_limits()?;
        reader.line += 1;
    }
    reader.finish()
}

impl<'a> Reader<'a> {
    fn new(task: &'a Task<'a>) -> Self {
        let first_units = task
            .survey
            .first_units
            .map_or(task.reading.units, |units| super::sense::in_trial(task.reading, task.survey, units));
        let reading = super::sense::after_switch(task.reading, first_units, None);
        let mut out = DrillFile::default();
        let mut codes = BTreeMap::new();
        for &CommentTool { code, diameter, plated, line } in &task.survey.comment_tools {
            codes.entry(code).or_insert_with(|| {
                out.tools.push(ToolEntry { code, diameter, plated, line });
                out.tools.len() as u16 - 1
            });
        }
        // Without any tool word, the tools are those of the comments in order, and M00 changes to the next
        // one.
        let by_stops = (!task.survey.has_tool_words && !out.tools.is_empty()).then_some(0);
        let guess = task.text.len() / 12;
        out.hits.reserve(guess.min(MOST_HITS));
        Self {
            task,
            index: 0,
            line: 1,
            reading,
            stated: None,
            scale: Scale::new(reading),
            findings: Findings::new(task.name),
            out,
            codes,
            tool: by_stops.map(|_| 0),
            by_stops,
            at: Point::default(),
            zero: Point::default(),
            incremental: false,
            header: false,
            mode: Mode::Drill,
            motion: Motion::Rapid,
            route: None,
            pattern: None,
            repeated: 0,
            moves: 0,
            section_plated: None,
            next_plated: None,
            stopped: false,
            ended: false,
        }
    }

    /// The fast path for lines of `X…Y…`, `X…` or `Y…` while drilling. Stops before any other line; true if
    /// it read any.
    fn plain_hits(&mut self) -> bool {
        if self.mode == Mode::Rout || self.header || self.ended {
            return false;
        }
        let Some(tool) = self.tool else { return false };
        let bytes = self.task.text;
        let (start, scale) = (self.index, self.scale);
        let room = MOST_HITS.saturating_sub(self.out.hits.len());
        for _ in 0..room {
            let Some((to, length)) = plain_pair(bytes.get(self.index..).unwrap_or_default(), &scale) else {
                break;
            };
            let from = if self.incremental { self.at } else { self.zero };
            let base = if self.incremental { Point::default() } else { self.at };
            let there = match to {
                [Some(x), Some(y)] => Point::new(from.x + x, from.y + y),
                [Some(x), None] => Point::new(from.x + x, if self.incremental { from.y } else { base.y }),
                [None, Some(y)] => Point::new(if self.incremental { from.x } else { base.x }, from.y + y),
                [None, None] => break,
            };
            // Leave a coordinate beyond the limit to the normal path, which reports it.
            if there.x.abs() > Length::LIMIT || there.y.abs() > Length::LIMIT {
                break;
            }
            self.at = there;
            self.out.hits.push(Hit { at: self.at, line: self.line, tool });
            self.index += length;
            self.line += 1;
        }
        self.index > start
    }

    fn check_limits(&mut self) -> Result<(), Diagnostic> {
        let counts = [
            (code!("drill.too_many_hits"), self.out.hits.len(), MOST_HITS),
            (code!("drill.too_many_repeats"), self.repeated, MOST_REPEATED),
            (code!("drill.too_many_moves"), self.moves + self.out.slots.len(), MOST_MOVES),
            (code!("drill.too_many_tools"), self.out.tools.len(), MOST_TOOLS),
        ];
        match counts.into_iter().find(|(_, count, most)| count >= most) {
            Some((code, _, most)) => Err(self.refusal(code).with("most", most)),
            None => Ok(()),
        }
    }

    pub(super) fn refusal(&self, code: &str) -> Diagnostic {
        Diagnostic::error(code).at(self.task.name, self.line, 1)
    }

    pub(super) fn report(&mut self, severity: Severity, code: &str, column: u32, found: &[u8]) {
        self.findings.at(severity, code, self.line, column, found);
    }

    fn line(&mut self, line: &[u8]) -> Result<(), Diagnostic> {
        let parsed = parse(line);
        for hint in parsed.comment.map(hints::comment).unwrap_or_default() {
            match hint {
                Hint::SectionPlated(plated) => self.section_plated = Some(plated),
                Hint::NextPlated(plated) => self.next_plated = Some(plated),
                _ => {}
            }
        }
        if self.ended && !matches!(parsed.content, Content::Blank | Content::Percent) {
            self.findings.once(Severity::Error, code!("drill.after_end"), self.line, 1, b"");
            return Ok(());
        }
        match parsed.content {
            Content::Blank => {}
            Content::Percent => self.header = false,
            Content::Optional => {
                self.report(Severity::Error, code!("drill.optional_line"), 1, line.trim_ascii());
            }
            Content::Statement { keyword, args } => self.statement(keyword, args),
            Content::Garbled(words, column) => {
                self.fault(&words, Fault { code: code!("drill.bad_number"), column }, line);
            }
            Content::Words(words) => match sort(&words) {
                Ok(block) => self.block(&block, line)?,
                Err(fault) => self.fault(&words, fault, line),
            },
        }
        Ok(())
    }

    /// A faulty line. If it selects a tool, no tool is active afterwards: the previous one would drill wrong
    /// holes.
    fn fault(&mut self, words: &[Word], fault: Fault, line: &[u8]) {
        let found = line.get(fault.column.saturating_sub(1) as usize..).unwrap_or_default();
        self.report(Severity::Error, fault.code, fault.column, found);
        if words.first().is_some_and(|word| word.letter == b'T') && !self.header {
            self.tool = None;
        }
    }

    fn block(&mut self, block: &Block, line: &[u8]) -> Result<(), Diagnostic> {
        if let Some(tool) = block.tool {
            self.tool_word(tool, block.to.any());
        }
        self.feeds(block);
        let takes_coordinates = self.codes_before(block, line);
        if let Some(count) = block.repeat {
            self.repeat(count, block.to)?;
        } else if let Some(end) = block.slot_to {
            self.slot(block.to, end);
        } else if block.to.any() && !takes_coordinates {
            self.coordinates(block, line);
        }
        self.codes_after(block, line)
    }

    fn coordinates(&mut self, block: &Block, line: &[u8]) {
        if self.header {
            self.header = false;
            self.report(Severity::Warning, code!("drill.header_open"), 1, line);
        }
        let from = self.at;
        if !self.go(block.to) {
            return;
        }
        match self.mode {
            Mode::Drill => {
                let tool = self.tool_in_use();
                self.out.hits.push(Hit { at: self.at, line: self.line, tool });
            }
            Mode::Rout => self.rout(from, block, line),
        }
    }

    /// Moves to a pair of coordinates; reports and returns false if it is beyond the limit.
    pub(super) fn go(&mut self, to: Pair) -> bool {
        let length = |number: Option<Decimal>| match number {
            None => Some(None),
            Some(number) => self.scale.length(number).map(Some),
        };
        if let (Some(x), Some(y)) = (length(to.x), length(to.y)) {
            let step = |at: Length, zero: Length, value: Option<Length>| match value {
                None => at,
                Some(value) => value + if self.incremental { at } else { zero },
            };
            let there = Point::new(step(self.at.x, self.zero.x, x), step(self.at.y, self.zero.y, y));
            if there.x.abs() <= Length::LIMIT && there.y.abs() <= Length::LIMIT {
                self.at = there;
                return true;
            }
        }
        self.report(Severity::Error, code!("drill.out_of_range"), 1, b"");
        false
    }

    /// M00: the machine stops. If no word selects tools, the next one of the comments becomes active.
    pub(super) fn stop(&mut self) {
        self.stopped = true;
        self.tool_up();
        let done = self.out.hits.len() + self.out.slots.len() + self.out.routes.len();
        if self.by_stops.is_some_and(|before| before < done) {
            self.by_stops = Some(done);
            let next = self.tool.map(|tool| tool + 1);
            self.tool = next.filter(|&next| usize::from(next) < self.task.survey.comment_tools.len());
        }
    }

    /// The current tool; creates an unnamed one if none was selected.
    pub(super) fn tool_in_use(&mut self) -> u16 {
        if let Some(tool) = self.tool {
            return tool;
        }
        self.findings.once(Severity::Error, code!("drill.no_tool"), self.line, 1, b"");
        let index = self.tool_index(0);
        self.tool = Some(index);
        index
    }

    fn finish(mut self) -> Result<(DrillFile, Vec<Diagnostic>), Diagnostic> {
        self.tool_up();
        if self.header && (self.out.hits.is_empty() || !self.ended) {
            self.findings.at(Severity::Error, code!("drill.header_never_ends"), self.line, 1, b"");
        } else if !self.ended && !self.stopped {
            self.missing_end();
        }
        if self.by_stops.is_some() && !self.out.hits.is_empty() {
            let tools = self.task.survey.comment_tools.len();
            let warning = warning!("drill.tools_by_stops", tools = tools);
            self.findings.push(warning.at(self.task.name, 0, 0));
        }
        let counts = self.out.counts();
        for (tool, count) in self.out.tools.iter().zip(counts) {
            let holes = count.hits + count.slots + count.routed_paths;
            let diagnostic = match tool.diameter {
                Some(_) => continue,
                None if holes > 0 => error!("drill.tool_without_diameter", ..),
                None => note!("drill.unused_tool_without_diameter", ..),
            };
            let diagnostic = diagnostic.with("tool", format!("T{}", tool.code)).with("holes", holes);
            self.findings.push(diagnostic.at(self.task.name, tool.line, 1));
        }
        self.out.hits.shrink_to_fit();
        Ok((self.out, self.findings.finish()))
    }

    /// The program has no end. If the last line is cut off and its number shorter than all others, a digit is
    /// missing.
    fn missing_end(&mut self) {
        let text = self.task.text;
        let last = text.iter().rposition(|byte| matches!(byte, b'\n' | b'\r')).map_or(0, |at| at + 1);
        let tail = text.get(last..).unwrap_or_default();
        let number =
            tail.iter().rposition(|byte| byte.is_ascii_alphabetic()).and_then(|at| tail.get(at + 1..));
        let shape = &self.task.survey.shape;
        let short = match number.map(decimal) {
            Some(Some((number, _))) if shape.decimal() => {
                number.decimals < shape.fewest_decimals.max(shape.most_decimals)
            }
            Some(Some((number, _))) => self.reading.zeros != Zeros::Leading && number.digits < shape.longest,
            Some(None) => !tail.trim_ascii().is_empty(),
            None => false,
        };
        let (severity, code) = if short {
            (Severity::Error, code!("drill.cut_short"))
        } else {
            (Severity::Warning, code!("drill.no_end"))
        };
        self.report(severity, code, 1, tail);
    }
}

/// `X…`, `Y…` or both, including the line end. None for anything else.
#[inline]
fn plain_pair(bytes: &[u8], scale: &Scale) -> Option<([Option<Length>; 2], usize)> {
    let (mut index, mut pair) = (0, [None; 2]);
    for (letter, axis) in [b'X', b'Y'].into_iter().zip(&mut pair) {
        if bytes.get(index) == Some(&letter) {
            let (number, used) = decimal(bytes.get(index + 1..)?)?;
            *axis = Some(scale.length(number)?);
            index += 1 + used;
        }
    }
    match (bytes.get(index), bytes.get(index + 1)) {
        _ if index == 0 => None,
        (None, _) => Some((pair, index)),
        (Some(b'\r'), Some(b'\n')) => Some((pair, index + 2)),
        (Some(b'\n' | b'\r'), _) => Some((pair, index + 1)),
        _ => None,
    }
}
