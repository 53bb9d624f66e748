//! Everything in a drill program that isn't a position: statements, tools, G and M codes, feeds.

use super::block::{Block, ToolWord};
use super::hints::{self, Hint};
use super::reader::{Mode, Motion, Reader};
use super::survey::units_named;
use crate::artwork::Units;
use crate::artwork::drill::ToolEntry;
use crate::artwork::number::{Decimal, Scale};
use crate::code;
use crate::diagnostic::{Diagnostic, Severity};
use crate::units::Length;

/// A larger number is not a diameter.
const LARGEST_DIAMETER: Length = Length::from_um(50_000);

/// Setup words that concern only the machine.
const MACHINE_WORDS: [&str; 16] = [
    "FMAT", "VER", "DETECT", "ATC", "TCST", "OSTOP", "OTCLMP", "OM", "R", "SBK", "SG", "SIXM", "AFS", "CCW",
    "CP", "BLKD",
];

impl Reader<'_> {
    pub(super) fn statement(&mut self, keyword: &[u8], args: &[u8]) {
        let upper = keyword.to_ascii_uppercase();
        if let Some(units) = units_named(keyword) {
            self.switch_units(units, &hints::arguments(args));
            return;
        }
        match upper.as_slice() {
            b"ICI" => self.incremental = args.eq_ignore_ascii_case(b"ON"),
            b"FMAT" if args.starts_with(b"1") => {
                self.report(Severity::Note, code!("drill.format_1"), 1, args);
            }
            b"FMAT" if args.starts_with(b"2") => {}
            b"M97" | b"M98" => self.report(Severity::Error, code!("drill.text_not_drilled"), 1, args),
            [b'M', b'4', _] => self.report(Severity::Note, code!("drill.operator_message"), 1, args),
            _ if MACHINE_WORDS.iter().any(|word| upper == word.as_bytes()) => {
                self.findings.once(Severity::Note, code!("drill.machine_word"), self.line, 1, keyword);
            }
            _ => {
                let severity = if self.header { Severity::Warning } else { Severity::Error };
                self.report(severity, code!("drill.unknown_statement"), 1, keyword);
            }
        }
    }

    /// A trial can read a program in other units than stated; then every units statement means the other
    /// ones.
    fn switch_units(&mut self, units: Units, hints: &[Hint]) {
        let head = self.out.hits.is_empty() && self.out.slots.is_empty() && self.out.routes.is_empty();
        let before = self.stated.replace(units);
        if head && self.route.is_none() && before.is_some_and(|before| before != units) {
            let found = units.name();
            self.findings.once(
                Severity::Warning,
                code!("drill.units_contradict"),
                self.line,
                1,
                found.as_bytes(),
            );
        }
        let units = super::sense::in_trial(self.task.reading, self.task.survey, units);
        let digits = hints.iter().find_map(|hint| match hint {
            Hint::Digits(digits) => Some(*digits),
            _ => None,
        });
        if units != self.reading.units {
            if !self.out.hits.is_empty() {
                self.report(Severity::Note, code!("drill.units_change"), 1, units.name().as_bytes());
            }
            self.reading = super::sense::after_switch(self.task.reading, units, digits);
            self.scale = Scale::new(self.reading);
        }
    }

    /// Index of a tool in the table. Adds the tool if it is missing, with data from other files.
    pub(super) fn tool_index(&mut self, code: u32) -> u16 {
        self.codes.get(&code).copied().unwrap_or_else(|| {
            let (diameter, plated) = self.task.table.get(&code).copied().unwrap_or_default();
            self.new_tool(ToolEntry { code, diameter, plated, line: self.line })
        })
    }

    pub(super) fn new_tool(&mut self, tool: ToolEntry) -> u16 {
        let index = u16::try_from(self.out.tools.len()).unwrap_or(u16::MAX);
        self.codes.insert(tool.code, index);
        self.out.tools.push(tool);
        index
    }

    /// `T01` selects a tool, `T01C0.8` defines one and, outside the header, also selects it. `T0101` is tool
    /// 1 with its compensation number, if there is a tool 1 and no tool 101.
    pub(super) fn tool_word(&mut self, word: ToolWord, with_coordinates: bool) {
        let short = word.code / 100;
        let doubled =
            word.digits == 4 && word.size.is_none() && self.is_tool(short) && !self.is_tool(word.code);
        let word = if doubled { ToolWord { code: short, ..word } } else { word };
        let known = self.codes.contains_key(&word.code);
        if word.code == 0 && word.size.is_none() && !known {
            self.tool_up();
            return; // T0 unloads the tool
        }
        if let Some(size) = word.size {
            self.define(word, size);
            if self.header {
                return;
            }
        } else if self.header {
            if !known {
                let index = self.tool_index(word.code);
                self.set_plating(index);
                return;
            }
            self.header = false;
            self.report(Severity::Warning, code!("drill.header_open"), word.column, b"");
        }
        self.tool_up();
        let index = self.tool_index(word.code);
        self.tool = Some(index);
        if with_coordinates && self.mode == Mode::Rout {
            self.motion = Motion::Rapid;
        }
    }

    fn is_tool(&self, code: u32) -> bool {
        self.codes.contains_key(&code) || self.task.table.contains_key(&code)
    }

    fn set_plating(&mut self, index: u16) {
        let code = self.out.tools.get(usize::from(index)).map_or(0, |tool| tool.code);
        let plated =
            self.next_plated.take().or(self.section_plated).or_else(|| self.task.survey.plated_from(code));
        if let (Some(tool), Some(plated)) = (self.out.tools.get_mut(usize::from(index)), plated) {
            tool.plated = Some(plated);
        }
    }

    fn define(&mut self, word: ToolWord, size: Option<Decimal>) {
        let diameter = size
            .and_then(|size| size.length(self.reading.units))
            .filter(|&length| Length::ZERO < length && length <= LARGEST_DIAMETER);
        if diameter.is_none() {
            self.report(
                Severity::Error,
                code!("drill.tool_diameter"),
                word.column,
                format!("T{}", word.code).as_bytes(),
            );
        }
        let before = self.codes.get(&word.code).and_then(|&index| self.out.tools.get(usize::from(index)));
        let differs = before.and_then(|tool| tool.diameter).is_some_and(|old| Some(old) != diameter);
        if differs {
            self.report(
                Severity::Warning,
                code!("drill.tool_defined_twice"),
                word.column,
                format!("T{}", word.code).as_bytes(),
            );
        }
        // After the header, holes drilled before keep the old size.
        let index = if differs && !self.header {
            self.new_tool(ToolEntry { code: word.code, diameter, plated: None, line: self.line })
        } else {
            self.tool_index(word.code)
        };
        if let Some(tool) = self.out.tools.get_mut(usize::from(index)) {
            tool.diameter = diameter;
            tool.line = self.line;
        }
        self.set_plating(index);
    }

    /// Feeds, speeds and hit counts: one note each.
    pub(super) fn feeds(&mut self, block: &Block) {
        for (letter, number, column) in &block.feeds {
            if number.mantissa != 0 {
                self.findings.once(Severity::Note, code!("drill.feed_word"), self.line, *column, &[*letter]);
            }
        }
    }

    /// Codes that act before the coordinates of their line. True if they consume the coordinates.
    pub(super) fn codes_before(&mut self, block: &Block, line: &[u8]) -> bool {
        let mut takes = false;
        for &(code, column) in &block.gs {
            match code {
                0..=3 => {
                    self.mode = Mode::Rout;
                    self.motion =
                        [Motion::Rapid, Motion::Straight, Motion::Clockwise, Motion::Counterclockwise]
                            [usize::from(code)];
                }
                5 | 81 => {
                    self.tool_up();
                    self.mode = Mode::Drill;
                }
                90 => self.incremental = false,
                91 => self.incremental = true,
                92 | 93 => {
                    takes = true;
                    self.zero_set(block, line);
                }
                20 | 70 => self.switch_units(Units::Inch, &[]),
                21 | 71 => self.switch_units(Units::Mm, &[]),
                17..=19 | 40 | 43 | 44 | 49 | 50 | 53..=59 | 61 | 64 | 80 | 94..=99 => {}
                4 => {
                    takes = true;
                    self.findings.once(
                        Severity::Note,
                        code!("drill.machine_word"),
                        self.line,
                        column,
                        b"G04",
                    );
                }
                41 | 42 => self.report(Severity::Error, code!("drill.cutter_compensation"), column, line),
                _ => {
                    takes = true;
                    self.report(Severity::Error, code!("drill.unsupported_cycle"), column, line);
                }
            }
        }
        for &(code, _) in &block.ms {
            match code {
                71 => self.switch_units(Units::Mm, &[]),
                72 => self.switch_units(Units::Inch, &[]),
                15 => self.tool_down(),
                2 => takes |= block.to.any(),
                70 | 80 | 90 => takes = true,
                _ => {}
            }
        }
        takes
    }

    /// G93: sets the origin of the coordinates.
    fn zero_set(&mut self, block: &Block, line: &[u8]) {
        let was = (self.at, self.incremental);
        self.incremental = false;
        self.zero = crate::geometry::Point::default();
        if self.go(block.to) {
            self.zero = self.at;
        }
        (self.at, self.incremental) = was;
        if self.zero != crate::geometry::Point::default() {
            self.report(Severity::Note, code!("drill.zero_set"), 1, line);
        }
    }

    /// Codes that act after the coordinates of their line.
    pub(super) fn codes_after(&mut self, block: &Block, line: &[u8]) -> Result<(), Diagnostic> {
        for &(code, column) in &block.ms {
            match code {
                0 => self.stop(),
                1 => self.pattern_ends(),
                2 if block.to.any() => self.pattern_again(block.to)?,
                2 if self.pattern.is_none() => self.stopped = true,
                2 => {}
                8 => self.pattern = None,
                15 | 71 | 72 => {}
                16 | 17 => self.tool_up(),
                25 => self.pattern_starts(),
                30 => self.ended = true,
                48 => self.header = true,
                95 => self.header = false,
                70 | 80 | 90 => self.report(Severity::Error, code!("drill.mirrored_pattern"), column, line),
                97 | 98 => self.report(Severity::Error, code!("drill.text_not_drilled"), column, line),
                6 | 9 | 12..=14 | 18 | 21 | 22 | 31 | 40..=47 | 50 | 60 => {
                    self.findings.once(
                        Severity::Note,
                        code!("drill.machine_word"),
                        self.line,
                        column,
                        format!("M{code:02}").as_bytes(),
                    );
                }
                _ => self.report(Severity::Error, code!("drill.unknown_code"), column, line),
            }
        }
        Ok(())
    }
}
