//! Undo and redo of whole states.
//!
//! ```text
//! past … before ◀─ undo ─ now ─ redo ─▶ after … future      typing in one field is one step
//! ```

const MOST_STEPS: usize = 200;

#[derive(Clone, Debug)]
pub struct LabHistory<T> {
    past: Vec<T>,
    now: T,
    future: Vec<T>,
    /// The field of the last change, while the user is still in it.
    field: Option<String>,
}

impl<T: Clone + PartialEq> LabHistory<T> {
    pub fn new(now: T) -> Self {
        Self { past: Vec::new(), now, future: Vec::new(), field: None }
    }

    pub fn now(&self) -> &T {
        &self.now
    }

    /// Changes to `next`. Successive changes from one `field` are one step; without a field, each change is a
    /// step.
    pub fn change(&mut self, field: Option<&str>, next: T) {
        if next == self.now {
            return;
        }
        let same_field = field.is_some() && self.field.as_deref() == field && !self.past.is_empty();
        let before = std::mem::replace(&mut self.now, next);
        if !same_field {
            self.past.push(before);
            if self.past.len() > MOST_STEPS {
                self.past.remove(0);
            }
        }
        self.future.clear();
        self.field = field.map(str::to_owned);
    }

    /// The user left the field: further typing is a new step.
    pub fn rest(&mut self) {
        self.field = None;
    }

    /// False if there is nothing to undo.
    pub fn undo(&mut self) -> bool {
        let Some(before) = self.past.pop() else { return false };
        self.future.push(std::mem::replace(&mut self.now, before));
        self.field = None;
        true
    }

    /// False if there is nothing to redo.
    pub fn redo(&mut self) -> bool {
        let Some(after) = self.future.pop() else { return false };
        self.past.push(std::mem::replace(&mut self.now, after));
        self.field = None;
        true
    }

    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn undo_and_redo_visit_the_same_states() {
        let mut history = LabHistory::new(0);
        for state in 1..=5 {
            history.change(None, state);
        }
        for state in (0..5).rev() {
            assert!(history.undo());
            assert_eq!(*history.now(), state);
        }
        assert!(!history.undo());
        for state in 1..=5 {
            assert!(history.redo());
            assert_eq!(*history.now(), state);
        }
        assert!(!history.redo());
    }

    #[test]
    fn change_after_undo_clears_redo() {
        let mut history = LabHistory::new(0);
        history.change(None, 1);
        history.undo();
        history.change(None, 2);
        assert!(!history.can_redo());
        assert!(history.undo());
        assert_eq!(*history.now(), 0);
    }

    #[test]
    fn typing_in_one_field_is_one_undo_step() {
        let mut history = LabHistory::new("");
        history.change(Some("length"), "1");
        history.change(Some("length"), "12");
        history.change(Some("speed"), "12/5");
        history.rest();
        history.change(Some("speed"), "12/50");
        history.change(None, "12/50");
        let seen: Vec<_> = std::iter::from_fn(|| history.undo().then(|| *history.now())).collect();
        assert_eq!(seen, ["12/5", "12", ""]);
    }

    #[test]
    fn undo_history_is_bounded() {
        let mut history = LabHistory::new(0);
        for state in 1..=1000 {
            history.change(None, state);
        }
        let steps = std::iter::from_fn(|| history.undo().then_some(())).count();
        assert_eq!((steps, *history.now()), (MOST_STEPS, 1000 - MOST_STEPS));
    }
}
