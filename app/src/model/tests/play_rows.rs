//! The playback by rows.

use crate::engine::messages::Timed;
use crate::keys::Stride;
use crate::model::{Clock, Effect, Event, Model, PlayEvent, update};
use annulus_core::sim::Playback;
use std::sync::Arc;

/// A model that plays for ten seconds, at this second and speed.
fn playing(at_s: f64, speed: f64) -> Model {
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
    update(model, Event::Clock { clock: Clock { page_ms, wall_ms: 0.0 } });
    update(model, PlayEvent::Frame.into())
}

#[test]
fn one_frame_is_asked_for_at_a_time() {
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
fn it_holds_at_its_end() {
    let mut model = playing(0.0, 1.0);
    update(&mut model, PlayEvent::Toggle.into());
    assert_eq!(frame(&mut model, 0.0), [Effect::Frame], "the first frame sets the clock");
    assert_eq!(frame(&mut model, 100.0), [], "the end of nothing is at 0 s");
    assert!(!model.play.running);
}

#[test]
fn speeds_go_up_and_down_within_what_there_is() {
    let rows =
        [(1.0, true, 2.0), (1.0, false, 0.5), (1000.0, true, 1000.0), (0.1, false, 0.1), (10.0, true, 50.0)];
    for (speed, more, next) in rows {
        let mut model = playing(0.0, speed);
        update(&mut model, PlayEvent::Faster { more }.into());
        assert!((model.play.speed - next).abs() < 1e-9, "{speed} {more}");
    }
}

#[test]
fn another_plan_is_played_from_its_beginning() {
    let mut model = playing(3.0, 1.0);
    model.play.running = true;
    model.board.timed = Some(Arc::new(Timed::default()));
    update(&mut model, PlayEvent::Step { stride: Stride::Hole(true) }.into());
    assert!(model.play.at_s.abs() < 1e-9 && !model.play.running);
}
