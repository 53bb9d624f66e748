//! What a reader, a plan or a check has to say: a code, a place and named arguments. The sentences themselves
//! live in the locale tables under the same code.
//!
//! Comes in: a finding. Goes out: a [`Diagnostic`]. Does not know any language.

use crate::locale;
use serde::{Deserialize, Serialize};

/// How much a diagnostic weighs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Nothing is lost; good to know.
    Note,
    /// The reading is probably right; somebody should look.
    Warning,
    /// Something of the input is missing from the result. Work cannot start until it was seen.
    Error,
}

impl Severity {
    /// Its word in what scripts read.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// Where in a file. Lines and columns count from 1; 0 means the file as a whole.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Location {
    /// Name of the file as it was given, for example `board.zip!/drill.drl`.
    pub file: String,
    /// Line, from 1.
    pub line: u32,
    /// Column in bytes, from 1.
    pub column: u32,
}

/// One finding. `code` is a key of the locale tables, for example `drill.unknown_word`; the table has
/// `drill.unknown_word.message` and `drill.unknown_word.advice`, with `{name}` where an argument goes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Diagnostic {
    /// How much it weighs.
    pub severity: Severity,
    /// Stable code, a key of the locale tables.
    pub code: String,
    /// Where it was found, if in a file.
    pub place: Option<Location>,
    /// Arguments of the sentence, by name.
    pub args: Vec<(String, String)>,
}

impl Diagnostic {
    /// A diagnostic without place and arguments.
    pub fn new(severity: Severity, code: &str) -> Self {
        Self { severity, code: code.to_owned(), place: None, args: Vec::new() }
    }

    /// What stands under the first of `names` that it has an argument for.
    pub fn argument(&self, names: &[&str]) -> Option<&str> {
        let find = |name: &&str| self.args.iter().find(|(have, _)| have == name);
        names.iter().find_map(find).map(|(_, value)| value.as_str())
    }

    /// Something of the input is missing from the result, or cannot be done.
    pub fn error(code: &str) -> Self {
        Self::new(Severity::Error, code)
    }

    /// Probably right; somebody should look.
    pub fn warning(code: &str) -> Self {
        Self::new(Severity::Warning, code)
    }

    /// Good to know.
    pub fn note(code: &str) -> Self {
        Self::new(Severity::Note, code)
    }

    /// The same at a place.
    #[must_use]
    pub fn at(mut self, file: &str, line: u32, column: u32) -> Self {
        self.place = Some(Location { file: file.to_owned(), line, column });
        self
    }

    /// The same with one more argument.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl ToString) -> Self {
        self.args.push((name.to_owned(), value.to_string()));
        self
    }

    /// Whether it is an error whose code is not among those that somebody has seen and accepted.
    pub fn is_unacknowledged(&self, accepted: &[String]) -> bool {
        self.severity == Severity::Error && !accepted.contains(&self.code)
    }

    /// What happened and what it means, in `language`.
    pub fn message(&self, language: &str) -> String {
        locale::text(language, &format!("{}.message", self.code), &self.args)
    }

    /// What to do, in `language`.
    pub fn advice(&self, language: &str) -> String {
        locale::text(language, &format!("{}.advice", self.code), &self.args)
    }
}

/// The name among `known` that is nearest to `name`: fewest letters to put in, take out, exchange or swap.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> &'a str {
    let wanted: Vec<char> = name.chars().take(64).collect();
    known.into_iter().min_by_key(|candidate| distance(&wanted, candidate)).unwrap_or_default()
}

/// How many letters have to be put in, taken out, exchanged or swapped to come from `name` to `other`.
pub fn letters_apart(name: &str, other: &str) -> usize {
    let wanted: Vec<char> = name.chars().take(64).collect();
    distance(&wanted, other).div_ceil(2)
}

/// Twice the edit distance; two letters swapped, and a letter that is only small or capital, count half.
fn distance(wanted: &[char], candidate: &str) -> usize {
    let candidate: Vec<char> = candidate.chars().collect();
    let mut before: Vec<usize> = Vec::new();
    let mut row: Vec<usize> = (0..=candidate.len()).map(|count| 2 * count).collect();
    for (y, &a) in wanted.iter().enumerate() {
        let mut next = vec![2 * (y + 1)];
        for (x, &b) in candidate.iter().enumerate() {
            let at = |cells: &[usize], index: usize| cells.get(index).copied().unwrap_or(usize::MAX / 2);
            let exchange = if a == b { 0 } else { 2 - usize::from(a.eq_ignore_ascii_case(&b)) };
            let mut best = (at(&row, x) + exchange).min(at(&row, x + 1) + 2).min(at(&next, x) + 2);
            let swapped = y > 0 && x > 0 && wanted.get(y - 1) == Some(&b) && candidate.get(x - 1) == Some(&a);
            if swapped {
                best = best.min(at(&before, x - 1) + 1);
            }
            next.push(best);
        }
        before = std::mem::replace(&mut row, next);
    }
    row.last().copied().unwrap_or_default()
}
