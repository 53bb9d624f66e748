//! The host of a drill on this computer: threads, a folder, and the listeners.

use super::RECORD;
use super::recorder::Recorder;
use super::store;
use crate::adapter;
use crate::executor::{self, Heard, clock, process};
use crate::hosted::Listeners;
use crate::machine_file;
use annulus_core::control::{Lateness, Timing};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::machine::{self, Machine, Output, Value};
use annulus_core::pins::Pins;
use annulus_core::wire::Tell;
use annulus_host::executor::{Seat, Shared};
use annulus_host::journal::Record;
use annulus_host::{KeptSurface, Message, Outside};
use std::fs;
use std::io::{Read, Seek, SeekFrom};
use std::path::PathBuf;
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, PoisonError};

/// Name of the executor's record in the drill's folder.
const EXECUTED: &str = "executor.log";

pub(super) struct KeptSettings {
    pub(super) path: PathBuf,
    /// What the file has in place of values of one run.
    pub(super) unchanged: Vec<(String, Value)>,
}

pub(super) struct Here {
    pub(super) folder: PathBuf,
    pub(super) speed: f64,
    pub(super) settings: Arc<Mutex<KeptSettings>>,
    pub(super) recorder: Recorder,
    pub(super) messages: Sender<Message>,
    pub(super) listeners: Listeners,
}

impl Here {
    fn hear(&self) -> impl Fn(Heard) + Send + 'static {
        let messages = self.messages.clone();
        move |heard| {
            let _ = messages.send(match heard {
                Heard::Report(report) => Message::Report(report),
                Heard::Gone(why) => Message::ExecutorGone(why),
            });
        }
    }
}

impl Outside for Here {
    fn tell(&self, tell: Tell) {
        self.listeners.tell(&tell);
    }

    fn record(&self, record: Record) {
        self.recorder.write(record);
    }

    fn records(&self) -> bool {
        self.recorder.lives()
    }

    fn keep_settings(&self, machine: &Machine) -> Result<(), Diagnostic> {
        let kept = self.settings.lock().unwrap_or_else(PoisonError::into_inner);
        let of_file = machine::apply(machine, &kept.unchanged).map_err(|why| {
            why.into_iter().next().unwrap_or_else(|| error!("machine.file_syntax", what = "?"))
        })?;
        machine_file::save(&kept.path, &of_file)
    }

    fn keep_surface(&self, surface: Option<&KeptSurface>) -> Result<(), Diagnostic> {
        store::keep_surface(&self.folder, surface)
    }

    fn record_length(&self) -> Option<u64> {
        fs::metadata(self.folder.join(RECORD)).ok().map(|file| file.len())
    }

    fn recorded(&self, from: u64) -> Option<String> {
        let mut file = fs::File::open(self.folder.join(RECORD)).ok()?;
        file.seek(SeekFrom::Start(from)).ok()?;
        let mut text = String::new();
        file.read_to_string(&mut text).ok()?;
        Some(text)
    }

    fn seat(
        &self,
        machine: &Machine,
        pins: Box<dyn Pins + Send>,
        late: Option<u64>,
        shared: &Arc<Shared>,
    ) -> Result<Box<dyn Seat>, Diagnostic> {
        executor::start(machine, pins, (self.speed, late), shared, self.hear())
    }

    fn real_seat(
        &self,
        machine: &Machine,
        measured: Option<Lateness>,
        shared: &Arc<Shared>,
    ) -> Result<(Box<dyn Seat>, Option<Timing>), Diagnostic> {
        if machine.output == Output::Adapter {
            return Ok((adapter::start(machine, clock::time, shared, self.hear())?, None));
        }
        let record = self.folder.join(EXECUTED);
        let (process, timing) = process::start(machine, &record, measured, shared, self.hear())?;
        Ok((Box::new(process), Some(timing)))
    }
}
