//! A presser foot that is down where a second STOP holds the lift: it is up again before X and Y move (C7).

use super::*;
use annulus_core::job::Input;
use annulus_core::machine::apply;

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
