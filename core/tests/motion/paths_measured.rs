//! Tests of random paths measured by their positions alone: speeds, accelerations, jerks, and the reserve
//! for changes of the override. A failure prints its seed.

use super::paths::{RULES, end_of, flattened, keeps_its_laws, random_axes, random_chain};
use crate::programs::{Chance, rounds};
use annulus_core::motion::path::{Chain, PathPoint, PathRules, PlannedPath, override_change_per_s, plan};
use annulus_core::motion::profile::Limits;

/// Returns whether the path consists of short lines only, its pieces, its axes and the planned path.
fn random_path(chance: &mut Chance) -> (bool, Chain, [Limits; 3], PlannedPath) {
    let lines = chance.bits().is_multiple_of(2);
    let chain = if lines { flattened(chance) } else { random_chain(chance, 12) };
    let axes = random_axes(chance);
    let path = plan(&chain, &axes, &RULES).unwrap();
    (lines, chain, axes, path)
}

/// Mean speeds of an axis, measured by steps over adjacent intervals of 5 ms, may differ only by its
/// acceleration and a corner's jump.
#[test]
fn mean_speed_changes_are_within_axis_and_corner_limits() {
    let window_s = 5e-3;
    let (mut worst, mut alike, mut runs) = (0.0_f64, 0, 0);
    for seed in 0..rounds(3_000) {
        let mut chance = Chance::new(seed);
        let (short, chain, axes, path) = random_path(&mut chance);
        keeps_its_laws(&path, &chain, &axes, &RULES, seed);
        if short && path.pieces.len() > 20 {
            alike += path.pieces.len();
            runs += path.runs.len();
        }
        for _ in 0..200 {
            let t = path.duration_s() * chance.unit();
            let [before, at, after] = [t - window_s, t, t + window_s].map(|t| path.at(t));
            for axis in 0..3 {
                let change = ((after[axis] - at[axis]) - (at[axis] - before[axis])).abs() / window_s;
                let own = axes[axis].acceleration_mm_per_s2;
                let allowed = own * window_s + libm::sqrt(8.0 * own * RULES.deviation_mm);
                worst = worst.max(change / allowed);
                assert!(
                    change <= allowed,
                    "seed {seed}: axis {axis} changes by {change} at {t}, {allowed} allowed"
                );
            }
        }
    }
    println!("at most {worst} of what is allowed; {alike} short pieces in {runs} runs");
    assert!(runs * 5 < alike, "short pieces gather speed together: {alike} in {runs} runs");
}

/// A hold changes the rate from 1 to 0, an override to any value between: the reserve of the plan must be
/// enough.
#[test]
fn path_reserve_covers_every_feed_override_change() {
    for seed in 0..rounds(10_000) {
        let mut chance = Chance::new(seed);
        let (chain, axes) = (random_chain(&mut chance, 12), random_axes(&mut chance));
        let rules = PathRules { share: chance.between(0.3, 0.95), ..RULES };
        let path = plan(&chain, &axes, &rules).unwrap();
        let change = override_change_per_s(&path, &axes, &rules);
        assert!(change > 0.0, "seed {seed}");
        for part in 1..20 {
            let t = path.duration_s() * f64::from(part) / 20.0;
            let (feed_override, way) = (chance.unit(), if part % 2 == 0 { change } else { -change });
            let (v, a) = (path.velocity(t), path.acceleration(t));
            for axis in 0..3 {
                let pulled = feed_override * feed_override * a[axis]
                    + if v[axis] == 0.0 { 0.0 } else { way * v[axis] };
                assert!(
                    pulled.abs() <= axes[axis].acceleration_mm_per_s2 * (1.0 + 1e-9),
                    "seed {seed}: {pulled} at {t}"
                );
            }
        }
    }
}

/// Speed, acceleration and jerk of an axis from its positions at t, t + h, t + 2h, t + 3h.
fn differentiated(path: &PlannedPath, axis: usize, t: f64, h: f64) -> [f64; 3] {
    let [a, b, c, d] = [0.0, 1.0, 2.0, 3.0].map(|times| path.at(t + times * h)[axis]);
    [(d - a) / (3.0 * h), (d - c - b + a) / (2.0 * h * h), (d - 3.0 * c + 3.0 * b - a) / (h * h * h)]
}

/// The times at which pieces and spans of a path meet. Between them the motion is smooth.
fn joints(path: &PlannedPath) -> Vec<f64> {
    let pieces = (0..path.pieces.len()).map(|piece| path.start_of_piece_s(piece));
    let spans = path.runs.iter().flat_map(|run| run.spans.iter().map(|span| run.start_s + span.end_s()));
    let edges = path.runs.iter().flat_map(|run| {
        run.spans.iter().flat_map(|span| {
            let ramp = &span.ramp;
            let rise = [ramp.jerk_time_s, ramp.jerk_time_s + ramp.hold_s].map(|at| at - span.skip_s);
            rise.map(|at| run.start_s + span.start_s + if span.falls { span.duration_s - at } else { at })
        })
    });
    let mut all: Vec<f64> = pieces.chain(spans).chain(edges).filter(|at| *at > 0.0).collect();
    all.push(0.0);
    all.push(path.duration_s());
    all.sort_by(f64::total_cmp);
    all
}

/// Differentiates positions only. Between joints every axis must keep its limits of speed, acceleration and
/// jerk. At a joint the speed may jump by what a corner allows, and the acceleration by at most its limit.
/// Lines are followed within a nanometre, and the end is exact.
#[test]
fn path_positions_alone_obey_all_limits() {
    let (mut even, mut over, mut pulled) = (0, 0, 0);
    for seed in 0..rounds(4_000) {
        let mut chance = Chance::new(seed);
        let (lines, chain, axes, path) = random_path(&mut chance);
        assert_eq!(path.at(path.duration_s() + 1.0), path.end(), "seed {seed}");
        let joints = joints(&path);
        for pair in joints.windows(2).filter(|pair| pair[1] - pair[0] > 1e-4) {
            let h = (0.25 * (pair[1] - pair[0])).min(2e-3);
            let t = pair[0] + chance.unit() * (pair[1] - pair[0] - 3.0 * h);
            for (axis, own) in axes.iter().take(3).enumerate() {
                let [v, a, j] = differentiated(&path, axis, t, h).map(f64::abs);
                // Positions are exact to about 1e-14 mm.
                let noise = 1e-13 / h;
                let most = RULES.share * own.acceleration_mm_per_s2;
                assert!(
                    v <= own.speed_mm_per_s * (1.0 + 1e-9) + noise,
                    "seed {seed}: axis {axis} goes {v} at {t}"
                );
                assert!(a <= most * (1.0 + 1e-9) + noise / h, "seed {seed}: axis {axis} pulls {a} at {t}");
                assert!(
                    j <= own.jerk_mm_per_s3 * (1.0 + 1e-6) + noise / h / h,
                    "seed {seed}: axis {axis} jerks {j} at {t}"
                );
            }
            even += 1;
            if lines {
                let at = path.at(t);
                let near = |to: &[PathPoint]| {
                    let way: PathPoint = core::array::from_fn(|axis| to[1][axis] - to[0][axis]);
                    let off: PathPoint = core::array::from_fn(|axis| at[axis] - to[0][axis]);
                    let squared: f64 = way.iter().map(|part| part * part).sum();
                    let share = way.iter().zip(off).map(|(way, off)| way * off).sum::<f64>() / squared;
                    let rest = |axis: usize| off[axis] - share.clamp(0.0, 1.0) * way[axis];
                    libm::sqrt((0..3).map(|axis| rest(axis) * rest(axis)).sum())
                };
                let mut places = vec![chain.start];
                places.extend(chain.pieces.iter().map(end_of));
                let off = places
                    .windows(2)
                    .filter(|pair| pair[0] != pair[1])
                    .map(near)
                    .fold(f64::INFINITY, f64::min);
                assert!(off <= 1e-6, "seed {seed}: {off} mm beside the path at {t}");
            }
        }
        for trio in joints.windows(3).filter(|trio| trio[1] - trio[0] > 4e-4 && trio[2] - trio[1] > 4e-4) {
            let h = 1e-4;
            for (axis, own) in axes.iter().take(3).enumerate() {
                let [_, before, _] = differentiated(&path, axis, trio[1] - 3.0 * h, h);
                let [_, after, _] = differentiated(&path, axis, trio[1], h);
                let pull = RULES.share * own.acceleration_mm_per_s2;
                let room = 3.0 * own.jerk_mm_per_s3 * h + 1e-13 / h / h;
                // From line to line the acceleration of an axis changes by at most its limit; an arc adds
                // its centripetal acceleration.
                let most = if lines { pull } else { 2.0 * pull };
                assert!((after - before).abs() <= most + room, "seed {seed}: axis {axis} at {}", trio[1]);
                let tiny = 1e-6;
                let speed = |t: f64| (path.at(t + tiny)[axis] - path.at(t)[axis]) / tiny;
                let jump = (speed(trio[1]) - speed(trio[1] - tiny)).abs();
                let corner = libm::sqrt(8.0 * pull * RULES.deviation_mm);
                let most = corner * (1.0 + 1e-6) + 2.0 * pull * tiny + 1e-13 / tiny;
                assert!(jump <= most, "seed {seed}: axis {axis} jumps by {jump} of {most} at {}", trio[1]);
                over += 1;
                pulled += u64::from(jump > 1e-3 * corner && after.abs() > 0.1 * pull);
            }
        }
    }
    println!("{even} even stretches, {over} joints of an axis, pulled over a corner {pulled} times");
    assert!(even > rounds(20_000) && pulled > rounds(1_000), "{even} stretches, {pulled} pulled");
}
