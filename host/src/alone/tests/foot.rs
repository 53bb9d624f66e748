//! Tests that a presser foot left down by a second STOP is up again before X and Y move, for any kind of
//! move.

use super::*;
use annulus_core::job::Input;
use annulus_core::machine::apply;
use annulus_core::queue::Mode;

/// A presser foot, and drill cycles slow enough to stop within.
fn changes() -> Vec<(String, Value)> {
    let word = |word: &str| Value::Text(word.to_owned());
    let slow = ["stroke.feed", "z.max_speed", "motion.down_speed"].map(|key| (key, Value::Number(4.0)));
    let foot = [("foot.on", word("yes")), ("overlap.on", word("no"))];
    foot.into_iter().chain(slow).map(|(key, value)| (key.to_owned(), value)).collect()
}

fn is_down(status: &Status) -> bool {
    status.inputs & Input::FootDown.bit() != 0
}

/// Presses STOP, and again while the tool rises: later than the second half of a double click.
fn stops_twice(bench: &mut Bench) {
    bench.ask(&Ask::FeedOverride { percent: 10 });
    bench.ask(&Ask::Stop);
    let deep = bench.status().work_mm[2];
    (0..70).for_each(|_| bench.turn(TURN));
    bench.until(|status| status.work_mm[2] > deep + 0.2);
    bench.ask(&Ask::Stop);
    bench.ask(&Ask::FeedOverride { percent: 100 });
}

/// Stopped within a drill cycle, and stopped again while the tool rises.
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
    stops_twice(&mut bench);
    let status = bench.until(|status| status.state == State::Ready);
    assert!(
        status.work_mm[2] < 0.0 && is_down(&status),
        "the tip rests in the board, which is held: {status:?}"
    );
    bench
}

#[test]
fn foot_left_down_by_a_second_stop_is_raised_before_xy_moves() {
    let mut bench = held();
    bench.home();
    let status = bench.status().clone();
    assert_eq!((status.alarm.clone(), is_down(&status)), (None, false), "{status:?}");
    let mut bench = held();
    for (axis, distance_um) in [(2, 8_000), (0, 3_000)] {
        bench.ask(&Ask::Jog { axis, distance_um, anyway: false });
        while bench.status().state == State::Jogging {
            bench.ask(&Ask::JogOn);
            bench.turn(TURN);
        }
        assert_eq!(bench.status().alarm, None, "axis {axis}");
    }
    assert!(!is_down(bench.status()), "{:?}", bench.status());
}

/// Loads a queue and runs it to its end, successful or not.
fn queue(bench: &mut Bench, text: &str) -> Status {
    bench.ask(&Ask::Queue { text: text.to_owned() });
    bench.ask(&Ask::QueueRun { mode: Mode::ToEnd });
    bench.until(|status| matches!(status.state, State::Ready | State::Alarm))
}

#[test]
fn queue_raises_a_foot_left_down_before_xy_moves() {
    let mut bench = held();
    let status = queue(&mut bench, "HOME Z\nMOVE_BY 400 0\n");
    assert_eq!((status.alarm.clone(), is_down(&status)), (None, false), "{status:?}");
    let mut bench = held();
    let status = queue(&mut bench, "HOME ALL\n");
    assert_eq!((status.alarm.clone(), is_down(&status)), (None, false), "{status:?}");
    // The same for a queue that is stopped and held with the foot down.
    let mut bench = held();
    bench.ask(&Ask::Queue { text: "DRILL_UP\nSPINDLE 20000\nDRILL_DOWN\n".to_owned() });
    bench.ask(&Ask::QueueRun { mode: Mode::ToEnd });
    bench.until(|status| status.work_mm[2] > 0.5);
    bench.until(|status| status.work_mm[2] < -1.0);
    stops_twice(&mut bench);
    let status = bench.until(|status| status.state == State::Ready);
    assert!(is_down(&status), "{status:?}");
    let status = queue(&mut bench, "HOME Z\nMOVE_BY 400 0\n");
    assert_eq!((status.alarm.clone(), is_down(&status)), (None, false), "{status:?}");
}

#[test]
fn jogging_the_tool_out_of_the_board_raises_the_foot() {
    let mut bench = held();
    let deep_um = (-1e3 * bench.status().work_mm[2]) as i32;
    for (distance_um, stays) in [(100, true), (deep_um + 1_000, false)] {
        bench.ask(&Ask::Jog { axis: 2, distance_um, anyway: false });
        bench.until(|status| status.state == State::Jogging);
        while bench.status().state == State::Jogging {
            bench.ask(&Ask::JogOn);
            bench.turn(TURN);
        }
        let status = bench.status();
        assert_eq!((status.alarm.clone(), is_down(status)), (None, stays), "{distance_um}: {status:?}");
    }
}
