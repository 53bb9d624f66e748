//! Creates executors: on the virtual drill, or on real hardware through the host.

use super::board::Board;
use crate::executor::{Executor, Shared};
use crate::outside::Outside;
use annulus_core::control::{Lateness, Timing};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Machine, Output};
use annulus_core::pins::Steady;
use annulus_core::virtual_drill::{BreakWatch, DrilledBoard, Faults, Slip, SlipWatch, VirtualDrill};
use std::sync::{Arc, Mutex};

pub(crate) struct Hands {
    pub(crate) faults: Faults,
    pub(crate) seed: u64,
    pub(crate) record: Arc<Mutex<DrilledBoard>>,
    /// Where the virtual drill lost steps since it was built.
    pub(crate) slips: Arc<Mutex<Vec<Slip>>>,
    pub(crate) board: Board,
}

impl Hands {
    pub(crate) fn executor(
        &self,
        machine: &Machine,
        measured: Option<Lateness>,
        shared: Arc<Shared>,
        outside: &dyn Outside,
    ) -> Result<(Executor, Option<Timing>), Diagnostic> {
        if machine.output != Output::Virtual {
            let (seat, timing) = outside.real_seat(machine, measured, &shared)?;
            return Ok((Executor::new(seat, shared), timing));
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
        let drill = VirtualDrill::new(machine, self.seed, self.faults.clone(), drilled).watched(watch);
        let pins = Box::new(Steady::new(drill.watched_for_breaks(breaks)));
        let seat = outside.seat(machine, pins, self.faults.late_host, &shared)?;
        Ok((Executor::new(seat, shared), None))
    }
}
