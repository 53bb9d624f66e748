//! Tests of height maps on the real firmware: its probe measures a tilted board, and a job follows it.
//! Judged by the step pins: the tool's depth below the instrument's true surface, not the measured one.

use super::bench::{ZERO, ZERO_AT};
use super::firmware::{Board, STEPS, instrument, long_instrument, settings};
use super::jobs;
use super::judge;
use super::sender::Desk;
use serde_json::Value;
use std::fs::{self, File};
use std::io::{BufRead, BufReader};

/// The surface in carriage coordinates: a height, and its slopes along X and Y.
#[derive(Clone, Copy)]
struct Surface([f64; 3]);

impl Surface {
    fn height(self, x: f64, y: f64) -> f64 {
        self.0[0] + self.0[1] * x + self.0[2] * y
    }

    fn option(self) -> String {
        self.0.map(|value| value.to_string()).join(",")
    }
}

/// More than a degree along X, half of that along Y: 0.3 mm below the work zero there.
const ASKEW: Surface = Surface([-19.9, 0.02, -0.01]);
const START: [f64; 3] = [-6.0, -5.0, -4.0];
/// One step, the rounding of homing and reports, and a touch noticed one step late.
const TOLERANCE_MM: f64 = 0.013;

/// Depth of each hole, and smallest and largest depth of all cuts, mm below the surface.
struct Depths {
    holes: Vec<f64>,
    cut: [f64; 2],
    cut_steps: usize,
}

fn depths(board: &Board, start: [f64; 3], surface: Surface) -> Depths {
    let mut at = start;
    let mut found = Depths { holes: Vec::new(), cut: [f64::INFINITY, f64::NEG_INFINITY], cut_steps: 0 };
    let (mut deepest, mut moved) = (0.0_f64, false);
    for line in BufReader::new(File::open(board.edges()).unwrap()).lines() {
        let line = line.unwrap();
        let (axis, to, _) = judge::edge(&line).unwrap_or_else(|| panic!("not an edge: {line}"));
        at[axis] = start[axis] + to as f64 / STEPS;
        let depth = surface.height(at[0], at[1]) - at[2];
        if depth <= 0.0 {
            if deepest > 0.5 && !moved {
                found.holes.push(deepest);
            }
            (deepest, moved) = (0.0, false);
            continue;
        }
        deepest = deepest.max(depth);
        if axis != 2 {
            moved = true;
            found.cut = [found.cut[0].min(depth), found.cut[1].max(depth)];
            found.cut_steps += 1;
        }
    }
    found
}

fn assert_follows(board: &mut Board, start: [f64; 3], surface: Surface) {
    board.end();
    let depths = depths(board, start, surface);
    assert_eq!(depths.holes.len(), 12, "{:?}", depths.holes);
    let off = |depth: f64, wanted: f64| (depth - wanted).abs() > TOLERANCE_MM;
    let wrong: Vec<f64> = depths.holes.iter().copied().filter(|depth| off(*depth, 1.7)).collect();
    assert!(wrong.is_empty(), "holes {wrong:?}");
    assert!(depths.cut_steps > 2_000, "{}", depths.cut_steps);
    assert!(!off(depths.cut[0], 0.12) && !off(depths.cut[1], 0.12), "{:?}", depths.cut);
}

fn number(object: &Value, name: &str) -> f64 {
    object[name].as_f64().unwrap_or_else(|| panic!("no {name} in {object}"))
}

#[test]
fn holes_and_cuts_follow_the_height_map_of_a_tilted_board() {
    let Some(instrument) = instrument() else { return };
    let job = jobs::board();
    let mut board = Board::new(instrument, &settings(true), START, &["--probe-z", &ASKEW.option()]);
    let desk = Desk::new(&job.text);
    let none = desk.run(
        &board,
        &format!("run job.nc {ZERO_AT} --height-map saved --equal-tool-lengths --unattended-tool-change 0"),
    );
    assert_eq!((none.0, &none.1["error"]["code"]), (1, &"level.none_kept".into()), "{}", none.1);
    let (exit, map) = desk.run(&board, &format!("level job.nc {ZERO_AT} --spacing 5"));
    assert_eq!(exit, 0, "{map} {}", desk.said());
    // At the work zero the board is 0.3 mm low; the job is 10 by 18 mm.
    let expected = |x: f64, y: f64| ASKEW.height(x + ZERO[0], y + ZERO[1]) - ZERO[2];
    let (columns, rows) = (number(&map, "columns") as usize, number(&map, "rows") as usize);
    assert_eq!((columns, rows, map["heights_um"].as_array().unwrap().len()), (3, 4, 12));
    for index in 0..12 {
        let share = |axis: usize, at: usize, count: usize| {
            let (low, high) = (map["low_mm"][axis].as_f64().unwrap(), map["high_mm"][axis].as_f64().unwrap());
            low + (high - low) * at as f64 / (count - 1) as f64
        };
        let wanted = expected(share(0, index % columns, columns), share(1, index / columns, rows));
        let found = map["heights_um"][index].as_f64().unwrap() / 1e3;
        assert!((found - wanted).abs() < 0.03, "{index}: {found} not {wanted}");
    }
    // Another zero, and another job: nothing moves down.
    let elsewhere = desk.run(
        &board,
        "run job.nc --zero-at -41,-40,-20 --height-map saved --equal-tool-lengths --unattended-tool-change 0",
    );
    assert_eq!(
        (elsewhere.0, &elsewhere.1["error"]["code"]),
        (1, &"level.other_zero".into()),
        "{}",
        elsewhere.1
    );
    fs::write(desk.path().join("other.nc"), &job.text).unwrap();
    let other = desk.run(
        &board,
        &format!("run other.nc {ZERO_AT} --height-map saved --equal-tool-lengths --unattended-tool-change 0"),
    );
    assert_eq!((other.0, &other.1["error"]["code"]), (1, &"level.other_job".into()), "{}", other.1);
    let (exit, object) = desk.run(
        &board,
        &format!("run job.nc {ZERO_AT} --height-map saved --equal-tool-lengths --unattended-tool-change 0.1"),
    );
    assert_eq!((exit, &object["holes_done"]), (0, &12.into()), "{object} {}", desk.said());
    assert!(number(&object, "largest_correction_um") > 400.0, "{object}");
    assert_follows(&mut board, START, ASKEW);
}

#[test]
fn level_measure_works_without_homing() {
    let Some(instrument) = long_instrument() else { return };
    let here = [-100.0, -100.0, -60.0];
    // The tool touches the board: the touch is the zero.
    let surface = Surface([-60.0 + 100.0 * 0.015 + 100.0 * 0.012, 0.015, 0.012]);
    let mut board = Board::new(instrument, &settings(false), here, &["--probe-z", &surface.option()]);
    let desk = Desk::new(&jobs::board().text);
    let (exit, object) = desk.run(
        &board,
        "run job.nc --zero-here --height-map measure --spacing 6 --equal-tool-lengths \
         --unattended-tool-change 0.1",
    );
    assert_eq!(exit, 0, "{object} {}", desk.said());
    assert!(desk.said().contains("Depth follows the height map, by up to 0.3"), "{}", desk.said());
    // After power-cycling, the position of its zero is lost.
    let (exit, object) = desk.run(
        &board,
        "run job.nc --zero-here --height-map saved --restart --equal-tool-lengths --unattended-tool-change 0",
    );
    assert_eq!((exit, &object["error"]["code"]), (1, &"level.other_zero".into()), "{object}");
    assert_follows(&mut board, here, surface);
}

#[test]
fn missing_board_and_stopped_probing_leave_no_map() {
    let Some(instrument) = long_instrument() else { return };
    let mut board = Board::new(instrument, &settings(true), START, &[]);
    let desk = Desk::new(&jobs::board().text);
    let (exit, object) = desk.run(&board, &format!("level job.nc {ZERO_AT}"));
    assert_eq!((exit, &object["error"]["code"]), (1, &"level.no_board".into()), "{object} {}", desk.said());
    let report = board.end();
    assert_eq!(report["crash_steps"], serde_json::json!([0, 0, 0]), "{report}");
    assert!(!desk.path().join("home/grbl/controller-height-map").exists());
    let mut board = Board::new(instrument, &settings(true), START, &["--probe-z", &ASKEW.option()]);
    let sender = desk.start(&board, &format!("level job.nc {ZERO_AT} --spacing 2"));
    desk.says("4 of ");
    sender.stop();
    let (exit, object) = desk.answer(sender);
    assert_eq!((exit, &object["error"]["code"]), (130, &"level.stopped".into()), "{object} {}", desk.said());
    let rest = board.rests();
    std::thread::sleep(std::time::Duration::from_millis(500));
    assert_eq!(board.rests(), rest);
    assert!(!desk.path().join("home/grbl/controller-height-map").exists());
    board.end();
}
