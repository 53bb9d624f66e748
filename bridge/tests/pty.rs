//! A simulated controller on a pseudo-terminal. At a wrong speed it understands nothing and sends noise; it
//! can lose a line on its way.

// Shared with the engine's own tests.
#[allow(dead_code)]
#[path = "../../core/tests/grbl/automaton/mod.rs"]
mod automaton;

use automaton::Automaton;
use serialport::{SerialPort, TTYPort};
use std::io::{Read, Write};
use std::mem;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

pub(crate) struct Board {
    pub(crate) port: String,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    ends: AtomicBool,
    door: AtomicBool,
    /// The controller hangs: it reads and sends nothing more.
    frozen: AtomicBool,
    asked: AtomicBool,
    told: Mutex<Option<String>>,
    heard: Mutex<Vec<u8>>,
}

impl Board {
    pub(crate) fn at(bits_per_s: u32) -> Self {
        Self::that_swallows(bits_per_s, b"none")
    }

    /// The first line that starts like this never arrives.
    pub(crate) fn that_swallows(bits_per_s: u32, line: &'static [u8]) -> Self {
        Self::with(bits_per_s, line, Automaton::new([0.0; 3]))
    }

    /// A controller above a board whose surface has this height, by carriage position.
    pub(crate) fn over(surface: fn(f64, f64) -> f64) -> Self {
        let mut board = Automaton::new([0.0; 3]);
        board.surface = Some(surface);
        Self::with(115_200, b"none", board)
    }

    /// A controller that switches its motors off `ms` milliseconds after each move (`$1`).
    pub(crate) fn lets_go_after(ms: f64) -> Self {
        let mut board = Automaton::new([0.0; 3]);
        board.settings.push((1, ms));
        Self::with(115_200, b"none", board)
    }

    /// A controller that keeps its motors on, with or without homing (`$22`).
    pub(crate) fn that_homes(homes: bool) -> Self {
        let mut board = Automaton::new([0.0; 3]);
        board.settings.retain(|(number, _)| *number != 22);
        board.settings.extend([(1, 255.0), (22, f64::from(u8::from(homes)))]);
        if !homes {
            board.power_up_unheard();
        }
        Self::with(115_200, b"none", board)
    }

    /// A controller that runs a long move of another program.
    pub(crate) fn busy() -> Self {
        let mut board = Automaton::new([0.0; 3]);
        board.power_up_unheard();
        board.hear(b"G91G1X-100F10\n");
        (0..50).for_each(|_| board.tick());
        Self::with(115_200, b"none", board)
    }

    /// A controller built without mist.
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
            // The controller was on before the test listens.
            drop(board.said());
            let (began, mut ticks, mut swallowed) = (Instant::now(), 0, false);
            while !shared.ends.load(Ordering::SeqCst) {
                if shared.frozen.load(Ordering::SeqCst) {
                    thread::sleep(Duration::from_millis(5));
                    continue;
                }
                let same = theirs.baud_rate().is_ok_and(|now| now == bits_per_s);
                let mut bytes = [0; 256];
                if let Ok(count) = own.read(&mut bytes)
                    && same
                {
                    // A single line is sent alone.
                    let found = bytes[..count].windows(line.len()).position(|part| part == line);
                    let count = found.filter(|_| !swallowed).unwrap_or(count);
                    swallowed |= found.is_some();
                    board.hear(&bytes[..count]);
                    shared.heard.lock().unwrap().extend(&bytes[..count]);
                }
                if shared.door.load(Ordering::SeqCst) {
                    board.held.get_or_insert("Door:0");
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

    pub(crate) fn opens_door(&self) {
        self.shared.door.store(true, Ordering::SeqCst);
    }

    pub(crate) fn freezes(&self) {
        self.shared.frozen.store(true, Ordering::SeqCst);
    }

    pub(crate) fn heard(&self) -> String {
        String::from_utf8_lossy(&self.shared.heard.lock().unwrap()).into_owned()
    }

    /// A status report that only the test gets.
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
