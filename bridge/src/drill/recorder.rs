//! The journal's thread: writes records in order and says how many legs are durable.
//!
//! Comes in: records. Goes out: the number that lets the next stroke start, or a diagnostic when the disk refuses. After a
//! refusal it writes no further leg: what the journal says stays true; what else comes is tried anew. Does not know the executor.

use super::owner::Message;
use crate::executor::Shared;
use crate::journal::{JobRecord, Journal, Progress, WorkZero};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Steps;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

/// What is to be written.
pub(super) enum Record {
    /// A job begins; the owner hears when it is durable.
    Begin(Box<JobRecord>, Progress, Vec<u8>),
    /// A leg is done, the next begun.
    Advance(Progress, Option<(u32, Steps)>),
    /// The job is over or forgotten.
    Finish,
    /// The work zero in force.
    Zero(Option<WorkZero>),
    /// It was read that the journal before this one was damaged.
    DamageRead,
}

/// The owner's end.
pub(super) struct Recorder {
    records: Option<Sender<Record>>,
    thread: Option<JoinHandle<()>>,
}

impl Recorder {
    pub(super) fn start(
        journal: Journal,
        shared: Arc<Shared>,
        owner: Sender<Message>,
    ) -> std::io::Result<Self> {
        let (records, inbox) = channel();
        let builder = thread::Builder::new().name("journal".to_owned());
        let thread = builder.spawn(move || {
            let over = Over(owner);
            run(journal, &inbox, &shared, &over.0);
        })?;
        Ok(Self { records: Some(records), thread: Some(thread) })
    }

    pub(super) fn write(&self, record: Record) {
        if let Some(records) = &self.records {
            let _ = records.send(record);
        }
    }

    /// Whether what is written is read.
    pub(super) fn lives(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }
}

/// When the thread ends, whatever ended it, a start that waits for it is answered.
struct Over(Sender<Message>);

impl Drop for Over {
    fn drop(&mut self) {
        let _ = self.0.send(Message::Begun(Err(Diagnostic::error("control.shut_down"))));
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.records = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn run(mut journal: Journal, inbox: &Receiver<Record>, shared: &Shared, owner: &Sender<Message>) {
    let (mut failed, mut refused) = (false, false);
    while let Ok(record) = inbox.recv() {
        if refused && !matches!(record, Record::Advance(..)) {
            refused = journal.again().is_err();
        }
        let written = match record {
            Record::Begin(job, progress, program) => {
                let begun = journal.begin(&job, progress, &program);
                failed = begun.is_err();
                refused |= failed;
                if begun.is_ok() {
                    shared.set_durable(progress.done);
                }
                let _ = owner.send(Message::Begun(begun));
                Ok(())
            }
            Record::Advance(..) if failed => Ok(()),
            Record::Advance(progress, stop) => {
                let advanced = journal.advance(progress, stop);
                match &advanced {
                    Ok(()) => shared.set_durable(progress.done),
                    Err(_) => failed = true,
                }
                advanced
            }
            Record::Finish => journal.finish(),
            Record::Zero(zero) => journal.keep_zero(zero.as_ref()),
            Record::DamageRead => journal.forget_damage(),
        };
        if let Err(why) = written {
            refused = true;
            let _ = owner.send(Message::CannotRecord(why));
        }
    }
}
