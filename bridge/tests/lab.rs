//! Tests of `annulus lab` as a real process: exit codes, one JSON object, refusals, output for reports.

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn annulus(home: &Path, arguments: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.args(arguments.split_whitespace()).current_dir(home).env("ANNULUS_HOME", home.join("home"));
    command.output().unwrap()
}

/// The JSON object on standard output, and the exit code.
fn object(home: &Path, arguments: &str) -> (Value, i32) {
    let output = annulus(home, &format!("{arguments} --json"));
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text.lines().count(), 1, "{arguments}: {text}");
    (serde_json::from_str(&text).unwrap(), output.status.code().unwrap())
}

fn text(home: &Path, arguments: &str) -> String {
    let output = annulus(home, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments}: {output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Two cases of the power law; the second has a variable duration.
fn cases(duration: &str) -> String {
    format!(
        r#"{{"schema": "power11/1", "tolerance": {{"time_rel": 1e-9}}, "cases": [
        {{"id": "long", "L": 8, "Vm": 60, "Am": 1e4, "Jm": 1e6, "alpha": 0.5, "total_time": 0.1523069992943436}},
        {{"id": "other", "L": 8, "Vm": 150, "Am": 1e4, "Jm": 2e6, "alpha": 0.5, "total_time": {duration}}}]}}"#
    )
}

#[test]
#[allow(clippy::too_many_lines, reason = "a table of files and answers")]
fn check_passes_fails_and_refuses_files() {
    let home = tempfile::tempdir().unwrap();
    let home = home.path();
    fs::write(home.join("good.json"), cases("0.07583333333333334")).unwrap();
    fs::write(home.join("off.json"), cases("0.07583333433333334")).unwrap();
    fs::write(home.join("cut.json"), &cases("1")[..90]).unwrap();
    fs::write(home.join("bytes.json"), b"{\n\"schema\": \"\xff\"}").unwrap();

    let table = r#"{"period": [7, 4, 2, 1], "enter": [0, 0, 0], "leave": [3, 3, 3]}"#;
    fs::write(home.join("hunts.json"), table).unwrap();
    fs::write(home.join("short.json"), table.replace("[0, 0, 0]", "[0, 0]")).unwrap();

    let (good, exit) = object(home, "lab check good.json good.json");
    assert_eq!((exit, &good["ok"], &good["cases"], &good["within"]), (0, &true.into(), &4.into(), &4.into()));
    assert_eq!(good["files"][0]["results"][1]["id"], "other");
    assert!(good["files"][1]["results"][0]["worst_ratio"].as_f64().unwrap() < 0.01);
    assert!(text(home, "lab check good.json").ends_with("2 of 2 within tolerance\n"));

    let (off, exit) = object(home, "lab check good.json off.json");
    assert_eq!((exit, &off["ok"], &off["cases"], &off["within"]), (1, &false.into(), &4.into(), &3.into()));
    let case = &off["files"][1]["results"][1];
    assert_eq!(case["within"], false);
    assert_eq!(case["worst"]["what"], "cases[1].total_time");
    let ratio = case["worst_ratio"].as_f64().unwrap();
    assert!((10.0..20.0).contains(&ratio), "1e-9 s beside a tolerance of 7.6e-11 s: {ratio}");
    assert_eq!(off["error"]["code"], "lab.outside");
    let said = annulus(home, "lab check off.json");
    assert_eq!(said.status.code(), Some(1));
    let said = String::from_utf8(said.stdout).unwrap();
    assert!(said.contains("! other") && said.contains("1 of 2 within tolerance"), "{said}");

    for (arguments, code, exit, line) in [
        ("lab check missing.json", "files.missing", 3, None),
        ("lab check good.json cut.json", "lab.not_json", 1, Some(2)),
        ("lab check bytes.json", "lab.not_json", 1, Some(2)),
        ("lab check .", "files.unreadable", 3, None),
        ("lab check", "cli.usage", 2, None),
        ("lab profile --length-mm -1", "motion.bad_length", 1, None),
        ("lab profile --speed 0", "motion.bad_speed", 1, None),
        ("lab profile --jerk NaN", "motion.bad_jerk", 1, None),
        ("lab profile --shape power --order 3", "motion.bad_order", 1, None),
        ("lab profile --shape round", "cli.usage", 2, None),
        ("lab profile --machine nobody", "machine.no_such", 3, None),
        ("lab profile -o plot.bmp", "lab.ending", 2, None),
        ("lab automaton --interrupt-hz 0", "lab.bad_frequency", 1, None),
        ("lab automaton --retarget 0:4", "lab.bad_retarget", 2, None),
        ("lab automaton --retarget 5", "lab.bad_retarget", 2, None),
        ("lab automaton --target 900000000", "lab.long_move", 1, None),
        ("lab automaton --table nowhere.json", "files.missing", 3, None),
        ("lab automaton --table hunts.json", "automaton.hunts", 1, None),
        ("lab automaton --table short.json", "lab.wrong_length", 1, Some(1)),
        ("lab profile -o no/such/folder/plot.svg", "lab.not_written", 3, None),
        ("lab cycle --hop 3", "lab.bad_hop", 2, None),
        ("lab cycle --hop 3,NaN", "lab.bad_hop", 2, None),
        ("lab cycle --clear-mm 3", "lab.bad_clear", 1, None),
        ("lab cycle --settle-ms NaN", "motion.bad_time", 1, None),
        ("lab cycle --feed 300", "motion.bad_feed", 1, None),
        ("lab cycle --machine six --up-speed 0", "machine.setting_range", 1, None),
        ("lab cycle --machine six --order 0 --xy-jerk NaN", "machine.setting_range", 1, None),
        ("lab cycle --spindles 7", "cli.usage", 2, None),
        ("lab servo --sample 0", "servo.bad_parameter", 1, None),
        ("lab servo --plant-tau -1", "servo.bad_parameter", 1, None),
        ("lab servo --kp -1", "servo.bad_parameter", 1, None),
        ("lab servo --sample -1", "servo.bad_parameter", 1, None),
        ("lab servo --stroke --down-speed -1", "motion.bad_speed", 1, None),
        ("lab profile --speed -1", "motion.bad_speed", 1, None),
        ("lab profile --jerk -1e3", "motion.bad_jerk", 1, None),
        ("lab profile --shape power --order -1", "motion.bad_order", 1, None),
        ("lab automaton --interrupt-hz -5", "lab.bad_frequency", 1, None),
        ("lab cycle --margin-ms -1", "motion.bad_time", 1, None),
        ("lab cycle --clear-mm -1", "lab.bad_clear", 1, None),
        ("lab cycle --machine six --settle-ms -1", "machine.setting_range", 1, None),
        ("lab servo --duration 1e9", "servo.too_long", 1, None),
        ("lab servo --stroke --height-mm NaN", "motion.bad_length", 1, None),
    ] {
        let (found, status) = object(home, arguments);
        assert_eq!((found["error"]["code"].as_str(), status), (Some(code), exit), "{arguments}: {found}");
        assert_eq!(found["ok"], false);
        assert_eq!(found["error"]["place"]["line"].as_u64(), line, "{arguments}: {found}");
    }
}

#[test]
fn profile_times_match_the_reference() {
    let home = tempfile::tempdir().unwrap();
    let (found, exit) = object(home.path(), "lab profile --length-mm 5 --samples 11");
    assert_eq!(exit, 0);
    // Part D.1 of the reference: linear, S-curve, power law with order one half.
    for (index, (shape, case, ms)) in
        [("linear", "triangle", 44.72), ("s", "-A", 55.83), ("power", "-A", 62.17)].into_iter().enumerate()
    {
        let profile = &found["profiles"][index];
        assert_eq!((profile["shape"].as_str(), profile["case"].as_str()), (Some(shape), Some(case)));
        assert!((1e3 * profile["duration_s"].as_f64().unwrap() - ms).abs() < 0.01, "{profile}");
    }
    assert_eq!(found["choice"], "linear");
    let columns = found["columns"].as_array().unwrap();
    let last = found["samples"].as_array().unwrap().last().unwrap();
    assert_eq!((columns.len(), last.as_array().unwrap().len()), (13, 13));
    assert_eq!(found["samples"].as_array().unwrap().len(), 11);
    assert_eq!((&columns[1], &last[1]), (&"linear_s_mm".into(), &5.0.into()));
    // A machine provides limits; an explicit limit overrides them.
    let (machine, _) = object(home.path(), "lab profile --machine lab --speed 7 --shape auto");
    assert_eq!(machine["limits"]["speed_mm_per_s"], 7.0);
    assert_eq!(machine["profiles"].as_array().unwrap().len(), 1);
}

#[test]
fn automaton_steps_match_the_reference() {
    let home = tempfile::tempdir().unwrap();
    let (found, exit) = object(home.path(), "lab automaton --target 10 --retarget 12:25");
    assert_eq!((exit, &found["total_interrupts"], &found["final_position"]), (0, &46.into(), &25.into()));
    let first = &found["samples"][0];
    assert_eq!(
        (first[0].as_f64(), first[1].as_f64(), first[2].as_f64()),
        (Some(7.0), Some(0.014), Some(1.0))
    );
    // Part A.5: 100 steps need 121 interrupts, 0.2086 s at 580 Hz; the machine of the paper has the same
    // table.
    let (found, _) = object(home.path(), "lab automaton --target -100 --interrupt-hz 580");
    assert_eq!((&found["total_interrupts"], &found["final_position"]), (&121.into(), &(-100).into()));
    assert!((found["duration_s"].as_f64().unwrap() - 0.2086).abs() < 5e-5);
    let (lab, _) = object(home.path(), "lab automaton --machine lab");
    assert_eq!((&lab["total_interrupts"], &lab["duration_s"]), (&121.into(), &0.242.into()));
    let early = r#"{"period": [7, 4, 2, 1], "enter": [0, 1, 2], "leave": [1, 2, 4]}"#;
    fs::write(home.path().join("early.json"), early).unwrap();
    let (early, _) = object(home.path(), "lab automaton --table early.json --target 12");
    assert_eq!(early["total_interrupts"], 27);
}

#[test]
fn cycle_events_match_the_reference() {
    let home = tempfile::tempdir().unwrap();
    let (found, exit) = object(home.path(), "lab cycle");
    assert_eq!(exit, 0);
    // Part C2.4 of the reference, ms.
    let near =
        |value: &Value, ms: f64| assert!((1e3 * value.as_f64().unwrap() - ms).abs() < 6e-4, "{value} {ms}");
    let first = &found["events"][0];
    near(&first["ready_s"], 79.031);
    for (key, ms) in [
        ("trigger_s", 50.581),
        ("start_s", 50.781),
        ("contact_s", 82.031),
        ("bottom_s", 106.615),
        ("up_start_s", 108.615),
        ("clear_s", 126.381),
        ("top_s", 145.630),
    ] {
        near(&first["spindles"][0][key], ms);
    }
    near(&found["events"][1]["cycle_s"], 95.956);
    near(&found["events"][2]["cycle_s"], 95.849);
    assert!(found["holes_per_min"].as_f64() > found["holes_per_min_sequential"].as_f64());
    let (machine, exit) = object(home.path(), "lab cycle --machine six --hop 2.54,0 --hop -2.54,0");
    assert_eq!((exit, machine["events"][0]["spindles"].as_array().unwrap().len()), (0, 6), "{machine}");
    let (slower, _) =
        object(home.path(), "lab cycle --machine six --hop 2.54,0 --hop -2.54,0 --settle-ms 50");
    assert!(slower["total_s"].as_f64() > machine["total_s"].as_f64(), "{slower}");
}

#[test]
fn cycle_without_overlap_equals_the_simulation() {
    let home = tempfile::tempdir().unwrap();
    let home = home.path();
    fs::write(home.join("apart.toml"), "schema = 1\n[overlap]\non = \"no\"\n").unwrap();
    fs::write(home.join("two.drl"), "M48\nMETRIC\nT1C0.8\n%\nT1\nX10.0Y0.0\nX15.0Y0.0\nX17.54Y2.54\nM30\n")
        .unwrap();
    for machine in ["lab", "./apart.toml"] {
        // The work zero of a board is its corner: the first hole is there. A drill of 0.8 mm goes deeper by
        // the height of its point: 0.4 mm / tan 65°.
        let hops = "--hop 0,0 --hop 5,0 --hop 2.54,2.54 --depth-mm 2.286523";
        let (found, exit) = object(home, &format!("lab cycle --machine {machine} {hops}"));
        assert_eq!(
            (exit, &found["overlap"], found["events"].as_array().unwrap().len()),
            (0, &false.into(), 3)
        );
        assert_eq!(found["holes_per_min"], found["holes_per_min_sequential"]);
        assert_eq!(found["spindle"]["last_stop_s"], Value::Null, "the table rests before the tip goes down");
        let (whole, _) = object(home, &format!("simulate two.drl --order file --machine {machine}"));
        let rate = |object: &Value| object["holes_per_min"].as_f64().unwrap();
        assert!((rate(&found) / rate(&whole) - 1.0).abs() < 1e-6, "{} {}", found["holes_per_min"], whole);
        let said = text(home, &format!("lab cycle --machine {machine} {hops}"));
        assert!(said.contains("without overlap") && !said.contains("with overlap"), "{said}");
    }
}

#[test]
fn cycle_reports_the_last_stop_and_holes_of_all_spindles() {
    let home = tempfile::tempdir().unwrap();
    let home = home.path();
    for (machine, spindles) in [("virtual", 1.0), ("six", 6.0)] {
        let (found, _) = object(home, &format!("lab cycle --machine {machine} --hop 2.54,0 --hop 5,0"));
        let (one, all) = (&found["holes_per_min"], &found["holes_per_min_all_spindles"]);
        assert!((one.as_f64().unwrap() * spindles - all.as_f64().unwrap()).abs() < 1e-9, "{found}");
        assert_eq!(one.as_f64().unwrap(), 120.0 / found["total_s"].as_f64().unwrap());
        let z = &found["events"][1]["spindles"][0];
        let [start, last, contact] =
            ["start_s", "last_stop_s", "contact_s"].map(|key| z[key].as_f64().unwrap());
        assert!(start < last && last < contact, "{z}");
        assert!((last - start - found["spindle"]["last_stop_s"].as_f64().unwrap()).abs() < 1e-12);
    }
    let said = text(home, "lab cycle --machine six");
    assert!(said.contains("last stop over the board") && said.contains("all spindles"), "{said}");
    assert!(text(home, "lab cycle --svg").contains(">last stop over the board<"));
}

#[test]
fn profile_text_names_the_jerk_limit() {
    let home = tempfile::tempdir().unwrap();
    let said = text(home.path(), "lab profile");
    // The linear law has no jerk limit, and is faster.
    assert!(said.contains("shortest possible time at this jerk"), "{said}");
}

#[test]
fn servo_metrics_match_the_reference() {
    let home = tempfile::tempdir().unwrap();
    let (found, _) = object(home.path(), "lab servo");
    // Part B2.4 of the reference: overshoot in % and settling in ms.
    for (index, (name, over, settling)) in
        [("fuzzy", 0.69, 27.5), ("plain", 12.9, 160.0), ("retuned", 2.71, 35.0)].into_iter().enumerate()
    {
        let row = &found["controllers"][index];
        assert_eq!(row["controller"], name);
        assert!((row["metrics"]["overshoot_pct"].as_f64().unwrap() - over).abs() < 0.05, "{row}");
        assert!((1e3 * row["metrics"]["settling_s"].as_f64().unwrap() - settling).abs() < 1e-6, "{row}");
    }
    let (load, _) = object(
        home.path(),
        "lab servo --step-mm 0 --stage cut --load -0.3 --load-from 0.05 --load-to 0.2 --duration 0.35",
    );
    let most = load["controllers"][0]["metrics"]["max_deviation_mm"].as_f64().unwrap();
    assert!((most - 0.135).abs() < 0.001, "{most}");
    let (stroke, _) = object(home.path(), "lab servo --stroke --feed-forward");
    let metrics = &stroke["controllers"][0]["metrics"];
    assert!((metrics["depth_error_mm"].as_f64().unwrap() - 0.064).abs() < 0.001, "{metrics}");
}

#[test]
fn plots_and_tables_are_written_in_the_requested_format() {
    let home = tempfile::tempdir().unwrap();
    let home = home.path();
    for (command, words) in [
        ("lab profile", &["speed / mm/s", "jerk / mm/s³", "power law α = 0.5", "time / ms"][..]),
        ("lab automaton", &["position / steps", "state", "rate / 1/s"]),
        ("lab servo", &["control / V", "staged fuzzy PID", "position / mm"]),
        ("lab servo --stroke", &["contact", "surface", "return"]),
    ] {
        let plot = text(home, &format!("{command} --svg"));
        assert!(plot.starts_with("<svg ") && plot.ends_with("</svg>\n"));
        for word in words {
            assert!(plot.contains(word), "{command}: no {word}");
        }
        let table = text(home, &format!("{command} --csv"));
        let wide = table.lines().next().unwrap().split(',').count();
        assert!(wide >= 4 && table.contains("t_s,") && table.lines().count() > 100, "{command}");
        assert!(table.lines().all(|line| line.split(',').count() == wide), "{command}");
        for (ending, start) in [("svg", "<svg "), ("csv", &table[..12]), ("json", "{")] {
            let file = format!("out.{ending}");
            let (found, exit) = object(home, &format!("{command} -o {file}"));
            assert_eq!((exit, &found["file"]), (0, &Value::from(file.clone())));
            let written = fs::read_to_string(home.join(&file)).unwrap();
            assert!(written.starts_with(start), "{command} {ending}");
        }
        assert!(text(home, command).lines().count() >= 3, "{command}");
        assert_eq!(text(home, &format!("{command} --svg")), plot, "the same again");
    }
    let chart = text(home, "lab cycle --svg");
    for word in ["XY", "Z1", "release", "trigger", "contact", "clear", "settle", "dwell"] {
        assert!(chart.contains(&format!(">{word}<")), "no {word}");
    }
    assert_eq!(text(home, "lab cycle --csv").lines().count(), 4);
    assert_eq!(annulus(home, "lab profile --svg --csv").status.code(), Some(2));
}
