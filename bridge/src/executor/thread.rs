//! The executor's thread: plays tasks on pins that it owns alone.

use annulus_core::machine::Machine;
use annulus_core::pins::{Clock, Pins, through};
use annulus_host::executor::{Instruction, Report, Shared};
use annulus_host::{Next, Orders, Place};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

const RING: usize = 16;

/// Starts the thread, which calls `first` before anything else, and `report` once per task.
pub(super) fn start(
    machine: &Machine,
    pins: Box<dyn Pins + Send>,
    clock: Box<dyn Clock + Send>,
    shared: Arc<Shared>,
    first: impl FnOnce() + Send + 'static,
    report: impl Fn(Report) + Send + 'static,
) -> std::io::Result<(SyncSender<Instruction>, JoinHandle<()>)> {
    let (ring, orders) = sync_channel(RING);
    let place = Place::new(machine, pins, clock, shared);
    let builder = thread::Builder::new().name("executor".to_owned());
    let thread = builder.spawn(move || {
        first();
        through(place.run(Ring(orders), report));
    })?;
    Ok((ring, thread))
}

struct Ring(Receiver<Instruction>);

impl Orders for Ring {
    fn next(&mut self, patience: Option<Duration>) -> Next {
        let message = match patience {
            Some(patience) => self.0.recv_timeout(patience),
            None => self.0.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        match message {
            Ok(message) => Next::Order(message),
            Err(RecvTimeoutError::Timeout) => Next::Late,
            Err(RecvTimeoutError::Disconnected) => Next::Over,
        }
    }

    fn pause(&mut self) {
        thread::sleep(Duration::from_micros(100));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::executor::clock;
    use annulus_core::machine::{Output, Steps, virtual_drill};
    use annulus_core::motion::cycles;
    use annulus_core::pins::Recorder;
    use annulus_core::steps::{Segment, segment};
    use annulus_host::executor::{Ended, Task};
    use std::sync::mpsc::channel;

    /// A clock that is never late.
    struct Punctual(u64);

    impl Clock for Punctual {
        fn now(&mut self) -> u64 {
            self.0
        }
        fn wait_until(&mut self, tick: u64) -> u64 {
            self.0 = self.0.max(tick);
            tick
        }
    }

    fn way(machine: &Machine, from: Steps, z: i64) -> Vec<Segment> {
        let way = cycles::retract(machine, from, z).unwrap();
        way.moves.iter().map(|planned| segment(planned, machine)).collect()
    }

    fn task(id: u64, segments: Vec<Segment>, follows: bool, surface_steps: i64) -> Instruction {
        Instruction::Task(Task {
            id,
            segments,
            follows,
            surface_steps,
            board_steps: 0,
            needs_durable: 0,
            lift_to: Some(0),
            granted: false,
        })
    }

    /// Plays two tasks with a pause between them: the first leaves the tool `depth` steps below the board's
    /// surface, the second should follow. Returns how each ended, and the tool's height above the surface.
    fn two_tasks(output: Output, follows: bool, depth: i64, pause: Duration) -> [(Ended, i64); 2] {
        let machine = Machine { output, ..virtual_drill() };
        let surface = machine.z.scale.steps(machine.process.surface);
        let (reports, heard) = channel();
        let report = move |report| {
            let _ = reports.send(report);
        };
        let pins = Box::<Recorder>::default();
        let shared = Arc::new(Shared::new(clock::time));
        let (ring, thread) = start(&machine, pins, Box::new(Punctual(0)), shared, || {}, report).unwrap();
        let mut low = Steps::default();
        low[2] = surface - depth;
        ring.send(task(1, way(&machine, Steps::default(), low[2]), follows, surface)).unwrap();
        let first: Report = heard.recv().unwrap();
        thread::sleep(pause);
        ring.send(task(2, way(&machine, low, surface + 1_000), false, surface)).unwrap();
        let second = heard.recv().unwrap();
        ring.send(Instruction::Finish).unwrap();
        thread.join().unwrap();
        [first, second].map(|report| (report.ended, report.position[2] - surface))
    }

    #[test]
    fn final_position_is_published_to_a_slow_reader() {
        let machine = virtual_drill();
        let (reports, heard) = channel();
        let shared = Arc::new(Shared::new(clock::time));
        let (ring, thread) = start(
            &machine,
            Box::<Recorder>::default(),
            Box::new(Punctual(0)),
            Arc::clone(&shared),
            || {},
            move |report: Report| {
                let _ = reports.send(report);
            },
        )
        .unwrap();
        // The task ends while the reader holds the snapshot.
        shared.change_glimpse(|_| {
            ring.send(task(1, way(&machine, Steps::default(), -100), false, 0)).unwrap();
            thread::sleep(Duration::from_millis(300));
        });
        assert_eq!(heard.recv().unwrap().position[2], -100);
        assert_eq!(shared.glimpse().position[2], -100);
        ring.send(Instruction::Finish).unwrap();
        thread.join().unwrap();
    }

    #[test]
    fn starved_executor_lifts_the_tool_out_of_the_board() {
        const LONG: Duration = Duration::from_millis(2_400);
        let top = -virtual_drill().z.scale.steps(virtual_drill().process.surface);
        let [down, starved] = two_tasks(Output::Card, true, 100, LONG);
        assert_eq!((down, starved), ((Ended::Completed, -100), (Ended::Starved, top)));
        // No lift: in time; on the virtual drill, which runs by stream time; with the tool out of the
        // board; after a queue row, which may leave the tool down.
        let rows = [
            (Output::Card, true, 100, Duration::ZERO),
            (Output::Virtual, true, 100, LONG),
            (Output::Card, true, -100, LONG),
            (Output::Card, false, 100, LONG),
        ];
        let rows = rows.map(|(output, follows, depth, pause)| {
            thread::spawn(move || (depth, two_tasks(output, follows, depth, pause)))
        });
        for row in rows {
            let (depth, ended) = row.join().unwrap();
            assert_eq!(ended, [(Ended::Completed, -depth), (Ended::Completed, 1_000)]);
        }
    }
}
