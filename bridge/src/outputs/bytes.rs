//! The output bytes of a port: what is to be on them, what is, and the charge pump that goes to and fro on one bit of them.
//!
//! ```text
//! signals that are on ──▶ image ─┬─ xor bits that are on when low ──▶ differs from its shadow: written
//!              charge pump, a thread of its own ─┘
//! ```
//!
//! The pump tells the drivers' board that this program lives. It stands still when the program is gone, and also when whoever
//! steps has not been heard of for a moment while something moves: then the board switches the motors off.
//!
//! Comes in: images. Goes out: single bytes at a [`Port`], those alone that changed. After the port refused once, nothing more is
//! written. Does not know what the bits mean.

use super::Port;
use annulus_core::machine::Wiring;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Output bytes there can be.
pub(super) const BYTES: usize = 4;

/// So long nothing may be heard while something moves.
const SILENCE: Duration = Duration::from_millis(100);

/// Why the port refused, once it did.
pub(crate) type Trouble = Arc<OnceLock<String>>;

/// One bit of a byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Bit {
    pub(super) byte: usize,
    pub(super) mask: u8,
}

impl Bit {
    /// The bit with this number; none for a signal without a wire.
    pub(super) fn of(number: i8) -> Option<Self> {
        let number = usize::try_from(number).ok().filter(|number| *number < 8 * BYTES)?;
        Some(Self { byte: number / 8, mask: 1 << (number % 8) })
    }
}

/// A signal's level on every byte, everything else off.
pub(super) type Image = [u8; BYTES];

/// Sets the bit `bit` of `image`.
pub(super) fn turn_on(image: &mut Image, bit: Bit) {
    image[bit.byte] |= bit.mask;
}

/// The bytes that have a wire, each with its bits that are on when they are 0.
pub(super) fn wired(wiring: &Wiring) -> [Option<u8>; BYTES] {
    let mut wired = [None; BYTES];
    for bit in wiring.signals().filter_map(|(_, bit)| Bit::of(bit)) {
        wired[bit.byte] = Some(wiring.low_bits(bit.byte));
    }
    wired
}

/// Turns every output that has a wire off: all of them, even where one is refused.
pub(super) fn all_off(wiring: &Wiring, port: &mut dyn Port) -> io::Result<()> {
    let mut all = Ok(());
    for (byte, low) in wired(wiring).into_iter().enumerate() {
        if let Some(off) = low {
            let one = port.write(byte, off);
            all = all.and(one);
        }
    }
    all
}

/// The bytes.
pub(super) struct Bytes {
    port: Box<dyn Port>,
    image: Image,
    pump: Option<Bit>,
    pumped: bool,
    /// Bits that are on when low, of every byte with a wire; and what is on it.
    low: Image,
    shadow: [Option<u8>; BYTES],
    trouble: Trouble,
}

impl Bytes {
    /// Everything off.
    pub(super) fn new(wiring: &Wiring, mut port: Box<dyn Port>) -> io::Result<Self> {
        all_off(wiring, &mut *port)?;
        let shadow = wired(wiring);
        let low = shadow.map(Option::unwrap_or_default);
        let pump = Bit::of(wiring.drivers.charge_pump);
        let trouble = Trouble::default();
        Ok(Self { port, image: [0; BYTES], pump, pumped: false, low, shadow, trouble })
    }

    /// Where it is written down that the port refused.
    pub(super) fn trouble(&self) -> &Trouble {
        &self.trouble
    }

    /// Puts `image` on the outputs.
    pub(super) fn put(&mut self, image: Image) {
        self.image = image;
        self.write();
    }

    /// The other level of the charge pump.
    fn pump(&mut self) {
        self.pumped = !self.pumped;
        self.write();
    }

    /// Writes what changed.
    fn write(&mut self) {
        let mut wanted = self.image;
        if let Some(bit) = self.pump.filter(|_| self.pumped) {
            turn_on(&mut wanted, bit);
        }
        for (byte, value) in wanted.into_iter().enumerate() {
            let value = value ^ self.low[byte];
            if self.shadow[byte].is_none_or(|shadow| shadow == value) || self.trouble.get().is_some() {
                continue;
            }
            match self.port.write(byte, value) {
                Ok(()) => self.shadow[byte] = Some(value),
                Err(error) => drop(self.trouble.set(error.to_string())),
            }
        }
    }

    /// The inputs of byte `byte`.
    pub(super) fn read(&mut self, byte: usize) -> io::Result<u8> {
        self.port.read(byte)
    }
}

/// The bytes, as whoever steps and the pump have them.
#[derive(Clone)]
pub(super) struct SharedBytes(Arc<Mutex<Bytes>>);

impl SharedBytes {
    pub(super) fn new(bytes: Bytes) -> Self {
        Self(Arc::new(Mutex::new(bytes)))
    }

    /// The bytes, for one access.
    pub(super) fn lock(&self) -> MutexGuard<'_, Bytes> {
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

/// Signs of life of whoever steps.
struct Life {
    began: Instant,
    /// When it was heard last, ns since then.
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

    /// Whether the pump goes on, `since` the beginning.
    fn goes_on(&self, since: Duration) -> bool {
        let heard = Duration::from_nanos(self.heard_ns.load(Ordering::Relaxed));
        !self.moves.load(Ordering::Relaxed) || since.saturating_sub(heard) <= SILENCE
    }
}

/// The pump's thread. It ends with this.
pub(super) struct Pump {
    life: Arc<Life>,
    /// Half a period, and the bytes; none where there is no pump, or it runs.
    waits: Option<(Duration, SharedBytes)>,
    thread: Option<JoinHandle<()>>,
    trouble: Trouble,
}

impl Pump {
    /// That of `wiring`, where it has one.
    pub(super) fn new(wiring: &Wiring, bytes: &SharedBytes) -> Self {
        let half = Duration::from_secs(1) / (2 * wiring.drivers.charge_pump_hz.max(1));
        let waits = Bit::of(wiring.drivers.charge_pump).map(|_| (half, bytes.clone()));
        let trouble = bytes.lock().trouble().clone();
        Self { life: Arc::new(Life::new()), waits, thread: None, trouble }
    }

    /// Whoever steps lives; and whether it moves something. The first time it is whoever steps that starts the pump: its thread has the
    /// urgency of the one that starts it, and one that had less would hold the bytes while the other waits for them.
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
            // Without it the drivers stay off.
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
    fn the_pump_is_started_by_whoever_steps_and_not_before() {
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
    fn the_pump_stands_still_when_nobody_is_heard_while_something_moves() {
        let ms = Duration::from_millis;
        let life = Life::new();
        let rows = [
            // heard at, moves, asked at, goes on
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
