//! A board of our own behind a pseudo-terminal. At another speed than its own it hears nothing that it understands, and what it says is
//! noise; a line may be swallowed on its way.

// The same board that the engine's own tests have.
#[allow(dead_code)]
#[path = "../../core/tests/controller/automaton.rs"]
mod automaton;

use automaton::Automaton;
use serialport::{SerialPort, TTYPort};
use std::io::{Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// A board at its port.
pub(crate) struct Board {
    pub(crate) port: String,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Board {
    pub(crate) fn at(bits_per_s: u32) -> Self {
        Self::that_swallows(bits_per_s, b"none")
    }

    /// The first line that begins so never comes to it.
    pub(crate) fn that_swallows(bits_per_s: u32, line: &'static [u8]) -> Self {
        let (mut own, theirs) = TTYPort::pair().unwrap();
        own.set_timeout(Duration::from_millis(1)).unwrap();
        let (port, ends) = (theirs.name().unwrap(), Arc::<AtomicBool>::default());
        let over = Arc::clone(&ends);
        let thread = thread::spawn(move || {
            let mut board = Automaton::new([0.0; 3]);
            // It was on before anybody listened.
            drop(board.said());
            let (began, mut ticks, mut swallowed) = (Instant::now(), 0, false);
            while !over.load(Ordering::SeqCst) {
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
                }
                while ticks < began.elapsed().as_millis() {
                    board.tick();
                    ticks += 1;
                }
                let said = board.said().into_iter().map(|byte| if same { byte } else { !byte });
                let _ = own.write_all(&said.collect::<Vec<_>>());
            }
        });
        Self { port, ends, thread: Some(thread) }
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
