//! The spindle on a frequency converter at a serial port.
//!
//! ```text
//! executor ── spindle 20000 ──▶ watch ── asks ──▶ this thread ── bytes ──▶ converter
//!    ▲                            │    ◀─ answers ──┘            ◀──────────┘
//!    └── at speed? lost? ─────────┘        down only at speed; the tool lifts if the spindle is lost
//! ```
//!
//! The thread lives in the executor's process: if the bridge dies, that process stops, lifts the tool and
//! then switches the spindle off through it.

mod frames;
mod late;
mod profile;
mod watch;

use annulus_core::error;
pub(crate) use profile::names;

use crate::machine_file;
use crate::serial::{self, Port};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Converter, Machine};
use annulus_core::pass_pins_on;
use annulus_core::pins::{Pins, SpindleState, SpindleTrouble};
use frames::{Answer, Ask};
use late::Late;
use profile::Profile;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use watch::{Limits, TRIES, Watch};

const ANSWER: Duration = Duration::from_millis(60);

/// Wait if there is nothing to ask, or no port.
const PAUSE: Duration = Duration::from_millis(2);

/// Interval of attempts to open a missing port.
const REOPEN: Duration = Duration::from_millis(500);

/// Extra time to reach the speed, beyond twice the machine's spin-up time.
const SPIN_UP_MORE: Duration = Duration::from_secs(3);

/// How long the end waits until the converter has confirmed the stop.
const LAST: Duration = Duration::from_millis(800);

/// The pins of `machine`. If it has a converter, the spindle is switched there and reports its state. At
/// every change, another thread calls `tell`.
pub(crate) fn with(
    machine: &Machine,
    pins: Box<dyn Pins + Send>,
    tell: impl Fn(SpindleState) + Send + 'static,
) -> Result<Box<dyn Pins + Send>, Diagnostic> {
    if !machine.converter.is_there() {
        return Ok(pins);
    }
    let profile = profile_of(machine)?;
    fits(&profile, machine)?;
    let limits = Limits {
        tolerance_share: machine.converter.tolerance_percent / 100.0,
        spin_up: Duration::from_secs_f64(machine.process.spin_up_ms * 2e-3) + SPIN_UP_MORE,
        run_writes: profile.run.len(),
        stop_writes: profile.stop.len(),
        tells_faults: profile.fault.is_some(),
    };
    let shared = Arc::new(Watched {
        began: Instant::now(),
        watch: Mutex::new(Watch::new(limits)),
        ends: AtomicBool::new(false),
    });
    let (line, own) = (Line::new(profile, machine.converter.clone()), Arc::clone(&shared));
    let thread = thread::Builder::new()
        .name("spindle".to_owned())
        .spawn(move || own.run(line, tell))
        .map_err(|error| error!("control.no_thread", reason = error))?;
    Ok(Box::new(Converted { pins, shared, thread: Some(thread) }))
}

/// The profile title of the converter of `machine`, or why it cannot be used.
pub(crate) fn check(machine: &Machine) -> Result<String, Diagnostic> {
    let profile = profile_of(machine)?;
    fits(&profile, machine)?;
    Ok(profile.title)
}

fn profile_of(machine: &Machine) -> Result<Profile, Diagnostic> {
    profile::named(&machine.converter.profile, &machine_file::converters())
}

/// Checks that the machine's speed fits into the profile's register. A stop needs no number.
fn fits(profile: &Profile, machine: &Machine) -> Result<(), Diagnostic> {
    let rpm = machine.process.spindle_rpm;
    if !profile.speed.reaches(rpm, &machine.converter) {
        let why = error!("spindle.beyond", name = &machine.converter.profile, ..);
        return Err(why.with("rpm", rpm).with("most", u16::MAX));
    }
    Ok(())
}

pub(crate) fn make_safe(machine: &Machine) -> Result<(), Diagnostic> {
    if !machine.converter.is_there() {
        return Ok(());
    }
    let profile = profile_of(machine)?;
    let writes = profile.stop.len();
    let mut line = Line::new(profile, machine.converter.clone());
    let since = Instant::now();
    let mut all = Ok(());
    // Try all of them, even if one fails; long enough for a port that the dead process has not released
    // yet.
    for place in 0..writes {
        let mut tries = 0;
        while let Err(trouble) = line.ask(Ask::Stop { place }) {
            tries += 1;
            if tries >= TRIES && since.elapsed() >= LAST {
                all = all.and(Err(trouble.diagnostic()));
                break;
            }
        }
    }
    all
}

struct Watched {
    began: Instant,
    watch: Mutex<Watch>,
    ends: AtomicBool,
}

impl Watched {
    fn watch(&self) -> MutexGuard<'_, Watch> {
        self.watch.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run(&self, mut line: Line, tell: impl Fn(SpindleState)) {
        let mut told = SpindleState::Untold;
        let mut ending: Option<Duration> = None;
        loop {
            let now = self.began.elapsed();
            if self.ends.load(Ordering::Relaxed) {
                let since = *ending.get_or_insert(now);
                if self.watch().is_over() || now - since > LAST {
                    return;
                }
            }
            let next = self.watch().next(now);
            match next {
                None => thread::sleep(PAUSE),
                Some(ask) => {
                    // A write, above all a stop, must not wait for a reading.
                    let is_urgent = || self.watch().has_writes();
                    if let Some(answer) = line.ask_unless(ask, &is_urgent) {
                        self.watch().heard(ask, answer, self.began.elapsed());
                    }
                }
            }
            let state = self.watch().state();
            if state != told {
                told = state;
                tell(state);
            }
        }
    }
}

struct Line {
    profile: Profile,
    converter: Converter,
    port: Option<Port>,
    tried: Option<Instant>,
    began: Instant,
    late: Late,
}

impl Line {
    fn new(profile: Profile, converter: Converter) -> Self {
        let (began, late) = (Instant::now(), Late::default());
        Self { profile, converter, port: None, tried: None, began, late }
    }

    fn ask(&mut self, ask: Ask) -> Result<Answer, SpindleTrouble> {
        self.ask_unless(ask, &|| false).unwrap_or(Err(SpindleTrouble::Silent))
    }

    /// Asks once no late answer can arrive any longer; gives up if something urgent is pending.
    fn ask_unless(
        &mut self,
        ask: Ask,
        is_urgent: &dyn Fn() -> bool,
    ) -> Option<Result<Answer, SpindleTrouble>> {
        let frame = frames::frame(ask, &self.profile, &self.converter);
        let Some(frame) = frame else { return Some(Ok(Answer::Done)) };
        let quiet_until = self.late.quiet_until(ask).unwrap_or_default();
        while self.began.elapsed() < quiet_until {
            if is_urgent() {
                return None;
            }
            if self.port().and_then(Port::read).is_err() {
                break;
            }
        }
        self.late.asked(ask, self.began.elapsed());
        let heard = self.say(&frame);
        let answer = self.read(&frame, heard);
        self.late.over(answer.is_ok());
        Some(answer)
    }

    fn read(
        &mut self,
        frame: &frames::Frame,
        heard: std::io::Result<Vec<u8>>,
    ) -> Result<Answer, SpindleTrouble> {
        match heard {
            Ok(heard) if heard.is_empty() => Err(SpindleTrouble::Silent),
            Ok(heard) => frame.answer(&heard, &self.profile, &self.converter),
            Err(error) => {
                tracing::debug!(%error, port = self.converter.port, "spindle");
                self.port = None;
                thread::sleep(PAUSE * 5);
                Err(SpindleTrouble::Silent)
            }
        }
    }

    fn say(&mut self, frame: &frames::Frame) -> std::io::Result<Vec<u8>> {
        let port = self.port()?;
        // Discard late bytes, and wait for silence between two frames. A line that is never silent is used
        // anyway, within the time limit of the answer: perhaps a stop gets through.
        let mut asked = Instant::now();
        while !port.read()?.is_empty() && asked.elapsed() < ANSWER / 2 {}
        if asked.elapsed() < ANSWER / 2 {
            asked = Instant::now();
        }
        port.write(&frame.bytes)?;
        let mut heard = Vec::new();
        loop {
            heard.extend(port.read()?);
            if let Some(length) = frame.answer_length(&heard).filter(|length| heard.len() >= *length) {
                heard.truncate(length);
                return Ok(heard);
            }
            if asked.elapsed() >= ANSWER {
                return Ok(heard);
            }
        }
    }

    fn port(&mut self) -> std::io::Result<&mut Port> {
        if self.port.is_none() {
            if self.tried.is_some_and(|tried| tried.elapsed() < REOPEN) {
                return Err(std::io::ErrorKind::NotConnected.into());
            }
            self.tried = Some(Instant::now());
            let baud = if self.converter.baud > 0 { self.converter.baud } else { self.profile.baud };
            let parity = match self.profile.parity {
                profile::Parity::None => serial::Parity::None,
                profile::Parity::Even => serial::Parity::Even,
                profile::Parity::Odd => serial::Parity::Odd,
            };
            let stop_bits =
                if self.profile.stop_bits == 2 { serial::StopBits::Two } else { serial::StopBits::One };
            self.port = Some(serial::open_as(&self.converter.port, baud, parity, stop_bits)?);
        }
        self.port.as_mut().ok_or_else(|| std::io::ErrorKind::NotConnected.into())
    }
}

struct Converted {
    pins: Box<dyn Pins + Send>,
    shared: Arc<Watched>,
    thread: Option<JoinHandle<()>>,
}

impl Converted {
    fn want(&self, rpm: u32) {
        self.shared.watch().want(rpm, self.shared.began.elapsed());
    }
}

impl Pins for Converted {
    pass_pins_on!(step, inputs, output, rest, due, bit, stock, ahead, attend);

    fn spindle(&mut self, at_tick: u64, rpm: u32) {
        self.want(rpm);
        self.pins.spindle(at_tick, rpm);
    }

    fn spindle_state(&mut self) -> SpindleState {
        // The thread may hang at its port: its silence counts like the converter's.
        let now = self.shared.began.elapsed();
        let mut watch = self.shared.watch();
        watch.passed(now);
        watch.state()
    }

    fn safe(&mut self) {
        self.want(0);
        self.pins.safe();
    }
}

impl Drop for Converted {
    fn drop(&mut self) {
        self.want(0);
        self.shared.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
