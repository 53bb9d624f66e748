//! The tools of a controller's jobs, as the page has them: what is written down with what is done of the job, and a person's word (C3).
//!
//! Comes in: a person's word. Goes out: what tools have done, which is asked for. Does not know how they are counted.

use super::station::Station;
use crate::files::Files;
use annulus_core::control::State;
use annulus_core::controller::EngineAsk;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::ToolWear;
use annulus_core::wire::{Tell, ToolsReport};

impl<F: Files> Station<F> {
    /// What tools have done, with the job in work as far as it is.
    pub(super) fn wear_now(&self) -> Vec<ToolWear> {
        let tools = self.attended.tools().filter(|_| self.work.is_some());
        tools.map_or_else(|| self.ledger.wear(), |tools| tools.wear()).to_vec()
    }

    /// A new tool is in under this number.
    pub(super) fn new_tool(&mut self, number: u32) -> Result<(), Diagnostic> {
        let why = || Diagnostic::error("control.no_such_tool").with("number", number);
        let tool = self.machine.rack.iter().find(|tool| tool.number == number).ok_or_else(why)?;
        let new = ToolWear::new(&self.machine.name, tool);
        self.ledger.keep_wear(new.clone())?;
        self.attended.set_wear(new);
        // It is as long as it is: it is touched off before it cuts.
        self.engine_asked(EngineAsk::NewBit)?;
        self.tell_tools();
        Ok(())
    }

    /// What everybody sees of the tools.
    pub(super) fn tools_report(&self) -> ToolsReport {
        let known = self.ledger.wear();
        let asks = self.work.is_some() && self.state() == State::ToolChange;
        ToolsReport {
            wear: known.iter().filter(|wear| wear.machine == self.machine.name).cloned().collect(),
            in_spindle: None,
            wanted: self.attended.tools().filter(|_| asks).and_then(|tools| tools.wanted()),
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
