//! The diagnostics of one file, in file order. Merges equal ones, and many of the same code: the first keeps
//! its position, and `more` counts the others. At most [`MOST_KEPT`], plus one that counts the rest.

use crate::code;
use crate::diagnostic::{Diagnostic, MORE, Severity};
use std::collections::{BTreeMap, BTreeSet};

pub const MOST_KEPT: usize = 200;
/// Diagnostics of one code are listed separately up to this number; more probably have a common cause.
const MOST_OF_A_CODE: usize = 3;
const LONGEST_EXCERPT: usize = 40;

type Kind = (Severity, String);

/// The first diagnostic of a cause, and the number of further ones.
#[derive(Clone, Debug)]
struct Row {
    first: Diagnostic,
    more: usize,
}

#[derive(Clone, Debug)]
pub(super) struct Findings {
    file: String,
    kept: Vec<Row>,
    /// Index in `kept` by kind and arguments.
    rows: BTreeMap<Kind, BTreeMap<Vec<(String, String)>, usize>>,
    dropped: usize,
    gravest_dropped: Severity,
    said: BTreeSet<String>,
}

impl Findings {
    pub(super) fn new(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            kept: Vec::new(),
            rows: BTreeMap::new(),
            dropped: 0,
            gravest_dropped: Severity::Note,
            said: BTreeSet::new(),
        }
    }

    pub(super) fn push(&mut self, diagnostic: Diagnostic) {
        let alike = self.rows.entry((diagnostic.severity, diagnostic.code.clone())).or_default();
        let many = alike.len() > MOST_OF_A_CODE;
        let known = alike.get(&diagnostic.args).or_else(|| alike.values().next().filter(|_| many)).copied();
        if let Some(row) = known.and_then(|at| self.kept.get_mut(at)) {
            row.more += 1;
        } else if self.kept.len() < MOST_KEPT {
            alike.insert(diagnostic.args.clone(), self.kept.len());
            self.kept.push(Row { first: diagnostic, more: 0 });
        } else {
            self.dropped += 1;
            self.gravest_dropped = self.gravest_dropped.max(diagnostic.severity);
        }
    }

    pub(super) fn at(&mut self, severity: Severity, code: &str, line: u32, column: u32, found: &[u8]) {
        let file = self.file.clone();
        self.push(Diagnostic::new(severity, code).at(&file, line, column).with("found", excerpt(found)));
    }

    /// Adds a diagnostic unless there is one with the same code and excerpt.
    pub(super) fn once(&mut self, severity: Severity, code: &str, line: u32, column: u32, found: &[u8]) {
        let subject = excerpt(found);
        if self.said.insert(format!("{code} {subject}")) {
            self.at(severity, code, line, column, found);
        }
    }

    pub(super) fn whole(&mut self, diagnostic: Diagnostic) {
        let file = self.file.clone();
        self.push(diagnostic.at(&file, 0, 0));
    }

    pub(super) fn finish(mut self) -> Vec<Diagnostic> {
        let mut merged = BTreeSet::new();
        for of_kind in self.rows.values().filter(|of_kind| of_kind.len() > MOST_OF_A_CODE) {
            let first = of_kind.values().copied().min().unwrap_or_default();
            let others = of_kind.values().copied().filter(|&at| at != first);
            let more: usize = others.clone().filter_map(|at| Some(1 + self.kept.get(at)?.more)).sum();
            self.kept.get_mut(first).into_iter().for_each(|row| row.more += more);
            merged.extend(others);
        }
        let rows = self.kept.into_iter().enumerate().filter(|(at, _)| !merged.contains(at));
        let counted = |Row { first, more }| if more == 0 { first } else { first.with(MORE, more) };
        let mut all: Vec<Diagnostic> = rows.map(|(_, row)| counted(row)).collect();
        if self.dropped > 0 {
            let more = Diagnostic::new(self.gravest_dropped, code!("file.more_findings"))
                .with("count", self.dropped);
            all.push(more.at(&self.file, 0, 0));
        }
        all
    }
}

/// A printable excerpt: one short line of visible ASCII.
pub(super) fn excerpt(bytes: &[u8]) -> String {
    let shown = bytes.iter().take(LONGEST_EXCERPT);
    let mut text: String =
        shown.map(|&byte| if (b' '..=b'~').contains(&byte) { char::from(byte) } else { '·' }).collect();
    if bytes.len() > LONGEST_EXCERPT {
        text.push('…');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_problems_are_merged_into_one() {
        let mut findings = Findings::new("f");
        for line in 1..=195 {
            findings.at(Severity::Error, "drill.out_of_range", line, 1, b"");
            findings.at(Severity::Warning, "gerber.point", line, 2, format!("X{line}").as_bytes());
        }
        for line in 1..=3 {
            findings.at(Severity::Error, "drill.bad_number", line, 1, format!("Q{line}").as_bytes());
        }
        let all = findings.finish();
        let seen: Vec<_> = all.iter().map(|one| (one.code.as_str(), one.argument(&[MORE]))).collect();
        let number = ("drill.bad_number", None);
        let wanted =
            [("drill.out_of_range", Some("194")), ("gerber.point", Some("194")), number, number, number];
        assert_eq!(seen, wanted);
        assert_eq!(all[0].place.as_ref().map(|place| place.line), Some(1));
        assert!(all[0].message("en").contains("194"), "{}", all[0].message("en"));
    }
}
