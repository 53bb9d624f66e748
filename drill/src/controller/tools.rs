//! The tools of a controller's jobs: what each has done, written down with what is done of the job (C3).
//!
//! Comes in: how far the job is, a person's word. Goes out: what tools have done. A tool whose life ends in mid-job is told before the
//! next job and at the next change: a controller is not sent anywhere between two holes of its text.

use super::attended::AttendedJob;
use super::order::Order;
use super::station::Station;
use crate::files::Files;
use crate::prepare::worn_tools;
use annulus_core::control::State;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{RackTool, ToolWear, tool_of};
use annulus_core::wire::{PreflightRow, RowVerdict, Tell, ToolsReport};

impl<F: Files> Station<F> {
    /// The tool of the rack that bit `bit` of the job in work is.
    fn tool_of_bit(&self, bit: u32, known: &[ToolWear]) -> Option<&RackTool> {
        let bit = self.work.as_ref()?.order.program.bits.get(bit as usize)?;
        tool_of(&self.machine.rack, bit, &self.machine.name, known)
    }

    /// What tools have done once the job in work is as far as `entry` says.
    pub(super) fn wear_of(&self, entry: &AttendedJob) -> Vec<ToolWear> {
        let mut known = self.ledger.wear().to_vec();
        let before = self.ledger.entry();
        let goes_on = self.bringing.is_none() && before.key == entry.key;
        let Some(work) = self.work.as_ref().filter(|_| goes_on) else { return known };
        let legs = work.order.leg(before.done)..work.order.leg(entry.done);
        let wears = work.wears.get(legs).unwrap_or_default().iter().filter(|(_, more)| !more.is_nothing());
        for (bit, more) in wears {
            let tool = self.tool_of_bit(*bit, &known);
            let wear = tool.map(|tool| ToolWear::of(&known, &self.machine.name, tool).plus(*more));
            if let Some(wear) = wear {
                wear.keep(&mut known);
            }
        }
        known
    }

    /// The tools of `order` that are worn before leg `leg` is begun.
    pub(super) fn worn(&self, order: &Order, leg: usize) -> Vec<PreflightRow> {
        let rows = worn_tools(&order.program, &self.machine, (leg, self.ledger.wear()));
        rows.into_iter().filter(|row| row.verdict == RowVerdict::Warn).collect()
    }

    /// A tool is asked for: that of the section to come.
    pub(super) fn tool_asked(&mut self) {
        let done = self.attended.entry().done;
        if let Some(work) = &mut self.work {
            work.asked_bit = work.wears.get(work.order.leg(done)).map(|(bit, _)| *bit);
        }
    }

    /// The tool that was asked for is in: a new one, where the one of that number was worn.
    pub(super) fn tool_is_in(&mut self) -> Result<(), Diagnostic> {
        let bit = self.work.as_mut().and_then(|work| work.asked_bit.take());
        let known = self.ledger.wear();
        let tool = bit.and_then(|bit| self.tool_of_bit(bit, known));
        let worn = tool.filter(|tool| ToolWear::of(known, &self.machine.name, tool).is_over(tool.life));
        worn.map(|tool| tool.number).map_or(Ok(()), |number| self.new_tool(number))
    }

    /// A new tool is in under this number.
    pub(super) fn new_tool(&mut self, number: u32) -> Result<(), Diagnostic> {
        let why = || Diagnostic::error("control.no_such_tool").with("number", number);
        let tool = self.machine.rack.iter().find(|tool| tool.number == number).ok_or_else(why)?;
        self.ledger.keep_wear(ToolWear::new(&self.machine.name, tool))?;
        self.tell_tools();
        Ok(())
    }

    /// What everybody sees of the tools.
    pub(super) fn tools_report(&self) -> ToolsReport {
        let known = self.ledger.wear();
        let asked = self.work.as_ref().filter(|_| self.state() == State::ToolChange);
        let wanted = asked.and_then(|work| work.asked_bit).and_then(|bit| self.tool_of_bit(bit, known));
        ToolsReport {
            wear: known.iter().filter(|wear| wear.machine == self.machine.name).cloned().collect(),
            in_spindle: None,
            wanted: wanted.map(|tool| tool.number),
        }
    }

    /// Tells it, where it is another one.
    pub(super) fn tell_tools(&mut self) {
        let report = self.tools_report();
        if report != self.tools_told {
            self.tools_told = report.clone();
            self.line.tell(&Tell::Tools(report));
        }
    }
}
