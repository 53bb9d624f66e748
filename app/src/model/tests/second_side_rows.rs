//! The second side: holes located by tip or camera, the fit, the aligned job, and a missing camera.

use super::line::status;
use crate::engine::messages::{Answer, Request, Timed};
use crate::model::{
    ControllerEvent, Effect, Event, Eye, Job, LinkEvent, Model, SecondSideEvent, StartEvent, Support, update,
};
use annulus_core::align::{BoardFit, aligned};
use annulus_core::control::{State, Trust};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Leg, Mark, Program};
use annulus_core::units::Length;
use annulus_core::wire::{Tell, program as bytes_of};
use std::sync::Arc;

/// True position of the board: rotated by nearly a degree and shifted by about a millimetre.
const TRUTH: BoardFit = BoardFit { turn_rad: 0.016, shift_mm: [1.25, -0.5], left_over_mm: 0.0 };
const ZERO_MM: [f64; 2] = [40.0, 30.0];
const CAMERA_MM: [f64; 2] = [55.5, -12.25];

fn program() -> Program {
    let um = Length::from_um;
    let hole = |(number, (x, y)): (u32, (f64, f64))| {
        let rapid = Command::Rapid { to: Point::from_mm(x, y) };
        let plunge = Command::Plunge { to: um(-1_700), feed_um_per_s: 5_000, gate: None };
        let commands = vec![rapid, plunge, Command::Retract { to: um(2_000) }];
        Leg { mark: Mark::Hole(number), commands }
    };
    let places = [(3.0, 4.0), (83.0, 4.0), (40.0, 30.0), (3.0, 64.0)];
    Program {
        name: "holes".to_owned(),
        machine: String::new(),
        origin: Point::default(),
        bits: Vec::new(),
        accepted: Vec::new(),
        safe_height: um(2_000),
        spindles: 1,
        legs: (0..).zip(places).map(hole).collect(),
    }
}

fn tell(model: &mut Model, event: SecondSideEvent) -> Vec<Effect> {
    update(model, event.into())
}

/// Sets the tool head's position, machine mm.
fn stands(model: &mut Model, [x, y]: [f64; 2]) {
    let mut now = status(State::Ready, None);
    (now.machine_mm, now.zero_mm) = ([x, y, 0.0], Some(ZERO_MM));
    model.link.status = Some(Arc::new(now));
}

fn begun() -> Model {
    let mut model = Model::default();
    let program = program();
    let bytes = bytes_of::encode(&program);
    let key = bytes_of::key(&bytes);
    model.board.job = Some(Arc::new(Job { program, bytes, key, stream_digest: "planned".to_owned() }));
    stands(&mut model, [0.0, 0.0]);
    tell(&mut model, SecondSideEvent::Show { on: true });
    model
}

/// Moves to the selected hole's true position and takes it.
fn find(model: &mut Model, by_camera: bool) {
    let sought = model.second_side.holes[model.second_side.aimed].planned;
    let lies = TRUTH.moved(sought);
    let from = if by_camera { CAMERA_MM } else { [0.0; 2] };
    stands(model, [lies.x.mm() + ZERO_MM[0] - from[0], lies.y.mm() + ZERO_MM[1] - from[1]]);
    tell(model, SecondSideEvent::Take { by_camera });
}

#[test]
fn holes_located_by_tool_or_camera_align_the_job() {
    let mut model = begun();
    let count = model.second_side.holes.len();
    assert!(count >= 2, "{:?}", model.second_side.holes);
    // Without a camera offset the crosshair locates nothing.
    find(&mut model, true);
    assert_eq!(model.second_side.holes[0].found_mm, None);
    stands(&mut model, [100.0, 80.0]);
    tell(&mut model, SecondSideEvent::Dot);
    stands(&mut model, [100.0 - CAMERA_MM[0], 80.0 - CAMERA_MM[1]]);
    let kept = tell(&mut model, SecondSideEvent::OnDot);
    assert_eq!(kept, [Effect::KeepCamera { offset_mm: CAMERA_MM }]);
    find(&mut model, true);
    assert_eq!((model.second_side.aimed, model.second_side.fit.clone()), (1, None), "one hole tells nothing");
    (1..count).for_each(|_| find(&mut model, false));
    let fit = model.second_side.fit.clone().unwrap().unwrap();
    assert!((fit.turn_rad - TRUTH.turn_rad).abs() < 1e-6 && fit.left_over_mm < 1e-4, "{fit:?}");
    // An applied fit is used only after the aligned job is timed.
    let effects = tell(&mut model, SecondSideEvent::Apply { on: true });
    let [Effect::Ask { number, request, .. }] = effects.as_slice() else { panic!("{effects:?}") };
    let Request::Time(wanted) = request.as_ref() else { panic!("{request:?}") };
    let along = aligned(&program(), &fit);
    assert_eq!(wanted.program, bytes_of::encode(&along));
    assert_eq!(update(&mut model, StartEvent::Open.into()), [], "it is not there yet");
    let timed = Timed { stream_digest: "along".to_owned(), ..Timed::default() };
    update(&mut model, Event::Answered { number: *number, answer: Ok(Answer::Timed(timed)) });
    assert_eq!(model.start.shown.as_ref().map(|job| job.program.clone()), Some(along));
    update(&mut model, StartEvent::Open.into());
    let preflight = model.start.preflight.clone().unwrap();
    assert_eq!(preflight.own_digest, "along");
    assert_eq!(preflight.lies.map(|why| why.code).as_deref(), Some("align.lies"));
    // When it is no longer applied, the planned job is used.
    tell(&mut model, SecondSideEvent::Apply { on: false });
    update(&mut model, StartEvent::Open.into());
    let preflight = model.start.preflight.clone().unwrap();
    assert_eq!((preflight.own_digest.as_str(), preflight.lies), ("planned", None));
}

#[test]
fn misfit_holes_give_an_error_and_no_aligned_job() {
    let mut model = begun();
    (0..model.second_side.holes.len()).for_each(|_| find(&mut model, false));
    tell(&mut model, SecondSideEvent::Aim { hole: 1 });
    let [x, y] = model.second_side.holes[1].found_mm.unwrap();
    stands(&mut model, [x + 2.0, y]);
    tell(&mut model, SecondSideEvent::Take { by_camera: false });
    let code = |model: &Model| model.second_side.fit.clone().and_then(Result::err).map(|why| why.code);
    assert_eq!(code(&model).as_deref(), Some("align.apart"));
    assert_eq!(tell(&mut model, SecondSideEvent::Apply { on: true }), []);
    assert_eq!(model.second_side.job, None);
}

#[test]
fn late_camera_is_closed_and_a_lost_one_reported() {
    let mut model = begun();
    assert_eq!(tell(&mut model, SecondSideEvent::Look { on: true }), [Effect::Camera { on: true }]);
    assert_eq!(model.second_side.eye, Eye::Opening);
    tell(&mut model, SecondSideEvent::Eye { eye: Eye::Open });
    let gone = Eye::Blind(Diagnostic::error("camera.lost"));
    tell(&mut model, SecondSideEvent::Eye { eye: gone.clone() });
    assert_eq!(model.second_side.eye, gone);
    // Locating by tip still works.
    find(&mut model, false);
    assert!(model.second_side.holes[0].found_mm.is_some());
    tell(&mut model, SecondSideEvent::Look { on: true });
    assert_eq!(tell(&mut model, SecondSideEvent::Show { on: false }), [Effect::Camera { on: false }]);
    let late = tell(&mut model, SecondSideEvent::Eye { eye: Eye::Open });
    assert_eq!((late, &model.second_side.eye), (vec![Effect::Camera { on: false }], &Eye::Shut));
}

#[test]
fn another_job_or_hole_discards_located_positions() {
    let mut model = begun();
    find(&mut model, false);
    let before: Vec<_> = model.second_side.holes.iter().map(|hole| hole.planned).collect();
    tell(&mut model, SecondSideEvent::Aim { hole: 0 });
    tell(&mut model, SecondSideEvent::Other);
    let now = model.second_side.holes[0];
    assert_eq!((before.contains(&now.planned), now.found_mm), (false, None), "the one in the middle");
    // A deeper plan has the same holes: located positions stay. Another board has other holes.
    find(&mut model, false);
    let found = model.second_side.holes.clone();
    let plan = |model: &mut Model, program: Program| {
        let job = Job { program, bytes: Vec::new(), key: "anew".to_owned(), stream_digest: String::new() };
        model.board.job = Some(Arc::new(job));
        tell(model, SecondSideEvent::Apply { on: false });
    };
    plan(&mut model, program());
    assert_eq!(model.second_side.holes, found);
    let mut other = program();
    other.legs.pop();
    plan(&mut model, other);
    assert!(model.second_side.holes.iter().all(|hole| hole.found_mm.is_none()));
}

/// All holes located, the aligned job timed.
fn goes_along() -> Model {
    let mut model = begun();
    (0..model.second_side.holes.len()).for_each(|_| find(&mut model, false));
    let effects = tell(&mut model, SecondSideEvent::Apply { on: true });
    let [Effect::Ask { number, .. }] = effects.as_slice() else { panic!("{effects:?}") };
    let timed = Timed { stream_digest: "along".to_owned(), ..Timed::default() };
    update(&mut model, Event::Answered { number: *number, answer: Ok(Answer::Timed(timed)) });
    assert!(model.second_side.lies().is_some());
    model
}

fn said_before_start(model: &mut Model) -> Option<String> {
    update(model, StartEvent::Open.into());
    model.start.preflight.clone().and_then(|preflight| preflight.lies).map(|why| why.code)
}

#[test]
fn lost_position_discards_the_alignment() {
    let mut model = goes_along();
    assert_eq!(said_before_start(&mut model).as_deref(), Some("align.lies"));
    let mut lost = status(State::NotHomed, None);
    lost.trust = Trust::Lost;
    update(&mut model, LinkEvent::Heard { tell: Some(Box::new(Tell::Status(Box::new(lost)))) }.into());
    // The position counts from zero again, and the user sets a work zero: equal numbers, other positions.
    let mut now = status(State::Ready, None);
    (now.machine_mm, now.zero_mm) = ([0.0; 3], Some([0.0; 2]));
    update(&mut model, LinkEvent::Heard { tell: Some(Box::new(Tell::Status(Box::new(now)))) }.into());
    let side = &model.second_side;
    assert!(side.holes.iter().all(|hole| hole.found_mm.is_none()) && !side.applied, "{side:?}");
    assert_eq!((side.fit.clone(), side.job.clone(), side.lies()), (None, None, None));
    // A warning reports that the job is not aligned.
    assert_eq!(said_before_start(&mut model).as_deref(), Some("align.forgotten"));
    // After locating the holes again, the job is aligned again.
    (0..model.second_side.holes.len()).for_each(|_| find(&mut model, false));
    tell(&mut model, SecondSideEvent::Apply { on: true });
    assert!(model.second_side.waits() && !model.second_side.forgotten);
}

#[test]
fn new_controller_discards_located_holes() {
    let mut model = goes_along();
    model.link.controller.support = Support::Yes;
    update(&mut model, LinkEvent::Controller(ControllerEvent::Chosen).into());
    assert!(model.link.controller.chosen);
    assert!(model.second_side.holes.iter().all(|hole| hole.found_mm.is_none()) && !model.second_side.applied);
}

#[test]
fn untrusted_position_locates_no_hole() {
    let mut model = begun();
    stands(&mut model, [3.0 + ZERO_MM[0], 4.0 + ZERO_MM[1]]);
    let mut now = model.link.status.as_deref().cloned().unwrap();
    now.trust = Trust::Suspect;
    model.link.status = Some(Arc::new(now));
    tell(&mut model, SecondSideEvent::Dot);
    tell(&mut model, SecondSideEvent::Take { by_camera: false });
    assert_eq!((model.second_side.holes[0].found_mm, model.second_side.dot_mm), (None, None));
}

#[test]
fn moved_zero_limits_the_board_shift() {
    let mut model = goes_along();
    let moved = |model: &mut Model, by_mm: f64| {
        let mut now = status(State::Ready, None);
        now.zero_mm = Some([ZERO_MM[0] + by_mm, ZERO_MM[1]]);
        model.link.status = Some(Arc::new(now));
        tell(model, SecondSideEvent::Aim { hole: 0 });
        model.second_side.fit.clone().unwrap().map(|_| ()).map_err(|why| why.code)
    };
    assert_eq!(moved(&mut model, 5.0), Ok(()), "a corner that was set more exactly");
    assert_eq!(moved(&mut model, 60.0), Err("align.zero_elsewhere".to_owned()));
    assert_eq!(model.second_side.job, None);
    // Located from this zero, any shift is accepted.
    tell(&mut model, SecondSideEvent::Aim { hole: 0 });
    let [x, y] = model.second_side.holes[0].found_mm.unwrap();
    let mut now = model.link.status.as_deref().cloned().unwrap();
    now.machine_mm = [x, y, 0.0];
    model.link.status = Some(Arc::new(now));
    tell(&mut model, SecondSideEvent::Take { by_camera: false });
    assert!(model.second_side.fit.clone().unwrap().is_ok(), "{:?}", model.second_side.fit);
}
