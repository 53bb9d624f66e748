//! What is typed while a controller is attended: lines where a tool is changed, and at a terminal keys while a job runs. And Ctrl-C.
//!
//! ```text
//! pipe      ─ lines ─▶ Word::Line                       no key: what stands in a pipe was written before anything moved
//! terminal  ─ signs ─▶ Word::Key ─┬─ a job runs ─▶ override, pause, resume
//!                                 └─ a tool is changed ─▶ a line, with its echo
//! ```
//!
//! Comes in: standard input, signals. Goes out: words. Does not know what a key is for.

use crate::signals::Signals;
use std::io::{self, BufRead, Read, Write};
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
    _terminal: terminal::Terminal,
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
    let keys = terminal.map(|terminal| Keys { _terminal: terminal, line: None, wanted: [None; 3] });
    if keys.is_some() {
        let _ = std::thread::Builder::new().name("keys".to_owned()).spawn(move || {
            for key in io::stdin().lock().bytes().map_while(Result::ok) {
                if sends.send(Word::Key(key)).is_err() {
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
    use rustix::process::getpgrp;
    use rustix::termios::{
        LocalModes, OptionalActions, SpecialCodeIndex, Termios, tcgetattr, tcgetpgrp, tcsetattr,
    };
    use std::io::{IsTerminal, stdin};

    /// A terminal that gives each key as it is pressed, until this is dropped.
    pub(super) struct Terminal {
        before: Termios,
    }

    impl Terminal {
        /// None where standard input is no terminal, or where another program has it: one behind is stopped when it touches it.
        pub(super) fn of_keys() -> Option<Self> {
            let input = stdin();
            if !input.is_terminal() || tcgetpgrp(&input).is_ok_and(|front| front != getpgrp()) {
                return None;
            }
            let before = tcgetattr(&input).ok()?;
            let mut now = before.clone();
            // Ctrl-C stays a signal.
            now.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
            now.special_codes[SpecialCodeIndex::VMIN] = 1;
            now.special_codes[SpecialCodeIndex::VTIME] = 0;
            tcsetattr(&input, OptionalActions::Now, &now).ok()?;
            Some(Self { before })
        }
    }

    impl Drop for Terminal {
        fn drop(&mut self) {
            let _ = tcsetattr(stdin(), OptionalActions::Now, &self.before);
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
