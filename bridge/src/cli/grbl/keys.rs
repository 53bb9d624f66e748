//! Reads input while a job runs at a controller: lines during a tool change, keys at a terminal, and Ctrl-C.
//!
//! ```text
//! pipe      ─ lines ─▶ Word::Line                       never a key: it was written before anything moved
//! terminal  ─ bytes ─▶ Word::Key ─┬─ job runs ─▶ override, pause, resume
//!                                 └─ tool change ─▶ a line, with its echo
//!           ─ another program is in the foreground ─▶ nothing: reading there would suspend this program
//! ```

use crate::signals::Signals;
use std::io::{self, BufRead, Write};
use std::sync::Arc;
use std::sync::mpsc::Sender;

/// Maximum length of a typed line, in bytes.
const LONGEST: usize = 200;

/// Input from outside the controller.
pub(super) enum Word {
    Line(String),
    /// The end of the lines.
    End,
    /// A key at a terminal.
    Key(u8),
    Signal,
}

/// What to read in addition to signals.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Typing {
    Nothing,
    /// Keys at a terminal; otherwise nothing.
    Keys,
    /// Keys at a terminal; otherwise lines.
    Lines,
}

/// The keys of a terminal. Dropping it restores the terminal modes.
pub(super) struct Keys {
    terminal: Arc<terminal::Terminal>,
    /// The line typed until now; `None` while keys are read.
    line: Option<String>,
    /// Requested percentages that are not reported yet: feed, rapids, spindle.
    pub(super) wanted: [Option<u16>; 3],
}

impl Keys {
    /// Switches between reading lines and reading keys.
    pub(super) fn type_lines(&mut self, lines: bool) {
        self.line = lines.then(String::new);
    }

    /// Adds a key to the line. Returns the line if the key completes it.
    pub(super) fn typed(&mut self, key: u8) -> Option<String> {
        take(self.line.as_mut()?, key)
    }

    /// Returns `true` while lines are read.
    pub(super) fn types(&self) -> bool {
        self.line.is_some()
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        self.terminal.give_back();
    }
}

/// Adds a character to the line and echoes it. Returns the line if the character completes it.
fn take(line: &mut String, key: u8) -> Option<String> {
    let mut out = io::stderr().lock();
    match key {
        b'\n' | b'\r' => {
            let _ = writeln!(out);
            return Some(std::mem::take(line));
        }
        0x08 | 0x7f if line.pop().is_some() => {
            let _ = write!(out, "\x08 \x08");
        }
        b' '..=b'~' if line.len() < LONGEST => {
            line.push(char::from(key));
            let _ = write!(out, "{}", char::from(key));
        }
        _ => {}
    }
    let _ = out.flush();
    None
}

/// Starts reading signals and input. Returns the keys if this is a terminal and they are wanted.
pub(super) fn listen(sends: Sender<Word>, typing: Typing) -> Option<Keys> {
    let signals = sends.clone();
    let _ = std::thread::Builder::new().name("signals".to_owned()).spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        let Ok(runtime) = runtime else { return };
        runtime.block_on(async {
            let Ok(mut all) = Signals::new() else { return };
            loop {
                let _ = all.wait().await;
                if signals.send(Word::Signal).is_err() {
                    return;
                }
            }
        });
    });
    let terminal = if typing == Typing::Nothing { None } else { terminal::Terminal::of_keys() };
    let keys = terminal.map(|terminal| Keys { terminal: Arc::new(terminal), line: None, wanted: [None; 3] });
    if let Some(keys) = &keys {
        let terminal = Arc::clone(&keys.terminal);
        let _ = std::thread::Builder::new().name("keys".to_owned()).spawn(move || {
            while let Some(pressed) = terminal.pressed() {
                if pressed.into_iter().any(|key| sends.send(Word::Key(key)).is_err()) {
                    return;
                }
            }
            let _ = sends.send(Word::End);
        });
    } else if typing == Typing::Lines {
        let _ = std::thread::Builder::new().name("typed".to_owned()).spawn(move || {
            for line in io::stdin().lock().lines().map_while(Result::ok) {
                if sends.send(Word::Line(line)).is_err() {
                    return;
                }
            }
            let _ = sends.send(Word::End);
        });
    }
    keys
}

#[cfg(unix)]
mod terminal {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    use rustix::io::{Errno, read};
    use rustix::process::getpgrp;
    use rustix::termios::{
        LocalModes, OptionalActions, SpecialCodeIndex, Termios, tcgetattr, tcgetpgrp, tcsetattr,
    };
    use std::io::{IsTerminal, stdin};
    use std::sync::{Mutex, PoisonError};
    use std::thread::sleep;
    use std::time::Duration;

    /// How long to wait for a key, and the interval of the foreground check, ms.
    const TURN_MS: u32 = 100;

    /// A terminal that delivers each key immediately, while this program is in the foreground.
    pub(super) struct Terminal(Mutex<Hold>);

    /// Whether the terminal is still needed, and its original modes.
    #[derive(Default)]
    struct Hold {
        is_over: bool,
        before: Option<Termios>,
    }

    /// Returns `true` if this program is in the foreground. The kernel suspends a background program that
    /// uses the terminal.
    fn is_in_front() -> bool {
        tcgetpgrp(stdin()).map_or(true, |front| front == getpgrp())
    }

    /// The current modes and the modes to set; `None` if they are already set.
    fn modes() -> Option<(Termios, Termios)> {
        let before = tcgetattr(stdin()).ok()?;
        let mut now = before.clone();
        // ISIG stays set: Ctrl-C remains a signal.
        now.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
        now.special_codes[SpecialCodeIndex::VMIN] = 1;
        now.special_codes[SpecialCodeIndex::VTIME] = 0;
        let is_so = now.local_modes == before.local_modes
            && [SpecialCodeIndex::VMIN, SpecialCodeIndex::VTIME]
                .iter()
                .all(|code| now.special_codes[*code] == before.special_codes[*code]);
        (!is_so).then_some((before, now))
    }

    impl Terminal {
        /// `None` if standard input is not a terminal.
        pub(super) fn of_keys() -> Option<Self> {
            let terminal = stdin().is_terminal().then(|| Self(Mutex::default()))?;
            terminal.is_held();
            Some(terminal)
        }

        /// Returns `true` if this program is in the foreground. A shell may have reset the terminal
        /// meanwhile, so this sets the modes again unless the terminal was given back.
        fn is_held(&self) -> bool {
            let mut hold = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            if hold.is_over || !is_in_front() {
                return false;
            }
            if let Some((before, now)) = modes()
                && tcsetattr(stdin(), OptionalActions::Now, &now).is_ok()
            {
                hold.before = Some(before);
            }
            true
        }

        /// Keys pressed within a short time; `None` if the terminal is gone.
        pub(super) fn pressed(&self) -> Option<Vec<u8>> {
            if !self.is_held() {
                sleep(Duration::from_millis(TURN_MS.into()));
                return Some(Vec::new());
            }
            let input = stdin();
            let mut asked = [PollFd::new(&input, PollFlags::IN)];
            let wait = Timespec { tv_sec: 0, tv_nsec: i64::from(TURN_MS) * 1_000_000 };
            let ready = poll(&mut asked, Some(&wait)).is_ok_and(|ready| ready > 0);
            if !ready || !is_in_front() {
                return Some(Vec::new());
            }
            let mut keys = [0; 64];
            match read(&input, &mut keys) {
                Ok(count) if count > 0 => Some(keys[..count].to_vec()),
                Err(Errno::INTR) => Some(Vec::new()),
                _ => None,
            }
        }

        /// Restores the original modes, unless another program is in the foreground.
        pub(super) fn give_back(&self) {
            let mut hold = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            hold.is_over = true;
            if let Some(before) = hold.before.take().filter(|_| is_in_front()) {
                let _ = tcsetattr(stdin(), OptionalActions::Now, &before);
            }
        }
    }
}

#[cfg(not(unix))]
mod terminal {
    /// Without keys, only lines are read.
    pub(super) struct Terminal;

    impl Terminal {
        pub(super) fn of_keys() -> Option<Self> {
            None
        }

        pub(super) fn pressed(&self) -> Option<Vec<u8>> {
            None
        }

        pub(super) fn give_back(&self) {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backspace_corrects_a_typed_line() {
        let mut line = String::new();
        let lines: Vec<String> =
            b"x 1\x7f2\ngo\x1b\r".iter().filter_map(|key| take(&mut line, *key)).collect();
        assert_eq!((lines, line), (vec!["x 2".to_owned(), "go".to_owned()], String::new()));
    }
}
