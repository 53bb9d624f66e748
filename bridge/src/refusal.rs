//! Why a command was refused, for people and for scripts, and with which exit code.
//!
//! Comes in: a diagnostic or an I/O error. Goes out: sentence, object, exit code. Does not know the commands.

use annulus_core::diagnostic::Diagnostic;
use serde_json::{Value, json};
use std::fmt;
use std::process::ExitCode;

/// Exit codes of the contract.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Exit {
    /// Done; diagnostics are allowed.
    Done = 0,
    /// Refused for content: an error that nobody acknowledged, a check that failed.
    Content = 1,
    /// Wrong usage.
    Usage = 2,
    /// Surroundings: missing file, port in use, no permission, disk full.
    Surroundings = 3,
    /// Interrupted by a person.
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// A refusal: what, where, what it means, what to do, and a stable code.
#[derive(Debug)]
pub(crate) struct Refusal {
    /// What happened, as a diagnostic whose sentences are in the locale tables.
    pub(crate) why: Diagnostic,
    /// How the process ends.
    pub(crate) exit: Exit,
    /// Everything that was said of the files, this among it.
    pub(crate) diagnostics: Vec<Diagnostic>,
}

impl Refusal {
    /// A refusal for content.
    pub(crate) fn content(why: Diagnostic) -> Self {
        Self { why, exit: Exit::Content, diagnostics: Vec::new() }
    }

    /// A refusal of wrong usage.
    pub(crate) fn usage(why: Diagnostic) -> Self {
        Self { why, exit: Exit::Usage, diagnostics: Vec::new() }
    }

    /// A refusal because of the surroundings.
    pub(crate) fn surroundings(why: Diagnostic) -> Self {
        Self { why, exit: Exit::Surroundings, diagnostics: Vec::new() }
    }

    /// The same with everything else that was said, by file and line.
    #[must_use]
    pub(crate) fn among(mut self, mut diagnostics: Vec<Diagnostic>) -> Self {
        diagnostics.sort_by(|a, b| a.place.cmp(&b.place));
        self.diagnostics = Vec::with_capacity(diagnostics.len());
        for diagnostic in diagnostics {
            // Equal ones stand in one place.
            let mut here = self.diagnostics.iter().rev().take_while(|other| other.place == diagnostic.place);
            if !here.any(|other| *other == diagnostic) {
                self.diagnostics.push(diagnostic);
            }
        }
        self
    }

    /// The object for scripts.
    pub(crate) fn object(&self) -> Value {
        let place = self.why.place.as_ref();
        json!({
            "ok": false,
            "error": {
                "code": self.why.code,
                "message": self.why.message("en"),
                "advice": self.why.advice("en"),
                "place": place.map(|p| json!({ "file": p.file, "line": p.line, "column": p.column })),
                "diagnostics": self.diagnostics.iter().map(diagnostic).collect::<Vec<_>>(),
            }
        })
    }
}

/// One diagnostic for scripts.
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
