//! Tests of the laws of profiles on millions of random moves. A failure prints its seed.

use crate::programs::{Chance, rounds};
use annulus_core::motion::profile::bounds::{fifteen_phases_s, least_duration_s};
use annulus_core::motion::profile::{
    Limits, MotionLaw, Profile, Ramp, Stroke, choose, plan, point_of_no_return_s, residual_mm, stopping_mm,
    two_speeds,
};

const ROUNDING: f64 = 1e-9;

fn random_limits(chance: &mut Chance) -> Limits {
    let (speed, acceleration) = (chance.scale(0.01, 5e3), chance.scale(0.1, 2e5));
    Limits {
        speed_mm_per_s: speed,
        acceleration_mm_per_s2: acceleration,
        jerk_mm_per_s3: chance.scale(1.0, 1e8),
    }
}

fn random_shape(chance: &mut Chance) -> MotionLaw {
    match chance.bits() % 6 {
        0 => MotionLaw::Linear,
        1 | 2 => MotionLaw::SCurve,
        3 => MotionLaw::Power(0.5),
        4 => MotionLaw::Power([0.25, 1.0, 1.5, 2.0][chance.bits() as usize % 4]),
        _ => MotionLaw::Power(chance.scale(1e-3, 2.0)),
    }
}

/// Lengths that a user would try, and lengths at the boundaries between the cases.
fn random_length(chance: &mut Chance, limits: Limits) -> f64 {
    let boundaries = choose(1.0, limits).unwrap();
    match chance.bits() % 8 {
        0 => boundaries.linear_from_mm,
        1 => boundaries.s_curve_from_mm,
        2 => boundaries.s_curve_from_mm * (1.0 - 1e-12),
        3 => chance.scale(1e-9, 1e-5),
        _ => chance.scale(1e-6, 1e4),
    }
}

fn keeps_its_laws(plan: &Profile, limits: Limits, seed: u64) {
    let (total, length) = (plan.duration_s(), plan.length_mm);
    assert_eq!(plan.position_mm(total), length, "seed {seed}");
    assert_eq!(plan.position_mm(0.0), 0.0, "seed {seed}");
    assert!(plan.time_at(length) == total && plan.time_at(0.0) == 0.0, "seed {seed}: inverse at the ends");
    let mut before = 0.0;
    for part in 0..=12 {
        let t = total * f64::from(part) / 12.0;
        let s = plan.position_mm(t);
        assert!(s >= before && s <= length, "seed {seed}: goes back at {t}");
        before = s;
        let v = plan.speed(t);
        assert!(v >= 0.0 && v <= limits.speed_mm_per_s * (1.0 + ROUNDING), "seed {seed}: speed {v} at {t}");
        let a = plan.acceleration(t).abs();
        assert!(
            a <= limits.acceleration_mm_per_s2 * (1.0 + ROUNDING),
            "seed {seed}: acceleration {a} at {t}"
        );
        let j = plan.jerk(t).abs();
        assert!(
            plan.shape == MotionLaw::Linear || j <= limits.jerk_mm_per_s3 * (1.0 + ROUNDING),
            "seed {seed}: jerk {j} at {t}"
        );
        let back = plan.position_mm(plan.time_at(s));
        assert!((back - s).abs() <= ROUNDING * length, "seed {seed}: inverse at {t}: {back} instead of {s}");
    }
}

#[test]
fn profiles_obey_their_limits_and_end_exactly() {
    for seed in 0..rounds(1_000_000) {
        let mut chance = Chance::new(seed);
        let (limits, shape) = (random_limits(&mut chance), random_shape(&mut chance));
        let length = random_length(&mut chance, limits);
        keeps_its_laws(&plan(shape, length, limits).unwrap(), limits, seed);
    }
}

#[test]
fn move_times_are_bounded_and_monotonic() {
    for seed in 0..rounds(1_000_000) {
        let mut chance = Chance::new(seed);
        let (limits, shape) = (random_limits(&mut chance), random_shape(&mut chance));
        let length = random_length(&mut chance, limits);
        let seconds = |shape, length, limits| plan(shape, length, limits).unwrap().duration_s();
        let total = seconds(shape, length, limits);
        let least = if shape == MotionLaw::Linear {
            (length / limits.speed_mm_per_s).max(2.0 * libm::sqrt(length / limits.acceleration_mm_per_s2))
        } else {
            least_duration_s(length, limits, None).unwrap()
        };
        assert!(total >= least * (1.0 - ROUNDING), "seed {seed}: {total} is faster than possible");
        assert!(seconds(shape, length * 1.001, limits) > total, "seed {seed}: longer but not slower");
        let more = 1.0 + chance.scale(1e-6, 10.0);
        let wider = [
            Limits { speed_mm_per_s: limits.speed_mm_per_s * more, ..limits },
            Limits { acceleration_mm_per_s2: limits.acceleration_mm_per_s2 * more, ..limits },
            Limits { jerk_mm_per_s3: limits.jerk_mm_per_s3 * more, ..limits },
        ];
        for wider in wider {
            let faster = seconds(shape, length, wider);
            assert!(
                faster <= total * (1.0 + 1e-12),
                "seed {seed}: {wider:?} takes {faster}, more than {total}"
            );
        }
        if let MotionLaw::Power(order) = shape {
            let smoother = seconds(MotionLaw::Power(order.max(1e-3) * 0.5 + 1.0), length, limits);
            assert!(order > 1.0 || smoother >= total * (1.0 - 1e-12), "seed {seed}: smoother and faster");
            let s_curve = seconds(MotionLaw::SCurve, length, limits);
            assert!(total >= s_curve * (1.0 - 1e-12), "seed {seed}: faster than the S-curve");
        }
    }
}

#[test]
fn profile_formulas_are_derivatives_of_each_other() {
    let mut tried = 0;
    for seed in 0..rounds(200_000) {
        let mut chance = Chance::new(seed);
        let (limits, shape) = (random_limits(&mut chance), random_shape(&mut chance));
        let plan = plan(shape, random_length(&mut chance, limits), limits).unwrap();
        let phases = plan.phases();
        let chosen = chance.bits() as usize % phases.len();
        let begin: f64 = phases.iter().take(chosen).sum();
        let t = begin + phases[chosen] * chance.between(0.1, 0.9);
        let (h, total) = (1e-3 * phases[chosen], plan.duration_s());
        let blurred = 1e-15 * total / h;
        if blurred > 1e-4 {
            continue;
        }
        tried += 1;
        let room = 1e-5 + 10.0 * blurred;
        let slope = |of: &dyn Fn(f64) -> f64| (of(t + h) - of(t - h)) / (2.0 * h);
        let close = |found: f64, expected: f64, room: f64, what: &str| {
            assert!((found - expected).abs() <= room, "seed {seed}: {what} {found}, its slope {expected}");
        };
        close(plan.speed(t), slope(&|t| plan.position_mm(t)), room * plan.speed_mm_per_s, "speed");
        let a = plan.acceleration_mm_per_s2;
        close(plan.acceleration(t), slope(&|t| plan.speed(t)), room * a, "acceleration");
        let sharp = plan.jerk_mm_per_s3.max(a / total);
        close(plan.jerk(t), slope(&|t| plan.acceleration(t)), 10.0 * room * sharp, "jerk");
    }
    assert!(tried > rounds(50_000), "only {tried} moments");
}

/// A random drill cycle with the height and limits of its plan, if one is possible.
fn random_stroke(chance: &mut Chance) -> Option<(Stroke, f64, Limits)> {
    let limits = random_limits(chance);
    let (height, depth) = (chance.scale(0.05, 50.0), chance.scale(0.05, 20.0));
    let shape = random_shape(chance);
    if chance.bits().is_multiple_of(4) {
        return Some((Stroke::One(plan(shape, height + depth, limits).unwrap()), height, limits));
    }
    let feed = (limits.speed_mm_per_s * chance.scale(1e-3, 1.0)).min(limits.speed_mm_per_s);
    two_speeds(shape, height, depth, feed, limits).ok().map(|stroke| (stroke, height, limits))
}

#[test]
fn strokes_obey_their_limits_and_arrive_at_the_feed() {
    let mut two = 0;
    for seed in 0..rounds(400_000) {
        let mut chance = Chance::new(seed);
        let Some((stroke, height, limits)) = random_stroke(&mut chance) else { continue };
        let (total, length) = (stroke.duration_s(), stroke.length_mm());
        assert!(stroke.position_mm(0.0) == 0.0 && stroke.position_mm(total) == length, "seed {seed}");
        let mut before = 0.0;
        for part in 0..=16 {
            let t = total * f64::from(part) / 16.0;
            let s = stroke.position_mm(t);
            assert!(s >= before - 1e-12 * length && s <= length * (1.0 + 1e-12), "seed {seed}: back at {t}");
            before = s;
            let (v, a) = (stroke.speed(t), stroke.acceleration(t).abs());
            assert!(
                v >= -1e-12 && v <= limits.speed_mm_per_s * (1.0 + ROUNDING),
                "seed {seed}: speed {v} at {t}"
            );
            assert!(
                a <= limits.acceleration_mm_per_s2 * (1.0 + ROUNDING),
                "seed {seed}: acceleration {a} at {t}"
            );
            assert!(
                stroke.jerk(t).abs() <= limits.jerk_mm_per_s3 * (1.0 + ROUNDING),
                "seed {seed}: jerk at {t}"
            );
            let back = stroke.position_mm(stroke.time_at(s));
            assert!((back - s).abs() <= ROUNDING * length, "seed {seed}: inverse at {t}: {back}, not {s}");
        }
        if let Stroke::Two(spans) = &stroke {
            two += 1;
            let t = spans.contact_s;
            let at = |found: f64, expected: f64| (found - expected).abs() <= ROUNDING * length;
            assert!(at(stroke.position_mm(t), height), "seed {seed}: surface at {}", stroke.position_mm(t));
            assert!((stroke.time_at(height) - t).abs() <= ROUNDING * total, "seed {seed}: contact");
            let v = stroke.speed(t);
            assert!(
                (v - spans.feed_mm_per_s).abs() <= ROUNDING * limits.speed_mm_per_s,
                "seed {seed}: {v} at contact"
            );
            assert!(stroke.position_mm(0.5 * (t + total)) > height, "seed {seed}");
        }
    }
    assert!(two > rounds(100_000), "only {two} strokes with two speeds");
}

/// Stopping is the deceleration to rest, planned with the same limits: its distance must match exactly.
#[test]
fn stopping_distance_is_exact_at_any_moment() {
    for seed in 0..rounds(200_000) {
        let mut chance = Chance::new(seed);
        let Limits { acceleration_mm_per_s2: acceleration, jerk_mm_per_s3: jerk, .. } =
            random_limits(&mut chance);
        let limits =
            Limits { speed_mm_per_s: 1e9, acceleration_mm_per_s2: acceleration, jerk_mm_per_s3: jerk };
        let speed = chance.scale(1e-3, 1e3);
        let stop = |v: f64, a: f64| stopping_mm(MotionLaw::SCurve, v, a, limits);
        // A move from rest to rest consists of two stops from its top speed.
        let steady = stop(speed, 0.0);
        let there_and_back = plan(MotionLaw::SCurve, 2.0 * steady, limits).unwrap();
        assert!(
            (there_and_back.speed_mm_per_s - speed).abs() <= 1e-9 * speed,
            "seed {seed}: {there_and_back:?}"
        );
        // Within a stop, the stopping distance is the remaining distance at every moment.
        let half = plan(MotionLaw::SCurve, 2.0 * steady, limits).unwrap();
        let t = half.duration_s() * chance.between(0.5, 1.0);
        let left = 2.0 * steady - half.position_mm(t);
        let found = stop(half.speed(t), half.acceleration(t));
        assert!((found - left).abs() <= 1e-9 * steady, "seed {seed}: {found} instead of {left} at {t}");
        // During acceleration, the stop begins with the decrease of the acceleration to zero.
        let a = (acceleration * chance.between(0.0, 1.0)).min(libm::sqrt(2.0 * jerk * speed));
        let t0 = a / jerk;
        let on = speed * t0 + a * t0 * t0 / 3.0 + stop(speed + 0.5 * a * t0, 0.0);
        assert!((stop(speed, a) - on).abs() <= 1e-12 * on, "seed {seed}");
    }
}

#[test]
fn stop_before_the_point_of_no_return_ends_above_the_gap() {
    for seed in 0..rounds(20_000) {
        let mut chance = Chance::new(seed);
        let Some((stroke, height, limits)) = random_stroke(&mut chance) else { continue };
        let gap = height * chance.between(0.0, 1.0);
        let shape = stroke.shape();
        let last = point_of_no_return_s(&stroke, height, gap, limits).unwrap();
        assert!(last <= stroke.time_at(height), "seed {seed}");
        for part in 0..=16 {
            let t = last * f64::from(part) / 16.0;
            let end =
                stroke.position_mm(t) + stopping_mm(shape, stroke.speed(t), stroke.acceleration(t), limits);
            assert!(end <= height - gap + ROUNDING * height, "seed {seed}: a stop at {t} ends at {end}");
        }
        let t = last + 1e-6 * stroke.duration_s();
        let end = stroke.position_mm(t) + stopping_mm(shape, stroke.speed(t), stroke.acceleration(t), limits);
        let late = t >= stroke.time_at(height) || end >= (height - gap) * (1.0 - ROUNDING);
        assert!(late, "seed {seed}: {last} is too early");
    }
}

#[test]
fn law_choice_has_the_peak_speeds_of_the_profiles() {
    for seed in 0..rounds(300_000) {
        let mut chance = Chance::new(seed);
        let limits = random_limits(&mut chance);
        let length = random_length(&mut chance, limits);
        let found = choose(length, limits).unwrap();
        let linear = plan(MotionLaw::Linear, length, limits).unwrap().speed_mm_per_s;
        let s_curve = plan(MotionLaw::SCurve, length, limits).unwrap().speed_mm_per_s;
        assert!((found.linear_peak_mm_per_s - linear).abs() <= 1e-9 * linear, "seed {seed}");
        assert!(
            (found.s_curve_peak_mm_per_s - s_curve).abs() <= 1e-9 * s_curve,
            "seed {seed}: {found:?} {s_curve}"
        );
        assert!(found.linear_from_mm < found.s_curve_from_mm, "seed {seed}");
        assert!(found.case == 1 || s_curve < linear * (1.0 + 1e-12), "seed {seed}: {found:?}");
    }
}

/// Table of D.1: V 500, A 10⁴, J 10⁶, S 10⁹; in milliseconds, as printed there.
#[test]
fn duration_bounds_match_the_reference_table() {
    let limits = Limits { speed_mm_per_s: 500.0, acceleration_mm_per_s2: 1e4, jerk_mm_per_s3: 1e6 };
    let rows = [
        (0.1, [6.32, 14.74, 16.20, 16.87, 18.57], 0.005),
        (1.0, [20.00, 31.75, 33.14, 36.34, 40.00], 0.005),
        (5.0, [44.72, 55.83, 57.05, 62.17, 68.40], 0.005),
        (50.0, [150.0, 160.0, 161.0, 165.0, 170.0], 0.05),
    ];
    for (length, expected, room) in rows {
        let ms = |shape| plan(shape, length, limits).unwrap().duration_s() * 1e3;
        let anchor = fifteen_phases_s(length, limits, 1e9).unwrap() * 1e3;
        let found = [
            ms(MotionLaw::Linear),
            ms(MotionLaw::SCurve),
            anchor,
            ms(MotionLaw::Power(0.5)),
            ms(MotionLaw::Power(1.0)),
        ];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() <= room, "{length} mm: {found} ms instead of {expected}");
        }
        let least = least_duration_s(length, limits, Some(1e9)).unwrap() * 1e3;
        assert!(least <= anchor, "{length} mm: {least}");
    }
}

#[test]
fn invalid_profile_numbers_are_named() {
    let good = Limits { speed_mm_per_s: 100.0, acceleration_mm_per_s2: 1e3, jerk_mm_per_s3: 1e5 };
    let bad = [f64::NAN, f64::INFINITY, 0.0, -1.0, 1e300, 5e-324];
    for value in bad {
        let code = |shape, length, limits| plan(shape, length, limits).unwrap_err().code;
        let wrong_length = value != 0.0 && value != 5e-324;
        assert_eq!(plan(MotionLaw::SCurve, value, good).is_err(), wrong_length, "{value}");
        let rows = [
            ("motion.bad_speed", Limits { speed_mm_per_s: value, ..good }),
            ("motion.bad_acceleration", Limits { acceleration_mm_per_s2: value, ..good }),
            ("motion.bad_jerk", Limits { jerk_mm_per_s3: value, ..good }),
        ];
        for (expected, limits) in rows {
            assert_eq!(code(MotionLaw::SCurve, 1.0, limits), expected, "{value}");
            assert_eq!(code(MotionLaw::Power(1.0), 0.0, limits), expected, "{value}");
            assert_eq!(choose(1.0, limits).unwrap_err().code, expected, "{value}");
            assert_eq!(
                two_speeds(MotionLaw::SCurve, 1.0, 1.0, 1.0, limits).unwrap_err().code,
                expected,
                "{value}"
            );
            assert_eq!(fifteen_phases_s(1.0, limits, 1e9).unwrap_err().code, expected, "{value}");
        }
        assert!(
            plan(MotionLaw::Linear, 1.0, Limits { jerk_mm_per_s3: value, ..good }).is_ok(),
            "linear has no jerk: {value}"
        );
        assert_eq!(fifteen_phases_s(1.0, good, value).unwrap_err().code, "motion.bad_snap", "{value}");
        assert_eq!(two_speeds(MotionLaw::SCurve, 1.0, 1.0, value, good).unwrap_err().code, "motion.bad_feed");
        if value != 5e-324 {
            assert_eq!(code(MotionLaw::Power(value), 1.0, good), "motion.bad_order", "{value}");
        }
    }
    let stroke = two_speeds(MotionLaw::SCurve, 5.0, 2.0, 10.0, good).unwrap();
    let rows = [
        ("motion.low_start", two_speeds(MotionLaw::SCurve, 0.1, 2.0, 50.0, good).unwrap_err()),
        ("motion.shallow_stroke", two_speeds(MotionLaw::SCurve, 5.0, 0.1, 50.0, good).unwrap_err()),
        ("motion.bad_gap", point_of_no_return_s(&stroke, 5.0, 6.0, good).unwrap_err()),
        ("motion.bad_rise", Ramp::rising(MotionLaw::SCurve, -1.0, good).unwrap_err()),
        ("motion.bad_length", plan(MotionLaw::SCurve, -1.0, good).unwrap_err()),
        ("motion.bad_feed", two_speeds(MotionLaw::SCurve, 1.0, 1.0, 101.0, good).unwrap_err()),
        ("motion.bad_order", plan(MotionLaw::Power(2.1), 1.0, good).unwrap_err()),
    ];
    for (code, diagnostic) in rows {
        assert_eq!(diagnostic.code, code);
        for text in [diagnostic.message("en"), diagnostic.advice("en")] {
            assert!(!text.is_empty() && !text.contains('{') && !text.contains(code), "{text}");
        }
    }
}

#[test]
fn profile_survives_serialization() {
    for shape in [MotionLaw::Linear, MotionLaw::SCurve, MotionLaw::Power(0.5)] {
        let limits = Limits { speed_mm_per_s: 100.0, acceleration_mm_per_s2: 1e3, jerk_mm_per_s3: 1e5 };
        let profile = plan(shape, 20.0, limits).unwrap();
        let bytes = postcard::to_allocvec(&profile).unwrap();
        assert_eq!(postcard::from_bytes::<Profile>(&bytes).unwrap(), profile);
        let stroke = two_speeds(shape, 5.0, 2.0, 10.0, limits).unwrap();
        let bytes = postcard::to_allocvec(&stroke).unwrap();
        assert_eq!(postcard::from_bytes::<Stroke>(&bytes).unwrap(), stroke);
        let text = serde_json::to_string(&stroke).unwrap();
        assert!(!text.contains("null"), "a number that JSON cannot say: {text}");
    }
}

/// Table of D.2: L 10 mm, V 500, A 10⁴, J 10⁶; in micrometres, as printed there.
#[test]
fn residual_vibration_matches_the_reference_table() {
    let limits = Limits { speed_mm_per_s: 500.0, acceleration_mm_per_s2: 1e4, jerk_mm_per_s3: 1e6 };
    let rows = [
        (MotionLaw::Linear, 1e6, [2119.0, 346.0, 28.0, 27.0, 25.0, 23.0], 63.3),
        (MotionLaw::SCurve, 1e6, [1712.0, 120.0, 84.0, 12.0, 7.4, 1.5], 74.0),
        (MotionLaw::Power(0.5), 1e6, [1343.0, 0.0, 90.0, 0.6, 0.0, 0.0], 80.0),
        (MotionLaw::Power(1.0), 1e6, [917.0, 63.0, 65.0, 0.1, 0.6, 2.0], 86.3),
        (MotionLaw::Power(0.5), 1.5e6, [1749.0, 132.0, 108.0, 36.0, 3.8, 0.4], 74.0),
    ];
    for (shape, jerk, expected, ms) in rows {
        let profile = plan(shape, 10.0, Limits { jerk_mm_per_s3: jerk, ..limits }).unwrap();
        assert!((profile.duration_s() * 1e3 - ms).abs() <= 0.06, "{shape:?} {}", profile.duration_s());
        for (frequency, expected) in [20.0, 40.0, 60.0, 90.0, 120.0, 150.0].into_iter().zip(expected) {
            let found = residual_mm(&profile, frequency).unwrap() * 1e3;
            let room = if expected >= 10.0 { 0.5 } else { 0.05 };
            assert!(
                (found - expected).abs() <= room,
                "{shape:?} at {frequency} Hz: {found} µm instead of {expected}"
            );
        }
    }
    assert_eq!(residual_mm(&Profile::default(), 0.0).unwrap_err().code, "motion.bad_frequency");
}

/// Compares the closed form with the integral, summed over every phase.
#[test]
fn residual_vibration_is_the_transform_of_the_acceleration() {
    for seed in 0..rounds(2_000) {
        let mut chance = Chance::new(seed);
        let (limits, shape) = (random_limits(&mut chance), random_shape(&mut chance));
        let profile = plan(shape, random_length(&mut chance, limits), limits).unwrap();
        let frequency = chance.scale(0.05, 5.0) / profile.duration_s();
        let omega = 2.0 * core::f64::consts::PI * frequency;
        let (mut re, mut im, mut begin) = (0.0, 0.0, 0.0);
        for phase in profile.phases() {
            let h = phase / 400.0;
            for index in 0..400 {
                let t = begin + h * (f64::from(index) + 0.5);
                let a = profile.acceleration(t) * h;
                (re, im) = (re + a * libm::cos(omega * t), im + a * libm::sin(omega * t));
            }
            begin += phase;
        }
        let expected = libm::sqrt(re * re + im * im) / omega;
        let found = residual_mm(&profile, frequency).unwrap();
        let room = 1e-4 * expected + 1e-5 * profile.speed_mm_per_s / omega;
        assert!((found - expected).abs() <= room, "seed {seed}: {found} instead of {expected} {profile:?}");
    }
}
