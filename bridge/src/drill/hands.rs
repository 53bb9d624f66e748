//! The executor of a machine: a thread for the virtual drill, a process of its own for everything real.
//!
//! Comes in: a machine. Goes out: an executor that is ready, and what its clock is worth where time is real. Does not know
//! what it is given to do.

use super::board::Board;
use super::owner::Message;
use crate::executor::{Executor, Heard, Shared, process};
use annulus_core::control::{Lateness, Timing};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Machine, Output};
use annulus_core::pins::Steady;
use annulus_core::virtual_drill::{BreakWatch, DrilledBoard, Faults, Slip, SlipWatch, VirtualDrill};
use std::path::PathBuf;
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex};

/// Name of the executor's record in the drill's folder.
const RECORD: &str = "executor.log";

/// What every executor of one drill is made with.
pub(super) struct Hands {
    pub(super) folder: PathBuf,
    pub(super) faults: Faults,
    pub(super) record: Arc<Mutex<DrilledBoard>>,
    /// Where the virtual drill lost steps since it was built.
    pub(super) slips: Arc<Mutex<Vec<Slip>>>,
    /// The board since the last run began.
    pub(super) board: Board,
    pub(super) messages: Sender<Message>,
}

impl Hands {
    /// An executor for `machine`, `speed` times as fast as life where it is virtual.
    pub(super) fn executor(
        &self,
        machine: &Machine,
        speed: f64,
        measured: Option<Lateness>,
        shared: Arc<Shared>,
    ) -> Result<(Executor, Option<Timing>), Diagnostic> {
        let messages = self.messages.clone();
        let hear = move |heard| {
            let _ = messages.send(match heard {
                Heard::Report(report) => Message::Report(report),
                Heard::Gone(why) => Message::ExecutorGone(why),
            });
        };
        if machine.output != Output::Virtual {
            let (process, timing) =
                process::start(machine, &self.folder.join(RECORD), measured, &shared, hear)?;
            return Ok((Executor::of(process, shared), Some(timing)));
        }
        let (record, board) = (Arc::clone(&self.record), Arc::clone(&self.board));
        let drilled: DrilledBoard = Box::new(move |hole| {
            if let Ok(mut board) = board.lock() {
                board.holes.push(*hole);
            }
            if let Ok(mut record) = record.lock() {
                record(hole);
            }
        });
        let seed = u64::from(std::process::id());
        let slips = Arc::clone(&self.slips);
        if let Ok(mut before) = slips.lock() {
            before.clear();
        }
        let watch: SlipWatch = Box::new(move |all| {
            if let Ok(mut slips) = slips.lock() {
                slips.clear();
                slips.extend_from_slice(all);
            }
        });
        let board = Arc::clone(&self.board);
        let breaks: BreakWatch = Box::new(move |_| {
            if let Ok(mut board) = board.lock() {
                board.broken += 1;
            }
        });
        let drill = VirtualDrill::new(machine, seed, self.faults.clone(), drilled).watched(watch);
        let drill = Steady::new(drill.watched_for_breaks(breaks));
        let executor =
            Executor::start(machine, Box::new(drill), (speed, self.faults.late_host), shared, hear)
                .map_err(|error| Diagnostic::error("control.no_thread").with("reason", error))?;
        Ok((executor, None))
    }
}
