//! Tests of the files written by `annulus cam`: one per tool if the controller cannot change tools,
//! numbered and named, with a run sheet. Also of feeds within the limits, and of the assumed machine.

use super::{CAM, annulus, answer, codes, folder};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().unwrap_or_else(|| panic!("{key}: {value}"))
}

fn name(file: &Value) -> String {
    Path::new(text(file, "file")).file_name().unwrap().to_string_lossy().into_owned()
}

#[test]
fn files_are_written_per_tool_with_a_run_sheet() {
    let folder = folder();
    let home = folder.path();
    for (target, ending) in [("grbl", "nc"), ("marlin", "gcode")] {
        let (exit, told) =
            answer(home, &format!("{CAM} --machine hobby --fix-gaps --to {target} -o {target}"));
        assert_eq!(exit, 0, "{told}");
        assert_eq!(told["machine"], "hobby");
        assert!(!codes(&told["diagnostics"]).contains(&"cli.machine_assumed"), "{told}");
        let files = told["files"].as_array().unwrap();
        let names: Vec<String> = files.iter().map(name).collect();
        let mut sorted = names.clone();
        sorted.sort();
        assert_eq!(names, sorted, "in the order of running");
        assert_eq!(names[0], format!("01-top-isolate-V30-0.1.{ending}"));
        assert!(names.len() > 2 && names.last().unwrap().contains("cut-out-mill-"), "{names:?}");
        let mut sum = 0.0;
        for (index, file) in files.iter().enumerate() {
            assert!(name(file).starts_with(&format!("{:02}-top-", index + 1)), "{file}");
            assert_eq!((text(file, "side"), file["tools"].as_array().map(Vec::len)), ("top", Some(1)));
            assert!(!text(file, "operation").is_empty());
            let tool = &file["tool"];
            let vee = text(tool, "form") == "vee";
            assert!(tool["diameter_mm"].as_f64() > Some(0.0), "{tool}");
            assert_eq!((tool["angle_deg"].is_null(), tool["tip_mm"].is_null()), (!vee, !vee), "{tool}");
            sum += file["time_s"].as_f64().unwrap();
            let written = fs::read_to_string(home.join(text(file, "file"))).unwrap();
            let head: Vec<&str> = written.lines().take(12).collect();
            let named = text(tool, "name").replace('°', " deg");
            assert!(
                head.iter().any(|line| line.contains(&format!("tool {}: {named}", index + 1))),
                "{head:?}"
            );
            for words in ["job: ", "side: top", "zero: ", "blank: ", "time: "] {
                assert!(head.iter().any(|line| line.contains(words)), "{words} {head:?}");
            }
        }
        let total = told["programs"][0]["total_time_s"].as_f64().unwrap();
        assert!((sum - total).abs() < 0.01, "{sum} {total}");
        let sheet = fs::read_to_string(home.join(text(&told, "run_sheet"))).unwrap();
        assert!(names.iter().all(|name| sheet.contains(name)), "{sheet}");
        assert_eq!(fs::read_dir(home.join(target)).unwrap().count(), names.len() + 1);
    }
    let (exit, told) =
        answer(home, &format!("{CAM} --machine hobby --fix-gaps --to grbl --single-file -o one"));
    assert_eq!((exit, told["files"].as_array().map(Vec::len)), (0, Some(1)), "{told}");
    let whole = fs::read_to_string(home.join("one/sensor-top.nc")).unwrap();
    assert!(whole.contains("(MSG, put in tool 2: ") && whole.contains("\nM0\n"), "{whole}");
}

#[test]
fn feeds_and_speeds_stay_within_the_machine() {
    let folder = folder();
    let home = folder.path();
    let set = "--set isolate.feed=400 --set operation.plunge=80 --set operation.speed=90000";
    let (exit, told) = answer(home, &format!("{CAM} --machine hobby --fix-gaps --to grbl -o out {set}"));
    assert_eq!(exit, 0, "{told}");
    let codes = codes(&told["programs"][0]["diagnostics"]);
    for code in ["cam.feed_bounded", "cam.plunge_bounded", "cam.speed_bounded"] {
        assert!(codes.contains(&code), "{codes:?}");
    }
    let (mut fastest, mut turns) = (0.0_f64, 0.0_f64);
    for file in told["files"].as_array().unwrap() {
        let written = fs::read_to_string(home.join(text(file, "file"))).unwrap();
        let code = written.lines().filter(|line| !line.starts_with('('));
        for word in code.flat_map(str::split_whitespace) {
            let (letter, number) = word.split_at(1);
            match letter {
                "F" => fastest = fastest.max(number.parse().unwrap()),
                "S" => turns = turns.max(number.parse().unwrap()),
                _ => {}
            }
        }
    }
    // 1000 mm/min in XY, 10 mm/s in Z, 10 000 rpm.
    assert!(fastest > 999.0 && fastest <= 1000.1, "{fastest}");
    assert_eq!(turns, 10_000.0);
}

#[test]
fn assumed_machine_is_reported() {
    let folder = folder();
    let home = folder.path();
    for command in
        [format!("{CAM} --fix-gaps --to linuxcnc -o out"), "export sensor.drl --to grbl -o a.nc".to_owned()]
    {
        let (exit, told) = answer(home, &command);
        assert_eq!((exit, &told["machine"]), (0, &"virtual".into()), "{told}");
        let diagnostics = told["diagnostics"].as_array().unwrap();
        let note = diagnostics.iter().find(|diagnostic| diagnostic["code"] == "cli.machine_assumed").unwrap();
        assert!(
            text(note, "message").contains("Virtual drill")
                && text(note, "advice").contains("--machine hobby")
        );
        let named = answer(home, &format!("{command} --machine virtual")).1;
        assert!(!codes(&named["diagnostics"]).contains(&"cli.machine_assumed"), "{named}");
    }
}

#[test]
fn cut_out_without_tabs_is_reported() {
    let folder = folder();
    let home = folder.path();
    for (tabs, told) in [(0, true), (4, false)] {
        let output = answer(home, &format!("{CAM} --fix-gaps --to grbl -o out --set cut_out.tabs={tabs}")).1;
        let diagnostics = &output["programs"][0]["diagnostics"];
        assert_eq!(codes(diagnostics).contains(&"cam.no_tabs"), told, "{output}");
    }
    let arguments = format!("{CAM} --fix-gaps --to grbl -o out --set cut_out.tabs=0");
    let said = annulus(home, &arguments.split_whitespace().collect::<Vec<_>>());
    assert!(String::from_utf8_lossy(&said.stderr).contains("the board will come loose"));
}

#[test]
fn written_files_of_every_postprocessor_are_proved() {
    let folder = folder();
    let home = folder.path();
    fs::create_dir(home.join("board")).unwrap();
    for name in super::BOARD {
        fs::rename(home.join(name), home.join("board").join(name)).unwrap();
    }
    for target in ["grbl", "marlin", "linuxcnc", "mach3", "sinumerik", "fanuc", "heidenhain"] {
        let cam = format!(
            "cam board --machine hobby --fix-gaps --to {target} -o {target} --save-job {target}.toml"
        );
        let (exit, told) = answer(home, &cam);
        assert_eq!(exit, 0, "{target}: {told}");
        let files: Vec<&str> =
            told["files"].as_array().unwrap().iter().map(|file| text(file, "file")).collect();
        let prove = format!("prove board {} --job {target}.toml", files.join(" "));
        let (exit, told) = answer(home, &prove);
        assert_eq!(exit, 0, "{target}: {told}");
        for key in ["missing", "doubled", "shifted"] {
            assert_eq!(told["drilled"][key], 0, "{target}: {told}");
        }
    }
}
