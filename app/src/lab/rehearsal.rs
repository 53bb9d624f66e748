//! Runs a queue in the page on a separate virtual drill: no bridge, no hardware, no waiting for real time.
//!
//! ```text
//! homed drill ─ begin(queue) ─▶ Trial ─ go(step │ breakpoint │ end), in slices ─▶ results per row, trail
//! ```
//!
//! Nothing outside this page moves.

use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Machine, Steps};
use annulus_core::queue::{Mode, Queue, Rehearsal, Rest, Rig, RowResult, Standing};
use annulus_core::virtual_drill::{Faults, VirtualDrill};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// Segments of motion or waiting per call, so that the page stays responsive.
const PIECES: usize = 8;

/// A virtual drill starts at a random position; this seed always gives the same one.
const SEED: u64 = 1;

pub struct Trial {
    machine: Machine,
    twin: VirtualDrill,
    rehearsal: Rehearsal,
    holes: Arc<AtomicU32>,
}

fn drill(machine: &Machine) -> (VirtualDrill, Arc<AtomicU32>) {
    let holes = Arc::new(AtomicU32::new(0));
    let count = holes.clone();
    let drilled = Box::new(move |_: &_| {
        count.fetch_add(1, Ordering::Relaxed);
    });
    (VirtualDrill::new(machine, SEED, Faults::default(), drilled), holes)
}

/// The state of the page's drill before a queue: homed, work zero at the position after homing, spindle off.
pub fn standing(machine: &Machine) -> Result<Standing, Diagnostic> {
    let (mut twin, _) = drill(machine);
    Rig::homed(machine, &mut twin).map(|bench| bench.standing)
}

impl Trial {
    /// Prepares `queue` on a homed drill. `outputs` are the names that the queue may switch.
    pub fn begin(machine: &Machine, queue: Queue, outputs: Vec<String>) -> Result<Self, Diagnostic> {
        let (mut twin, holes) = drill(machine);
        let bench = Rig::homed(machine, &mut twin)?;
        Ok(Self { machine: machine.clone(), twin, rehearsal: Rehearsal::new(queue, outputs, bench), holes })
    }

    /// Runs a slice. None if there is more to do: call it again with the same mode.
    pub fn go(&mut self, mode: Mode) -> Option<Rest> {
        self.rehearsal.go(&self.machine, mode, &mut self.twin, PIECES)
    }

    pub fn results(&self) -> &[RowResult] {
        self.rehearsal.run().results()
    }

    /// The current or next row; none at the end.
    pub fn row(&self) -> Option<usize> {
        self.rehearsal.run().row()
    }

    /// The machine at the start.
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    pub fn ended(&self) -> bool {
        self.rehearsal.run().ended()
    }

    /// Row and machine steps at the end of every segment.
    pub fn trail(&self) -> &[(usize, Steps)] {
        self.rehearsal.trail()
    }

    pub fn holes(&self) -> u32 {
        self.holes.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::machine::virtual_drill;
    use annulus_core::queue::{RowState, read};

    fn run(trial: &mut Trial, mode: Mode) -> Rest {
        (0..10_000).find_map(|_| trial.go(mode)).expect("it comes to rest")
    }

    #[test]
    fn simulated_queue_drills_and_stops_at_its_breakpoint() {
        let text = "SPINDLE 20000\nREPEAT 3\n  MOVE_BY 200 0\n  DRILL_DOWN\n  DRILL_UP\nEND\n* SPINDLE 0\n";
        let queue = read("", text).unwrap();
        let mut trial = Trial::begin(&virtual_drill(), queue, Vec::new()).unwrap();
        assert_eq!(run(&mut trial, Mode::Step), Rest::Held);
        assert_eq!((trial.row(), trial.results()[0].state), (Some(1), RowState::Done));
        assert_eq!(run(&mut trial, Mode::ToBreakpoint), Rest::Held);
        assert_eq!((trial.row(), trial.holes()), (Some(6), 3));
        assert_eq!(run(&mut trial, Mode::ToEnd), Rest::Done);
        assert!(trial.ended() && trial.results().iter().all(|result| result.state == RowState::Done));
        assert!(!trial.trail().is_empty());
    }

    #[test]
    fn out_of_range_row_is_refused_before_motion() {
        let queue = read("", "MOVE_BY 999999 0\n").unwrap();
        let mut trial = Trial::begin(&virtual_drill(), queue, Vec::new()).unwrap();
        assert!(
            matches!(run(&mut trial, Mode::ToEnd), Rest::Failed { why, .. } if why.code == "queue.outside")
        );
        assert!(trial.trail().is_empty());
        assert!(standing(&virtual_drill()).unwrap().all_homed());
    }
}
