//! Tool wear on a controller: saved with the job's progress, corrected by the user, reported to the page.

use super::station::Station;
use crate::files::Files;
use annulus_core::control::State;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::grbl::EngineAsk;
use annulus_core::machine::ToolWear;
use annulus_core::wire::{Tell, ToolsReport};

impl<F: Files> Station<F> {
    /// Wear of all tools, including the running job.
    pub(super) fn wear_now(&self) -> Vec<ToolWear> {
        let counts = self.work.is_some() || self.is_for_command();
        let tools = self.attended.tools().filter(|_| counts);
        tools.map_or_else(|| self.ledger.wear(), |tools| tools.wear()).to_vec()
    }

    pub(super) fn new_tool(&mut self, number: u32) -> Result<(), Diagnostic> {
        let why = || error!("control.no_such_tool", number = number);
        let tool = self.machine.rack.iter().find(|tool| tool.number == number).ok_or_else(why)?;
        let new = ToolWear::new(&self.machine.name, tool);
        self.ledger.keep_wear(new.clone())?;
        self.attended.set_wear(new);
        // Its length is unknown: it must be touched off before it cuts.
        self.engine_asked(EngineAsk::NewBit)?;
        self.tell_tools();
        Ok(())
    }

    pub(super) fn tools_report(&self) -> ToolsReport {
        let known = self.ledger.wear();
        let asks = self.work.is_some() && self.state() == State::ToolChange;
        ToolsReport {
            wear: known.iter().filter(|wear| wear.machine == self.machine.name).cloned().collect(),
            in_spindle: None,
            wanted: self.attended.tools().filter(|_| asks).and_then(|tools| tools.wanted()),
        }
    }

    pub(super) fn tell_tools(&mut self) {
        let report = self.tools_report();
        if report != self.tools_told {
            self.tools_told = report.clone();
            self.tell(Tell::Tools(report));
        }
    }
}
