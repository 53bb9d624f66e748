//! What happened, in order: what the machine said, what this page asked, how the link was.
//!
//! ```text
//! tells, asks, link ─▶ Event ─▶ Log (the last 500) ─▶ filter ─▶ list, file
//! ```
//!
//! Comes in: events with their time. Goes out: entries. Knows no language: the words are found where they are shown.

use annulus_core::control::{Ending, State};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::magazine::ChangeStep;
use annulus_core::wire::Status;
use std::collections::VecDeque;

/// The most entries kept.
const MOST_ENTRIES: usize = 500;

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub enum LogEvent {
    /// The machine does something else now.
    State(State),
    /// The machine changes a tool and begins with this step.
    Change(ChangeStep),
    /// An alarm.
    Alarm(Diagnostic),
    /// A job ended, after so many holes and so many toolpaths.
    Ended {
        /// How it ended.
        ending: Ending,
        /// How many holes.
        holes: u32,
        /// How many toolpaths.
        toolpaths: u32,
    },
    /// A wish was refused.
    Refused(Diagnostic),
    /// This page asked for something, by its name on the wire.
    Asked(String),
    /// Control was taken (true: by this page) or given back.
    Control {
        /// This page has it.
        yours: bool,
        /// Somebody has it.
        taken: bool,
    },
    /// The machine's settings are others now.
    Settings,
    /// The link came or went.
    Link {
        /// It came, else it went.
        open: bool,
    },
}

/// What an entry is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// The machine and its jobs.
    Machine,
    /// Alarms and refusals.
    Trouble,
    /// What this page asked.
    Asked,
    /// Link, control, settings.
    Link,
}

impl Topic {
    /// All of them, in the order of the filter.
    pub const ALL: [Self; 4] = [Self::Machine, Self::Trouble, Self::Asked, Self::Link];
}

impl LogEvent {
    /// What it is about.
    pub fn kind(&self) -> Topic {
        match self {
            Self::State(_) | Self::Change(_) | Self::Ended { .. } => Topic::Machine,
            Self::Alarm(_) | Self::Refused(_) => Topic::Trouble,
            Self::Asked(_) => Topic::Asked,
            Self::Control { .. } | Self::Settings | Self::Link { .. } => Topic::Link,
        }
    }
}

/// An event with its number and its time.
#[derive(Clone, Debug, PartialEq)]
pub struct LogEntry {
    /// Counts from 1 and never repeats.
    pub number: u64,
    /// Milliseconds since 1970.
    pub at_ms: f64,
    /// What happened.
    pub event: LogEvent,
}

/// The last events.
#[derive(Clone, Debug, Default)]
pub struct Log {
    entries: VecDeque<LogEntry>,
    count: u64,
    state: Option<State>,
    alarm: Option<Diagnostic>,
}

impl Log {
    /// Adds an event.
    pub fn add(&mut self, at_ms: f64, event: LogEvent) {
        self.count += 1;
        self.entries.push_back(LogEntry { number: self.count, at_ms, event });
        if self.entries.len() > MOST_ENTRIES {
            self.entries.pop_front();
        }
    }

    /// Whether there is anything new in a status.
    pub fn is_news(&self, status: &Status) -> bool {
        self.state != Some(status.state) || self.alarm != status.alarm
    }

    /// Looks at a status and adds what is new in it. Says whether anything was.
    pub fn seen(&mut self, at_ms: f64, status: &Status) -> bool {
        let before = self.count;
        if self.state.replace(status.state) != Some(status.state) {
            self.add(at_ms, LogEvent::State(status.state));
        }
        if self.alarm != status.alarm {
            self.alarm.clone_from(&status.alarm);
            if let Some(alarm) = &status.alarm {
                self.add(at_ms, LogEvent::Alarm(alarm.clone()));
            }
        }
        self.count > before
    }

    /// Entries of the kinds that `wanted` lets through, the newest first.
    pub fn newest(&self, wanted: impl Fn(Topic) -> bool) -> Vec<LogEntry> {
        self.entries.iter().rev().filter(|entry| wanted(entry.event.kind())).cloned().collect()
    }

    /// Whether nothing happened yet.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Forgets the entries; numbers go on.
    pub fn clear(&mut self) {
        self.entries.clear();
    }
}

/// A field of a CSV file: quoted where it has to be.
pub fn csv_field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_events_newest_first_by_kind() {
        let mut log = Log::default();
        assert!(log.is_empty());
        for number in 0..600 {
            log.add(
                f64::from(number),
                if number % 2 == 0 { LogEvent::Settings } else { LogEvent::Asked("home".into()) },
            );
        }
        assert_eq!(log.newest(|_| true).len(), MOST_ENTRIES);
        assert_eq!(log.newest(|_| true)[0].number, 600);
        assert!(
            log.newest(|kind| kind == Topic::Asked).iter().all(|entry| entry.event.kind() == Topic::Asked)
        );
        assert_eq!(log.newest(|kind| kind == Topic::Trouble), []);
        log.clear();
        log.add(0.0, LogEvent::Link { open: true });
        assert_eq!(log.newest(|_| true)[0].number, 601);
    }

    #[test]
    fn fields_of_a_file_keep_their_commas() {
        for (text, field) in [("plain", "plain"), ("a, b", "\"a, b\""), ("say \"x\"", "\"say \"\"x\"\"\"")] {
            assert_eq!(csv_field(text), field);
        }
    }
}
