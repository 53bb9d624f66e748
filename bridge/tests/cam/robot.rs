//! Tests the example of the manual, `docs/manual/robot.md`, from the drawing to a robot's programs. Uses
//! its template, runs its commands, and compares output and files with the manual.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The code blocks of the manual: the text after the three backquotes, and the lines.
fn blocks(manual: &str) -> Vec<(String, Vec<String>)> {
    let mut blocks = Vec::new();
    let mut lines = manual.lines();
    while let Some(line) = lines.next() {
        if let Some(kind) = line.strip_prefix("```") {
            let own = lines.by_ref().take_while(|line| *line != "```").map(str::to_owned).collect();
            blocks.push((kind.to_owned(), own));
        }
    }
    blocks
}

#[test]
fn robot_commands_of_the_manual_give_the_printed_output() {
    let manual = fs::read_to_string(root().join("docs/manual/robot.md")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path();
    fs::copy(root().join("www/drawings/robot.json"), home.join("robot.drawing.json")).unwrap();
    let (mut commands, mut programs) = (0, 0);
    for (kind, lines) in blocks(&manual) {
        match kind.as_str() {
            "toml" => fs::write(home.join("robot.toml"), lines.join("\n") + "\n").unwrap(),
            "console" => {
                let (command, answer) = lines.split_first().unwrap();
                let words = command.strip_prefix("$ annulus ").unwrap().split(' ');
                let mut annulus = Command::new(env!("CARGO_BIN_EXE_annulus"));
                annulus.args(words).current_dir(home).env("ANNULUS_HOME", home.join("home"));
                let output = annulus.output().unwrap();
                assert!(output.status.success(), "{command}: {output:?}");
                let told = String::from_utf8(output.stdout).unwrap();
                assert!(told.starts_with(&(answer.join("\n") + "\n")), "{command}\n{told}");
                commands += 1;
            }
            name => {
                let program = fs::read_to_string(home.join("out").join(name)).unwrap();
                assert!(program.starts_with(&(lines.join("\n") + "\n")), "{name}\n{program}");
                programs += 1;
            }
        }
    }
    assert_eq!((commands, programs), (3, 2));
}

#[test]
fn robot_drawing_has_the_counts_of_the_manual() {
    let manual = fs::read_to_string(root().join("docs/manual/robot.md")).unwrap();
    let drawing = fs::read_to_string(root().join("www/drawings/robot.json")).unwrap();
    let things: serde_json::Value = serde_json::from_str(&drawing).unwrap();
    let things = things["things"].as_object().unwrap();
    for kind in ["node", "track", "pad", "hole", "group"] {
        let count = things.values().filter(|thing| thing.get(kind).is_some()).count();
        assert!(manual.contains(&format!("| {kind}s | {count} |")), "{kind}: {count}");
    }
}
