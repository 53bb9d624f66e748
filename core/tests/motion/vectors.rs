//! Tests of profiles against reference numbers computed elsewhere, in `tests/data/vectors`.

use crate::reference::vectors;
use annulus_core::motion::profile::{
    Limits, MotionLaw, Profile, Stroke, choose, plan, point_of_no_return_s, two_speeds,
};
use serde_json::Value;

pub(crate) fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("no number {key} in {row}"))
}

fn numbers(row: &Value) -> Vec<f64> {
    row.as_array().unwrap().iter().map(|value| value.as_f64().unwrap_or(0.0)).collect()
}

pub(crate) fn near(found: f64, expected: f64, room: f64, what: &str) {
    assert!((found - expected).abs() <= room, "{what}: {found} instead of {expected}");
}

pub(crate) fn limits(row: &Value, [speed, acceleration, jerk]: [&str; 3]) -> Limits {
    let one = |key: &str| row[key].as_f64().unwrap_or(f64::NAN);
    Limits {
        speed_mm_per_s: one(speed),
        acceleration_mm_per_s2: one(acceleration),
        jerk_mm_per_s3: one(jerk),
    }
}

/// Compares one profile with all its expected values. Returns the number of samples.
fn agrees(profile: &Profile, limits: Limits, expected: &Value, tolerance: &Value, id: &str) -> usize {
    let room = |key: &str, by: f64| number(tolerance, key) * by;
    let total = number(expected, "total_time");
    near(profile.duration_s(), total, room("time_rel", total), &format!("{id} time"));
    assert_eq!(profile.case.name(), expected["case"].as_str().unwrap(), "{id} case");
    let [v, a, s] = [
        room("v_rel_vlimit", limits.speed_mm_per_s),
        room("a_rel_alimit", limits.acceleration_mm_per_s2),
        room("s_rel_L", profile.length_mm),
    ];
    near(profile.speed_mm_per_s, number(expected, "v_peak"), v, &format!("{id} greatest speed"));
    near(
        profile.acceleration_mm_per_s2,
        number(expected, "a_peak"),
        a,
        &format!("{id} greatest acceleration"),
    );
    let phases = numbers(&expected["phases"]);
    assert_eq!(profile.phases().len(), phases.len(), "{id} phases");
    for (index, (found, phase)) in profile.phases().into_iter().zip(phases).enumerate() {
        near(found, phase, room("time_rel", total), &format!("{id} phase {}", index + 1));
    }
    let samples = expected["samples_t_s_v_a_j"].as_array().unwrap();
    for row in samples {
        let now = numbers(row);
        let t = now[0];
        near(profile.position_mm(t), now[1], s, &format!("{id} place at {t}"));
        near(profile.speed(t), now[2], v, &format!("{id} speed at {t}"));
        near(profile.acceleration(t), now[3], a, &format!("{id} acceleration at {t}"));
        near(profile.time_at(now[1]), t, room("time_rel", total), &format!("{id} time at {} mm", now[1]));
        if !row[4].is_null() {
            near(
                profile.jerk(t),
                now[4],
                room("j_rel_jlimit", limits.jerk_mm_per_s3),
                &format!("{id} jerk at {t}"),
            );
        }
    }
    for row in expected["boundaries_t_s_v"].as_array().unwrap() {
        let now = numbers(row);
        near(profile.position_mm(now[0]), now[1], s, &format!("{id} place at the boundary {}", now[0]));
        near(profile.speed(now[0]), now[2], v, &format!("{id} speed at the boundary {}", now[0]));
    }
    samples.len()
}

#[test]
fn linear_and_s_curves_match_the_reference() {
    let file = vectors("trapezoid_scurve.json");
    let mut samples = 0;
    for case in file["cases"].as_array().unwrap() {
        let limits = limits(case, ["v", "a", "J"]);
        for (shape, key) in [(MotionLaw::SCurve, "scurve"), (MotionLaw::Linear, "trapezoid")] {
            let profile = plan(shape, number(case, "L"), limits).unwrap();
            let id = format!("{} {key}", case["id"]);
            samples += agrees(&profile, limits, &case[key], &file["tolerance"], &id);
        }
    }
    assert!(samples > 150, "only {samples} samples");
}

#[test]
fn power_laws_match_the_reference() {
    let file = vectors("power11.json");
    let mut samples = 0;
    for case in file["cases"].as_array().unwrap() {
        let (limits, length) = (limits(case, ["Vm", "Am", "Jm"]), number(case, "L"));
        let profile = plan(MotionLaw::Power(number(case, "alpha")), length, limits).unwrap();
        let id = case["id"].to_string();
        samples += agrees(&profile, limits, case, &file["tolerance"], &id);
        let room = number(&file["tolerance"], "time_rel") * number(case, "total_time");
        near(0.5 * profile.jerk_time_s, number(case, "Tf"), room, &format!("{id} Tf"));
        near(profile.time_at(0.5 * length), number(case, "time_at_half"), room, &format!("{id} half"));
        let at_three_quarters = number(case, "time_at_three_quarters");
        near(profile.time_at(0.75 * length), at_three_quarters, room, &format!("{id} three quarters"));
        let s_curve = plan(MotionLaw::SCurve, length, limits).unwrap().duration_s();
        near(s_curve, number(case, "scurve_total_time"), room, &format!("{id} S-curve"));
    }
    assert!(samples > 150, "only {samples} samples");
}

#[test]
fn law_choice_matches_the_reference() {
    let file = vectors("trapezoid_scurve.json");
    let law = |shape: MotionLaw| if shape == MotionLaw::SCurve { "S" } else { "T" };
    let profiles = file["cases"].as_array().unwrap().iter().map(|case| (case, &case["selection"]));
    let rows: Vec<_> =
        profiles.chain(file["selection_cases"].as_array().unwrap().iter().map(|case| (case, case))).collect();
    assert!(rows.len() >= 40, "only {} rows", rows.len());
    for (case, expected) in rows {
        let (limits, length) = (limits(case, ["v", "a", "J"]), number(case, "L"));
        let found = choose(length, limits).unwrap();
        let (l_t, l_s) = (number(expected, "L_T"), number(expected, "L_S"));
        near(found.linear_from_mm, l_t, 1e-9 * l_t, &format!("L_T of {case}"));
        near(found.s_curve_from_mm, l_s, 1e-9 * l_s, &format!("L_S of {case}"));
        assert_eq!(u64::from(found.case), expected["case"], "case of {case}");
        assert_eq!(law(found.choice), expected["choice"], "choice of {case}");
        assert_eq!(law(found.choice_strict), expected["choice_strict"], "strict choice of {case}");
        assert_eq!(found.reaches_acceleration, expected["a_reached"], "acceleration of {case}");
        if expected.get("v_peak_s").is_some() {
            near(
                found.linear_peak_mm_per_s,
                number(expected, "v_peak_linear"),
                1e-9 * limits.speed_mm_per_s,
                "linear peak",
            );
            near(
                found.s_curve_peak_mm_per_s,
                number(expected, "v_peak_s"),
                1e-9 * limits.speed_mm_per_s,
                "S-curve peak",
            );
            for (shape, key) in [(MotionLaw::Linear, "t_linear"), (MotionLaw::SCurve, "t_s")] {
                let time = number(expected, key);
                near(plan(shape, length, limits).unwrap().duration_s(), time, 1e-9 * time, key);
            }
        }
    }
}

#[test]
fn move_times_match_an_independent_generator() {
    let file = vectors("oracle_durations.json");
    let cases = file["cases"].as_array().unwrap();
    assert!(!cases.is_empty());
    for case in cases {
        let limits = limits(case, ["V", "A", "J"]);
        let rows = [
            (MotionLaw::SCurve, "oracle_duration"),
            (MotionLaw::SCurve, "scurve_duration"),
            (MotionLaw::Linear, "linear_duration"),
            (MotionLaw::Power(number(case, "alpha")), "power11_duration"),
            (MotionLaw::Power(number(case, "alpha")), "oracle_duration_at_J_over_1_plus_alpha"),
        ];
        for (shape, key) in rows {
            let found = plan(shape, number(case, "L"), limits).unwrap().duration_s();
            let expected = number(case, key);
            near(
                found,
                expected,
                number(&file["tolerance"], "duration_rel") * expected,
                &format!("{key} {case}"),
            );
        }
    }
}

/// The downward move of a row of the throughput file: `["s", V, A, J]` or `["2", V, A, J, feed]`.
fn down(row: &Value, height: f64, depth: f64) -> Stroke {
    let given = numbers(row);
    let limits =
        Limits { speed_mm_per_s: given[1], acceleration_mm_per_s2: given[2], jerk_mm_per_s3: given[3] };
    if row[0] == "2" {
        return two_speeds(MotionLaw::SCurve, height, depth, given[4], limits).unwrap();
    }
    Stroke::One(plan(MotionLaw::SCurve, height + depth, limits).unwrap())
}

#[test]
fn stroke_and_rapid_times_match_the_reference() {
    let file = vectors("throughput.json");
    let rel = number(&file["tolerance"], "rel");
    for (name, class) in file["z"].as_object().unwrap() {
        let (height, depth, clear) = (number(class, "H"), number(class, "D"), number(class, "c"));
        let stroke = down(&class["down"], height, depth);
        let up = numbers(&class["up"]);
        let up_limits =
            Limits { speed_mm_per_s: up[0], acceleration_mm_per_s2: up[1], jerk_mm_per_s3: up[2] };
        let up = plan(MotionLaw::SCurve, height + depth, up_limits).unwrap();
        let (t_z, t_leave) = (stroke.time_at(height), up.time_at(depth + clear));
        let rows = [
            ("t_z", t_z),
            ("T_dn", stroke.duration_s()),
            ("T_up", up.duration_s()),
            ("t_leave", t_leave),
            ("t_air", up.duration_s() - t_leave + t_z),
            ("t_board", stroke.duration_s() - t_z + t_leave),
        ];
        for (key, found) in rows {
            let expected = number(&class["times"], key);
            near(found, expected, rel * expected, &format!("{key} of {name}"));
        }
    }
    for row in file["rows"].as_array().unwrap() {
        let axis = limits(&file["xy"][row["xy"].as_str().unwrap()], ["V", "A", "J"]);
        let t_xy = plan(MotionLaw::SCurve, number(row, "pitch"), axis).unwrap().duration_s();
        near(t_xy, number(row, "t_xy"), rel * t_xy, &format!("hop of {row}"));
        let times = &file["z"][row["z"].as_str().unwrap()]["times"];
        let (air, board) = (number(times, "t_air"), number(times, "t_board"));
        let cycle = air.max(t_xy + number(&file, "settle")) + board;
        near(cycle, number(row, "cycle"), rel * cycle, &format!("cycle of {row}"));
    }
    let params = &file["hobby"]["params"];
    let linear = |length: f64, given: Vec<f64>| {
        let limits =
            Limits { speed_mm_per_s: given[0], acceleration_mm_per_s2: given[1], jerk_mm_per_s3: f64::NAN };
        plan(MotionLaw::Linear, length, limits).unwrap().duration_s()
    };
    let (height, depth) = (number(params, "H"), number(params, "D"));
    let z = numbers(&params["z"]);
    let t_z = linear(height, z.clone())
        + linear(depth, vec![number(params, "feed"), z[1]])
        + linear(height + depth, z);
    for row in file["hobby"]["rows"].as_array().unwrap() {
        near(t_z, number(row, "t_z"), rel * t_z, "hobby Z");
        let t_xy = linear(number(row, "pitch"), numbers(&params["xy"]));
        near(t_xy, number(row, "t_xy"), rel * t_xy, "hobby hop");
    }
}

#[test]
fn point_of_no_return_matches_the_reference() {
    let file = vectors("xyz_timeline.json");
    let mut spindles = 0;
    for z in file["cases"].as_array().unwrap().iter().flat_map(|case| case["z"].as_array().unwrap()) {
        let limits = limits(&z["down"], ["Vm", "Am", "Jm"]);
        let height = number(z, "H");
        let shape = MotionLaw::Power(number(&z["down"], "alpha"));
        let profile = plan(shape, height + number(z, "D"), limits).unwrap();
        let abort = &z["derived"]["abort"];
        let stop = Limits {
            acceleration_mm_per_s2: number(abort, "A_stop"),
            jerk_mm_per_s3: number(abort, "J_stop"),
            ..limits
        };
        let found = point_of_no_return_s(&Stroke::One(profile), height, number(abort, "gap"), stop).unwrap();
        near(found, number(abort, "t_pnr"), 1e-9, &format!("point of no return of {z}"));
        near(profile.time_at(height) - found, number(abort, "safe_margin"), 1e-9, "safe margin");
        spindles += 1;
    }
    assert!(spindles >= 4, "only {spindles} spindles");
}
