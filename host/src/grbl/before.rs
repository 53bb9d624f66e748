//! The pre-flight check of a job on a controller, row by row. A controller plans its own motion, so there
//! is no digest; other facts are compared. Moves nothing.

use super::job_tools::{JobTools, SectionWear};
use super::lengths::length_row;
use super::order::Order;
use super::station::Station;
use crate::files::Files;
use crate::prepare::{accepted, bit_of_leg, far_below, missing_drills, rest, row, worn_tools};
use annulus_core::cam::suits;
use annulus_core::control::State;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::grbl::{BoardHeight, Changer, EngineStart, estimates_s};
use annulus_core::job::bite;
use annulus_core::machine;
use annulus_core::wire::{PreflightRow, RowVerdict};
use annulus_core::{code, error, note, warning};
use std::sync::Arc;

/// Code of the problem that the work zero differs from the job's.
const ZERO_MOVED: &str = code!("grbl.zero_moved");

impl<F: Files> Station<F> {
    pub(super) fn start_of(&self, order: &Order, from: usize) -> EngineStart {
        let zero_mm = self.ledger.entry().zero_mm.filter(|_| from > 0);
        let spin_up_s = self.machine.process.spin_up_ms / 1e3;
        let mut accepted = order.program.accepted.clone();
        // If the user set the zero again, the user must accept its distance from the old zero separately.
        accepted.retain(|code| code != ZERO_MOVED);
        accepted.extend(self.hand.zero_meant.then(|| ZERO_MOVED.to_owned()));
        let (routine, same_length, setter) = (Arc::clone(&order.routine), false, self.lengths.in_force());
        let changer = self.changer_for(order);
        EngineStart { routine, from, zero_mm, same_length, setter, changer, spin_up_s, accepted }
    }

    /// The tool-change macro for `order`, with tool numbers of the machine's list; `None` if the user
    /// changes tools.
    fn changer_for(&self, order: &Order) -> Option<Changer> {
        let lines = Some(self.changer.clone()).filter(|lines| !lines.is_empty())?;
        let sections = SectionWear::by_legs(&order.program, order.legs.clone());
        let machine = (self.machine.name.as_str(), self.machine.rack.as_slice());
        let tools = JobTools::new(sections, machine, self.ledger.wear().to_vec());
        Some(Changer { lines, numbers: tools.numbers(&order.routine) })
    }

    pub(super) fn rows(&self, order: &Order, start: &EngineStart) -> Vec<PreflightRow> {
        let controller = self.attended.controller();
        let leg = order.leg(start.from);
        let meant = |found: &Diagnostic| found.code == ZERO_MOVED && self.hand.zero_meant;
        let judged_here = |found: Diagnostic| {
            let severity = if meant(&found) { Severity::Warning } else { found.severity };
            judged(Diagnostic { severity, ..found })
        };
        let mut rows: Vec<_> = controller.check(start).into_iter().map(judged_here).collect();
        rows.extend(self.unlike_mill().into_iter().map(|why| row(RowVerdict::Warn, why)));
        rows.push(match self.state() {
            State::Ready => row(RowVerdict::Pass, note!("preflight.at_rest")),
            _ => row(RowVerdict::Fail, error!("preflight.busy")),
        });
        rows.extend(self.height_row(order, start));
        rows.extend(self.planned_for(order, start.from));
        rows.extend(length_row(&self.lengths));
        rows.push(row(RowVerdict::Pass, note!("grbl.own_motion")));
        rows.push(row(RowVerdict::Warn, self.feeder()));
        let missing = missing_drills(&order.program, &self.machine);
        if !missing.is_empty() {
            let why = warning!("preflight.bit_not_in_rack", bits = missing.join(", "));
            rows.push(row(RowVerdict::Warn, why));
        }
        rows.extend(worn_tools(&order.program, &self.machine, (leg, self.ledger.wear())));
        rows.extend(machine::warnings(&self.machine).into_iter().map(|why| row(RowVerdict::Warn, why)));
        if order.program.hole_count() > 0 {
            rows.push(row(RowVerdict::Note, warning!("grbl.broken_bits_unseen")));
        }
        rows.extend(bite::judged_all(&order.program).into_iter().map(|why| row(RowVerdict::Warn, why)));
        // A changer fetches the tool, whichever is in.
        let is_in = start.from > 0 && start.changer.is_none();
        if let Some(bit) = bit_of_leg(&order.program, leg).filter(|_| is_in) {
            let bit = bit.titled();
            rows.push(row(RowVerdict::Warn, note!("preflight.first_bit", bit = bit)));
        }
        rows.extend(far_below(&order.program, &self.machine));
        rows.extend(accepted(&order.program));
        rows.extend(self.given_up(order, start.from).map(|why| row(RowVerdict::Warn, why)));
        if let Some(left_s) = self.estimates(order, start.from) {
            rows.push(row(RowVerdict::Pass, rest(&order.program, leg, left_s.iter().sum())));
        }
        rows
    }

    /// Warns about what interrupts the job, because the controller gets it line by line.
    fn feeder(&self) -> Diagnostic {
        if self.in_page { warning!("grbl.page_feeds") } else { warning!("grbl.bridge_feeds") }
    }

    /// Checks that the job was planned for this machine, and that its feeds and speeds suit it. A job for
    /// another machine that is too fast here may not start. An interrupted one may still be finished.
    fn planned_for(&self, order: &Order, from: usize) -> Vec<PreflightRow> {
        let (program, machine) = (&order.program, &self.machine);
        let too_fast = suits::judged(program, machine);
        let first = if program.machine == machine.fingerprint() {
            row(RowVerdict::Pass, note!("preflight.same_machine"))
        } else if too_fast.is_empty() || from > 0 {
            row(RowVerdict::Warn, warning!("preflight.planned_for_other"))
        } else {
            row(RowVerdict::Fail, error!("preflight.other_machine"))
        };
        let others = too_fast.into_iter().map(|why| row(RowVerdict::Warn, why));
        std::iter::once(first).chain(others).collect()
    }

    /// States for which tool the board height is known. `None` if for no tool: another row reports that
    /// error.
    fn height_row(&self, order: &Order, start: &EngineStart) -> Option<PreflightRow> {
        let height = self.attended.controller().height();
        // With a tool setter, the current tool and every later one are measured: another row reports that.
        let measured = start.setter.is_some() && height == BoardHeight::OfThisBit;
        if measured && start.routine.changes_tools() {
            return None;
        }
        let known = height != BoardHeight::Unknown || self.height_as_left(start.from);
        let bit = bit_of_leg(&order.program, order.leg(start.from)).map(|bit| bit.titled());
        let told = |code: &str| Diagnostic::note(code).with("bit", bit.unwrap_or_default());
        known.then(|| match height {
            BoardHeight::OfThisBit if start.from > 0 => row(RowVerdict::Pass, told(code!("grbl.height_set"))),
            BoardHeight::OfThisBit if start.changer.is_some() => {
                row(RowVerdict::Pass, note!("changer.fetches_first"))
            }
            BoardHeight::OfThisBit => row(RowVerdict::Warn, told(code!("grbl.height_of_first"))),
            _ => row(RowVerdict::Pass, told(code!("grbl.height_asked"))),
        })
    }

    /// Returns `true` if zero of Z is still where the resumed job had it. After homing, machine coordinates
    /// are valid again.
    pub(super) fn height_as_left(&self, from: usize) -> bool {
        from > 0 && self.attended.controller().height_as_left(self.ledger.entry().zero_mm)
    }

    pub(super) fn resumes_at_height(&self) -> bool {
        self.offer.is_some() && self.height_as_left(self.ledger.entry().done)
    }

    pub(super) fn estimates(&self, order: &Order, from: usize) -> Option<Vec<f64>> {
        let controller = self.attended.controller();
        let blocks = usize::from(controller.info.options.blocks);
        let place = controller.place().unwrap_or_default();
        estimates_s(&order.routine, &controller.info.values, blocks, from, place)
    }

    /// Warning about what a start from `from` discards: another interrupted job, or the progress of this
    /// one.
    fn given_up(&self, order: &Order, from: usize) -> Option<Diagnostic> {
        let offered = self.offer.as_ref()?;
        if offered.key != order.key {
            let job = &offered.key[..offered.key.len().min(8)];
            return Some(warning!("preflight.forgets", job = job));
        }
        (from == 0).then(|| warning!("preflight.anew"))
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
