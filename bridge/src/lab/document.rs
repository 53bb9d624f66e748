//! A JSON document whose values know their position, so that an error has line and column.
//!
//! Positions are computed only for an error: the text is parsed again along the node's path.

use annulus_core::code;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use serde_json::Value;
use std::cell::RefCell;
use std::collections::BTreeSet;

/// Explanatory members for human readers; allowed anywhere.
const NOTES: [&str; 4] = ["note", "units", "oracle", "id"];

#[derive(Debug)]
pub(super) struct Document<'a> {
    name: &'a str,
    text: &'a str,
    value: Value,
    /// The paths that were requested, present or not.
    asked: RefCell<BTreeSet<Vec<Step>>>,
    /// The objects whose members were listed: the file chooses those names.
    named: RefCell<BTreeSet<Vec<Step>>>,
}

/// One step from a value to one inside it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Step {
    Key(String),
    Index(usize),
}

#[derive(Clone, Debug)]
pub(super) struct Node<'a> {
    document: &'a Document<'a>,
    value: &'a Value,
    path: Vec<Step>,
}

impl<'a> Document<'a> {
    /// Parses `text`; an error has its position. The parser limits the nesting.
    pub(super) fn parse(name: &'a str, text: &'a str) -> Result<Self, Diagnostic> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        match serde_json::from_str(text) {
            Ok(value) => Ok(Self { name, text, value, asked: RefCell::default(), named: RefCell::default() }),
            Err(bad) => {
                let at = |number: usize| u32::try_from(number.max(1)).unwrap_or(u32::MAX);
                // The parser appends line and column to its message; they go into the position instead.
                let words = bad.to_string();
                let what = words.rsplit_once(" at line ").map_or(words.as_str(), |(what, _)| what);
                let why = error!("lab.not_json", what = what);
                Err(why.at(name, at(bad.line()), at(bad.column())))
            }
        }
    }

    pub(super) fn root(&'a self) -> Node<'a> {
        Node { document: self, value: &self.value, path: Vec::new() }
    }

    /// The first member that was not requested in any place of its kind, such as a misspelt expected value.
    /// Places that differ only in list indices, or in names that the file chooses, are of one kind.
    pub(super) fn unknown(&'a self) -> Option<Node<'a>> {
        let named = self.named.borrow();
        let known: BTreeSet<Vec<Step>> = self.asked.borrow().iter().map(|path| kind(path, &named)).collect();
        let mut todo = vec![self.root()];
        while let Some(node) = todo.pop() {
            if let Some(items) = node.value.as_array() {
                let inside = |(at, value)| node.inside(value, Step::Index(at));
                todo.extend(items.iter().enumerate().rev().map(inside));
            }
            let members = node.value.as_object().into_iter().flatten();
            for (key, value) in members.filter(|(key, _)| !NOTES.contains(&key.as_str())) {
                let member = node.inside(value, Step::Key(key.clone()));
                if !named.contains(&node.path) && !known.contains(&kind(&member.path, &named)) {
                    return Some(member);
                }
                todo.push(member);
            }
        }
        None
    }
}

/// A path without list indices and without names that the file chooses.
fn kind(path: &[Step], named: &BTreeSet<Vec<Step>>) -> Vec<Step> {
    let any = |(at, step): (usize, &Step)| match step {
        Step::Key(key) if !named.contains(&path[..at]) => Step::Key(key.clone()),
        _ => Step::Index(0),
    };
    path.iter().enumerate().map(any).collect()
}

impl<'a> Node<'a> {
    fn inside(&self, value: &'a Value, step: Step) -> Self {
        let mut path = self.path.clone();
        path.push(step);
        Self { document: self.document, value, path }
    }

    /// The member `key`, if there is one. `null` is a member.
    pub(super) fn find(&self, key: &str) -> Option<Self> {
        let mut path = self.path.clone();
        path.push(Step::Key(key.to_owned()));
        self.document.asked.borrow_mut().insert(path);
        self.value.get(key).map(|value| self.inside(value, Step::Key(key.to_owned())))
    }

    pub(super) fn get(&self, key: &str) -> Result<Self, Diagnostic> {
        if !self.value.is_object() {
            return Err(self.unlike("an object"));
        }
        self.find(key).ok_or_else(|| self.refuse(code!("lab.missing")).with("field", key))
    }

    pub(super) fn number_at(&self, key: &str) -> Result<f64, Diagnostic> {
        self.get(key)?.number()
    }

    pub(super) fn number(&self) -> Result<f64, Diagnostic> {
        self.value.as_f64().filter(|value| value.is_finite()).ok_or_else(|| self.unlike("a number"))
    }

    pub(super) fn maybe_number(&self) -> Result<Option<f64>, Diagnostic> {
        if self.value.is_null() { Ok(None) } else { self.number().map(Some) }
    }

    pub(super) fn whole(&self, low: i64, high: i64) -> Result<i64, Diagnostic> {
        let whole = self.value.as_i64().filter(|value| (low..=high).contains(value));
        whole.ok_or_else(|| self.unlike(&format!("a whole number from {low} to {high}")))
    }

    pub(super) fn text(&self) -> Result<&'a str, Diagnostic> {
        self.value.as_str().ok_or_else(|| self.unlike("a text"))
    }

    pub(super) fn truth(&self) -> Result<bool, Diagnostic> {
        self.value.as_bool().ok_or_else(|| self.unlike("true or false"))
    }

    pub(super) fn items(&self) -> Result<Vec<Self>, Diagnostic> {
        let items = self.value.as_array().ok_or_else(|| self.unlike("a list"))?;
        Ok(items.iter().enumerate().map(|(at, value)| self.inside(value, Step::Index(at))).collect())
    }

    pub(super) fn exactly<const N: usize>(&self) -> Result<[Self; N], Diagnostic> {
        self.items()?.try_into().map_err(|_| self.unlike(&format!("a list of {N}")))
    }

    /// The members of an object, in the file's order.
    pub(super) fn members(&self) -> Result<Vec<(&'a str, Self)>, Diagnostic> {
        let members = self.value.as_object().ok_or_else(|| self.unlike("an object"))?;
        self.document.named.borrow_mut().insert(self.path.clone());
        let inside = |(key, value): (&'a String, &'a Value)| {
            (key.as_str(), self.inside(value, Step::Key(key.clone())))
        };
        Ok(members.iter().map(inside).collect())
    }

    pub(super) fn value(&self) -> &'a Value {
        self.value
    }

    /// The path to this value in readable form: `cases[3].z[0].H`.
    pub(super) fn path(&self) -> String {
        let mut out = String::new();
        for step in &self.path {
            match step {
                Step::Key(key) if out.is_empty() => out.push_str(key),
                Step::Key(key) => out.extend([".", key]),
                Step::Index(index) => out.push_str(&format!("[{index}]")),
            }
        }
        out
    }

    pub(super) fn refuse(&self, code: &str) -> Diagnostic {
        let path = self.path();
        let path = if path.is_empty() { "the file".to_owned() } else { path };
        self.place(Diagnostic::error(code).with("path", path))
    }

    pub(super) fn place(&self, why: Diagnostic) -> Diagnostic {
        let at = locate(self.document.text.as_bytes(), &self.path);
        let before = &self.document.text.as_bytes()[..at];
        let line = before.iter().filter(|byte| **byte == b'\n').count() + 1;
        let column = before.iter().rev().take_while(|byte| **byte != b'\n').count() + 1;
        let short = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
        why.at(self.document.name, short(line), short(column))
    }

    fn unlike(&self, wanted: &str) -> Diagnostic {
        let mut found = self.value.to_string();
        if found.chars().count() > 40 {
            found = found.chars().take(40).chain(['…']).collect();
        }
        self.refuse(code!("lab.not_a")).with("found", found).with("wanted", wanted)
    }
}

/// Offset in bytes of the value at the end of `path`. The text must be JSON. If the path is missing, the
/// offset of its last existing value.
fn locate(text: &[u8], path: &[Step]) -> usize {
    let mut at = blank(text, 0);
    for step in path {
        let Some(next) = enter(text, at, step) else { return at };
        at = next;
    }
    at.min(text.len())
}

/// Offset of the value inside the one at `at`. Of two members with the same name the last counts, as in the
/// parser.
fn enter(text: &[u8], at: usize, step: &Step) -> Option<usize> {
    let mut found = None;
    let mut index = 0;
    let mut here = blank(text, at + 1);
    while here < text.len() && !matches!(text[here], b'}' | b']') {
        let mut wanted = matches!(step, Step::Index(number) if *number == index);
        if text[at] == b'{' {
            let end = behind(text, here);
            let key = serde_json::from_slice::<String>(&text[here..end]).ok()?;
            wanted = matches!(step, Step::Key(name) if *name == key);
            here = blank(text, blank(text, end) + 1);
        }
        if wanted {
            found = Some(here);
        }
        here = blank(text, behind(text, here));
        if text.get(here) == Some(&b',') {
            here = blank(text, here + 1);
        }
        index += 1;
    }
    found
}

/// The first byte from `at` that is not white space.
fn blank(text: &[u8], at: usize) -> usize {
    let rest = text.get(at..).unwrap_or_default();
    at + rest.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(rest.len())
}

/// The byte after the value that starts at `at`.
fn behind(text: &[u8], at: usize) -> usize {
    let (mut depth, mut quoted, mut here) = (0_usize, false, at);
    while here < text.len() {
        let byte = text[here];
        here += 1;
        if quoted {
            match byte {
                b'\\' => here += 1,
                b'"' => quoted = false,
                _ => continue,
            }
        } else {
            match byte {
                b'"' => quoted = true,
                b'{' | b'[' => depth += 1,
                b'}' | b']' => depth = depth.saturating_sub(1),
                _ => {
                    let ends = text.get(here).is_none_or(|next| b",]} \t\r\n:".contains(next));
                    if depth == 0 && ends {
                        return here;
                    }
                    continue;
                }
            }
        }
        if depth == 0 && !quoted {
            return here.min(text.len());
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::chance::Chance;

    const TEXT: &str =
        "{ \"a\" : [1, {\"b\\\"}\": [ ] ,\n \"c\": \"]\\\\\" }, -2.5e3 ],\n\"d\":null, \"d\" :  true}";

    #[test]
    fn every_value_has_its_line_and_column() {
        let document = Document::parse("f", TEXT).unwrap();
        let root = document.root();
        let a = root.get("a").unwrap();
        let items = a.items().unwrap();
        let rows = [
            (root.clone(), 1, 1),
            (a.clone(), 1, 9),
            (items[0].clone(), 1, 10),
            (items[1].clone(), 1, 13),
            (items[1].get("b\"}").unwrap(), 1, 22),
            (items[1].get("c").unwrap(), 2, 7),
            (items[2].clone(), 2, 16),
            (root.get("d").unwrap(), 3, 18),
        ];
        for (node, line, column) in rows {
            let place = node.refuse("lab.missing").place.unwrap();
            assert_eq!((place.line, place.column), (line, column), "{}", node.path());
        }
        assert_eq!(items[1].get("c").unwrap().path(), "a[1].c");
        let why = root.get("d").unwrap().number().unwrap_err();
        assert!(why.message("en").contains("true") && why.message("en").contains("a number"), "{why:?}");
    }

    #[test]
    fn truncated_text_is_refused_and_changed_bytes_never_panic() {
        for end in 0..TEXT.len() {
            let why = Document::parse("f", &TEXT[..end]).unwrap_err();
            assert_eq!(why.code, "lab.not_json");
            assert!(why.place.is_some_and(|place| place.line >= 1 && place.column >= 1));
        }
        let mut chance = Chance::new(3);
        for _ in 0..5_000 {
            let mut bytes = TEXT.as_bytes().to_vec();
            let at = chance.below(bytes.len());
            bytes[at] = chance.below(128) as u8;
            let text = String::from_utf8_lossy(&bytes).into_owned();
            if let Ok(document) = Document::parse("f", &text) {
                let mut todo = vec![document.root()];
                while let Some(node) = todo.pop() {
                    let place = node.refuse("lab.missing").place.unwrap();
                    assert!(place.line <= 4 && place.column as usize <= text.len() + 1);
                    todo.extend(node.items().unwrap_or_default());
                    todo.extend(node.members().unwrap_or_default().into_iter().map(|(_, node)| node));
                }
            }
        }
        let deep = "[".repeat(100_000);
        assert_eq!(Document::parse("f", &deep).unwrap_err().code, "lab.not_json");
    }
}
