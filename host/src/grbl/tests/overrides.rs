//! Tests of feed, spindle and rapid overrides: the page shows the controller's own report.

use super::*;

fn told(status: &Status) -> (u8, Option<u8>, Option<u8>) {
    (status.feed_override_percent, status.spindle_override_percent, status.rapid_override_percent)
}

#[test]
fn page_sets_overrides_and_shows_the_actual_values() {
    let mut bench = Bench::ready(&Memory::default());
    assert_eq!(told(bench.status().unwrap()), (100, Some(100), Some(100)));
    let asks = [
        Ask::FeedOverride { percent: 85 },
        Ask::SpindleOverride { percent: 150 },
        Ask::RapidOverride { percent: 25 },
    ];
    for ask in &asks {
        assert_eq!(bench.refused(ask), None, "{ask:?}");
    }
    bench.until(|status| told(status) == (85, Some(150), Some(25)));
    assert_eq!(bench.board.overrides, [85, 25, 150]);
    // A change made at the machine is reported too, and stays.
    (0..5_000).for_each(|_| bench.millisecond());
    bench.board.hear(&[0x99, 0x96]);
    bench.until(|status| told(status) == (85, Some(100), Some(50)));
    (0..5_000).for_each(|_| bench.millisecond());
    assert_eq!(bench.board.overrides, [85, 50, 100]);
    for (ask, code) in [
        (Ask::SpindleOverride { percent: 9 }, "control.bad_spindle_override"),
        (Ask::RapidOverride { percent: 75 }, "control.bad_rapid_override"),
    ] {
        assert_eq!(bench.refused(&ask).as_deref(), Some(code), "{ask:?}");
    }
}
