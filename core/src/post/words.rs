//! A dialect file as a tree of values with positions, and the faults found in it.

use crate::diagnostic::{Diagnostic, nearest};
use crate::error;
use std::collections::BTreeMap;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

const MOST_FAULTS: usize = 200;

pub(super) struct Words<'a> {
    file: &'a str,
    text: &'a str,
    pub(super) faults: Vec<Diagnostic>,
}

pub(super) type Value<'a> = Spanned<DeValue<'a>>;

/// A table: its name for people, its position, its keys.
#[derive(Clone, Debug)]
pub(super) struct Table<'a> {
    name: String,
    at: usize,
    keys: BTreeMap<String, Value<'a>>,
}

impl<'a> Table<'a> {
    fn new(name: &str, at: usize, table: DeTable<'a>) -> Self {
        let keys = table.into_iter().map(|(key, value)| (key.into_inner().into_owned(), value)).collect();
        Self { name: name.to_owned(), at, keys }
    }

    pub(super) fn take(&mut self, key: &str) -> Option<Value<'a>> {
        self.keys.remove(key)
    }

    fn path(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) }
    }
}

impl<'a> Words<'a> {
    /// Parses `text`. Invalid TOML is a fault; reading continues after it.
    pub(super) fn new(file: &'a str, text: &'a str) -> (Self, Table<'a>) {
        let (tree, errors) = DeTable::parse_recoverable(text);
        let mut words = Self { file, text, faults: Vec::new() };
        for error in errors {
            let at = error.span().map_or(0, |span| span.start);
            let why = error!("post.dialect_unreadable", why = error.message());
            words.fault(why, at);
        }
        (words, Table::new("", 0, tree.into_inner()))
    }

    pub(super) fn fault(&mut self, diagnostic: Diagnostic, at: usize) {
        if self.faults.len() < MOST_FAULTS {
            let (line, column) = place(self.text, at);
            self.faults.push(diagnostic.at(self.file, line, column));
        }
    }

    pub(super) fn source(&self, span: Range<usize>) -> &'a str {
        self.text.get(span).unwrap_or_default()
    }

    fn bad(&mut self, table: &Table<'_>, key: &str, expected: &str, at: usize) {
        let diagnostic = error!("post.bad_value", ..);
        self.fault(diagnostic.with("name", table.path(key)).with("expected", expected), at);
    }

    pub(super) fn unknown(&mut self, table: &Table<'_>, known: &[&str]) {
        for (key, value) in &table.keys {
            let diagnostic = error!("post.unknown_key", name = table.path(key), ..);
            let diagnostic = diagnostic.with("nearest", nearest(key, known.iter().copied()));
            self.fault(diagnostic.with("known", known.join(", ")), value.span().start);
        }
    }

    pub(super) fn missing(&mut self, table: &Table<'_>, key: &str) {
        self.fault(error!("post.missing_key", name = table.path(key)), table.at);
    }

    pub(super) fn missing_block(&mut self, table: &Table<'_>, diagnostic: Diagnostic) {
        self.fault(diagnostic, table.at);
    }

    pub(super) fn table(&mut self, from: &mut Table<'a>, key: &str) -> Option<Table<'a>> {
        let value = from.take(key)?;
        let (at, name) = (value.span().start, from.path(key));
        match value.into_inner() {
            DeValue::Table(table) => Some(Table::new(&name, at, table)),
            _ => {
                self.bad(from, key, "[…]", at);
                None
            }
        }
    }

    pub(super) fn text(&mut self, from: &mut Table<'a>, key: &str) -> Option<Spanned<String>> {
        let value = from.take(key)?;
        let span = value.span();
        match value.into_inner() {
            DeValue::String(text) => Some(Spanned::new(span, text.into_owned())),
            _ => {
                self.bad(from, key, "\"…\"", span.start);
                None
            }
        }
    }

    /// The text `key`, one of `choices`.
    pub(super) fn choice<T: Copy>(
        &mut self,
        from: &mut Table<'a>,
        key: &str,
        choices: &[(&str, T)],
    ) -> Option<T> {
        let text = self.text(from, key)?;
        let found = choices.iter().find(|(name, _)| name == text.get_ref());
        if found.is_none() {
            let names: Vec<String> = choices.iter().map(|(name, _)| format!("\"{name}\"")).collect();
            self.bad(from, key, &names.join(", "), text.span().start);
        }
        found.map(|(_, value)| *value)
    }

    /// The text `key`: at most `longest` bytes, only `allowed` characters.
    pub(super) fn short(
        &mut self,
        from: &mut Table<'a>,
        key: &str,
        longest: usize,
        allowed: impl Fn(char) -> bool,
    ) -> Option<String> {
        let text = self.text(from, key)?;
        let sound = text.get_ref().len() <= longest && text.get_ref().chars().all(allowed);
        if !sound {
            self.bad(from, key, &format!("\"…\" ≤ {longest}"), text.span().start);
        }
        sound.then(|| text.into_inner())
    }

    pub(super) fn flag(&mut self, from: &mut Table<'a>, key: &str) -> Option<bool> {
        let value = from.take(key)?;
        if let DeValue::Boolean(flag) = value.get_ref() {
            return Some(*flag);
        }
        self.bad(from, key, "true, false", value.span().start);
        None
    }

    pub(super) fn number(&mut self, from: &mut Table<'a>, key: &str, range: Range<f64>) -> Option<f64> {
        let value = from.take(key)?;
        let found =
            number_of(value.get_ref()).filter(|number| range.start <= *number && *number <= range.end);
        if found.is_none() {
            self.bad(from, key, &format!("{} … {}", range.start, range.end), value.span().start);
        }
        found
    }

    pub(super) fn count(&mut self, from: &mut Table<'a>, key: &str, range: Range<u32>) -> Option<u32> {
        let at = from.keys.get(key).map_or(0, |value| value.span().start);
        let number = self.number(from, key, f64::from(range.start)..f64::from(range.end))?;
        let whole = number as u32;
        if f64::from(whole) == number {
            return Some(whole);
        }
        self.bad(from, key, &format!("{} … {}", range.start, range.end), at);
        None
    }

    pub(super) fn texts(&mut self, from: &mut Table<'a>, key: &str) -> Vec<Spanned<String>> {
        let Some(value) = from.take(key) else { return Vec::new() };
        let at = value.span().start;
        let DeValue::Array(items) = value.into_inner() else {
            self.bad(from, key, "[\"…\", …]", at);
            return Vec::new();
        };
        let mut out = Vec::new();
        for item in items {
            let span = item.span();
            match item.into_inner() {
                DeValue::String(text) => out.push(Spanned::new(span, text.into_owned())),
                _ => self.bad(from, key, "[\"…\", …]", span.start),
            }
        }
        out
    }

    pub(super) fn pair(&mut self, from: &mut Table<'a>, key: &str, range: Range<f64>) -> Option<[f64; 2]> {
        let value = from.take(key)?;
        let numbers: Vec<f64> = match value.get_ref() {
            DeValue::Array(items) => items.iter().filter_map(|item| number_of(item.get_ref())).collect(),
            _ => Vec::new(),
        };
        match numbers.as_slice() {
            &[x, y] if [x, y].iter().all(|number| range.start <= *number && *number <= range.end) => {
                Some([x, y])
            }
            _ => {
                let expected = format!("[x, y], {} … {}", range.start, range.end);
                self.bad(from, key, &expected, value.span().start);
                None
            }
        }
    }
}

fn number_of(value: &DeValue<'_>) -> Option<f64> {
    let text = match value {
        DeValue::Integer(number) if number.radix() == 10 => number.as_str(),
        DeValue::Float(number) => number.as_str(),
        _ => return None,
    };
    text.parse().ok().filter(|number: &f64| number.is_finite())
}

pub(super) fn place(text: &str, offset: usize) -> (u32, u32) {
    let before = text.get(..offset).unwrap_or_default();
    let line = before.matches('\n').count() + 1;
    let column = before.len() - before.rfind('\n').map_or(0, |end| end + 1) + 1;
    (line as u32, column as u32)
}
