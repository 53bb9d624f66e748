//! For which bit the height of the board is known. Nothing is cut with another one: whoever asks, page or command line.
//!
//! ```text
//!  Unknown ──── zero of Z is set, by hand or by a touch, and read again ───▶ OfThisBit
//!     ▲                                                                        │ another bit is asked for or said to be in,
//!     │ zero of Z is asked for, not yet taken                                  ▼ a job is over
//!     └ the place is lost, and there are no switches ◀─────────────────── OfAnotherBit
//!
//!  the first bit of a job    the one that was in when zero of Z was set: the height stays known
//!  every other one, and      the job asks for it: it goes up to where tools are changed, and not down before the tip was touched off
//!  the one of a resumed job
//!  with a tool setter         what zero of Z was set with is measured first, then each before it goes down: `setter`
//! ```
//!
//! Comes in: zeros, bits, jobs, from the engine. Goes out: what is known, refusals. mm in machine coordinates. Does not know lines.

use super::asks::{EngineAction, EngineStart};
use super::engine::Controller;
use super::hand::SAME_ZERO_MM;
use super::run::Run;
use super::settings;
use crate::control::Trust;
use crate::diagnostic::Diagnostic;

/// How far zero of Z may be from where it was and still be the same: so many times the last digit of a report.
const SAME_HEIGHT_SHARE: f64 = 1.5;
/// Within so many ms a controller has told where it is by a new zero.
const TOLD_MS: u64 = 4_000;

/// For which bit zero of Z is the height of the board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BoardHeight {
    /// For none: it was not set since the link was opened, or what was set was not taken.
    #[default]
    Unknown,
    /// For one that was in before.
    OfAnotherBit,
    /// For the one that is in.
    OfThisBit,
}

impl Controller {
    /// For which bit the height of the board is known.
    pub fn height(&self) -> BoardHeight {
        self.height
    }

    /// Whether the machine has switches, so that a place is the same one again after it was lost.
    pub(super) fn homes(&self) -> bool {
        settings::on(&self.info.values, 22)
    }

    /// Where the machine is, is not known any more; without switches its zeros mean nothing then.
    pub(super) fn lose_place(&mut self) {
        (self.trust, self.reference_mm) = (Trust::Lost, None);
        if !self.homes() {
            self.height = BoardHeight::Unknown;
        }
    }

    /// Another bit may be in now.
    pub(super) fn bit_is_another(&mut self) {
        let alike = self.run.as_ref().is_some_and(|run| run.same_length);
        if self.height == BoardHeight::OfThisBit && !alike {
            self.height = BoardHeight::OfAnotherBit;
        }
    }

    /// How far two heights that are reported may be apart and still be the same, mm.
    pub(super) fn same_height_mm(&self) -> f64 {
        SAME_HEIGHT_SHARE * settings::place_digit_mm(&self.info.values)
    }

    /// Whether zero of Z is where it was, `before_mm`, by the switches.
    pub fn height_as_left(&self, before_mm: Option<[f64; 3]>) -> bool {
        let same_mm = self.same_height_mm();
        let same = |before: [f64; 3], now: [f64; 3]| libm::fabs(before[2] - now[2]) <= same_mm;
        self.homes() && before_mm.zip(self.job_zero_mm()).is_some_and(|(before, now)| same(before, now))
    }

    /// What of the work zero keeps a job from being started: of Z it was never set, or it is not where the job had it.
    pub(super) fn check_zero(&self, start: &EngineStart) -> Option<Diagnostic> {
        let unknown = self.height == BoardHeight::Unknown;
        let Some((before, now)) = start.zero_mm.filter(|_| self.homes()).zip(self.job_zero_mm()) else {
            return unknown.then(|| Diagnostic::error("grbl.no_height"));
        };
        let off_mm: [f64; 3] = core::array::from_fn(|axis| now[axis] - before[axis]);
        let plane = off_mm[..2].iter().any(|off_mm| libm::fabs(*off_mm) > SAME_ZERO_MM);
        // One that was set since is that of the bit that is in, or that goes in.
        let height = unknown && !self.height_as_left(start.zero_mm);
        let told = |axis: usize| format!("{:.3}", off_mm[axis]);
        (plane || height).then(|| {
            let why = Diagnostic::error("grbl.zero_moved").with("x", told(0)).with("y", told(1));
            why.with("z", told(2))
        })
    }

    /// A job begins: where all bits are alike, a zero of Z that was set with one of them, or that the job had, is good for all. One that
    /// begins anew lies on another board: how high that is the tool setter does not know.
    pub(super) fn height_at_start(&mut self, start: &EngineStart) {
        if start.from == 0 {
            self.reference_mm = None;
        }
        let known = self.height == BoardHeight::OfAnotherBit || self.height_as_left(start.zero_mm);
        if start.same_length && known {
            self.height = BoardHeight::OfThisBit;
        }
    }

    /// Whoever says that the tool is in right after zero was set does not know that the controller is still writing it, or has not told
    /// yet where it is by that zero: it counts as soon as that is over.
    pub(super) fn tool_ready_waits(&mut self) {
        let Some(asked_ms) = self.ready_asked_ms else { return };
        // One that was damaged on its way is told again.
        if self.zero_off_mm().is_some() {
            self.zero_mm = None;
        }
        let is_to_come = self.place().is_none() && self.now_ms < asked_ms + TOLD_MS;
        if self.idle() && !is_to_come {
            self.ready_asked_ms = None;
            self.ask_tool_ready();
        }
    }

    /// The tool is in: on, where its height over the board is known; where a tool setter tells it, to that first.
    fn ask_tool_ready(&mut self) {
        let Some(place) = self.place() else { return self.found(Diagnostic::error("grbl.no_report")) };
        let known = self.height == BoardHeight::OfThisBit;
        match self.run.as_ref().and_then(Run::setter) {
            Some(setter) if !known || self.reference_mm.is_none() => self.measure_tool(setter),
            _ if known => self.tool_ready(place),
            _ => self.found(Diagnostic::error("grbl.height_first")),
        }
    }

    /// Zero of Z is asked for: until it is taken it is that of no tool. One that somebody sets ends what was known of the tool setter; one
    /// that goes by that does not.
    pub(super) fn height_is_asked(&mut self, wanted: &ZeroWanted) {
        if !wanted.of_setter {
            (self.height, self.reference_mm) = (BoardHeight::Unknown, None);
        }
    }

    /// Zero was asked for and is there.
    pub(super) fn zero_is_taken(&mut self, wanted: &ZeroWanted) {
        if wanted.trusts {
            self.trust = Trust::Trusted;
        }
        if wanted.of_height {
            self.height = BoardHeight::OfThisBit;
        }
        if let Some(run) = &mut self.setter {
            run.answered = true;
        }
        self.out.push(EngineAction::ZeroSet);
    }

    /// Zero was asked for, and something else is there; `plane`: X or Y may be elsewhere than where the job that is in work has them.
    pub(super) fn zero_is_not_taken(&mut self, plane: bool) {
        self.height = BoardHeight::Unknown;
        let why = Diagnostic::error("grbl.zero_not_taken");
        if plane && !self.homes() {
            self.lose_place();
        }
        if plane && self.run.is_some() {
            return self.trouble(why);
        }
        self.found(why);
        if self.setter.is_some() {
            self.rest();
        }
    }
}

/// A work zero that was asked for, until the controller has said that it is there.
#[derive(Clone, Debug, Default)]
pub(super) struct ZeroWanted {
    /// In machine coordinates; that of the other axes as it was, where that is known.
    pub(super) place_mm: [Option<f64>; 3],
    /// Zero of Z is among them.
    pub(super) of_height: bool,
    /// The place where the probe met the board, of which it was made, machine coordinates.
    pub(super) touched_mm: Option<[f64; 3]>,
    /// A place is known by it: a person's word, where there are no switches.
    pub(super) trusts: bool,
    /// It goes by the tool setter.
    pub(super) of_setter: bool,
}
