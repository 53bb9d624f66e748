//! Whole jobs from the first line to the last: at a machine's pace, at a person's, and refused before they begin.

use super::firmware::{Board, SPEED, STEPS, instrument, settings, steps};
use super::jobs;
use super::judge;
use super::sender::Desk;
use std::time::Duration;

/// Where the carriage stands when it is turned on, mm: the work zero of machines without switches.
const HERE: [f64; 3] = [-100.0, -100.0, -60.0];

#[test]
fn a_job_of_three_tools_leaves_every_pin_at_the_step_where_its_program_ends() {
    let Some(instrument) = instrument() else { return };
    let job = jobs::board();
    let mut board = Board::new(instrument, &settings(false), HERE, &[]);
    let desk = Desk::new(&job.text);
    let (exit, object) = desk.run(&board, "run job.nc --zero-here --same-length --confirm-tools 0.2");
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
fn a_person_may_take_half_a_minute_over_a_tool() {
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
        // What stands behind a word that was not understood is not done.
        if tool == 0 {
            sender.types("wobble\ngo");
            desk.says("x, y, z with mm; zero; probe; go.");
            assert_eq!((board.rests(), board.snapshot()["spindle"]["on"].clone()), (before, 0.into()));
        }
        // A tool after the first does not go on before it was touched off.
        if tool == 1 {
            sender.types("go");
            desk.says("was not touched off");
            assert_eq!((board.rests(), board.snapshot()["spindle"]["on"].clone()), (before, 0.into()));
            sender.types("z -8\nzero\nz 8");
        }
        // Up by hand and down again, the height set there: all typed at once.
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
fn the_probe_finds_the_board_for_every_tool_and_one_that_meets_nothing_ends_the_job() {
    let Some(instrument) = instrument() else { return };
    let job = jobs::board();
    // The board lies where the tip stands; or nothing is there, as where the clip fell off.
    for (plane, holes) in [("-60,0,0", 12), ("-90,0,0", 0)] {
        let mut board = Board::new(instrument, &settings(false), HERE, &["--probe-z", plane]);
        let desk = Desk::new(&job.text);
        let (exit, object) = desk.run(&board, "run job.nc --zero-here --confirm-tools 0.1 --probe 12");
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
        // As deep as planned below the board that was touched: what a touch is late by, and the digits of a report.
        let log = judge::read(&board.edges(), -(0.05 * STEPS) as i64);
        assert_eq!(judge::compare(&log, &job.wanted([0; 3]), 4), judge::Verdict::default());
    }
}

#[test]
fn tools_that_nobody_would_touch_off_are_refused_before_a_pin_moves() {
    let Some(instrument) = instrument() else { return };
    let mut board = Board::new(instrument, &settings(false), HERE, &[]);
    let desk = Desk::new(&jobs::board().text);
    let (exit, object) = desk.run(&board, "run job.nc --zero-here --confirm-tools 0");
    assert_eq!((exit, &object["error"]["code"]), (1, &"grbl.tools_unmeasured".into()), "{object}");
    assert_eq!(board.end()["edges_total"], 0);
}

#[test]
fn what_does_not_fit_the_settings_is_refused_before_a_pin_moves() {
    let Some(instrument) = instrument() else { return };
    let job = jobs::board();
    for (code, changed, words) in [
        ("grbl.no_zero", None, ""),
        ("grbl.laser_mode", Some((32, 1.0)), "--zero-here"),
        ("grbl.too_large", Some((131, 12.0)), "--zero-here"),
        ("grbl.steps_too_fast", Some((110, 9000.0)), "--zero-here"),
    ] {
        let mut board =
            Board::new(instrument, &[settings(false), changed.into_iter().collect()].concat(), HERE, &[]);
        let desk = Desk::new(&job.text);
        let (exit, object) = desk.run(&board, &format!("run job.nc --same-length --confirm-tools 0 {words}"));
        assert_eq!((exit, &object["error"]["code"]), (1, &code.into()), "{object} {}", desk.said());
        let report = board.end();
        assert_eq!((&report["edges_total"], &report["spindle"]["starts"]), (&0.into(), &0.into()), "{code}");
    }
}
