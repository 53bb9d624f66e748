//! Automatic tool changes: `core` defines the steps, which become tasks here, and the contents of magazine
//! and spindle are saved.
//!
//! ```text
//! tool wanted ─▶ step ─▶ report, checked ─▶ step … ─▶ changed ─▶ the leg continues
//!                 │ the clamp moves only after the journal has it
//!                 └ stop, alarm ─▶ tool up ─▶ sensor states are saved ─▶ offered to continue from
//! ```

use super::Owner;
use super::clamp::ClampByHand;
use super::moves::Doing;
use crate::executor::Report;
use crate::journal::Record;
use annulus_core::control::{Event, State};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::job::Bit;
use annulus_core::magazine::{Change, Held, Seen, StepWork, StockedTool, ToolStock};
use annulus_core::wire::{MagazineReport, Tell};

#[derive(Default)]
pub(crate) struct ToolChanger {
    pub(crate) stock: ToolStock,
    change: Option<Change>,
    record: u32,
    /// A step that waits until the record with this number is durable.
    waits: Option<(u32, StepWork)>,
    pub(super) inputs: u32,
    pub(super) clamp: ClampByHand,
}

impl ToolChanger {
    pub(crate) fn new(stock: ToolStock) -> Self {
        Self { stock, ..Self::default() }
    }
}

impl Owner {
    fn wanted_bit(&self) -> Option<Bit> {
        let work = self.work.as_ref()?;
        let bit = work.awaited().or(work.bit)?;
        work.job.program.bits.get(bit as usize).cloned()
    }

    pub(crate) fn change_tool(&mut self) -> Result<(), Diagnostic> {
        let Some(bit) = self.wanted_bit() else {
            self.pending.push_back(Event::Changed);
            return Ok(());
        };
        let from = [0, 1].map(|axis: usize| self.down >> axis & 1 == 1);
        let back = (self.position, from);
        self.tools.change = Change::new(&mut self.tools.stock, &bit, back)?;
        self.keep_stock();
        if self.tools.change.is_some() {
            return self.change_step();
        }
        self.pending.push_back(Event::Changed);
        Ok(())
    }

    fn change_step(&mut self) -> Result<(), Diagnostic> {
        let Some(change) = &self.tools.change else { return Ok(()) };
        let stands = (self.position, self.tools.inputs);
        let work = change.begin(&self.machine, &mut self.tools.stock, stands)?;
        let segments = self.in_time(work.segments.clone())?;
        let work = StepWork { segments, ..work };
        self.tell(self.magazine_tell());
        if !work.needs_kept {
            self.do_step(work);
            return Ok(());
        }
        self.tools.waits = Some((self.keep_stock(), work));
        Ok(())
    }

    fn do_step(&mut self, work: StepWork) {
        if let Some((place, on)) = work.output {
            self.executor.output(place, on);
        }
        self.give(Doing::Change, work.segments);
    }

    /// The magazine record with this number is durable.
    pub(crate) fn stock_kept(&mut self, number: u32) {
        if let Some((_, work)) = self.tools.waits.take_if(|(wanted, _)| *wanted == number) {
            self.do_step(work);
        }
        self.clamp_kept(number);
    }

    /// Ends the change, because its job ended.
    pub(super) fn change_over(&mut self) {
        self.tools.waits = None;
        if self.tools.change.take().is_some() {
            self.tell(self.magazine_tell());
        }
    }

    pub(crate) fn brake_change(&mut self) {
        if self.tools.waits.take().is_some() {
            self.pending.push_back(Event::Rested);
        }
    }

    pub(super) fn change_reported(&mut self, report: &Report) -> Result<(), Diagnostic> {
        if self.session.state == State::Stopping {
            self.pending.push_back(Event::Rested);
            return Ok(());
        }
        let Some(change) = &mut self.tools.change else { return Ok(()) };
        let before = self.tools.stock.spindle.clone();
        let is_done = change.done(&self.machine, &mut self.tools.stock, report.inputs)?;
        if is_done {
            // Clear it before the report: the page waits for the last report of this change.
            self.tools.change = None;
        }
        if is_done || self.tools.stock.spindle != before {
            self.keep_stock();
        }
        if !is_done {
            return self.change_step();
        }
        self.pending.push_back(Event::Changed);
        Ok(())
    }

    /// After a stop with the tool up: derives from the sensors what the spindle holds.
    pub(super) fn settle_stock(&mut self) {
        self.tools.change = None;
        if self.tools.stock.change.is_some() {
            let over = Change::is_over_place(&self.machine, &self.tools.stock, &self.position);
            self.tools.stock.settle(self.machine.told_inputs(), self.tools.inputs, over);
            self.clamp_holds();
            self.keep_stock();
        }
    }

    /// How long a moving clamp still needs, in ticks.
    pub(super) fn clamp_wait_ticks(&self) -> u64 {
        if self.tools.change.is_some() { self.tools.stock.wait_before_lift_ticks(&self.machine) } else { 0 }
    }

    /// Keeps the clamp closed on a tool that is known to be in the spindle.
    fn clamp_holds(&self) {
        let clamp = self.machine.output_place(&self.machine.magazine.clamp);
        let holds = matches!(self.tools.stock.spindle, Held::Tool { .. });
        if let Some(place) = clamp.filter(|_| holds && self.machine.has_magazine()) {
            self.executor.output(place, false);
        }
    }

    /// Saves and reports the contents of magazine and spindle. Returns the number of the record.
    pub(super) fn keep_stock(&mut self) -> u32 {
        self.tools.record = self.tools.record.wrapping_add(1);
        let (stock, number) = (Box::new(self.tools.stock.clone()), self.tools.record);
        self.outside.record(Record::Stock { stock, number });
        self.tell(self.magazine_tell());
        number
    }

    pub(crate) fn stock_said(
        &mut self,
        places: Vec<Option<StockedTool>>,
        spindle: Held,
    ) -> Result<(), Diagnostic> {
        let stock = ToolStock::reported(places, spindle, &self.machine)?;
        self.stock_is(stock)
    }

    /// The user states what the spindle holds after an interrupted change.
    pub(crate) fn tool_seen(&mut self, seen: Seen) -> Result<(), Diagnostic> {
        if self.waits_for_new_tool() {
            return self.close_clamp(seen);
        }
        let mut stock = self.tools.stock.clone();
        stock.seen(seen)?;
        self.stock_is(stock)
    }

    fn stock_is(&mut self, stock: ToolStock) -> Result<(), Diagnostic> {
        if !self.machine.has_magazine() {
            return Err(error!("magazine.none"));
        }
        self.try_event(Event::Disarmed { position_lost: false })?;
        (self.prepared, self.tool_in) = (None, None);
        self.tools.stock = stock;
        self.tools.clamp.stays();
        self.stock_for_pins();
        self.clamp_holds();
        self.keep_stock();
        Ok(())
    }

    /// Passes the contents to the pins: a simulated machine has no sensors to find out.
    pub(crate) fn stock_for_pins(&self) {
        if self.machine.has_magazine() {
            self.executor.stock(self.tools.stock.clone());
        }
    }

    /// An output was switched manually. If that was the clamp, the spindle's contents are unknown.
    pub(crate) fn switched_by_hand(&mut self, place: u8) {
        self.foot_switched(place);
        let clamp = self.machine.output_place(&self.machine.magazine.clamp);
        if self.machine.has_magazine() && clamp == Some(place) {
            self.tool_in = None;
            self.spindle_is_unknown();
        }
    }

    pub(super) fn put_in_by_hand(&mut self) {
        if self.tools.stock.spindle != Held::Unknown {
            self.spindle_is_unknown();
        }
    }

    fn spindle_is_unknown(&mut self) {
        (self.tools.stock.spindle, self.tools.stock.change) = (Held::Unknown, None);
        self.keep_stock();
    }

    pub(crate) fn magazine_tell(&self) -> Tell {
        Tell::Magazine(Box::new(MagazineReport {
            stock: self.tools.stock.clone(),
            changes: self.tools.change.is_some(),
            goes_on_with: self.tools.stock.goes_on_with(),
        }))
    }
}
