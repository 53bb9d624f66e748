//! Tests of one board per spindle, each drilled to the depth of its spindle.

use super::twin;
use crate::operator::{OnTime, Orders};
use crate::programs::{Chance, random_program, rounds};
use annulus_core::check::corner_zero;
use annulus_core::job::{Mark, Program};
use annulus_core::machine::{self, AXES, Machine, Value, six_spindles};
use annulus_core::motion::{cycles, timeline};
use annulus_core::pins::{Motors, Order, Outcome, Pins, Playhead, play};
use annulus_core::queue::{Homing, HomingNext, QueueReport, Standing};
use annulus_core::steps::{Segment, Stage, Steps, segment, stream};
use annulus_core::units::Length;
use annulus_core::virtual_drill::{Faults, VirtualHole, tally};

fn own(base: &Machine, lists: &[(&str, &[f64])]) -> Machine {
    let list = |(key, numbers): &(&str, &[f64])| (format!("spindle.{key}"), Value::Numbers(numbers.to_vec()));
    machine::apply(base, &lists.iter().map(list).collect::<Vec<_>>()).unwrap()
}

struct Drilled {
    holes: Vec<VirtualHole>,
    depths_mm: Vec<Vec<f64>>,
    zero_mm: [f64; 2],
}

fn drilled(program: &Program, machine: &Machine, real: &Machine) -> Drilled {
    let (mut drill, holes) = twin(real, Faults::default());
    let stream = stream(&timeline(program, machine).unwrap(), machine).unwrap();
    let mut zero = corner_zero(machine);
    for (axis, zero) in zero.iter_mut().enumerate().take(2) {
        *zero += machine.axis(axis).scale.steps(Length::from_mm(10.0));
    }
    let mut line = Playhead::default();
    line.position[..3].copy_from_slice(&drill.real());
    line.position[2..2 + drill.heights().len()].copy_from_slice(&drill.heights());
    let start: Steps = std::array::from_fn(|axis| zero[axis] + stream.start[axis]);
    let way = cycles::go_to(machine, line.position, start).unwrap();
    let there: Vec<Segment> = way.moves.iter().map(|planned| segment(planned, machine)).collect();
    let (motors, mut depths_mm) = (Motors::of(machine), Vec::new());
    for segment in there.iter().chain(&stream.segments) {
        let mut operator = Orders([(u64::MAX, Order::Go); 2], line.tick);
        let outcome = play(segment, &motors, &mut line, &mut drill, &mut OnTime(0), &mut operator);
        assert_eq!(outcome, Outcome::Completed, "{segment:?}");
        let is_down = matches!(segment.stage, Stage::Drill | Stage::NextHole);
        if is_down && matches!(segment.mark, Mark::Hole(_)) {
            depths_mm.push(drill.depths_mm());
        }
    }
    assert!(drill.slips().is_empty() && drill.broken().is_none());
    let zero_mm = [0, 1].map(|axis: usize| machine.axis(axis).scale.length(zero[axis]).mm());
    let holes = holes.lock().unwrap().clone();
    Drilled { holes, depths_mm, zero_mm }
}

#[test]
fn spindle_with_its_own_depth_drills_that_deep() {
    let lists: [(&str, &[f64]); 3] = [
        ("deeper", &[0.0, 0.4, 0.0, -0.7, 0.4]),
        ("longer", &[0.0, 0.0, 1.5, -2.25, 0.8]),
        ("margin", &[0.0, 0.0, 0.0, 0.0, 12.0]),
    ];
    let six = six_spindles();
    for overlap in ["yes", "no"] {
        let on = ("overlap.on".to_owned(), Value::Text(overlap.to_owned()));
        // Tools of different lengths must not be reported as touching too early or never.
        let looks = ("stroke.contact_tolerance".to_owned(), Value::Number(0.1));
        let machine = own(&machine::apply(&six, &[on, looks]).unwrap(), &lists);
        let step_mm = 1.0 / machine.z.scale.steps_per_mm();
        let through_mm = (machine.process.board_thickness + machine.process.breakthrough).mm();
        for seed in 0..rounds(60) {
            let program = random_program(&mut Chance::new(seed), &machine, 4);
            let board = drilled(&program, &machine, &machine);
            assert_eq!(board.depths_mm.len(), 4, "seed {seed}");
            for (spindle, deeper) in [0.0, 0.4, 0.0, -0.7, 0.4, 0.0].into_iter().enumerate() {
                let off = |depths: &Vec<f64>| (depths[spindle] - through_mm - deeper).abs() > 1.5 * step_mm;
                let wrong = board.depths_mm.iter().find(|depths| off(depths));
                assert_eq!(wrong, None, "seed {seed}: spindle {spindle} of {overlap}");
                // A cut that is shallower than the board is thick makes no hole.
                let made = board.holes.iter().filter(|hole| usize::from(hole.spindle) == spindle).count();
                assert_eq!(made, if spindle == 3 { 0 } else { 4 }, "seed {seed}: spindle {spindle}");
            }
            let legs = program.legs.len();
            let tally = tally(&program, &machine, 0..legs, board.zero_mm, &board.holes);
            assert!(tally.is_clean(), "seed {seed}: {tally:?}");
            let alike = tally_of_alike(&program, &six, &board);
            assert_eq!(
                alike, 4,
                "seed {seed}: a spindle that is to go through and does not leaves holes out"
            );
        }
    }
}

/// Number of missing holes on the board if all spindles should have drilled through.
fn tally_of_alike(program: &Program, machine: &Machine, board: &Drilled) -> u32 {
    tally(program, machine, 0..program.legs.len(), board.zero_mm, &board.holes).missing
}

#[test]
fn longer_tool_than_configured_drills_deeper() {
    let machine = own(&six_spindles(), &[("longer", &[0.0, 1.0])]);
    let real = own(&six_spindles(), &[("longer", &[0.0, 1.25])]);
    let program = random_program(&mut Chance::new(1), &machine, 2);
    let depths = |real: &Machine| drilled(&program, &machine, real).depths_mm[0].clone();
    let (said, found) = (depths(&machine), depths(&real));
    assert!((found[1] - said[1] - 0.25).abs() < 0.01, "{said:?} {found:?}");
    assert_eq!(found[0], said[0]);
    assert_eq!(said.len(), AXES - 2);
}

#[test]
fn spindles_at_different_heights_are_homed_to_one_height() {
    let machine = six_spindles();
    let (mut drill, _) = twin(&machine, Faults::default());
    let mut line = Playhead::default();
    line.position[2..].copy_from_slice(&drill.heights());
    let mut played = |segment: &Segment, line: &mut Playhead| {
        let mut operator = Orders([(u64::MAX, Order::Go); 2], line.tick);
        let outcome = play(segment, &Motors::of(&machine), line, &mut drill, &mut OnTime(0), &mut operator);
        let (position, inputs) = (line.position, drill.inputs(line.tick));
        (QueueReport { outcome, position, inputs, ticks: 0 }, drill.heights())
    };
    // Z1 and Z4 are 2 mm lower, and Z2 is 3 mm lower.
    let mut apart = line.position;
    for (axis, mm) in [(2, 2.0), (5, 2.0), (3, 3.0)] {
        apart[axis] -= machine.z.scale.steps(Length::from_mm(mm));
    }
    for planned in &cycles::go_to(&machine, line.position, apart).unwrap().moves {
        played(&segment(planned, &machine), &mut line);
    }
    // All counts of the spindles have the same error.
    machine.spindle_axes().for_each(|axis| line.position[axis] += 777);
    let rests = Standing::just_homed(&machine).position;
    let mut homing = Homing::new(&[2], [false; 3]);
    let mut next = homing.begin(&machine).unwrap();
    while let HomingNext::Play { segment, correction_steps } = next {
        machine.spindle_axes().for_each(|axis| line.position[axis] += correction_steps);
        let (report, heights) = played(&segment, &mut line);
        let mut position = report.position;
        next = homing.reported(&machine, &report, &mut position).map_err(|(why, _)| why).unwrap();
        if segment.stage == Stage::Offset {
            assert_eq!(heights, line.position[2..]);
            assert_eq!(heights, rests[2..]);
        }
    }
    assert_eq!(line.position[2..], rests[2..]);
}
