//! Tests of the virtual drill: motors that slip when overdriven, sensors, and a simulated board.

mod sensors;
mod spindles;
mod stops;

use annulus_core::chance::Chance;
use annulus_core::job::{Bit, Cutter, Input};
use annulus_core::machine::phases::{PRESETS as TABLES, preset};
use annulus_core::machine::{Dynamics, Machine, PhaseTable, StrokeEnd, lab, six_spindles, virtual_drill};
use annulus_core::pins::Pins;
use annulus_core::steps::TICK_HZ;
use annulus_core::steps::automaton::Automaton;
use annulus_core::units::Length;
use annulus_core::virtual_drill::{Breakage, Cause, Faults, Push, Rotor, VirtualDrill, VirtualHole};
use std::sync::{Arc, Mutex};

fn twin(machine: &Machine, faults: Faults) -> (VirtualDrill, Arc<Mutex<Vec<VirtualHole>>>) {
    let holes = Arc::new(Mutex::new(Vec::new()));
    let sink = Arc::clone(&holes);
    (VirtualDrill::new(machine, 1, faults, Box::new(move |hole| sink.lock().unwrap().push(*hole))), holes)
}

fn drive(twin: &mut VirtualDrill, tick: &mut u64, axis: usize, to: i64, most: u64) {
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
fn rotor_follows_ramps_and_slips_if_overdriven() {
    // (start rate, end rate in steps/s, steps, reason for slipping). The limits are 10 kHz and 100 kHz/s.
    let rows = [
        (100.0, 100.0, 500, None),
        (9_900.0, 9_900.0, 500, Some(Cause::TooSteep)),
        (200.0, 9_000.0, 3_000, None),
        (200.0, 12_000.0, 4_000, Some(Cause::TooFast)),
        (200.0, 9_000.0, 12, Some(Cause::TooSteep)),
    ];
    for (table, (from, to, count, why)) in
        TABLES.iter().flat_map(|name| rows.iter().map(move |row| (preset(name).unwrap(), *row)))
    {
        let mut rotor = Rotor::new(&table, 0, (-100_000, 100_000), 10_000.0, (100_000.0, 0.0));
        let turn = table.columns.len() as u64;
        let (mut time_s, mut cause) = (0.0, None);
        for step in 0..count {
            // Constant acceleration: the square of the rate grows linearly with the distance.
            let share = f64::from(step) / f64::from(count);
            let square = from * from * (1.0 - share) + to * to * share;
            time_s += 1.0 / square.sqrt();
            let lost = rotor.step(Push::free((time_s * TICK_HZ as f64) as u64, true));
            cause = cause.or(lost.map(|(_, cause)| cause));
        }
        assert_eq!(cause, why, "{from} to {to} in {count}: {} lost", rotor.lost);
        assert_eq!(rotor.at + rotor.lost as i64, i64::from(count));
        assert_eq!(rotor.lost % turn, 0, "what is lost is lost by whole turns of the current");
        // Slow pulses are followed again; until then, one more revolution of the current may be lost.
        let lost = rotor.lost;
        for _ in 0..2 * turn {
            time_s += 0.01;
            rotor.step(Push::free((time_s * TICK_HZ as f64) as u64, true));
        }
        assert!(rotor.lost <= lost + turn, "{from} to {to}");
    }
}

#[test]
fn limit_switches_close_beyond_the_range_and_stops_hold() {
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
fn only_a_turning_whole_tool_through_the_board_makes_a_hole() {
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
    assert_eq!(drill.broken(), Some(Breakage::Dragged), "dragged sideways in the board");
    drive(&mut drill, &mut tick, 2, z(-28.0), 100_000);
    drive(&mut drill, &mut tick, 2, z(-32.1), 100_000);
    assert_eq!(holes.lock().unwrap().len(), 2, "a broken bit drills nothing");

    let (mut still, holes) = twin(&machine, Faults::default());
    drive(&mut still, &mut tick, 2, z(-32.1), 100_000);
    assert_eq!((still.broken(), holes.lock().unwrap().len()), (Some(Breakage::Still), 0));
}

#[test]
fn tool_stopped_in_its_hole_breaks_only_when_driven_deeper() {
    let (mut drill, _) = twin(&virtual_drill(), Faults::default());
    let (z, mut tick) = (|mm| virtual_drill().z.scale.steps(Length::from_mm(mm)), 0);
    drill.spindle(tick, 30_000);
    drive(&mut drill, &mut tick, 2, z(-31.0), 100_000);
    drill.spindle(tick, 0);
    drive(&mut drill, &mut tick, 2, z(-28.0), 100_000);
    assert_eq!(drill.broken(), None);
    drive(&mut drill, &mut tick, 2, z(-31.1), 100_000);
    assert_eq!(drill.broken(), Some(Breakage::Still));
}

fn bit(diameter_um: i64, cutter: Cutter) -> Bit {
    Bit { diameter: Length::from_um(diameter_um), name: String::new(), cutter, handling: Default::default() }
}

/// Steps an axis evenly at `hz` steps per second.
fn drive_at(twin: &mut VirtualDrill, tick: &mut u64, axis: usize, to: i64, hz: u64) {
    while twin.real()[axis] != to {
        *tick += TICK_HZ / hz;
        let up = if to > twin.real()[axis] { 1 << axis } else { 0 };
        twin.step(*tick, 1 << axis, up);
    }
}

#[test]
fn end_mills_and_v_bits_break_if_overloaded() {
    let machine = virtual_drill();
    let vee = Cutter::Vee { tip: Length::from_um(100), angle_mdeg: 60_000 };
    // (tool, depth in µm, sideways steps per second, rpm, reason for breaking); a step of XY is 12.5 µm.
    let rows = [
        (bit(800, Cutter::Mill), 1_700, 800, 30_000, None),
        (bit(800, Cutter::Drill), 1_700, 800, 30_000, Some(Breakage::Dragged)),
        (bit(3_175, vee), 100, 800, 30_000, None),
        // A quarter of 0.8 mm per revolution at 1000 rpm is 3.3 mm/s or 267 steps/s.
        (bit(800, Cutter::Mill), 500, 200, 1_000, None),
        (bit(800, Cutter::Mill), 500, 300, 1_000, Some(Breakage::TooFast)),
        // Cutting edges of five diameters in length.
        (bit(300, Cutter::Mill), 1_450, 400, 30_000, None),
        (bit(300, Cutter::Mill), 1_550, 400, 30_000, Some(Breakage::TooDeep)),
        (bit(300, Cutter::Drill), 1_700, 0, 30_000, None),
        (bit(3_175, vee), 3_000, 0, 30_000, Some(Breakage::TooDeep)),
        (bit(800, Cutter::Mill), 1_700, 0, 0, Some(Breakage::Still)),
    ];
    for (bit, depth_um, hz, rpm, why) in rows {
        let (mut drill, holes) = twin(&machine, Faults::default());
        let z = |um: i64| machine.z.scale.steps(machine.process.surface + Length::from_um(um));
        let mut tick = TICK_HZ;
        drill.bit(tick, &bit);
        drill.spindle(tick, rpm);
        drive_at(&mut drill, &mut tick, 2, z(50), 300);
        // Slow enough for 1000 rpm.
        drive_at(&mut drill, &mut tick, 2, z(-depth_um), 300);
        if hz > 0 {
            let aside = drill.real()[0] + 400;
            drive_at(&mut drill, &mut tick, 0, aside, hz);
        }
        assert_eq!(drill.broken(), why, "{bit:?} at {depth_um} µm, {hz} steps/s, {rpm} rpm");
        drive_at(&mut drill, &mut tick, 2, z(1_000), 300);
        let through = depth_um > 1_600 && rpm > 0;
        assert_eq!(holes.lock().unwrap().len(), usize::from(through), "where it went straight down");
        drill.bit(tick, &bit);
        assert_eq!(drill.broken(), None, "a new one is whole");
    }
}

#[test]
fn worn_tool_is_slowed_only_in_fresh_material() {
    let machine = virtual_drill();
    let z = |um: i64| machine.z.scale.steps(machine.process.surface + Length::from_um(um));
    let dull = Faults { dull_bit_hz: Some(100.0), ..Faults::default() };
    let (mut drill, holes) = twin(&machine, dull);
    drill.spindle(0, 30_000);
    let mut tick = TICK_HZ;
    drive_at(&mut drill, &mut tick, 2, z(-800), 90);
    assert_eq!(drill.lost(), [0; 3]);
    // A peck: fast in the existing hole, then slowly.
    drive_at(&mut drill, &mut tick, 2, z(500), 400);
    drive_at(&mut drill, &mut tick, 2, z(-450), 400);
    drive_at(&mut drill, &mut tick, 2, z(-1_700), 90);
    assert_eq!((drill.lost(), holes.lock().unwrap().len()), ([0; 3], 1));
}

#[test]
fn axis_with_backlash_waits_for_its_takeup() {
    let mut machine = virtual_drill();
    machine.x.backlash = Length::from_um(125);
    let (mut drill, _) = twin(&machine, Faults::default());
    let (start, mut tick) = (drill.real()[0], TICK_HZ);
    // (steps of the motor, resulting position of the axis): the backlash is ten steps.
    let rows = [(30, 30), (-4, 30), (4, 30), (-10, 30), (-5, 25), (8, 25), (2, 25), (3, 28)];
    for (way, place) in rows {
        for _ in 0..i32::abs(way) {
            tick += TICK_HZ / 100;
            drill.step(tick, 1, u8::from(way > 0));
        }
        assert_eq!(drill.real()[0], start + place, "after {way}");
    }
    assert_eq!(drill.lost(), [0; 3]);
}

#[test]
fn every_spindle_has_its_own_motor_tool_and_board() {
    let machine = six_spindles();
    let z = |mm: f64| machine.z.scale.steps(Length::from_mm(mm) + machine.process.surface);
    let (mut drill, holes) = twin(&machine, Faults { lost_steps: vec![(3, 40)], ..Faults::default() });
    assert_eq!(drill.heights().len(), 6);
    drill.spindle(0, 120_000);
    let mut tick = TICK_HZ;
    // Z1, Z2 and Z6 together; the others stay up.
    let down = drill.real()[2] - z(-1.7);
    let set = 0b1000_1100;
    for _ in 0..down {
        tick += TICK_HZ / 250;
        drill.step(tick, set, 0);
    }
    let heights = drill.heights();
    assert_eq!((heights[0], heights[5]), (z(-1.7), z(-1.7)));
    assert!(heights[1] > z(-1.7) && heights[2] == heights[3], "Z2 lost steps: {heights:?}");
    let drilled: Vec<u8> = holes.lock().unwrap().iter().map(|hole| hole.spindle).collect();
    assert!(drilled.contains(&0) && drilled.contains(&5) && !drilled.contains(&2), "{drilled:?}");
    assert_eq!(drill.slips().iter().map(|slip| slip.axis).collect::<Vec<_>>(), [3]);
    assert_ne!(drill.inputs(tick) & Input::Contact.bit(), 0);
    assert_eq!(drill.inputs(tick) & Input::ZTop.bit(), 0, "not before the last one is up");
}

#[test]
fn virtual_drill_is_deterministic() {
    for machine in [virtual_drill(), Machine { stroke_end: StrokeEnd::Sensor, ..lab() }] {
        let run = || {
            let (mut twin, holes) =
                twin(&machine, Faults { lost_steps: vec![(0, 5)], glitches: 0.01, ..Faults::default() });
            let mut chance = Chance::new(5);
            let mut inputs = Vec::new();
            for _ in 0..20_000_u64 {
                let number = chance.bits();
                let tick = inputs.len() as u64 * 5_000 + (number >> 60);
                twin.step(tick, (number >> 40) as u8 & 7, (number >> 50) as u8);
                inputs.push(twin.inputs(tick));
            }
            let holes = holes.lock().unwrap().clone();
            (twin.real(), twin.lost(), twin.slips().to_vec(), inputs, holes)
        };
        assert_eq!(run(), run());
    }
}

/// Moves an axis back and forth through the automaton at this interrupt rate.
fn shuttle(
    twin: &mut VirtualDrill,
    tick: &mut u64,
    dynamics: &Dynamics,
    axis: usize,
    way: i64,
    interrupt_hz: u64,
) {
    let mut automaton = Automaton::new(dynamics.clone(), 0);
    for target in [way, 0] {
        automaton.retarget(target);
        while !automaton.is_at_rest() {
            *tick += TICK_HZ / interrupt_hz;
            if let Some(step) = automaton.interrupt() {
                twin.step(*tick, 1 << axis, if step.forward { 1 << axis } else { 0 });
            }
        }
        *tick += TICK_HZ;
    }
}

#[test]
fn lab_drill_slips_above_580_hz_and_then_stalls() {
    for axis in [0, 1] {
        for (interrupt_hz, clean, stalls) in [
            (250, true, false),
            (500, true, false),
            (560, true, false),
            (580, true, false),
            (585, false, false),
            (600, false, false),
            (650, false, true),
            (800, false, true),
        ] {
            let (mut twin, _) = twin(&lab(), Faults::default());
            let (start, mut tick) = (twin.real()[axis], TICK_HZ);
            shuttle(&mut twin, &mut tick, &Dynamics::arendt(), axis, 400, interrupt_hz);
            assert_eq!(twin.lost()[axis] == 0, clean, "{interrupt_hz} Hz: {:?}", twin.slips());
            assert_eq!(twin.slips().is_empty(), clean);
            if clean {
                assert_eq!(twin.real()[axis], start);
            }
            assert!(twin.slips().iter().all(|slip| (slip.axis, slip.cause) == (axis, Cause::TooFast)));
            if let Some(slip) = twin.slips().first() {
                let way = slip.place - start;
                assert_eq!(
                    stalls,
                    (3..30).contains(&way),
                    "where full speed is reached: {slip:?} from {start}"
                );
                // Losses are whole revolutions of the current. Without a stall, the axis covers most of the
                // distance but ends in a wrong position.
                assert!(slip.lost.is_multiple_of(12) && way < 400, "{interrupt_hz} Hz: {slip:?}");
                let lost = twin.lost()[axis];
                println!("{interrupt_hz} Hz: {lost} steps lost");
                assert_eq!(stalls, lost > 400, "{interrupt_hz} Hz: {lost} steps lost");
            }
        }
    }
}

#[test]
fn too_steep_step_table_loses_steps() {
    // (periods, whether the motor follows at 500 interrupts per second): the jump from state to state
    // decides.
    let rows: [(&[u32], bool); 4] =
        [(&[7, 4, 2, 1], true), (&[7, 2, 1], true), (&[7, 1], false), (&[1], false)];
    for (period, clean) in rows {
        let states = period.len() as u32 - 1;
        let dynamics = Dynamics {
            period: period.to_vec(),
            enter: (1..=states).collect(),
            leave: (2..=states + 1).collect(),
        };
        let (mut twin, _) = twin(&lab(), Faults::default());
        let mut tick = TICK_HZ;
        shuttle(&mut twin, &mut tick, &dynamics, 0, 300, 500);
        assert_eq!(twin.lost()[0] == 0, clean, "{period:?}: {:?}", twin.slips());
        let causes: Vec<Cause> = twin.slips().iter().map(|slip| slip.cause).collect();
        assert_eq!(causes.contains(&Cause::TooSteep), !clean, "{causes:?}");
    }
}

#[test]
fn wrong_phase_table_slips_or_runs_backwards() {
    let good = PhaseTable::arendt();
    let reversed = PhaseTable { columns: good.columns.iter().rev().copied().collect() };
    let mut swapped = good.clone();
    for step in 3..6 {
        swapped.columns.swap(step, step + 3);
    }
    // (table, broken wires, range of the distance really covered by 120 steps)
    let rows = [
        (good.clone(), 0, 120..=120),
        (reversed, 0, -126..=-114),
        (swapped, 0, -12..=12),
        (good.clone(), 0b0010, -12..=12),
        (good, 0b0110_0000, 120..=120),
    ];
    for (table, dead, made) in rows {
        let mut machine = lab();
        machine.x.phases = table;
        let (mut twin, _) = twin(&machine, Faults { dead_wires: [dead, 0, 0], ..Faults::default() });
        let (start, mut tick) = (twin.real()[0], 0);
        for _ in 0..120 {
            tick += TICK_HZ / 100;
            twin.step(tick, 1, 1);
        }
        let way = twin.real()[0] - start;
        assert!(made.contains(&way), "{:?}: {way}, {:?}", machine.x.phases, twin.slips());
        let clean = *made.start() == 120;
        assert_eq!(twin.slips().is_empty(), clean);
        assert!(twin.slips().iter().all(|slip| slip.cause == Cause::NoPull), "{:?}", twin.slips());
    }
}

#[test]
fn lost_step_costs_one_revolution_of_the_current() {
    for (machine, turn) in [(virtual_drill(), 4), (lab(), 12)] {
        let faults = Faults { lost_steps: vec![(1, 50)], ..Faults::default() };
        let (mut twin, _) = twin(&machine, faults);
        let (start, mut tick) = (twin.real()[1], 0);
        for _ in 0..100 {
            tick += TICK_HZ / 100;
            twin.step(tick, 2, 2);
        }
        assert_eq!(twin.real()[1], start + 100 - turn);
        let [slip] = twin.slips() else { panic!("{:?}", twin.slips()) };
        assert_eq!((slip.axis, slip.step, slip.place), (1, 50, start + 49));
        assert_eq!((slip.lost as i64, slip.cause), (turn, Cause::Fault));
    }
}

#[test]
fn slip_records_are_limited_to_64() {
    let faults = Faults { lost_steps: (1..=100).map(|step| (0, step)).collect(), ..Faults::default() };
    let told = Arc::new(Mutex::new(0));
    let sink = Arc::clone(&told);
    let (twin, _) = twin(&virtual_drill(), faults);
    let mut twin = twin.watched(Box::new(move |slips| *sink.lock().unwrap() = slips.len()));
    for step in 1..=100_u64 {
        twin.step(step * TICK_HZ, 1, 1);
    }
    assert_eq!((twin.slips().len(), twin.lost()[0], *told.lock().unwrap()), (64, 400, 64));
}
