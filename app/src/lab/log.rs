//! The log: reports of the machine, requests of this page, state of the link.
//!
//! ```text
//! reports, requests, link ─▶ Event ─▶ Log (the last 500) ─▶ filter ─▶ list, file
//! ```

use annulus_core::control::{Ending, State};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::magazine::ChangeStep;
use annulus_core::wire::Status;
use std::collections::VecDeque;

const MOST_ENTRIES: usize = 500;

/// Keys of a state's name and sentence, if they say more than the state alone.
type OwnWords = Option<[&'static str; 2]>;

#[derive(Clone, Debug, PartialEq)]
pub enum LogEvent {
    State(State, OwnWords),
    Change(ChangeStep),
    Alarm(Diagnostic),
    Ended {
        ending: Ending,
        holes: u32,
        toolpaths: u32,
    },
    Refused(Diagnostic),
    /// A request of this page, by its name on the wire.
    Asked(String),
    Control {
        yours: bool,
        taken: bool,
    },
    Settings,
    Link {
        open: bool,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    Machine,
    Trouble,
    Asked,
    Link,
}

impl Topic {
    pub const ALL: [Self; 4] = [Self::Machine, Self::Trouble, Self::Asked, Self::Link];
}

impl LogEvent {
    pub fn kind(&self) -> Topic {
        match self {
            Self::State(..) | Self::Change(_) | Self::Ended { .. } => Topic::Machine,
            Self::Alarm(_) | Self::Refused(_) => Topic::Trouble,
            Self::Asked(_) => Topic::Asked,
            Self::Control { .. } | Self::Settings | Self::Link { .. } => Topic::Link,
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct LogEntry {
    /// Counts from 1; never reused.
    pub number: u64,
    /// Milliseconds since 1970.
    pub at_ms: f64,
    pub event: LogEvent,
}

#[derive(Clone, Debug, Default)]
pub struct Log {
    entries: VecDeque<LogEntry>,
    count: u64,
    state: Option<(State, OwnWords)>,
    alarm: Option<Diagnostic>,
}

impl Log {
    pub fn add(&mut self, at_ms: f64, event: LogEvent) {
        self.count += 1;
        self.entries.push_back(LogEntry { number: self.count, at_ms, event });
        if self.entries.len() > MOST_ENTRIES {
            self.entries.pop_front();
        }
    }

    pub fn is_news(&self, status: &Status, words: OwnWords) -> bool {
        self.state != Some((status.state, words)) || self.alarm != status.alarm
    }

    /// Adds what is new in a status; returns true if anything was.
    pub fn seen(&mut self, at_ms: f64, status: &Status, words: OwnWords) -> bool {
        let before = self.count;
        let now = (status.state, words);
        if self.state.replace(now) != Some(now) {
            self.add(at_ms, LogEvent::State(status.state, words));
        }
        if self.alarm != status.alarm {
            self.alarm.clone_from(&status.alarm);
            if let Some(alarm) = &status.alarm {
                self.add(at_ms, LogEvent::Alarm(alarm.clone()));
            }
        }
        self.count > before
    }

    pub fn newest(&self, wanted: impl Fn(Topic) -> bool) -> Vec<LogEntry> {
        self.entries.iter().rev().filter(|entry| wanted(entry.event.kind())).cloned().collect()
    }

    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Removes all entries; numbers continue.
    pub fn clear(&mut self) {
        self.entries.clear();
    }
}

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
    fn log_shows_the_latest_events_first_by_kind() {
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
    fn csv_fields_are_quoted() {
        for (text, field) in [("plain", "plain"), ("a, b", "\"a, b\""), ("say \"x\"", "\"say \"\"x\"\"\"")] {
            assert_eq!(csv_field(text), field);
        }
    }
}
