//! Tests of `serve`, `link`, `machines` and `doctor` as scripts use them.

use super::client::{Running, annulus, output, take_apart};
use annulus_core::machine::Value as Setting;
use annulus_core::wire::{Ask, Tell};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use tempfile::TempDir;

fn code(object: &Value) -> &str {
    assert_eq!(object["ok"], false, "{object}");
    assert!(object["error"]["advice"].as_str().unwrap().len() > 10, "{object}");
    object["error"]["code"].as_str().unwrap()
}

#[test]
fn serve_prints_one_line_and_ends_on_signals() {
    for (signal, expected) in [(Signal::INT, 130), (Signal::TERM, 0)] {
        let home = TempDir::new().unwrap();
        let mut command = annulus(&home, &["serve", "--port", "0", "--no-open", "--json"]);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        out.read_line(&mut line).unwrap();
        let object: Value = serde_json::from_str(&line).unwrap();
        let (port, token) = take_apart(object["url"].as_str().unwrap());
        assert_eq!((object["ok"].as_bool(), object["port"].as_u64()), (Some(true), Some(port.into())));
        assert_eq!(token.len(), 32, "128 bits");
        kill_process(Pid::from_child(&child), signal).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(expected));
        let mut rest = String::new();
        out.read_to_string(&mut rest).unwrap();
        assert_eq!(rest, "");
    }
}

#[test]
fn port_in_use_is_an_error() {
    let home = TempDir::new().unwrap();
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let (exit, object, text) = output(&home, &["serve", "--no-open", "--json", "--port", &port]);
    assert_eq!((exit, code(&object)), (3, "serve.port_in_use"));
    assert!(text.contains(&port), "{text}");
}

#[test]
fn second_bridge_is_refused_with_the_port_of_the_first() {
    let bridge = Running::start();
    let home = bridge.home.as_ref().unwrap();
    let (exit, object, text) = output(home, &["serve", "--no-open", "--json", "--port", "0"]);
    assert_eq!((exit, code(&object)), (3, "serve.already_running"));
    assert!(text.contains("annulus link") && text.contains(&bridge.port.to_string()), "{text}");
}

#[test]
fn link_lets_another_page_in() {
    let bridge = Running::start();
    let (one, two) = (bridge.link("configure"), bridge.link("configure"));
    assert_ne!(one, two);
    bridge.page();
    let stranger = TempDir::new().unwrap();
    let (exit, object, _) = output(&stranger, &["link", "--json"]);
    assert_eq!((exit, code(&object)), (3, "link.no_bridge"));
}

#[test]
fn bridge_starts_after_a_killed_bridge() {
    let mut bridge = Running::start();
    bridge.child.kill().unwrap();
    bridge.child.wait().unwrap();
    let home = bridge.home.take().unwrap();
    let (exit, object, _) = output(&home, &["link", "--json"]);
    assert_eq!((exit, code(&object)), (3, "link.no_bridge"));
    let again = Running::start_in(home);
    again.page();
}

#[cfg(unix)]
#[test]
fn secret_is_readable_only_by_its_user() {
    use std::os::unix::fs::PermissionsExt;
    let bridge = Running::start();
    let note = bridge.home.as_ref().unwrap().path().join("bridge.json");
    assert_eq!(std::fs::metadata(note).unwrap().permissions().mode() & 0o777, 0o600);
}

#[cfg(unix)]
fn open_to_others(place: &Path) -> Vec<PathBuf> {
    use std::os::unix::fs::PermissionsExt;
    let kind = std::fs::symlink_metadata(place).unwrap();
    let below = kind.is_dir().then(|| std::fs::read_dir(place).unwrap().flatten());
    let below = below.into_iter().flatten().flat_map(|entry| open_to_others(&entry.path()));
    let own = (kind.permissions().mode() & 0o077 != 0).then(|| place.to_owned());
    own.into_iter().chain(below).collect()
}

#[cfg(unix)]
#[test]
fn saved_files_are_private_and_folders_are_created() {
    let board = Path::new(env!("CARGO_MANIFEST_DIR")).join("../www/examples/sensor.drl");
    let board = board.to_str().unwrap();
    let place = TempDir::new().unwrap();
    let home = place.path().join("fresh");
    let ask = |arguments: &[&str]| {
        let mut command = annulus(&place, arguments);
        let output = command.env("ANNULUS_HOME", &home).stdin(Stdio::null()).output().unwrap();
        let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
        (object["error"]["code"].as_str().unwrap_or_default().to_owned(), output)
    };
    // The error must be the missing port, not the missing folder for the program.
    let (why, output) = ask(&["grbl", "run", board, "--port", "/dev/no-such-port", "--json"]);
    assert_ne!(why, "job.not_written", "{output:?}");
    assert!(!output.status.success());
    ask(&["doctor", "--json"]);
    ask(&["run", board, "--time-scale", "2000", "--json"]);
    assert_eq!(open_to_others(&home), Vec::<PathBuf>::new());
    // Files saved by the page are protected too.
    let bridge = Running::start();
    let mut page = bridge.page();
    assert!(page.take_control(false));
    page.ask(&Ask::Configure { changes: vec![("motion.reserve".to_owned(), Setting::Number(0.1))] });
    let home = bridge.home.as_ref().unwrap().path();
    while !home.join("machines/virtual.toml").is_file() {
        page.until(|_| true);
    }
    assert_eq!(open_to_others(home), Vec::<PathBuf>::new());
}

#[cfg(unix)]
#[test]
fn symlinked_folder_is_not_written_through() {
    let (place, elsewhere) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    std::os::unix::fs::symlink(elsewhere.path(), place.path().join("machines")).unwrap();
    let bridge = Running::start_in(place);
    let mut page = bridge.page();
    assert!(page.take_control(false));
    page.ask(&Ask::Configure { changes: vec![("motion.reserve".to_owned(), Setting::Number(0.1))] });
    page.until(|tell| matches!(tell, Tell::Refused { why } if why.code == "machine.file_not_saved"));
    assert_eq!(std::fs::read_dir(elsewhere.path()).unwrap().count(), 0);
}

#[test]
fn wrong_usage_is_one_json_object() {
    let home = TempDir::new().unwrap();
    let rows: [&[&str]; 4] = [
        &["--json", "fly"],
        &["serve", "--port", "many", "--json"],
        &["serve", "--port", "70000", "--json"],
        &["plan", "--json"],
    ];
    for arguments in rows {
        let (exit, object, text) = output(&home, arguments);
        assert_eq!((exit, code(&object)), (2, "cli.usage"), "{arguments:?}");
        assert!(!text.is_empty());
    }
    let (_, object, _) = output(&home, &["run", "a.drl", "--time-scale", "fast", "--json"]);
    let said = object["error"]["message"].as_str().unwrap_or_default();
    assert!(said.contains("a number, such as 1 for real time"), "{said}");
    let (exit, object, _) = output(&home, &["fly"]);
    assert_eq!((exit, object), (2, Value::Null));
    let (exit, _, _) = output(&home, &["--version"]);
    assert_eq!(exit, 0);
}

#[test]
fn machines_lists_presets_and_broken_files() {
    let home = TempDir::new().unwrap();
    let folder = home.path().join("machines");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("broken.toml"), "schema = ").unwrap();
    let (exit, object, text) = output(&home, &["machines", "--json"]);
    assert_eq!((exit, object["ok"].as_bool()), (0, Some(true)));
    let rows = object["machines"].as_array().unwrap();
    let row = |name: &str| rows.iter().find(|row| row["name"] == name).unwrap_or_else(|| panic!("{object}"));
    assert_eq!(row("virtual")["output"], "virtual");
    assert_eq!(row("virtual")["fingerprint"].as_str().unwrap().len(), 64);
    assert_eq!(row("broken")["ok"], false);
    assert!(text.contains("broken.toml"), "{text}");
}

#[test]
fn doctor_compares_latency_with_the_needs_of_a_machine() {
    let home = TempDir::new().unwrap();
    let measured = |name: &str| output(&home, &["doctor", "--machine", name, "--seconds", "1", "--json"]);
    for name in ["lab", "g540"] {
        let (exit, object, text) = measured(name);
        let late = |name: &str| object["late_us"][name].as_f64().unwrap();
        assert!(late("p50") <= late("p99") && late("p99") <= late("max"), "{object}");
        let number = |name: &str| object[name].as_f64().unwrap();
        let good = number("safe_hz") >= number("needs_hz");
        assert_eq!(
            (exit, &object["good"], &object["ok"]),
            (i32::from(!good), &good.into(), &good.into()),
            "{text}"
        );
        assert_eq!(
            object["bars"].as_array().unwrap().iter().filter_map(|bar| bar.as_u64()).sum::<u64>(),
            object["beats"]
        );
    }
    let (exit, object, _) = measured("no-such-machine");
    assert_eq!((exit, &object["error"]["code"]), (3, &"machine.no_such".into()));
    assert_eq!(output(&home, &["doctor", "--seconds", "5", "--json"]).0, 2, "seconds of what?");
}

#[test]
fn doctor_reports_every_check_and_moves_no_files() {
    let home = TempDir::new().unwrap();
    let (exit, object, text) = output(&home, &["doctor", "--json"]);
    assert_eq!((exit, object["ok"].as_bool()), (0, Some(true)), "{object}");
    let names: Vec<_> =
        object["checks"].as_array().unwrap().iter().map(|row| row["name"].as_str().unwrap()).collect();
    assert_eq!(
        names,
        ["data_folder", "runtime_folder", "port", "journal", "timing", "adapter", "converter", "browser"]
    );
    let timing = &object["checks"][4]["numbers"];
    let number = |name: &str| timing[name].as_f64().unwrap();
    assert!(number("p50_us") <= number("p99_us") && number("p99_us") <= number("max_us"), "{timing}");
    assert_eq!(text.lines().count(), names.len());
    let machines = home.path().join("machines");
    std::fs::create_dir_all(&machines).unwrap();
    for (port, code) in [("/nowhere", "doctor.converter_no_port"), ("/dev/null", "doctor.converter")] {
        let text = format!(
            "schema = 1\n[spindle]\nspeed = 20000\n[converter]\nprofile = \"huanyang\"\nport = \"{port}\"\n"
        );
        std::fs::write(machines.join("mill.toml"), text).unwrap();
        let (exit, object, _) = output(&home, &["doctor", "--json"]);
        assert_eq!((exit, &object["checks"][6]["code"]), (0, &code.into()), "{object}");
    }
    std::fs::write(home.path().join("journal.redb"), b"not a journal").unwrap();
    let (exit, object, _) = output(&home, &["doctor", "--json"]);
    assert_eq!((exit, &object["checks"][3]["verdict"]), (1, &"bad".into()), "{object}");
    assert!(home.path().join("journal.redb").exists(), "a doctor moves nothing aside");
    let bridge = Running::start();
    let (_, object, _) = output(bridge.home.as_ref().unwrap(), &["doctor", "--json"]);
    assert_eq!(object["checks"][2]["code"], "doctor.running");
    assert_eq!(object["checks"][3]["code"], "doctor.journal_in_use");
}
