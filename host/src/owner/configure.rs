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

/// Settings that define positions on the machine: a change requires homing. Wiring changes require it too;
/// other settings of the virtual drill are compared separately.
const BUILT_FROM: [&str; 13] = [
    "machine.spindles",
    "x.",
    "y.",
    "z.",
    "drive.",
    "foot.",
    "magazine.",
    "spindle.longer",
    "stroke.contact_tolerance",
    "stroke.end",
    "stroke.surface",
    "stroke.board_thickness",
    "stroke.breakthrough",
];

/// Returns `true` if a drill is built from the setting `key`.
fn is_built_from(key: &str) -> bool {
    is_in_file_only(key) || BUILT_FROM.iter().any(|start| key.starts_with(start))
}

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
            let differs = setting.value(&self.machine) != setting.value(&changed);
            differs && is_built_from(setting.key)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// All other settings: how the machine moves and in which order, not what it is built from.
    const KEPT: [&str; 19] = [
        "machine.name",
        "machine.description",
        "motion.",
        "overlap.",
        "park.",
        "change.",
        "stroke.longest_drilling",
        "stroke.settle",
        "stroke.touch_speed",
        "stroke.lift_at_pause",
        "stroke.safe_height",
        "stroke.feed",
        "stroke.dwell_bottom",
        "spindle.deeper",
        "spindle.enabled",
        "spindle.margin",
        "spindle.max_speed",
        "spindle.sp",
        "rack.",
    ];

    #[test]
    fn every_setting_is_classified_as_rebuilding_or_not() {
        let keys: Vec<&str> = machine::settings().map(|setting| setting.key).collect();
        for key in &keys {
            let kept = KEPT.iter().any(|start| key.starts_with(start));
            assert!(is_built_from(key) != kept, "{key}: built from it {}, kept {kept}", is_built_from(key));
        }
        for start in BUILT_FROM.iter().chain(&KEPT) {
            assert!(keys.iter().any(|key| key.starts_with(start)), "no setting begins with {start}");
        }
    }
}
