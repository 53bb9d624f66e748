//! A file being written: fills template lines, adds line numbers, omits repeated words.
//!
//! ```text
//!   template line ─ fill ─▶ text with positions of numbers ─ omit ─▶ ─ number, slash, ending ─▶ file
//!                                                               "@>" ─▶ end part
//! ```

use super::dialect::Dialect;
use super::lined::Lined;
use super::names::{Block, CURVES, HEAD, TemplateKind};
use super::template::{Goes, Line, Piece, Template};
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::job::CommandPlace;
use std::collections::BTreeMap;
use std::ops::Range;

/// Largest output, in bytes: a template must not fill the memory.
const LARGEST: usize = 256 * 1024 * 1024;
/// Coordinates of an end point: never omitted in an arc.
const PLACES: &[&str] = &["X", "Y"];

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Value {
    Number(i64),
    Word(String),
    Lines(Vec<String>),
}

#[derive(Debug)]
pub(super) struct OpenFile<'a> {
    dialect: &'a Dialect,
    part: TemplateKind,
    out: Lined,
    end: Lined,
    /// Position of the end part: bytes and lines.
    end_at: Option<(usize, usize)>,
    number: u64,
    points: u64,
    said: BTreeMap<String, String>,
    /// The active word of each group.
    holds: Vec<String>,
}

/// A filled line, with the bytes of each parameter.
struct Filled<'t> {
    text: String,
    fields: Vec<(Range<usize>, &'t str)>,
}

impl<'a> OpenFile<'a> {
    pub(super) fn new(dialect: &'a Dialect, part: TemplateKind) -> Self {
        Self {
            dialect,
            part,
            out: Lined::default(),
            end: Lined::default(),
            end_at: None,
            number: dialect.lines.first,
            points: 0,
            said: BTreeMap::new(),
            holds: vec![String::new(); dialect.modal.groups.len()],
        }
    }

    /// Uses the blocks of `part` from now on.
    pub(super) fn turn_to(&mut self, part: TemplateKind) {
        self.part = part;
    }

    /// The text without the end part.
    pub(super) fn written(&self) -> &str {
        self.out.text()
    }

    fn len(&self) -> usize {
        self.out.text().len() + self.end.text().len()
    }

    /// Writes a block; `done` is the last command that it completes.
    pub(super) fn write(
        &mut self,
        done: CommandPlace,
        block: Block,
        template: &Template,
        value: impl Fn(&str) -> Value,
    ) -> Result<(), Diagnostic> {
        (self.out.now, self.end.now) = (done, done);
        // The user or a cycle may change the modal state in these blocks, so forget it.
        let moves = CURVES.contains(&block) || matches!(block, Block::Approach | Block::Line | Block::Leave);
        if !moves {
            self.forget();
        }
        let mut points = 0;
        for line in &template.lines {
            let skipped = line.only_if.as_deref().is_some_and(|name| value(name) == Value::Number(0));
            points += u64::from(line.to == Goes::End && uses(line, "K"));
            match lines_of(line, &value) {
                _ if skipped => {}
                Some(sentences) => {
                    for said in sentences {
                        self.template_line(block, line, &|name| match name {
                            HEAD => Value::Word(said.clone()),
                            _ => value(name),
                        });
                    }
                }
                None => self.template_line(block, line, &value),
            }
        }
        self.points += points;
        if !moves {
            self.forget();
        }
        if self.len() > LARGEST {
            return Err(error!("post.too_large"));
        }
        Ok(())
    }

    fn template_line(&mut self, block: Block, line: &Line, value: &impl Fn(&str) -> Value) {
        match line.to {
            Goes::PutsEnd => self.end_at = Some(self.out.place()),
            Goes::End => {
                let filled = self.fill(line, value);
                self.end.push(&filled.text);
                self.end.push(if self.dialect.lines.crlf { "\r\n" } else { "\n" });
            }
            Goes::Here => {
                let filled = self.fill(line, value);
                self.line(block, filled);
            }
        }
    }

    pub(super) fn finish(mut self) -> (String, Vec<CommandPlace>) {
        let at = self.end_at.unwrap_or(self.out.place());
        self.out.insert(at, &self.end);
        self.out.finish()
    }

    fn forget(&mut self) {
        self.said.clear();
        self.holds.iter_mut().for_each(String::clear);
    }

    fn fill<'t>(&mut self, line: &'t Line, value: &impl Fn(&str) -> Value) -> Filled<'t> {
        let mut out = Filled { text: String::new(), fields: Vec::new() };
        for piece in &line.pieces {
            match piece {
                Piece::Text(text) => out.text.push_str(text),
                Piece::Field(field) => {
                    let name = field.name.as_str();
                    let found = match name {
                        "N" => Value::Number(self.next_number()),
                        "K" => Value::Number(millionths(self.points)),
                        _ => value(name),
                    };
                    let start = out.text.len();
                    match found {
                        Value::Number(number) => {
                            let mut format = self.dialect.numbers.of(name);
                            format.decimals = field.decimals.unwrap_or(format.decimals);
                            out.text.push_str(&format.text(field.reckon(number)));
                        }
                        Value::Word(word) if self.dialect.comments.capitals => {
                            out.text.push_str(&word.to_ascii_uppercase());
                        }
                        Value::Word(word) => out.text.push_str(&word),
                        Value::Lines(lines) => out.text.push_str(&lines.join(" ")),
                    }
                    out.fields.push((start..out.text.len(), name));
                }
            }
        }
        out
    }

    fn next_number(&mut self) -> i64 {
        let number = self.number;
        self.number = number.saturating_add(self.dialect.lines.step);
        millionths(number)
    }

    fn line(&mut self, block: Block, filled: Filled<'_>) {
        let was_empty = filled.text.trim().is_empty();
        let text = self.without_known(block, &self.without_comments(filled));
        if text.trim().is_empty() && !was_empty {
            return;
        }
        let lines = &self.dialect.lines;
        if lines.skippable.contains(&(self.part, block)) && !was_empty {
            self.out.push("/");
        }
        let bare = lines.unnumbered.iter().any(|start| text.starts_with(start.as_str()));
        if lines.numbered && !was_empty && !bare {
            let number = self.next_number() / 1_000_000;
            let lines = &self.dialect.lines;
            self.out.push(&format!("{}{number}{}", lines.before, lines.after));
        }
        self.out.push(&text);
        self.out.push(if self.dialect.lines.crlf { "\r\n" } else { "\n" });
    }

    fn comments(&self, text: &str) -> Vec<Range<usize>> {
        let style = &self.dialect.comments;
        let mut found = Vec::new();
        let mut at = 0;
        while !style.open.is_empty() {
            let Some(start) = text.get(at..).and_then(|rest| rest.find(&style.open)) else { break };
            let start = at + start;
            let behind = start + style.open.len();
            let close = text
                .get(behind..)
                .filter(|_| !style.close.is_empty())
                .and_then(|rest| rest.find(&style.close));
            at = close.map_or(text.len(), |close| behind + close + style.close.len());
            found.push(start..at);
        }
        found
    }

    fn without_comments<'t>(&self, filled: Filled<'t>) -> Filled<'t> {
        let comments = self.comments(&filled.text);
        if !self.dialect.comments.dropped || comments.is_empty() {
            return filled;
        }
        // Fields after a comment would move, so keep only those before it.
        let kept = (0..).zip(filled.text.char_indices());
        let text: String = kept
            .filter(|(_, (at, _))| !comments.iter().any(|comment| comment.contains(at)))
            .map(|(_, (_, letter))| letter)
            .collect();
        let last = comments.first().map_or(0, |comment| comment.start);
        let fields = filled.fields.into_iter().filter(|(range, _)| range.end <= last).collect();
        Filled { text: text.trim_end().to_owned(), fields }
    }

    /// The line without words that repeat.
    fn without_known(&mut self, block: Block, filled: &Filled<'_>) -> String {
        let modal = &self.dialect.modal;
        if modal.parameters.is_empty() && modal.groups.is_empty() {
            return filled.text.clone();
        }
        let comments = self.comments(&filled.text);
        let mut kept: Vec<&str> = Vec::new();
        let mut dropped = false;
        for range in words(&filled.text) {
            let text = filled.text.get(range.clone()).unwrap_or_default();
            let commented =
                comments.iter().any(|comment| comment.start < range.end && range.start < comment.end);
            if !commented && self.says_again(block, text, &range, &filled.fields) {
                dropped = true;
            } else {
                kept.push(text);
            }
        }
        if dropped { kept.join(" ") } else { filled.text.clone() }
    }

    /// True if a word repeats the current state; if not, updates the state.
    fn says_again(
        &mut self,
        block: Block,
        text: &str,
        range: &Range<usize>,
        fields: &[(Range<usize>, &str)],
    ) -> bool {
        let modal = &self.dialect.modal;
        for (group, holds) in modal.groups.iter().zip(&mut self.holds) {
            if group.iter().any(|word| word == text) {
                let again = holds == text;
                text.clone_into(holds);
                return again;
            }
        }
        let mut inside =
            fields.iter().filter(|(field, _)| range.start <= field.start && field.end <= range.end);
        let name = inside.next().map(|(_, name)| *name);
        let one = inside.next().is_none();
        let letters = text.chars().take_while(char::is_ascii_alphabetic).count();
        let (letters, number) = text.split_at(letters);
        let plain = one && !letters.is_empty() && number.parse::<f64>().is_ok();
        if !plain {
            // Several numbers in one word: its previous values are no longer known.
            text.chars().filter(char::is_ascii_alphabetic).for_each(|letter| {
                self.said.remove(letter.to_string().as_str());
            });
            return false;
        }
        let again = self.said.get(letters).is_some_and(|last| last == number);
        let fixed = CURVES.contains(&block) && name.is_some_and(|name| PLACES.contains(&name));
        let may = name.is_some_and(|name| modal.parameters.contains(&name)) && !fixed;
        self.said.insert(letters.to_owned(), number.to_owned());
        again && may
    }
}

fn words(text: &str) -> impl Iterator<Item = Range<usize>> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + text.get(at..)?.find(|c: char| !c.is_whitespace())?;
        let rest = text.get(start..)?;
        at = start + rest.find(char::is_whitespace).unwrap_or(rest.len());
        Some(start..at)
    })
}

fn uses(line: &Line, name: &str) -> bool {
    line.pieces.iter().any(|piece| matches!(piece, Piece::Field(field) if field.name == name))
}

/// The texts for which a line with the header is repeated; `None` for other lines.
fn lines_of(line: &Line, value: &impl Fn(&str) -> Value) -> Option<Vec<String>> {
    match uses(line, HEAD).then(|| value(HEAD))? {
        Value::Lines(lines) => Some(lines),
        _ => None,
    }
}

fn millionths(count: u64) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX).saturating_mul(1_000_000)
}
