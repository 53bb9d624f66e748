//! Tests of the laws for paths of lines and arcs on many random ones. A failure prints its seed.

use crate::programs::{Chance, rounds};
use annulus_core::motion::path::{
    Chain, PathPoint, PathRules, PlannedPath, To, WantedPiece, laws, plan, sweeps,
};
use annulus_core::motion::profile::{self, Limits, MotionLaw};
use core::f64::consts::{PI, TAU};

pub(super) const RULES: PathRules = PathRules { share: 0.8, deviation_mm: 0.01, longest_s: 300.0 };

fn axes(speed: f64, acceleration: f64, jerk: f64) -> [Limits; 3] {
    [Limits { speed_mm_per_s: speed, acceleration_mm_per_s2: acceleration, jerk_mm_per_s3: jerk }; 3]
}

pub(super) fn random_axes(chance: &mut Chance) -> [Limits; 3] {
    core::array::from_fn(|_| Limits {
        speed_mm_per_s: chance.scale(5.0, 500.0),
        acceleration_mm_per_s2: chance.scale(50.0, 2e4),
        jerk_mm_per_s3: chance.scale(1e3, 1e6),
    })
}

fn rounded(mm: f64) -> f64 {
    libm::round(mm * 1e6) * 1e-6
}

fn rise(chance: &mut Chance) -> f64 {
    if chance.bits().is_multiple_of(2) { 0.0 } else { chance.between(-2.0, 2.0) }
}

fn random_piece(chance: &mut Chance, at: PathPoint, way: &mut f64) -> WantedPiece {
    let feed = if chance.bits().is_multiple_of(4) { f64::INFINITY } else { chance.scale(0.5, 200.0) };
    let length = if chance.bits().is_multiple_of(5) { 0.001 } else { chance.scale(0.001, 30.0) };
    *way += match chance.bits() % 6 {
        0 => PI,
        1 | 2 => 0.0,
        3 => chance.between(-0.1, 0.1),
        _ => chance.between(-PI, PI),
    };
    let beyond = [at[0] + length * libm::cos(*way), at[1] + length * libm::sin(*way)];
    let to = match chance.bits() % 8 {
        0 => To::Line(at),
        1 => To::Line([rounded(beyond[0]), rounded(beyond[1]), rounded(at[2] + chance.between(-2.0, 2.0))]),
        2 => To::Line([at[0], at[1], rounded(at[2] + chance.between(-2.0, 2.0))]),
        3 => {
            let to = [at[0], at[1], rounded(at[2] + rise(chance))];
            To::Arc { to, center: beyond, ccw: chance.bits().is_multiple_of(2) }
        }
        4 | 5 => {
            let ccw = chance.bits().is_multiple_of(2);
            let side = if ccw { 0.5 * PI } else { -0.5 * PI };
            let center = [at[0] + length * libm::cos(*way + side), at[1] + length * libm::sin(*way + side)];
            let turn = if ccw { 1.0 } else { -1.0 } * chance.scale(1e-3, TAU);
            let angle = *way - side + turn;
            *way += turn;
            let to = [center[0] + length * libm::cos(angle), center[1] + length * libm::sin(angle)];
            let to = [rounded(to[0]), rounded(to[1]), rounded(at[2] + rise(chance))];
            To::Arc { to, center: center.map(rounded), ccw }
        }
        _ => To::Line([rounded(beyond[0]), rounded(beyond[1]), at[2]]),
    };
    WantedPiece { to, feed_mm_per_s: feed }
}

pub(super) fn end_of(piece: &WantedPiece) -> PathPoint {
    match piece.to {
        To::Line(to) | To::Arc { to, .. } => to,
    }
}

pub(super) fn random_chain(chance: &mut Chance, most: u64) -> Chain {
    let mut chain = Chain { start: [rounded(chance.between(-10.0, 10.0)), 0.0, 2.0], pieces: Vec::new() };
    let (mut at, mut way) = (chain.start, 0.0);
    for _ in 0..1 + chance.bits() % most {
        let piece = random_piece(chance, at, &mut way);
        at = end_of(&piece);
        chain.pieces.push(piece);
    }
    chain
}

/// A curve split into many short lines, as is common in drawings.
pub(super) fn flattened(chance: &mut Chance) -> Chain {
    let (radius, wave) = (chance.scale(0.3, 20.0), chance.between(0.0, 0.4));
    let (waves, piece_mm) = (libm::floor(chance.between(1.0, 9.0)), chance.scale(0.005, 0.5));
    let count = (1.0 + radius / piece_mm * chance.between(0.5, TAU)).min(400.0) as u32;
    let at = |index: u32| {
        let angle = f64::from(index) * piece_mm / radius;
        let r = radius * (1.0 + wave * libm::sin(waves * angle));
        [rounded(r * libm::cos(angle)), rounded(r * libm::sin(angle)), 0.0]
    };
    let feed_mm_per_s =
        if chance.bits().is_multiple_of(2) { f64::INFINITY } else { chance.scale(1.0, 200.0) };
    let piece = |index| WantedPiece { to: To::Line(at(index)), feed_mm_per_s };
    Chain { start: at(0), pieces: (1..=count).map(piece).collect() }
}

pub(super) fn keeps_its_laws(
    path: &PlannedPath,
    chain: &Chain,
    axes: &[Limits; 3],
    rules: &PathRules,
    seed: u64,
) {
    laws(path, axes, rules).unwrap_or_else(|diagnostic| panic!("seed {seed}: {diagnostic:?}"));
    let total = path.duration_s();
    let end = chain.pieces.last().map_or(chain.start, end_of);
    let nearly = |a: PathPoint, b: PathPoint| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-9);
    assert!(nearly(path.end(), end), "seed {seed}: ends at {:?} instead of {end:?}", path.end());
    assert!(path.at(total) == path.end() && path.at(0.0) == chain.start, "seed {seed}");
    assert!(path.speed(0.0) == 0.0 && path.speed(total) == 0.0, "seed {seed}");
    let mut before = 0.0;
    for part in 0..=40 {
        let t = total * f64::from(part) / 40.0;
        let s = path.position_mm(t);
        assert!(s >= before - 1e-9, "seed {seed}: goes back at {t}");
        before = s;
        let back = path.position_mm(path.time_at_length(s));
        assert!((back - s).abs() <= 1e-9 * (1.0 + s), "seed {seed}: inverse at {t}: {back} instead of {s}");
        let (v, a) = (path.velocity(t), path.acceleration(t));
        for axis in 0..3 {
            let own = axes[axis];
            assert!(
                v[axis].abs() <= own.speed_mm_per_s * (1.0 + 1e-9),
                "seed {seed}: axis {axis} goes {} at {t}",
                v[axis]
            );
            let most = own.acceleration_mm_per_s2 * rules.share * (1.0 + 1e-9);
            assert!(a[axis].abs() <= most, "seed {seed}: axis {axis} pulls {} at {t}", a[axis]);
        }
    }
}

#[test]
fn random_paths_obey_every_axis_limit() {
    let mut pieces = 0;
    for seed in 0..rounds(60_000) {
        let mut chance = Chance::new(seed);
        let (chain, axes) = (random_chain(&mut chance, 12), random_axes(&mut chance));
        let rules =
            PathRules { share: chance.between(0.3, 1.0), deviation_mm: chance.scale(1e-4, 1.0), ..RULES };
        let path =
            plan(&chain, &axes, &rules).unwrap_or_else(|diagnostic| panic!("seed {seed}: {diagnostic:?}"));
        keeps_its_laws(&path, &chain, &axes, &rules, seed);
        pieces += path.pieces.len() as u64;
    }
    assert!(pieces > rounds(200_000), "only {pieces} pieces");
}

/// Speeds must be the derivatives of positions, and accelerations those of speeds, if both sides of a
/// moment are in one span.
#[test]
fn path_position_speed_and_acceleration_are_consistent() {
    let mut tried = 0;
    for seed in 0..rounds(20_000) {
        let mut chance = Chance::new(seed);
        let (chain, axes) = (random_chain(&mut chance, 6), random_axes(&mut chance));
        let path = plan(&chain, &axes, &RULES).unwrap();
        if path.pieces.is_empty() {
            continue;
        }
        let run = &path.runs[chance.bits() as usize % path.runs.len()];
        let span = run.spans[chance.bits() as usize % run.spans.len()];
        let h = 1e-4 * span.duration_s;
        let t = run.start_s + span.start_s + span.duration_s * chance.between(0.05, 0.95);
        let corner = |piece| (path.start_of_piece_s(piece) - t).abs() <= 2.0 * h;
        if (0..path.pieces.len()).any(corner) {
            continue;
        }
        if h < 1e-9 * path.duration_s() {
            continue;
        }
        tried += 1;
        let (before, after) = (path.at(t - h), path.at(t + h));
        let (v_before, v_after) = (path.velocity(t - h), path.velocity(t + h));
        for axis in 0..3 {
            let (v, a) = (path.velocity(t)[axis], path.acceleration(t)[axis]);
            let slope = (after[axis] - before[axis]) / (2.0 * h);
            let room = 1e-4 * axes[axis].speed_mm_per_s + 1e-14 / h;
            assert!((v - slope).abs() <= room, "seed {seed}: axis {axis} goes {v}, its slope {slope}");
            let slope = (v_after[axis] - v_before[axis]) / (2.0 * h);
            let room = 0.02 * axes[axis].acceleration_mm_per_s2 + 1e-12 * path.speed(t) / h;
            assert!((a - slope).abs() <= room, "seed {seed}: axis {axis} pulls {a}, its slope {slope}");
        }
    }
    assert!(tried > rounds(10_000), "only {tried} moments");
}

#[test]
fn path_steps_are_made_half_way_and_end_at_the_path_end() {
    let mut steps = 0;
    for seed in 0..rounds(6_000) {
        let mut chance = Chance::new(seed);
        let (chain, axes) = (random_chain(&mut chance, 8), random_axes(&mut chance));
        let path = plan(&chain, &axes, &RULES).unwrap();
        let mm = chance.scale(0.002, 0.2);
        let turn_s = chance.scale(1e-6, 1e-3);
        for axis in 0..3 {
            let at_step = |mm_at: f64| libm::floor(mm_at / mm + 0.5) as i64;
            let (mut at, mut last, mut forward) = (at_step(chain.start[axis]), 0.0, None);
            for sweep in sweeps(&path, axis, mm, turn_s) {
                assert!(sweep.count > 0 && sweep.from_step == at, "seed {seed}: {sweep:?} begins elsewhere");
                assert_ne!(forward, Some(sweep.forward), "seed {seed}: two sweeps one way");
                for step in 1..=sweep.count {
                    let t = sweep.time_s(&path, step);
                    let least = if step == 1 && forward.is_some() { last + turn_s } else { last };
                    assert!(t >= least - 1e-9, "seed {seed}: step {step} of {sweep:?} at {t} after {last}");
                    let half = at as f64 + if sweep.forward { 0.5 } else { -0.5 };
                    let place = path.at(t)[axis];
                    assert!(
                        (place - half * mm).abs() <= 1e-7,
                        "seed {seed}: {place} instead of {}",
                        half * mm
                    );
                    at += if sweep.forward { 1 } else { -1 };
                    last = t;
                    steps += 1;
                }
                forward = Some(sweep.forward);
            }
            // If a last reversal was omitted, the axis may end one step away from a position near the
            // middle between two steps.
            let off = path.end()[axis] / mm - at as f64;
            assert!(off.abs() <= 0.5 + 1e-6, "seed {seed}: axis {axis} ends {off} steps off");
        }
    }
    assert!(steps > rounds(1_000_000), "only {steps} steps");
}

fn line(x: f64, y: f64) -> WantedPiece {
    WantedPiece { to: To::Line([x, y, 0.0]), feed_mm_per_s: 20.0 }
}

fn planned(pieces: Vec<WantedPiece>, axes: &[Limits; 3]) -> PlannedPath {
    let path = plan(&Chain { start: [0.0; 3], pieces }, axes, &RULES).unwrap();
    laws(&path, axes, &RULES).unwrap();
    path
}

#[test]
fn single_piece_path_equals_the_profile() {
    let axes = axes(50.0, 1000.0, 5e4);
    for length in [1e-3, 0.1, 3.0, 80.0] {
        let path = planned(vec![line(length, 0.0)], &axes);
        let limits = Limits { speed_mm_per_s: 20.0, acceleration_mm_per_s2: 800.0, jerk_mm_per_s3: 5e4 };
        let expected = profile::plan(MotionLaw::SCurve, length, limits).unwrap().duration_s();
        assert!((path.duration_s() - expected).abs() <= 1e-9 * expected, "{length} mm");
    }
}

#[test]
fn sharper_corners_are_slower() {
    let axes = axes(50.0, 1000.0, 5e4);
    let corner = |angle: f64| {
        let beyond = [20.0 + 20.0 * libm::cos(angle), 20.0 * libm::sin(angle)];
        let path = planned(vec![line(20.0, 0.0), line(beyond[0], beyond[1])], &axes);
        path.speed(path.start_of_piece_s(1))
    };
    assert_eq!(corner(0.0), 20.0, "straight on is no corner");
    assert!(corner(PI) < 1e-6, "back is a stop");
    let speeds: Vec<f64> = (0..=18).map(|part| corner(PI * f64::from(part) / 18.0)).collect();
    assert!(speeds.is_sorted_by(|a, b| a >= b), "{speeds:?}");
    // Right angle: R = d·(1 + √2), and the acceleration of both axes together, 800·√2.
    let right = libm::sqrt(800.0 * libm::sqrt(2.0) * 0.01 * (1.0 + libm::sqrt(2.0)));
    assert!((corner(0.5 * PI) - right).abs() <= 1e-9, "{} instead of {right}", corner(0.5 * PI));
    // A polygon with many corners may be hardly faster than a circle, whose centripetal acceleration is 0.6
    // of 800 mm/s².
    let points = (1..=2000).map(|part| TAU * f64::from(part) / 2000.0);
    let pieces = points.map(|angle| WantedPiece {
        to: To::Line([1.0 - libm::cos(angle), libm::sin(angle), 0.0]),
        feed_mm_per_s: f64::INFINITY,
    });
    let path = planned(pieces.collect(), &axes);
    let middle = path.speed(0.5 * path.duration_s());
    assert!((middle - libm::sqrt(480.0)).abs() <= 0.1 * middle, "{middle}");
}

#[test]
fn full_circles_reversals_and_empty_pieces_are_planned() {
    let axes = axes(50.0, 1000.0, 5e4);
    let circle = |feed| WantedPiece {
        to: To::Arc { to: [0.0; 3], center: [3.0, 0.0], ccw: true },
        feed_mm_per_s: feed,
    };
    let path = planned(vec![circle(f64::INFINITY)], &axes);
    assert!((path.length_mm() - 6.0 * PI).abs() < 1e-9);
    let half = path.at(path.time_at_length(3.0 * PI));
    assert!((half[0] - 6.0).abs() < 1e-9 && half[1].abs() < 1e-9, "{half:?}");
    assert_eq!(path.at(path.duration_s()), [0.0; 3]);
    // The centripetal acceleration may be 0.9 of 0.8 of the limit. From rest to rest, a slightly lower
    // speed takes less time.
    let fastest =
        (0..1000).map(|part| path.speed(path.duration_s() * f64::from(part) / 1000.0)).fold(0.0, f64::max);
    let most = libm::sqrt(0.72 * 1000.0 * 3.0);
    assert!(fastest <= most * (1.0 + 1e-9) && fastest > 0.6 * most, "{fastest} of {most}");
    let there_and_back = planned(vec![line(5.0, 0.0), line(0.0, 0.0)], &axes);
    let one_way = planned(vec![line(5.0, 0.0)], &axes);
    // At the reversal the speed is zero, but the acceleration continues in the same direction. This saves
    // the 20 ms of its decrease and the 20 ms of its increase.
    let (both_s, each_s) = (there_and_back.duration_s(), one_way.duration_s());
    assert!(both_s < 2.0 * each_s - 0.015 && both_s > 2.0 * each_s - 0.04, "{both_s} of twice {each_s}");
    let nothing = planned(vec![line(0.0, 0.0), line(0.0, 0.0)], &axes);
    assert!(
        nothing.duration_s() == 0.0
            && nothing.at(1.0) == [0.0; 3]
            && sweeps(&nothing, 0, 0.01, 0.0).is_empty()
    );
    assert_eq!(planned(Vec::new(), &axes).duration_s(), 0.0);
    let dust = planned((1..=1000).map(|step| line(f64::from(step) * 1e-3, 0.0)).collect(), &axes);
    let one = planned(vec![line(1.0, 0.0)], &axes);
    assert!((dust.duration_s() - one.duration_s()).abs() < 1e-9, "dust gathers speed as one line does");
    assert_eq!((dust.pieces.len(), dust.runs.len()), (1000, 1));
}

#[test]
fn helix_is_a_circle_that_rises_evenly() {
    let axes = axes(50.0, 1000.0, 5e4);
    for (ccw, rise, turns) in [(true, -1.5, 1.0), (false, 2.0, 1.0), (true, 0.25, 0.5), (false, -40.0, 0.5)] {
        let end = if turns == 1.0 { [0.0, 0.0, rise] } else { [4.0, 0.0, rise] };
        let to = To::Arc { to: end, center: [2.0, 0.0], ccw };
        let path = planned(vec![WantedPiece { to, feed_mm_per_s: f64::INFINITY }], &axes);
        let (around, way) = (4.0 * PI * turns, if ccw { 1.0 } else { -1.0 });
        assert!((path.length_mm() - libm::sqrt(around * around + rise * rise)).abs() < 1e-9);
        for part in 0..=100 {
            let share = f64::from(part) / 100.0;
            let at = path.at(path.time_at_length(share * path.length_mm()));
            let angle = PI + way * TAU * turns * share;
            let meant = [2.0 + 2.0 * libm::cos(angle), 2.0 * libm::sin(angle), rise * share];
            assert!(at.iter().zip(meant).all(|(a, b)| (a - b).abs() < 1e-7), "{at:?} instead of {meant:?}");
        }
    }
    // Steep helices are as fast as the height allows, flat ones as fast as the circle.
    let top = |rise: f64| {
        let to = To::Arc { to: [0.0, 0.0, rise], center: [2.0, 0.0], ccw: true };
        let path = planned(vec![WantedPiece { to, feed_mm_per_s: f64::INFINITY }], &axes);
        (0..1000)
            .map(|part| path.velocity(path.duration_s() * f64::from(part) / 1000.0))
            .fold([0.0_f64; 2], |most, v| {
                [most[0].max(libm::sqrt(v[0] * v[0] + v[1] * v[1])), most[1].max(v[2].abs())]
            })
    };
    let flat = top(0.0)[0];
    assert!(flat <= libm::sqrt(0.72 * 1000.0 * 2.0) * (1.0 + 1e-9), "{flat}");
    assert!((top(1.0)[0] - flat).abs() < 0.02 * flat, "{:?} beside {flat}", top(1.0));
    assert!(top(400.0)[1] > 0.99 * 50.0, "{:?}", top(400.0));
}

#[test]
fn square_with_lookahead_is_faster_than_with_stops() {
    let axes = axes(50.0, 1000.0, 5e4);
    let square = [(10.0, 0.0), (10.0, 10.0), (0.0, 10.0), (0.0, 0.0)];
    let path = planned(square.map(|(x, y)| line(x, y)).to_vec(), &axes);
    let side = planned(vec![line(10.0, 0.0)], &axes).duration_s();
    let straight = planned(vec![line(40.0, 0.0)], &axes).duration_s();
    assert!(path.duration_s() < 4.0 * side && path.duration_s() > straight, "{}", path.duration_s());
}

#[test]
fn invalid_chains_are_refused_with_the_piece() {
    let good = axes(50.0, 1000.0, 5e4);
    let refused = |piece: WantedPiece| {
        let chain = Chain { start: [0.0; 3], pieces: vec![line(1.0, 0.0), piece] };
        let diagnostic = plan(&chain, &good, &RULES).unwrap_err();
        assert!(diagnostic.args.contains(&("piece".to_owned(), "2".to_owned())), "{diagnostic:?}");
        for text in [diagnostic.message("en"), diagnostic.advice("en")] {
            assert!(!text.contains('{') && !text.contains("motion."), "{text}");
        }
        diagnostic.code
    };
    let arc = |to, center| WantedPiece { to: To::Arc { to, center, ccw: true }, feed_mm_per_s: 10.0 };
    assert_eq!(refused(line(f64::NAN, 0.0)), "motion.bad_place");
    assert_eq!(refused(line(1e12, 0.0)), "motion.bad_place");
    assert_eq!(refused(arc([2.0, 0.0, 0.0], [f64::INFINITY, 0.0])), "motion.bad_place");
    assert_eq!(refused(arc([2.0, 0.0, f64::NAN], [1.5, 0.0])), "motion.bad_place");
    assert_eq!(refused(arc([2.0, 0.0, 0.0], [1.2, 0.0])), "motion.bad_arc");
    assert_eq!(refused(arc([1.0, 0.0, 0.0], [1.0, 0.0])), "motion.bad_arc");
    for feed in [0.0, -1.0, f64::NAN] {
        assert_eq!(refused(WantedPiece { feed_mm_per_s: feed, ..line(2.0, 0.0) }), "motion.bad_path_feed");
    }
    let chain = Chain { start: [0.0; 3], pieces: vec![line(1.0, 0.0)] };
    let code = |axes: &[Limits; 3], rules: PathRules| plan(&chain, axes, &rules).unwrap_err().code;
    assert_eq!(code(&axes(0.0, 1.0, 1.0), RULES), "motion.bad_speed");
    for wrong in [-1.0, f64::NAN, 1e9] {
        assert_eq!(code(&good, PathRules { share: wrong, ..RULES }), "motion.bad_share");
        assert_eq!(code(&good, PathRules { deviation_mm: wrong, ..RULES }), "motion.bad_deviation");
    }
}

#[test]
fn altered_path_fails_the_laws() {
    let axes = axes(50.0, 1000.0, 5e4);
    let good = planned(vec![line(10.0, 0.0), line(10.0, 10.0)], &axes);
    let mut path = good.clone();
    path.start[0] = 1.0;
    assert_eq!(laws(&path, &axes, &RULES).unwrap_err().code, "motion.path_broken");
    let mut path = good.clone();
    path.pieces.pop();
    assert_eq!(laws(&path, &axes, &RULES).unwrap_err().code, "motion.path_broken");
    let mut path = good.clone();
    path.runs[0].spans[1].duration_s *= 1.5;
    assert_eq!(laws(&path, &axes, &RULES).unwrap_err().code, "motion.path_broken");
    let slower = [Limits { speed_mm_per_s: 10.0, ..axes[0] }; 3];
    assert_eq!(laws(&good, &slower, &RULES).unwrap_err().code, "motion.path_over_limit");
    assert_eq!(
        laws(&good, &axes, &PathRules { share: 0.4, ..RULES }).unwrap_err().code,
        "motion.path_over_limit"
    );
    let bytes = postcard::to_allocvec(&good).unwrap();
    assert_eq!(postcard::from_bytes::<PlannedPath>(&bytes).unwrap(), good);
}
