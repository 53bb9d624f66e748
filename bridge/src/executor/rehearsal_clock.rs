//! The clock of a simulated port whose machine is simulated by another program: time passes only as that
//! program allows.
//!
//! ```text
//! 0xFF00  the tick that the executor waits for   written here    8 bytes, little-endian
//! 0xFF08  the tick that the machine has reached  written by the simulator
//! ```

use annulus_core::machine::Machine;
use annulus_core::pins::Clock;
use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::FileExt;
use std::thread;
use std::time::{Duration, Instant};

/// If set, the simulator of a simulated port keeps the executor's time.
const REQUESTED: &str = "ANNULUS_REHEARSAL_CLOCK";

/// Offsets of the two ticks in the file. No card has ports there.
const AWAITED_AT: u64 = 0xFF00;
const REACHED_AT: u64 = 0xFF08;

const LOOK: Duration = Duration::from_micros(50);

/// A simulator that is silent for this long has ended: the executor must still be able to stop.
const SIMULATOR_GONE: Duration = Duration::from_secs(30);

/// Returns `true` if the simulator keeps the time. Has no effect on a real device.
pub(super) fn is_requested(machine: &Machine) -> bool {
    std::env::var_os(REQUESTED).is_some() && crate::outputs::is_rehearsal(machine)
}

/// A clock that is never late, because its time stops until the simulator advances it.
pub(super) struct RehearsalClock {
    device: File,
    reached: u64,
}

impl RehearsalClock {
    /// Opens the port file of `machine`. Starts at the later of both ticks, which a previous executor may
    /// have left.
    pub(super) fn open(machine: &Machine) -> io::Result<Self> {
        let device = OpenOptions::new().read(true).write(true).open(&machine.wiring().device)?;
        let mut clock = Self { device, reached: 0 };
        clock.reached = clock.read(AWAITED_AT)?.max(clock.read(REACHED_AT)?);
        Ok(clock)
    }

    fn read(&self, place: u64) -> io::Result<u64> {
        let mut tick = [0; 8];
        self.device.read_exact_at(&mut tick, place)?;
        Ok(u64::from_le_bytes(tick))
    }
}

impl Clock for RehearsalClock {
    fn now(&mut self) -> u64 {
        self.reached
    }

    fn wait_until(&mut self, tick: u64) -> u64 {
        if tick <= self.reached {
            return self.reached;
        }
        let since = Instant::now();
        let _ = self.device.write_all_at(&tick.to_le_bytes(), AWAITED_AT);
        while since.elapsed() < SIMULATOR_GONE && self.read(REACHED_AT).is_ok_and(|reached| reached < tick) {
            thread::sleep(LOOK);
        }
        self.reached = tick;
        tick
    }
}
