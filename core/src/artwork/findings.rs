//! The remarks of one file, with a cap: after the first findings the rest is counted, and never lighter.
//!
//! Comes in: findings. Goes out: remarks, at most [`MOST_KEPT`] and one that says how many more. Does not know what they
//! are about.

use crate::remark::{Remark, Weight};
use std::collections::BTreeSet;

/// Remarks kept of one file.
pub const MOST_KEPT: usize = 200;
/// Bytes of a file shown in a remark.
const LONGEST_EXCERPT: usize = 40;

/// Collects the remarks of one file.
#[derive(Clone, Debug)]
pub(super) struct Findings {
    file: String,
    kept: Vec<Remark>,
    dropped: usize,
    heaviest_dropped: Weight,
    said: BTreeSet<String>,
}

impl Findings {
    pub(super) fn new(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            kept: Vec::new(),
            dropped: 0,
            heaviest_dropped: Weight::Note,
            said: BTreeSet::new(),
        }
    }

    /// Adds a remark.
    pub(super) fn push(&mut self, remark: Remark) {
        if self.kept.len() < MOST_KEPT {
            self.kept.push(remark);
        } else {
            self.dropped += 1;
            self.heaviest_dropped = self.heaviest_dropped.max(remark.weight);
        }
    }

    /// Adds a remark at a place, with what was found there.
    pub(super) fn at(&mut self, weight: Weight, code: &str, line: u32, column: u32, found: &[u8]) {
        let file = self.file.clone();
        self.push(Remark::new(weight, code).at(&file, line, column).with("found", excerpt(found)));
    }

    /// Adds a remark of this code and subject unless it was said before.
    pub(super) fn once(&mut self, weight: Weight, code: &str, line: u32, column: u32, found: &[u8]) {
        let subject = excerpt(found);
        if self.said.insert(format!("{code} {subject}")) {
            self.at(weight, code, line, column, found);
        }
    }

    /// Adds a remark about the file as a whole.
    pub(super) fn whole(&mut self, remark: Remark) {
        let file = self.file.clone();
        self.push(remark.at(&file, 0, 0));
    }

    /// All that was said.
    pub(super) fn finish(mut self) -> Vec<Remark> {
        if self.dropped > 0 {
            let more = Remark::new(self.heaviest_dropped, "file.more_findings").with("count", self.dropped);
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
