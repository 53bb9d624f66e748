//! Tests of sensors that chatter, glitch and stick, and of gated moves with them.

use super::{bit, drive, twin};
use crate::operator::{OnTime, Orders};
use annulus_core::job::{Cutter, Gate, Input, Otherwise};
use annulus_core::machine::{Machine, Steps, StrokeEnd, virtual_drill};
use annulus_core::motion::cycles;
use annulus_core::pins::{Motors, Order, Outcome, Pins, Playhead, Steady, play};
use annulus_core::steps::{Segment, TICK_HZ, segment};
use annulus_core::virtual_drill::{Cause, Faults, Switches, VirtualDrill};

#[test]
fn switches_chatter_briefly_from_the_edge() {
    let mut switches = Switches::new(7, 1, 0.0);
    let ms = TICK_HZ / 1000;
    let closed: Vec<bool> = (0..100 * ms)
        .step_by(ms as usize / 50)
        .map(|tick| switches.read(tick, u32::from(tick >= 50 * ms)) & 1 == 1)
        .collect();
    let first = closed.iter().position(|on| *on).unwrap();
    assert_eq!(first, 50 * 50, "the first touch is at the edge");
    let flips = closed.windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert!((3..40).contains(&flips), "{flips} flips");
    assert!(closed[53 * 50..].iter().all(|on| *on), "and it ends");
}

fn played(machine: &Machine, segment: &Segment, pins: &mut dyn Pins, line: &mut Playhead) -> Outcome {
    let (mut clock, mut operator) = (OnTime(line.tick), Orders([(0, Order::Go); 2], line.tick));
    play(segment, &Motors::of(machine), line, pins, &mut clock, &mut operator)
}

/// Searches for the low end of X as homing does. Returns the outcome, and the distance between the edge and
/// the gate.
fn seek(machine: &Machine, pins: &mut dyn Pins, start: i64) -> (Outcome, i64) {
    let (_, timeline) = cycles::home(machine).unwrap().into_iter().find(|(axis, _)| *axis == 0).unwrap();
    let mut line = Playhead::default();
    let outcome = played(machine, &segment(&timeline.moves[0], machine), pins, &mut line);
    let edge = machine.x.scale.steps(machine.x.min) - 1;
    let at = if let Outcome::Gated(at) = outcome { at[0] } else { line.position[0] };
    (outcome, start + at - edge)
}

#[test]
fn confirmed_readings_make_a_seek_immune_to_glitches() {
    let machine = virtual_drill();
    let mut fooled = 0;
    for seed in 1..=20 {
        let faults = Faults { glitches: 0.01, ..Faults::default() };
        let mut bare = VirtualDrill::new(&machine, seed, faults.clone(), Box::new(|_| {}));
        let start = bare.real()[0];
        let (outcome, off) = seek(&machine, &mut bare, start);
        fooled += usize::from(off != 0 || !matches!(outcome, Outcome::Gated(_)));

        let mut steady = Steady::new(VirtualDrill::new(&machine, seed, faults, Box::new(|_| {})));
        let (outcome, off) = seek(&machine, &mut steady, start);
        assert!(matches!(outcome, Outcome::Gated(_)), "seed {seed}: {outcome:?}");
        // Chatter may delay the confirmation of a true edge, at most by its duration.
        assert!((-12..=0).contains(&off), "seed {seed}: {off} steps off the edge");
        assert_eq!(steady.inner().lost(), [0; 3]);
    }
    assert!(fooled >= 19, "only {fooled} of 20 were fooled without care");
}

#[test]
fn stuck_sensors_end_moves_by_name() {
    let machine = virtual_drill();
    let off = Faults { stuck_off: Input::XMin.bit(), ..Faults::default() };
    let mut twin = Steady::new(VirtualDrill::new(&machine, 3, off, Box::new(|_| {})));
    let start = twin.inner().real()[0];
    let (outcome, _) = seek(&machine, &mut twin, start);
    let unmet = |gate: Gate| gate.input == Input::XMin && gate.otherwise == Otherwise::Alarm;
    assert!(matches!(outcome, Outcome::Unmet(gate) if unmet(gate)), "{outcome:?}");
    assert!(twin.inner().slips().iter().any(|slip| slip.cause == Cause::Blocked), "it ran into its stop");

    let on = Faults { stuck_on: Input::Contact.bit(), ..Faults::default() };
    let mut twin = Steady::new(VirtualDrill::new(&machine, 3, on, Box::new(|_| {})));
    let to = Steps::from([2_000, 0, 0, 0, 0, 0, 0, 0]);
    let timeline = cycles::go_to(&machine, Steps::default(), to).unwrap();
    let mut line = Playhead::default();
    let outcome = played(&machine, &segment(&timeline.moves[0], &machine), &mut twin, &mut line);
    assert_eq!((outcome, line.position[0]), (Outcome::Guarded(Input::Contact), 0), "refused before it moves");
}

#[test]
fn worn_tool_slows_the_stroke_until_it_times_out() {
    let mut machine = Machine { stroke_end: StrokeEnd::Sensor, ..virtual_drill() };
    machine.process.feed_mm_per_s = 4.0;
    let z = |mm: f64| machine.z.scale.steps(annulus_core::units::Length::from_mm(mm));
    let feed_hz = machine.process.feed_mm_per_s * machine.z.scale.steps_per_mm();
    let (mut drill, holes) = twin(&machine, Faults { bit_life: Some(20), ..Faults::default() });
    drill.spindle(0, 30_000);
    let mut tick = 0;
    let mut times = Vec::new();
    for hole in 0..30 {
        drive(&mut drill, &mut tick, 2, z(-29.9), 100_000);
        let beside = drill.real()[0] + 100;
        drive(&mut drill, &mut tick, 0, beside, 100);
        let begun = tick;
        let deadline = tick + 2 * TICK_HZ;
        tick += TICK_HZ / 10;
        while drill.inputs(tick) & Input::ZBottom.bit() == 0 && tick < deadline {
            tick += (TICK_HZ as f64 / feed_hz) as u64;
            drill.step(tick, 4, 0);
        }
        times.push(tick - begun);
        if tick >= deadline {
            assert!(hole > 20, "a sharp bit was late at hole {hole}");
            break;
        }
    }
    let sharp = times[0];
    assert!(times[..20].iter().all(|time| *time < sharp + sharp / 20), "{times:?}");
    assert!(*times.last().unwrap() > 3 * sharp, "{times:?}");
    assert!(drill.slips().iter().any(|slip| slip.axis == 2 && slip.cause == Cause::Held));
    let worn = holes.lock().unwrap().len();
    assert!((20..30).contains(&worn), "{worn} holes");
    drill.bit(tick, &bit(800, Cutter::Drill));
    drive(&mut drill, &mut tick, 2, z(-29.9), 100_000);
    let beside = drill.real()[0] + 100;
    drive(&mut drill, &mut tick, 0, beside, 100);
    drive(&mut drill, &mut tick, 2, z(-31.7), 100_000);
    assert_eq!(holes.lock().unwrap().len(), worn + 1, "a new bit is sharp");
}
