//! A drawing with all its edits: back and on again without end, and kept over a reload with the rest of the project (S2).
//!
//! Comes in: edits. Goes out: the drawing now, and what an edit touched. Does not know who makes them.

use super::{Drawing, Edit, Id};
use crate::diagnostic::Diagnostic;
use std::collections::BTreeSet;

/// A drawing with what takes its edits back.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct History {
    now: Drawing,
    /// What takes the edits back, the latest last.
    back: Vec<Edit>,
    /// What makes those again that were taken back, the next last.
    on: Vec<Edit>,
    /// An edit that is still being made, for example by a pointer that is held. Until it is made, what was taken back before it waits:
    /// it may be called off.
    open: bool,
}

impl History {
    /// A drawing that nothing was done to yet.
    pub fn new(now: Drawing) -> Self {
        Self { now, ..Self::default() }
    }

    /// A drawing as it was kept, with its edits. Those that do not fit it are left out.
    pub(super) fn restored(now: Drawing, back: Vec<Edit>, on: Vec<Edit>) -> Self {
        Self { now, back, on, open: false }
    }

    /// The drawing.
    pub fn now(&self) -> &Drawing {
        &self.now
    }

    /// How many edits can be taken back, and how many made again.
    pub fn depth(&self) -> (usize, usize) {
        (self.back.len(), self.on().len())
    }

    /// What can be made again: nothing behind an edit that is being made.
    fn on(&self) -> &[Edit] {
        if self.open { &[] } else { &self.on }
    }

    /// What takes the edits back, and what makes them again; the next last.
    pub(super) fn edits(&self) -> (&[Edit], &[Edit]) {
        (&self.back, self.on())
    }

    /// Whether this is the drawing `earlier` with what was done to it since: it went, or can go, through the state that one is in.
    pub fn goes_on_from(&self, earlier: &Self) -> bool {
        let depth = earlier.back.len();
        let mut there = self.clone();
        while there.back.len() > depth && there.step(true).is_some() {}
        while there.back.len() < depth && there.step(false).is_some() {}
        there.back.len() == depth && there.now == earlier.now
    }

    /// Makes an edit. What it touched; nothing where it changes nothing.
    pub fn make(&mut self, edit: &Edit) -> Result<BTreeSet<Id>, Diagnostic> {
        self.rest();
        let touched = self.take_in(edit)?;
        if !edit.is_empty() {
            self.on.clear();
        }
        Ok(touched)
    }

    /// Makes an edit in place of the one that is being made: a thing that is dragged goes from where it was to where it is, in
    /// one step. `edit` is asked with the drawing as it was before.
    pub fn make_instead(&mut self, edit: impl FnOnce(&Drawing) -> Edit) -> Result<BTreeSet<Id>, Diagnostic> {
        let mut touched = BTreeSet::new();
        if std::mem::take(&mut self.open)
            && let Some(inverse) = self.back.pop()
        {
            touched = self.now.touched(&inverse);
            self.now.apply(&inverse)?;
        }
        let edit = edit(&self.now);
        let made = self.take_in(&edit)?;
        self.open = !edit.is_empty();
        touched.extend(made);
        Ok(touched)
    }

    /// What is being made is made.
    pub fn rest(&mut self) {
        if std::mem::take(&mut self.open) {
            self.on.clear();
        }
    }

    /// Takes an edit back, or makes it again. What it touched; none where there is no such edit.
    pub fn step(&mut self, back: bool) -> Option<BTreeSet<Id>> {
        self.rest();
        let (from, to) = if back { (&mut self.back, &mut self.on) } else { (&mut self.on, &mut self.back) };
        let edit = from.pop()?;
        // What hangs on a node is looked for before and behind: an edit may untie it.
        let mut touched = self.now.touched(&edit);
        let inverse = self.now.apply(&edit).ok()?;
        to.push(inverse);
        touched.extend(self.now.touched(&edit));
        Some(touched)
    }

    fn take_in(&mut self, edit: &Edit) -> Result<BTreeSet<Id>, Diagnostic> {
        if edit.is_empty() {
            return Ok(BTreeSet::new());
        }
        let mut touched = self.now.touched(edit);
        let inverse = self.now.apply(edit)?;
        touched.extend(self.now.touched(edit));
        self.back.push(inverse);
        Ok(touched)
    }
}
