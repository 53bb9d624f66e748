//! What must be up before X and Y move: the tool, and the presser foot outside of drill cycles.
//!
//! X and Y don't jog while the tool is, or may be, in the board, unless the user insists. A trusted or
//! counted position decides. If the position was lost while the tool may have been low, it must first rise by
//! the greatest possible depth. The foot is down only while the machine drills.
//!
//! ```text
//! drill cycle ─ foot down … up ─▶ up        a stop held in the cycle ─▶ may be down ─▶ up, before X and Y move
//!                                                                                   └▶ up, once a jog lifts the tool
//! ```

use super::Owner;
use super::moves::{Doing, rest};
use crate::executor::Ended;
use annulus_core::control::{Event, Trust};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::machine::Steps;
use annulus_core::steps::{Segment, Stage, Switching};

/// Whether the foot may be down. Its sensor is optional, so the state is tracked here.
#[derive(Debug)]
pub(crate) struct Foot {
    may_be_down: bool,
    is_lifted: bool,
}

impl Default for Foot {
    /// After a start its state is unknown.
    fn default() -> Self {
        Self { may_be_down: true, is_lifted: false }
    }
}

impl Foot {
    pub(super) fn given(&mut self, segments: &[Segment]) {
        let switches = segments.iter().filter_map(|segment| match segment.effect {
            Switching::Foot { down } => Some(down),
            _ => None,
        });
        self.is_lifted = false;
        for down in switches {
            self.may_be_down |= down;
            self.is_lifted = !down;
        }
    }

    pub(super) fn played(&mut self, ended: Ended) {
        if ended == Ended::Completed && std::mem::take(&mut self.is_lifted) {
            self.may_be_down = false;
        }
    }
}

impl Owner {
    pub(super) fn foot_may_be_down(&self) -> bool {
        self.machine.foot.on && self.foot.may_be_down
    }

    pub(super) fn foot_switched(&mut self, place: u8) {
        self.foot.may_be_down |= self.machine.output_place(&self.machine.foot.output) == Some(place);
    }

    /// Adds "foot up" before a move of X or Y, if the foot may be down, for example after a held stop.
    /// Programs, queues, tool changes and parking have their own. A jog that lifts the tool out of the
    /// board also lifts the foot.
    pub(super) fn with_foot_up(&self, doing: &Doing, mut moves: Vec<Segment>) -> Vec<Segment> {
        let has_its_own = matches!(doing, Doing::Leg | Doing::Queue | Doing::Change | Doing::Park);
        if has_its_own || !self.foot_may_be_down() {
            return moves;
        }
        let in_plane = |piece: &Segment| piece.runs.iter().any(|run| run.axes & 0b11 != 0);
        if let Some(at) = moves.iter().position(in_plane) {
            let before = at.checked_sub(1).and_then(|before| moves.get(before));
            let from = before.map_or(self.position, |before| before.end);
            moves.insert(at, self.foot_up(from));
            return moves;
        }
        let end = moves.last().map_or(self.position, |last| last.end);
        let is_out = self.machine.lowest(&end) >= self.machine.on_surface()[2];
        if is_out && matches!(doing, Doing::Jog | Doing::Approach) {
            moves.push(self.foot_up(end));
        }
        moves
    }

    /// Lifts the foot and waits for its time.
    pub(super) fn foot_up(&self, at: Steps) -> Segment {
        rest(Stage::Dwell, Switching::Foot { down: false }, self.machine.foot.ticks(), at)
    }
}

impl Owner {
    /// Steps of Z above which X and Y may move. A tool of unknown length must stay at the change height
    /// during a tool change.
    fn safe_steps(&self) -> i64 {
        if self.session.changes_by_hand() && !self.length_is_known() {
            return self.machine.change_steps(&self.machine.on_surface());
        }
        let process = &self.machine.process;
        self.machine.z.scale.steps(process.surface + process.safe_height)
    }

    /// Steps that the tool must rise before X and Y jog; `None` if it is high enough.
    pub(super) fn lift_first_steps(&self) -> Option<i64> {
        let counted = self.safe_steps() - self.machine.lowest(&self.position);
        let counted = if self.session.trust == Trust::Lost { 0 } else { counted };
        Some(counted.max(self.unseen_steps)).filter(|steps| *steps > 0)
    }

    /// The same distance in mm, rounded up.
    pub(super) fn lift_first_mm(&self) -> Option<f64> {
        let length = self.machine.z.scale.length(self.lift_first_steps()?);
        Some((length.mm() * 100.0).ceil() / 100.0)
    }

    /// Jogs, if the tool may move that way.
    pub(super) fn ask_jog(&mut self, axis: u8, distance_um: i32, anyway: bool) -> Result<(), Diagnostic> {
        self.sideways(axis, anyway)?;
        self.jog_steps(axis, distance_um)?;
        self.try_event(Event::Jog { axis, distance_um })
    }

    /// Returns an error if X and Y may not jog now.
    fn sideways(&self, axis: u8, anyway: bool) -> Result<(), Diagnostic> {
        match self.lift_first_mm().filter(|_| axis < 2 && !anyway) {
            Some(mm) => Err(error!("control.tip_low", mm = format!("{mm:.2}"))),
            None => Ok(()),
        }
    }

    /// The position was lost while the tool had to rise by `before` steps; `None` if it was high enough.
    pub(super) fn lost_low(&mut self, before: Option<i64>) {
        self.unseen_steps = self.unseen_steps.max(before.unwrap_or_default());
    }

    /// Assumes the tool at the lowest end of travel.
    pub(crate) fn may_be_low(&mut self) {
        self.unseen_steps = self.safe_steps() - self.machine.z.scale.steps(self.machine.z.min);
    }

    /// The current action ended without a report.
    pub(super) fn ended_unseen(&mut self) {
        let is_high = matches!(self.doing, Doing::Nothing | Doing::Park | Doing::Clamp { .. });
        if !is_high {
            self.may_be_low();
        }
    }

    /// The axes stopped; `before` is the previous stop position.
    pub(super) fn has_risen(&mut self, before: &Steps) {
        let rise = self.machine.lowest(&self.position) - self.machine.lowest(before);
        if self.unseen_steps > 0 {
            self.unseen_steps = (self.unseen_steps - rise).max(0);
        }
    }
}
