//! Tests of a machine with automatic tool changes, as a real process on a real disk. Killed at random
//! moments, also during changes, it drills every hole with its tool and never pushes one tool onto another.

use annulus_core::chance::Chance;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Number of kills, normally and with `cargo xtask test --long`.
const KILLS: [u32; 2] = [24, 240];

const KILLS_A_BOARD: u32 = 6;

fn board() -> String {
    let holes = |tool: u32| (0..3).map(move |hole| format!("X{}.0Y{}.0\n", 5 + 9 * hole, 5 * tool));
    let of = |tool: u32| format!("T{tool}\n{}", holes(tool).collect::<String>());
    format!("M48\nMETRIC\nT1C0.6\nT2C0.8\nT3C1.0\n%\n{}{}{}M30\n", of(1), of(2), of(3))
}

fn start(home: &Path, loads: bool) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.args(["run", "three.drl", "--machine", "changer.toml", "--time-scale", "400", "--json"]);
    command.args(loads.then_some("--assume-magazine-loaded"));
    let said = fs::OpenOptions::new().create(true).append(true).open(home.join("said.txt")).unwrap();
    command.current_dir(home).env("ANNULUS_HOME", home.join("home")).stdout(Stdio::piped()).stderr(said);
    command.spawn().unwrap()
}

/// How often each hole is in the record, with the tool for its position.
fn record(home: &Path) -> BTreeMap<String, u32> {
    let mut holes = BTreeMap::new();
    for line in fs::read_to_string(home.join("home").join("drilled.txt")).unwrap_or_default().lines() {
        let words: Vec<&str> = line.split(' ').collect();
        *holes.entry(format!("{} {} {}", words[0], words[1], words[words.len() - 1])).or_insert(0) += 1;
    }
    holes
}

#[test]
fn killed_tool_changes_still_drill_each_hole_with_its_tool() {
    let seed = 20_261_126_u64;
    println!("seed {seed}");
    let mut chance = Chance::new(seed);
    let most = KILLS[usize::from(std::env::var_os("ANNULUS_LONG").is_some())];
    let mut kills = 0;
    while kills < most {
        let folder = tempfile::tempdir().unwrap();
        let home = folder.path();
        fs::write(home.join("three.drl"), board()).unwrap();
        fs::write(home.join("changer.toml"), "schema = 1\n[rack]\nchange = \"magazine\"\n").unwrap();
        let (mut loads, mut here) = (true, 0);
        loop {
            let mut child = start(home, loads);
            let began = Instant::now();
            let wait = Duration::from_micros(chance.bits() % 400_000);
            let mut ended = None;
            while here < KILLS_A_BOARD && began.elapsed() < wait && ended.is_none() {
                ended = child.try_wait().unwrap();
                std::thread::sleep(Duration::from_micros(300));
            }
            if ended.is_none() && here < KILLS_A_BOARD {
                child.kill().unwrap();
                child.wait().unwrap();
                (kills, here, loads) = (kills + 1, here + 1, false);
                continue;
            }
            let output = child.wait_with_output().unwrap();
            let text = String::from_utf8_lossy(&output.stdout).into_owned();
            let object: serde_json::Value = serde_json::from_str(&text).unwrap();
            // Killed before the magazine's contents were saved: they must be stated again.
            if object["error"]["code"] == "magazine.spindle_unknown" && record(home).is_empty() && !loads {
                loads = true;
                continue;
            }
            assert!(output.status.success(), "seed {seed}, kill {kills}: {object}");
            assert_eq!(object["drilled"]["broken"], 0, "seed {seed}, kill {kills}: {object}");
            break;
        }
        let holes = record(home);
        let mut tools: Vec<&str> = holes.keys().map(|hole| hole.rsplit(' ').next().unwrap()).collect();
        tools.sort_unstable();
        let expected = [["D0.6000"; 3], ["D0.8000"; 3], ["D1.0000"; 3]].concat();
        assert_eq!(tools, expected, "seed {seed}, kill {kills}: {holes:?}");
        assert!(holes.values().all(|count| *count <= 1 + KILLS_A_BOARD), "{holes:?}");
    }
}
