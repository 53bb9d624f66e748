//! The Simulate screen: the planned motion played, faster or slower, forwards or by steps.
//!
//! ```text
//! timeline ─ Playback ─ at(second) ─▶ head, holes done, stage       the second is all that moves
//! ```
//!
//! Comes in: the plan in time. Goes out: the moment on show. Never moves a machine.

mod commands;
mod player;
mod scrub;

use crate::i18n::t;
use crate::keys::{Action, Stride};
use crate::page::open_board;
use crate::screens::cam;
use crate::screens::shown::Moment;
use crate::view::Progress;
use annulus_core::job::{Mark, Stage};
use annulus_core::sim::{self, Playback};
use leptos::html::div;
use leptos::prelude::*;
use std::cell::Cell;
use std::sync::Arc;

/// The playback: what is played, which second, how fast.
#[derive(Clone, Copy)]
pub(crate) struct Play {
    /// What is played.
    pub playback: Memo<Option<Arc<Playback>>>,
    /// The second on show.
    pub at_s: RwSignal<f64>,
    /// Whether it runs.
    pub running: RwSignal<bool>,
    /// Seconds of the plan in a second of the clock.
    pub speed: RwSignal<f64>,
}

thread_local! {
    static PLAY: Cell<Option<Play>> = const { Cell::new(None) };
}

/// The playback. Made by [`begin`].
pub(crate) fn play() -> Play {
    PLAY.get().expect("the playback is made before the first screen")
}

/// Makes it in the root of the page, after the desk.
pub(crate) fn begin() {
    let playback = Memo::new(move |_| {
        let timed = open_board().timed.get()?;
        Some(Arc::new(Playback::new(timed.timeline.clone())))
    });
    let play = Play {
        playback,
        at_s: RwSignal::new(0.0),
        running: RwSignal::new(false),
        speed: RwSignal::new(10.0),
    };
    PLAY.set(Some(play));
    Effect::new(move |_| {
        playback.track();
        play.at_s.set(0.0);
        play.running.set(false);
    });
    player::begin(play);
}

impl Play {
    /// How long all of it takes.
    pub(crate) fn total_s(self) -> f64 {
        self.playback.with(|playback| playback.as_ref().map_or(0.0, |playback| playback.total_s()))
    }

    /// The moment on show.
    pub(crate) fn now(self) -> Option<sim::Moment> {
        let at_s = self.at_s.get();
        self.playback.with(|playback| playback.as_ref()?.at(at_s))
    }

    /// Shows second `at_s`.
    pub(crate) fn seek(self, at_s: f64) {
        let total_s = self
            .playback
            .with_untracked(|playback| playback.as_ref().map_or(0.0, |playback| playback.total_s()));
        self.at_s.set(at_s.clamp(0.0, total_s));
    }

    /// Runs or holds; from the end it begins anew.
    pub(crate) fn toggle(self) {
        let at_end = self.at_s.get_untracked()
            >= self.playback.with_untracked(|p| p.as_ref().map_or(0.0, |p| p.total_s()));
        if at_end && !self.running.get_untracked() {
            self.seek(0.0);
        }
        self.running.update(|running| *running = !*running);
    }

    /// To the beginning of the next or last segment or hole, or by a hundredth.
    pub(crate) fn step(self, stride: Stride) {
        self.running.set(false);
        let now_s = self.at_s.get_untracked();
        let target = self.playback.with_untracked(|playback| {
            let playback = playback.as_ref()?;
            match stride {
                Stride::Percent(on) => Some(now_s + if on { 0.01 } else { -0.01 } * playback.total_s()),
                Stride::Hole(on) => {
                    neighbour(now_s, on, playback.drilled().iter().map(|drilled| drilled.done_s))
                }
                Stride::Segment(on) => {
                    let starts = playback
                        .timeline()
                        .moves
                        .iter()
                        .map(|planned| planned.start_tick as f64 / annulus_core::units::TICK_HZ as f64);
                    neighbour(now_s, on, starts)
                }
            }
        });
        if let Some(target) = target {
            self.seek(target);
        }
    }

    /// What a key asks of the playback.
    pub(crate) fn act(self, action: Action) {
        match action {
            Action::Play => self.toggle(),
            Action::Step(stride) => self.step(stride),
            Action::Beginning => self.seek(0.0),
            Action::End => {
                self.seek(self.playback.with_untracked(|p| p.as_ref().map_or(0.0, |p| p.total_s())));
            }
            Action::Faster(more) => self.speed.update(|speed| *speed = scrub::next_speed(*speed, more)),
            _ => {}
        }
    }
}

/// The nearest of `times` before or behind `now_s`; they ascend.
fn neighbour(now_s: f64, on: bool, mut times: impl DoubleEndedIterator<Item = f64>) -> Option<f64> {
    const SAME_S: f64 = 1e-6;
    if on {
        times.find(|time| *time > now_s + SAME_S)
    } else {
        times.rev().find(|time| *time < now_s - SAME_S)
    }
}

/// How far the picture is.
pub(crate) fn moment() -> Moment {
    let Some(now) = play().now() else { return Moment::default() };
    let drilling = matches!(now.mark, Mark::Hole(_)) && matches!(now.stage, Stage::Approach | Stage::Drill);
    let [x, y, _] = now.position_mm;
    let done = cam::ways()
        .with(|ways| ways.as_ref().map_or(now.holes_done, |ways| ways.done(now.leg, now.holes_done)));
    Moment { progress: Progress { discs: done, drilling, lines: done }, head_mm: Some([x, y]) }
}

/// The panels round the picture.
pub(crate) fn simulate() -> impl IntoView {
    (
        div().class("panel right commands").child(commands::commands()),
        div()
            .class("bottom timeline")
            .attr("role", "region")
            .attr("aria-label", t!("page.simulate.timeline"))
            .child((player::controls(), scrub::coarse(), scrub::fine())),
    )
}
