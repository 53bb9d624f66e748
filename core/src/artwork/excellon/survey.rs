//! A first pass over a drill program: its statements, and the look of its numbers.

use super::hints::{self, Hint};
use super::words::{Content, Word, parse};
use crate::artwork::number::Decimal;
use crate::artwork::text::{front, lines};
use crate::artwork::{Digits, Source, Units, Zeros};
use crate::units::Length;

/// Only this many bytes are surveyed; statements are at the start of a file.
const LOOKED_AT: usize = 256 * 1024;
const MOST_TOOLS: usize = 1000;

#[derive(Clone, Copy, Debug)]
pub(in crate::artwork) struct CommentTool {
    pub(in crate::artwork) code: u32,
    pub(in crate::artwork) diameter: Option<Length>,
    pub(in crate::artwork) plated: Option<bool>,
    pub(in crate::artwork) line: u32,
}

#[derive(Clone, Copy, Debug, Default)]
pub(in crate::artwork) struct Shape {
    pub(in crate::artwork) numbers: u32,
    pub(in crate::artwork) with_point: u32,
    /// Minimum and maximum number of digits without a point.
    pub(in crate::artwork) shortest: u8,
    pub(in crate::artwork) longest: u8,
    /// Numbers that start, or end, with a zero that could be omitted.
    pub(in crate::artwork) leading_zeros: u32,
    pub(in crate::artwork) trailing_zeros: u32,
    pub(in crate::artwork) fewest_decimals: u8,
    pub(in crate::artwork) most_decimals: u8,
    pub(in crate::artwork) bare_zeros: u32,
}

impl Shape {
    pub(in crate::artwork) fn decimal(&self) -> bool {
        self.with_point > 0 && self.with_point * 2 >= self.numbers.saturating_sub(self.bare_zeros)
    }

    /// True if some numbers have no point.
    pub(in crate::artwork) fn points_missing(&self) -> bool {
        self.with_point + self.bare_zeros < self.numbers
    }

    pub(in crate::artwork) fn is_full(&self, digits: Digits) -> bool {
        self.shortest == self.longest && self.longest == digits.integer + digits.decimal
    }

    fn look(&mut self, number: Decimal, text: &[u8]) {
        self.numbers += 1;
        if number.point {
            let first = self.with_point == 0;
            self.with_point += 1;
            self.fewest_decimals =
                if first { number.decimals } else { self.fewest_decimals.min(number.decimals) };
            self.most_decimals = self.most_decimals.max(number.decimals);
        } else if number.mantissa == 0 && number.digits == 1 {
            self.bare_zeros += 1;
        } else {
            let first = self.longest == 0;
            self.shortest = if first { number.digits } else { self.shortest.min(number.digits) };
            self.longest = self.longest.max(number.digits);
            if number.mantissa != 0 {
                let digits = text.trim_ascii_start().strip_prefix(b"-").unwrap_or(text);
                let digits = digits.strip_prefix(b"+").unwrap_or(digits);
                self.leading_zeros += u32::from(digits.first() == Some(&b'0'));
                self.trailing_zeros += u32::from(number.mantissa % 10 == 0);
            }
        }
    }
}

#[derive(Clone, Debug, Default)]
pub(in crate::artwork) struct Survey {
    /// The first named units; they apply to tools defined before any statement.
    pub(in crate::artwork) first_units: Option<Units>,
    pub(in crate::artwork) units: Option<(Units, Source)>,
    pub(in crate::artwork) digits: Option<(Digits, Source)>,
    pub(in crate::artwork) zeros: Option<(Zeros, Source)>,
    pub(in crate::artwork) comment_tools: Vec<CommentTool>,
    pub(in crate::artwork) file_plated: Option<bool>,
    pub(in crate::artwork) generator: Option<String>,
    pub(in crate::artwork) shape: Shape,
    pub(in crate::artwork) sizes: Vec<Decimal>,
    pub(in crate::artwork) routes: bool,
    /// True if a word selects or defines a tool.
    pub(in crate::artwork) has_tool_words: bool,
    pub(in crate::artwork) plated_from: Vec<(u32, bool)>,
}

pub(in crate::artwork) fn survey(text: &[u8]) -> Survey {
    let mut found = Survey::default();
    for line in lines(front(text, LOOKED_AT)) {
        let parsed = parse(line.text);
        for hint in parsed.comment.map(hints::comment).unwrap_or_default() {
            found.hint(hint, Source::Comment, line.number);
        }
        match parsed.content {
            Content::Statement { keyword, args } => found.statement(keyword, args, line.number),
            Content::Words(words) => found.words(&words, line.text),
            _ => {}
        }
    }
    found
}

impl Survey {
    fn hint(&mut self, hint: Hint, source: Source, line: u32) {
        let weaker = |have: Option<Source>| have.is_none_or(|have| source <= have);
        match hint {
            Hint::Units(units) => self.set_units(units, source),
            Hint::Digits(digits) if weaker(self.digits.map(|(_, source)| source)) => {
                self.digits = Some((digits, source));
            }
            Hint::Zeros(zeros) if weaker(self.zeros.map(|(_, source)| source)) => {
                self.zeros = Some((zeros, source));
            }
            Hint::Tool { code, diameter, plated, units } => {
                if self.comment_tools.len() < MOST_TOOLS {
                    self.comment_tools.push(CommentTool { code, diameter, plated, line });
                }
                self.set_units(units, source);
            }
            Hint::FilePlated(plated) => self.file_plated = Some(plated),
            Hint::Generator(name) => {
                self.generator.get_or_insert(name);
            }
            Hint::PlatedFrom(code, plated) => {
                if self.plated_from.len() < MOST_TOOLS {
                    self.plated_from.push((code, plated));
                }
            }
            Hint::Digits(_) | Hint::Zeros(_) | Hint::SectionPlated(_) | Hint::NextPlated(_) => {}
        }
    }

    /// Plating of tool `code` from comments about tool ranges.
    pub(super) fn plated_from(&self, code: u32) -> Option<bool> {
        let before = self.plated_from.iter().filter(|(from, _)| *from <= code);
        before.max_by_key(|(from, _)| *from).map(|(_, plated)| *plated)
    }

    /// Units count only until the first coordinate; statements override comments.
    fn set_units(&mut self, units: Units, source: Source) {
        let outweighed = self.units.is_some_and(|(_, have)| have < source);
        if self.shape.numbers == 0 && !outweighed {
            self.units = Some((units, source));
            if source == Source::Header {
                self.first_units.get_or_insert(units);
            }
        }
    }

    fn statement(&mut self, keyword: &[u8], args: &[u8], line: u32) {
        if let Some(units) = units_named(keyword) {
            self.set_units(units, Source::Header);
            for hint in hints::arguments(args) {
                self.hint(hint, Source::Header, line);
            }
        }
    }

    fn words(&mut self, words: &[Word], text: &[u8]) {
        for word in words {
            let Some(number) = word.number else { continue };
            match (word.letter, number.mantissa) {
                (b'M', 71) => self.set_units(Units::Mm, Source::Header),
                (b'M', 72) => self.set_units(Units::Inch, Source::Header),
                (b'G', 21 | 71) => self.set_units(Units::Mm, Source::Header),
                (b'G', 20 | 70) => self.set_units(Units::Inch, Source::Header),
                (b'M', 15) => self.routes = true,
                (b'T', 1..) => self.has_tool_words = true,
                (b'C', _) if self.sizes.len() < MOST_TOOLS => self.sizes.push(number),
                (b'X' | b'Y', _) if words.first().is_some_and(|first| first.letter != b'R') => {
                    self.shape.look(number, text.get(word.column as usize..).unwrap_or_default());
                }
                _ => {}
            }
        }
    }
}

pub(super) fn units_named(keyword: &[u8]) -> Option<Units> {
    let is = |names: [&str; 2]| names.iter().any(|name| keyword.eq_ignore_ascii_case(name.as_bytes()));
    if is(["METRIC", "M71"]) { Some(Units::Mm) } else { is(["INCH", "M72"]).then_some(Units::Inch) }
}
