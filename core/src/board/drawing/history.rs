//! Unlimited undo and redo; saved with the project, so it survives a reload.

use super::{Drawing, Edit, Id};
use crate::diagnostic::Diagnostic;
use std::collections::BTreeSet;

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct History {
    now: Drawing,
    /// Undo stack, the latest last.
    back: Vec<Edit>,
    on: Vec<Edit>,
    /// The last edit is still in progress, for example a drag. The redo stack is cleared only when it ends,
    /// because it may be cancelled.
    open: bool,
}

impl History {
    pub fn new(now: Drawing) -> Self {
        Self { now, ..Self::default() }
    }

    /// A saved drawing with its edits. Edits that don't fit are dropped.
    pub(super) fn restored(now: Drawing, back: Vec<Edit>, on: Vec<Edit>) -> Self {
        Self { now, back, on, open: false }
    }

    pub fn now(&self) -> &Drawing {
        &self.now
    }

    pub fn depth(&self) -> (usize, usize) {
        (self.back.len(), self.on().len())
    }

    /// The redo steps: none while an edit is in progress.
    fn on(&self) -> &[Edit] {
        if self.open { &[] } else { &self.on }
    }

    /// Undo and redo steps; the next last.
    pub(super) fn edits(&self) -> (&[Edit], &[Edit]) {
        (&self.back, self.on())
    }

    /// True if this history continues `earlier`: its current state is among our undo or redo states.
    pub fn goes_on_from(&self, earlier: &Self) -> bool {
        let depth = earlier.back.len();
        let mut there = self.clone();
        while there.back.len() > depth && there.step(true).is_some() {}
        while there.back.len() < depth && there.step(false).is_some() {}
        there.back.len() == depth && there.now == earlier.now
    }

    /// Applies an edit. Returns the affected elements, none for an empty edit.
    pub fn make(&mut self, edit: &Edit) -> Result<BTreeSet<Id>, Diagnostic> {
        self.rest();
        let touched = self.take_in(edit)?;
        if !edit.is_empty() {
            self.on.clear();
        }
        Ok(touched)
    }

    /// Replaces the edit in progress, so that a drag is one step from start to end. `edit` gets the drawing
    /// as before the drag.
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

    pub fn rest(&mut self) {
        if std::mem::take(&mut self.open) {
            self.on.clear();
        }
    }

    /// Undoes or redoes one step. Returns the affected elements; `None` if there is no step.
    pub fn step(&mut self, back: bool) -> Option<BTreeSet<Id>> {
        self.rest();
        let (from, to) = if back { (&mut self.back, &mut self.on) } else { (&mut self.on, &mut self.back) };
        let edit = from.pop()?;
        // Collect attached elements before and after: the edit may detach some.
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
