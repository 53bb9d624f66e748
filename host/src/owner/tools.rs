//! The tools of a job: the requested one, the wear of each, and the replacement of a worn tool during the
//! job.
//!
//! ```text
//! hole 17 │ counted with the leg │ life over? ─▶ next hole waits: up, spindle off ─▶ user ─▶ back ─▶ hole 18
//! ```
//!
//! A hole is counted in the same record that completes it, so it is never lost or counted twice. If the
//! user confirms the tool after a request to replace it, it counts as new.

use super::Owner;
use super::moves::Doing;
use super::work::Work;
use crate::journal::Record;
use annulus_core::control::{Event, State};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::job::worn::Wear;
use annulus_core::machine::{RackTool, ToolChange, ToolWear, tool_of};
use annulus_core::wire::ToolsReport;

impl Owner {
    /// The tool in the spindle, from the machine's list: the one that a job last inserted.
    fn tool(&self) -> Option<&RackTool> {
        self.machine.rack.iter().find(|tool| Some(tool.number) == self.tool_in)
    }

    /// The machine's tool for the program's tool `bit`.
    pub(super) fn tool_of_bit(&self, bit: u32) -> Option<&RackTool> {
        let bit = self.work.as_ref()?.job.program.bits.get(bit as usize)?;
        tool_of(&self.machine.rack, bit, &self.machine.name, &self.wear)
    }

    fn wear_of(&self, tool: &RackTool) -> ToolWear {
        ToolWear::of(&self.wear, &self.machine.name, tool)
    }

    fn is_worn(&self, tool: &RackTool) -> bool {
        self.wear_of(tool).is_over(tool.life)
    }

    /// Counts the wear by leg `leg`. Returns the tool's new total.
    pub(super) fn count_wear(&mut self, leg: usize) -> Option<ToolWear> {
        let (_, more) = *self.work.as_ref()?.wears.get(leg)?;
        let wear = self.wear_of(self.tool().filter(|_| !more.is_nothing())?).plus(more);
        wear.clone().keep(&mut self.wear);
        Some(wear)
    }

    /// Counts a hole drilled by a queue, for the tool that a job last inserted. Without one the tool is
    /// unknown, and nothing is counted.
    pub(super) fn count_stroke(&mut self) {
        let Some(tool) = self.tool().filter(|tool| !tool.wears_by_way()) else { return };
        let wear = self.wear_of(tool).plus(Wear { hits: 1, milled_um: 0 });
        wear.clone().keep(&mut self.wear);
        self.outside.record(Record::Wear(wear));
    }

    /// Tool `bit` is in the spindle. If it is `new` and replaces a worn one, its wear starts at zero.
    pub(super) fn tool_is_in(&mut self, bit: u32, new: bool) {
        let tool = self.tool_of_bit(bit).cloned();
        self.tool_in = tool.as_ref().map(|tool| tool.number);
        if let Some(worn) = tool.filter(|tool| new && self.is_worn(tool)) {
            self.forget_wear(&worn);
        }
    }

    fn forget_wear(&mut self, tool: &RackTool) {
        let wear = ToolWear::new(&self.machine.name, tool);
        wear.clone().keep(&mut self.wear);
        self.outside.record(Record::Wear(wear));
    }

    pub(super) fn new_tool(&mut self, number: u32) -> Result<(), Diagnostic> {
        let tool = self.machine.rack.iter().find(|tool| tool.number == number).cloned();
        let tool = tool.ok_or_else(|| error!("control.no_such_tool", number = number))?;
        self.forget_wear(&tool);
        Ok(())
    }

    pub(super) fn wants_new_tool(&self) -> bool {
        let wears = |work: &Work| work.is_at_start() && !work.wear().is_nothing();
        self.work.as_ref().is_some_and(wears) && self.tool().is_some_and(|tool| self.is_worn(tool))
    }

    /// Asks for a new tool before the next leg, if needed: lifts the tool and stops the spindle first.
    /// Returns `true` if it asked.
    pub(super) fn asks_for_new_tool(&mut self) -> bool {
        if !self.wants_new_tool() {
            return false;
        }
        let Some(work) = &mut self.work else { return false };
        if self.machine.tool_change == ToolChange::Unattended {
            let bit = work.bit.unwrap_or(0);
            self.put_in(bit, true);
            return false;
        }
        work.is_worn = true;
        let bit = work.bit.unwrap_or(0);
        if self.machine.is_changed_by_hand() {
            if let Err(why) = self.change_first(bit, true) {
                self.fails(why, self.session.trust);
            }
            return true;
        }
        let segments = self.up_and_off(true);
        self.give(Doing::ToChange, segments);
        true
    }

    /// The tool is in: continues the leg.
    pub(crate) fn rest_of_leg(&mut self) {
        if self.back_to_job() {
            return;
        }
        let spindle = self.spindle_up();
        let Some(work) = &mut self.work else { return };
        if std::mem::take(&mut work.is_worn) {
            let bit = work.bit.unwrap_or(0);
            self.worn_is_replaced(bit);
            if let Err(why) = self.approach() {
                self.fails(why, self.session.trust);
            }
            return;
        }
        if std::mem::take(&mut work.confirm_bit) {
            let bit = work.bit.unwrap_or(0);
            self.put_in(bit, true);
            return self.give(Doing::Approach, spindle);
        }
        if let Some(bit) = work.awaited() {
            work.bit = Some(bit);
            work.given += 1;
            self.put_in(bit, true);
        }
        self.leg(spindle);
    }

    /// Tool `bit` of the program is in the spindles; `is_new` if it may be another one of the same kind.
    pub(super) fn put_in(&mut self, bit: u32, is_new: bool) {
        // The machine fetched the tool from its slot, so it is not new.
        self.tool_is_in(bit, is_new && !self.machine.has_magazine());
        let bits = self.work.as_ref().map(|work| &work.job.program.bits);
        let Some(bit) = bits.and_then(|bits| bits.get(bit as usize)).cloned() else { return };
        if self.machine.has_magazine() {
            // The pins fetched it themselves.
            self.in_spindle = Some(bit);
        } else if is_new || self.in_spindle.as_ref() != Some(&bit) {
            self.put_in_by_hand();
            self.executor.bit(bit.clone());
            self.in_spindle = Some(bit);
        }
    }

    /// The event for a tool request: the user inserts it, or the machine fetches it.
    pub(super) fn bit_wanted(&self) -> Event {
        if self.machine.has_magazine() { Event::ChangeWanted } else { Event::BitWanted }
    }

    /// The user replaced the worn tool `bit`; in a magazine it returns to the same slot.
    pub(super) fn worn_is_replaced(&mut self, bit: u32) {
        self.tool_is_in(bit, true);
        let bits = self.work.as_ref().map(|work| &work.job.program.bits);
        if let Some(new) = bits.and_then(|bits| bits.get(bit as usize)).cloned() {
            if self.machine.has_magazine() {
                self.executor.bit(new);
            } else {
                self.put_in(bit, true);
            }
        }
    }

    pub(super) fn tools_report(&self) -> ToolsReport {
        let work = self.work.as_ref();
        let waits = self.session.state == State::ToolChange || self.session.in_change;
        let asked = work.filter(|_| waits);
        let of_work = |work: &Work| work.asked.as_ref().map(|asked| asked.bit).or(work.awaited());
        let bit = asked.and_then(|work| of_work(work).or(work.bit).or(Some(0)));
        ToolsReport {
            wear: self.wear.iter().filter(|wear| wear.machine == self.machine.name).cloned().collect(),
            in_spindle: work.and(self.tool_in),
            wanted: bit.and_then(|bit| self.tool_of_bit(bit)).map(|tool| tool.number),
        }
    }
}
