//! Tests of a tool setter on the real firmware: each tool is measured before it cuts, and every hole has
//! its planned depth. The instrument's probe has no tool lengths, so its plane represents the setter:
//! `core/tests/grbl/setter.rs` tests different lengths.

use super::bench::{Bench, START, ZERO_AT};
use super::firmware::{STEPS, instrument, long_instrument};
use super::jobs;
use super::judge::{self, Verdict};
use std::fs::File;
use std::io::{BufRead, BufReader};

/// The setter is 5.5 mm higher than this plane would be at the board, which is never probed.
const PLANE: [&str; 2] = ["--probe-z", "-25,-0.05,0"];
const SETTER: &str = "--tool-setter -150,-10,-5 --setter-depth 30 --setter-feeds 300,60";
const X_MM: f64 = -150.0;
const PIN_MM: f64 = -17.5;

/// Visits of the tool to the setter, and its lowest position there, mm.
fn visits(bench: &Bench) -> (usize, f64) {
    let (mut at, mut is_down, mut visits, mut lowest) = (START, false, 0, 0.0_f64);
    for line in BufReader::new(File::open(bench.board.edges()).unwrap()).lines() {
        let line = line.unwrap();
        let (axis, to, _) = judge::edge(&line).unwrap_or_else(|| panic!("not an edge: {line}"));
        at[axis] = START[axis] + to as f64 / STEPS;
        let is_there = (at[0] - X_MM).abs() < 0.1;
        // Once per tool: between its two touches it rises by only a millimetre.
        let was_down = std::mem::replace(&mut is_down, is_there && at[2] < PIN_MM + 2.0);
        visits += usize::from(is_down && !was_down);
        lowest = if is_there { lowest.min(at[2]) } else { lowest };
    }
    (visits, lowest)
}

#[test]
fn tool_setter_gives_every_tool_the_planned_depth() {
    let Some(instrument) = long_instrument() else { return };
    let mut bench = Bench::new(instrument, jobs::board(), &PLANE);
    let words = format!("run job.nc {ZERO_AT} {SETTER} --unattended-tool-change 0.1");
    let (exit, object) = bench.desk.run(&bench.board, &words);
    assert_eq!((exit, &object["holes_done"]), (0, &12.into()), "{object} {}", bench.desk.said());
    assert_eq!(object["position_trust"], "trusted", "{object}");
    let (verdict, report) = bench.judged();
    assert_eq!((verdict, &report["spindle"]["starts"]), (Verdict::default(), &3.into()), "{report}");
    let (visits, lowest) = visits(&bench);
    // The tool that zero was set with, then each of three tools.
    assert_eq!(visits, 4);
    // When the contact closes, the controller still runs its buffered motion: some 60 ms.
    assert!((PIN_MM - 0.35..=PIN_MM + 0.02).contains(&lowest), "{lowest}");
}

#[test]
fn missing_tool_setter_ends_the_job_before_any_cut() {
    let Some(instrument) = instrument() else { return };
    let mut bench = Bench::new(instrument, jobs::board(), &[]);
    for (words, code) in [
        (format!("{ZERO_AT} {SETTER}"), "grbl.alarm_5"),
        (format!("{ZERO_AT} --tool-setter -250,-10,-5"), "setter.no_room"),
    ] {
        let words = format!("run job.nc {words} --unattended-tool-change 0.1");
        let (exit, object) = bench.desk.run(&bench.board, &words);
        assert_eq!((exit, &object["error"]["code"]), (1, &code.into()), "{object} {}", bench.desk.said());
        assert_eq!(object["holes_done"], 0, "{object}");
    }
    assert_eq!(bench.board.end()["spindle"]["starts"], 0);
}
