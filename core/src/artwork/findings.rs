//! The diagnostics of one file, with a cap: after the first findings the rest is counted, and never lighter.
//!
//! Comes in: findings. Goes out: diagnostics, at most [`MOST_KEPT`] and one that says how many more. Does not know what they
//! are about.

use crate::diagnostic::{Diagnostic, Severity};
use std::collections::BTreeSet;

/// Diagnostics kept of one file.
pub const MOST_KEPT: usize = 200;
/// Bytes of a file shown in a diagnostic.
const LONGEST_EXCERPT: usize = 40;

/// Collects the diagnostics of one file.
#[derive(Clone, Debug)]
pub(super) struct Findings {
    file: String,
    kept: Vec<Diagnostic>,
    dropped: usize,
    gravest_dropped: Severity,
    said: BTreeSet<String>,
}

impl Findings {
    pub(super) fn new(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            kept: Vec::new(),
            dropped: 0,
            gravest_dropped: Severity::Note,
            said: BTreeSet::new(),
        }
    }

    /// Adds a diagnostic.
    pub(super) fn push(&mut self, diagnostic: Diagnostic) {
        if self.kept.len() < MOST_KEPT {
            self.kept.push(diagnostic);
        } else {
            self.dropped += 1;
            self.gravest_dropped = self.gravest_dropped.max(diagnostic.severity);
        }
    }

    /// Adds a diagnostic at a place, with what was found there.
    pub(super) fn at(&mut self, severity: Severity, code: &str, line: u32, column: u32, found: &[u8]) {
        let file = self.file.clone();
        self.push(Diagnostic::new(severity, code).at(&file, line, column).with("found", excerpt(found)));
    }

    /// Adds a diagnostic of this code and subject unless it was said before.
    pub(super) fn once(&mut self, severity: Severity, code: &str, line: u32, column: u32, found: &[u8]) {
        let subject = excerpt(found);
        if self.said.insert(format!("{code} {subject}")) {
            self.at(severity, code, line, column, found);
        }
    }

    /// Adds a diagnostic about the file as a whole.
    pub(super) fn whole(&mut self, diagnostic: Diagnostic) {
        let file = self.file.clone();
        self.push(diagnostic.at(&file, 0, 0));
    }

    /// All that was said.
    pub(super) fn finish(mut self) -> Vec<Diagnostic> {
        if self.dropped > 0 {
            let more =
                Diagnostic::new(self.gravest_dropped, "file.more_findings").with("count", self.dropped);
            self.kept.push(more.at(&self.file, 0, 0));
        }
        self.kept
    }
}

/// A piece of a file made fit to show: one short line of visible ASCII.
pub(super) fn excerpt(bytes: &[u8]) -> String {
    let shown = bytes.iter().take(LONGEST_EXCERPT);
    let mut text: String =
        shown.map(|&byte| if (b' '..=b'~').contains(&byte) { char::from(byte) } else { '·' }).collect();
    if bytes.len() > LONGEST_EXCERPT {
        text.push('…');
    }
    text
}
