//! Tests of the journal on full or broken disks; only the drilled-board record is judged.

use annulus_core::chance::Chance;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;
use tempfile::TempDir;

const HOLES: usize = 30;

fn shop() -> TempDir {
    let folder = TempDir::new().unwrap();
    let places: String = (0..HOLES).map(|n| format!("X{}.0Y{}.0\n", n % 6 * 2, n / 6 * 2)).collect();
    let board = format!("M48\nMETRIC,TZ\nT1C0.8\n%\nT1\n{places}M30\n");
    fs::write(folder.path().join("board.drl"), board).unwrap();
    folder
}

fn run(folder: &Path, before: &str, arguments: &str) -> Command {
    let line = format!("{before} exec {} run board.drl --json {arguments}", env!("CARGO_BIN_EXE_annulus"));
    let mut shell = Command::new("sh");
    shell.args(["-c", &line]).current_dir(folder).env("ANNULUS_HOME", folder.join("home"));
    shell.stdout(Stdio::piped()).stderr(Stdio::piped());
    shell
}

fn json(output: &Output) -> serde_json::Value {
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text} {output:?}"))
}

fn places(home: &Path) -> BTreeMap<String, usize> {
    let text = fs::read_to_string(home.join("drilled.txt")).unwrap_or_default();
    let mut places = BTreeMap::new();
    for line in text.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        *places.entry(words[..2].join(" ")).or_default() += 1;
    }
    places
}

/// A run killed after some holes: the journal and the record that it left.
fn killed(folder: &Path) -> (Vec<u8>, Vec<u8>) {
    let home = folder.join("home");
    let mut child = run(folder, "", "--time-scale 60").spawn().unwrap();
    while places(&home).len() < 8 {
        assert!(child.try_wait().unwrap().is_none(), "it ended too early");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    (fs::read(home.join("journal.redb")).unwrap(), fs::read(home.join("drilled.txt")).unwrap())
}

fn broken(good: &[u8], round: usize, chance: &mut Chance) -> Vec<u8> {
    let mut bytes = good.to_vec();
    let used = bytes.iter().rposition(|byte| *byte != 0).unwrap_or(0) + 1;
    match round % 5 {
        0 => bytes.truncate(chance.below(good.len())),
        1 => {
            let at = chance.below(used);
            bytes[at] ^= 1 << chance.below(8);
        }
        2 => {
            let (at, length) = (chance.below(used), 1 << chance.below(13));
            bytes.iter_mut().skip(at).take(length).for_each(|byte| *byte = 0);
        }
        3 => {
            for _ in 0..1 << chance.below(10) {
                let at = chance.below(used);
                bytes[at] = chance.below(256) as u8;
            }
        }
        _ => {
            // A sector from another position.
            let (from, to) = (chance.below(used) & !511, chance.below(used) & !511);
            bytes.copy_within(from..(from + 512).min(good.len()), to.min(good.len() - 512));
        }
    }
    bytes
}

#[test]
fn damaged_journal_never_drills_a_board_again_unasked() {
    let rounds = if std::env::var_os("ANNULUS_LONG").is_some() { 100 } else { 15 };
    let folder = shop();
    let home = folder.path().join("home");
    let (journal, record) = killed(folder.path());
    let mut chance = Chance::new(2_026);
    let (mut refused, mut went_on) = (0, 0);
    for round in 0..rounds {
        let _ = fs::remove_dir_all(&home);
        fs::create_dir_all(&home).unwrap();
        fs::write(home.join("journal.redb"), broken(&journal, round, &mut chance)).unwrap();
        fs::write(home.join("drilled.txt"), &record).unwrap();
        let before = places(&home);
        let output = run(folder.path(), "", "--time-scale 2000").env("RUST_BACKTRACE", "1").output().unwrap();
        let (object, after) = (json(&output), places(&home));
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!said.contains("panicked") && !said.contains("backtrace"), "round {round}: {said}");
        let told = object["error"]["code"] == "control.board_differs";
        if output.status.code() == Some(0) || told {
            // Accepted: it resumed where it was, perhaps one record earlier. One hole may be drilled twice
            // by design. If the kill lost one record and the damage another, the second repetition is
            // reported.
            went_on += 1;
            assert_eq!(after.len(), HOLES, "round {round}: {object}");
            let again: usize = after.values().map(|count| count - 1).sum();
            assert!(again <= 2, "round {round}: {again} holes of {} again", before.len());
            assert_eq!(told, again == 2, "round {round}: {again} again: {object}");
        } else {
            refused += 1;
            assert_eq!(object["error"]["code"], "journal.damaged", "round {round}: {object}");
            assert_eq!(after, before, "round {round}: it moved");
        }
    }
    println!("{refused} refused, {went_on} went on where they were");
    assert!(refused > 0 && went_on > 0);
}

#[test]
fn missing_journal_must_be_accepted_before_a_run() {
    let folder = shop();
    let home = folder.path().join("home");
    let (journal, record) = killed(folder.path());
    // Either of these proves that a drill worked here: the virtual drill's record, or an uploaded program.
    for kept in ["drilled.txt", "jobs"] {
        fs::remove_file(home.join("journal.redb")).unwrap();
        match kept {
            "jobs" => fs::remove_file(home.join("drilled.txt")).unwrap(),
            _ => fs::remove_dir_all(home.join("jobs")).unwrap(),
        }
        let before = places(&home);
        for _ in 0..2 {
            let output = run(folder.path(), "", "--time-scale 2000").output().unwrap();
            let error = &json(&output)["error"];
            assert_eq!((output.status.code(), &error["code"]), (Some(1), &"journal.gone".into()), "{kept}");
            assert!(error["advice"].as_str().unwrap().contains("--accept journal.gone"), "{error}");
            assert_eq!(places(&home), before, "{kept}: nothing moves");
        }
        fs::write(home.join("journal.redb"), &journal).unwrap();
        fs::write(home.join("drilled.txt"), &record).unwrap();
        let output = run(folder.path(), "", "--time-scale 2000").output().unwrap();
        assert!(output.status.success(), "the journal as it was is believed: {output:?}");
        assert_eq!(places(&home).len(), HOLES);
        fs::write(home.join("drilled.txt"), &record).unwrap();
    }
    fs::remove_file(home.join("journal.redb")).unwrap();
    let output = run(folder.path(), "", "--time-scale 2000 --accept journal.gone").output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let output = run(folder.path(), "", "--time-scale 2000").output().unwrap();
    assert!(output.status.success(), "asked once, {output:?}");
}

#[test]
fn damaged_journal_is_refused_until_accepted() {
    let folder = shop();
    let home = folder.path().join("home");
    let (mut journal, _) = killed(folder.path());
    // Only the name of its job survives.
    journal.iter_mut().take(4096).for_each(|byte| *byte = 7);
    fs::write(home.join("journal.redb"), &journal).unwrap();
    let before = places(&home);
    for _ in 0..3 {
        let output = run(folder.path(), "", "--time-scale 2000").output().unwrap();
        let object = json(&output);
        assert_eq!((output.status.code(), &object["error"]["code"]), (Some(1), &"journal.damaged".into()));
        let said = object["error"]["message"].as_str().unwrap();
        assert!(said.contains("journal.damaged-1") && said.contains("board"), "{said}");
        assert!(said.contains(&before.values().sum::<usize>().to_string()), "{said}");
        assert!(object["error"]["advice"].as_str().unwrap().contains("--accept journal.damaged"), "{object}");
        assert_eq!(places(&home), before, "nothing moves");
    }
    let output = run(folder.path(), "", "--time-scale 2000 --accept journal.damaged").output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert_eq!(places(&home).len(), HOLES);
    assert_eq!(fs::read(home.join("journal.damaged-1")).unwrap(), journal);
    assert_eq!(
        run(folder.path(), "", "--time-scale 2000").output().unwrap().status.code(),
        Some(0),
        "read once"
    );
}

#[test]
fn unwritable_record_stops_the_job_with_an_error() {
    const BLOCKS: u64 = 40_000;
    let folder = shop();
    let home = folder.path().join("home");
    fs::create_dir_all(&home).unwrap();
    // Room for three more holes below the file size limit.
    let file = fs::File::create(home.join("drilled.txt")).unwrap();
    let full = BLOCKS * 512;
    let line = "6.0000 5.0000 2.0000\n".len() as u64;
    file.set_len(full - 3 * line - line / 2).unwrap();
    let limit = format!("trap '' XFSZ; ulimit -f {BLOCKS};");
    let output = run(folder.path(), &limit, "--time-scale 2000").output().unwrap();
    let object = json(&output);
    assert_eq!((output.status.code(), &object["stopped_because"]), (Some(1), &"alarm".into()), "{object}");
    assert_eq!(object["error"]["code"], "control.record_unwritable", "{object}");
    assert!(object["holes_done"].as_u64().unwrap() < 8, "{object}");
    let text = fs::read(home.join("drilled.txt")).unwrap();
    assert!(text.ends_with(b"\n") && (text.len() as u64) < full, "no half line");
    // With room again the job continues.
    let output = run(folder.path(), "", "--time-scale 2000").output().unwrap();
    assert_eq!((output.status.code(), &json(&output)["holes_done"]), (Some(0), &HOLES.into()), "{output:?}");
}
