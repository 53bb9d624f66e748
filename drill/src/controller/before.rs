//! Before the first move: what the job is compared with, row by row. A controller plans its own motion, so there is no digest; what
//! is compared instead is said.
//!
//! Comes in: a job, how controller and person stand. Goes out: rows. Moves nothing.

use super::job_tools::{JobTools, SectionWear};
use super::lengths::length_row;
use super::order::Order;
use super::station::Station;
use crate::files::Files;
use crate::prepare::{accepted, bit_of_leg, far_below, missing_drills, rest, row, worn_tools};
use annulus_core::control::State;
use annulus_core::controller::{BoardHeight, Changer, EngineStart, estimates_s};
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::job::bite;
use annulus_core::wire::{PreflightRow, RowVerdict};
use std::sync::Arc;

/// The finding that the work zero is not where a job had it.
const ZERO_MOVED: &str = "grbl.zero_moved";

impl<F: Files> Station<F> {
    /// What the engine is asked for to run `order` from section `from` on.
    pub(super) fn start_of(&self, order: &Order, from: usize) -> EngineStart {
        let zero_mm = self.ledger.entry().zero_mm.filter(|_| from > 0);
        let spin_up_s = self.machine.process.spin_up_ms / 1e3;
        let mut accepted = order.program.accepted.clone();
        // A zero that a person set anew is meant: how far it is from the one before is read and ticked.
        accepted.retain(|code| code != ZERO_MOVED);
        accepted.extend(self.hand.zero_meant.then(|| ZERO_MOVED.to_owned()));
        let (routine, same_length, setter) = (Arc::clone(&order.routine), false, self.lengths.in_force());
        let changer = self.changer_for(order);
        EngineStart { routine, from, zero_mm, same_length, setter, changer, spin_up_s, accepted }
    }

    /// How the machine changes the tools of `order` itself, by their numbers in the rack.
    fn changer_for(&self, order: &Order) -> Option<Changer> {
        let lines = Some(self.changer.clone()).filter(|lines| !lines.is_empty())?;
        let sections = SectionWear::by_legs(&order.program, order.legs.clone());
        let machine = (self.machine.name.as_str(), self.machine.rack.as_slice());
        let tools = JobTools::new(sections, machine, self.ledger.wear().to_vec());
        Some(Changer { lines, numbers: tools.numbers(&order.routine) })
    }

    /// The rows of the pre-flight.
    pub(super) fn rows(&self, order: &Order, start: &EngineStart) -> Vec<PreflightRow> {
        let controller = self.attended.controller();
        let leg = order.leg(start.from);
        let meant = |found: &Diagnostic| found.code == ZERO_MOVED && self.hand.zero_meant;
        let judged_here = |found: Diagnostic| {
            let severity = if meant(&found) { Severity::Warning } else { found.severity };
            judged(Diagnostic { severity, ..found })
        };
        let mut rows: Vec<_> = controller.check(start).into_iter().map(judged_here).collect();
        let mut unlike = self.unlike_mill();
        unlike.retain(|why| rows.iter().all(|row| row.finding.code != why.code));
        rows.extend(unlike.into_iter().map(|why| row(RowVerdict::Warn, why)));
        rows.push(match self.state() {
            State::Ready => row(RowVerdict::Pass, Diagnostic::note("preflight.at_rest")),
            _ => row(RowVerdict::Fail, Diagnostic::error("preflight.busy")),
        });
        rows.extend(self.height_row(order, start));
        rows.extend(length_row(&self.lengths));
        rows.push(row(RowVerdict::Pass, Diagnostic::note("grbl.own_motion")));
        rows.push(row(RowVerdict::Warn, Diagnostic::warning("grbl.page_feeds")));
        let missing = missing_drills(&order.program, &self.machine);
        if !missing.is_empty() {
            let why = Diagnostic::warning("preflight.bit_not_in_rack").with("bits", missing.join(", "));
            rows.push(row(RowVerdict::Warn, why));
        }
        rows.extend(worn_tools(&order.program, &self.machine, (leg, self.ledger.wear())));
        rows.extend(bite::judged_all(&order.program).into_iter().map(|why| row(RowVerdict::Warn, why)));
        // A changer fetches it, whatever is in.
        let is_in = start.from > 0 && start.changer.is_none();
        if let Some(bit) = bit_of_leg(&order.program, leg).filter(|_| is_in) {
            let bit = bit.titled();
            rows.push(row(RowVerdict::Warn, Diagnostic::note("preflight.first_bit").with("bit", bit)));
        }
        rows.extend(far_below(&order.program, &self.machine));
        rows.extend(accepted(&order.program));
        rows.extend(self.given_up(order, start.from).map(|why| row(RowVerdict::Warn, why)));
        if let Some(left_s) = self.estimates(order, start.from) {
            rows.push(row(RowVerdict::Pass, rest(&order.program, leg, left_s.iter().sum())));
        }
        rows
    }

    /// For which bit the height of the board is known; none where it is for no one, which is an error of its own.
    fn height_row(&self, order: &Order, start: &EngineStart) -> Option<PreflightRow> {
        let height = self.attended.controller().height();
        // What is in is measured first, and the first bit like every other: that is said by itself.
        let measured = start.setter.is_some() && height == BoardHeight::OfThisBit;
        if measured && start.routine.changes_tools() {
            return None;
        }
        let known = height != BoardHeight::Unknown || self.height_as_left(start.from);
        let bit = bit_of_leg(&order.program, order.leg(start.from)).map(|bit| bit.titled());
        let told = |code: &str| Diagnostic::note(code).with("bit", bit.unwrap_or_default());
        known.then(|| match height {
            BoardHeight::OfThisBit if start.from > 0 => row(RowVerdict::Pass, told("grbl.height_set")),
            BoardHeight::OfThisBit if start.changer.is_some() => {
                row(RowVerdict::Pass, Diagnostic::note("changer.fetches_first"))
            }
            BoardHeight::OfThisBit => row(RowVerdict::Warn, told("grbl.height_of_first")),
            _ => row(RowVerdict::Pass, told("grbl.height_asked")),
        })
    }

    /// Whether zero of Z is still where the job that is taken up had it: by the switches, a place is the same again.
    pub(super) fn height_as_left(&self, from: usize) -> bool {
        from > 0 && self.attended.controller().height_as_left(self.ledger.entry().zero_mm)
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
