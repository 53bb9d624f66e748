//! Milled paths as moves and steps: within half a step of the plan, passed by the checker, stopped and slowed on the path.

use crate::programs::{Chance, one_by_one};
use annulus_core::check::{corner_zero, verify};
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Leg, Mark, Program};
use annulus_core::machine::{Machine, lab, six_spindles, virtual_drill};
use annulus_core::motion::{Timeline, laws, timeline};
use annulus_core::steps::{self, Segment, Stage, TICK_HZ};
use annulus_core::units::Length;

/// A random path of lines and arcs around the middle of the machine, the tip in the board.
fn milling(chance: &mut Chance, machine: &Machine) -> Program {
    let process = &machine.process;
    let height = Length::from_um(-100);
    let mut commands = vec![
        Command::Spindle { rpm: process.spindle_rpm.max(1) },
        Command::Dwell { us: (process.spin_up_ms * 1e3) as u32 },
        Command::Rapid { to: Point::from_mm(60.0, 60.0) },
        Command::Plunge { to: height, feed_um_per_s: 2_000, gate: None },
    ];
    let mut at = [60.0, 60.0];
    for _ in 0..20 {
        let reach = chance.scale(0.02, 20.0);
        let angle = chance.between(0.0, 6.2);
        let feed_um_per_s = chance.scale(2e3, 1e5) as u32;
        let away = [at[0] + reach * libm::cos(angle), at[1] + reach * libm::sin(angle)];
        let inside = |place: [f64; 2]| place.iter().all(|mm| (25.0..100.0).contains(mm));
        match chance.next() % 3 {
            0 => {
                // A full circle around a place nearby.
                let center = [at[0] + 0.2 * (away[0] - at[0]), at[1] + 0.2 * (away[1] - at[1])];
                let (to, center) = (Point::from_mm(at[0], at[1]), Point::from_mm(center[0], center[1]));
                commands.push(Command::MillArc {
                    to,
                    height,
                    center,
                    ccw: chance.next().is_multiple_of(2),
                    feed_um_per_s,
                });
            }
            _ if inside(away) => {
                let to = Point::from_mm(away[0], away[1]);
                commands.push(Command::Mill { to, height, feed_um_per_s });
                at = away;
            }
            _ => {}
        }
    }
    commands.push(Command::Retract { to: process.safe_height });
    commands.push(Command::Spindle { rpm: 0 });
    Program {
        name: "path".into(),
        machine: machine.fingerprint(),
        origin: Point::default(),
        bits: vec![],
        spindles: 1,
        safe_height: process.safe_height,
        legs: vec![Leg { mark: Mark::Finish, commands }],
        accepted: vec![],
    }
}

/// Every step of a milled segment lies within half a step of the plan, and 1 µs and what a turn may leave out beside.
fn on_the_path(plan: &Timeline, index: usize, segment: &Segment, seed: u64) {
    let planned = &plan.moves[index];
    let mut at = planned.from;
    for pulse in steps::replay(segment) {
        let t_s = pulse.tick as f64 / TICK_HZ as f64;
        for axis in (0..2).filter(|axis| pulse.axes >> axis & 1 == 1) {
            at[axis] += if pulse.forward >> axis & 1 == 1 { 1 } else { -1 };
            let off = (planned.at(t_s)[axis] - at[axis] as f64).abs();
            assert!(off < 0.75, "seed {seed}: {off} steps off at {t_s} s on axis {axis}");
        }
    }
    assert_eq!(at, planned.to, "seed {seed}");
}

#[test]
fn paths_become_steps_that_keep_the_plan_and_pass_the_check() {
    let mut milled = 0;
    for seed in 0..300 {
        for machine in [virtual_drill(), one_by_one(), six_spindles()] {
            let program = milling(&mut Chance(seed), &machine);
            let plan = timeline(&program, &machine).unwrap();
            laws::laws(&plan, &machine).unwrap_or_else(|why| panic!("seed {seed}: {:?}", why[0]));
            let stream = steps::stream(&plan, &machine).unwrap();
            for (index, segment) in stream.segments.iter().enumerate() {
                if segment.stage == Stage::Mill {
                    on_the_path(&plan, index, segment, seed);
                    milled += 1;
                }
            }
            let verdict = verify(&stream, &machine, corner_zero(&machine));
            assert!(verdict.is_ok(), "seed {seed} on {}: {:?}", machine.name, verdict.unwrap_err()[0]);
        }
    }
    assert!(milled >= 900, "{milled} paths, each one move");
}

#[test]
fn paths_that_a_machine_cannot_follow_are_refused_with_a_sentence() {
    let mut played = virtual_drill();
    played.x.backlash = Length::from_um(100);
    for (machine, code) in [(played, "motion.path_with_play"), (lab(), "motion.path_on_table")] {
        let why = timeline(&milling(&mut Chance(3), &machine), &machine).unwrap_err();
        assert_eq!(why.code, code);
        assert!(!why.message("en").contains('{') && !why.advice("en").is_empty());
    }
}
