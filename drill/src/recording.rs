//! How records are written, wherever they are kept: in order, and what comes of it goes before the owner.
//!
//! Comes in: records. Goes out: the number of legs that are durable, which lets the next stroke start, or a diagnostic when the
//! disk refuses. After a refusal no further leg is written: what the journal says stays true; what else comes is tried anew. Does
//! not know the executor, nor what a journal is made of.

use crate::executor::Shared;
use crate::journal::{JobRecord, Progress, Record, WorkZero};
use crate::owner::Message;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Steps, ToolWear};
use annulus_core::magazine::ToolStock;

/// Somewhere to keep what must survive. Whatever returns without a reason is durable.
pub trait Keeper {
    /// A job begins at leg `progress.done`. Its program is kept too, so that it can always be taken up.
    fn begin(&mut self, job: &JobRecord, progress: Progress, program: &[u8]) -> Result<(), Diagnostic>;

    /// A leg is done and the next begun. `stop` is where a sensor ended the stroke of a leg, `wear` what its tool has done now.
    fn advance(
        &mut self,
        progress: Progress,
        stop: Option<(u32, Steps)>,
        wear: Option<&ToolWear>,
    ) -> Result<(), Diagnostic>;

    /// What a tool has done now.
    fn keep_wear(&mut self, wear: &ToolWear) -> Result<(), Diagnostic>;

    /// The job came to its end, or is to be forgotten.
    fn finish(&mut self) -> Result<(), Diagnostic>;

    /// The work zero in force.
    fn keep_zero(&mut self, zero: Option<&WorkZero>) -> Result<(), Diagnostic>;

    /// What lies in the magazine.
    fn keep_stock(&mut self, stock: &ToolStock) -> Result<(), Diagnostic>;

    /// Somebody has read that the journal before this one was damaged.
    fn forget_damage(&mut self) -> Result<(), Diagnostic>;

    /// Once something was refused: it is tried anew.
    fn again(&mut self) -> Result<(), Diagnostic>;
}

/// What became of the records so far.
#[derive(Debug, Default)]
pub struct Recording {
    /// The job in work cannot be kept up with.
    failed: bool,
    /// The last one was refused.
    refused: bool,
}

impl Recording {
    /// Has `record` kept; what the owner has to hear of it goes to `owner`.
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
