//! Tests of the feed override of a job.

use super::*;
use annulus_core::steps::Switching;

#[test]
fn feed_override_is_range_checked_and_reported() {
    let mut bench = Bench::new(&machine(), Faults::default());
    bench.start(&grid(&machine(), 12));
    for wrong in [0, 9, 201] {
        let refused = bench.drill.ask(Ask::FeedOverride { percent: wrong }).unwrap_err();
        assert_eq!(refused.code, "control.bad_feed_override");
    }
    bench.drill.ask(Ask::FeedOverride { percent: 40 }).unwrap();
    bench.wait(|status| status.feed_override_percent == 40);
    assert_eq!(bench.ended(), (Ending::Done, 12));
    assert_eq!(bench.record().len(), 12);
}

/// Slowly drilled holes, so that feeds matter.
fn slow_feed(machine: &Machine, count: u32) -> Program {
    let mut program = grid(machine, count);
    for command in program.legs.iter_mut().flat_map(|leg| &mut leg.commands) {
        if let Command::Plunge { feed_um_per_s, .. } = command {
            *feed_um_per_s = 500;
        }
    }
    program
}

#[test]
fn feed_override_above_100_applies_from_the_next_stop() {
    let mut bench = Bench::new(&machine(), Faults::default());
    let refused = bench.drill.ask(Ask::FeedOverride { percent: 150 }).unwrap_err();
    assert_eq!(refused.code, "control.feed_override_needs_job");
    bench.start(&slow_feed(&machine(), 40));
    let rest_after = |holes: u32| {
        bench.wait(|status| status.holes_done >= holes);
        bench.drill.ask(Ask::Pause).unwrap();
        let status = bench.wait(|status| status.state == State::Paused);
        bench.drill.ask(Ask::Resume).unwrap();
        (status.left_s / f64::from(40 - status.holes_done), status.feed_override_percent)
    };
    let (planned, percent) = rest_after(2);
    assert_eq!(percent, 100);
    bench.drill.ask(Ask::FeedOverride { percent: 200 }).unwrap();
    let (fast, percent) = rest_after(12);
    assert_eq!(percent, 200);
    assert!(fast < 0.7 * planned, "{fast} s a hole at 200 %, {planned} at 100 %");
    // Slower at once, and with the program's feeds from the next stop on.
    bench.drill.ask(Ask::FeedOverride { percent: 50 }).unwrap();
    let (slow, percent) = rest_after(20);
    assert_eq!(percent, 50);
    assert!((slow / planned - 2.0).abs() < 0.1, "{slow} s a hole at 50 %, {planned} at 100 %");
    bench.drill.ask(Ask::FeedOverride { percent: 100 }).unwrap();
    assert_eq!(bench.ended(), (Ending::Done, 40));
    assert_eq!(counts(&bench.record(), 40), [1; 40], "every hole once, whatever the feed_override");
}

#[test]
fn pause_and_slower_feed_do_not_wait_for_the_planner() {
    let mut bench = Bench::new(&machine(), Faults::default());
    bench.start(&slow_feed(&machine(), 60));
    // A plan is being made, and takes long.
    let planning = bench.drill.planner.lock().unwrap();
    let drill = bench.drill.clone();
    let faster = std::thread::spawn(move || drill.ask(Ask::FeedOverride { percent: 150 }));
    bench.wait(|status| status.feed_override_percent == 150);
    let slower = bench.drill.begin(Ask::FeedOverride { percent: 50 }, None);
    bench.wait(|status| status.feed_override_percent == 50);
    bench.drill.ask(Ask::Pause).unwrap();
    bench.wait(|status| status.state == State::Paused);
    bench.drill.ask(Ask::Resume).unwrap();
    drop(planning);
    faster.join().unwrap().unwrap();
    slower.finish().unwrap();
    bench.drill.ask(Ask::FeedOverride { percent: 100 }).unwrap();
    assert_eq!(bench.ended(), (Ending::Done, 60));
    assert_eq!(counts(&bench.record(), 60), [1; 60]);
}

#[test]
fn stream_planned_leg_by_leg_equals_the_whole_stream() {
    for (_, machine) in annulus_core::machine::presets() {
        let program = grid(&machine, 40);
        let timeline = annulus_core::motion::timeline(&program, &machine).unwrap();
        let whole = annulus_core::steps::stream(&timeline, &machine).unwrap();
        assert_eq!(annulus_core::steps::stream_of(&program, &machine).unwrap(), whole);
        let packed = annulus_core::steps::Packed::of(&program, &machine).unwrap();
        assert!(packed.start() == whole.start && packed.segments().eq(whole.segments.iter().cloned()));
        let mut before = (0, whole.start);
        for leg in 0..=program.legs.len() {
            let segments = packed.leg(leg);
            let range = before.0..before.0 + segments.len();
            assert_eq!((packed.range(leg), packed.before(leg)), (range.clone(), before.1), "leg {leg}");
            assert_eq!(segments, whole.segments[range.clone()]);
            assert_eq!(packed.ticks(leg), segments.iter().map(|segment| segment.duration_ticks).sum::<u64>());
            let switched = whole.segments[..range.start].iter().map(|segment| segment.effect);
            assert!(
                packed.effects_before(range.start).eq(switched.filter(|effect| *effect != Switching::None))
            );
            before = (range.end, segments.last().map_or(before.1, |last| last.end));
        }
    }
}

#[test]
fn higher_feeds_reach_the_same_positions_and_obey_the_clock() {
    let (machine, program) = (machine(), slow_feed(&machine(), 10));
    let bytes = program::encode(&program);
    let context = prepare::Context {
        machine,
        zero: Some([3_200, 3_200]),
        state: State::Ready,
        trust: Trust::Trusted,
        safe_hz: None,
        spindle_answers: None,
        wear: Vec::new(),
        stock: None,
        offer: None,
        surface: None,
        known: Default::default(),
    };
    let job = prepare::prepare(&program::key(&bytes), &bytes, 0, &context).unwrap();
    let fast = prepare::at_feed(&job, 200).unwrap();
    assert_ne!(fast.digest, job.digest);
    assert!(fast.left_ticks[0] < job.left_ticks[0]);
    assert!((0..program.legs.len()).all(|leg| fast.before_leg(leg) == job.before_leg(leg)));
    assert_eq!(prepare::at_feed(&fast, 100).unwrap().digest, job.digest, "and back");
    let weak = prepare::Prepared { context: prepare::Context { safe_hz: Some(1.0), ..context }, ..job };
    assert_eq!(prepare::at_feed(&weak, 150).err().unwrap().code, "control.faster_than_clock");
}

#[test]
fn homing_succeeds_at_low_feed_overrides() {
    for percent in [10, 30] {
        let bench = Bench::new(&machine(), Faults::default());
        bench.home();
        bench.drill.ask(Ask::Jog { axis: 0, distance_um: 250_000, anyway: false }).unwrap();
        bench.wait(|status| status.state == State::Ready);
        bench.drill.ask(Ask::FeedOverride { percent }).unwrap();
        bench.home();
        let status = bench.status();
        assert_eq!((status.state, status.trust), (State::Ready, Trust::Trusted), "{percent} %: {status:?}");
    }
}
