//! Golden test of the command line: the `--json` answers of about sixty commands, and the bytes of their
//! files. A refactoring must leave them equal. `ANNULUS_BLESS=1` accepts a change.

use annulus_core::wire::auth::sha256;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use std::{env, fs};

/// Longest answer to store in full, in bytes; of longer ones, the digest and field names.
const WHOLE: usize = 4_000;

/// One command per row; each starts with the files that the earlier ones left.
const COMMANDS: [&str; 62] = [
    "inspect sensor",
    "inspect sensor --ignore-siblings",
    "inspect sensor/sensor.drl --units inch --format 2.4 --suppress-zeros leading",
    "inspect drill",
    "inspect drill/packed.zip",
    "inspect drill/headerless.drl",
    "inspect synthetic/x01-repeat-bomb.drl",
    "inspect synthetic/x08-binary-noise.drl",
    "inspect synthetic/x31-zip-bomb.zip",
    "inspect synthetic/d26-slots-and-routing.drl",
    "inspect synthetic/d10-headerless.drl",
    "inspect folders/easyeda-pro-vias-twice",
    "inspect folders/gerber-names-unknown",
    "inspect folders/allegro-film-names",
    "inspect missing",
    "inspect sensor --role sensor-top.gbr=copper:bottom",
    "inspect sensor --role nothing",
    "plan sensor -o board.annulus-program",
    "plan board.annulus-program --order fastest",
    "plan sensor --order file --group ascending --machine six --spindles 2",
    "plan sensor --machine missing",
    "plan sensor --no-mill --loaded 0.8",
    "plan --wrong",
    "plan synthetic/d26-slots-and-routing.drl --accept drill.holes_overlap",
    "simulate sensor",
    "simulate board.annulus-program --digest-trace",
    "simulate sensor --machine lab",
    "simulate sensor --machine six",
    "simulate sensor --machine genmitsu-3018-pro",
    "export sensor --to excellon -o out.drl",
    "export sensor --to grbl -o out-grbl",
    "export sensor --to heidenhain -o out-heidenhain",
    "export sensor --to missing -o out",
    "export sensor --to linuxcnc --arcs-to-lines=0.01 -o out-linuxcnc",
    "cam sensor --to grbl -o cam-grbl --machine genmitsu-3018-pro --save-job job.toml --save-project board.annulus --accept proof.gap",
    "cam sensor --to linuxcnc -o cam-linuxcnc --single-file --set isolate.passes=1 --accept proof.gap",
    "cam sensor --to grbl -o cam-wrong --set isolate.passes=many",
    "cam sensor --to grbl -o cam-job --job job.toml --accept proof.gap",
    "cam board.annulus --to marlin -o cam-project --accept proof.gap",
    "cam sensor --to grbl -o cam-cured --fix-gaps",
    "cam sensor --to grbl -o cam-refused",
    "prove sensor cam-grbl --for grbl",
    "prove sensor out.drl",
    "prove sensor cam-linuxcnc --for linuxcnc --clearance 0.1",
    "prove sensor missing.nc",
    "run sensor --time-scale 5000",
    "run sensor --time-scale 5000 --machine genmitsu-3018-pro --rehearse",
    "run sensor --time-scale 5000 --fault broken-bit@2",
    "run sensor --time-scale 5000 --height-map saved",
    "machines",
    "tools list",
    "tools list --machine six",
    "tools reset 1",
    "templates grbl",
    "templates",
    "queue check home.queue",
    "queue run home.queue --time-scale 5000",
    "lab cycle",
    "lab profile --length-mm 10",
    "lab servo",
    "lab check missing.json",
    "grbl run sensor --port missing",
];

/// The input files: the example board, and folders of test data.
fn lay_out(home: &Path) {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    for (from, to) in [
        ("www/examples", "sensor"),
        ("tests/data/drill", "drill"),
        ("tests/data/synthetic", "synthetic"),
        ("tests/data/folders", "folders"),
    ] {
        copy(&sources.join(from), &home.join(to));
    }
    fs::write(home.join("home.queue"), "HOME ALL\nMOVE_BY 40 0\nMOVE_TO 5.0 10.0\n").unwrap();
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let to = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &to);
        } else {
            fs::copy(entry.path(), to).unwrap();
        }
    }
}

/// Every file below `folder` with its digest, except those of the program's home.
fn digests(folder: &Path, names: &mut BTreeMap<String, String>, below: &str) {
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = format!("{below}{}", entry.file_name().to_string_lossy());
        if name == "home" {
            continue;
        }
        if entry.path().is_dir() {
            digests(&entry.path(), names, &format!("{name}/"));
        } else {
            names.insert(name, sha256(&fs::read(entry.path()).unwrap()));
        }
    }
}

/// The names of all fields of an answer, each once, in order.
fn fields(value: &serde_json::Value, names: &mut Vec<String>) {
    match value {
        serde_json::Value::Object(object) => {
            for (name, value) in object {
                if !names.contains(name) {
                    names.push(name.clone());
                }
                fields(value, names);
            }
        }
        serde_json::Value::Array(rows) => rows.iter().for_each(|row| fields(row, names)),
        _ => {}
    }
}

/// The stored form of a command's output.
fn shown(answer: &str) -> String {
    if answer.len() <= WHOLE {
        return answer.to_owned();
    }
    let mut names = Vec::new();
    fields(&serde_json::from_str(answer).unwrap(), &mut names);
    format!("{} bytes, {}\n{}", answer.len(), sha256(answer.as_bytes()), names.join(" "))
}

#[test]
fn command_output_matches_the_stored_cast() {
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path();
    lay_out(home);
    let mut there = BTreeMap::new();
    digests(home, &mut there, "");
    let mut text = String::new();
    for line in COMMANDS {
        let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
        command.args(line.split_whitespace()).arg("--json").current_dir(home);
        let output = command.env("ANNULUS_HOME", home.join("home")).output().unwrap();
        let answer = String::from_utf8(output.stdout).unwrap();
        let answer = answer.trim_end().replace(home.to_str().unwrap(), "");
        writeln!(text, "$ annulus {line} --json\n{}", shown(&answer)).unwrap();
        writeln!(text, "exit {}", output.status.code().unwrap()).unwrap();
        let mut now = BTreeMap::new();
        digests(home, &mut now, "");
        for (name, digest) in now.iter().filter(|(name, digest)| there.get(*name) != Some(digest)) {
            writeln!(text, "wrote {name} {digest}").unwrap();
        }
        writeln!(text).unwrap();
        there = now;
    }
    compare(&text);
}

#[track_caller]
fn compare(text: &str) {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cast.txt");
    if env::var_os("ANNULUS_BLESS").is_some() {
        return fs::write(path, text).unwrap();
    }
    let expected = fs::read_to_string(path).unwrap();
    let rows = |text: &str| text.split("\n\n").map(str::to_owned).collect::<Vec<_>>();
    for (found, expected) in rows(text).into_iter().zip(rows(&expected)) {
        assert!(found == expected, "was\n{expected}\nis\n{found}");
    }
    assert_eq!(text.len(), expected.len());
}
