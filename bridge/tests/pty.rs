//! A board of our own behind a pseudo-terminal. At another speed than its own it hears nothing that it understands, and what it says is
//! noise; a line may be swallowed on its way.

// The same board that the engine's own tests have.
#[allow(dead_code)]
#[path = "../../core/tests/controller/automaton/mod.rs"]
mod automaton;

use automaton::Automaton;
use serialport::{SerialPort, TTYPort};
use std::io::{Read, Write};
use std::mem;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// A board at its port.
pub(crate) struct Board {
    pub(crate) port: String,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// What its thread is asked for, and what it tells.
#[derive(Default)]
struct Shared {
    ends: AtomicBool,
    /// It is to tell how it is.
    asked: AtomicBool,
    told: Mutex<Option<String>>,
    heard: Mutex<Vec<u8>>,
}

impl Board {
    pub(crate) fn at(bits_per_s: u32) -> Self {
        Self::that_swallows(bits_per_s, b"none")
    }

    /// The first line that begins so never comes to it.
    pub(crate) fn that_swallows(bits_per_s: u32, line: &'static [u8]) -> Self {
        Self::with(bits_per_s, line, Automaton::new([0.0; 3]))
    }

    /// One below whose tip a board lies at this height, by the place of its carriage.
    pub(crate) fn over(surface: fn(f64, f64) -> f64) -> Self {
        let mut board = Automaton::new([0.0; 3]);
        board.surface = Some(surface);
        Self::with(115_200, b"none", board)
    }

    /// One that was built without mist.
    pub(crate) fn without_mist() -> Self {
        let mut board = Automaton::new([0.0; 3]);
        board.has_mist = false;
        Self::with(115_200, b"none", board)
    }

    fn with(bits_per_s: u32, line: &'static [u8], mut board: Automaton) -> Self {
        let (mut own, theirs) = TTYPort::pair().unwrap();
        own.set_timeout(Duration::from_millis(1)).unwrap();
        let (port, shared) = (theirs.name().unwrap(), Arc::<Shared>::default());
        let own_shared = Arc::clone(&shared);
        let thread = thread::spawn(move || {
            let shared = own_shared;
            // It was on before anybody listened.
            drop(board.said());
            let (began, mut ticks, mut swallowed) = (Instant::now(), 0, false);
            while !shared.ends.load(Ordering::SeqCst) {
                let same = theirs.baud_rate().is_ok_and(|now| now == bits_per_s);
                let mut bytes = [0; 256];
                if let Ok(count) = own.read(&mut bytes)
                    && same
                {
                    // Nothing else is sent beside a line that stands alone.
                    let found = bytes[..count].windows(line.len()).position(|part| part == line);
                    let count = found.filter(|_| !swallowed).unwrap_or(count);
                    swallowed |= found.is_some();
                    board.hear(&bytes[..count]);
                    shared.heard.lock().unwrap().extend(&bytes[..count]);
                }
                while ticks < began.elapsed().as_millis() {
                    board.tick();
                    ticks += 1;
                }
                let said = board.said().into_iter().map(|byte| if same { byte } else { !byte });
                let _ = own.write_all(&said.collect::<Vec<_>>());
                if shared.asked.swap(false, Ordering::SeqCst) {
                    board.hear(b"?");
                    board.tick();
                    ticks += 1;
                    *shared.told.lock().unwrap() = Some(String::from_utf8_lossy(&board.said()).into_owned());
                }
            }
        });
        Self { port, shared, thread: Some(thread) }
    }

    /// Everything that it heard.
    pub(crate) fn heard(&self) -> String {
        String::from_utf8_lossy(&self.shared.heard.lock().unwrap()).into_owned()
    }

    /// What a report of it says now, which nobody else hears.
    pub(crate) fn report(&self) -> String {
        self.shared.asked.store(true, Ordering::SeqCst);
        let since = Instant::now();
        loop {
            if let Some(told) = mem::take(&mut *self.shared.told.lock().unwrap()) {
                return told;
            }
            assert!(since.elapsed() < Duration::from_secs(10), "the board is gone");
            thread::sleep(Duration::from_millis(2));
        }
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
