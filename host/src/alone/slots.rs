//! A journal in two files that are written in turn, so that one of them is always intact.
//!
//! ```text
//! slot 0 │ 41 sealed │           │ 43 sealed │          the intact slot with the highest number holds;
//! slot 1 │           │ 42 sealed │           │ 44 se     a slot interrupted while writing is ignored
//! ```
//!
//! If both files are damaged, they are saved aside, and the new journal reports that until the user
//! acknowledges it.

use crate::files::{File, Files};
use crate::journal::{Contents, Damage, JobRecord, Progress, WorkZero, sealed, unsealed};
use crate::recording::Keeper;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::machine::{Steps, ToolWear};
use annulus_core::magazine::ToolStock;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Slot {
    number: u64,
    job: Option<(JobRecord, Progress)>,
    zero: Option<WorkZero>,
    /// Tool wear; missing in older journals.
    #[serde(default)]
    wear: Vec<ToolWear>,
    damage: Option<Damage>,
    #[serde(default)]
    stock: Option<ToolStock>,
    /// Which of the two program files holds the job's program.
    program: bool,
}

pub(super) struct Slots<F> {
    pub(super) files: F,
    last: Slot,
}

fn full(reason: String) -> Diagnostic {
    error!("journal.cannot_write", reason = reason)
}

fn unreadable(file: File, reason: String) -> Diagnostic {
    error!("journal.cannot_open", file = file.name(), reason = reason)
}

impl<F: Files> Slots<F> {
    /// Opens the journal in `files`. Returns its contents and the program of its job.
    pub(super) fn open(mut files: F) -> Result<(Self, Contents, Option<Vec<u8>>), Diagnostic> {
        let mut read = |file: File| files.read(file).map_err(|why| unreadable(file, why));
        let slots = [read(File::Slot(false))?, read(File::Slot(true))?];
        let believed = slots.iter().filter_map(|bytes| unsealed::<Slot>(bytes).ok());
        let last = believed.max_by_key(|slot| slot.number);
        let damaged = last.is_none() && slots.iter().any(|bytes| !bytes.is_empty());
        let mut slots = Slots { files, last: last.unwrap_or_default() };
        if damaged {
            slots.put_aside()?;
        }
        let Slot { job, zero, wear, damage, stock, program, .. } = slots.last.clone();
        let program = job.is_some().then(|| slots.files.read(File::Program(program)).ok()).flatten();
        Ok((slots, Contents { job, zero, wear, damage, stock }, program))
    }

    pub(super) fn job(&self) -> Option<&String> {
        self.last.job.as_ref().map(|(job, _)| &job.key)
    }

    /// Copies both damaged slots into a separate file, then starts an empty journal.
    fn put_aside(&mut self) -> Result<(), Diagnostic> {
        let mut all = Vec::new();
        for file in [File::Slot(false), File::Slot(true)] {
            all.extend(self.files.read(file).map_err(|why| unreadable(file, why))?);
        }
        self.files.write(File::Aside, &all).map_err(full)?;
        let damage = Damage { file: Some(File::Aside.name().to_owned()), job: None };
        self.change(|slot| slot.damage = Some(damage))
    }

    /// Writes the changed slot. Memory changes only after the write succeeded.
    fn change(&mut self, change: impl FnOnce(&mut Slot)) -> Result<(), Diagnostic> {
        let mut next = self.last.clone();
        next.number += 1;
        change(&mut next);
        self.files.write(File::Slot(next.number % 2 == 1), &sealed(&next)).map_err(full)?;
        self.last = next;
        Ok(())
    }
}

impl<F: Files> Keeper for Slots<F> {
    fn begin(&mut self, job: &JobRecord, progress: Progress, program: &[u8]) -> Result<(), Diagnostic> {
        let other = !self.last.program;
        self.files.write(File::Program(other), program).map_err(full)?;
        self.change(|slot| (slot.job, slot.program) = (Some((job.clone(), progress)), other))
    }

    fn advance(
        &mut self,
        now: Progress,
        _: Option<(u32, Steps)>,
        wear: Option<&ToolWear>,
    ) -> Result<(), Diagnostic> {
        self.change(|slot| {
            if let Some((_, progress)) = &mut slot.job {
                *progress = now;
            }
            if let Some(wear) = wear {
                wear.clone().keep(&mut slot.wear);
            }
        })
    }

    fn keep_wear(&mut self, wear: &ToolWear) -> Result<(), Diagnostic> {
        self.change(|slot| wear.clone().keep(&mut slot.wear))
    }

    fn finish(&mut self) -> Result<(), Diagnostic> {
        self.change(|slot| slot.job = None)
    }

    fn keep_zero(&mut self, zero: Option<&WorkZero>) -> Result<(), Diagnostic> {
        self.change(|slot| slot.zero = zero.cloned())
    }

    fn keep_stock(&mut self, stock: &ToolStock) -> Result<(), Diagnostic> {
        self.change(|slot| slot.stock = Some(stock.clone()))
    }

    fn forget_damage(&mut self) -> Result<(), Diagnostic> {
        self.change(|slot| slot.damage = None)
    }

    fn again(&mut self) -> Result<(), Diagnostic> {
        Ok(())
    }
}
