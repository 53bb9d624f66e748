//! Tests of windings at the pins: every pattern in its cycle, forced as long as by an I/O card, held
//! without forcing after a stop.

use crate::card::{Card, Shown, windings};
use crate::rig::{
    INPUT_PIN, MICRO, MILLI, PHASES_INPUT_PIN, PHASES_SPINDLE_PIN, PHASES_STOP_PIN, Rig, SETTINGS,
    SPINDLE_PIN, STOP_PIN,
};
use crate::support::{seeds, segment, slow_path};
use annulus_core::chance::Chance;
use annulus_core::machine::PhaseTable;
use annulus_core::machine::phases::{PRESETS, preset};
use annulus_link::cutter::Rule;
use annulus_link::message::{Clear, Configure, Guard, Outputs, Place, Refusal, State, Trust, Windings};
use annulus_link::phases::{MOTORS, tables_crc};
use annulus_link::run::{HALF, Run};
use annulus_link::{AXES, CYCLES_PER_TICK};

const RULE: Rule = Rule { ticks: 20_000, fall: 2000, rise: 2000 };

const PINS: std::ops::Range<u8> = 0..18;

fn forces(pin: u8) -> bool {
    pin % 6 > 3
}

fn said(tables: &[PhaseTable; MOTORS], forcing: u32) -> [Windings; MOTORS] {
    std::array::from_fn(|axis| windings(axis, &tables[axis], forcing))
}

fn named(name: &str) -> [PhaseTable; MOTORS] {
    std::array::from_fn(|_| preset(name).unwrap())
}

/// Ramps of three motors to some thousand steps per second and back: 60 ms.
fn way() -> ([Vec<Run>; AXES], u32) {
    let mut runs: [Vec<Run>; AXES] = Default::default();
    for (own, fast) in runs.iter_mut().zip([1_500_u32, 2_000, 3_300]) {
        let up = Run { forward: true, count: 40, interval: 3 * fast, fraction: 0, change: 0, phase: HALF };
        let slope = ((2 * fast) << 16) as i32 / 40;
        let (first, last) = (Run { change: -slope, ..up }, Run { interval: fast, change: slope, ..up });
        *own = vec![first, Run { interval: fast, count: 300_000 / fast, ..up }, last];
    }
    let last = |runs: &Vec<Run>| runs.iter().map(|run| run.extent().unwrap().last).sum::<u32>();
    let ticks = runs.iter().map(last).max().unwrap() + 100;
    (runs, ticks)
}

/// The patterns of an I/O card for the path, in cycles from its start.
fn of_a_card(tables: &[PhaseTable; MOTORS], forcing: u32, path: &([Vec<Run>; AXES], u32)) -> [Shown; MOTORS] {
    let shown = Card::new(tables, forcing).played(&[segment(&path.0, path.1)]);
    let cycles = |(tick, pattern): (u64, u8)| (tick * u64::from(CYCLES_PER_TICK), pattern);
    shown.map(|own| own.into_iter().map(cycles).collect())
}

/// Checks that the pins showed these patterns, all motors from the same cycle. Returns their number.
fn is_exact(rig: &Rig, wanted: &[Shown; MOTORS]) -> usize {
    let made = rig.shown();
    let first = (0..MOTORS).find(|axis| !wanted[*axis].is_empty()).expect("a pattern");
    let start = made[first][0].0 - wanted[first][0].0;
    for (axis, (made, wanted)) in made.into_iter().zip(wanted).enumerate() {
        let made: Shown = made.into_iter().map(|(cycle, pattern)| (cycle - start, pattern)).collect();
        assert_eq!(made, *wanted, "motor {axis}");
    }
    wanted.iter().map(Vec::len).sum()
}

#[test]
fn every_phase_table_steps_and_forces_like_a_card() {
    let (mut patterns, mut steps) = (0, 0);
    for (seed, name) in seeds(4).zip(PRESETS.into_iter().cycle()) {
        let mut chance = Chance::new(seed);
        // Each motor has its own table; the first takes every table in turn.
        let others = [0, 1].map(|_| preset(PRESETS[chance.below(PRESETS.len())]).unwrap());
        let tables = [preset(name).unwrap(), others[0].clone(), others[1].clone()];
        let forcing = chance.scale(2_000.0, 30_000.0) as u32;
        let path = slow_path(&mut chance, 600_000, (500.0, 40_000.0));
        let mut rig = Rig::with_phases(&said(&tables, forcing));
        rig.edges.clear();
        let rule = Rule { ticks: chance.scale(2e4, 2e5) as u32, ..Rule::resting_within(50_000) };
        rig.play(&path.0, path.1, &rule, 800_000, |_| false);
        assert_eq!(rig.state(), State::Ready, "{:?}", rig.status);
        patterns += is_exact(&rig, &of_a_card(&tables, forcing, &path));
        steps += path.0.iter().flatten().map(|run| run.count as usize).sum::<usize>();
    }
    println!("{steps} steps, {patterns} patterns, every one in its cycle");
    assert!(steps > 300 && patterns > 300);
}

#[test]
fn three_motors_at_twice_the_maximum_rate_are_exact() {
    let even = |interval| Run { count: 2_000, ..Run::one(true, interval) };
    let path = ([vec![even(500)], vec![even(503)], vec![even(511)], vec![]], 1_100_000);
    // Forcing that ends between any two steps gives the most words.
    for forcing in [200, 20_000] {
        let tables = named("boost_12");
        let mut rig = Rig::with_phases(&said(&tables, forcing));
        rig.edges.clear();
        let before = rig.busy;
        rig.play(&path.0, path.1, &Rule::resting_within(100_000), 1_000_000, |_| false);
        assert_eq!(rig.state(), State::Ready, "{:?}", rig.status);
        let cycles = u64::from(path.1 * CYCLES_PER_TICK);
        let patterns = is_exact(&rig, &of_a_card(&tables, forcing, &path));
        println!(
            "{patterns} patterns, {:.0} % of the processor",
            (rig.busy - before) as f64 / cycles as f64 * 100.0
        );
    }
}

fn amid(rig: &mut Rig, path: &([Vec<Run>; AXES], u32), phase: u64) {
    let mut turns = 0;
    rig.play(&path.0, path.1, &RULE, 400_000, |rig| {
        turns += u32::from(rig.state() == State::Running);
        turns > 60
    });
    rig.pass(phase);
}

/// Checks that the pins followed the path up to the index and hold there without forcing. Every step of the
/// table has a different pattern.
fn holds_at_its_index(rig: &Rig, wanted: &[Shown; MOTORS]) {
    let index = rig.status.unwrap().index;
    for (axis, made) in rig.shown().iter().enumerate() {
        let halves = |shown: &Shown| -> Vec<u8> {
            let mut halves: Vec<u8> = shown.iter().map(|(_, pattern)| pattern & 0b1111).collect();
            halves.dedup();
            halves
        };
        let (made, wanted) = (halves(made), halves(&wanted[axis]));
        assert_eq!(made, wanted[..made.len()], "motor {axis} left the path");
        assert_eq!(index[axis], made.len() as i32, "motor {axis}: counted otherwise than the pins show");
        let held = (0..6).fold(0, |held, pin| held | (rig.driven[6 * axis + pin] as u8 & 1) << pin);
        assert_eq!(held, *made.last().unwrap_or(&0), "motor {axis} is held without forcing");
    }
}

const FORCED: [u8; 4] = [0x25, 0x49, 0x2A, 0x46];

fn forced() -> [PhaseTable; MOTORS] {
    std::array::from_fn(|_| PhaseTable { columns: FORCED.to_vec() })
}

#[test]
fn emergency_stop_freezes_windings_and_ends_forcing() {
    let (tables, path) = (forced(), way());
    let wanted = of_a_card(&tables, 100_000, &path);
    let (mut last, mut unforced) = (0, 0);
    for seed in seeds(6) {
        let mut rig = Rig::with_phases(&said(&tables, 100_000));
        rig.say(Outputs { on: 1 });
        rig.edges.clear();
        amid(&mut rig, &path, Chance::new(seed).below(60_000) as u64);
        assert_eq!(rig.driven[usize::from(PHASES_SPINDLE_PIN)], 1);
        assert!(
            PINS.filter(|pin| forces(*pin)).any(|pin| rig.driven[usize::from(pin)] == 1),
            "something is forced"
        );
        let (since, count) = (rig.cycle, rig.edges.len());
        rig.pin(PHASES_STOP_PIN, false);
        rig.pass(MILLI);
        for edge in rig.edges[count..].iter().filter(|edge| PINS.contains(&edge.pin)) {
            let after = edge.cycle - since;
            match forces(edge.pin) && !edge.level {
                true => unforced = unforced.max(after),
                false => last = last.max(after),
            }
        }
        rig.until("no stop", |rig| rig.state() == State::EmergencyStop);
        assert_eq!((rig.status.unwrap().trust, rig.status.unwrap().outputs), (Trust::Lost, 0));
        assert_eq!(rig.driven[usize::from(PHASES_SPINDLE_PIN)], 0);
        holds_at_its_index(&rig, &wanted);
        assert_eq!(rig.say(Clear {}).refusal, Refusal::Input);
        rig.pin(PHASES_STOP_PIN, true);
        rig.pass(5 * MILLI);
        let count = rig.edges.len();
        assert_eq!(rig.say(Clear {}).state, State::Ready);
        rig.pass(5 * MILLI);
        assert!(!rig.edges[count..].iter().any(|edge| PINS.contains(&edge.pin)), "nothing by itself");
    }
    println!(
        "last new pattern after {:.2} µs, nothing forced after {:.2} µs",
        last as f64 / 120.0,
        unforced as f64 / 120.0
    );
    assert!(last < 2 * MICRO && unforced < 10 * MICRO, "{last} {unforced}");
}

#[test]
fn limit_switch_stops_at_its_step_and_allows_reverse() {
    let (tables, path) = (forced(), way());
    let wanted = of_a_card(&tables, 20_000, &path);
    for (seed, input) in seeds(4).zip(0..4) {
        let mut rig = Rig::with_phases(&said(&tables, 20_000));
        rig.edges.clear();
        amid(&mut rig, &path, Chance::new(seed).below(60_000) as u64);
        rig.pin(PHASES_INPUT_PIN + input, true);
        rig.pass(MILLI);
        rig.until("no stop", |rig| rig.state() == State::Limit);
        let status = rig.status.unwrap();
        assert_eq!((status.trust, status.input, status.inputs), (Trust::Suspect, input, 1 << input));
        holds_at_its_index(&rig, &wanted);
        assert_eq!(rig.say(Clear {}).refusal, Refusal::Input);
        rig.say(Guard { limits: SETTINGS.limits & !(1 << input) });
        assert_eq!(rig.say(Clear {}).state, State::Ready);
        // Backwards: the first pattern is the one before the held pattern.
        let at = status.index[0];
        rig.edges.retain(|edge| edge.pin < 6);
        let before = rig.shown()[0].len();
        let back = [vec![Run { count: 9, ..Run::one(false, 30_000) }], vec![], vec![], vec![]];
        rig.play(&back, 300_000, &RULE, 400_000, |_| false);
        assert_eq!((rig.state(), rig.status.unwrap().index[0]), (State::Ready, at - 9));
        let halves: Vec<u8> = rig.shown()[0][before..].iter().map(|(_, pattern)| pattern & 0b1111).collect();
        let wanted: Vec<u8> =
            (1..=9).map(|step| FORCED[(at - 1 - step).rem_euclid(4) as usize] & 0b1111).collect();
        let mut once = halves.clone();
        once.dedup();
        assert_eq!(once, wanted);
        assert_eq!(halves.len(), 18, "each is forced for a while");
    }
}

#[test]
fn dead_bridge_leaves_motors_stopped_at_their_index() {
    let (tables, path) = (forced(), way());
    let wanted = of_a_card(&tables, 20_000, &path);
    let mut amid = 0;
    for kill in (0..40).step_by(4) {
        let mut rig = Rig::with_phases(&said(&tables, 20_000));
        rig.edges.clear();
        rig.packets = Some(kill);
        rig.play(&path.0, path.1, &RULE, 200_000, |rig| rig.packets == Some(0));
        rig.unplug();
        for _ in 0..400 {
            rig.pass(MILLI);
            if rig.state() != State::Running {
                break;
            }
        }
        rig.pass(12 * MILLI);
        let status = rig.status.unwrap();
        assert_eq!(status.trust, Trust::Trusted, "{status:?}");
        amid += u32::from(status.state == State::Starved && status.index[0] > 0);
        holds_at_its_index(&rig, &wanted);
    }
    assert!(amid > 2, "{amid} times amid the path");
}

/// Pins of emergency stop, first input and first output in a new welcome.
fn named_pins(rig: &mut Rig) -> [u8; 3] {
    rig.welcome = None;
    rig.until("no welcome", |rig| rig.welcome.is_some());
    let welcome = rig.welcome.unwrap();
    [welcome.stop_pin, welcome.input_pin, welcome.output_pin]
}

#[test]
fn pins_stay_undriven_until_configured() {
    let tables = said(&named("full_two"), 20_000);
    let mut rig = Rig::new();
    rig.pass(20 * MILLI);
    assert!(rig.driven.iter().all(|level| *level == 2), "{:?}", rig.driven);
    assert!(rig.edges.is_empty());
    let driven = |rig: &Rig| -> Vec<usize> { (0..30).filter(|pin| rig.driven[*pin] != 2).collect() };
    // Steps and directions, RUN, outputs, alive.
    rig.say(SETTINGS);
    assert_eq!(driven(&rig), (2..10).chain(19..23).collect::<Vec<_>>());
    assert_eq!(named_pins(&mut rig), [STOP_PIN, INPUT_PIN, SPINDLE_PIN]);
    // Tables that were not sent, tables of another machine, inputs that do not exist.
    let phases = Configure { pulse: 2, setup: 0, phases: tables_crc(&tables), ..SETTINGS };
    assert_eq!(rig.say(phases).refusal, Refusal::Settings);
    for table in tables {
        rig.say(table);
    }
    assert_eq!(rig.say(Configure { phases: 1, ..phases }).refusal, Refusal::Settings);
    let refused = rig.status.unwrap().refused;
    assert_ne!(rig.say(Configure { limits: 0b1_0000, ..phases }).refused, refused);
    rig.pin(PHASES_STOP_PIN, true);
    rig.edges.clear();
    assert_eq!(rig.say(phases).state, State::Ready);
    rig.pin(STOP_PIN, false);
    rig.pass(5 * MILLI);
    assert_eq!(
        (rig.state(), rig.status.unwrap().inputs),
        (State::Ready, 0),
        "the other pin is the emergency stop"
    );
    assert_eq!(driven(&rig), (0..18).chain(26..29).collect::<Vec<_>>());
    assert_eq!(named_pins(&mut rig), [PHASES_STOP_PIN, PHASES_INPUT_PIN, PHASES_SPINDLE_PIN]);
    assert!(
        !rig.edges.iter().any(|edge| PINS.contains(&edge.pin) && edge.level),
        "nothing is on before a step"
    );
    rig.say(Place { index: [0; AXES] });
    // An axis without pins.
    let one = vec![Run::one(true, 20_000)];
    let fourth = [vec![], vec![], vec![], one.clone()];
    // The chunk after the refused one does not fit the chunks before.
    let is_refused = |rig: &mut Rig| matches!(rig.status.unwrap().refusal, Refusal::Settings | Refusal::Gap);
    rig.play(&fourth, 30_000, &RULE, 100_000, is_refused);
    let turn = [one.clone(), one.clone(), one, vec![]];
    let mut rig = Rig::with_phases(&tables);
    rig.play(&turn, 30_000, &RULE, 400_000, |_| false);
    let held = |rig: &Rig| [0, 6, 12].map(|first| (rig.driven[first], rig.driven[first + 2]));
    assert_eq!(held(&rig), [(1, 1); 3], "1a and 2a");
    // The same settings again: the motors are held.
    rig.edges.clear();
    rig.drive(&tables);
    assert_eq!((held(&rig), rig.shown().concat().len()), ([(1, 1); 3], 0));
    // Back to steps: the shown patterns give no pulse.
    rig.pin(STOP_PIN, true);
    rig.say(SETTINGS);
    assert_eq!(driven(&rig), (2..10).chain(19..23).collect::<Vec<_>>());
    rig.edges.clear();
    rig.say(Place { index: [0; AXES] });
    let steps = [vec![Run { count: 5, ..Run::one(true, 1_000) }], vec![], vec![], vec![]];
    rig.play(&steps, 10_000, &RULE, 100_000, |_| false);
    assert_eq!([0, 1, 2, 3].map(|axis| rig.pulses(axis).len()), [5, 0, 0, 0]);
    rig.pin(INPUT_PIN, true);
    rig.until("no stop", |rig| rig.state() == State::Limit);
    assert_eq!(rig.driven[usize::from(SPINDLE_PIN)], 0);
}

#[test]
fn hung_firmware_releases_every_winding() {
    let mut rig = Rig::with_phases(&said(&forced(), 20_000));
    amid(&mut rig, &way(), 0);
    rig.hang();
    rig.pass(120 * MILLI);
    assert!(rig.reset.is_some() && rig.driven.iter().all(|level| *level == 2), "{:?}", rig.driven);
}
