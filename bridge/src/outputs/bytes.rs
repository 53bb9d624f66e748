//! The output bytes of a port: requested and written levels, and the charge pump that toggles one of the
//! bits.
//!
//! ```text
//! signals that are on ──▶ image ─┬─ xor active-low bits ──▶ differs from its shadow: written
//!              charge pump, in its own thread ─┘
//! ```
//!
//! The pump shows the driver board that this program is alive. The pump stops if the program dies, or if
//! the stepping thread is silent during motion; the board then switches the motors off.
//!
//! After the port has refused once, nothing more is written.

use super::Port;
use annulus_core::machine::Wiring;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

pub(super) const BYTES: usize = 4;

/// Longest silence of the stepping thread during motion.
const SILENCE: Duration = Duration::from_millis(100);

pub(crate) type Trouble = Arc<OnceLock<String>>;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Bit {
    pub(super) byte: usize,
    pub(super) mask: u8,
}

impl Bit {
    /// The bit with this number; `None` for a signal without a wire.
    pub(super) fn of(number: i8) -> Option<Self> {
        // A negative number means that the signal has no wire.
        let number = usize::try_from(number).ok().filter(|number| *number < 8 * BYTES)?;
        Some(Self { byte: number / 8, mask: 1 << (number % 8) })
    }
}

/// The levels of all signals; everything else is off.
pub(super) type Image = [u8; BYTES];

pub(super) fn turn_on(image: &mut Image, bit: Bit) {
    image[bit.byte] |= bit.mask;
}

/// The wired bytes, each with its active-low bits.
pub(super) fn wired(wiring: &Wiring) -> [Option<u8>; BYTES] {
    let mut wired = [None; BYTES];
    for bit in wiring.signals().filter_map(|(_, bit)| Bit::of(bit)) {
        wired[bit.byte] = Some(wiring.low_bits(bit.byte));
    }
    wired
}

/// Turns every wired output off; continues after a refusal.
pub(super) fn all_off(wiring: &Wiring, port: &mut dyn Port) -> io::Result<()> {
    let mut all = Ok(());
    for (byte, low) in wired(wiring).into_iter().enumerate() {
        if let Some(off) = low {
            let one = port.write(byte, off);
            // Every byte gets its chance to go off; only the first refusal is reported.
            all = all.and(one);
        }
    }
    all
}

pub(super) struct Bytes {
    port: Box<dyn Port>,
    image: Image,
    pump: Option<Bit>,
    pumped: bool,
    /// Active-low bits of every wired byte; the last written levels.
    low: Image,
    shadow: [Option<u8>; BYTES],
    trouble: Trouble,
}

impl Bytes {
    pub(super) fn new(wiring: &Wiring, mut port: Box<dyn Port>) -> io::Result<Self> {
        all_off(wiring, &mut *port)?;
        let shadow = wired(wiring);
        let low = shadow.map(Option::unwrap_or_default);
        let pump = Bit::of(wiring.drivers.charge_pump);
        let trouble = Trouble::default();
        Ok(Self { port, image: [0; BYTES], pump, pumped: false, low, shadow, trouble })
    }

    pub(super) fn trouble(&self) -> &Trouble {
        &self.trouble
    }

    pub(super) fn put(&mut self, image: Image) {
        self.image = image;
        self.write();
    }

    /// Toggles the charge pump.
    fn pump(&mut self) {
        self.pumped = !self.pumped;
        self.write();
    }

    fn write(&mut self) {
        let mut wanted = self.image;
        if let Some(bit) = self.pump.filter(|_| self.pumped) {
            turn_on(&mut wanted, bit);
        }
        for (byte, value) in wanted.into_iter().enumerate() {
            let value = value ^ self.low[byte];
            // Each write costs bus time, so an unchanged byte is left out. After a refusal the levels are
            // unknown.
            if self.shadow[byte].is_none_or(|shadow| shadow == value) || self.trouble.get().is_some() {
                continue;
            }
            match self.port.write(byte, value) {
                Ok(()) => self.shadow[byte] = Some(value),
                Err(error) => drop(self.trouble.set(error.to_string())),
            }
        }
    }

    pub(super) fn read(&mut self, byte: usize) -> io::Result<u8> {
        self.port.read(byte)
    }
}

#[derive(Clone)]
pub(super) struct SharedBytes(Arc<Mutex<Bytes>>);

impl SharedBytes {
    pub(super) fn new(bytes: Bytes) -> Self {
        Self(Arc::new(Mutex::new(bytes)))
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Bytes> {
        // Even if another thread panicked, the outputs must still go off.
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

struct Life {
    began: Instant,
    /// Time of the last sign, ns since `began`.
    heard_ns: AtomicU64,
    moves: AtomicBool,
    ends: AtomicBool,
}

impl Life {
    fn new() -> Self {
        Self {
            began: Instant::now(),
            heard_ns: AtomicU64::new(0),
            moves: AtomicBool::new(false),
            ends: AtomicBool::new(false),
        }
    }

    fn hear(&self, since: Duration, moves: bool) {
        self.heard_ns.store(since.as_nanos() as u64, Ordering::Relaxed);
        self.moves.store(moves, Ordering::Relaxed);
    }

    /// Returns `true` if the pump may continue at the time `since`.
    fn goes_on(&self, since: Duration) -> bool {
        let heard = Duration::from_nanos(self.heard_ns.load(Ordering::Relaxed));
        // At rest no thread reports in; only during motion does silence mean that the loop hangs.
        !self.moves.load(Ordering::Relaxed) || since.saturating_sub(heard) <= SILENCE
    }
}

/// The pump's thread; it ends when this is dropped.
pub(super) struct Pump {
    life: Arc<Life>,
    /// Half a period, and the bytes; `None` without a pump, or after its start.
    waits: Option<(Duration, SharedBytes)>,
    thread: Option<JoinHandle<()>>,
    trouble: Trouble,
}

impl Pump {
    pub(super) fn new(wiring: &Wiring, bytes: &SharedBytes) -> Self {
        // One period has two edges.
        let half = Duration::from_secs(1) / (2 * wiring.drivers.charge_pump_hz.max(1));
        let waits = Bit::of(wiring.drivers.charge_pump).map(|_| (half, bytes.clone()));
        let trouble = bytes.lock().trouble().clone();
        Self { life: Arc::new(Life::new()), waits, thread: None, trouble }
    }

    /// A sign of life of the stepping thread; `moves` during motion. The first one starts the pump: its
    /// thread inherits the priority of the stepping thread. A lower priority would hold the lock while the
    /// stepping thread waits for it.
    pub(super) fn hear(&mut self, moves: bool) {
        if let Some((half, bytes)) = self.waits.take() {
            self.start(half, bytes);
        }
        if self.thread.is_some() {
            self.life.hear(self.life.began.elapsed(), moves);
        }
    }

    fn start(&mut self, half: Duration, bytes: SharedBytes) {
        let own = Arc::clone(&self.life);
        let pump = move || {
            while !own.ends.load(Ordering::Relaxed) {
                thread::sleep(half);
                if own.goes_on(own.began.elapsed()) {
                    bytes.lock().pump();
                }
            }
        };
        match thread::Builder::new().name("charge pump".to_owned()).spawn(pump) {
            Ok(thread) => self.thread = Some(thread),
            // Without the pump the drivers stay off.
            Err(error) => drop(self.trouble.set(error.to_string())),
        }
    }
}

impl Drop for Pump {
    fn drop(&mut self) {
        self.life.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Nowhere;

    impl Port for Nowhere {
        fn write(&mut self, _: usize, _: u8) -> io::Result<()> {
            Ok(())
        }

        fn read(&mut self, _: usize) -> io::Result<u8> {
            Ok(0)
        }
    }

    #[test]
    fn charge_pump_starts_with_the_first_heartbeat() {
        let machine = annulus_core::machine::lab();
        let mut wiring = machine.wiring().clone();
        wiring.drivers.charge_pump = 4;
        let bytes = SharedBytes::new(Bytes::new(&wiring, Box::new(Nowhere)).unwrap());
        let mut pump = Pump::new(&wiring, &bytes);
        assert!(pump.thread.is_none());
        pump.hear(false);
        assert!(pump.thread.is_some());
        let mut none = Pump::new(machine.wiring(), &bytes);
        none.hear(true);
        assert!(none.thread.is_none());
    }

    #[test]
    fn charge_pump_stops_100_ms_after_a_heartbeat_in_motion() {
        let ms = Duration::from_millis;
        let life = Life::new();
        let rows = [
            // heard at, moves, asked at, continues
            (0, false, 50, true),
            (0, false, 5_000, true),
            (5_000, true, 5_100, true),
            (5_000, true, 5_101, false),
            (5_200, true, 5_201, true),
            (5_300, false, 60_000, true),
        ];
        for (heard, moves, asked, goes_on) in rows {
            life.hear(ms(heard), moves);
            assert_eq!(life.goes_on(ms(asked)), goes_on, "{heard} {asked}");
        }
    }
}
