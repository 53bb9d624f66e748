//! The journal's thread: writes records in order and says how many legs are durable.
//!
//! Comes in: records. Goes out: the number that lets the next stroke start, or a diagnostic when the disk refuses. Does not know
//! what a record means.

use crate::journal::Journal;
use annulus_core::diagnostic::Diagnostic;
use annulus_drill::executor::Shared;
use annulus_drill::journal::Record;
use annulus_drill::{Message, Recording};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

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
    let mut recording = Recording::default();
    while let Ok(record) = inbox.recv() {
        recording.write(&mut journal, record, shared, |message| drop(owner.send(message)));
    }
}
