//! The serial line to a controller: lines that wait or are in flight, and the last signs of life.

use super::buffer::Buffer;
use super::heard::Ear;
use super::setter::SetterStep;
use std::collections::VecDeque;

const ANSWER_MS: f64 = 2_000.0;

/// Longest wait for an answer while the controller reports Idle, s: a tool fetching line is answered only
/// when the tool is in.
const LINE_S: f64 = 120.0;

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Meaning {
    /// An identification query; `true` for the last one.
    Identify(bool),
    Home,
    Unlock,
    Jog,
    /// A stored offset or a setting is written.
    Written,
    /// A written zero is read back.
    Echo(ZeroWanted),
    Probe {
        plate_mm: f64,
        up_mm: f64,
    },
    Edge {
        axis: usize,
        radius_mm: f64,
        back_mm: f64,
    },
    /// A line of a survey; modal words before it carry `None`.
    Survey(Option<SurveyStep>),
    /// A line of a tool measurement; modal words before it carry `None`.
    Setter(Option<SetterStep>),
    Changer(ChangerLine),
    /// `$C`, into check mode.
    CheckMode,
    /// A line of a job in check mode, with its section and program line.
    Check {
        section: usize,
        line: u32,
    },
    /// A line of a job, with the longest wait for its answer.
    Job {
        wait_s: f64,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SurveyStep {
    Rise,
    /// To the next point.
    Over,
    /// Down to the board.
    Down,
    /// Queries the touch position again: the line has no checksum.
    Again,
    /// Back over the work zero.
    Back,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ChangerLine {
    Word,
    /// The last of our lines before the macro.
    Ready,
    /// A line of the macro.
    Own,
    /// `G4P0` after a macro line: answered when the head has stopped.
    Rest,
    /// The last of our lines after the macro.
    Again,
}

/// A requested work zero, until the controller confirms it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ZeroWanted {
    /// Machine coordinates; for the other axes the zero before, if known.
    pub(super) place_mm: [Option<f64>; 3],
    /// X and Y are included.
    pub(super) of_plane: bool,
    /// The Z zero is included.
    pub(super) of_height: bool,
    /// Probed position that the zero derives from, machine coordinates.
    pub(super) touched_mm: Option<[f64; 3]>,
    /// The zero makes the position trusted: without limit switches the user's word counts.
    pub(super) trusts: bool,
    /// The tool setter made it.
    pub(super) of_setter: bool,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Outgoing {
    pub(super) text: String,
    pub(super) meaning: Meaning,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AfterReset {
    Home,
    Unlock,
}

#[derive(Debug, Default)]
pub(super) struct Line {
    pub(super) ear: Ear,
    pub(super) buffer: Buffer<Outgoing>,
    pub(super) queue: VecDeque<Outgoing>,
    pub(super) asked_ms: Option<u64>,
    pub(super) last_ask_ms: u64,
    pub(super) late_reports: u32,
    pub(super) heard_ms: u64,
    pub(super) moved_ms: u64,
    /// Idle reports since an answer is overdue, counting only queries sent after that.
    pub(super) rests_overdue: u32,
    /// The engine requested a reset and waits for the banner: since when, and the number of tries.
    pub(super) reset_at: Option<(u64, u32)>,
    /// The controller must restart before it can be unlocked.
    pub(super) needs_reset: bool,
    pub(super) after_reset: Option<AfterReset>,
}

impl Line {
    pub(super) fn is_empty(&self) -> bool {
        self.buffer.is_empty() && self.queue.is_empty()
    }

    /// True if nothing is in flight or queued, and no restart is awaited.
    pub(super) fn is_idle(&self) -> bool {
        self.is_empty() && self.reset_at.is_none()
    }

    pub(super) fn drop_lines(&mut self) {
        self.buffer.clear();
        self.queue.clear();
        self.asked_ms = None;
    }

    pub(super) fn is_overdue(&self, now_ms: u64) -> bool {
        let wait_s = |sent: &Outgoing| match sent.meaning {
            Meaning::Job { wait_s } => wait_s,
            Meaning::Changer(_) => LINE_S,
            _ => 0.0,
        };
        let waits_s: f64 = self.buffer.waiting().map(wait_s).sum();
        let is_late = now_ms as f64 > self.moved_ms as f64 + ANSWER_MS + waits_s * 1e3;
        is_late && !self.buffer.is_empty()
    }
}
