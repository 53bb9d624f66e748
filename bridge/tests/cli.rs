//! Tests of the other commands as real processes: the contract with scripts, and closed pipes.

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const BOARD: &str =
    "M48\nMETRIC,TZ\nT1C0.8\nT2C1.0\n%\nT1\nX5.0Y5.0\nX10.0Y5.0\nX10.0Y9.0\nT2\nX3.0Y3.0\nM30\n";

fn annulus(home: &Path, arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.args(arguments.split_whitespace()).current_dir(home).env("ANNULUS_HOME", home.join("home"));
    command
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("board.drl"), BOARD).unwrap();
    folder
}

#[test]
fn closed_output_pipes_do_not_change_the_exit_code() {
    let folder = folder();
    for (arguments, exit) in [
        ("inspect board.drl", 0),
        ("inspect board.drl --json", 0),
        ("plan board.drl", 0),
        ("plan missing.drl --json", 3),
        ("plan --wrong --json", 2),
        ("run board.drl --time-scale 2000", 0),
    ] {
        let (nobody, out) = std::io::pipe().unwrap();
        let (no_person, err) = std::io::pipe().unwrap();
        drop((nobody, no_person));
        let status = annulus(folder.path(), arguments).stdout(out).stderr(err).status().unwrap();
        assert_eq!(status.code(), Some(exit), "{arguments}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn full_disk_under_the_output_is_an_error() {
    let folder = folder();
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let mut command = annulus(folder.path(), "inspect board.drl --json");
    let Output { status, stderr, .. } = command.stdout(full).stderr(Stdio::piped()).output().unwrap();
    assert_eq!(status.code(), Some(3));
    assert!(String::from_utf8_lossy(&stderr).contains("could not be printed"));
}

fn json(output: &Output) -> Value {
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(text.lines().count(), 1, "{text}");
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// The answer of a command that must succeed.
fn answer(home: &Path, arguments: &str) -> Value {
    let output = annulus(home, &format!("{arguments} --json")).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{arguments}: {output:?}");
    let object = json(&output);
    assert_eq!(object["ok"], true);
    object
}

#[test]
fn json_output_has_the_documented_keys_in_order() {
    let folder = folder();
    for (arguments, keys) in [
        (
            "plan board.drl -o board.annulus-program",
            "travel_before_mm travel_after_mm hop_time_before_s hop_time_after_s tools iterations program_sha256",
        ),
        (
            "plan board.annulus-program --order fastest",
            "travel_before_mm hop_time_after_s tools program_sha256",
        ),
        (
            "simulate board.drl",
            "tick_hz total_time_s holes_per_min holes_per_min_sequential time_per_hole_s steps stream_bytes \
             stream_digest",
        ),
        ("simulate board.annulus-program --machine virtual", "tick_hz total_time_s stream_digest"),
        ("export board.drl --to excellon -o out.drl", "to file holes diagnostics"),
        ("export board.annulus-program --to grbl -o out.nc", "to file holes diagnostics"),
        (
            "export board.drl --to kuka -o . --arcs-to-lines",
            "to file files bytes sha256 holes toolpaths tools diagnostics",
        ),
        ("templates", "blocks parameters dialects"),
        ("templates grbl", "name text"),
        (
            "run board.annulus-program --machine virtual --time-scale 2000",
            "holes_done stopped_because position_trust stream_digest",
        ),
    ] {
        let object = answer(folder.path(), arguments);
        let there: Vec<&str> = object.as_object().unwrap().keys().map(String::as_str).collect();
        let places: Vec<Option<usize>> =
            keys.split_whitespace().map(|key| there.iter().position(|name| *name == key)).collect();
        assert!(places.iter().all(Option::is_some) && places.is_sorted(), "{arguments}: {keys} in {there:?}");
    }
    let plan = answer(folder.path(), "plan board.drl");
    let drill = serde_json::json!({
        "form": "drill", "diameter_mm": 0.8, "angle_deg": null, "tip_mm": null, "name": "drill 0.8"
    });
    let tool = serde_json::json!({
        "n": 1, "file_diameter_mm": 0.8, "rack_diameter_mm": 0.8, "holes": 3, "tool": drill, "slots": 0, "toolpaths": 0
    });
    assert_eq!((&plan["tools"][0], plan["tools"].as_array().unwrap().len()), (&tool, 2));
    let simulated = answer(folder.path(), "simulate board.drl --digest-trace");
    assert_eq!((&simulated["tick_hz"], &simulated["holes"]), (&10_000_000.into(), &4.into()));
    assert!(simulated["time_per_hole_s"]["median"].as_f64() <= simulated["time_per_hole_s"]["max"].as_f64());
    assert!(["x", "y", "z"].iter().all(|axis| simulated["steps"][axis].as_u64() > Some(0)), "{simulated}");
    assert!(!simulated["digest_trace"].as_array().unwrap().is_empty());
    for (machine, spindles) in [("virtual", 1), ("six", 6)] {
        let simulated = answer(folder.path(), &format!("simulate board.drl --machine {machine}"));
        let rate = |name: &str| simulated[name].as_f64().unwrap();
        assert_eq!(simulated["spindles"], spindles, "{machine}");
        let all = rate("holes_per_min") * f64::from(spindles);
        assert!((rate("holes_per_min_all_spindles") - all).abs() < 1e-4, "{simulated}");
    }
}

#[test]
fn exported_excellon_reads_back_as_the_same_holes() {
    let folder = folder();
    answer(folder.path(), "export board.drl --to excellon -o out.drl --order file");
    fs::create_dir(folder.path().join("twice")).unwrap();
    answer(folder.path(), "export out.drl --ignore-siblings --to excellon -o twice --order file");
    let file =
        |name: &str| answer(folder.path(), &format!("inspect {name} --ignore-siblings"))["files"][0].clone();
    let (first, second) = (file("board.drl"), file("out.drl"));
    for key in ["tools", "totals", "bbox_centres_mm", "bbox_outer_mm", "rapid_length_file_order_mm"] {
        assert!(!first[key].is_null(), "{key}");
        if key == "tools" {
            let sizes = |file: &Value| -> Vec<(String, String)> {
                let rows = file["tools"].as_array().unwrap().iter();
                rows.map(|row| (row["diameter_mm"].to_string(), row["hits"].to_string())).collect()
            };
            assert_eq!(sizes(&first), sizes(&second));
        } else {
            assert_eq!(first[key], second[key], "{key}");
        }
    }
    let text = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(text("out.drl"), text("twice/out.drl"));
}

#[test]
fn drill_layer_is_used_only_without_a_drill_file() {
    let folder = folder();
    fs::create_dir(folder.path().join("layers")).unwrap();
    let layer = "%TF.FileFunction,Plated,1,2,PTH,Mixed*%\n%FSLAX33Y33*%\n%MOMM*%\n%ADD10C,0.8*%\n%ADD11C,1.0*%\nD10*\n\
        X5000Y5000D03*\nX9000Y5000D03*\nD11*\nX0Y0D02*\nX3000Y0D01*\nM02*\n";
    fs::write(folder.path().join("layers/pth.gbr"), layer).unwrap();
    fs::write(folder.path().join("pth.gbr"), layer).unwrap();
    let told = json(&annulus(folder.path(), "plan . --json").output().unwrap());
    assert_eq!(told["error"]["code"], "board.holes_in_layer_only", "{told}");
    for (job, holes) in [("layers", 2), ("pth.gbr", 2), (". --accept board.holes_in_layer_only", 4)] {
        let told = answer(folder.path(), &format!("plan {job}"));
        let found: u64 =
            told["tools"].as_array().unwrap().iter().filter_map(|row| row["holes"].as_u64()).sum();
        assert_eq!(found, holes, "{job}: {told}");
    }
    let file = answer(folder.path(), "inspect layers")["files"][0].clone();
    let totals = serde_json::json!({ "hits": 2, "slots_g85": 1, "routed_paths": 0, "routed_segments": 0 });
    assert_eq!((&file["kind"], &file["plated"], &file["totals"]), (&"gerber".into(), &true.into(), &totals));
    assert_eq!(file["tools"][1]["diameter_mm"], 1.0);
}

#[test]
fn user_postprocessor_is_checked_and_used() {
    let folder = folder();
    let shipped = answer(folder.path(), "templates grbl")["text"].as_str().unwrap().to_owned();
    let save = |text: &str| fs::write(folder.path().join("mine.toml"), text).unwrap();
    save(&shipped);
    answer(folder.path(), "templates mine.toml");
    answer(folder.path(), "export board.drl --to mine.toml -o a.nc");
    answer(folder.path(), "export board.drl --to grbl -o b.nc");
    let text = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    // They are named after the files.
    assert_eq!(text("a.nc").replacen("job: a", "job: b", 1), text("b.nc"));
    save(&shipped.replace("X@X@ Y@Y@\nG0 Z@A@", "X@XX@ Y@Y\nG0 Z@A@"));
    let output = annulus(folder.path(), "templates mine.toml --json").output().unwrap();
    let told = json(&output);
    assert_eq!(
        (output.status.code(), told["diagnostics"].as_array().map(Vec::len)),
        (Some(1), Some(6)),
        "{told}"
    );
    assert_eq!(told["diagnostics"][0]["code"], "post.unknown_parameter");
    let output = annulus(folder.path(), "export board.drl --to mine.toml -o c.nc --json").output().unwrap();
    assert_eq!((output.status.code(), &json(&output)["error"]["code"]), (Some(1), &"post.faults".into()));
}

#[test]
fn errors_are_one_json_object_with_an_exit_code() {
    let folder = folder();
    fs::write(folder.path().join("letter.txt"), "Dear Sir,\nno holes today.\n").unwrap();
    // Too small for every drill and end mill.
    let tiny = BOARD.replace("T1C0.8", "T1C0.2");
    fs::write(folder.path().join("tiny.drl"), tiny).unwrap();
    fs::write(folder.path().join("broken.annulus-program"), b"annulus-program 1\n\xFF\xFF\xFF").unwrap();
    for (arguments, exit) in [
        ("plan tiny.drl", 1),
        ("simulate tiny.drl", 1),
        ("export tiny.drl --to grbl -o x.nc", 1),
        ("run tiny.drl", 1),
        ("plan letter.txt", 1),
        ("simulate broken.annulus-program", 1),
        ("plan board.drl --order sideways", 2),
        ("simulate", 2),
        ("export board.drl --to wobble -o x.nc", 2),
        ("export board.drl --to grbl", 2),
        ("export board.drl --to grbl -o x.nc --arcs-to-lines=3", 2),
        ("export board.drl --to missing.toml -o x.nc", 3),
        ("templates wobble", 2),
        ("templates missing.toml", 3),
        ("run board.drl --time-scale 0", 2),
        ("plan missing.drl", 3),
        ("simulate missing.drl", 3),
        ("simulate board.drl --machine missing", 3),
        ("export board.drl --to grbl -o nowhere/x.nc", 3),
        ("run missing.drl", 3),
    ] {
        let output = annulus(folder.path(), &format!("{arguments} --json")).output().unwrap();
        let object = json(&output);
        assert_eq!(
            (output.status.code(), &object["ok"]),
            (Some(exit), &Value::Bool(false)),
            "{arguments}: {object}"
        );
        for key in ["code", "message", "advice"] {
            assert!(
                object["error"][key].as_str().is_some_and(|text| !text.is_empty()),
                "{arguments}: {object}"
            );
        }
        assert!(object["error"].get("place").is_some(), "{arguments}: {object}");
        assert!(!folder.path().join("x.nc").exists(), "{arguments}");
    }
}

#[test]
fn old_flags_work_and_print_a_note() {
    let folder = folder();
    for (arguments, notes) in [
        ("inspect board.drl --alone --json", vec!["--alone is now called --ignore-siblings."]),
        (
            "run board.drl --speed=2000 --from-start --json",
            vec!["--speed is now called --time-scale.", "--from-start is now called --restart."],
        ),
        (
            "export board.drl --to kuka --lines-only 0.01 -o . --json",
            vec!["--lines-only is now called --arcs-to-lines."],
        ),
        ("inspect board.drl --ignore-siblings --json", vec![]),
        ("lab profile --machine lab --speed 7 --shape auto --json", vec![]),
    ] {
        let output = annulus(folder.path(), arguments).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(
            (output.status.code(), &json(&output)["ok"]),
            (Some(0), &true.into()),
            "{arguments}: {said}"
        );
        assert_eq!(said.matches("is now called").count(), notes.len(), "{arguments}: {said}");
        assert!(notes.iter().all(|note| said.contains(*note)), "{arguments}: {said}");
    }
}

#[test]
fn count_of_one_has_no_plural() {
    let folder = folder();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("b.drl", "M48\nMETRIC,TZ\nT1C0.8\n%\nT1\nX5.0Y5.0\nM30\n");
    write(
        "b-F_Cu.gbr",
        "%TF.FileFunction,Copper,L1,Top*%\n%FSLAX46Y46*%\n%MOMM*%\n%ADD10C,1.6*%\nD10*\nX5000000Y5000000D03*\nM02*\n",
    );
    write("one.txt", "SPINDLE 20000\n");
    for arguments in [
        "inspect b.drl",
        "inspect b-F_Cu.gbr",
        "plan b.drl",
        "cam b.drl b-F_Cu.gbr --to grbl -o out",
        "export b.drl --to grbl -o out.nc",
        "simulate b.drl",
        "run b.drl --time-scale 2000",
        "queue check one.txt",
    ] {
        let output = annulus(folder.path(), arguments).output().unwrap();
        let text = [output.stdout, output.stderr].concat();
        let text = String::from_utf8_lossy(&text).into_owned();
        assert!(!text.is_empty(), "{arguments}");
        let words: Vec<&str> = text.split_whitespace().collect();
        let plural = |word: &str| {
            let word = word.trim_end_matches(|letter: char| !letter.is_alphanumeric());
            word.len() > 2 && word.ends_with('s') && !word.ends_with("ss") && !["has", "was"].contains(&word)
        };
        let wrong = words.windows(2).find(|pair| pair[0] == "1" && plural(pair[1]));
        assert_eq!(wrong, None, "{arguments}: {text}");
    }
}

#[test]
fn errors_carry_every_diagnostic() {
    let folder = folder();
    fs::write(folder.path().join("x.tar.gz"), b"\x1F\x8B\x08\0\0\0\0\0\0\x03abcdef").unwrap();
    let output = annulus(folder.path(), "plan x.tar.gz --json").output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let said = json(&output)["error"]["diagnostics"].clone();
    assert!(said.as_array().unwrap().iter().any(|one| one["code"] == "archive.not_opened"), "{said}");
    let object = answer(folder.path(), "inspect x.tar.gz");
    let one = &object["files"][0]["diagnostics"][0];
    let keys: Vec<&String> = one.as_object().unwrap().keys().collect();
    for key in ["severity", "code", "line", "column", "found", "expected", "message", "advice"] {
        assert!(keys.iter().any(|have| *have == key), "{key}: {one}");
    }
}

#[test]
fn truncated_zip_is_refused_with_one_reason() {
    let folder = folder();
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    write("cut.zip", b"PK\x03\x04\x14\0\0\0\x08\0cut off");
    write("none.drl", b"");
    for (name, code) in [("cut.zip", "archive.damaged"), ("none.drl", "refused.empty")] {
        let output =
            annulus(folder.path(), &format!("inspect {name} --ignore-siblings --json")).output().unwrap();
        let object = json(&output);
        assert_eq!(
            (output.status.code(), &object["ok"], &object["error"]["code"]),
            (Some(1), &false.into(), &code.into())
        );
        assert_eq!(object["files"][0]["kind"], "refused", "{object}");
        let output = annulus(folder.path(), &format!("inspect {name} --ignore-siblings")).output().unwrap();
        let text = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
        let message = object["error"]["message"].as_str().unwrap();
        assert_eq!((output.status.code(), text.matches(message).count()), (Some(1), 1), "{text}");
        assert!(text.contains(object["error"]["advice"].as_str().unwrap()), "{text}");
    }
    // A folder containing it can still be listed.
    let output = annulus(folder.path(), "inspect . --json").output().unwrap();
    assert_eq!(output.status.code(), Some(0));
}

#[test]
fn against_reports_moved_and_resized_holes() {
    let folder = folder();
    let home = folder.path();
    for (name, text) in [
        ("old", BOARD.to_owned()),
        ("moved", BOARD.replace("X10.0Y9.0", "X10.0Y9.5").replace("T2C1.0", "T2C1.2")),
        ("damaged", "nothing".to_owned()),
    ] {
        fs::create_dir(home.join(name)).unwrap();
        fs::write(home.join(name).join("board.drl"), text).unwrap();
    }
    let same = answer(home, "inspect old --against old")["changes"].clone();
    assert_eq!((&same["same"], &same["unchanged"]), (&true.into(), &4.into()), "{same}");
    let changes = answer(home, "inspect moved --against old")["changes"].clone();
    let rows: Vec<_> =
        changes["holes"].as_array().unwrap().iter().map(|row| row["change"].as_str()).collect();
    assert_eq!((rows, &changes["unchanged"]), (vec![Some("moved"), Some("resized")], &2.into()), "{changes}");
    assert_eq!(changes["holes"][0]["now"]["at_mm"], serde_json::json!([10.0, 9.5]));
    let lost = answer(home, "inspect damaged --against old")["changes"].clone();
    assert_eq!((&lost["may_be_another_board"], &lost["same"]), (&true.into(), &false.into()), "{lost}");
    assert!(answer(home, "inspect old")["changes"].is_null());
    let output = annulus(home, "inspect moved --against old").output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(
        said.contains("1 hole moved") && said.contains("X 10.000 Y 9.000 → 0.800 mm  X 10.000 Y 9.500"),
        "{said}"
    );
    let output = annulus(home, "inspect old --against missing --json").output().unwrap();
    assert_eq!(output.status.code(), Some(3));
}

#[test]
fn help_is_grouped_and_ends_with_examples() {
    let folder = folder();
    for (arguments, parts) in [
        (
            "--help",
            vec!["Annulus reads the fabrication files", "Examples:\n  annulus\n", "Manual: docs/manual/"],
        ),
        ("cam --help", vec!["Input:", "Planning:", "Output:", "-o, --output", "-m, --machine"]),
        ("run --help", vec!["Running:", "--dry-run", "-q, --quiet", "-v, --verbose"]),
        ("export --help", vec!["grbl, linuxcnc", "gerber and svg"]),
    ] {
        let output = annulus(folder.path(), arguments).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(output.status.code(), Some(0), "{arguments}");
        for part in parts {
            assert!(text.contains(part), "{arguments}: {part} in {text}");
        }
    }
}

#[test]
fn color_is_used_only_if_asked_for() {
    let folder = folder();
    for (arguments, is_colored) in [
        ("plan --help", false),
        ("plan --help --color always", true),
        ("--color=never plan --help", false),
        ("plan missing.drl --color always", true),
        ("plan missing.drl", false),
        ("plan missing.drl --color never", false),
    ] {
        let output = annulus(folder.path(), arguments).output().unwrap();
        let text = [output.stdout, output.stderr].concat();
        assert_eq!(text.contains(&0x1b), is_colored, "{arguments}");
    }
}

#[test]
fn completions_and_manual_pages_cover_every_command() {
    let folder = folder();
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let output = annulus(folder.path(), &format!("completions {shell}")).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success() && text.contains("inspect") && text.contains("dry-run"), "{shell}");
    }
    let told = answer(folder.path(), "man pages");
    let files: Vec<&str> =
        told["files"].as_array().unwrap().iter().filter_map(|file| file.as_str()).collect();
    for name in ["annulus.1", "annulus-cam.1", "annulus-grbl-run.1", "annulus-completions.1"] {
        assert!(files.contains(&name) && folder.path().join("pages").join(name).is_file(), "{name}: {told}");
    }
    assert!(!files.contains(&"annulus-executor.1"), "{told}");
}

#[test]
fn dry_run_opens_no_port_and_writes_nothing() {
    let folder = folder();
    let home = folder.path();
    fs::write(home.join("home.queue"), "HOME ALL\nMOVE_TO 5.0 10.0\n").unwrap();
    answer(home, "export board.drl --to GRBL -o out.nc");
    let saved = |name: &str| home.join("home").join(name).exists();
    for (arguments, driver, port) in [
        ("run board.drl", "virtual_drill", None),
        ("run board.drl -m 3018", "controller", None),
        ("run board.drl -m 3018 --port missing", "controller", Some("missing")),
        ("run board.drl -m 3018 --rehearse", "virtual_drill", None),
        ("grbl run board.drl --port missing --zero-here", "controller", Some("missing")),
        ("grbl run out.nc --port missing", "controller", Some("missing")),
        ("run out.nc", "controller", None),
    ] {
        let told = answer(home, &format!("{arguments} --dry-run"));
        assert_eq!(told["dry_run"], true, "{arguments}: {told}");
        assert_eq!((&told["holes"], &told["driven_by"]), (&4.into(), &driver.into()), "{arguments}: {told}");
        assert_eq!(told["port"].as_str(), port, "{arguments}: {told}");
        for key in ["machine", "toolpaths", "time_s", "tool_changes", "zero", "diagnostics"] {
            assert!(told.get(key).is_some(), "{arguments}: {key} in {told}");
        }
    }
    let told = answer(home, "level board.drl --dry-run");
    assert!(told["dry_run"] == true && told["points"].as_u64() > Some(3), "{told}");
    let told = answer(home, "queue run home.queue --dry-run");
    assert_eq!((&told["dry_run"], &told["rows_done"]), (&true.into(), &2.into()), "{told}");
    let output = annulus(home, "grbl resume --port missing --dry-run --json").output().unwrap();
    let told = json(&output);
    let code = &told["error"]["code"];
    assert_eq!((output.status.code(), code), (Some(1), &"grbl.nothing_interrupted".into()));
    assert!(!saved("grbl") && !saved("controller.nc"), "nothing is saved");
}

#[test]
fn board_is_exported_as_gerber_and_svg() {
    let folder = folder();
    let home = folder.path();
    for (arguments, files) in [
        ("export board.drl --to gerber -o layers", vec!["layers/board.drl"]),
        ("export board.drl --to SVG -o pictures", vec!["pictures/board.svg"]),
        ("export board.drl --to svg -o one.svg", vec!["one.svg"]),
    ] {
        let told = answer(home, arguments);
        assert_eq!(told["files"], serde_json::json!(files), "{arguments}: {told}");
        assert_eq!(told["holes"], 4, "{arguments}: {told}");
        assert!(files.iter().all(|file| home.join(file).is_file()), "{arguments}");
    }
    let holes =
        |name: &str| answer(home, &format!("inspect {name} --ignore-siblings"))["files"][0]["totals"].clone();
    assert_eq!(holes("layers/board.drl"), holes("board.drl"));
    answer(home, "plan board.drl -o board.program");
    answer(home, "export board.program --to svg -o program.svg");
    for (arguments, exit, code) in [
        ("export board.drl --to gerber -o .", 2, "export.over_input"),
        ("export board.program --to gerber -o layers", 1, "export.no_layers"),
        ("export board.drl --to svg -o x --arcs-to-lines", 2, "export.flag_of_program"),
    ] {
        let output = annulus(home, &format!("{arguments} --json")).output().unwrap();
        let told = json(&output);
        assert_eq!((output.status.code(), &told["error"]["code"]), (Some(exit), &code.into()), "{told}");
    }
    assert_eq!(fs::read_to_string(home.join("board.drl")).unwrap(), BOARD);
}

#[test]
fn targets_are_named_in_any_case() {
    let folder = folder();
    for target in ["GRBL", "LinuxCNC", "excellon", "Fanuc_TP"] {
        let told = answer(folder.path(), &format!("export board.drl --to {target} -o ."));
        assert_eq!(told["to"], target.to_lowercase());
    }
    assert_eq!(answer(folder.path(), "templates Grbl")["name"], "grbl");
}

#[test]
fn virtual_drill_says_that_it_confirms_tool_changes() {
    let folder = folder();
    for (arguments, is_said) in [("", true), ("--quiet", false), ("--unattended-tool-change 0", false)] {
        let run = format!("run board.drl --time-scale 2000 {arguments}");
        let output = annulus(folder.path(), &run).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(said.contains("confirms every tool change"), is_said, "{arguments}: {said}");
    }
}

#[test]
fn machines_are_a_table_with_one_row_each() {
    let folder = folder();
    let output = annulus(folder.path(), "machines").output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for (start, driver) in [
        ("3018, hobby ", "its GRBL controller"),
        ("g540 ", "Annulus, by the parallel port"),
        ("virtual ", "Annulus, simulated"),
    ] {
        let row = text.lines().find(|line| line.trim_start_matches(['*', ' ']).starts_with(start));
        assert!(row.is_some_and(|row| row.ends_with(driver)), "{start}: {text}");
    }
    assert!(!text.lines().any(|line| line.trim_start().starts_with("hobby")), "{text}");
    let rows = answer(folder.path(), "machines")["machines"].clone();
    let hobby = rows.as_array().unwrap().iter().find(|row| row["name"] == "hobby").unwrap();
    assert_eq!((&hobby["alias_of"], &hobby["driven_by"]), (&"3018".into(), &"grbl".into()));
}

#[test]
fn chosen_machine_is_remembered_and_a_flag_is_not() {
    let folder = folder();
    let home = folder.path();
    let used = |arguments: &str| {
        let told = answer(home, arguments);
        [told["machine"].clone(), told["machine_from"].clone()]
    };
    assert_eq!(used("plan board.drl"), ["virtual", "default"]);
    assert_eq!(used("plan board.drl --machine six"), ["six", "flag"]);
    assert_eq!(used("machines use hobby"), ["3018", "chosen"]);
    for command in ["plan board.drl", "simulate board.drl", "export board.drl --to grbl -o a.nc", "machines"]
    {
        assert_eq!(used(command), ["3018", "chosen"], "{command}");
    }
    assert_eq!(used("simulate board.drl --machine lab"), ["lab", "flag"]);
    assert_eq!(used("plan board.drl"), ["3018", "chosen"], "the flag holds for one call");
    let rows = answer(home, "machines")["machines"].clone();
    let marked: Vec<_> = rows.as_array().unwrap().iter().filter(|row| row["used"] == true).collect();
    assert_eq!(
        (marked.len(), &marked[0]["name"], &marked[0]["driven_by"]),
        (1, &"3018".into(), &"grbl".into())
    );
    let said = |arguments: &str| {
        String::from_utf8_lossy(&annulus(home, arguments).output().unwrap().stdout).into_owned()
    };
    assert!(said("plan board.drl").contains("Machine: 3018 router, chosen with annulus machines use."));
    assert!(said("plan board.drl --machine six").contains("Machine: Six spindles, named with --machine."));
    assert!(said("machines").lines().any(|line| line.starts_with("* 3018, hobby ")));
    let refused = annulus(home, "machines use missing --json").output().unwrap();
    assert_eq!(
        (refused.status.code(), &json(&refused)["error"]["code"]),
        (Some(3), &"machine.no_such".into())
    );
    assert_eq!(used("plan board.drl"), ["3018", "chosen"], "a refused choice changes nothing");
    assert_eq!(used("machines use virtual"), ["virtual", "chosen"]);
}
