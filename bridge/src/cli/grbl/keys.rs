//! What is typed while a controller is attended: lines where a tool is changed, and at a terminal keys while a job runs. And Ctrl-C.
//!
//! ```text
//! pipe      ─ lines ─▶ Word::Line                       no key: what stands in a pipe was written before anything moved
//! terminal  ─ signs ─▶ Word::Key ─┬─ a job runs ─▶ override, pause, resume
//!                                 └─ a tool is changed ─▶ a line, with its echo
//!           ─ another program is in front of it ─▶ nothing: whoever reads there is stopped
//! ```
//!
//! Comes in: standard input, signals. Goes out: words. Does not know what a key is for.

use crate::signals::Signals;
use std::io::{self, BufRead, Write};
use std::sync::Arc;
use std::sync::mpsc::Sender;

/// The longest line that is typed.
const LONGEST: usize = 200;

/// What comes from outside of the controller.
pub(super) enum Word {
    Line(String),
    /// A key at a terminal.
    Key(u8),
    Signal,
}

/// What is listened for besides signals.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Typing {
    Nothing,
    /// At a terminal keys; else nothing: nobody is asked.
    Keys,
    /// At a terminal keys; else lines.
    Lines,
}

/// The keys of a terminal, which is as it was before once this is gone.
pub(super) struct Keys {
    terminal: Arc<terminal::Terminal>,
    /// What was typed of a line; none while keys are meant.
    line: Option<String>,
    /// Percent that were asked for and are not reported yet: feed, rapids, spindle.
    pub(super) wanted: [Option<u16>; 3],
}

impl Keys {
    /// Lines are wanted from now on, or keys again.
    pub(super) fn type_lines(&mut self, lines: bool) {
        self.line = lines.then(String::new);
    }

    /// Takes a key in, where lines are wanted; gives the line that it ends.
    pub(super) fn typed(&mut self, key: u8) -> Option<String> {
        take(self.line.as_mut()?, key)
    }

    /// Whether lines are wanted.
    pub(super) fn types(&self) -> bool {
        self.line.is_some()
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        self.terminal.give_back();
    }
}

/// Takes a sign of a line in, with its echo; gives the line where that ends it.
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

/// Listens for signals, and for what is typed. Gives the keys, where this is at a terminal and they are wanted.
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
        });
    } else if typing == Typing::Lines {
        let _ = std::thread::Builder::new().name("typed".to_owned()).spawn(move || {
            for line in io::stdin().lock().lines().map_while(Result::ok) {
                if sends.send(Word::Line(line)).is_err() {
                    return;
                }
            }
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

    /// How long it waits for a key, and between two looks whether it is in front.
    const TURN_MS: u32 = 100;

    /// A terminal that gives each key as it is pressed, while this program is in front of it.
    pub(super) struct Terminal(Mutex<Hold>);

    /// Whether it is still wanted, and how it was before.
    #[derive(Default)]
    struct Hold {
        is_over: bool,
        before: Option<Termios>,
    }

    /// Whether no other program has it. What touches it from behind is stopped.
    fn is_in_front() -> bool {
        tcgetpgrp(stdin()).map_or(true, |front| front == getpgrp())
    }

    /// Its modes as they are, and as they are to be; none where they are so.
    fn modes() -> Option<(Termios, Termios)> {
        let before = tcgetattr(stdin()).ok()?;
        let mut now = before.clone();
        // Ctrl-C stays a signal.
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
        /// None where standard input is no terminal.
        pub(super) fn of_keys() -> Option<Self> {
            let terminal = stdin().is_terminal().then(|| Self(Mutex::default()))?;
            terminal.is_held();
            Some(terminal)
        }

        /// Whether it is in front. A shell that was there meanwhile has set the terminal as it wants it: that is undone, until it is given
        /// back.
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

        /// The keys that are pressed within a short time; none where the terminal is gone.
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

        /// As it was before, where nobody else has it.
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
    /// No keys: lines are typed there as before.
    pub(super) struct Terminal;

    impl Terminal {
        /// None.
        pub(super) fn of_keys() -> Option<Self> {
            None
        }

        /// None.
        pub(super) fn pressed(&self) -> Option<Vec<u8>> {
            None
        }

        /// There is nothing to give back.
        pub(super) fn give_back(&self) {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_typed_sign_by_sign_and_corrected() {
        let mut line = String::new();
        let lines: Vec<String> =
            b"x 1\x7f2\ngo\x1b\r".iter().filter_map(|key| take(&mut line, *key)).collect();
        assert_eq!((lines, line), (vec!["x 2".to_owned(), "go".to_owned()], String::new()));
    }
}
