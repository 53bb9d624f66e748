//! Problems that readers, planners and checks report: a code, a location and named arguments. The locale
//! tables hold the texts under that code.

use crate::locale;
use serde::{Deserialize, Serialize};

#[macro_export]
macro_rules! code {
    ($code:literal) => {{
        const _: () = assert!($crate::locale::fits($code, &[], false), "no text has this code");
        $code
    }};
}

/// A diagnostic whose code and arguments the compiler compares with the tables. A final `..` leaves arguments
/// to [`Diagnostic::with`].
///
/// ```
/// # use annulus_core::error;
/// assert_eq!(error!("files.missing", path = "a.drl").message("en"), "a.drl does not exist.");
/// ```
#[macro_export]
macro_rules! error {
    ($($of:tt)*) => { $crate::diagnostic_of!(error $($of)*) };
}

#[macro_export]
macro_rules! warning {
    ($($of:tt)*) => { $crate::diagnostic_of!(warning $($of)*) };
}

#[macro_export]
macro_rules! note {
    ($($of:tt)*) => { $crate::diagnostic_of!(note $($of)*) };
}

#[doc(hidden)]
#[macro_export]
macro_rules! diagnostic_of {
    ($severity:ident $code:literal $(, $name:ident = $value:expr)* $(,)?) => {{
        const _: () =
            assert!($crate::locale::fits($code, &[$(stringify!($name)),*], true), "wrong code or arguments");
        $crate::diagnostic::Diagnostic::$severity($code)$(.with(stringify!($name), $value))*
    }};
    ($severity:ident $code:literal $(, $name:ident = $value:expr)*, ..) => {{
        const _: () =
            assert!($crate::locale::fits($code, &[$(stringify!($name)),*], false), "wrong code or arguments");
        $crate::diagnostic::Diagnostic::$severity($code)$(.with(stringify!($name), $value))*
    }};
}

/// Argument with the number of further problems of one cause in the file.
pub const MORE: &str = "more";

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// For information; nothing is lost.
    Note,
    /// The result is probably right, but the user should check it.
    Warning,
    /// Part of the input is missing from the result. Work can't start until the user accepts it.
    Error,
}

impl Severity {
    pub const fn word(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// Position in a file; line and column 0 mean the file as a whole.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Location {
    /// File name as opened, for example `board.zip!/drill.drl`.
    pub file: String,
    pub line: u32,
    /// From 1, in bytes.
    pub column: u32,
}

/// One problem. `code` is a key of the locale tables, for example `drill.unknown_word`. The tables hold
/// `drill.unknown_word.message` and `drill.unknown_word.advice`, with a `{name}` for each argument.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Diagnostic {
    pub severity: Severity,
    /// Stable code, a key of the locale tables.
    pub code: String,
    /// Position in a file, if any.
    pub place: Option<Location>,
    pub args: Vec<(String, String)>,
}

impl Diagnostic {
    /// A diagnostic without position and arguments.
    pub fn new(severity: Severity, code: &str) -> Self {
        Self { severity, code: code.to_owned(), place: None, args: Vec::new() }
    }

    /// Value of the first of `names` that is an argument.
    pub fn argument(&self, names: &[&str]) -> Option<&str> {
        let find = |name: &&str| self.args.iter().find(|(have, _)| have == name);
        names.iter().find_map(find).map(|(_, value)| value.as_str())
    }

    /// Part of the input is missing from the result, or the request can't be met.
    pub fn error(code: &str) -> Self {
        Self::new(Severity::Error, code)
    }

    /// Probably right, but the user should check it.
    pub fn warning(code: &str) -> Self {
        Self::new(Severity::Warning, code)
    }

    pub fn note(code: &str) -> Self {
        Self::new(Severity::Note, code)
    }

    #[must_use]
    pub fn at(mut self, file: &str, line: u32, column: u32) -> Self {
        self.place = Some(Location { file: file.to_owned(), line, column });
        self
    }

    #[must_use]
    pub fn with(mut self, name: &str, value: impl ToString) -> Self {
        self.args.push((name.to_owned(), value.to_string()));
        self
    }

    /// True for an error with a code that isn't in `accepted`.
    pub fn is_unacknowledged(&self, accepted: &[String]) -> bool {
        self.severity == Severity::Error && !accepted.contains(&self.code)
    }

    /// The message in `language`, with the number of further problems of one cause.
    pub fn message(&self, language: &str) -> String {
        let first = locale::text(language, &format!("{}.message", self.code), &self.args);
        match self.argument(&[MORE]) {
            Some(_) => first + &locale::text(language, "file.and_more", &self.args),
            None => first,
        }
    }

    pub fn advice(&self, language: &str) -> String {
        locale::text(language, &format!("{}.advice", self.code), &self.args)
    }
}

pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> &'a str {
    let wanted: Vec<char> = name.chars().take(64).collect();
    known.into_iter().min_by_key(|candidate| distance(&wanted, candidate)).unwrap_or_default()
}

/// Edit distance between `name` and `other`: letters inserted, deleted, replaced or swapped.
pub fn letters_apart(name: &str, other: &str) -> usize {
    let wanted: Vec<char> = name.chars().take(64).collect();
    distance(&wanted, other).div_ceil(2)
}

/// Twice the edit distance. A swap of two letters, or a change of case, counts half.
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
