//! Tests of the feed, rapid and spindle overrides. The controller processes real-time characters every few
//! milliseconds, and two of the same kind within that time count as one.

use super::survey::found;
use super::*;
use annulus_core::grbl::OverrideOf;

impl Bench {
    fn wish(&mut self, of: OverrideOf, percent: u8) {
        self.event(EngineEvent::Ask(EngineAsk::Override { of, percent }));
    }
}

#[test]
fn overrides_reach_their_values_and_stay() {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    bench.told.clear();
    for (feed, rapid, spindle) in [(75, 25, 133), (200, 50, 10), (12, 100, 199), (100, 100, 100)] {
        bench.wish(OverrideOf::Feed, feed);
        bench.wish(OverrideOf::Rapid, rapid);
        bench.wish(OverrideOf::Spindle, spindle);
        let wanted = [feed, rapid, spindle].map(u16::from);
        assert!(bench.until(10_000, |bench| bench.board.overrides == wanted), "{:?}", bench.board.overrides);
        // The values must stay there, and the reports must agree.
        bench.until(5_000, |_| false);
        let reported = bench.engine().status.as_ref().and_then(|status| status.overrides);
        assert_eq!((bench.board.overrides, reported), (wanted, Some(wanted)));
    }
    assert_eq!(found(&bench), Vec::<String>::new());
}

#[test]
fn lower_feed_override_never_overshoots() {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    bench.wish(OverrideOf::Feed, 50);
    bench.until(5_000, |_| false);
    bench.wish(OverrideOf::Feed, 23);
    bench.until(70, |_| false);
    bench.wish(OverrideOf::Feed, 41);
    let mut most = 0;
    for _ in 0..5_000 {
        bench.tick();
        most = most.max(bench.board.overrides[0]);
    }
    assert!(bench.board.overrides[0] == 41 && most <= 50, "{:?} {most}", bench.board.overrides);
}

#[test]
fn lost_override_characters_are_resent_then_reported() {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    bench.told.clear();
    bench.instead = Some((b"\x92", b""));
    bench.wish(OverrideOf::Feed, 70);
    bench.until(80, |_| false);
    assert_eq!(bench.board.overrides[0], 100);
    bench.instead = None;
    assert!(bench.until(10_000, |bench| bench.board.overrides[0] == 70));
    bench.until(5_000, |_| false);
    assert_eq!((bench.board.overrides[0], found(&bench)), (70, vec![]));
    bench.instead = Some((b"\x97", b""));
    bench.wish(OverrideOf::Rapid, 25);
    assert!(bench.until(60_000, |bench| found(bench) == ["grbl.override_not_taken"]), "{:?}", found(&bench));
    let asked =
        bench.told.iter().filter(|action| matches!(action, EngineAction::Write(bytes) if bytes == b"\x97"));
    assert_eq!(asked.count(), 5, "and is not asked for any more");
}

#[test]
fn invalid_override_is_refused_and_reset_ends_pending_ones() {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    for (of, percent, code) in [
        (OverrideOf::Feed, 9, "control.bad_feed_override"),
        (OverrideOf::Feed, 201, "control.bad_feed_override"),
        (OverrideOf::Spindle, 5, "control.bad_spindle_override"),
        (OverrideOf::Rapid, 75, "control.bad_rapid_override"),
    ] {
        bench.told.clear();
        bench.wish(of, percent);
        assert_eq!(found(&bench), [code], "{of:?} {percent}");
    }
    bench.told.clear();
    bench.wish(OverrideOf::Spindle, 200);
    bench.until(60, |_| false);
    bench.board.power_up();
    bench.until(10_000, |_| false);
    assert_eq!((bench.board.overrides, bench.engine().trust), ([100; 3], Trust::Lost));
    bench.unplug();
    bench.told.clear();
    bench.wish(OverrideOf::Spindle, 50);
    assert_eq!(found(&bench), ["grbl.not_now"]);
}

#[test]
fn remaining_overrides_are_reported_before_the_next_job() {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    let told = |bench: &Bench| {
        let found = bench.engine().check(&job(0));
        found
            .into_iter()
            .filter(|why| why.code == "grbl.overrides_stand")
            .map(|why| why.message("en"))
            .collect()
    };
    let stand: Vec<String> = told(&bench);
    assert_eq!(stand, Vec::<String>::new());
    bench.wish(OverrideOf::Feed, 150);
    bench.wish(OverrideOf::Spindle, 60);
    bench.until(10_000, |_| false);
    let stand: Vec<String> = told(&bench);
    assert_eq!(stand, ["Overrides from before are still active: feed 150 %, rapids 100 %, spindle 60 %."]);
    bench.wish(OverrideOf::Feed, 100);
    bench.wish(OverrideOf::Spindle, 100);
    bench.until(10_000, |_| false);
    let stand: Vec<String> = told(&bench);
    assert_eq!(stand, Vec::<String>::new());
}
