//! The playback.

use crate::engine::messages::Timed;
use crate::keys::Stride;
use crate::model::{Clocks, Effect, Event, Model, PlayEvent, update};
use annulus_core::geometry::Point;
use annulus_core::machine::virtual_drill;
use annulus_core::motion::timeline;
use annulus_core::sim::Playback;
use annulus_core::units::Length;
use std::sync::Arc;

fn um(um: i64) -> Length {
    Length::from_um(um)
}

pub(super) fn playing(at_s: f64, speed: f64) -> Model {
    let mut model = Model::default();
    model.board.timed = Some(Arc::new(Timed::default()));
    update(&mut model, PlayEvent::Speed { speed }.into());
    let mut timeline = Timed::default().timeline;
    timeline.moves.clear();
    model.play.playback = Some(Arc::new(Playback::new(timeline)));
    model.play.at_s = at_s;
    model
}

fn frame(model: &mut Model, page_ms: f64) -> Vec<Effect> {
    update(model, Event::Clock { clock: Clocks { page_ms, wall_ms: 0.0 } });
    update(model, PlayEvent::Frame.into())
}

#[test]
fn one_frame_is_requested_at_a_time() {
    let mut model = playing(0.0, 1.0);
    assert_eq!(update(&mut model, PlayEvent::Toggle.into()), [Effect::Frame]);
    assert_eq!(update(&mut model, PlayEvent::Toggle.into()), []);
    assert_eq!(update(&mut model, PlayEvent::Toggle.into()), [], "one is on its way");
    assert!(model.play.running);
    update(&mut model, PlayEvent::Hold { at_s: 0.0 }.into());
    assert_eq!(frame(&mut model, 16.0), [], "it holds");
    assert_eq!(update(&mut model, PlayEvent::Toggle.into()), [Effect::Frame]);
}

#[test]
fn playback_pauses_at_its_end() {
    let mut model = playing(0.0, 1.0);
    update(&mut model, PlayEvent::Toggle.into());
    assert_eq!(frame(&mut model, 0.0), [Effect::Frame], "the first frame sets the clock");
    assert_eq!(frame(&mut model, 100.0), [], "the end of nothing is at 0 s");
    assert!(!model.play.running);
}

#[test]
fn playback_speed_stays_within_its_steps() {
    let rows =
        [(1.0, true, 2.0), (1.0, false, 0.5), (1000.0, true, 1000.0), (0.1, false, 0.1), (10.0, true, 50.0)];
    for (speed, more, next) in rows {
        let mut model = playing(0.0, speed);
        update(&mut model, PlayEvent::Faster { more }.into());
        assert!((model.play.speed - next).abs() < 1e-9, "{speed} {more}");
    }
}

#[test]
fn new_plan_resets_the_playback() {
    let mut model = playing(3.0, 1.0);
    model.play.running = true;
    model.board.timed = Some(Arc::new(Timed::default()));
    update(&mut model, PlayEvent::Step { stride: Stride::Hole { onwards: true } }.into());
    assert!(model.play.at_s.abs() < 1e-9 && !model.play.running);
}

#[test]
fn working_speed_moves_the_playback_at_that_speed() {
    use annulus_core::job::{Command, Leg, Mark, Program};
    let mill = |x| Command::Mill { to: Point::from_mm(x, 0.0), height: um(-100), feed_um_per_s: 10_000 };
    let plunge = Command::Plunge { to: um(-100), feed_um_per_s: 5_000, gate: None };
    let up = Command::Retract { to: um(2_000) };
    let program = Program {
        name: String::new(),
        machine: String::new(),
        origin: Point::default(),
        bits: Vec::new(),
        accepted: Vec::new(),
        safe_height: um(2_000),
        spindles: 1,
        legs: vec![Leg { mark: Mark::Toolpath(0), commands: vec![plunge, mill(100.0), up] }],
    };
    let playback = Playback::new(timeline(&program, &virtual_drill()).unwrap());
    let begin_s = (0..4_000)
        .map(|ms| f64::from(ms) * 1e-3)
        .find(|at| playback.at(*at).is_some_and(|now| now.position_mm[0] > 10.0));
    let begin_s = begin_s.unwrap();
    for m_per_s in [0.002, 0.02, 0.1] {
        let mut model = playing(begin_s, 1.0);
        model.play.playback = Some(Arc::new(playback.clone()));
        update(&mut model, PlayEvent::Working { m_per_s }.into());
        model.play.running = true;
        frame(&mut model, 0.0);
        frame(&mut model, 100.0);
        let [x, ..] = playback.at(model.play.at_s).unwrap().position_mm;
        let [from, ..] = playback.at(begin_s).unwrap().position_mm;
        assert!((x - from - 100.0 * m_per_s).abs() < 0.02 + 2.0 * m_per_s, "{m_per_s} m/s: {} mm", x - from);
    }
}

#[test]
fn nearest_warning_is_shown_at_the_playback_position() {
    use crate::model::play::mark_at;
    use annulus_core::sim::{Fault, Warning};
    let warning = |at_s, fault| Warning { at_s, fault, leg: 0, depth_mm: 0.1 };
    let both = vec![warning(0.1, Fault::TooDeep), warning(0.3, Fault::Outside)];
    let rows = [
        (0.1, Some(Fault::TooDeep)),
        (0.3, Some(Fault::Outside)),
        (0.25, Some(Fault::Outside)),
        (0.0, Some(Fault::TooDeep)),
        (0.7, None),
    ];
    for (at_s, said) in rows {
        assert_eq!(mark_at(&both, at_s).map(|warning| warning.fault), said, "{at_s} s");
    }
}

#[test]
fn flat_view_is_chosen_or_the_only_view() {
    let mut model = playing(0.0, 1.0);
    assert!(!model.play.in_space(), "nothing is carved");
    update(&mut model, PlayEvent::Flat { flat: None }.into());
    assert!(model.play.flat);
    update(&mut model, PlayEvent::Flat { flat: Some(false) }.into());
    update(&mut model, PlayEvent::Space { there: false }.into());
    assert!(!model.play.flat && model.play.no_space && !model.play.in_space());
}
