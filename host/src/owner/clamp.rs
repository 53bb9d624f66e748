//! Opens the clamp for the user: after an interrupted tool change, or to replace a worn tool. The tool
//! drops when the clamp opens, so the user must hold it. No axis moves.
//!
//! ```text
//! stopped, spindle off ─ OpenClamp ─▶ "spindle unknown" durable ─▶ clamp opens ─ ToolSeen ─▶ closes
//! ```

use super::Owner;
use super::moves::{Doing, rest};
use annulus_core::control::{Event, State};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::magazine::{ChangeStep, Held, Seen, ToolStock};
use annulus_core::pins::SpindleState;
use annulus_core::steps::{Stage, Switching};
use annulus_core::wire::Tell;
use std::time::Duration;

#[derive(Debug, Default)]
pub(crate) struct ClampByHand {
    /// The clamp opens when the record with this number is durable.
    opens_with: Option<u32>,
    /// When the spindle last turned, by the host's clock.
    turned: Option<Duration>,
}

impl ClampByHand {
    pub(super) fn stays(&mut self) {
        self.opens_with = None;
    }
}

impl Owner {
    pub(super) fn look_at_spindle(&mut self) {
        if self.machine.has_magazine() && self.executor.shared.glimpse().rpm > 0 {
            self.tools.clamp.turned = Some(self.now());
        }
    }

    /// Returns `true` if the spindle has stopped: its run-down time has passed, and its own report, if any,
    /// agrees.
    fn spindle_stands(&self) -> bool {
        let wait = Duration::from_secs_f64(self.machine.magazine.spin_down_ms.max(0.0) / 1e3 / self.speed);
        let rests = |turned: Duration| self.now().saturating_sub(turned) >= wait;
        let glimpse = self.executor.shared.glimpse();
        let tells_of_turns = matches!(glimpse.spindle, SpindleState::Off { rpm } if rpm > 0);
        glimpse.rpm == 0 && !tells_of_turns && self.tools.clamp.turned.is_none_or(rests)
    }

    pub(super) fn waits_for_new_tool(&self) -> bool {
        let is_worn = self.work.as_ref().is_some_and(|work| work.is_worn);
        let rests = self.session.state == State::ToolChange && !self.session.moving;
        self.machine.has_magazine() && is_worn && rests
    }

    fn may_open_clamp(&self) -> Result<(), Diagnostic> {
        if !self.machine.has_magazine() {
            return Err(error!("magazine.none"));
        }
        match self.session.state {
            State::Alarm => return Err(error!("control.alarm_unread")),
            State::Ready | State::NotHomed if !self.session.moving => {
                if self.tools.stock.change.is_none() {
                    return Err(error!("magazine.nothing_stopped"));
                }
            }
            _ if self.waits_for_new_tool() => {}
            _ => return Err(error!("control.busy")),
        }
        if self.spindle_stands() { Ok(()) } else { Err(error!("magazine.spindle_turns")) }
    }

    /// Opens the clamp once the journal records that the spindle's contents are unknown.
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

    pub(super) fn clamp_kept(&mut self, number: u32) {
        let opens = self.tools.clamp.opens_with.take_if(|wanted| *wanted == number).is_some();
        if opens && self.may_open_clamp().is_ok() {
            let in_hand = ToolStock { spindle: Held::Nothing, change: None, ..self.tools.stock.clone() };
            self.move_clamp(true, in_hand);
        }
    }

    /// Moves the clamp. Simulated pins get the new contents first.
    fn move_clamp(&mut self, opens: bool, lies: ToolStock) {
        let Some(place) = self.machine.output_place(&self.machine.magazine.clamp) else { return };
        self.executor.stock(lies);
        self.executor.output(place, opens);
        let ticks = self.machine.magazine.clamp_ticks();
        let moves = rest(Stage::Dwell, Switching::None, ticks, self.position);
        self.give(Doing::Clamp { opens }, vec![moves]);
    }

    /// The user holds the new tool in the clamp: close it.
    pub(super) fn close_clamp(&mut self, seen: Seen) -> Result<(), Diagnostic> {
        if seen != Seen::InSpindle {
            return Err(error!("control.busy"));
        }
        let mut stock = self.tools.stock.clone();
        stock.seen(seen)?;
        self.tools.clamp.stays();
        self.move_clamp(false, stock);
        Ok(())
    }

    /// The clamp's time has passed. The new tool is in, unless a sensor contradicts.
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

    /// The user confirms that the tool is in. Refused while the opened clamp is not closed.
    pub(super) fn tool_changed(&mut self) -> Result<(), Diagnostic> {
        if self.waits_for_new_tool() && self.tools.stock.spindle == Held::Unknown {
            return Err(error!("magazine.clamp_by_hand"));
        }
        self.may_go_on()?;
        self.try_event(Event::ToolChanged)
    }
}
