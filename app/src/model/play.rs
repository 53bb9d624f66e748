//! The playback: its program, the displayed second, its speed.
//!
//! ```text
//! timeline ─ Playback ─ at(second) ─▶ tool head, finished holes, stage       only the second changes
//! ```

use super::{Effect, Model, carved};
use crate::engine::messages::Timed;
use crate::keys::{Stride, Tab};
use annulus_core::sim::{Carving, Playback, Stock, Warning, nearest};
use annulus_core::units::TICK_HZ;
use std::sync::Arc;

pub const SPEEDS: [f64; 9] = [0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 50.0, 200.0, 1000.0];
/// Longest advance per frame in ms, so that a page that was hidden does not leap.
const LEAP_MS: f64 = 200.0;

#[derive(Clone, Debug, PartialEq)]
pub struct Play {
    pub playback: Option<Arc<Playback>>,
    /// The displayed second.
    pub at_s: f64,
    pub running: bool,
    /// Time scale.
    pub speed: f64,
    /// If set, the time scale varies so that the tool head moves at this speed on the screen, m/s.
    pub working_m_per_s: Option<f64>,
    /// The user chose the 2D view.
    pub flat: bool,
    /// The browser cannot draw the 3D view.
    pub no_space: bool,
    /// The stock at the displayed second, in the 3D view.
    pub carved: Option<Arc<Stock>>,
    pub warnings: Arc<Vec<Warning>>,
    carving: Option<Carving>,
    /// Everything was carved once, so every second is reached quickly.
    explored: bool,
    last_ms: Option<f64>,
    awaits: bool,
    of: Option<Arc<Timed>>,
}

impl Default for Play {
    fn default() -> Self {
        Self {
            playback: None,
            at_s: 0.0,
            running: false,
            speed: 10.0,
            working_m_per_s: None,
            flat: false,
            no_space: false,
            carved: None,
            warnings: Arc::default(),
            carving: None,
            explored: false,
            last_ms: None,
            awaits: false,
            of: None,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlayEvent {
    /// Start or hold; at the end, start from the beginning.
    Toggle,
    Hold {
        at_s: f64,
    },
    Seek {
        at_s: f64,
    },
    /// Jump to the next or previous segment or hole, or by one per cent.
    Step {
        stride: Stride,
    },
    End,
    Faster {
        more: bool,
    },
    Speed {
        speed: f64,
    },
    /// Vary the time scale for this speed of the tool head.
    Working {
        m_per_s: f64,
    },
    /// Jump to the moment when the tool cuts nearest to a position.
    At {
        /// Work coordinates, mm.
        place_mm: [f64; 2],
    },
    Wrong {
        on: bool,
    },
    /// Switch between 2D and 3D view.
    Flat {
        /// `None` toggles.
        flat: Option<bool>,
    },
    /// Whether the browser can draw the 3D view.
    Space {
        there: bool,
    },
    Frame,
}

const BESIDE_MM: f64 = 1.5;
const AT_MARK_S: f64 = 0.25;
/// Steps per frame for the variable time scale.
const PIECES: u32 = 16;

impl Play {
    pub fn total_s(&self) -> f64 {
        self.playback.as_ref().map_or(0.0, |playback| playback.total_s())
    }

    fn seek(&mut self, at_s: f64) {
        self.at_s = at_s.clamp(0.0, self.total_s());
    }

    fn step(&mut self, stride: Stride) {
        self.running = false;
        let Some(playback) = self.playback.clone() else { return };
        let now_s = self.at_s;
        let start_s = |tick: u64| tick as f64 / TICK_HZ as f64;
        let target = match stride {
            Stride::Percent { onwards: on } => {
                Some(now_s + if on { 0.01 } else { -0.01 } * playback.total_s())
            }
            Stride::Hole { onwards: on } => {
                neighbour(now_s, on, playback.drilled().iter().map(|drilled| drilled.done_s))
            }
            Stride::Segment { onwards: on } => {
                let moves = playback.timeline().moves.iter();
                neighbour(now_s, on, moves.map(|planned| start_s(planned.start_tick)))
            }
        };
        if let Some(target) = target {
            self.seek(target);
        }
    }

    fn run(&mut self) -> Vec<Effect> {
        if !self.running {
            return Vec::new();
        }
        // The time on hold does not count.
        self.last_ms = None;
        self.ask_for_frame()
    }

    fn after(&self, gone_s: f64) -> f64 {
        let (Some(m_per_s), Some(playback)) = (self.working_m_per_s, &self.playback) else {
            return self.at_s + gone_s * self.speed;
        };
        let piece_s = gone_s / f64::from(PIECES);
        (0..PIECES).fold(self.at_s, |at_s, _| {
            // While the tool head does not move, the playback runs in real time.
            let own = playback.at(at_s).map_or(0.0, |now| now.speed_mm_per_s);
            let factor = if own > 0.1 { m_per_s * 1e3 / own } else { 1.0 };
            at_s + piece_s * factor.clamp(SPEEDS[0], SPEEDS[SPEEDS.len() - 1])
        })
    }

    /// True if the 3D view is shown.
    pub fn in_space(&self) -> bool {
        !self.flat && !self.no_space && self.carved.is_some()
    }

    fn ask_for_frame(&mut self) -> Vec<Effect> {
        if std::mem::replace(&mut self.awaits, true) { Vec::new() } else { vec![Effect::Frame] }
    }

    fn carve(&mut self) {
        if let Some(carving) = &mut self.carving {
            carved::carve(carving, self.at_s, &mut self.carved);
        }
    }

    /// When the displayed second is reached, carves parts that were never carved.
    fn explore(&mut self) {
        let at_s = self.at_s;
        if let Some(carving) = self.carving.as_mut().filter(|carving| !carved::is_behind(carving, at_s)) {
            self.explored = carved::explore(carving);
        }
    }

    fn frame(&mut self, now_ms: f64) -> Vec<Effect> {
        self.awaits = false;
        if !self.running {
            self.carve();
            self.explore();
            return Vec::new();
        }
        let last_ms = self.last_ms.replace(now_ms);
        let gone_s = last_ms.map_or(0.0, |last_ms| (now_ms - last_ms).min(LEAP_MS)) / 1000.0;
        let at_s = self.after(gone_s);
        self.seek(at_s);
        self.carve();
        // `seek` has limited the second: the end is reached.
        if self.at_s < at_s {
            self.running = false;
            return Vec::new();
        }
        self.ask_for_frame()
    }
}

/// The nearest of the ascending `times` after (`on`) or before `now_s`.
fn neighbour(now_s: f64, on: bool, mut times: impl DoubleEndedIterator<Item = f64>) -> Option<f64> {
    const SAME_S: f64 = 1e-6;
    if on {
        times.find(|time| *time > now_s + SAME_S)
    } else {
        times.rev().find(|time| *time < now_s - SAME_S)
    }
}

/// The warning at `at_s`; the nearest one within `AT_MARK_S`.
pub fn mark_at(warnings: &[Warning], at_s: f64) -> Option<&Warning> {
    let away_s = |warning: &&Warning| (warning.at_s - at_s).abs();
    let near = warnings.iter().filter(|warning| away_s(warning) <= AT_MARK_S);
    near.min_by(|a, b| away_s(a).total_cmp(&away_s(b)))
}

fn next_speed(speed: f64, more: bool) -> f64 {
    let mut speeds = SPEEDS.into_iter();
    let found = if more { speeds.find(|one| *one > speed) } else { speeds.rev().find(|one| *one < speed) };
    found.unwrap_or(speed)
}

pub(super) fn hold(play: &mut Play, at_s: f64) {
    play.running = false;
    play.seek(at_s);
}

pub(super) fn update(model: &mut Model, event: PlayEvent) -> Vec<Effect> {
    let play = &mut model.play;
    match event {
        PlayEvent::Toggle => {
            if play.at_s >= play.total_s() && !play.running {
                play.at_s = 0.0;
            }
            play.running = !play.running;
            return play.run();
        }
        PlayEvent::Hold { at_s } => hold(play, at_s),
        PlayEvent::Seek { at_s } => play.seek(at_s),
        PlayEvent::Step { stride } => play.step(stride),
        PlayEvent::End => play.seek(play.total_s()),
        PlayEvent::Faster { more } => {
            (play.speed, play.working_m_per_s) = (next_speed(play.speed, more), None);
        }
        PlayEvent::Speed { speed } => (play.speed, play.working_m_per_s) = (speed, None),
        PlayEvent::Working { m_per_s } => play.working_m_per_s = Some(m_per_s),
        PlayEvent::At { place_mm } => {
            let timeline = play.playback.as_ref().map(|playback| playback.timeline());
            let found = timeline.and_then(|line| nearest(&line.moves, &line.mm_per_step, place_mm));
            if let Some((at_s, _)) = found.filter(|(_, away_mm)| *away_mm <= BESIDE_MM) {
                hold(play, at_s);
            }
        }
        PlayEvent::Wrong { on } => {
            let times = play.warnings.iter().map(|warning| warning.at_s);
            if let Some(at_s) = neighbour(play.at_s, on, times) {
                hold(play, at_s);
            }
        }
        PlayEvent::Flat { flat } => play.flat = flat.unwrap_or(!play.flat),
        PlayEvent::Space { there } => play.no_space = !there,
        PlayEvent::Frame => return play.frame(model.clock.page_ms),
    }
    Vec::new()
}

/// Starts a new plan from its beginning; in the 3D view, carves the stock up to the displayed second.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let (now, of) = (&model.board.timed, &model.play.of);
    if now.as_ref().map(Arc::as_ptr) != of.as_ref().map(Arc::as_ptr) {
        let playback = now.as_ref().map(|timed| Arc::new(Playback::new(timed.timeline.clone())));
        let of = now.clone();
        let play = &mut model.play;
        (play.playback, play.of, play.at_s, play.running) = (playback, of, 0.0, false);
        (play.carving, play.carved) = (None, None);
        let warnings = carved::warned(model);
        model.play.warnings = warnings;
    }
    let wanted = model.frame.tab == Tab::Simulate && !model.play.flat && !model.play.no_space;
    if wanted && model.play.carving.is_none() {
        let carving = carved::begin(model);
        let play = &mut model.play;
        play.carved = carving.as_ref().map(|carving| Arc::new(carving.stock().clone()));
        (play.carving, play.explored) = (carving, false);
    }
    let play = &mut model.play;
    let behind = play.carving.as_ref().is_some_and(|carving| carved::is_behind(carving, play.at_s));
    let unexplored = play.carving.is_some() && !play.explored && !play.running;
    if wanted && (behind || unexplored) { play.ask_for_frame() } else { Vec::new() }
}
