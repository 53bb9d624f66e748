//! Tests of whole jobs, from the first line to the last: at full speed, with a slow user, and refused at
//! the start.

use super::firmware::{Board, SPEED, STEPS, instrument, settings, steps};
use super::jobs;
use super::judge;
use super::sender::Desk;
use std::time::Duration;

/// Carriage position at power-on, mm: the work zero of machines without switches.
const HERE: [f64; 3] = [-100.0, -100.0, -60.0];

#[test]
fn job_of_three_tools_ends_at_the_exact_steps() {
    let Some(instrument) = instrument() else { return };
    let job = jobs::board();
    let mut board = Board::new(instrument, &settings(false), HERE, &[]);
    let desk = Desk::new(&job.text);
    let (exit, object) =
        desk.run(&board, "run job.nc --zero-here --equal-tool-lengths --unattended-tool-change 0.2");
    assert_eq!(exit, 0, "{object} {}", desk.said());
    assert_eq!((&object["holes_done"], &object["toolpaths_done"]), (&12.into(), &1.into()), "{object}");
    assert_eq!(object["position_trust"], "trusted", "{object}");
    let report = board.end();
    let log = judge::read(&board.edges(), 0);
    assert_eq!(judge::compare(&log, &job.wanted([0; 3]), 0), judge::Verdict::default());
    assert_eq!((log.end, steps(&report)), (job.end_steps([0; 3]), job.end_steps([0; 3])));
    assert_eq!(
        (&report["uart"]["overrun"], &report["spindle"]["starts"]),
        (&0.into(), &3.into()),
        "{report}"
    );
    assert_eq!(report["spindle"]["on"], 0, "{report}");
}

#[test]
fn tool_change_waits_30_s_and_requires_touch_off() {
    let Some(instrument) = instrument() else { return };
    let job = jobs::board();
    let mut board = Board::new(instrument, &settings(false), HERE, &[]);
    let desk = Desk::new(&job.text);
    let mut sender = desk.start(&board, "run job.nc --zero-here");
    for (tool, name) in ["put in 0.8 mm", "put in 1.0 mm", "put in V 30"].into_iter().enumerate() {
        desk.says(&format!("Tool {}: {name}", tool + 1));
        let before = board.rests();
        if tool == 1 {
            std::thread::sleep(Duration::from_secs_f64(30.0 / SPEED));
        }
        let now = board.snapshot();
        assert_eq!((steps(&now), &now["spindle"]["on"]), (before, &0.into()), "{now}");
        // Input after a misunderstood word is not carried out.
        if tool == 0 {
            sender.types("wobble\ngo");
            desk.says("Type x, y or z and mm; zero; probe; or go.");
            assert_eq!((board.rests(), board.snapshot()["spindle"]["on"].clone()), (before, 0.into()));
        }
        // A later tool does not continue before it was touched off.
        if tool == 1 {
            sender.types("go");
            desk.says("was not touched off");
            assert_eq!((board.rests(), board.snapshot()["spindle"]["on"].clone()), (before, 0.into()));
            sender.types("z -8\nzero\nz 8");
        }
        // Jog up and down again, and set the height there: all typed at once.
        if tool == 2 {
            sender.types("z 1.5\nz -1.5\nz -8\nzero\nz 8");
        }
        sender.types("go");
    }
    let (exit, object) = desk.answer(sender);
    assert_eq!(exit, 0, "{object} {}", desk.said());
    board.end();
    let log = judge::read(&board.edges(), 0);
    assert_eq!(judge::compare(&log, &job.wanted([0; 3]), 0), judge::Verdict::default());
    assert_eq!(log.end, job.end_steps([0; 3]));
}

#[test]
fn each_tool_is_probed_and_a_missed_probe_ends_the_job() {
    let Some(instrument) = instrument() else { return };
    let job = jobs::board();
    // The board is at the tool; or nothing is there, as if the clip had come off.
    for (plane, holes) in [("-60,0,0", 12), ("-90,0,0", 0)] {
        let mut board = Board::new(instrument, &settings(false), HERE, &["--probe-z", plane]);
        let desk = Desk::new(&job.text);
        let (exit, object) =
            desk.run(&board, "run job.nc --zero-here --unattended-tool-change 0.1 --probe-depth 12");
        assert_eq!(object["holes_done"], holes, "{object} {}", desk.said());
        let report = board.end();
        assert_eq!(report["spindle"]["on"], 0, "{report}");
        if holes == 0 {
            assert_eq!(
                (exit, &object["error"]["code"]),
                (1, &"grbl.alarm_5".into()),
                "{object} {}",
                desk.said()
            );
            assert_eq!(report["spindle"]["starts"], 0, "{report}");
            continue;
        }
        assert_eq!(exit, 0, "{object} {}", desk.said());
        // At the planned depth below the probed board, within the touch's delay and the report's digits.
        let log = judge::read(&board.edges(), -(0.05 * STEPS) as i64);
        assert_eq!(judge::compare(&log, &job.wanted([0; 3]), 4), judge::Verdict::default());
    }
}

#[test]
fn unmeasured_tools_are_refused_without_motion() {
    let Some(instrument) = instrument() else { return };
    let mut board = Board::new(instrument, &settings(false), HERE, &[]);
    let desk = Desk::new(&jobs::board().text);
    let (exit, object) = desk.run(&board, "run job.nc --zero-here --unattended-tool-change 0");
    assert_eq!((exit, &object["error"]["code"]), (1, &"grbl.tools_unmeasured".into()), "{object}");
    assert_eq!(board.end()["edges_total"], 0);
}

#[test]
fn jobs_that_conflict_with_settings_are_refused_without_motion() {
    let Some(instrument) = instrument() else { return };
    let job = jobs::board();
    for (code, changed, words) in [
        ("grbl.no_zero", None, ""),
        ("grbl.zero_here_homes", Some((22, 1.0)), "--zero-here"),
        ("grbl.laser_mode", Some((32, 1.0)), "--zero-here"),
        ("grbl.too_large", Some((131, 12.0)), "--zero-here"),
        ("grbl.steps_too_fast", Some((110, 9000.0)), "--zero-here"),
    ] {
        let mut board =
            Board::new(instrument, &[settings(false), changed.into_iter().collect()].concat(), HERE, &[]);
        let desk = Desk::new(&job.text);
        let (exit, object) =
            desk.run(&board, &format!("run job.nc --equal-tool-lengths --unattended-tool-change 0 {words}"));
        assert_eq!((exit, &object["error"]["code"]), (1, &code.into()), "{object} {}", desk.said());
        let report = board.end();
        assert_eq!((&report["edges_total"], &report["spindle"]["starts"]), (&0.into(), &0.into()), "{code}");
    }
}
