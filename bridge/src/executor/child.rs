//! The executor as a separate process: `annulus executor`, started only by the bridge.
//!
//! ```text
//! standard input ── frames ──▶ this thread ── ring ──▶ executor thread ──▶ recorded pins ──▶ card
//!       ends, or is silent: ramp down      ── stop, durable: two numbers ──▶  │
//! standard output ◀── frames ── writer ◀── reports, latest position ──────────┘
//! ```
//!
//! If the bridge dies or stalls, or the system ends this process, motion stops on its path. The tool is
//! lifted if the position is trusted. Then forcing and spindle go off, and the record notes the position.

use super::clock::{MEASURED, StepClock, measure};
use super::frames::{self, Down, Up};
use super::record::{Offsets, Recorded, Why};
#[cfg(unix)]
use super::rehearsal_clock::{self, RehearsalClock};
use super::{clock, realtime, thread};
use crate::outputs::{self, Trouble};
use crate::spindle;
use annulus_core::control::{Lateness, Timing, lateness};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::machine::{self, Machine};
use annulus_core::pins::{Clock, Steady};
use annulus_host::executor::{Glimpse, Instruction, Said, Shared};
use std::io;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

/// Interval of position updates and keep-alives.
const GLIMPSES: Duration = Duration::from_millis(20);

const LOOK: Duration = Duration::from_millis(25);

/// Longest silence of the bridge. Counted in checks: time in which this process did not run either does not
/// count.
const SILENCE: Duration = Duration::from_millis(300);

/// How long the last frames may take to leave.
const LAST_FRAMES: Duration = Duration::from_millis(500);

/// For a simulated port only: the lateness of the clock to report, in µs.
const REHEARSED: &str = "ANNULUS_LATENESS_US";

/// The executor's thread and its channel; `None` after its end.
type Thread = Option<(SyncSender<Instruction>, JoinHandle<()>)>;

/// Ends the process; whichever thread calls it first decides.
#[derive(Clone)]
struct Hands {
    thread: Arc<Mutex<Thread>>,
    shared: Arc<Shared>,
    why: Why,
}

impl Hands {
    /// Stops everything and makes it safe; `last` is the executor's last order. Returns when that is done.
    fn end(&self, why: &'static str, last: Instruction) {
        let Ok(mut thread) = self.thread.lock() else { return };
        if let Some((ring, thread)) = thread.take() {
            self.say(why);
            // Covers every ticket, so no task delays the end.
            self.shared.stop(u64::MAX);
            let _ = ring.send(last);
            let _ = thread.join();
        }
    }

    /// Returns `true` if the thread ended without an order.
    fn died(&self) -> bool {
        // `end` holds the lock while it joins the thread; that is no death.
        let Ok(thread) = self.thread.try_lock() else { return false };
        thread.as_ref().is_some_and(|(_, thread)| thread.is_finished())
    }

    fn say(&self, why: &'static str) {
        if let Ok(mut place) = self.why.lock()
            // The first reason is the cause; later ones only follow from it.
            && *place == RUNNING
        {
            *place = why;
        }
    }

    fn send(&self, message: Instruction) {
        if let Ok(thread) = self.thread.lock()
            && let Some((ring, _)) = &*thread
        {
            let _ = ring.send(message);
        }
    }
}

/// No reason for the end has been set yet.
const RUNNING: &str = "finished";

/// Runs until the bridge ends it, dies or stalls.
pub(crate) fn run() -> io::Result<()> {
    let Some(Down::Start { settings, record, measured }) = frames::receive(&mut io::stdin().lock())? else {
        return Err(io::ErrorKind::InvalidData.into());
    };
    let (up, frames_up) = channel();
    let machine = machine::apply(&machine::virtual_drill(), &settings);
    let begun = machine.map_err(|mut refusals| refusals.remove(0)).and_then(|machine| {
        Ok((begin(&machine, &record, measured, &up)?, super::patience(&machine, SILENCE)))
    });
    let ((hands, trouble, offsets), patience) = match begun {
        Ok(begun) => begun,
        Err(why) => return frames::send(&mut io::stdout().lock(), &Up::Refused(why)),
    };
    watch_signals(hands.clone());
    let (body, frames_down) = channel();
    std::thread::Builder::new().name("pipe".to_owned()).spawn(move || read(&body))?;
    let (told, all_told) = channel();
    let writer = {
        let (hands, trouble) = (hands.clone(), Arc::clone(&trouble));
        move || {
            write(&frames_up, &hands, &trouble);
            let _ = told.send(());
        }
    };
    std::thread::Builder::new().name("frames".to_owned()).spawn(writer)?;
    match obey(&frames_down, &hands, &offsets, patience) {
        End::Asked => hands.end(RUNNING, Instruction::Finish),
        End::Gone => hands.end("bridge_gone", Instruction::Abandon),
        End::Silent => {
            hands.end("bridge_silent", Instruction::Abandon);
            let _ = up.send(Up::Refused(error!("output.bridge_silent")));
        }
    }
    drop(up);
    // A stalled bridge does not read: do not wait for it.
    let _ = all_told.recv_timeout(LAST_FRAMES);
    if trouble.get().is_some() {
        // Nothing was made safe: the exit code must show that to the parent process.
        std::process::exit(1);
    }
    Ok(())
}

/// Passes on raw frames from the pipe until it ends. They are parsed later, so that parsing a large task
/// does not count as silence.
fn read(body: &Sender<Vec<u8>>) {
    let mut pipe = io::stdin().lock();
    while let Ok(Some(bytes)) = frames::receive_bytes(&mut pipe) {
        if body.send(bytes).is_err() {
            return;
        }
    }
}

enum End {
    /// The bridge requested it.
    Asked,
    /// The bridge is gone, or not understood.
    Gone,
    /// The bridge exists but is silent.
    Silent,
}

fn obey(frames_down: &Receiver<Vec<u8>>, hands: &Hands, offsets: &Offsets, patience: Duration) -> End {
    let mut silent = Duration::ZERO;
    loop {
        let bytes = match frames_down.recv_timeout(LOOK) {
            Ok(bytes) => bytes,
            Err(RecvTimeoutError::Disconnected) => return End::Gone,
            Err(RecvTimeoutError::Timeout) => {
                silent += LOOK;
                if silent >= patience {
                    return End::Silent;
                }
                continue;
            }
        };
        silent = Duration::ZERO;
        match serde_json::from_slice(&bytes) {
            Ok(Down::Said(Said::Order(Instruction::Finish))) => return End::Asked,
            Ok(Down::Said(Said::Order(message))) => {
                if let Instruction::Correct { axis, steps } = &message
                    && let Some(offset) = offsets.get(*axis)
                {
                    offset.fetch_add(*steps, Ordering::SeqCst);
                }
                hands.send(message);
            }
            Ok(Down::Said(Said::Stop { upto: id })) => hands.shared.stop(id),
            Ok(Down::Said(Said::Durable { legs })) => hands.shared.set_durable(legs),
            Ok(Down::Said(Said::FeedOverride { percent })) => hands.shared.set_feed_override(percent),
            Ok(Down::Said(Said::Grant)) => hands.shared.grant(),
            Ok(Down::Said(Said::Revoke)) => hands.shared.revoke(),
            Ok(Down::Said(Said::Hold { id, number })) => hands.shared.hold_as(id, number),
            Ok(Down::Said(Said::Lift { id })) => hands.shared.lift(id),
            Ok(Down::Said(Said::Go)) => hands.shared.go(),
            Ok(Down::Alive) => {}
            Ok(Down::Start { .. }) | Err(_) => return End::Gone,
        }
    }
}

/// Takes over the outputs, makes them safe, and starts the thread, which first measures its clock.
fn begin(
    machine: &Machine,
    record: &Path,
    measured: Option<Lateness>,
    up: &Sender<Up>,
) -> Result<(Hands, Trouble, Offsets), Diagnostic> {
    let cannot = |error: io::Error| error!("output.executor_failed", reason = error);
    let wires = outputs::open(machine)?;
    let trouble = wires.trouble();
    let (offsets, why) = (Offsets::default(), Why::new(Mutex::new(RUNNING)));
    let pins = Recorded::new(wires, record, Arc::clone(&offsets), Arc::clone(&why)).map_err(cannot)?;
    let shared = Arc::new(Shared::new(clock::time));
    let not_locked = realtime::ask_for_memory();
    let start_stop_hz = f64::from(machine.wiring().start_stop_hz);
    let rehearsed = rehearsed(machine);
    let ready = up.clone();
    let first = move || {
        let no_realtime = realtime::ask_for_class();
        let known = rehearsed.or(measured);
        let lateness = known.unwrap_or_else(|| measure(&mut StepClock::new(), MEASURED));
        let safe_hz = lateness::safe_rate(&lateness, start_stop_hz);
        let _ = ready.send(Up::Ready(Timing { lateness, safe_hz, no_realtime, not_locked }));
    };
    let reports = up.clone();
    let report = move |report| drop(reports.send(Up::Report(report)));
    let clock = clock_of(machine).map_err(cannot)?;
    let told = Arc::clone(&shared);
    let pins = spindle::with(machine, Box::new(Steady::new(pins)), move |state| {
        told.change_glimpse(|glimpse| glimpse.spindle = state);
    })?;
    let thread = thread::start(machine, pins, clock, Arc::clone(&shared), first, report).map_err(cannot)?;
    Ok((Hands { thread: Arc::new(Mutex::new(Some(thread))), shared, why }, trouble, offsets))
}

/// Real time, unless the simulator of a simulated port keeps the time.
fn clock_of(machine: &Machine) -> io::Result<Box<dyn Clock + Send>> {
    #[cfg(unix)]
    if rehearsal_clock::is_requested(machine) {
        return Ok(Box::new(RehearsalClock::open(machine)?));
    }
    Ok(Box::new(StepClock::new()))
}

/// The lateness to report for a simulated port; `None` on real hardware.
fn rehearsed(machine: &Machine) -> Option<Lateness> {
    let us: f64 = std::env::var(REHEARSED).ok()?.parse().ok()?;
    outputs::is_rehearsal(machine).then(|| Lateness::of(&mut [us]))
}

/// Sends reports as they arrive, position updates in between, and the port's refusal.
fn write(frames_up: &Receiver<Up>, hands: &Hands, trouble: &Trouble) {
    let mut pipe = io::stdout().lock();
    let (mut told, mut refused) = (Glimpse::default(), false);
    loop {
        let frame = frames_up.recv_timeout(GLIMPSES);
        let latest = hands.shared.glimpse();
        let sent = match frame {
            Ok(Up::Report(report)) => {
                // Position first: the receiver of the report must see where it ended.
                let place = Glimpse { position: report.position, inputs: report.inputs, ..latest };
                frames::send(&mut pipe, &Up::Glimpse(place))
                    .and_then(|()| frames::send(&mut pipe, &Up::Report(report)))
            }
            Ok(frame) => frames::send(&mut pipe, &frame),
            Err(RecvTimeoutError::Timeout) if latest != told => {
                told = latest;
                frames::send(&mut pipe, &Up::Glimpse(latest))
            }
            // Without a sign of life the bridge would take this process for dead.
            Err(RecvTimeoutError::Timeout) => frames::send(&mut pipe, &Up::Alive),
            Err(RecvTimeoutError::Disconnected) => return,
        };
        if hands.died() {
            // Without its thread this process can do nothing: the bridge makes the outputs safe.
            let why = error!("output.executor_failed", reason = "its thread ended");
            let _ = frames::send(&mut pipe, &Up::Refused(why));
            std::process::exit(1);
        }
        if let (Some(reason), false) = (trouble.get(), refused) {
            refused = true;
            hands.say("port_refused");
            hands.shared.stop(u64::MAX);
            let why = error!("output.port_refused", reason = reason);
            let _ = frames::send(&mut pipe, &Up::Refused(why));
        }
        if sent.is_err() {
            // The bridge is gone; the other end of the pipe shows that too.
            return;
        }
    }
}

/// Ends the process in a controlled way on a signal of the system.
fn watch_signals(hands: Hands) {
    let watch = move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        let Ok(runtime) = runtime else { return };
        let signalled = runtime.block_on(async {
            match crate::signals::Signals::new() {
                Ok(mut signals) => {
                    signals.wait().await;
                    true
                }
                Err(_) => false,
            }
        });
        if signalled {
            hands.end("signal", Instruction::Abandon);
            std::process::exit(0);
        }
    };
    let _ = std::thread::Builder::new().name("signals".to_owned()).spawn(watch);
}
