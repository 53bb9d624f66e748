//! A presser foot that is down where a second STOP holds the lift: it is up again before X and Y move, whoever moves them (C7).

use super::*;
use annulus_core::job::Input;
use annulus_core::machine::apply;
use annulus_core::queue::Mode;

/// A foot, and strokes slow enough to be met in their middle.
fn changes() -> Vec<(String, Value)> {
    let word = |word: &str| Value::Text(word.to_owned());
    let slow = ["stroke.feed", "z.max_speed", "motion.down_speed"].map(|key| (key, Value::Number(4.0)));
    let foot = [("foot.on", word("yes")), ("overlap.on", word("no"))];
    foot.into_iter().chain(slow).map(|(key, value)| (key.to_owned(), value)).collect()
}

fn is_down(status: &Status) -> bool {
    status.inputs & Input::FootDown.bit() != 0
}

/// Stopped in mid-stroke, and stopped again while the tip rises.
fn held() -> Bench {
    let machine = apply(&virtual_drill(), &changes()).unwrap();
    let program = drilled::holes(&machine, 4, 4, |_| 800);
    let mut bench = Bench::open_at(&Memory::default(), 1.0);
    bench.ask(&Ask::Configure { changes: changes() });
    assert_eq!(bench.refused(), None);
    bench.home();
    bench.ask(&Ask::SetZero);
    bench.turn(Duration::from_millis(200));
    bench.start(&program, 0);
    bench.until(|status| status.state == State::ToolChange);
    bench.ask(&Ask::ToolChanged);
    bench.until(|status| status.work_mm[2] < -1.0);
    bench.ask(&Ask::Stop);
    let deep = bench.status().work_mm[2];
    bench.until(|status| status.work_mm[2] > deep + 0.2);
    bench.ask(&Ask::Stop);
    let status = bench.until(|status| status.state == State::Ready);
    assert!(
        status.work_mm[2] < 0.0 && is_down(&status),
        "the tip rests in the board, which is held: {status:?}"
    );
    bench
}

#[test]
fn a_foot_that_a_second_stop_left_down_is_up_before_x_and_y_move() {
    let mut bench = held();
    bench.home();
    let status = bench.status().clone();
    assert_eq!((status.alarm.clone(), is_down(&status)), (None, false), "{status:?}");
    let mut bench = held();
    for (axis, distance_um) in [(2, 8_000), (0, 3_000)] {
        bench.ask(&Ask::Jog { axis, distance_um });
        while bench.status().state == State::Jogging {
            bench.ask(&Ask::JogOn);
            bench.turn(TURN);
        }
        assert_eq!(bench.status().alarm, None, "axis {axis}");
    }
    assert!(!is_down(bench.status()), "{:?}", bench.status());
}

/// Brings a queue and runs it to its end, good or bad.
fn queue(bench: &mut Bench, text: &str) -> Status {
    bench.ask(&Ask::Queue { text: text.to_owned() });
    bench.ask(&Ask::QueueRun { mode: Mode::ToEnd });
    bench.until(|status| matches!(status.state, State::Ready | State::Alarm))
}

#[test]
fn a_queue_that_begins_under_a_foot_that_was_left_down_lifts_it_before_x_and_y_move() {
    let mut bench = held();
    let status = queue(&mut bench, "HOME Z\nMOVE_BY 400 0\n");
    assert_eq!((status.alarm.clone(), is_down(&status)), (None, false), "{status:?}");
    let mut bench = held();
    let status = queue(&mut bench, "HOME ALL\n");
    assert_eq!((status.alarm.clone(), is_down(&status)), (None, false), "{status:?}");
    // What a queue leaves down when it is stopped and held likewise.
    let mut bench = held();
    bench.ask(&Ask::Queue { text: "DRILL_UP\nSPINDLE 20000\nDRILL_DOWN\n".to_owned() });
    bench.ask(&Ask::QueueRun { mode: Mode::ToEnd });
    bench.until(|status| status.work_mm[2] > 0.5);
    bench.until(|status| status.work_mm[2] < -1.0);
    bench.ask(&Ask::Stop);
    let deep = bench.status().work_mm[2];
    bench.until(|status| status.work_mm[2] > deep + 0.2);
    bench.ask(&Ask::Stop);
    let status = bench.until(|status| status.state == State::Ready);
    assert!(is_down(&status), "{status:?}");
    let status = queue(&mut bench, "HOME Z\nMOVE_BY 400 0\n");
    assert_eq!((status.alarm.clone(), is_down(&status)), (None, false), "{status:?}");
}

#[test]
fn a_tip_that_is_taken_out_of_the_board_by_hand_lifts_the_foot_and_one_that_stays_in_it_does_not() {
    let mut bench = held();
    let deep_um = (-1e3 * bench.status().work_mm[2]) as i32;
    for (distance_um, stays) in [(100, true), (deep_um + 1_000, false)] {
        bench.ask(&Ask::Jog { axis: 2, distance_um });
        bench.until(|status| status.state == State::Jogging);
        while bench.status().state == State::Jogging {
            bench.ask(&Ask::JogOn);
            bench.turn(TURN);
        }
        let status = bench.status();
        assert_eq!((status.alarm.clone(), is_down(status)), (None, stays), "{distance_um}: {status:?}");
    }
}
