//! Tests of `annulus run` as a real process: a board from a drill file, a full disk, corrupted files.

use annulus_core::machine::{Machine, SECTIONS, Value, apply, lab, virtual_drill};
use annulus_core::wire::program;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

const BOARD: &str =
    "M48\nMETRIC,TZ\nT1C0.8\nT2C1.0\n%\nT1\nX5.0Y5.0\nX10.0Y5.0\nX10.0Y9.0\nT2\nX3.0Y3.0\nM30\n";

fn annulus(home: &Path, arguments: &str) -> Output {
    // Through a shell, to set its limits: a maximal file size in blocks of 512 bytes.
    let (limit, rest) = arguments.split_once('|').unwrap_or(("", arguments));
    let line = format!("{limit} exec {} {rest}", env!("CARGO_BIN_EXE_annulus"));
    let mut shell = Command::new("sh");
    shell.args(["-c", &line]).current_dir(home).env("ANNULUS_HOME", home.join("home"));
    shell.output().unwrap()
}

fn json(output: &Output) -> serde_json::Value {
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text} {output:?}"))
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("board.drl"), BOARD).unwrap();
    folder
}

#[test]
fn machine_with_a_controller_needs_a_port_or_a_rehearsal() {
    let folder = folder();
    for machine in ["genmitsu-3018-pro", "shapeoko-3", "fluidnc-3018", "hobby", "3018", "lab", "six"] {
        let output = annulus(folder.path(), &format!("run board.drl --machine {machine} --json"));
        let object = json(&output);
        let code = object["error"]["code"].as_str().unwrap_or_default().to_owned();
        let wanted: &[_] = match machine {
            "lab" | "six" => &[("run.no_output", 2)],
            _ => &[("run.no_port", 2), ("run.no_ports", 3)],
        };
        let found = (code.as_str(), output.status.code().unwrap_or_default());
        assert!(wanted.contains(&found), "{machine}: {object}");
        assert!(!folder.path().join("home/drilled.txt").exists(), "{machine}");
    }
    let output = annulus(
        folder.path(),
        "run board.drl --machine genmitsu-3018-pro --rehearse --time-scale 2000 --json",
    );
    let object = json(&output);
    assert_eq!((output.status.code(), &object["rehearsal"]), (Some(0), &true.into()), "{object}");
    assert_eq!((&object["driven_by"], &object["holes_done"]), (&"virtual_drill".into(), &4.into()));
    let said = annulus(folder.path(), "run board.drl --machine hobby --rehearse --time-scale 2000 --restart");
    let text = String::from_utf8_lossy(&said.stdout).into_owned();
    let claims = text.lines().filter(|line| line.contains("hole"));
    assert!(claims.clone().count() > 0 && claims.clone().all(|line| line.contains("Rehearsal")), "{text}");
}

#[test]
fn controller_flags_are_refused_on_the_virtual_drill() {
    let folder = folder();
    for flag in ["--zero-here", "--probe-depth 3", "--height-map measure", "--baud 9600"] {
        let output = annulus(folder.path(), &format!("run board.drl {flag} --json"));
        let object = json(&output);
        assert_eq!(
            (output.status.code(), &object["error"]["code"]),
            (Some(2), &"run.needs_controller".into()),
            "{flag}: {object}"
        );
    }
    let ports = annulus(folder.path(), "ports --json");
    assert!(json(&ports)["ports"].is_array() && ports.status.code() == Some(0));
}

#[test]
fn port_is_refused_for_a_machine_without_a_controller() {
    let folder = folder();
    let adapter = [("machine.output".to_owned(), Value::Text("adapter".to_owned()))];
    fs::write(folder.path().join("adapter.toml"), file(&apply(&virtual_drill(), &adapter).unwrap())).unwrap();
    let rows = [
        (
            "run board.drl --port nowhere --machine adapter.toml --yes --zero-at 9,9",
            3,
            "adapter.port_unopened",
            "",
        ),
        ("grbl run board.drl --port nowhere --machine adapter.toml", 2, "run.port_of_adapter", "serve"),
        ("grbl check board.drl --port nowhere --machine adapter.toml", 2, "run.port_of_adapter", "serve"),
        ("grbl level board.drl --port nowhere --machine adapter.toml", 2, "run.port_of_adapter", "serve"),
        ("run board.drl --port nowhere --machine virtual", 2, "run.port_of_virtual", "--machine 3018"),
        ("run board.drl --machine adapter.toml < /dev/null", 2, "run.needs_yes", "--yes"),
    ];
    for (words, exit, code, advice) in rows {
        let output = annulus(folder.path(), &format!("{words} --json"));
        let error = &json(&output)["error"];
        assert_eq!((output.status.code(), &error["code"]), (Some(exit), &code.into()), "{words}: {error}");
        assert!(error["advice"].as_str().unwrap_or_default().contains(advice), "{words}: {error}");
    }
    for machine in ["3018", "hobby"] {
        let output =
            annulus(folder.path(), &format!("run board.drl --port nowhere --machine {machine} --json"));
        let code = &json(&output)["error"]["code"];
        assert_eq!((output.status.code(), code), (Some(3), &"grbl.port_unopened".into()), "{machine}");
    }
}

#[test]
fn run_drills_a_board_from_its_file() {
    let folder = folder();
    let output = annulus(folder.path(), "run board.drl --time-scale 2000 --json");
    let object = json(&output);
    assert_eq!(output.status.code(), Some(0), "{object}");
    assert_eq!((object["ok"].as_bool(), object["holes_done"].as_u64()), (Some(true), Some(4)), "{object}");
    assert_eq!((&object["stopped_because"], &object["position_trust"]), (&"done".into(), &"trusted".into()));
    assert_eq!(object["stream_digest"].as_str().map(str::len), Some(64));
    let record = fs::read_to_string(folder.path().join("home/drilled.txt")).unwrap();
    assert_eq!(record.lines().count(), 4);
    let clean =
        serde_json::json!({ "missing": 0, "doubled": 0, "shifted": 0, "broken": 0, "slipped_steps": 0 });
    assert_eq!(object["drilled"], clean);
}

/// A machine file of the laboratory drill with this interrupt frequency.
fn lab_at(interrupts: u32) -> String {
    file(&Machine { interrupt_hz: interrupts, ..lab() })
}

fn file(machine: &Machine) -> String {
    let mut text = "schema = 1\n".to_owned();
    for section in SECTIONS {
        text += &format!("[{}]\n", section.name);
        for row in section.rows {
            let name = row.key.rsplit('.').next().unwrap();
            text += &match row.value(machine) {
                Value::Number(number) => format!("{name} = {number:?}\n"),
                Value::Text(text) => format!("{name} = {text:?}\n"),
                Value::Numbers(numbers) => format!("{name} = {numbers:?}\n"),
                Value::Texts(lines) => format!("{name} = {lines:?}\n"),
            };
        }
    }
    text
}

#[test]
fn lab_drill_loses_steps_at_600_hz_but_not_at_500() {
    let folder = folder();
    fs::write(
        folder.path().join("wide.drl"),
        "M48\nMETRIC\nT1C0.8\n%\nT1\nX5.0Y5.0\nX80.0Y5.0\nX5.0Y60.0\nM30\n",
    )
    .unwrap();
    for interrupts in [500, 600] {
        let file = format!("lab{interrupts}.toml");
        fs::write(folder.path().join(&file), lab_at(interrupts)).unwrap();
        let output =
            annulus(folder.path(), &format!("run wide.drl --machine ./{file} --time-scale 2000 --json"));
        let (object, said) = (json(&output), String::from_utf8_lossy(&output.stderr).into_owned());
        let slips = object["slips"].as_array().unwrap();
        if interrupts == 500 {
            assert_eq!(
                (output.status.code(), slips.len(), said.contains("Lost steps")),
                (Some(0), 0, false),
                "{object}"
            );
            assert_eq!(object["holes_done"], 3);
        } else {
            let slipped = object["drilled"]["slipped_steps"].as_u64();
            assert!(slipped > Some(0) && output.status.code() == Some(1), "{object}");
            assert!(!slips.is_empty() && slips.iter().all(|slip| slip["cause"] == "too_fast"), "{object}");
            assert!(said.contains("At 600 Hz (drive.interrupt_frequency)"), "{said}");
            assert!(said.contains("Lost steps: "), "{said}");
        }
        let planned = json(&annulus(folder.path(), &format!("plan wide.drl --machine ./{file} --json")));
        let warnings = planned["diagnostics"].as_array().unwrap().iter();
        let doubted = warnings.filter(|diagnostic| diagnostic["code"] == "machine.table_loses_steps").count();
        assert_eq!(doubted, usize::from(interrupts == 600), "{planned}");
    }
}

#[test]
fn milling_program_runs_as_simulated() {
    let folder = folder();
    let file = program::encode(&crate::programs::milling(&virtual_drill()));
    fs::write(folder.path().join("milled.annulus-program"), file).unwrap();
    let simulated = json(&annulus(folder.path(), "simulate milled.annulus-program --machine virtual --json"));
    let output =
        annulus(folder.path(), "run milled.annulus-program --machine virtual --time-scale 2000 --json");
    let object = json(&output);
    assert_eq!(output.status.code(), Some(0), "{object}");
    let done = ["holes_done", "toolpaths_done"].map(|key| object[key].as_u64());
    assert_eq!(done, [Some(2), Some(u64::from(crate::programs::WAYS))], "{object}");
    assert_eq!(simulated["stream_digest"], object["stream_digest"]);
    assert_eq!((&object["stopped_because"], &object["position_trust"]), (&"done".into(), &"trusted".into()));
    let record = fs::read_to_string(folder.path().join("home/drilled.txt")).unwrap();
    assert_eq!(record.lines().count(), crate::programs::HOLES.len(), "{record}");
    let time = simulated["time_s"].as_object().unwrap();
    let sum: f64 = time.values().filter_map(serde_json::Value::as_f64).sum();
    assert!((sum - simulated["total_time_s"].as_f64().unwrap()).abs() < 0.01, "{simulated}");
    assert!(time["mill"].as_f64() > time["drill"].as_f64(), "{simulated}");
    let parts = simulated["toolpath_time_s"].as_object().unwrap();
    let parts = ["plunge", "cut", "travel"].map(|part| parts[part].as_f64().unwrap());
    let both = time["mill"].as_f64().unwrap() + time["between"].as_f64().unwrap();
    assert!(parts.iter().all(|part| *part > 0.0), "{simulated}");
    assert!((parts.iter().sum::<f64>() - both).abs() < 0.01, "{simulated}");
    // Four sides of 8 mm with quarter circles of 1 mm. Five turns of 1.5 mm, which descend 2 mm in four. 14
    // mm with a tab.
    let turn = std::f64::consts::TAU;
    let milled = 32.0 + turn + 4.0 * 9.438 + 1.5 * turn + 14.2;
    let found = simulated["milled_mm"].as_f64().unwrap();
    assert!((found - milled).abs() < 0.1, "{found} instead of {milled}");
}

#[test]
fn full_disk_refuses_a_run_before_any_motion() {
    let folder = folder();
    let output = annulus(folder.path(), "trap '' XFSZ; ulimit -f 4; |run board.drl --time-scale 2000 --json");
    let object = json(&output);
    assert_eq!((output.status.code(), object["ok"].as_bool()), (Some(3), Some(false)), "{object}");
    assert_eq!(object["error"]["code"], "journal.cannot_open", "{object}");
    let drilled = fs::read_to_string(folder.path().join("home/drilled.txt")).unwrap_or_default();
    assert_eq!(drilled, "");
    // With room again it works.
    assert_eq!(annulus(folder.path(), "run board.drl --time-scale 2000 --json").status.code(), Some(0));
}

#[test]
fn corrupt_machine_file_is_refused_and_left_unchanged() {
    let folder = folder();
    let file = folder.path().join("home/machines/virtual.toml");
    fs::create_dir_all(file.parent().unwrap()).unwrap();
    let text = "schema = 1\n[x]\nmax_speed = \"fast\"\n";
    fs::write(&file, text).unwrap();
    let output = annulus(folder.path(), "run board.drl --json");
    let error = &json(&output)["error"];
    assert_eq!((output.status.code(), &error["code"]), (Some(1), &"machine.setting_kind".into()));
    assert_eq!((&error["place"]["line"], &error["place"]["column"]), (&3.into(), &13.into()));
    assert_eq!(fs::read_to_string(&file).unwrap(), text);
}

#[test]
fn corrupt_journal_is_moved_aside_once_accepted() {
    let folder = folder();
    fs::create_dir_all(folder.path().join("home")).unwrap();
    fs::write(folder.path().join("home/journal.redb"), [7_u8; 9_000]).unwrap();
    let output = annulus(folder.path(), "run board.drl --time-scale 2000 --json");
    assert_eq!((output.status.code(), &json(&output)["error"]["code"]), (Some(1), &"journal.damaged".into()));
    let output = annulus(folder.path(), "run board.drl --time-scale 2000 --json --accept journal.damaged");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("journal was damaged"), "{said}");
    let kept = fs::read(folder.path().join("home/journal.damaged-1")).unwrap();
    assert_eq!(kept, [7_u8; 9_000]);
}

/// Runs `annulus run`, waits for this many holes in the record, then sends a signal. Independent of time.
#[cfg(unix)]
fn signalled(home: &Path, arguments: &str, holes: usize, signal: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.arg("run").args(arguments.split_whitespace()).current_dir(home);
    command.env("ANNULUS_HOME", home.join("home")).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child: Child = command.spawn().unwrap();
    while fs::read_to_string(home.join("home/drilled.txt")).map_or(0, |text| text.lines().count() + 1)
        <= holes
    {
        assert!(child.try_wait().unwrap().is_none(), "it ended too early");
        std::thread::sleep(Duration::from_millis(2));
    }
    let sent = Command::new("sh").args(["-c", &format!("kill -s {signal} {}", child.id())]).status();
    assert!(sent.unwrap().success());
    child.wait_with_output().unwrap()
}

#[test]
#[cfg(unix)]
fn signals_stop_a_job_with_known_position_and_it_resumes() {
    const HOLES: usize = 200;
    for signal in ["INT", "TERM", "HUP"] {
        let folder = folder();
        let places: String = (0..HOLES).map(|n| format!("X{}.0Y{}.0\n", n % 20 * 2, n / 20 * 2)).collect();
        let board = format!("M48\nMETRIC,TZ\nT1C0.8\n%\nT1\n{places}M30\n");
        fs::write(folder.path().join("board.drl"), board).unwrap();
        let output = signalled(folder.path(), "board.drl --time-scale 20 --json", 3, signal);
        let object = json(&output);
        assert_eq!((output.status.code(), object["ok"].as_bool()), (Some(130), Some(false)), "{object}");
        assert_eq!(
            (&object["stopped_because"], &object["position_trust"]),
            (&"stopped".into(), &"trusted".into())
        );
        assert_eq!(object["error"]["code"], "run.stopped", "{object}");
        assert_eq!(object["resume_with"], "annulus run board.drl --time-scale 20 --json", "{object}");
        assert_eq!(object["stream_digest"].as_str().map(str::len), Some(64));
        let known = object["holes_done"].as_u64().unwrap() as usize;
        let places = || -> Vec<String> {
            let text = fs::read_to_string(folder.path().join("home/drilled.txt")).unwrap();
            text.lines().map(|line| line.rsplit_once(' ').unwrap().0.to_owned()).collect()
        };
        // Stopped below the board, the hole is there but its leg is not completed.
        let before = places().len();
        assert!((2..HOLES).contains(&known) && (known..=known + 1).contains(&before), "{known} {before}");
        let output = annulus(folder.path(), "run board.drl --time-scale 2000 --json");
        let object = json(&output);
        assert_eq!(
            (output.status.code(), object["holes_done"].as_u64()),
            (Some(0), Some(HOLES as u64)),
            "{object}"
        );
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains(&format!("interrupted after {known} holes")), "{said}");
        let twice: Vec<usize> = (known..before).map(|hole| hole + 1).collect();
        assert_eq!((&object["drilled_twice"], &object["drilled"]["doubled"]), (&twice.into(), &0.into()));
        let all = places();
        let different: std::collections::BTreeSet<_> = all.iter().collect();
        assert_eq!((different.len(), all.len() - HOLES), (HOLES, before - known), "{signal}");
    }
}

#[test]
#[cfg(unix)]
fn interrupted_probing_starts_again() {
    let folder = folder();
    let home = folder.path();
    let level = |speed: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
        command
            .args(["level", "board.drl", "--spacing", "1", "--json", "--time-scale", speed])
            .current_dir(home);
        command.env("ANNULUS_HOME", home.join("home")).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    };
    // Ended without a result, at an unknown moment: its measurements are lost.
    let mut child = level("8").spawn().unwrap();
    std::thread::sleep(Duration::from_secs(3));
    let sent = Command::new("sh").args(["-c", &format!("kill -s INT {}", child.id())]).status();
    assert!(sent.unwrap().success() && child.wait().is_ok());
    let output = level("2000").output().unwrap();
    let map = json(&output);
    assert!(output.status.success() && map["heights_um"].as_array().unwrap().len() >= 4, "{map}");
}

#[test]
#[cfg(unix)]
fn interrupt_during_homing_starts_no_job() {
    let folder = folder();
    let output = signalled(folder.path(), "board.drl --time-scale 0.1 --json", 0, "INT");
    let object = json(&output);
    assert_eq!((output.status.code(), object["holes_done"].as_u64()), (Some(130), Some(0)), "{object}");
    assert_eq!((&object["stopped_because"], &object["position_trust"]), (&"stopped".into(), &"lost".into()));
    assert_eq!(fs::read_to_string(folder.path().join("home/drilled.txt")).unwrap(), "");
}

#[test]
fn lab_drill_completes_a_job_with_sensor_ended_cycles() {
    let folder = folder();
    // A drill cycle whose sensor never turns on ends in an alarm, so a completed job reached it at every
    // hole.
    let output = annulus(folder.path(), "run board.drl --machine lab --rehearse --time-scale 200 --json");
    let object = json(&output);
    assert_eq!((output.status.code(), object["holes_done"].as_u64()), (Some(0), Some(4)), "{object}");
    assert_eq!((&object["stopped_because"], &object["position_trust"]), (&"done".into(), &"trusted".into()));
    let text = fs::read_to_string(folder.path().join("home/drilled.txt")).unwrap();
    let holes: Vec<Vec<f64>> =
        text.lines().map(|line| line.split(' ').map(|word| word.parse().unwrap()).collect()).collect();
    let zero = holes.iter().find(|hole| holes.iter().all(|other| hole[0] <= other[0])).unwrap();
    for (x, y) in [(0.0, 0.0), (2.0, 2.0), (7.0, 2.0), (7.0, 6.0)] {
        // A step of this drill is 0.21 mm.
        let near =
            |hole: &&Vec<f64>| (hole[0] - zero[0] - x).abs() < 0.25 && (hole[1] - zero[1] - y).abs() < 0.25;
        assert_eq!(holes.iter().filter(near).count(), 1, "{x} {y}: {text}");
    }
    let simulated = json(&annulus(folder.path(), "simulate board.drl --machine lab --json"));
    assert_eq!(simulated["stream_digest"], object["stream_digest"]);
}

#[test]
fn equal_tool_lengths_can_be_declared_for_one_run() {
    let folder = folder();
    fs::write(folder.path().join("touch.toml"), "schema = 1\n[change]\nlengths = \"touch\"\n").unwrap();
    let run = "run board.drl --machine touch.toml --time-scale 2000 --json";
    let object = json(&annulus(folder.path(), run));
    assert_eq!(object["error"]["code"], "control.length_first", "{object}");
    let object = json(&annulus(folder.path(), &format!("{run} --restart --equal-tool-lengths")));
    assert_eq!((&object["ok"], &object["holes_done"]), (&true.into(), &4.into()), "{object}");
}
