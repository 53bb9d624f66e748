//! Tests of `annulus cam` and `annulus prove` as real processes on the sample board. Covers refusals before
//! planning, unaccepted problems, which prevent every file, and saved jobs, which give the same programs.
//! `projects` tests saved projects, `same` compares with the page.

mod files;
mod projects;
mod proved;
mod robot;
mod same;
mod unmade;
mod written;

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const BOARD: [&str; 3] = ["sensor.drl", "sensor-top.gbr", "sensor-outline.gbr"];
const CAM: &str = "cam sensor.drl sensor-top.gbr sensor-outline.gbr";

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../www/examples");
    for name in BOARD {
        fs::copy(examples.join(name), folder.path().join(name)).unwrap();
    }
    folder
}

fn annulus(home: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.args(arguments).arg("--json");
    command.current_dir(home).env("ANNULUS_HOME", home.join("home")).output().unwrap()
}

/// Exit code and JSON object on standard output; checks that its `ok` and `error` fit the exit code.
fn answer(home: &Path, arguments: &str) -> (i32, Value) {
    answer_of(home, &arguments.split_whitespace().collect::<Vec<_>>())
}

fn answer_of(home: &Path, words: &[&str]) -> (i32, Value) {
    let output = annulus(home, words);
    let arguments = words.join(" ");
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(text.lines().count(), 1, "{arguments}: {output:?}");
    let object: Value = serde_json::from_str(&text).unwrap();
    let exit = output.status.code().unwrap();
    assert_eq!(object["ok"], exit == 0, "{arguments}: {object}");
    for key in ["code", "message", "advice"] {
        let said = object["error"][key].as_str().is_some_and(|text| !text.is_empty());
        assert_eq!(said, exit != 0, "{arguments}: {object}");
    }
    (exit, object)
}

fn codes(findings: &Value) -> Vec<&str> {
    findings.as_array().unwrap().iter().map(|row| row["code"].as_str().unwrap()).collect()
}

#[test]
fn unaccepted_gap_refuses_to_write_programs() {
    let folder = folder();
    let home = folder.path();
    let (exit, told) = answer(home, &format!("{CAM} --to grbl -o out --save-job job.toml"));
    assert_eq!((exit, &told["error"]["code"]), (1, &"cam.unread_findings".into()), "{told}");
    assert_eq!(told["findings_unread"], 1);
    let side = &told["programs"][0];
    assert_eq!(side["files"].as_array().map(Vec::len), Some(0));
    assert_eq!(codes(&side["findings"]), ["proof.gap"]);
    let gap = &side["findings"][0];
    assert!((gap["width_mm"].as_f64().unwrap() - 0.122).abs() < 0.001, "{gap}");
    assert_eq!((&gap["unread"], &gap["accepted"]), (&true.into(), &false.into()));
    assert!(gap["cures"][0]["depth_mm"].as_f64().is_some_and(|depth| depth < 0.08), "lengths in mm: {gap}");
    assert!(!home.join("out").exists());
    assert!(home.join("job.toml").exists(), "the job is there to be mended");
    // Accepting it, by ID or kind, gives the program.
    let id = gap["id"].as_str().unwrap();
    for word in [id, "gap", "proof.gap"] {
        let (exit, told) = answer(home, &format!("{CAM} --to grbl -o {word} --accept {word}"));
        assert_eq!((exit, &told["findings_unread"]), (0, &0.into()), "{word}");
        assert!(home.join(word).join("01-top-isolate-V30-0.1.nc").exists(), "{word}: {told}");
    }
}

#[test]
fn fixed_job_is_reported_and_reproduces_the_same_bytes() {
    let folder = folder();
    let home = folder.path();
    let arguments = "--fix-gaps --to program -o first --save-job job.toml";
    let (exit, told) = answer(home, &format!("{CAM} {arguments}"));
    assert_eq!(exit, 0, "{told}");
    let side = &told["programs"][0];
    for key in [
        "total_time_s",
        "milled_mm",
        "travel_mm",
        "plunges",
        "retracts",
        "holes",
        "toolpaths",
        "tool_changes",
    ] {
        assert!(side[key].as_f64() > Some(0.0), "{key}: {side}");
    }
    assert_eq!(side["face"], "top");
    let forms: Vec<&str> =
        side["tools"].as_array().unwrap().iter().map(|tool| tool["form"].as_str().unwrap()).collect();
    assert!(["vee", "drill", "mill"].iter().all(|form| forms.contains(form)), "{forms:?}");
    let file = &side["files"][0];
    let bytes = fs::read(home.join(file["file"].as_str().unwrap())).unwrap();
    assert_eq!((&file["bytes"], &file["sha256"]), (&bytes.len().into(), &side["program_sha256"]));

    let (exit, again) = answer(home, &format!("{CAM} --job job.toml --accept lost --to program -o second"));
    assert_eq!(exit, 0, "{again}");
    assert_eq!(fs::read(home.join("second/sensor-top.program")).unwrap(), bytes);
    let (exit, timed) = answer(home, "simulate first/sensor-top.program");
    assert_eq!((exit, &timed["total_time_s"]), (0, &side["total_time_s"]));
    // Bores and the cut-out go down along helices and ramps: both count their full length.
    assert_eq!(timed["milled_mm"], side["milled_mm"]);
    let of_tools = side["tools"].as_array().unwrap().iter().filter_map(|tool| tool["milled_mm"].as_f64());
    assert!((of_tools.sum::<f64>() - side["milled_mm"].as_f64().unwrap()).abs() < 0.01, "{side}");
}

#[test]
fn holes_without_a_fitting_tool_must_be_accepted() {
    let folder = folder();
    let home = folder.path();
    let drill = "M48\nMETRIC\nT1C0.8\nT2C0.15\n%\nG90\nT1\nX5.0Y5.0\nX9.0Y5.0\nT2\nX7.0Y5.0\nX8.0Y6.5\nM30\n";
    fs::write(home.join("vias.drl"), drill).unwrap();
    let (exit, told) = answer(home, "cam vias.drl --ignore-siblings --to grbl -o out");
    assert_eq!((exit, &told["error"]["code"]), (1, &"cam.unacknowledged_errors".into()), "{told}");
    let side = &told["programs"][0];
    assert_eq!((&told["errors_unacknowledged"], &side["holes"]), (&1.into(), &2.into()), "{told}");
    let error = &side["diagnostics"][0];
    assert_eq!((&error["severity"], &error["code"]), (&"error".into(), &"cam.holes_missing".into()));
    let said = error["message"].as_str().unwrap();
    assert!(said.contains("2 holes of 0.15 mm") && said.contains("X 7.000 Y 5.000"), "{said}");
    assert!(!home.join("out").exists());
    let (exit, told) =
        answer(home, "cam vias.drl --ignore-siblings --to grbl -o out --accept cam.holes_missing");
    assert_eq!((exit, &told["errors_unacknowledged"]), (0, &0.into()), "{told}");
    assert!(home.join("out/01-top-drill-0.8.nc").exists());
}

#[test]
fn unnamed_copper_without_drill_file_is_milled_once_accepted() {
    let folder = folder();
    let home = folder.path();
    let pads = "%FSLAX33Y33*%\n%MOMM*%\n%ADD10C,1.5*%\nD10*\nX2000Y2000D03*\nX9000Y5000D03*\nM02*\n";
    fs::create_dir(home.join("lone")).unwrap();
    fs::write(home.join("lone/sheet.off"), pads).unwrap();
    let (exit, told) = answer(home, "cam lone --to grbl -o out");
    assert_eq!((exit, &told["error"]["code"]), (1, &"set.only_copper".into()), "{told}");
    let (exit, told) = answer(home, "cam lone --to grbl -o out --accept set.only_copper");
    assert_eq!(exit, 0, "{told}");
    assert!(told["programs"][0]["milled_mm"].as_f64().unwrap() > 10.0, "{told}");
    assert_eq!(codes(&told["diagnostics"]), ["set.only_copper", "board.no_holes", "cli.machine_assumed"]);
    assert!(home.join("out/01-top-isolate-V30-0.1.nc").exists());
    // Without copper there is nothing to do, and drilling needs a drill file.
    fs::create_dir(home.join("none")).unwrap();
    fs::write(home.join("none/read.me"), "hello\n").unwrap();
    for (arguments, code) in
        [("cam none --to grbl -o out", "job.no_board"), ("plan lone", "job.no_drill_file")]
    {
        let (exit, told) = answer(home, arguments);
        assert_eq!((exit, &told["error"]["code"]), (1, &code.into()), "{arguments}: {told}");
    }
}

#[test]
fn role_settles_a_guessed_side_for_cam_and_prove() {
    let folder = folder();
    let home = folder.path();
    let pads = "%FSLAX33Y33*%\n%MOMM*%\n%ADD10C,1.5*%\nD10*\nX2000Y2000D03*\nX9000Y5000D03*\nM02*\n";
    fs::create_dir(home.join("lone")).unwrap();
    fs::write(home.join("lone/sheet.off"), pads).unwrap();
    let role = "--role sheet.off=bottom-copper";
    let (exit, told) = answer(home, &format!("cam lone {role} --to grbl -o out --save-project lone.annulus"));
    assert_eq!(exit, 0, "{told}");
    let written = "out/01-bottom-isolate-V30-0.1.nc";
    assert!(home.join(written).exists(), "{told}");
    let (exit, told) = answer(home, &format!("prove lone {written}"));
    assert_eq!((exit, &told["error"]["code"]), (1, &"set.only_copper".into()), "{told}");
    for design in [format!("lone {written} {role}"), format!("lone.annulus {written}")] {
        let (exit, told) = answer(home, &format!("prove {design}"));
        assert_eq!((exit, &told["sides"][0]["face"]), (0, &"bottom".into()), "{design}: {told}");
    }
    for (role, code) in [
        ("sheet.off=copper", "cli.bad_role"),
        ("sheet.off", "cli.bad_role"),
        ("other.gbr=top-copper", "cli.role_of_no_layer"),
    ] {
        let (exit, told) = answer(home, &format!("cam lone --role {role} --to grbl -o out"));
        assert_eq!((exit, &told["error"]["code"]), (2, &code.into()), "{told}");
    }
}

#[test]
fn copper_lost_to_a_fix_is_listed_without_stopping() {
    let folder = folder();
    let home = folder.path();
    // An end mill 20 µm too wide for the gap, and no thinner tool.
    let job = "schema = 1\n[[bit]]\nname = \"m\"\nform = \"mill\"\ndiameter = 0.142\n\
               [[operation]]\nkind = \"isolate\"\nbit = \"m\"\n";
    fs::write(home.join("job.toml"), job).unwrap();
    let (exit, told) =
        answer(home, &format!("{CAM} --job job.toml --fix-gaps --to grbl -o out --save-job cured.toml"));
    assert_eq!((exit, &told["findings_unread"]), (0, &0.into()), "{told}");
    let side = &told["programs"][0];
    let taken = codes(&side["diagnostics"]).into_iter().filter(|code| *code == "cam.cure_takes").count();
    assert_eq!(taken, 1, "however many passes: {side}");
    let lost: Vec<&Value> =
        side["findings"].as_array().unwrap().iter().filter(|row| row["code"] == "proof.lost").collect();
    assert!(!lost.is_empty() && lost.iter().all(|row| row["agreed"] == true), "{side}");
    assert!(lost.iter().all(|row| row["width_mm"].as_f64() < Some(0.016)), "{lost:?}");
    // Without the fix in its job, the problem is not accepted.
    let (exit, told) = answer(home, &format!("{CAM} --job cured.toml --to program -o own"));
    assert_eq!(exit, 0, "{told}");
    fs::create_dir(home.join("board")).unwrap();
    for name in BOARD {
        fs::copy(home.join(name), home.join("board").join(name)).unwrap();
    }
    assert_eq!(answer(home, "prove board own/sensor-top.program --job cured.toml").0, 0);
    assert_eq!(answer(home, "prove board own/sensor-top.program --job job.toml").0, 1);
}

#[test]
fn invalid_options_are_refused_before_planning() {
    let folder = folder();
    let home = folder.path();
    // The board is missing: checking for it first would give another error.
    for (arguments, exit, code) in [
        ("--to wobble", 2, "post.unknown_target"),
        ("--to program --arcs-to-lines", 2, "cam.own_form_has_arcs"),
        ("--to grbl --arcs-to-lines=3", 2, "cli.usage"),
        ("--to missing.toml", 3, "job.unreadable"),
        ("--to grbl", 3, "files.missing"),
        ("--to grbl --accept nonsense", 2, "cli.unknown_accept"),
        ("--to grbl --accept gap,0123abcd,proof.still", 3, "files.missing"),
    ] {
        let (found, told) = answer(home, &format!("cam missing.drl -o out {arguments}"));
        assert_eq!((found, &told["error"]["code"]), (exit, &code.into()), "{arguments}: {told}");
    }
    for (arguments, exit) in [
        ("--set passes", 2),
        ("--set isolate.passes=0", 2),
        ("--set operation.speed=0", 2),
        ("--machine missing", 3),
        ("--job missing.toml", 3),
    ] {
        assert_eq!(answer(home, &format!("{CAM} --to grbl -o out {arguments}")).0, exit, "{arguments}");
    }
    assert!(!home.join("out").exists());
}

#[test]
fn template_without_retract_height_is_noted_per_file() {
    let folder = folder();
    let home = folder.path();
    let (_, grbl) = annulus_core::post::shipped().find(|(name, _)| *name == "grbl").unwrap();
    fs::write(home.join("own.toml"), grbl.replace("G0 Z@HC@\n", "")).unwrap();
    fs::write(home.join("same.toml"), grbl).unwrap();
    for (arguments, warnings) in [
        (format!("{CAM} --fix-gaps -o out --to own.toml"), 4),
        (format!("{CAM} --fix-gaps -o out --to same.toml"), 0),
        (format!("{CAM} --fix-gaps -o out --to program"), 0),
        ("export sensor.drl -o out.nc --to own.toml".to_owned(), 4),
        ("export sensor.drl -o out.nc --to grbl".to_owned(), 0),
    ] {
        let (exit, told) = answer(home, &arguments);
        assert_eq!(exit, 0, "{arguments}: {told}");
        let diagnostics = told["diagnostics"].as_array().unwrap().iter();
        let told: Vec<&Value> = diagnostics.filter(|row| row["code"] == "post.no_height").collect();
        assert_eq!(told.len(), warnings, "{arguments}");
        assert!(told.iter().all(|row| row["severity"] == "note"), "{told:?}");
    }
}

#[test]
fn wrong_job_file_is_refused_with_line_and_column() {
    let folder = folder();
    let home = folder.path();
    let isolate = "schema = 1\n[[operation]]\nkind = \"isolate\"\n";
    for (text, code, line, column) in [
        (format!("{isolate}colour = 3\n"), "project.unknown_row", 4, 1),
        (format!("{isolate}  depth = -0.1\n"), "machine.setting_range", 4, 11),
        ("schema = 1\n[setup]\ncolumns = 1000\n".to_owned(), "machine.setting_range", 3, 11),
        ("schema = 1\n[setup\n".to_owned(), "project.syntax", 2, 7),
    ] {
        fs::write(home.join("job.toml"), &text).unwrap();
        let (exit, told) =
            answer(home, &format!("{CAM} --job job.toml --to grbl -o out --save-job kept.toml"));
        let place = &told["error"]["place"];
        assert_eq!((exit, &told["error"]["code"]), (1, &code.into()), "{text}: {told}");
        assert_eq!(
            (&place["file"], &place["line"], &place["column"]),
            (&"job.toml".into(), &line.into(), &column.into())
        );
        assert!(!home.join("out").exists() && !home.join("kept.toml").exists(), "{text}");
    }
}

#[test]
fn lines_only_replaces_arcs() {
    let folder = folder();
    let home = folder.path();
    for (lines_only, arcs) in [("", true), ("--arcs-to-lines", false)] {
        let (exit, told) = answer(home, &format!("{CAM} --fix-gaps --to grbl -o out {lines_only}"));
        assert_eq!(exit, 0, "{told}");
        let files = told["files"].as_array().unwrap().iter();
        let read = |file: &Value| fs::read_to_string(home.join(file["file"].as_str().unwrap())).unwrap();
        let text: String = files.map(read).collect();
        let is_arc =
            |line: &str| line.split_whitespace().any(|word| ["G2", "G3", "G02", "G03"].contains(&word));
        assert_eq!(text.lines().any(is_arc), arcs, "{lines_only}");
    }
}

#[test]
fn program_is_proved_on_the_panel_of_its_job() {
    let folder = folder();
    let home = folder.path();
    fs::create_dir(home.join("board")).unwrap();
    for name in BOARD {
        fs::rename(home.join(name), home.join("board").join(name)).unwrap();
    }
    let cam = "cam board --set setup.columns=2 --fix-gaps --to program -o out --save-job job.toml";
    let (exit, told) = answer(home, cam);
    assert_eq!(exit, 0, "{told}");
    let (exit, proved) = answer(home, "prove board out/board-top.program --job job.toml --accept lost");
    assert_eq!((exit, &proved["unread"]), (0, &0.into()), "{proved}");
    let (exit, alone) = answer(home, "prove board out/board-top.program");
    assert_eq!(exit, 0, "{alone}");
    assert_eq!(proved["islands"].as_u64(), alone["islands"].as_u64().map(|islands| 2 * islands));
    assert_eq!(answer(home, "prove board out/board-top.program --job missing.toml").0, 3);
    assert_eq!(answer(home, "prove board out/board-top.program --job job.toml --flip none").0, 2);
}

#[test]
fn programs_in_the_board_folder_do_not_stop_a_second_run() {
    let folder = folder();
    let home = folder.path();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/folders/own-output-in-folder");
    for target in [
        "abb",
        "fanuc",
        "fanuc_tp",
        "grbl",
        "heidenhain",
        "kuka",
        "linuxcnc",
        "mach3",
        "marlin",
        "sinumerik",
        "program",
    ] {
        let board = home.join(format!("board_{target}"));
        fs::create_dir(&board).unwrap();
        for entry in fs::read_dir(&data).unwrap() {
            let entry = entry.unwrap();
            fs::copy(entry.path(), board.join(entry.file_name())).unwrap();
        }
        let run = format!("cam board_{target} --to {target} -o board_{target}/out --iterations 10");
        let (exit, first) = answer(home, &run);
        assert_eq!(exit, 0, "{target}: {first}");
        let (exit, second) = answer(home, &run);
        assert_eq!((exit, &second["error"]["code"]), (0, &Value::Null), "{target}: {second}");
        assert_eq!(second["programs"][0]["holes"], first["programs"][0]["holes"], "{target}");
    }
    // Everything written is proved together; the run sheet is not a program.
    let written = fs::read_dir(home.join("board_grbl/out")).unwrap();
    let mut words = vec!["prove".to_owned(), "board_grbl".to_owned()];
    words.extend(written.map(|entry| entry.unwrap().path().display().to_string()));
    let (exit, told) = answer_of(home, &words.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(exit, 0, "{told}");
    assert!(codes(&told["diagnostics"]).contains(&"prove.not_a_program"), "{told}");
}
