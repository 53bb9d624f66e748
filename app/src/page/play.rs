//! The playback as signals.
//!
//! Goes out: signals to be read. Does not know how they are shown.

use super::signals as all;
use super::slots::Slots;
use crate::engine::messages::UnderTile;
use crate::model::lines::{WrittenProgram, row_now};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::sim::{Moment, Playback, Stock, Warning};
use leptos::prelude::*;
use std::sync::Arc;

/// The playback: what is played, which second, how fast.
#[derive(Clone, Copy)]
pub struct Play {
    /// What is played.
    pub playback: ReadSignal<Option<Arc<Playback>>>,
    /// The second on show.
    pub at_s: ReadSignal<f64>,
    /// Whether it runs.
    pub running: ReadSignal<bool>,
    /// Seconds of the plan in a second of the clock.
    pub speed: ReadSignal<f64>,
    /// The speed of the head on the screen, in metres a second, where that was chosen.
    pub working_m_per_s: ReadSignal<Option<f64>>,
    /// The board is looked at in space.
    pub in_space: ReadSignal<bool>,
    /// There is nothing that could draw it in space.
    pub no_space: ReadSignal<bool>,
    /// The board as it is carved now.
    pub carved: ReadSignal<Option<Arc<Stock>>>,
    /// What was cut of the other side before.
    pub under: ReadSignal<Arc<Vec<UnderTile>>>,
    /// What is wrong, and when.
    pub warnings: ReadSignal<Arc<Vec<Warning>>>,
    /// The lines of the program are looked at, and not the steps of the job.
    pub lines_shown: ReadSignal<bool>,
    /// The program, once it is written.
    pub written: ReadSignal<Option<Arc<WrittenProgram>>>,
    /// It is being written.
    pub writing: ReadSignal<bool>,
    /// Why it is not written.
    pub not_written: ReadSignal<Vec<Diagnostic>>,
    /// Its row that is done at the second on show.
    pub row_now: ReadSignal<Option<usize>>,
}

/// The playback.
pub fn play() -> Play {
    all().play
}

pub(super) fn signals(slots: &mut Slots) -> Play {
    Play {
        playback: slots.handle(|model| &model.play.playback),
        at_s: slots.part(|model| &model.play.at_s),
        running: slots.part(|model| &model.play.running),
        speed: slots.part(|model| &model.play.speed),
        working_m_per_s: slots.part(|model| &model.play.working_m_per_s),
        in_space: slots.made(|model| model.play.in_space()),
        no_space: slots.part(|model| &model.play.no_space),
        carved: slots.handle(|model| &model.play.carved),
        under: slots.kept(|model| &model.underside.tiles),
        warnings: slots.kept(|model| &model.play.warnings),
        lines_shown: slots.part(|model| &model.lines.shown),
        written: slots.handle(|model| &model.lines.written),
        writing: slots.made(|model| model.lines.is_on_the_way()),
        not_written: slots.part(|model| &model.lines.refused),
        row_now: slots.made(row_now),
    }
}

impl Play {
    /// How long all of it takes.
    pub fn total_s(self) -> f64 {
        self.playback.with(|playback| playback.as_ref().map_or(0.0, |playback| playback.total_s()))
    }

    /// The moment on show.
    pub fn now(self) -> Option<Moment> {
        let at_s = self.at_s.get();
        self.playback.with(|playback| playback.as_ref()?.at(at_s))
    }
}
