//! Tests that the check can fail: every kind of number in every file is altered in turn.

use super::{MOST_WORK, SCHEMAS, check};
use annulus_core::chance::Chance;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

fn vectors() -> Vec<(String, Value)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/vectors");
    let entries = std::fs::read_dir(folder).unwrap();
    let paths =
        entries.map(|entry| entry.unwrap().path()).filter(|path| path.extension() == Some("json".as_ref()));
    let mut files: Vec<_> = paths
        .map(|path| {
            let text = std::fs::read_to_string(&path).unwrap();
            (path.file_name().unwrap().to_string_lossy().into_owned(), serde_json::from_str(&text).unwrap())
        })
        .filter(|(_, file): &(String, Value)| SCHEMAS.iter().any(|(known, _)| file["schema"] == *known))
        .collect();
    files.sort_by(|one, other| one.0.cmp(&other.0));
    files
}

#[test]
fn every_reference_case_is_within_tolerance() {
    for (name, file) in vectors() {
        let report = check(&name, &file.to_string()).unwrap();
        assert!(report.cases.len() >= 4, "{name}");
        for case in &report.cases {
            assert!(case.is_within() && case.values > 0, "{name}: {case:?}");
        }
    }
}

/// Leaves of a value by kind: the path without indices of lists of lists and objects.
fn leaves(value: &Value, kind: &str, pointer: &str, out: &mut BTreeMap<String, Vec<String>>) {
    match value {
        Value::Object(members) => {
            for (key, value) in members {
                leaves(value, &format!("{kind}/{key}"), &format!("{pointer}/{key}"), out);
            }
        }
        Value::Array(items) => {
            for (index, value) in items.iter().enumerate() {
                let flat = !value.is_array() && !value.is_object();
                let inner = if flat { format!("{kind}/{index}") } else { format!("{kind}/*") };
                leaves(value, &inner, &format!("{pointer}/{index}"), out);
            }
        }
        _ => out.entry(kind.to_owned()).or_default().push(pointer.to_owned()),
    }
}

fn altered(value: &Value) -> Value {
    match value {
        Value::Null => json!(1.5),
        Value::Bool(truth) => json!(!truth),
        Value::String(text) => json!(format!("{text}x")),
        Value::Number(number) => match number.as_i64() {
            Some(whole) => json!(whole + 1),
            None => json!(number.as_f64().map(|value| if value == 0.0 { 0.01 } else { 1.02 * value })),
        },
        other => other.clone(),
    }
}

/// Members other than expected values: names, explanations, tolerances; and inputs, on which a result need
/// not depend (such as a limit that is not reached).
const INPUTS: &[&str] = &[
    "units note oracle tolerance id",
    "L v a J Vm Am Jm V A alpha H D c down up",
    "controller plant stage plain_pid setpoint duration disturbance_V disturbance_window",
    "E EC feedforward cutting_load_V dwell rest",
    "tables table target retarget enter leave n position",
    "moves xy settle latency margin dwell_bottom dwell_top gap A_stop J_stop",
    "pitch params f n_xy n_z",
];

fn is_input(kind: &str) -> bool {
    let inputs = || INPUTS.iter().flat_map(|line| line.split(' '));
    kind.split('/').any(|key| inputs().any(|input| input == key))
}

#[test]
fn altered_reference_numbers_are_detected() {
    for (name, file) in vectors() {
        let mut kinds = BTreeMap::new();
        leaves(&file, "", "", &mut kinds);
        let mut unseen = Vec::new();
        let mut tried = 0;
        for (kind, pointers) in &kinds {
            if is_input(kind) {
                continue;
            }
            for pointer in [0, pointers.len() / 2, pointers.len() - 1].map(|index| &pointers[index]) {
                let mut changed = file.clone();
                let leaf = changed.pointer_mut(pointer).unwrap();
                *leaf = altered(leaf);
                tried += 1;
                if let Ok(report) = check(&name, &changed.to_string())
                    && report.within() == report.cases.len()
                {
                    unseen.push(pointer.clone());
                }
            }
        }
        assert!(tried > 15, "{name}: only {tried}");
        assert!(unseen.is_empty(), "{name}: altered without anybody seeing it:\n{}", unseen.join("\n"));
    }
}

/// A misspelt name of any kind, anywhere, is refused at its position: nothing escapes the comparison.
#[test]
fn misspelt_keys_are_refused() {
    fn keys(value: &Value, out: &mut BTreeMap<String, u32>) {
        for (key, value) in value.as_object().into_iter().flatten() {
            *out.entry(key.clone()).or_default() += 1;
            keys(value, out);
        }
        value.as_array().into_iter().flatten().for_each(|value| keys(value, out));
    }
    fn renamed(value: &mut Value, from: &str, to: &str) {
        if let Some(members) = value.as_object_mut() {
            if let Some(value) = members.remove(from) {
                members.insert(to.to_owned(), value);
            }
            members.values_mut().for_each(|value| renamed(value, from, to));
        }
        value.as_array_mut().into_iter().flatten().for_each(|value| renamed(value, from, to));
    }
    // Names that the file chooses, and explanations.
    let own = "note units oracle id even classic arendt arendt_early custom 500 580";
    for (name, file) in vectors() {
        let mut found = BTreeMap::new();
        keys(&file, &mut found);
        let mut missed = Vec::new();
        let own_here = |key: &str| {
            own.split(' ').any(|word| word == key)
                || ["xy", "z"].iter().any(|list| file[*list].get(key).is_some())
        };
        for key in found.keys().filter(|key| !own_here(key)) {
            let mut changed = file.clone();
            renamed(&mut changed, key, &format!("{key}_"));
            if check(&name, &changed.to_string()).is_ok() {
                missed.push(key.clone());
            }
        }
        assert!(missed.is_empty(), "{name}: misspelt without anybody seeing it: {missed:?}");
    }
    let text = "{\"schema\": \"power11/1\", \"cases\": [{\"L\": 8, \"Vm\": 60, \"Am\": 1e4, \"Jm\": 1e6,
        \"alpha\": 0.5, \"case\": \"VA\",
        \"total_tim\": 7}]}";
    let why = check("f", text).unwrap_err();
    assert_eq!(why.code, "lab.unknown_key");
    assert_eq!(why.place.as_ref().map(|place| place.line), Some(3));
    assert!(why.message("en").contains("cases[0].total_tim"), "{}", why.message("en"));
}

#[test]
fn hostile_files_are_refused_with_line_and_file() {
    let one = |cases: &str| format!(r#"{{"schema": "power11/1", "cases": [{cases}]}}"#);
    let case = r#"{"L": 8, "Vm": 60, "Am": 1e4, "Jm": 1e6, "alpha": 0.5, "total_time": 0.1523069992943436}"#;
    let loop_file = |duration: &str, step: &str| {
        format!(
            r#"{{"schema": "fuzzy-pid/1", "steps": [{{"controller": {{"Kp0": 1, "Ki0": 1, "Kd0": 0, "u_max": 10,
            "Ts": {step}}}, "plain_pid": true, "stage": "xy", "setpoint": 1, "duration": {duration},
            "disturbance_V": 0, "disturbance_window": [0, null], "plant": {{"K": 60, "tau": 0.006}},
            "metrics": {{"overshoot_pct": 0}}}}]}}"#
        )
    };
    let rows: [(String, &str, u32); 19] = [
        (String::new(), "lab.not_json", 1),
        ("{".into(), "lab.not_json", 1),
        ("[1, 2]".into(), "lab.not_a", 1),
        ("{}".into(), "lab.missing", 1),
        (r#"{"schema": 7}"#.into(), "lab.not_a", 1),
        ("{\n\"schema\": \"power12/1\"}".into(), "lab.schema", 2),
        (one(""), "lab.nothing_expected", 1),
        (one(r#"{"L": 8}"#), "lab.missing", 1),
        (one("\n\"x\""), "lab.not_a", 2),
        (one(&case.replace("8,", "-8,")), "motion.bad_length", 1),
        (one(&case.replace("0.5", "7")), "motion.bad_order", 1),
        (one(&case.replace("1e4", "\"fast\"")), "lab.not_a", 1),
        (one(&case.replace("1e4", "1e999")), "lab.not_json", 1),
        (one(&case.replace("60", "0")), "motion.bad_speed", 1),
        (one(&case.replace("total_time", "total_tim")), "lab.nothing_expected", 1),
        (one(&case.replace("\"L\"", "\"samples_t_s_v_a_j\": [[1]], \"L\"")), "lab.not_a", 1),
        (
            one(case).replace("\"cases\"", "\n\"tolerance\": {\"time_rel\": 1e9}, \"cases\""),
            "lab.bad_tolerance",
            2,
        ),
        (loop_file("1e12", "0.0005"), "lab.too_much_work", 1),
        (loop_file("1", "1e-300"), "servo.bad_parameter", 1),
    ];
    for (text, code, line) in rows {
        let why = check("f", &text).unwrap_err();
        let place = why.place.clone().unwrap_or_else(|| panic!("no place: {why:?}"));
        assert_eq!((why.code.as_str(), place.file.as_str(), place.line), (code, "f", line), "{text}");
        for sentence in [why.message("en"), why.advice("en")] {
            assert!(!sentence.contains('{') && sentence.len() > 15, "{sentence}");
        }
    }
    assert!(check("f", &one(case)).is_ok());
    // Several runs of samples, each allowed, that together exceed the budget.
    let run = loop_file("400", "0.0005");
    let (start, end) = (run.find("[{").unwrap() + 1, run.rfind("]}").unwrap());
    let many = vec![&run[start..end]; MOST_WORK as usize / 800_000 + 1].join(",");
    let text = format!("{}{many}{}", &run[..start], &run[end..]);
    assert_eq!(check("f", &text).unwrap_err().code, "lab.too_much_work");
}

#[test]
fn truncation_and_random_bytes_do_not_panic() {
    let mut chance = Chance::new(5);
    for (name, file) in vectors() {
        let mut text = file.to_string().into_bytes();
        text.truncate(60_000);
        for _ in 0..60 {
            let mut bytes = text.clone();
            for _ in 0..3 {
                let at = chance.below(bytes.len());
                bytes[at] = b"0123456789-.eE,:[]{}\"ntfx "[chance.below(26)];
            }
            if chance.below(4) == 0 {
                bytes.truncate(chance.below(bytes.len()));
            }
            let _ = check(&name, &String::from_utf8_lossy(&bytes));
        }
        let _ = check(&name, &file.to_string());
    }
}
