//! Profiles against reference numbers computed elsewhere. They lie beside the repository, not in it.

use annulus_core::motion::profile::plan;
use serde_json::Value;
use std::path::Path;

/// The vectors, or none when they are not there (which fails where CI says so).
fn vectors(name: &str) -> Option<Value> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/reference/vectors").join(name);
    let Ok(text) = std::fs::read_to_string(file) else {
        assert!(std::env::var("CI").as_deref() != Ok("true"), "no reference vectors");
        println!("skipped: no reference vectors");
        return None;
    };
    Some(serde_json::from_str(&text).unwrap())
}

fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("no number {key} in {row}"))
}

fn near(found: f64, expected: f64, room: f64, what: &str) {
    assert!((found - expected).abs() <= room, "{what}: {found} instead of {expected}");
}

#[test]
fn s_curves_agree_with_the_reference() {
    let Some(file) = vectors("trapezoid_scurve.json") else { return };
    let mut samples = 0;
    for case in file["cases"].as_array().unwrap() {
        let id = &case["id"];
        let (length, v, a, j) = (number(case, "L"), number(case, "v"), number(case, "a"), number(case, "J"));
        let expected = &case["scurve"];
        let profile = plan(length, v, a, j).unwrap();
        let total = number(expected, "total_time");
        near(profile.duration_s(), total, 1e-9 * total, &format!("{id} time"));
        near(profile.speed_mm_per_s, number(expected, "v_peak"), 1e-9 * v, &format!("{id} speed"));
        for row in expected["samples_t_s_v_a_j"].as_array().unwrap() {
            let [t, s, v_now, a_now] = [0, 1, 2, 3].map(|column| row[column].as_f64().unwrap());
            near(profile.position_mm(t), s, 1e-9 * length, &format!("{id} place at {t}"));
            near(profile.speed(t), v_now, 1e-9 * v, &format!("{id} speed at {t}"));
            near(profile.acceleration(t), a_now, 1e-8 * a, &format!("{id} acceleration at {t}"));
            near(profile.time_at(s), t, 1e-9 * total, &format!("{id} time at {s} mm"));
            samples += 1;
        }
    }
    assert!(samples > 50, "only {samples} samples");
}

#[test]
fn move_times_agree_with_an_independent_generator() {
    let Some(file) = vectors("oracle_durations.json") else { return };
    let cases = file["cases"].as_array().unwrap();
    assert!(!cases.is_empty());
    for case in cases {
        let profile =
            plan(number(case, "L"), number(case, "V"), number(case, "A"), number(case, "J")).unwrap();
        let expected = number(case, "oracle_duration");
        near(profile.duration_s(), expected, 1e-9 * expected, &case.to_string());
    }
}
