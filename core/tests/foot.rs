//! Tests of the presser foot: down before the tool enters the board, up after it has left, with time for
//! both. The foot's sensor is an interlock. After STOP the foot is lifted. Streams that break these rules
//! are refused.

use crate::operator::{OnTime, Orders};
use crate::programs::{Chance, one_by_one, random_program};
use annulus_core::check;
use annulus_core::geometry::Point;
use annulus_core::job::{Bit, Command, Cutter, Input, Leg, Mark, Program, Stage, Switching};
use annulus_core::machine::{Machine, Steps, Value, apply, hobby_3018};
use annulus_core::motion;
use annulus_core::pins::{Motors, Order, Outcome, Pins, Playhead, Recorder, Steady, Written, play};
use annulus_core::queue::{Mode, Rehearsal, Rest, Rig, read};
use annulus_core::steps::{self, Segment, StepStream, TICK_HZ};
use annulus_core::units::Length;
use annulus_core::virtual_drill::{Faults, VirtualDrill};
use std::sync::{Arc, Mutex};

const FOOT_TICKS: u64 = TICK_HZ * 80 / 1_000;

fn on(machine: &Machine) -> Machine {
    let text = |text: &str| Value::Text(text.to_owned());
    let changes = [("foot.on", text("yes")), ("foot.time", Value::Number(80.0)), ("overlap.on", text("no"))];
    apply(machine, &changes.map(|(key, value)| (key.to_owned(), value))).unwrap()
}

/// Four holes, one of them drilled in two cycles, and a path.
fn program(machine: &Machine) -> Program {
    let mut program = random_program(&mut Chance::new(5), machine, 4);
    let deep = program.legs[1].commands[1];
    let up = Command::Retract { to: machine.process.safe_height };
    let part = Command::Plunge { to: Length::from_mm(-0.5), feed_um_per_s: 2_000, gate: None };
    program.legs[1].commands = vec![Command::Rapid { to: Point::from_mm(9.0, 9.0) }, part, up, deep, up];
    let shallow = Length::from_mm(-0.2);
    let path = vec![
        Command::Rapid { to: Point::from_mm(2.0, 2.0) },
        Command::Plunge { to: shallow, feed_um_per_s: 2_000, gate: None },
        Command::Mill { to: Point::from_mm(12.0, 2.0), height: shallow, feed_um_per_s: 2_000 },
        up,
    ];
    let last = program.legs.len() - 1;
    program.legs.insert(last, Leg { mark: Mark::Toolpath(0), commands: path });
    program
}

fn stream(machine: &Machine) -> StepStream {
    steps::stream(&motion::timeline(&program(machine), machine).unwrap(), machine).unwrap()
}

fn played(machine: &Machine, segments: &[Segment], pins: &mut dyn Pins, start: Steps) -> (Outcome, Playhead) {
    played_with(&Motors::of(machine), segments, pins, start)
}

fn played_with(
    motors: &Motors,
    segments: &[Segment],
    pins: &mut dyn Pins,
    start: Steps,
) -> (Outcome, Playhead) {
    let (mut line, mut clock) = (Playhead { position: start, ..Playhead::default() }, OnTime(0));
    for segment in segments {
        let mut operator = Orders([(u64::MAX, Order::Stop); 2], line.tick);
        let outcome = play(segment, motors, &mut line, pins, &mut clock, &mut operator);
        if outcome != Outcome::Completed {
            return (outcome, line);
        }
    }
    (Outcome::Completed, line)
}

#[test]
fn pressure_foot_is_down_only_around_a_plunge() {
    for base in [one_by_one(), hobby_3018()] {
        let machine = on(&base);
        let stream = stream(&machine);
        let mut recorder = Recorder { position: stream.start, ..Recorder::default() };
        // The executor has no foot configured, so that the interlock can't interfere.
        let motors = Motors { pressed: 0, ..Motors::of(&machine) };
        let (outcome, _) = played_with(&motors, &stream.segments, &mut recorder, stream.start);
        assert_eq!(outcome, Outcome::Completed);
        let (mut down, mut since, mut z, mut strokes) = (false, None::<u64>, stream.start[2], 0);
        // The path, including the plunge to it, is milled with the foot up.
        let ends = stream.segments.iter().scan(0, |end, segment| {
            *end += segment.duration_ticks;
            Some((*end - segment.duration_ticks, *end, segment.mark))
        });
        let path: Vec<_> = ends.filter(|(.., mark)| matches!(mark, Mark::Toolpath(_))).collect();
        let in_path = |tick: u64| path.iter().any(|(from, end, _)| (*from..=*end).contains(&tick));
        let mut milled = 0;
        for written in &recorder.written {
            match *written {
                Written::Output { tick, place, on } => {
                    assert_eq!(Some(place), machine.output_place("foot"));
                    assert_ne!(on, down, "each way once");
                    (down, since) = (on, Some(tick));
                    strokes += u32::from(on);
                }
                Written::Step { tick, axes, forward } => {
                    let there = since.is_none_or(|since| tick >= since + FOOT_TICKS);
                    if axes & 4 != 0 {
                        z += if forward & 4 != 0 { 1 } else { -1 };
                    }
                    milled += u32::from(axes & 3 != 0 && z < 0);
                    assert!(axes & 3 == 0 || !down && there, "X or Y moves under the foot at {tick}");
                    assert!(
                        z >= 0 || in_path(tick) || down && there,
                        "the bit enters without the foot at {tick}"
                    );
                }
                _ => {}
            }
        }
        assert_eq!(
            (strokes, down),
            (4, false),
            "once a hole, also where it is drilled in two strokes: {}",
            machine.name
        );
        assert!(milled > 10, "the path is milled with the foot up");
    }
}

#[test]
fn stream_without_a_foot_switches_no_foot() {
    let machine = one_by_one();
    let switched = |machine: &Machine| {
        stream(machine)
            .segments
            .iter()
            .filter(|segment| matches!(segment.effect, Switching::Foot { .. }))
            .count()
    };
    assert_eq!((switched(&machine), switched(&on(&machine))), (0, 8));
    assert_ne!(machine.fingerprint(), on(&machine).fingerprint());
}

#[test]
fn check_refuses_plunge_without_foot_and_xy_motion_under_it() {
    let machine = on(&one_by_one());
    let zero = check::roomy_zero(&machine, Point::default());
    let verdict = |change: fn(&mut StepStream)| {
        let mut stream = stream(&machine);
        change(&mut stream);
        let found = check::verify(&stream, &machine, zero).err().unwrap_or_default();
        found.into_iter().map(|why| why.code).collect::<std::collections::BTreeSet<_>>()
    };
    fn foot(stream: &mut StepStream, is_down: bool) -> &mut Segment {
        let is_it = |segment: &&mut Segment| segment.effect == Switching::Foot { down: is_down };
        stream.segments.iter_mut().find(is_it).unwrap()
    }
    let only = |code: &str| std::collections::BTreeSet::from([code.to_owned()]);
    assert!(verdict(|_| {}).is_empty());
    assert_eq!(verdict(|stream| foot(stream, true).effect = Switching::None), only("check.foot_up"));
    assert_eq!(verdict(|stream| foot(stream, true).duration_ticks -= 10), only("check.foot_up"));
    assert_eq!(verdict(|stream| foot(stream, false).duration_ticks -= 10), only("check.foot_down"));
    assert!(verdict(|stream| foot(stream, false).effect = Switching::None).contains("check.foot_down"));
}

#[test]
fn foot_sensor_and_cover_stop_all_but_upward_motion() {
    let machine = on(&one_by_one());
    let stream = stream(&machine);
    let [foot, cover] = [Input::FootDown, Input::CoverOpen].map(Input::bit);
    // Inputs by tick, the outcome that they cause, and a name.
    let down_at = {
        let mut now = 0;
        let mut at = 0;
        for segment in &stream.segments {
            if segment.effect == (Switching::Foot { down: true }) {
                at = now;
                break;
            }
            now += segment.duration_ticks;
        }
        at
    };
    let there = down_at + FOOT_TICKS;
    type Row<'a> = (&'a [(u64, u32)], Outcome, &'a str);
    let rows: [Row; 4] = [
        (&[(0, 0)], Outcome::Missing(Input::FootDown), "it never came down"),
        (&[(down_at, foot), (there + TICK_HZ / 50, 0)], Outcome::Missing(Input::FootDown), "it lets go"),
        (&[(down_at, foot)], Outcome::Guarded(Input::FootDown), "it stays down"),
        (&[(0, cover)], Outcome::Guarded(Input::CoverOpen), "the cover is open"),
    ];
    for (script, expected, what) in rows {
        let mut recorder =
            Recorder { position: stream.start, script: script.to_vec(), ..Recorder::default() };
        let (outcome, line) = played(&machine, &stream.segments, &mut recorder, stream.start);
        assert_eq!(outcome, expected, "{what}");
        assert_eq!(line.position, recorder.position, "every step is counted: {what}");
        if what == "it never came down" {
            assert_eq!(line.position[2], stream.start[2], "the bit did not go down");
        }
    }
    // Upward moves are allowed.
    let up = stream.segments.iter().find(|segment| segment.stage == Stage::Retract).unwrap();
    let mut recorder = Recorder { script: vec![(0, cover)], ..Recorder::default() };
    assert_eq!(
        played(&machine, std::slice::from_ref(up), &mut recorder, Steps::default()).0,
        Outcome::Completed
    );
}

#[test]
fn virtual_drill_lowers_the_foot_for_every_hole() {
    let machine = on(&one_by_one());
    let holes = Arc::new(Mutex::new(Vec::new()));
    let sink = Arc::clone(&holes);
    let drilled = Box::new(move |hole: &_| sink.lock().unwrap().push(*hole));
    let mut drill = Steady::new(VirtualDrill::new(&machine, 1, Faults::default(), drilled));
    let mill = Bit { cutter: Cutter::Mill, ..program(&machine).bits[0].clone() };
    drill.bit(0, &mill);
    let stream = stream(&machine);
    // The board is under the drill, and the spindle is at the height at which the program begins.
    let [x, y, z] = drill.inner().real();
    let surface = machine.z.scale.steps(machine.process.surface);
    let mut line = Playhead { position: [x, y, z, 0, 0, 0, 0, 0], ..Playhead::default() };
    let motors = Motors::of(&machine);
    let mut to = line.position;
    to[2] = surface + stream.start[2];
    let down = motion::cycles::go_to(&machine, line.position, to).unwrap();
    let before = down.moves.iter().map(|planned| steps::segment(planned, &machine));
    let mut seen = [false; 2];
    for segment in before.chain(stream.segments.iter().cloned()) {
        let mut operator = Orders([(u64::MAX, Order::Stop); 2], line.tick);
        let mut clock = OnTime(line.tick);
        let outcome = play(&segment, &motors, &mut line, &mut drill, &mut clock, &mut operator);
        assert_eq!(outcome, Outcome::Completed, "{:?}", segment.stage);
        if let Switching::Foot { down } = segment.effect {
            let is_down = drill.inputs(line.tick) & Input::FootDown.bit() != 0;
            assert_eq!(is_down, down, "its sensor tells when its time is over");
            seen[usize::from(down)] = true;
        }
    }
    assert_eq!(seen, [true, true]);
    assert_eq!((holes.lock().unwrap().len(), drill.inner().broken()), (4, None));
}

#[test]
fn queue_lowers_the_foot_for_a_stroke() {
    let machine = on(&one_by_one());
    let mut drill = Steady::new(VirtualDrill::new(&machine, 1, Faults::default(), Box::new(|_| {})));
    let rig = Rig::homed(&machine, &mut drill).unwrap();
    let run = |text: &str, rig: Rig, drill: &mut Steady<VirtualDrill>| {
        let queue = read("", text).unwrap();
        let mut rehearsal = Rehearsal::new(queue, machine.output_names(), rig);
        let rest = rehearsal.go(&machine, Mode::ToEnd, drill, usize::MAX);
        (rest, rehearsal.bench())
    };
    let (rest, rig) = run("SPINDLE 20000\nMOVE_BY 400 400\nDRILL_DOWN\n", rig, &mut drill);
    assert_eq!(rest, Some(Rest::Done));
    assert!(rig.line.foot_down && drill.inputs(rig.line.tick) & Input::FootDown.bit() != 0);
    let (rest, rig) = run("DRILL_UP\nMOVE_BY 400 0\n", rig, &mut drill);
    assert_eq!(rest, Some(Rest::Done));
    assert!(!rig.line.foot_down && drill.inputs(rig.line.tick) & Input::FootDown.bit() == 0);
    // Homing that raises the tool leaves the foot down: the next move of X or Y must raise the foot first.
    let mut rig = rig;
    for text in
        ["HOME Z\nMOVE_BY 400 0\n", "HOME ALL\n", "DRILL_UP\nOUTPUT foot ON\nWAIT 200\nMOVE_BY 400 0\n"]
    {
        let down = format!("SPINDLE 20000\nMOVE_BY 400 0\nDRILL_DOWN\n{text}");
        let (rest, next) = run(&down, rig, &mut drill);
        assert_eq!(rest, Some(Rest::Done), "{text}");
        rig = next;
        assert!(!rig.line.foot_down && drill.inputs(rig.line.tick) & Input::FootDown.bit() == 0, "{text}");
    }
}

#[test]
fn missing_or_early_contact_is_detected_at_its_hole() {
    for overlap in [true, false] {
        let text = |text: &str| Value::Text(text.to_owned());
        let word = if overlap { "yes" } else { "no" };
        let changes = [("stroke.contact_tolerance", Value::Number(0.1)), ("overlap.on", text(word))];
        let machine = apply(&one_by_one(), &changes.map(|(key, value)| (key.to_owned(), value))).unwrap();
        type Row = (Faults, fn(&Outcome) -> bool);
        let slips = |bit_slips_mm: f64| Faults { bit_slips_mm, ..Faults::default() };
        let rows: [Row; 4] = [
            (Faults::default(), |outcome| *outcome == Outcome::Completed),
            (slips(0.08), |outcome| *outcome == Outcome::Completed),
            (slips(0.25), |outcome| matches!(outcome, Outcome::Early { .. })),
            (Faults { stuck_off: Input::Contact.bit(), ..Faults::default() }, |outcome| {
                *outcome == Outcome::Missing(Input::Contact)
            }),
        ];
        for (faults, is_expected) in rows {
            let mut drill = Steady::new(VirtualDrill::new(&machine, 1, faults, Box::new(|_| {})));
            let program = random_program(&mut Chance::new(5), &machine, 4);
            let stream = steps::stream(&motion::timeline(&program, &machine).unwrap(), &machine).unwrap();
            let [x, y, z] = drill.inner().real();
            let surface = machine.z.scale.steps(machine.process.surface);
            let from = [x, y, z, 0, 0, 0, 0, 0];
            let mut to = from;
            to[2] = surface + stream.start[2];
            let down = motion::cycles::go_to(&machine, from, to).unwrap();
            let before = down.moves.iter().map(|planned| steps::segment(planned, &machine));
            let pieces: Vec<Segment> = before.chain(stream.segments.iter().cloned()).collect();
            let (outcome, line) = played(&machine, &pieces, &mut drill, from);
            assert!(is_expected(&outcome), "overlap {overlap}: {outcome:?}");
            let steps = |mm: f64| machine.z.scale.steps(Length::from_mm(mm));
            let deep = surface - steps(0.4);
            assert!(outcome == Outcome::Completed || line.position[2] > deep, "it stops where it noticed");
            if let Outcome::Early { at } = outcome {
                assert!((at[2] - surface - steps(0.25)).abs() <= 1, "{at:?}");
            }
        }
    }
}
