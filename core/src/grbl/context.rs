//! What all activities of the engine work with.

use super::asks::{EngineAction, realtime};
use super::buffer::stands_alone;
use super::heard::ReportedState;
use super::known::Known;
use super::line::{Line, Meaning, Outgoing};
use super::overrides::OverrideWishes;
use crate::diagnostic::Diagnostic;

/// Times in ms.
#[derive(Debug, Default)]
pub(super) struct Context {
    pub(super) now_ms: u64,
    pub(super) since_ms: u64,
    pub(super) hold_reports: u32,
    /// When STOP last had an effect.
    pub(super) stopped_ms: Option<u64>,
    pub(super) line: Line,
    pub(super) known: Known,
    pub(super) overrides: OverrideWishes,
    pub(super) out: Vec<EngineAction>,
}

impl Context {
    pub(super) fn write(&mut self, sign: u8) {
        self.out.push(EngineAction::Write(vec![sign]));
    }

    pub(super) fn send(&mut self, text: &str, meaning: Meaning) {
        self.line.queue.push_back(Outgoing { text: text.to_owned(), meaning });
    }

    /// Restarts the controller. In motion that loses its position.
    pub(super) fn reset(&mut self) {
        self.write(realtime::RESET);
        self.line.drop_lines();
        let tries = self.line.reset_at.map_or(0, |(_, tries)| tries);
        self.line.reset_at = Some((self.now_ms, tries + 1));
    }

    pub(super) fn query(&mut self) {
        self.write(realtime::ASK);
        (self.line.last_ask_ms, self.line.asked_ms) = (self.now_ms, Some(self.now_ms));
    }

    /// Sends the oldest queued line, if the buffer has room.
    pub(super) fn send_next(&mut self) -> bool {
        let line = &mut self.line;
        let Some(next) = line.queue.front() else { return false };
        let alone = stands_alone(&next.text);
        if line.reset_at.is_some() || !line.buffer.takes(next.text.len() + 1, alone) {
            return false;
        }
        let Some(next) = line.queue.pop_front() else { return false };
        let mut bytes = next.text.clone().into_bytes();
        bytes.push(b'\n');
        self.known.sent_lines += u64::from(matches!(next.meaning, Meaning::Job { .. }));
        line.buffer.put(bytes.len(), alone, next);
        (line.moved_ms, line.rests_overdue) = (self.now_ms, 0);
        self.out.push(EngineAction::Write(bytes));
        true
    }

    pub(super) fn found(&mut self, diagnostic: Diagnostic) {
        self.out.push(EngineAction::Found(diagnostic));
    }

    pub(super) fn error(&mut self, code: &str) {
        self.found(Diagnostic::error(code));
    }
}

/// A status report, as activities need it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Report {
    pub(super) doing: ReportedState,
    /// It answers our query; others may be old.
    pub(super) fresh: bool,
    /// State in the report before.
    pub(super) before: Option<ReportedState>,
}

impl Report {
    pub(super) fn is_idle(&self) -> bool {
        self.fresh && self.doing == ReportedState::Idle
    }
}
