//! The journal's thread: writes records in order and publishes how many legs are durable.

use crate::journal::Journal;
use annulus_core::error;
use annulus_host::executor::Shared;
use annulus_host::journal::Record;
use annulus_host::{Message, Recording};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

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

    pub(super) fn lives(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }
}

/// Answers a pending start when the thread ends, even by a panic.
struct Over(Sender<Message>);

impl Drop for Over {
    fn drop(&mut self) {
        let _ = self.0.send(Message::Begun(Err(error!("control.shut_down"))));
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
