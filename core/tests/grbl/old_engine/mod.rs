//! The engine as it was before its phases became activities, for comparison with today's.

mod alarm;
mod asks;
mod changer;
mod check;
mod depth;
mod ends;
mod engine;
mod hand;
mod height;
mod home;
mod jog;
mod look;
mod meet;
mod overrides;
mod park;
mod place;
mod room;
mod run;
mod setter;
mod shared;
mod stands;
mod survey;

pub(super) use engine::{Controller, step};

use annulus_core::grbl::{buffer, fits, heard, timing};
use shared::{lines, settings};

mod routine {
    pub(super) use annulus_core::grbl::{
        Course, Routine, RoutineAction, RoutineMove, Section, SectionKind, Spindle, TipPlace,
    };
}

mod written {
    pub(super) use annulus_core::grbl::WrittenLine;
}

impl Controller {
    pub(super) fn unlocks(&self) -> bool {
        let is_unlock = |sent: &engine::Outgoing| sent.meaning == engine::Meaning::Unlock;
        self.buffer.waiting().any(is_unlock) || self.queue.iter().any(is_unlock)
    }

    pub(super) fn outlives_its_job(&self) -> bool {
        use asks::EnginePhase::{Held, Holding, Measuring, ToolChange};
        let is_of_job = matches!(self.phase, Held | Holding | Measuring | ToolChange);
        is_of_job && self.run.is_none() && self.survey.is_none()
    }
}
