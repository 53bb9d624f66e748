//! The tools in work: the one that a leg waits for, what each has done, and a new one in mid-job where the life of the one before is over
//! (C3).
//!
//! ```text
//! hole 17 │ counted with the leg │ life over? ─▶ next hole is not begun: up, spindle off ─▶ a person ─▶ there again, on ─▶ hole 18
//! ```
//!
//! A hole is counted in the record that says that it is done, so a hit is never lost and never counted twice. Whoever is asked for
//! a tool whose life is over and says that it is in, has put in a new one.
//!
//! Comes in: legs that are done, a person's word. Goes out: what tools have done, what the executor is to do. Does not know how a tool
//! gets into the spindle.

use super::moves::Doing;
use super::work::Work;
use super::{Owner, diagnostic};
use crate::journal::Record;
use annulus_core::control::{Event, State};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::worn::Wear;
use annulus_core::machine::{RackTool, ToolChange, ToolWear, tool_of};
use annulus_core::wire::ToolsReport;

impl Owner {
    /// The tool of the rack in the spindle: the one that a job put in last.
    fn tool(&self) -> Option<&RackTool> {
        self.machine.rack.iter().find(|tool| Some(tool.number) == self.tool_in)
    }

    /// The tool of the rack that bit `bit` of the program is.
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

    /// Counts what leg `leg` wore its tool by, and gives what that has done now.
    pub(super) fn count_wear(&mut self, leg: usize) -> Option<ToolWear> {
        let (_, more) = *self.work.as_ref()?.wears.get(leg)?;
        let wear = self.wear_of(self.tool().filter(|_| !more.is_nothing())?).plus(more);
        wear.clone().keep(&mut self.wear);
        Some(wear)
    }

    /// Counts a hole that a queue drilled, with the tool that a job put in before it; where none did, nobody knows with which.
    pub(super) fn count_stroke(&mut self) {
        let Some(tool) = self.tool().filter(|tool| !tool.wears_by_way()) else { return };
        let wear = self.wear_of(tool).plus(Wear { hits: 1, milled_um: 0 });
        wear.clone().keep(&mut self.wear);
        self.outside.record(Record::Wear(wear));
    }

    /// Bit `bit` is in the spindle: which tool of the rack that is. A `new` one in the place of one that was worn has done nothing.
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

    /// A new tool was put in under this number: it has done nothing.
    pub(super) fn new_tool(&mut self, number: u32) -> Result<(), Diagnostic> {
        let tool = self.machine.rack.iter().find(|tool| tool.number == number).cloned();
        let tool = tool.ok_or_else(|| diagnostic("control.no_such_tool").with("number", number))?;
        self.forget_wear(&tool);
        Ok(())
    }

    /// Whether the leg to come would wear a tool whose life is over.
    pub(super) fn wants_new_tool(&self) -> bool {
        let wears = |work: &Work| work.is_at_start() && !work.wear().is_nothing();
        self.work.as_ref().is_some_and(wears) && self.tool().is_some_and(|tool| self.is_worn(tool))
    }

    /// Asks for a new tool before the leg to come, where it needs one: up and spindle off, from wherever the tip is. Whether it did.
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
        let segments = self.up_and_off(true);
        self.give(Doing::ToChange, segments);
        true
    }

    /// The bit is in: the leg goes on after it.
    pub(crate) fn rest_of_leg(&mut self) {
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

    /// Bit `bit` of the program is in the spindles: a new one, or perhaps still the same.
    pub(super) fn put_in(&mut self, bit: u32, is_new: bool) {
        // What the machine fetches itself is what lay there.
        self.tool_is_in(bit, is_new && !self.machine.has_magazine());
        let bits = self.work.as_ref().map(|work| &work.job.program.bits);
        let Some(bit) = bits.and_then(|bits| bits.get(bit as usize)).cloned() else { return };
        if self.machine.has_magazine() {
            // It came by itself.
            self.in_spindle = Some(bit);
        } else if is_new || self.in_spindle.as_ref() != Some(&bit) {
            self.put_in_by_hand();
            self.executor.bit(bit.clone());
            self.in_spindle = Some(bit);
        }
    }

    /// What it is when a bit is waited for: a person puts it in, or the machine fetches it.
    pub(super) fn bit_wanted(&self) -> Event {
        if self.machine.has_magazine() { Event::ChangeWanted } else { Event::BitWanted }
    }

    /// A person put a new tool in the place of bit `bit`, whose life is over; in a magazine it goes back to the same place.
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

    /// What everybody sees of the tools.
    pub(super) fn tools_report(&self) -> ToolsReport {
        let work = self.work.as_ref();
        let asked = work.filter(|_| self.session.state == State::ToolChange);
        let bit = asked.and_then(|work| work.awaited().or(work.bit).or(Some(0)));
        ToolsReport {
            wear: self.wear.iter().filter(|wear| wear.machine == self.machine.name).cloned().collect(),
            in_spindle: work.and(self.tool_in),
            wanted: bit.and_then(|bit| self.tool_of_bit(bit)).map(|tool| tool.number),
        }
    }
}
