//! Tests that kill the bridge at random moments, as a real process on a real disk. Only the drilled-board
//! record is judged, which the virtual drill writes hole by hole, independent of the journal.

use annulus_core::chance::Chance;
use annulus_core::geometry::Point;
use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program};
use annulus_core::machine::virtual_drill;
use annulus_core::units::Length;
use annulus_core::wire::program;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Child, Command as Process, Stdio};
use std::time::{Duration, Instant};

pub(crate) const HOLES: u32 = 24;
/// Number of kills, normally and with `cargo xtask test --long`.
const KILLS: [u32; 2] = [200, 1_000];
const KILLS_A_BOARD: u32 = 12;

fn place(hole: u32) -> Point {
    Point::from_mm(f64::from(hole % 6) * 2.0, f64::from(hole / 6) * 2.0)
}

pub(crate) fn board() -> Program {
    let machine = virtual_drill();
    let process = &machine.process;
    let spin_up =
        [Command::Spindle { rpm: 30_000 }, Command::Dwell { us: (process.spin_up_ms * 1e3) as u32 }];
    let mut legs = Vec::new();
    for hole in 0..HOLES {
        if hole % (HOLES / 2) == 0 {
            let bit = hole / (HOLES / 2);
            let mut commands = vec![Command::Spindle { rpm: 0 }, Command::AwaitBit { bit }];
            commands.extend(spin_up);
            legs.push(Leg { mark: Mark::ToolChange(bit), commands });
        }
        let commands = vec![
            Command::Rapid { to: place(hole) },
            Command::Plunge {
                to: -(process.board_thickness + process.breakthrough),
                feed_um_per_s: (process.feed_mm_per_s * 1e3) as u32,
                gate: None,
            },
            Command::Retract { to: process.safe_height },
        ];
        legs.push(Leg { mark: Mark::Hole(hole), commands });
    }
    let commands = vec![Command::Spindle { rpm: 0 }, Command::Rapid { to: Point::default() }];
    legs.push(Leg { mark: Mark::Finish, commands });
    let bit = |mm: f64| Bit {
        diameter: Length::from_mm(mm),
        name: format!("{mm} mm"),
        cutter: Cutter::Drill,
        handling: Default::default(),
    };
    Program {
        name: "kill test".to_owned(),
        machine: machine.fingerprint(),
        origin: Point::default(),
        bits: vec![bit(0.8), bit(1.0)],
        spindles: 1,
        safe_height: process.safe_height,
        legs,
        accepted: Vec::new(),
    }
}

pub(crate) fn start(home: &Path) -> Child {
    Process::new(env!("CARGO_BIN_EXE_annulus"))
        .args(["run", "board.annulus-program", "--machine", "virtual", "--time-scale", "2000", "--json"])
        .current_dir(home)
        .env("ANNULUS_HOME", home)
        .stdout(Stdio::piped())
        .stderr(fs::OpenOptions::new().create(true).append(true).open(home.join("said.txt")).unwrap())
        .spawn()
        .unwrap()
}

/// The holes in the record, in order; checks that every line is complete and belongs to the board.
pub(crate) fn record(home: &Path) -> Vec<u32> {
    let text = fs::read_to_string(home.join("drilled.txt")).unwrap_or_default();
    let rows = text.lines().map(|line| {
        let numbers: Vec<f64> = line.split(' ').map(|word| word.parse().unwrap()).collect();
        let [x, y, depth] = numbers[..] else { panic!("{line}") };
        assert!(depth >= 1.6, "{line}");
        // Work zero is the head's position after homing: 1 mm from the sensors.
        let near = |hole: &u32| {
            (place(*hole).x.mm() + 1.0 - x).abs() < 0.03 && (place(*hole).y.mm() + 1.0 - y).abs() < 0.03
        };
        (0..HOLES).find(near).unwrap_or_else(|| panic!("a hole where none should be: {line}"))
    });
    rows.collect()
}

/// Waits until the record has more than `known` holes, or the child has ended.
pub(crate) fn drilled(home: &Path, known: usize, child: &mut Child) {
    let since = Instant::now();
    // Only complete lines: the last one may be half written.
    let lines = || fs::read_to_string(home.join("drilled.txt")).map_or(0, |text| text.matches('\n').count());
    while lines() <= known && child.try_wait().unwrap().is_none() {
        assert!(since.elapsed() < Duration::from_secs(60), "it drills nothing and does not end");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn finish(mut child: Child) {
    let since = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if since.elapsed() > Duration::from_secs(60) {
            child.kill().unwrap();
            panic!("it hangs");
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    let output = child.wait_with_output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{text}");
    assert!(text.contains("\"stopped_because\":\"done\"") && text.contains("\"holes_done\":24"), "{text}");
    assert!(text.contains("\"position_trust\":\"trusted\""), "{text}");
}

#[test]
fn killed_runs_drill_every_hole_and_at_most_one_twice() {
    let seed: u64 =
        std::env::var("ANNULUS_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(20_261_120);
    let most = KILLS[usize::from(std::env::var_os("ANNULUS_LONG").is_some())];
    println!("seed {seed}");
    let bytes = program::encode(&board());
    let mut chance = Chance::new(seed);
    let (mut kills, mut boards, mut repeats, mut while_drilling) = (0, 0, 0, 0);
    let mut whole_run = Duration::ZERO;
    while kills < most {
        let folder = tempfile::tempdir().unwrap();
        let home = folder.path();
        fs::write(home.join("board.annulus-program"), &bytes).unwrap();
        let mut seen = BTreeSet::new();
        let mut known = 0;
        for round in 0.. {
            let begun = Instant::now();
            let mut child = start(home);
            let left_in_peace = boards == 0 || round >= KILLS_A_BOARD;
            if !left_in_peace {
                let (at_once, share) = (chance.below(2) == 0, chance.unit());
                // Half of them at any moment of the run; the others after a first hole, so that a slow
                // start is no problem.
                if at_once {
                    std::thread::sleep(whole_run.mul_f64(share));
                } else {
                    drilled(home, known, &mut child);
                    std::thread::sleep(whole_run.mul_f64(0.25 * share));
                }
            }
            let over = left_in_peace || child.try_wait().unwrap().is_some();
            if over {
                finish(child);
                whole_run = if boards == 0 { begun.elapsed() } else { whole_run.min(begun.elapsed()) };
            } else {
                child.kill().unwrap();
                child.wait().unwrap();
                kills += 1;
            }
            // New holes of this run: only the first one may have existed before.
            let holes = record(home);
            for (index, hole) in holes[known..].iter().enumerate() {
                let fresh = seen.insert(*hole);
                let said = || fs::read_to_string(home.join("said.txt")).unwrap_or_default();
                let now = &holes[known..];
                assert!(
                    fresh || index == 0,
                    "board {boards}, life {round}: {hole} again in {now:?}\n{}",
                    said()
                );
                repeats += u32::from(!fresh);
            }
            while_drilling += u32::from(!over && holes.len() > known);
            known = holes.len();
            // Killed after the last hole: it is unknown whether the journal had ended the job.
            if over || seen.len() == HOLES as usize {
                break;
            }
        }
        assert_eq!(seen.len(), HOLES as usize, "board {boards}: a hole was left out");
        boards += 1;
    }
    println!(
        "{kills} kills, {while_drilling} of them after a hole was drilled, {boards} boards, {repeats} holes twice"
    );
    assert!(while_drilling >= most / 8, "the kills came too early or too late: {while_drilling}");
}
