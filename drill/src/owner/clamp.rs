//! The clamp of a machine with a magazine, by a person's hand (C5): open where a change stopped, or where a tool that is worn waits for a
//! new one. Whoever opens it has the tool in the hand.
//!
//! ```text
//! rest, spindle still ─ OpenClamp ─▶ nobody knows the tool: on the disk ─▶ clamp opens ─ ToolSeen ─▶ closes where a tool is in
//! ```
//!
//! Comes in: asks of a person at the machine. Goes out: the clamp's output, records, tells. No axis moves by them.

use super::moves::{Doing, rest};
use super::{Owner, diagnostic};
use annulus_core::control::{Event, State};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::magazine::{ChangeStep, Held, Seen, ToolStock};
use annulus_core::pins::SpindleState;
use annulus_core::steps::{Stage, Switching};
use annulus_core::wire::Tell;
use std::time::Duration;

/// What is remembered of it.
#[derive(Debug, Default)]
pub(crate) struct ClampByHand {
    /// It opens when the record with this number is on the disk.
    opens_with: Option<u32>,
    /// When the spindle was seen turning last, by the clock outside.
    turned: Option<Duration>,
}

impl ClampByHand {
    /// It does not open any more.
    pub(super) fn stays(&mut self) {
        self.opens_with = None;
    }
}

impl Owner {
    /// Remembers when the spindle turned.
    pub(super) fn look_at_spindle(&mut self) {
        if self.machine.has_magazine() && self.executor.shared.glimpse().rpm > 0 {
            self.tools.clamp.turned = Some(self.now());
        }
    }

    /// Whether the spindle stands, by its time to come to rest, and by what it tells where it tells of itself.
    fn spindle_stands(&self) -> bool {
        let wait = Duration::from_secs_f64(self.machine.magazine.spin_down_ms.max(0.0) / 1e3 / self.speed);
        let rests = |turned: Duration| self.now().saturating_sub(turned) >= wait;
        let glimpse = self.executor.shared.glimpse();
        let tells_of_turns = matches!(glimpse.spindle, SpindleState::Off { rpm } if rpm > 0);
        glimpse.rpm == 0 && !tells_of_turns && self.tools.clamp.turned.is_none_or(rests)
    }

    /// Whether a job rests because the tool in the clamp is worn, and a person puts in a new one.
    pub(super) fn waits_for_new_tool(&self) -> bool {
        let is_worn = self.work.as_ref().is_some_and(|work| work.is_worn);
        let rests = self.session.state == State::ToolChange && !self.session.moving;
        self.machine.has_magazine() && is_worn && rests
    }

    fn may_open_clamp(&self) -> Result<(), Diagnostic> {
        if !self.machine.has_magazine() {
            return Err(diagnostic("magazine.none"));
        }
        match self.session.state {
            State::Alarm => return Err(diagnostic("control.alarm_unread")),
            State::Ready | State::NotHomed if !self.session.moving => {
                if self.tools.stock.change.is_none() {
                    return Err(diagnostic("magazine.nothing_stopped"));
                }
            }
            _ if self.waits_for_new_tool() => {}
            _ => return Err(diagnostic("control.busy")),
        }
        if self.spindle_stands() { Ok(()) } else { Err(diagnostic("magazine.spindle_turns")) }
    }

    /// Opens the clamp, once it is on the disk that nobody knows what the spindle holds.
    pub(super) fn open_clamp(&mut self) -> Result<(), Diagnostic> {
        self.may_open_clamp()?;
        let mut stock = self.tools.stock.clone();
        stock.opens_by_hand()?;
        if !self.waits_for_new_tool() {
            self.try_event(Event::Disarmed { position_lost: false })?;
            (self.prepared, self.tool_in) = (None, None);
        }
        self.tools.stock = stock;
        self.tools.clamp.opens_with = Some(self.keep_stock());
        Ok(())
    }

    /// The record of what lies where with this number is on the disk.
    pub(super) fn clamp_kept(&mut self, number: u32) {
        let opens = self.tools.clamp.opens_with.take_if(|wanted| *wanted == number).is_some();
        if opens && self.may_open_clamp().is_ok() {
            let in_hand = ToolStock { spindle: Held::Nothing, change: None, ..self.tools.stock.clone() };
            self.move_clamp(true, in_hand);
        }
    }

    /// The clamp moves; whoever has a model of everything is told first how it lies then.
    fn move_clamp(&mut self, opens: bool, lies: ToolStock) {
        let Some(place) = self.machine.output_place(&self.machine.magazine.clamp) else { return };
        self.executor.stock(lies);
        self.executor.output(place, opens);
        let ticks = self.machine.magazine.clamp_ticks();
        let moves = rest(Stage::Dwell, Switching::None, ticks, self.position);
        self.give(Doing::Clamp { opens }, vec![moves]);
    }

    /// A person holds the new tool in the clamp: it closes.
    pub(super) fn close_clamp(&mut self, seen: Seen) -> Result<(), Diagnostic> {
        if seen != Seen::InSpindle {
            return Err(diagnostic("control.busy"));
        }
        let mut stock = self.tools.stock.clone();
        stock.seen(seen)?;
        self.tools.clamp.stays();
        self.move_clamp(false, stock);
        Ok(())
    }

    /// The clamp had its time. A new tool is in where the sensors do not say otherwise.
    pub(super) fn clamp_moved(&mut self, opens: bool) {
        if opens || !self.waits_for_new_tool() {
            return;
        }
        let step = ChangeStep::CheckTaken;
        if let Some(wrong) = step.after().wrong(self.machine.told_inputs(), self.tools.inputs) {
            return self.tell(Tell::Refused { why: step.alarm(wrong) });
        }
        if self.tools.stock.seen(Seen::InSpindle).is_ok() {
            self.tools.stock.change = None;
            self.keep_stock();
        }
    }

    /// A person says that the tool is in. Refused where the clamp was opened for it and is not closed.
    pub(super) fn tool_changed(&mut self) -> Result<(), Diagnostic> {
        if self.waits_for_new_tool() && self.tools.stock.spindle == Held::Unknown {
            return Err(diagnostic("magazine.clamp_by_hand"));
        }
        self.try_event(Event::ToolChanged)
    }
}
