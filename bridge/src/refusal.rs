//! Why a command was refused, for users and for scripts, and its exit code.

use annulus_core::diagnostic::Diagnostic;
use serde_json::{Value, json};
use std::fmt;
use std::process::ExitCode;

/// Exit codes; documented, so never change them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Exit {
    /// Done; there may be warnings.
    Done = 0,
    /// Refused because of the content: an unaccepted error, a failed check.
    Content = 1,
    Usage = 2,
    /// Environment: missing file, busy port, no permission, full disk.
    Surroundings = 3,
    /// Interrupted by the user.
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// A refusal: what happened, where, what it means, what to do, and a stable code.
#[derive(Debug)]
pub(crate) struct Refusal {
    /// The reason; its sentences are in the locale tables.
    pub(crate) why: Diagnostic,
    pub(crate) exit: Exit,
    pub(crate) diagnostics: Vec<Diagnostic>,
}

impl Refusal {
    pub(crate) fn content(why: Diagnostic) -> Self {
        Self { why, exit: Exit::Content, diagnostics: Vec::new() }
    }

    pub(crate) fn usage(why: Diagnostic) -> Self {
        Self { why, exit: Exit::Usage, diagnostics: Vec::new() }
    }

    pub(crate) fn surroundings(why: Diagnostic) -> Self {
        Self { why, exit: Exit::Surroundings, diagnostics: Vec::new() }
    }

    /// Adds all other diagnostics, sorted by file and line.
    #[must_use]
    pub(crate) fn among(mut self, mut diagnostics: Vec<Diagnostic>) -> Self {
        diagnostics.sort_by(|a, b| a.place.cmp(&b.place));
        self.diagnostics = Vec::with_capacity(diagnostics.len());
        for diagnostic in diagnostics {
            // Keep equal ones once per position.
            let mut here = self.diagnostics.iter().rev().take_while(|other| other.place == diagnostic.place);
            if !here.any(|other| *other == diagnostic) {
                self.diagnostics.push(diagnostic);
            }
        }
        self
    }

    pub(crate) fn object(&self) -> Value {
        json!({
            "ok": false,
            "error": {
                "code": self.why.code,
                "message": self.why.message("en"),
                "advice": self.why.advice("en"),
                "place": self.why.place,
                "diagnostics": self.diagnostics.iter().map(diagnostic).collect::<Vec<_>>(),
            }
        })
    }
}

pub(crate) fn diagnostic(diagnostic: &Diagnostic) -> Value {
    let place = diagnostic.place.as_ref();
    json!({
        "severity": diagnostic.severity.word(),
        "code": diagnostic.code,
        "file": place.map(|place| place.file.as_str()),
        "line": place.map_or(0, |place| place.line),
        "column": place.map_or(0, |place| place.column),
        "found": diagnostic.argument(&["found"]),
        "expected": diagnostic.argument(&["expected", "promised"]),
        "message": diagnostic.message("en"),
        "advice": diagnostic.advice("en"),
    })
}

impl fmt::Display for Refusal {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.why.place {
            write!(out, "{}:{}:{}: ", place.file, place.line, place.column)?;
        }
        write!(out, "{} {} ({})", self.why.message("en"), self.why.advice("en"), self.why.code)
    }
}
