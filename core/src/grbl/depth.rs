//! Whether the tip is, or may be, in the board: X and Y don't jog then, unless the user insists.
//!
//! The board height outlives a lost position, because step counts continue after a reset. After a restart of
//! the controller they begin at zero; then the tip counts as in the board until it has risen far enough.

/// Tolerance for reports: a tip this far below the surface is on it, mm.
const ON_SURFACE_MM: f64 = 0.01;
/// Largest error of the step counts after the position was lost, mm.
const UNSURE_MM: f64 = 0.5;
/// Allowance for motion in a job since the last report, mm.
const UNSEEN_MM: f64 = 5.0;
/// *Lift first* lifts to this height above the surface, mm.
const CLEAR_MM: f64 = 1.0;

/// Height of the tip relative to the board. Machine coordinates, mm.
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
    /// How far the tip must rise to leave the board.
    fn low_mm(&self) -> Option<f64> {
        let counted = || self.out_mm.zip(self.last_mm).map(|(out, last)| out - last);
        self.rise_mm.or_else(counted).filter(|low_mm| *low_mm > ON_SURFACE_MM)
    }

    pub(super) fn lose_place(&mut self) {
        // Only once: UNSURE_MM covers all losses until the board is known again.
        if !std::mem::replace(&mut self.is_unsure, true) {
            self.out_mm = self.out_mm.map(|out| out + UNSURE_MM);
        }
    }

    /// State after the step counts restarted at zero.
    pub(super) fn restarted(&self) -> Self {
        let unseen_mm = if self.in_job { UNSEEN_MM } else { 0.0 };
        let low_mm = self.low_mm().unwrap_or_default() + unseen_mm;
        Self { rise_mm: (low_mm > 0.0).then_some(low_mm), is_unsure: true, ..Self::default() }
    }

    /// Lift needed before X and Y jog without insisting, mm; `None` if the tip is not known to be in the
    /// board.
    pub(super) fn lift_first_mm(&self) -> Option<f64> {
        self.low_mm().map(|low_mm| libm::ceil((low_mm + CLEAR_MM) * 100.0) / 100.0)
    }

    /// The controller runs something that we didn't start, or stopped in a job: the tip may be in the board.
    pub(super) fn may_be_low(&mut self) {
        *self = Self { in_job: true, ..*self }.restarted();
    }

    /// A report arrived. `surface_mm`: Z of the board, if known.
    pub(super) fn follow(&mut self, z_mm: f64, surface_mm: Option<f64>, cuts: bool) {
        (self.last_mm, self.in_job) = (Some(z_mm), cuts);
        if let Some(rise_mm) = self.rise_mm.take() {
            self.out_mm = Some(z_mm + rise_mm);
        }
        if surface_mm.is_some() {
            (self.out_mm, self.is_unsure) = (surface_mm, false);
        } else if self.is_unsure && self.low_mm().is_none() {
            // The tip is out; the position of the board is unknown now.
            self.out_mm = None;
        }
    }
}
