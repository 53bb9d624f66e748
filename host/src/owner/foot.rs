//! The presser foot outside of drill cycles: down only while the machine drills, up before anything else
//! moves over the board.
//!
//! ```text
//! drill cycle ─ foot down … up ─▶ up        a stop held in the cycle ─▶ may be down ─▶ up, before X and Y move
//!                                                                                   └▶ up, once a jog lifts the tool
//! ```

use super::Owner;
use super::moves::{Doing, rest};
use crate::executor::Ended;
use annulus_core::machine::Steps;
use annulus_core::steps::{Segment, Stage, Switching};

/// Whether the foot may be down. Its sensor is optional, so the state is tracked here.
#[derive(Debug)]
pub(crate) struct Foot {
    may_be_down: bool,
    /// The current task ends with the foot lifted.
    is_lifted: bool,
}

impl Default for Foot {
    /// After a start its state is unknown.
    fn default() -> Self {
        Self { may_be_down: true, is_lifted: false }
    }
}

impl Foot {
    /// Records the segments of the next task.
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

    /// Records how the task ended.
    pub(super) fn played(&mut self, ended: Ended) {
        if ended == Ended::Completed && std::mem::take(&mut self.is_lifted) {
            self.may_be_down = false;
        }
    }
}

impl Owner {
    /// Returns `true` if there is a foot that may be down.
    pub(super) fn foot_may_be_down(&self) -> bool {
        self.machine.foot.on && self.foot.may_be_down
    }

    /// An output was switched manually, or by a queue.
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
