//! The time of a simulated port, advanced by the test that simulates its machine. A busy computer makes it
//! slower, never late.
//!
//! ```text
//! 0xFF00  the tick that the executor waits for
//! 0xFF08  the tick that the machine has reached    written here
//! ```

use annulus_core::steps::TICK_HZ;
use std::fs::{File, OpenOptions};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Environment variable for the bridge whose executor takes its time from here.
pub(crate) const REQUEST: (&str, &str) = ("ANNULUS_REHEARSAL_CLOCK", "1");

const AWAITED_AT: u64 = 0xFF00;
const REACHED_AT: u64 = 0xFF08;

const LOOK: Duration = Duration::from_micros(200);

/// Largest advance of machine time per reading, even after a delay.
const LARGEST_STEP: Duration = Duration::from_millis(5);

/// How far and how fast the machine may run.
pub(crate) struct Limits {
    until: AtomicU64,
    /// Machine time as percent of real time.
    percent: AtomicU64,
    reached: AtomicU64,
    ends: AtomicBool,
}

impl Limits {
    pub(crate) fn none() -> Self {
        Self {
            until: AtomicU64::new(u64::MAX),
            percent: AtomicU64::new(100),
            reached: AtomicU64::new(0),
            ends: AtomicBool::new(false),
        }
    }

    pub(crate) fn allow(&self, time: Duration) {
        let more = time.as_micros() as u64 * (TICK_HZ / 1_000_000);
        self.until.store(self.reached.load(Ordering::SeqCst).saturating_add(more), Ordering::SeqCst);
    }

    pub(crate) fn free(&self) {
        self.until.store(u64::MAX, Ordering::SeqCst);
    }

    pub(crate) fn slow(&self, percent: u64) {
        self.percent.store(percent, Ordering::SeqCst);
    }

    pub(crate) fn end(&self) {
        self.ends.store(true, Ordering::SeqCst);
    }
}

/// Keeps the time of the port file `device` until the end. Calls `look` with the device and the tick before
/// each advance.
pub(crate) fn keep(device: &Path, limits: &Limits, mut look: impl FnMut(&File, u64)) {
    let device = OpenOptions::new().read(true).write(true).open(device).unwrap();
    let read = |place| {
        let mut tick = [0; 8];
        device.read_exact_at(&mut tick, place).unwrap();
        u64::from_le_bytes(tick)
    };
    let (mut reached, mut since) = (read(REACHED_AT), Instant::now());
    while !limits.ends.load(Ordering::SeqCst) {
        let awaited = read(AWAITED_AT);
        look(&device, reached);
        let passed = since.elapsed().min(LARGEST_STEP).as_nanos() as u64 * TICK_HZ / 1_000_000_000;
        since = Instant::now();
        let until = awaited.min(limits.until.load(Ordering::SeqCst));
        if reached < until {
            reached = until.min(reached + passed * limits.percent.load(Ordering::SeqCst) / 100);
            limits.reached.store(reached, Ordering::SeqCst);
            if reached == awaited {
                look(&device, reached);
                device.write_all_at(&reached.to_le_bytes(), REACHED_AT).unwrap();
                continue;
            }
        }
        thread::sleep(LOOK);
    }
}
