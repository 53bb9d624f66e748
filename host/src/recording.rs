//! Writes records in order and reports the results to the owner.
//!
//! After a failure no further leg is written, so the journal stays true; other records are tried again.

use crate::executor::Shared;
use crate::journal::{JobRecord, Progress, Record, WorkZero};
use crate::owner::Message;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Steps, ToolWear};
use annulus_core::magazine::ToolStock;

/// Durable storage. A call that succeeds is durable when it returns.
pub trait Keeper {
    /// A job starts at leg `progress.done`. Its program is saved too, so that it can be resumed.
    fn begin(&mut self, job: &JobRecord, progress: Progress, program: &[u8]) -> Result<(), Diagnostic>;

    /// A leg is completed and the next started. `stop` is where a sensor ended a leg's drill cycle, `wear`
    /// the tool's new wear.
    fn advance(
        &mut self,
        progress: Progress,
        stop: Option<(u32, Steps)>,
        wear: Option<&ToolWear>,
    ) -> Result<(), Diagnostic>;

    fn keep_wear(&mut self, wear: &ToolWear) -> Result<(), Diagnostic>;

    fn finish(&mut self) -> Result<(), Diagnostic>;

    fn keep_zero(&mut self, zero: Option<&WorkZero>) -> Result<(), Diagnostic>;

    fn keep_stock(&mut self, stock: &ToolStock) -> Result<(), Diagnostic>;

    /// The user acknowledged the damage of the previous journal.
    fn forget_damage(&mut self) -> Result<(), Diagnostic>;

    /// Prepares for another attempt after a failure.
    fn again(&mut self) -> Result<(), Diagnostic>;
}

#[derive(Debug, Default)]
pub struct Recording {
    /// The progress of the running job can no longer be recorded.
    failed: bool,
    refused: bool,
}

impl Recording {
    pub fn write(
        &mut self,
        keeper: &mut impl Keeper,
        record: Record,
        shared: &Shared,
        owner: impl Fn(Message),
    ) {
        if self.refused && !matches!(record, Record::Advance { .. }) {
            self.refused = keeper.again().is_err();
        }
        let written = match record {
            Record::Begin { job, progress, program } => {
                let begun = keeper.begin(&job, progress, &program);
                self.failed = begun.is_err();
                self.refused |= self.failed;
                if begun.is_ok() {
                    shared.set_durable(progress.done);
                }
                owner(Message::Begun(begun));
                Ok(())
            }
            Record::Advance { .. } if self.failed => Ok(()),
            Record::Advance { progress, wear, stop } => {
                let advanced = keeper.advance(progress, stop, wear.as_ref());
                match &advanced {
                    Ok(()) => shared.set_durable(progress.done),
                    Err(_) => self.failed = true,
                }
                advanced
            }
            Record::Finish => keeper.finish(),
            Record::Wear(wear) => keeper.keep_wear(&wear),
            Record::Zero(zero) => keeper.keep_zero(zero.as_ref()),
            Record::Stock { stock, number } => {
                let kept = keeper.keep_stock(&stock);
                if kept.is_ok() {
                    owner(Message::StockKept { number });
                }
                kept
            }
            Record::DamageRead => keeper.forget_damage(),
        };
        if let Err(why) = written {
            self.refused = true;
            owner(Message::CannotRecord(why));
        }
    }
}
