//! Tests of inputs with filters: short touches are only counted, long ones stop in time.

use crate::rig::{INPUT_PIN, MICRO, MILLI, Rig, SETTINGS};
use crate::stops::{RULE, after, way};
use annulus_link::cutter::{ChunkCutter, Rule};
use annulus_link::message::{Begin, Clear, Configure, Filters, Guard, Place, Refusal, State, Stop, Trust};
use annulus_link::run::Run;
use annulus_link::{AXES, INPUTS};

const LEAST_US: [u16; INPUTS] = [20, 100, 5, 0, 1_000, 0, 0, 40];

fn filtered() -> Rig {
    let mut rig = Rig::ready();
    assert_eq!(rig.say(Filters { least_us: LEAST_US }).state, State::Ready);
    rig
}

#[test]
fn touches_shorter_than_the_filter_are_only_counted() {
    let (runs, ticks) = way();
    let mut rig = filtered();
    let mut touched = [0_u16; INPUTS];
    let mut turns = 0;
    rig.play(&runs, ticks, &RULE, 400_000, |rig| {
        turns += 1;
        // Each input in turn, for a twentieth of its filter up to all of it.
        let input = [0, 1, 2, 4, 7][turns % 5];
        let length = u64::from(LEAST_US[input]) * MICRO * (1 + turns as u64 % 20) / 20;
        rig.pin(INPUT_PIN + input as u8, true);
        rig.pass(length);
        rig.pin(INPUT_PIN + input as u8, false);
        rig.pass(10 * MICRO);
        touched[input] += 1;
        assert_eq!(rig.status.unwrap().inputs, 0);
        false
    });
    assert_eq!(rig.state(), State::Ready, "{:?}", rig.status);
    rig.is_exact(&runs, ticks);
    let counted = rig.count_touches();
    assert!(turns > 50);
    assert_eq!(counted.short, touched);
    println!("{turns} touches, the longest {:?} µs", counted.longest_us);
    for (longest_us, least_us) in counted.longest_us.into_iter().zip(LEAST_US).filter(|(_, least)| *least > 0)
    {
        // A look is up to 5 µs late, and takes time itself.
        assert!((least_us * 3 / 4..=least_us + 8).contains(&longest_us), "{:?}", counted.longest_us);
    }
}

/// While pulses run, touches input `input` for good after this many bounces. Returns the times from the
/// touch to the last pulse's start and end, in µs.
fn stopped_by(rig: &mut Rig, input: u8, bounces: u64) -> [f64; 2] {
    let (runs, ticks) = way();
    rig.say(Place { index: [0; AXES] });
    rig.forget();
    let mut turns = 0;
    rig.play(&runs, ticks, &RULE, 200_000, |rig| {
        turns += u32::from(rig.state() == State::Running);
        turns > 20
    });
    rig.pass(977 * (1 + bounces));
    for _ in 0..bounces {
        rig.pin(INPUT_PIN + input, true);
        rig.pass(3 * MICRO);
        rig.pin(INPUT_PIN + input, false);
        rig.pass(MICRO);
    }
    let since = rig.cycle;
    rig.pin(INPUT_PIN + input, true);
    rig.pass(3 * MILLI);
    rig.until("no stop", |rig| rig.state() == State::Limit);
    rig.is_on_path(&runs, ticks);
    let status = rig.status.unwrap();
    assert_eq!((status.trust, status.input, status.inputs), (Trust::Suspect, input, 1 << input));
    assert_eq!(rig.say(Clear {}).refusal, Refusal::Input);
    let (began, ended) = after(rig, since);
    rig.pin(INPUT_PIN + input, false);
    assert_eq!(rig.say(Clear {}).state, State::Ready);
    [began, ended].map(|cycles| cycles as f64 / MICRO as f64)
}

#[test]
fn long_touch_stops_within_10_us_after_the_filter() {
    let (mut rig, mut latest_us) = (filtered(), 0.0_f64);
    for (input, bounces) in [(0, 0), (0, 3), (1, 0), (1, 5), (2, 0), (2, 2), (3, 0)] {
        let least_us = f64::from(LEAST_US[usize::from(input)]);
        let [began, ended] = stopped_by(&mut rig, input, bounces);
        println!(
            "filter of {least_us} µs: the last pulse began after {began:.2} µs, and was over after {ended:.2} µs"
        );
        // Pulses are at least 4 µs apart, and faster axes run up to the stop.
        assert!(began > least_us - 15.0 && ended < least_us + 10.0, "{began} {ended}");
        latest_us = latest_us.max(ended - least_us);
    }
    println!(
        "measured filter: the last pulse is over {latest_us:.1} µs after the filter of its input at most"
    );
    // Touches 1 µs apart may count as one.
    let short = rig.count_touches().short;
    assert!((1..=3).contains(&short[0]) && (1..=5).contains(&short[1]) && short[3..] == [0; 5], "{short:?}");
}

#[test]
fn filter_expiring_at_the_start_still_stops_the_motor() {
    let (steady, none) = ([Run { count: 5_000, ..Run::one(true, 100) }], [].as_slice());
    let mut rig = Rig::ready();
    rig.say(Filters { least_us: [1_000; INPUTS] });
    // The starting frame arrives just before or after the touch reaches its time.
    for early_us in (0..240).step_by(3) {
        rig.say(Place { index: [0; AXES] });
        rig.forget();
        let first = rig.status.unwrap().chunk;
        let mut cutter = ChunkCutter::new([&steady, none, none, none], 500_000, first, [0; AXES]);
        let piece = cutter.cut(&Rule { ticks: 500_000, ..RULE }).unwrap();
        assert!(rig.offer(&piece) && cutter.is_done());
        rig.until("no path", |rig| rig.sender.pending() == 0);
        assert!(rig.sender.offer(&Begin {}.into()).is_some());
        rig.pin(INPUT_PIN, true);
        rig.pass((1_020 - early_us) * MICRO);
        rig.turn(3 * MILLI);
        let status = rig.status.unwrap();
        let went = rig.pulses(0).len();
        let (is_stopped, index) = (status.state == State::Limit, status.index[0]);
        assert!(is_stopped && went < 30 && index == went as i32, "{early_us} µs: {went} steps, {status:?}");
        rig.pin(INPUT_PIN, false);
        rig.say(Stop {});
        assert_eq!(rig.say(Clear {}).state, State::Ready);
    }
}

#[test]
fn active_low_input_has_its_filter() {
    let mut rig = Rig::new();
    rig.pin(INPUT_PIN + 1, true);
    assert_eq!(rig.say(Configure { low_inputs: 0b10, ..SETTINGS }).state, State::Ready);
    rig.say(Filters { least_us: [0, 50, 0, 0, 0, 0, 0, 0] });
    for length_us in [2, 30, 49] {
        rig.pin(INPUT_PIN + 1, false);
        rig.pass(length_us * MICRO);
        rig.pin(INPUT_PIN + 1, true);
        rig.pass(MILLI);
        assert_eq!(rig.say(Guard { limits: 0b10 }).state, State::Ready);
    }
    let counted = rig.count_touches();
    assert_eq!(counted.short, [0, 3, 0, 0, 0, 0, 0, 0]);
    assert!((49..=55).contains(&counted.longest_us[1]), "{counted:?}");
    rig.pin(INPUT_PIN + 1, false);
    rig.pass(MILLI);
    rig.until("no stop", |rig| rig.state() == State::Limit);
    assert_eq!(rig.count_touches().short[1], 3);
}

#[test]
fn noisy_input_neither_stops_nor_starves_the_pulses() {
    let (runs, ticks) = way();
    let mut rig = filtered();
    let mut storm = 0_u64;
    rig.play(&runs, ticks, &RULE, 400_000, |rig| {
        for _ in 0..40 {
            rig.pin(INPUT_PIN, true);
            rig.pass(60);
            rig.pin(INPUT_PIN, false);
            rig.pass(60 + storm % 7 * 20);
            storm += 1;
        }
        false
    });
    assert_eq!(rig.state(), State::Ready, "{:?}", rig.status);
    rig.is_exact(&runs, ticks);
    let counted = rig.count_touches();
    println!("{storm} touches of half a microsecond, {} counted", counted.short[0]);
    assert!(storm > 2_000 && u64::from(counted.short[0]) > storm / 8);
    assert!(counted.longest_us[0] < LEAST_US[0]);
}

#[test]
fn overlong_filter_is_refused_and_a_new_session_has_none() {
    let mut rig = filtered();
    let status = rig.say(Filters { least_us: [10_001, 0, 0, 0, 0, 0, 0, 0] });
    assert_eq!(status.refusal, Refusal::Settings);
    rig.sender = annulus_link::sender::Sender::new(77);
    (rig.welcome, rig.status) = (None, None);
    assert_eq!(rig.say(SETTINGS).state, State::Ready);
    rig.pin(INPUT_PIN, true);
    rig.pass(3 * MICRO);
    rig.pin(INPUT_PIN, false);
    rig.until("no stop", |rig| rig.state() == State::Limit);
}
