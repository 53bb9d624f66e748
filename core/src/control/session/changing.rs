//! Moves during a manual tool change: they start in the change and return to it.
//!
//! ```text
//! ToolChange ─ jog, probe ─▶ Jogging ─┬─ arrived ─▶ ToolChange
//!            ─ park ───────▶ Parking ─┘
//!                              └ Stop or failure ─▶ the job ends, as from the change
//! ```

use super::super::{Action, Ending, Event, State};
use super::{Session, refuse};
use crate::code;

impl Session {
    /// True during a manual tool change, including the user's moves in it.
    pub fn changes_by_hand(&self) -> bool {
        self.in_change || (self.state == State::ToolChange && !self.moving)
    }

    pub(super) fn while_changing(&mut self, ask: &Event) -> Vec<Action> {
        let (state, action) = match *ask {
            Event::Jog { axis, distance_um } => (State::Jogging, Action::Jog { axis, distance_um }),
            Event::Touch => (State::Jogging, Action::Queue),
            Event::Park => (State::Parking, Action::Park),
            Event::Home | Event::SetZero { .. } | Event::UndoZero => {
                return refuse(code!("control.in_change"));
            }
            _ => return refuse(code!("control.busy")),
        };
        (self.state, self.in_change) = (state, true);
        vec![action]
    }

    /// Reports of a move that started in the change.
    pub(super) fn reported_in_change(&mut self, report: &Event) -> Vec<Action> {
        match report {
            Event::QueueDone => vec![Action::Touched],
            Event::Arrived => {
                (self.state, self.in_change) = (State::ToolChange, false);
                Vec::new()
            }
            _ => Vec::new(),
        }
    }

    /// STOP in these moves ends the job, not only the move.
    pub(super) fn stop_in_change(&mut self) {
        if std::mem::take(&mut self.in_change) {
            self.ending = Some(Ending::Stopped);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::Trust;
    use super::super::step;
    use super::*;
    use crate::diagnostic::Diagnostic;

    fn changing() -> Session {
        Session { state: State::ToolChange, trust: Trust::Trusted, ..Session::default() }
    }

    #[test]
    fn moves_during_a_tool_change_return_to_it() {
        let jog = Event::Jog { axis: 2, distance_um: -100 };
        let rows = [
            (jog, State::Jogging, Action::Jog { axis: 2, distance_um: -100 }),
            (Event::Touch, State::Jogging, Action::Queue),
            (Event::Park, State::Parking, Action::Park),
        ];
        for (ask, state, action) in rows {
            let (moves, actions) = step(&changing(), ask.clone());
            assert_eq!((moves.state, moves.moving, actions), (state, true, vec![action]), "{ask:?}");
            assert!(moves.has_job() && moves.changes_by_hand());
            let (back, actions) = step(&moves, Event::Arrived);
            assert_eq!((back.state, back.moving, actions), (State::ToolChange, false, vec![]), "{ask:?}");
            assert_eq!(back, changing());
            // STOP ends the job; so does a failure.
            let (stopping, actions) = step(&moves, Event::Stop { now_ms: 0 });
            assert_eq!((stopping.state, actions), (State::Stopping, vec![Action::Brake]));
            let (lifting, actions) = step(&stopping, Event::Rested);
            assert_eq!(actions, [Action::MakeSafe { lift: true }]);
            let (rests, actions) = step(&lifting, Event::Safe);
            assert_eq!((rests.state, actions), (State::Ready, vec![Action::End(Ending::Stopped)]));
            let why = Diagnostic::error("control.limit");
            let (alarm, actions) = step(&moves, Event::Failed { alarm: why, left: Trust::Suspect });
            assert_eq!((alarm.state, alarm.changes_by_hand()), (State::Alarm, false));
            assert!(actions.contains(&Action::End(Ending::Alarm)), "{actions:?}");
        }
        let (touched, _) = step(&changing(), Event::Touch);
        let (lifts, actions) = step(&touched, Event::QueueDone);
        assert_eq!((lifts.state, lifts.moving, actions), (State::Jogging, true, vec![Action::Touched]));
        assert_eq!(step(&lifts, Event::Arrived).0, changing());
    }

    #[test]
    fn tool_change_refuses_homing_and_zero() {
        let rows = [
            (Event::Home, "control.in_change"),
            (Event::SetZero { place_steps: [0; 2] }, "control.in_change"),
            (Event::UndoZero, "control.in_change"),
            (Event::Queue, "control.busy"),
        ];
        for (ask, code) in rows {
            let (after, actions) = step(&changing(), ask);
            assert_eq!((after, actions), (changing(), refuse(code)));
        }
        // Outside a change there is no tool to probe with.
        let ready = Session { state: State::Ready, ..changing() };
        assert_eq!(step(&ready, Event::Touch).1, refuse("control.nothing_to_do"));
    }
}
