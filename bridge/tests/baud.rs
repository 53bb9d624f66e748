//! The speed of a controller's line, where nobody says which: a board of our own behind a pseudo-terminal looks at the speed that its client
//! has set. At another one than its own it hears nothing that it understands, and what it says is noise.

// The same board that the engine's own tests have.
#[allow(dead_code)]
#[path = "../../core/tests/controller/automaton.rs"]
mod automaton;

use automaton::Automaton;
use serde_json::Value;
use serialport::{SerialPort, TTYPort};
use std::io::{Read, Write};
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// A board at its port.
struct Board {
    port: String,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Board {
    fn at(bits_per_s: u32) -> Self {
        let (mut own, theirs) = TTYPort::pair().unwrap();
        own.set_timeout(Duration::from_millis(1)).unwrap();
        let (port, ends) = (theirs.name().unwrap(), Arc::<AtomicBool>::default());
        let over = Arc::clone(&ends);
        let thread = thread::spawn(move || {
            let mut board = Automaton::new([0.0; 3]);
            // It was on before anybody listened.
            drop(board.said());
            let (began, mut ticks) = (Instant::now(), 0);
            while !over.load(Ordering::SeqCst) {
                let same = theirs.baud_rate().is_ok_and(|now| now == bits_per_s);
                let mut bytes = [0; 256];
                if let Ok(count) = own.read(&mut bytes)
                    && same
                {
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

    /// What `annulus grbl info` makes of it, with these words more.
    fn info(&self, words: &[&str]) -> (Option<i32>, Value, String) {
        let folder = tempfile::tempdir().unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
        command.args(["grbl", "info", "--json", "--port", &self.port]).args(words);
        let output = command.env("ANNULUS_HOME", folder.path()).output().unwrap();
        let object = serde_json::from_slice(&output.stdout).unwrap_or_default();
        (output.status.code(), object, String::from_utf8_lossy(&output.stderr).into_owned())
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

#[test]
fn the_speed_of_a_board_is_found_and_said() {
    for bits_per_s in [57_600, 250_000] {
        let board = Board::at(bits_per_s);
        let (exit, object, said) = board.info(&[]);
        assert_eq!((exit, &object["bits_per_s"]), (Some(0), &bits_per_s.into()), "{object} {said}");
        assert_eq!(object["controller"]["flavour"], "GRBL", "{object}");
        assert!(said.contains("Nobody answers at 115200 bits a second."), "{said}");
    }
}

#[test]
fn a_speed_that_is_given_is_that_one_and_no_other() {
    let board = Board::at(57_600);
    let (exit, object, said) = board.info(&["--baud", "57600"]);
    assert_eq!((exit, &object["bits_per_s"]), (Some(0), &57_600.into()), "{object} {said}");
    let (exit, object, said) = board.info(&["--baud", "9600"]);
    assert_eq!((exit, &object["error"]["code"]), (Some(3), &"grbl.no_answer".into()), "{object} {said}");
}
