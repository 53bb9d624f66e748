//! Whether the tip is, or may be, in the board: X and Y don't jog then, unless the user insists.
//!
//! The board height outlives a lost position, because step counts continue after a reset. After a restart of
//! the controller they begin at zero; then the tip counts as in the board until it has risen far enough.

use super::asks::EnginePhase;
use super::engine::Controller;
use super::height::BoardHeight;
use annulus_core::control::Trust;

const ON_SURFACE_MM: f64 = 0.01;
const UNSURE_MM: f64 = 0.5;
const UNSEEN_MM: f64 = 5.0;
const CLEAR_MM: f64 = 1.0;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct TipDepth {
    /// Above this Z the tip is out of the board; `None` if no board is known.
    out_mm: Option<f64>,
    last_mm: Option<f64>,
    in_job: bool,
    is_unsure: bool,
    /// The controller restarted: the tip is out after it has risen this far from the next reported Z.
    rise_mm: Option<f64>,
}

impl TipDepth {
    fn low_mm(&self) -> Option<f64> {
        let counted = || self.out_mm.zip(self.last_mm).map(|(out, last)| out - last);
        self.rise_mm.or_else(counted).filter(|low_mm| *low_mm > ON_SURFACE_MM)
    }

    fn lose_place(&mut self) {
        if !std::mem::replace(&mut self.is_unsure, true) {
            self.out_mm = self.out_mm.map(|out| out + UNSURE_MM);
        }
    }

    pub(super) fn restarted(&self) -> Self {
        let unseen_mm = if self.in_job { UNSEEN_MM } else { 0.0 };
        let low_mm = self.low_mm().unwrap_or_default() + unseen_mm;
        Self { rise_mm: (low_mm > 0.0).then_some(low_mm), is_unsure: true, ..Self::default() }
    }
}

impl Controller {
    /// Lift needed before X and Y jog without insisting, mm; `None` if the tip is not known to be in the
    /// board.
    pub fn lift_first_mm(&self) -> Option<f64> {
        self.depth.low_mm().map(|low_mm| libm::ceil((low_mm + CLEAR_MM) * 100.0) / 100.0)
    }

    /// The controller runs something that we didn't start, or stopped in a job: the tip may be in the board.
    pub(super) fn may_be_low(&mut self) {
        self.depth = TipDepth { in_job: true, ..self.depth }.restarted();
    }

    pub(super) fn depth_is_unsure(&mut self) {
        self.depth.lose_place();
    }

    pub(super) fn depth_reported(&mut self) {
        let Some(z_mm) = self.status.as_ref().and_then(|status| status.machine_mm).map(|place| place[2])
        else {
            return;
        };
        let in_job = self.run.is_some();
        let is_known = (self.height() != BoardHeight::Unknown || in_job)
            && (self.trust == Trust::Trusted || !self.homes());
        let surface_mm = self.zero_mm.map(|zero| zero[2]).filter(|_| is_known);
        // While the job waits for a tool, nothing cuts.
        let cuts = in_job && self.phase != EnginePhase::ToolChange;
        let depth = &mut self.depth;
        (depth.last_mm, depth.in_job) = (Some(z_mm), cuts);
        if let Some(rise_mm) = depth.rise_mm.take() {
            depth.out_mm = Some(z_mm + rise_mm);
        }
        if surface_mm.is_some() {
            (depth.out_mm, depth.is_unsure) = (surface_mm, false);
        } else if depth.is_unsure && depth.low_mm().is_none() {
            // The tip is out; the position of the board is unknown now.
            depth.out_mm = None;
        }
    }
}
