//! Undo and redo over whole states.
//!
//! ```text
//! past … before ◀─ undo ─ now ─ redo ─▶ after … future      typing in one field is one step
//! ```
//!
//! Comes in: the next state and the field it came from. Goes out: the state now. Does not know what the state is.

/// The most steps kept.
const MOST_STEPS: usize = 200;

/// A state with the ones before and after it.
#[derive(Clone, Debug)]
pub struct LabHistory<T> {
    past: Vec<T>,
    now: T,
    future: Vec<T>,
    /// The field that the last change came from, while the person is still in it.
    field: Option<String>,
}

impl<T: Clone + PartialEq> LabHistory<T> {
    /// A history that begins at `now`.
    pub fn new(now: T) -> Self {
        Self { past: Vec::new(), now, future: Vec::new(), field: None }
    }

    /// The state now.
    pub fn now(&self) -> &T {
        &self.now
    }

    /// Goes on to `next`. Changes that follow each other from one `field` are one step; no field, a step each.
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

    /// The person left the field: what is typed next is another step.
    pub fn rest(&mut self) {
        self.field = None;
    }

    /// Back by a step. False where there is none.
    pub fn undo(&mut self) -> bool {
        let Some(before) = self.past.pop() else { return false };
        self.future.push(std::mem::replace(&mut self.now, before));
        self.field = None;
        true
    }

    /// On by a step that was undone. False where there is none.
    pub fn redo(&mut self) -> bool {
        let Some(after) = self.future.pop() else { return false };
        self.past.push(std::mem::replace(&mut self.now, after));
        self.field = None;
        true
    }

    /// Whether there is a step back.
    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    /// Whether there is a step on.
    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn back_and_on_meet_the_same_states() {
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
    fn a_change_after_undo_forgets_what_was_undone() {
        let mut history = LabHistory::new(0);
        history.change(None, 1);
        history.undo();
        history.change(None, 2);
        assert!(!history.can_redo());
        assert!(history.undo());
        assert_eq!(*history.now(), 0);
    }

    #[test]
    fn typing_in_one_field_is_one_step_until_it_is_left() {
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
    fn the_past_is_bounded() {
        let mut history = LabHistory::new(0);
        for state in 1..=1000 {
            history.change(None, state);
        }
        let steps = std::iter::from_fn(|| history.undo().then_some(())).count();
        assert_eq!((steps, *history.now()), (MOST_STEPS, 1000 - MOST_STEPS));
    }
}
