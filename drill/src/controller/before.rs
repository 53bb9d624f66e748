//! Before the first move: what the job is compared with, row by row. A controller plans its own motion, so there is no digest; what
//! is compared instead is said.
//!
//! Comes in: a job, how controller and person stand. Goes out: rows. Moves nothing.

use super::order::Order;
use super::station::Station;
use crate::files::Files;
use crate::prepare::{accepted, bit_of_leg, missing_drills, rest, row, worn_tools};
use annulus_core::control::State;
use annulus_core::controller::{EngineStart, estimates_s, settings};
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::job::bite;
use annulus_core::locale;
use annulus_core::wire::{PreflightRow, RowVerdict};
use std::sync::Arc;

/// How far zero of Z may be from where it was: the last digit of a report.
const SAME_HEIGHT_MM: f64 = 0.001_5;

impl<F: Files> Station<F> {
    /// What the engine is asked for to run `order` from section `from` on.
    pub(super) fn start_of(&self, order: &Order, from: usize) -> EngineStart {
        let entry = self.ledger.entry();
        let homes = settings::on(&self.attended.controller().info.values, 22);
        // Where nothing was homed, places of the machine mean nothing over a reset; and a zero that was set again is meant.
        let zero_mm = entry.zero_mm.filter(|_| from > 0 && homes && !self.hand.zero_set);
        let spin_up_s = self.machine.process.spin_up_ms / 1e3;
        let accepted = order.program.accepted.clone();
        EngineStart { routine: Arc::clone(&order.routine), from, zero_mm, spin_up_s, accepted }
    }

    /// The rows of the pre-flight.
    pub(super) fn rows(&self, order: &Order, start: &EngineStart) -> Vec<PreflightRow> {
        let controller = self.attended.controller();
        let leg = order.leg(start.from);
        let mut rows: Vec<_> = controller.check(start).into_iter().map(judged).collect();
        rows.push(match self.state() {
            State::Ready => row(RowVerdict::Pass, Diagnostic::note("preflight.at_rest")),
            _ => row(RowVerdict::Fail, Diagnostic::error("preflight.busy")),
        });
        rows.push(if self.hand.height.is_some() || self.height_as_left(start.from) {
            row(RowVerdict::Pass, Diagnostic::note("grbl.height_set"))
        } else {
            row(RowVerdict::Fail, Diagnostic::error("grbl.no_height"))
        });
        rows.push(row(RowVerdict::Pass, Diagnostic::note("grbl.own_motion")));
        rows.push(row(RowVerdict::Warn, Diagnostic::warning("grbl.page_feeds")));
        let missing = missing_drills(&order.program, &self.machine);
        if !missing.is_empty() {
            let why = Diagnostic::warning("preflight.bit_not_in_rack").with("bits", missing.join(", "));
            rows.push(row(RowVerdict::Warn, why));
        }
        rows.extend(worn_tools(&order.program, &self.machine, (leg, self.ledger.wear())));
        rows.extend(bite::judged_all(&order.program).into_iter().map(|why| row(RowVerdict::Warn, why)));
        if let Some(bit) = bit_of_leg(&order.program, leg).filter(|_| start.from > 0) {
            let bit = bit.title(locale::FALLBACK);
            rows.push(row(RowVerdict::Warn, Diagnostic::note("preflight.first_bit").with("bit", bit)));
        }
        rows.extend(accepted(&order.program));
        rows.extend(self.given_up(order, start.from).map(|why| row(RowVerdict::Warn, why)));
        if let Some(left_s) = self.estimates(order, start.from) {
            rows.push(row(RowVerdict::Pass, rest(&order.program, leg, left_s.iter().sum())));
        }
        rows
    }

    /// Whether zero of Z is still where the job that is taken up had it: by the switches, a place is the same again.
    pub(super) fn height_as_left(&self, from: usize) -> bool {
        let homes = settings::on(&self.attended.controller().info.values, 22);
        let (before, now) = (self.ledger.entry().zero_mm, self.attended.controller().zero_mm);
        let same = before.zip(now).is_some_and(|(before, now)| (before[2] - now[2]).abs() <= SAME_HEIGHT_MM);
        from > 0 && homes && same
    }

    /// Seconds of each section from `from` on, by the controller's own settings.
    pub(super) fn estimates(&self, order: &Order, from: usize) -> Option<Vec<f64>> {
        let controller = self.attended.controller();
        let blocks = usize::from(controller.info.options.blocks);
        let place = controller.place().unwrap_or_default();
        estimates_s(&order.routine, &controller.info.values, blocks, from, place)
    }

    /// What is given up when this job begins there: another one that was broken off, or what is made of this one.
    fn given_up(&self, order: &Order, from: usize) -> Option<Diagnostic> {
        let offered = self.offer.as_ref()?;
        if offered.key != order.key {
            let job = &offered.key[..offered.key.len().min(8)];
            return Some(Diagnostic::warning("preflight.forgets").with("job", job));
        }
        (from == 0).then(|| Diagnostic::warning("preflight.anew"))
    }
}

fn judged(found: Diagnostic) -> PreflightRow {
    let verdict = match found.severity {
        Severity::Error => RowVerdict::Fail,
        Severity::Warning => RowVerdict::Warn,
        Severity::Note => RowVerdict::Pass,
    };
    row(verdict, found)
}
