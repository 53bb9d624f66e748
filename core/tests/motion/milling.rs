//! Tests of milled paths as moves and steps: within half a step of the plan, accepted by the checker,
//! stopped and slowed on the path.

use crate::programs::{Chance, one_by_one};
use annulus_core::check::{corner_zero, verify};
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Leg, Mark, Program};
use annulus_core::machine::{AXES, Machine, hobby_3018, lab, six_spindles, virtual_drill};
use annulus_core::motion::{Timeline, laws, timeline};
use annulus_core::steps::{self, Segment, Stage, TICK_HZ};
use annulus_core::units::Length;

#[derive(Clone, Copy)]
struct Kind {
    heights: bool,
    /// Between the commands the tool may leave the board and enter it again.
    pecks: bool,
    commands: u32,
    reach: f64,
}

const FLAT: Kind = Kind { heights: false, pecks: false, commands: 20, reach: 20.0 };

/// A leg of random lines and arcs around the middle of the machine, with the tool in the board.
fn milling(chance: &mut Chance, machine: &Machine, kind: Kind) -> Program {
    let process = &machine.process;
    let mut height = Length::from_um(-100);
    let mut commands = vec![
        Command::Spindle { rpm: process.spindle_rpm.max(1) },
        Command::Dwell { us: (process.spin_up_ms * 1e3) as u32 },
        Command::Rapid { to: Point::from_mm(60.0, 60.0) },
        Command::Plunge { to: height, feed_um_per_s: 2_000, gate: None },
    ];
    let (mut at, mut tip) = ([60.0, 60.0], height);
    for _ in 0..kind.commands {
        let reach = chance.scale(0.02, kind.reach);
        let angle = chance.between(0.0, 6.2);
        let feed_um_per_s = chance.scale(2e3, 1e5) as u32;
        let away = [at[0] + reach * libm::cos(angle), at[1] + reach * libm::sin(angle)];
        let inside = |place: [f64; 2]| place.iter().all(|mm| (25.0..100.0).contains(mm));
        if kind.heights && !chance.bits().is_multiple_of(3) {
            height = Length::from_um(-(chance.bits() as i64 & 0x7FF) + 300);
        }
        let ccw = chance.bits().is_multiple_of(2);
        let before = commands.len();
        match chance.bits() % 5 {
            0 => {
                // A full circle around a nearby point.
                let center = [at[0] + 0.2 * (away[0] - at[0]), at[1] + 0.2 * (away[1] - at[1])];
                let (to, center) = (Point::from_mm(at[0], at[1]), Point::from_mm(center[0], center[1]));
                commands.push(Command::MillArc { to, height, center, ccw, feed_um_per_s });
            }
            1 if inside(away) => {
                // Half a circle.
                let center = [0.5 * (at[0] + away[0]), 0.5 * (at[1] + away[1])];
                let (to, center) = (Point::from_mm(away[0], away[1]), Point::from_mm(center[0], center[1]));
                commands.push(Command::MillArc { to, height, center, ccw, feed_um_per_s });
                at = away;
            }
            2 if kind.pecks => {
                // Up, inside the board or above it, then deeper again; a path may follow directly.
                height = tip + Length::from_um(100 + (chance.bits() as i64 & 0x3FF));
                commands.push(Command::Retract { to: height });
                if !chance.bits().is_multiple_of(3) {
                    height -= Length::from_um(100 + (chance.bits() as i64 & 0x3FF));
                    commands.push(Command::Plunge { to: height, feed_um_per_s: 5_000, gate: None });
                }
            }
            _ if inside(away) => {
                let to = Point::from_mm(away[0], away[1]);
                commands.push(Command::Mill { to, height, feed_um_per_s });
                at = away;
            }
            _ => {}
        }
        if commands.len() > before {
            tip = height;
        }
    }
    commands.push(Command::Retract { to: process.safe_height.max(tip) });
    commands.push(Command::Spindle { rpm: 0 });
    Program {
        name: "path".into(),
        machine: machine.fingerprint(),
        origin: Point::default(),
        bits: vec![],
        spindles: 0b11,
        safe_height: process.safe_height,
        legs: vec![Leg { mark: Mark::Toolpath(0), commands }],
        accepted: vec![],
    }
}

/// Every step of a milled segment must be within half a step of the plan. Tolerated in addition: the motion
/// in 1 µs, and an omitted reversal.
fn on_the_path(plan: &Timeline, index: usize, segment: &Segment, seed: u64) {
    let planned = &plan.moves[index];
    let mut at = planned.from;
    for pulse in steps::replay(segment) {
        let t_s = pulse.tick as f64 / TICK_HZ as f64;
        for axis in (0..AXES).filter(|axis| pulse.axes >> axis & 1 == 1) {
            at[axis] += if pulse.forward >> axis & 1 == 1 { 1 } else { -1 };
            let off = (planned.at(t_s)[axis] - at[axis] as f64).abs();
            assert!(off < 0.75, "seed {seed}: {off} steps off at {t_s} s on axis {axis}");
        }
    }
    assert_eq!(at, planned.to, "seed {seed}");
}

/// Plans, times and checks a program. Returns the number of milled segments.
fn run(program: &Program, machine: &Machine, seed: u64) -> u32 {
    let plan = timeline(program, machine).unwrap_or_else(|why| panic!("seed {seed}: {why:?}"));
    laws::laws(&plan, machine).unwrap_or_else(|why| panic!("seed {seed}: {:?}", why[0]));
    let stream = steps::stream(&plan, machine).unwrap();
    let mut milled = 0;
    for (index, segment) in stream.segments.iter().enumerate() {
        if segment.stage == Stage::Mill {
            on_the_path(&plan, index, segment, seed);
            milled += 1;
        }
    }
    let verdict = verify(&stream, machine, corner_zero(machine));
    assert!(verdict.is_ok(), "seed {seed} on {}: {:?}", machine.name, verdict.unwrap_err()[0]);
    milled
}

#[test]
fn toolpaths_become_steps_that_pass_the_check() {
    let mut milled = 0;
    for seed in 0..60 {
        for machine in [virtual_drill(), one_by_one(), six_spindles()] {
            milled += run(&milling(&mut Chance::new(seed), &machine, FLAT), &machine, seed);
        }
    }
    assert!(milled >= 180, "{milled} paths, each one move");
}

#[test]
fn ramps_helices_pecks_and_tabs_pass_the_check() {
    let mut milled = 0;
    let kind = Kind { heights: true, pecks: true, ..FLAT };
    for seed in 0..60 {
        for machine in [virtual_drill(), six_spindles()] {
            milled += run(&milling(&mut Chance::new(seed), &machine, kind), &machine, seed);
        }
    }
    assert!(milled >= 360, "{milled} paths, several to a leg");
}

/// Halfway between two steps both are equally near: the path and its move must choose the same one.
#[test]
fn toolpaths_between_half_steps_end_on_the_chosen_step() {
    let machine = virtual_drill();
    let half = |steps: i64| Length::from_nm(steps * 6_250);
    assert_eq!(machine.x.scale.steps(Length::from_mm(1.0)), 80, "a step is 12.5 µm");
    for (from, to) in [(-1, 3), (-3, -5), (7, 1), (1, -1), (5, 5)] {
        let mut program = milling(&mut Chance::new(1), &machine, Kind { commands: 0, ..FLAT });
        let place = |at| Point::new(half(at), half(-at));
        let leg = &mut program.legs[0].commands;
        let at = leg.iter().position(|command| matches!(command, Command::Rapid { .. })).unwrap();
        leg[at] = Command::Rapid { to: place(from) };
        let height = Length::from_um(-100);
        leg.insert(at + 2, Command::Mill { to: place(to), height, feed_um_per_s: 5_000 });
        leg.insert(at + 3, Command::Mill { to: place(from), height, feed_um_per_s: 5_000 });
        leg.insert(at + 4, Command::Mill { to: place(to), height, feed_um_per_s: 5_000 });
        let mut roomy = machine.clone();
        (roomy.x.min, roomy.y.min) = (Length::from_um(-5_000), Length::from_um(-5_000));
        program.machine = roomy.fingerprint();
        let plan = timeline(&program, &roomy).unwrap();
        let stream = steps::stream(&plan, &roomy).unwrap();
        let mut zero = corner_zero(&roomy);
        (zero[0], zero[1]) = (0, 0);
        assert!(verify(&stream, &roomy, zero).is_ok(), "{from} {to}: {:?}", verify(&stream, &roomy, zero));
    }
}

/// The groove around a ground plane is metres long, and a small router needs a quarter of an hour for it.
#[test]
fn long_toolpath_is_split_into_moves_below_300_seconds() {
    let machine = hobby_3018();
    let (height, feed_um_per_s) = (Length::from_um(-100), 2_000);
    let at = |x: f64, y: f64| Point::from_mm(x, y);
    let mill = |to: Point, feed_um_per_s: u32| Command::Mill { to, height, feed_um_per_s };
    let there_and_back = |legs: u32| (0..legs).map(move |leg| if leg % 2 == 0 { 90.0 } else { 30.0 });
    let circle = Command::MillArc {
        to: at(60.0, 60.0),
        height,
        center: at(75.0, 60.0),
        ccw: true,
        feed_um_per_s: 100,
    };
    let toolpaths: [Vec<Command>; 3] = [
        there_and_back(30).map(|x| mill(at(x, 60.0 + x / 10.0), feed_um_per_s)).collect(),
        vec![mill(at(90.0, 60.0), 50)],
        vec![circle],
    ];
    for (seed, way) in (0..).zip(toolpaths) {
        let mut program = milling(&mut Chance::new(1), &machine, Kind { commands: 0, ..FLAT });
        let leg = &mut program.legs[0].commands;
        let after = leg.iter().position(|command| matches!(command, Command::Plunge { .. })).unwrap() + 1;
        leg.splice(after..after, way);
        let plan = timeline(&program, &machine).unwrap();
        let milled = plan.moves.iter().filter(|planned| planned.stage == Stage::Mill);
        let seconds: Vec<f64> =
            milled.map(|planned| planned.duration_ticks as f64 / TICK_HZ as f64).collect();
        assert!(seconds.iter().sum::<f64>() > 590.0, "{seconds:?}");
        assert!(seconds.iter().all(|seconds| *seconds < 301.0), "{seconds:?}");
        assert_eq!(run(&program, &machine, seed) as usize, seconds.len());
    }
}

#[test]
fn impossible_milling_is_refused() {
    let machine = virtual_drill();
    let mut down = milling(&mut Chance::new(3), &machine, FLAT);
    let last = down.legs[0].commands.len() - 2;
    down.legs[0].commands.insert(last, Command::Retract { to: Length::from_um(-500) });
    for (machine, program, code) in [
        (lab(), milling(&mut Chance::new(3), &lab(), FLAT), "motion.path_on_table"),
        (machine, down, "motion.retract_downwards"),
    ] {
        let why = timeline(&program, &machine).unwrap_err();
        assert_eq!(why.code, code);
        assert!(!why.message("en").contains('{') && !why.advice("en").is_empty(), "{}", why.message("en"));
    }
}

/// The path of a leg's mill commands as short straight lines, in mm.
fn outline(program: &Program) -> Vec<[f64; 2]> {
    let mm = |at: Point| [at.x.mm(), at.y.mm()];
    let mut line: Vec<[f64; 2]> = Vec::new();
    for command in &program.legs[0].commands {
        match *command {
            Command::Rapid { to } | Command::Mill { to, .. } => line.push(mm(to)),
            Command::MillArc { to, center, ccw, .. } => {
                let (from, to, center) = (*line.last().unwrap(), mm(to), mm(center));
                let angle = |at: [f64; 2]| libm::atan2(at[1] - center[1], at[0] - center[0]);
                let radius = libm::hypot(from[0] - center[0], from[1] - center[1]);
                let turn = if ccw { angle(to) - angle(from) } else { angle(from) - angle(to) };
                let full = core::f64::consts::TAU;
                let turn = if from == to { full } else { libm::fmod(turn + full, full) };
                for part in 1..=300 {
                    let share = f64::from(part) / 300.0 * if ccw { turn } else { -turn };
                    let at = angle(from) + share;
                    line.push([center[0] + radius * libm::cos(at), center[1] + radius * libm::sin(at)]);
                }
                line.push(to);
            }
            _ => {}
        }
    }
    line
}

fn distance(line: &[[f64; 2]], at: [f64; 2]) -> f64 {
    let to = |pair: &[[f64; 2]]| {
        let (way, off) =
            ([pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]], [at[0] - pair[0][0], at[1] - pair[0][1]]);
        let squared = way[0] * way[0] + way[1] * way[1];
        let share =
            if squared > 0.0 { ((way[0] * off[0] + way[1] * off[1]) / squared).clamp(0.0, 1.0) } else { 0.0 };
        libm::hypot(off[0] - share * way[0], off[1] - share * way[1])
    };
    line.windows(2).map(to).fold(f64::INFINITY, f64::min)
}

/// With backlash the position of an axis is that of its motor when moving up, and lags by the backlash when
/// moving down.
#[test]
fn backlash_is_taken_up_at_every_turn_of_a_toolpath() {
    let mut looked = 0;
    for seed in 0..40 {
        let mut chance = Chance::new(seed);
        let mut machine = virtual_drill();
        let play = |chance: &mut Chance| Length::from_um(12 * (chance.bits() as i64 & 0xF));
        (machine.x.backlash, machine.y.backlash) = (play(&mut chance), play(&mut chance));
        let kind = Kind { heights: true, pecks: false, commands: 6, reach: 4.0 };
        let program = milling(&mut chance, &machine, kind);
        let line = outline(&program);
        let mut away = program.clone();
        // Approach from both sides.
        away.legs[0]
            .commands
            .insert(2, Command::Rapid { to: Point::from_mm(chance.between(50.0, 70.0), 70.0) });
        run(&away, &machine, seed);
        let stream = steps::stream(&timeline(&away, &machine).unwrap(), &machine).unwrap();
        let play = [0, 1].map(|axis: usize| machine.axis(axis).scale.steps(machine.axis(axis).backlash));
        let (mut motors, mut axes) = (stream.start, [stream.start[0], stream.start[1]]);
        for segment in &stream.segments {
            for pulse in steps::replay(segment) {
                for axis in 0..2 {
                    if pulse.axes >> axis & 1 == 1 {
                        motors[axis] += if pulse.forward >> axis & 1 == 1 { 1 } else { -1 };
                    }
                    axes[axis] = axes[axis].clamp(motors[axis], motors[axis] + play[axis]);
                }
                let mm = [axes[0] as f64 / 80.0, axes[1] as f64 / 80.0];
                if segment.stage == Stage::Mill && (pulse.tick / 10).is_multiple_of(5) {
                    let off = distance(&line, mm) * 80.0;
                    assert!(off < 1.1, "seed {seed}: {mm:?} is {off} steps off the path");
                    looked += 1;
                }
            }
        }
        let end = *line.last().unwrap();
        let off = libm::hypot(axes[0] as f64 / 80.0 - end[0], axes[1] as f64 / 80.0 - end[1]) * 80.0;
        assert!(off < 0.75, "seed {seed}: {off} steps off at the end");
    }
    assert!(looked > 5_000, "{looked} places");
}
