//! For which tool the height of the board is known. Annulus cuts with no other tool, on the page and on the
//! command line.
//!
//! ```text
//!  Unknown ──── Z zero is set, by jogging or probing, and read back ───▶ OfThisBit
//!     ▲                                                                    │ another tool is requested
//!     │ Z zero is requested, not yet confirmed                             ▼ or reported, a job ends
//!     └ position lost, without limit switches ◀──────────────────── OfAnotherBit
//!
//!  first tool of a job        the tool that was in when the Z zero was set: the height stays known
//!  every other tool, and      the job requests it: the head rises to the tool change height
//!  tool of a resumed job      and stays up until the tip was touched off
//!  with a tool setter         the tool used for the Z zero is measured first, then each tool before it cuts
//! ```

use super::asks::{EngineAction, EngineStart};
use super::engine::Controller;
use super::hand::SAME_ZERO_MM;
use super::run::Run;
use super::settings;
use annulus_core::control::Trust;
use annulus_core::diagnostic::Diagnostic;

/// Tolerance for "the same Z zero", in units of the last digit of a report.
const SAME_HEIGHT_SHARE: f64 = 1.5;
const TOLD_MS: u64 = 4_000;

pub use annulus_core::control::BoardHeight;

impl Controller {
    pub fn height(&self) -> BoardHeight {
        self.height
    }

    /// True if the machine has limit switches, so that homing restores the same coordinates.
    pub(super) fn homes(&self) -> bool {
        settings::on(&self.info.values, 22)
    }

    pub(super) fn lose_place(&mut self) {
        (self.trust, self.reference_mm) = (Trust::Lost, None);
        self.depth_is_unsure();
        if !self.homes() {
            self.height = BoardHeight::Unknown;
        }
    }

    /// Records that another tool may be in. A known board height then belongs to the previous tool, unless
    /// all tools of the job are equally long.
    pub(super) fn bit_is_another(&mut self) {
        let alike = self.run.as_ref().is_some_and(|run| run.same_length);
        self.height = self.height.with_another_tool(alike);
    }

    pub(super) fn same_height_mm(&self) -> f64 {
        SAME_HEIGHT_SHARE * settings::place_digit_mm(&self.info.values)
    }

    /// True if the Z zero is where it was, `before_mm`. Only limit switches make that comparable.
    pub fn height_as_left(&self, before_mm: Option<[f64; 3]>) -> bool {
        let same_mm = self.same_height_mm();
        let same = |before: [f64; 3], now: [f64; 3]| libm::fabs(before[2] - now[2]) <= same_mm;
        self.homes() && before_mm.zip(self.job_zero_mm()).is_some_and(|(before, now)| same(before, now))
    }

    /// Problems of the work zero that prevent a job: Z was never set, or the zero has moved since the job was
    /// interrupted.
    pub(super) fn check_zero(&self, start: &EngineStart) -> Option<Diagnostic> {
        let unknown = self.height == BoardHeight::Unknown;
        let Some((before, now)) = start.zero_mm.filter(|_| self.homes()).zip(self.job_zero_mm()) else {
            return unknown.then(|| Diagnostic::error("grbl.no_height"));
        };
        let off_mm: [f64; 3] = core::array::from_fn(|axis| now[axis] - before[axis]);
        let plane = off_mm[..2].iter().any(|off_mm| libm::fabs(*off_mm) > SAME_ZERO_MM);
        // A Z zero set since then belongs to the current tool or to the next one.
        let height = unknown && !self.height_as_left(start.zero_mm);
        let told = |axis: usize| format!("{:.3}", off_mm[axis]);
        (plane || height).then(|| {
            let why = Diagnostic::error("grbl.zero_moved").with("x", told(0)).with("y", told(1));
            why.with("z", told(2))
        })
    }

    /// A job starts. If all tools are equally long, a Z zero set with any of them, or by the job earlier, is
    /// good for all. A job from the start is on a new board, so the setter reference no longer applies.
    pub(super) fn height_at_start(&mut self, start: &EngineStart) {
        if start.from == 0 {
            self.reference_mm = None;
        }
        let known = self.height == BoardHeight::OfAnotherBit || self.height_as_left(start.zero_mm);
        if start.same_length && known {
            self.height = BoardHeight::OfThisBit;
        }
    }

    /// A user who confirms the tool right after setting zero can't see that the zero is still being written.
    /// The confirmation waits until the zero is stored and reported.
    pub(super) fn tool_ready_waits(&mut self) {
        let Some(asked_ms) = self.ready_asked_ms else { return };
        // A damaged zero is discarded; the controller reports it again.
        if self.zero_off_mm().is_some() {
            self.zero_mm = None;
        }
        let is_to_come = self.place().is_none() && self.now_ms < asked_ms + TOLD_MS;
        if self.idle() && !is_to_come {
            self.ready_asked_ms = None;
            self.ask_tool_ready();
        }
    }

    /// The tool is in: continue if its height over the board is known; with a tool setter measure it first.
    fn ask_tool_ready(&mut self) {
        let Some(place) = self.place() else { return self.found(Diagnostic::error("grbl.no_report")) };
        let known = self.height.may_cut();
        if let Some(why) = self.no_room().filter(|_| known) {
            return self.found(why);
        }
        match self.run.as_ref().and_then(Run::setter) {
            Some(setter) if !known || self.reference_mm.is_none() => self.measure_tool(setter),
            _ if known => self.tool_ready(place),
            _ => self.found(Diagnostic::error("grbl.height_first")),
        }
    }

    /// A new Z zero was requested: until it is confirmed, the height is unknown. Unless the setter made it,
    /// the setter reference ends.
    pub(super) fn height_is_asked(&mut self, wanted: &ZeroWanted) {
        if !wanted.of_setter {
            (self.height, self.reference_mm) = (BoardHeight::Unknown, None);
        }
    }

    pub(super) fn zero_is_taken(&mut self, wanted: &ZeroWanted) {
        if wanted.trusts {
            self.trust = Trust::Trusted;
        }
        self.zero_refused &= !wanted.of_plane;
        if wanted.of_height {
            self.height = BoardHeight::OfThisBit;
            self.fit_run();
        }
        if let Some(run) = &mut self.setter {
            run.answered = true;
        }
        self.out.push(EngineAction::ZeroSet);
    }

    /// Another zero is stored than requested. `plane`: X or Y may be off from the running job's zero.
    pub(super) fn zero_is_not_taken(&mut self, plane: bool) {
        self.height = BoardHeight::Unknown;
        self.zero_refused |= plane;
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

#[derive(Clone, Debug, Default)]
pub(super) struct ZeroWanted {
    pub(super) place_mm: [Option<f64>; 3],
    pub(super) of_plane: bool,
    pub(super) of_height: bool,
    pub(super) touched_mm: Option<[f64; 3]>,
    pub(super) trusts: bool,
    pub(super) of_setter: bool,
}
