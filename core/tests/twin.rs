//! The virtual drill: motors that slip when overdriven, sensors, a board that is really drilled (N20).

use annulus_core::job::Input;
use annulus_core::machine::{Machine, StrokeEnd, lab, virtual_drill};
use annulus_core::pins::Pins;
use annulus_core::steps::TICK_HZ;
use annulus_core::twin::{Drilled, Faults, Rotor, Twin};
use std::sync::{Arc, Mutex};

fn twin(machine: &Machine, faults: Faults) -> (Twin, Arc<Mutex<Vec<Drilled>>>) {
    let holes = Arc::new(Mutex::new(Vec::new()));
    let sink = Arc::clone(&holes);
    (Twin::new(machine, 1, faults, Box::new(move |hole| sink.lock().unwrap().push(*hole))), holes)
}

/// Steps one axis evenly until it stands at `to`, or `most` steps.
fn drive(twin: &mut Twin, tick: &mut u64, axis: usize, to: i64, most: u64) {
    for _ in 0..most {
        let at = twin.real()[axis];
        if at == to {
            return;
        }
        *tick += TICK_HZ / 400;
        let bit = 1 << axis;
        twin.step(*tick, bit, if to > at { bit } else { 0 });
    }
}

#[test]
fn a_rotor_follows_ramps_and_stalls_where_it_is_overdriven() {
    // (start rate, end rate in steps/s, steps, whether it follows): fastest 10 kHz, 100 kHz/s asked of it.
    let rows = [
        (100.0, 100.0, 500, true),
        (9_900.0, 9_900.0, 500, false),
        (200.0, 9_000.0, 3_000, true),
        (200.0, 12_000.0, 4_000, false),
        (200.0, 9_000.0, 12, false),
    ];
    for (from, to, count, follows) in rows {
        let mut rotor = Rotor::new(0, (-100_000, 100_000), 10_000.0, 100_000.0);
        let mut time_s = 0.0;
        for step in 0..count {
            // Even acceleration: the square of the rate grows evenly with the way.
            let share = f64::from(step) / f64::from(count);
            let square = from * from * (1.0 - share) + to * to * share;
            time_s += 1.0 / square.sqrt();
            rotor.step((time_s * TICK_HZ as f64) as u64, true, false);
        }
        assert_eq!(rotor.lost == 0, follows, "{from} to {to} in {count}: {} lost", rotor.lost);
        assert_eq!(rotor.at + rotor.lost as i64, i64::from(count));
        // Slow pulses are followed again; going from fast to slow without a ramp costs one.
        let lost = rotor.lost;
        for _ in 0..10 {
            time_s += 0.01;
            rotor.step((time_s * TICK_HZ as f64) as u64, true, false);
        }
        assert!(rotor.lost <= lost + 1, "{from} to {to}");
    }
}

#[test]
fn end_sensors_turn_on_one_step_beyond_the_range_and_hard_stops_hold() {
    let machine = virtual_drill();
    let (mut twin, _) = twin(&machine, Faults::default());
    let mut tick = 0;
    let low = machine.x.scale.steps(machine.x.min);
    drive(&mut twin, &mut tick, 0, low, 100_000);
    assert_eq!(twin.inputs(tick) & Input::XMin.bit(), 0);
    drive(&mut twin, &mut tick, 0, low - 1, 1);
    assert_ne!(twin.inputs(tick) & Input::XMin.bit(), 0);
    drive(&mut twin, &mut tick, 0, low - 5_000, 5_000);
    assert!(twin.real()[0] > low - 700 && twin.lost()[0] > 4_000, "{:?}", twin.real());
}

#[test]
fn only_a_turning_whole_tip_that_comes_through_makes_a_hole() {
    let machine = virtual_drill();
    let z = |mm: f64| machine.z.scale.steps(annulus_core::units::Length::from_mm(mm));
    let (mut drill, holes) = twin(&machine, Faults::default());
    let mut tick = 0;
    drill.spindle(0, 30_000);
    drive(&mut drill, &mut tick, 2, z(-31.0), 100_000);
    drive(&mut drill, &mut tick, 2, z(-28.0), 100_000);
    assert_eq!(holes.lock().unwrap().len(), 0, "not through");
    drive(&mut drill, &mut tick, 2, z(-32.1), 100_000);
    assert_eq!(holes.lock().unwrap().len(), 1, "written down the moment it is through");
    drive(&mut drill, &mut tick, 2, z(-28.0), 100_000);
    drive(&mut drill, &mut tick, 2, z(-32.1), 100_000);
    assert_eq!(holes.lock().unwrap().len(), 2, "the same hole again is another line");
    let hole = holes.lock().unwrap()[1];
    assert!((1.6..1.61).contains(&hole.depth_mm), "{hole:?}");

    let aside = drill.real()[0] + 3;
    drive(&mut drill, &mut tick, 0, aside, 10);
    assert!(drill.broken(), "dragged sideways in the board");
    drive(&mut drill, &mut tick, 2, z(-28.0), 100_000);
    drive(&mut drill, &mut tick, 2, z(-32.1), 100_000);
    assert_eq!(holes.lock().unwrap().len(), 2, "a broken bit drills nothing");

    let (mut still, holes) = twin(&machine, Faults::default());
    drive(&mut still, &mut tick, 2, z(-32.1), 100_000);
    assert!(still.broken() && holes.lock().unwrap().is_empty(), "pushed in without turning");
}

#[test]
fn the_same_calls_give_the_same_drill() {
    for machine in [virtual_drill(), Machine { stroke_end: StrokeEnd::Sensor, ..lab() }] {
        let run = || {
            let (mut twin, holes) = twin(&machine, Faults { lost_steps: vec![(0, 5)], ..Faults::default() });
            let mut seed = 5_u64;
            let mut inputs = Vec::new();
            for _ in 0..20_000_u64 {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let tick = inputs.len() as u64 * 5_000 + (seed >> 60);
                twin.step(tick, (seed >> 40) as u8 & 7, (seed >> 50) as u8);
                inputs.push(twin.inputs(tick));
            }
            let holes = holes.lock().unwrap().clone();
            (twin.real(), twin.lost(), inputs, holes)
        };
        assert_eq!(run(), run());
    }
}
