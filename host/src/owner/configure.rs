//! Changes settings while the drill is stopped: saves them, applies them, and rebuilds the executor if it
//! depends on them.

use super::Owner;
use super::moves::ruler;
use crate::journal::Record;
use annulus_core::control::{Action, Event, step};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::machine::{self, Output, Steps, Value, is_in_file_only};
use annulus_core::virtual_drill::{VirtualDrill, faults};
use std::sync::Arc;

impl Owner {
    pub(super) fn configure(&mut self, changes: &[(String, Value)]) -> Result<(), Diagnostic> {
        // Only the machine file may choose the hardware; no request may change it.
        let fixed = |key: &str| is_in_file_only(key) && !self.outside.may_rewire(key);
        if let Some((key, _)) = changes.iter().find(|(key, _)| fixed(key)) {
            return Err(error!("control.in_file_only", key = key));
        }
        let changed = machine::apply(&self.machine, changes)
            .map_err(|refusals| refusals.into_iter().next().unwrap_or_else(|| error!("control.busy")))?;
        let wired = machine::settings().any(|setting| {
            setting.is_built_from() && setting.value(&self.machine) != setting.value(&changed)
        });
        let moved =
            changed.output == Output::Virtual && !VirtualDrill::is_the_same_for(&self.machine, &changed);
        let rebuilt = wired || moved;
        if let [Action::Refuse(why)] =
            step(&self.session, Event::Disarmed { position_lost: rebuilt }).1.as_slice()
        {
            return Err(why.clone());
        }
        self.outside.keep_settings(&changed)?;
        self.try_event(Event::Disarmed { position_lost: rebuilt })?;
        if ruler(&self.machine) != ruler(&changed) {
            // The work zero was counted in the old steps.
            self.session.zeros.clear();
            self.outside.record(Record::Zero(None));
        }
        if self.machine.process.surface != changed.process.surface {
            // The height was typed, not touched: the tool that it is valid for is unknown.
            self.known = Default::default();
        }
        self.machine = changed;
        (self.prepared, self.lab) = (None, None);
        self.lock_outputs();
        if rebuilt {
            self.renew_executor()?;
        }
        self.tell(self.machine_tell());
        self.queue_greeting().into_iter().for_each(|tell| self.tell(tell));
        self.tell(self.outputs_tell());
        self.tell(self.surface_tell());
        if self.machine.has_magazine() {
            self.tell(self.magazine_tell());
        }
        Ok(())
    }

    /// Rebuilds the virtual drill with exactly these faults.
    pub(super) fn provoke(&mut self, faults: &[String]) -> Result<(), Diagnostic> {
        if self.machine.output != Output::Virtual {
            return Err(error!("fault.of_virtual_drill"));
        }
        let read = faults::read(faults.iter().map(String::as_str))?;
        self.try_event(Event::Disarmed { position_lost: true })?;
        self.lock_outputs();
        self.hands.faults = read;
        self.renew_executor()?;
        self.tell(self.machine_tell());
        Ok(())
    }

    /// Replaces the executor with one for the current machine. The new one has no position.
    pub(super) fn renew_executor(&mut self) -> Result<(), Diagnostic> {
        let shared = Arc::clone(&self.executor.shared);
        self.executor.finish();
        let measured = self.timing.as_ref().map(|timing| timing.lateness.clone());
        let (executor, timing) = self.hands.executor(&self.machine, measured, shared, &*self.outside)?;
        (self.executor, self.timing) = (executor, timing);
        (self.position, self.down, self.in_spindle) = (Steps::default(), 0, None);
        self.stock_for_pins();
        Ok(())
    }
}
