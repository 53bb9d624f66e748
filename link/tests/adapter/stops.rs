//! Tests that it always stops: a dead bridge, a bad cable, the emergency stop, a limit switch, a hanging
//! program.

use crate::rig::{ALIVE_PIN, INPUT_PIN, MICRO, MILLI, RUN_PIN, Rig, SETTINGS, SPINDLE_PIN, STOP_PIN};
use crate::support::{path, seeds};
use annulus_core::chance::Chance;
use annulus_link::AXES;
use annulus_link::chunk::LONGEST;
use annulus_link::cutter::Rule;
use annulus_link::message::{Clear, Filters, Guard, Outputs, Place, Refusal, State, Trust};
use annulus_link::run::{HALF, Run};
use annulus_link::sender::Sender;

/// Two ramps and a stretch between them on every axis, each with its own speed: 30 ms.
pub(crate) fn way() -> ([Vec<Run>; AXES], u32) {
    let runs = [60, 75, 90, 120].map(|fast: u32| {
        let up = Run { forward: true, count: 200, interval: 4 * fast, fraction: 0, change: 0, phase: HALF };
        let slope = ((3 * fast) << 16) as i32 / 200;
        let length = 240_000 / fast;
        vec![
            Run { change: -slope, ..up },
            Run { interval: fast, count: length, ..up },
            Run { interval: fast, change: slope, ..up },
        ]
    });
    let last = |runs: &Vec<Run>| runs.iter().map(|run| run.extent().unwrap().last).sum::<u32>();
    let ticks = runs.iter().map(last).max().unwrap() + 100;
    (runs, ticks)
}

pub(crate) const RULE: Rule = Rule { ticks: 10_000, fall: 2000, rise: 2000 };

/// Path in the adapter, in ticks: the adapter reports every 10 ms how much is left.
pub(crate) const AHEAD: u32 = 150_000;

/// A bridge that dies after this many packets. Returns whether that was within the path, and how many ms
/// later the last pulse was; `None` if everything had been sent.
fn dies_after(kill: u64, runs: &[Vec<Run>; AXES], ticks: u32) -> Option<(bool, f64)> {
    let mut rig = Rig::ready();
    rig.packets = Some(kill);
    rig.play(runs, ticks, &RULE, AHEAD, |rig| rig.packets == Some(0));
    let (is_over, since) = (rig.packets != Some(0), rig.cycle);
    rig.unplug();
    rig.until_silent();
    let made = rig.is_on_path(runs, ticks);
    rig.rests_at_one_moment(runs, ticks);
    let status = rig.status.unwrap();
    assert!(rig.are_steps_low());
    assert_eq!(status.trust, Trust::Trusted, "{status:?}");
    assert!(matches!(status.state, State::Starved | State::Ready), "{status:?}");
    let last_ms =
        (0..AXES).flat_map(|axis| rig.pulses(axis)).map(|pulse| pulse.cycle.saturating_sub(since)).max();
    let last_ms = last_ms.unwrap_or(0) as f64 / MILLI as f64;
    (!is_over).then_some((status.state == State::Starved && made > 0, last_ms))
}

#[test]
fn dead_bridge_at_any_packet_stops_on_the_path() {
    let (runs, ticks) = way();
    let (mut starved, mut kill, mut longest_ms) = (0, 0_u64, 0.0_f64);
    while let Some((amid, last_ms)) = dies_after(kill, &runs, ticks) {
        starved += u32::from(amid);
        longest_ms = longest_ms.max(last_ms);
        kill += 1;
    }
    println!(
        "measured deaths of the firmware: at every one of {kill} packets, {starved} amid the path, index exact each time, at rest after \
         {longest_ms:.1} ms at most"
    );
    assert!(starved >= 8, "{starved}");
}

#[test]
fn dead_bridge_at_random_packets_stops_on_the_path() {
    let many = std::env::var_os("ANNULUS_LONG").is_some();
    let (mut starved, mut longest_ms) = (0, 0.0_f64);
    for seed in 1..=if many { 1_000 } else { 4 } {
        let mut chance = Chance::new(seed);
        let (runs, ticks) = path(&mut chance, 400_000);
        let Some((amid, last_ms)) = dies_after(chance.below(60) as u64, &runs, ticks) else { continue };
        starved += u32::from(amid);
        longest_ms = longest_ms.max(last_ms);
    }
    println!("{starved} deaths amid the path, at rest after {longest_ms:.1} ms at most");
    assert!(starved > 0);
}

impl Rig {
    fn until_silent(&mut self) {
        for _ in 0..400 {
            self.pass(MILLI);
            if self.state() != State::Running {
                return self.pass(12 * MILLI);
            }
        }
        panic!("it never came to rest: {:?}", self.status);
    }
}

#[test]
fn bad_cable_costs_time_and_never_a_step() {
    let (whole, mut rested) = (way().0.iter().flatten().map(|run| run.count as usize).sum::<usize>(), 0);
    for seed in seeds(3) {
        let (runs, ticks) = way();
        let mut rig = Rig::ready();
        rig.garble = Some((Chance::new(seed), 1500));
        rig.play(&runs, ticks, &RULE, 400_000, |_| false);
        let made = rig.is_on_path(&runs, ticks);
        rig.rests_at_one_moment(&runs, ticks);
        println!("{made} steps, {:?}", rig.state());
        match rig.state() {
            State::Ready => assert_eq!(made, whole),
            State::Starved => assert!(made > 0),
            _ => panic!("{:?}", rig.status),
        }
        rested += u32::from(rig.state() == State::Ready);
    }
    assert!(rested > 0, "once at least all of it came in time");
}

/// Runs of one step on all axes, 0.2 ms apart: they fill a chunk after 12 ms.
fn dense(chance: &mut Chance, ticks: u32) -> ([Vec<Run>; AXES], u32) {
    let step = |chance: &mut Chance| Run::one(true, 2_000 + chance.below(60) as u32);
    let runs = std::array::from_fn(|_| (0..ticks / 2_060).map(|_| step(chance)).collect());
    (runs, ticks + 100)
}

#[test]
fn lost_frame_on_a_dense_path_starves_no_state_machine() {
    let (mut rests, mut longest) = (0, 0);
    for seed in seeds(3) {
        let mut chance = Chance::new(seed);
        let (runs, ticks) = dense(&mut chance, 3_000_000);
        let mut rig = Rig::ready();
        rig.garble = Some((chance, 5_000));
        let rule = Rule { ticks: LONGEST, ..RULE };
        rig.play(&runs, ticks, &rule, 800_000, |_| false);
        let made = rig.is_on_path(&runs, ticks);
        rig.rests_at_one_moment(&runs, ticks);
        println!("{made} steps, {:?}, {} bytes", rig.state(), rig.said);
        assert!(matches!(rig.state(), State::Ready | State::Starved), "{:?}", rig.status);
        rests += u32::from(rig.state() == State::Ready);
        // The alive pin toggles every half millisecond; a longer loop delays it to the next one.
        let alive: Vec<_> =
            rig.edges.iter().filter(|edge| edge.pin == ALIVE_PIN).map(|edge| edge.cycle).collect();
        longest = longest.max(alive.windows(2).map(|two| two[1] - two[0]).max().unwrap());
    }
    let turn = longest.saturating_sub(MILLI / 2);
    println!("a turn of the program takes {:.2} ms at most", turn as f64 / MILLI as f64);
    assert!(rests > 0 && turn < 3 * MILLI / 2, "{rests} {turn}");
}

#[test]
fn silent_bridge_stops_motion_before_the_spindle() {
    let even = |interval: u32| vec![Run { count: 9_000_000 / interval, ..Run::one(true, interval) }];
    let (runs, ticks) = ([even(1_000), even(1_300), even(7_000), vec![]], 9_000_100);
    let mut rig = Rig::ready();
    rig.say(Outputs { on: 1 });
    // Half a second of path is there at the start; then the bridge is silent.
    let rule = Rule { ticks: LONGEST, ..Rule::resting_within(200_000) };
    rig.play(&runs, ticks, &rule, 9_000_000, |rig| rig.state() == State::Running);
    let since = rig.cycle;
    assert!(rig.status.unwrap().resident > 6_000_000, "{:?}", rig.status);
    rig.pass(240 * MILLI);
    let (began, _) = after(&rig, since);
    assert!(began > 239 * MILLI as i64, "it goes on");
    rig.until_silent();
    let (began, ended) = after(&rig, since);
    // 250 ms, words of 2 ms, and stream time that takes 40 ms to stop.
    assert!((250 * MILLI as i64..310 * MILLI as i64).contains(&began), "{began}");
    let status = rig.status.unwrap();
    assert_eq!((status.state, status.trust, status.outputs), (State::Starved, Trust::Trusted, 0));
    rig.is_on_path(&runs, ticks);
    rig.rests_at_one_moment(&runs, ticks);
    let off = rig.edges.iter().rfind(|edge| edge.pin == SPINDLE_PIN && !edge.level).unwrap();
    let off = (off.cycle - since) as i64;
    assert!((ended..ended + 20 * MILLI as i64).contains(&off), "{ended} {off}");
}

fn amid_motion(runs: &[Vec<Run>; AXES], ticks: u32) -> Rig {
    let mut rig = Rig::ready();
    rig.say(Outputs { on: 1 });
    let mut turns = 0;
    rig.play(runs, ticks, &RULE, 400_000, |rig| {
        turns += u32::from(rig.state() == State::Running);
        turns > 20
    });
    rig
}

#[test]
fn hello_during_motion_stops_it_before_the_spindle() {
    let (runs, ticks) = way();
    let mut rig = amid_motion(&runs, ticks);
    let since = rig.cycle;
    rig.sender = Sender::new(99);
    (rig.welcome, rig.status) = (None, None);
    rig.until("no rest", |rig| rig.status.is_some_and(|status| status.state == State::Unset));
    rig.pass(MILLI);
    let (_, ended) = after(&rig, since);
    let status = rig.status.unwrap();
    assert_eq!((status.trust, status.outputs), (Trust::Trusted, 0));
    assert!(rig.is_on_path(&runs, ticks) > 100 && ended > 2 * MILLI as i64);
    rig.rests_at_one_moment(&runs, ticks);
    let off = rig.edges.iter().rfind(|edge| edge.pin == SPINDLE_PIN && !edge.level).unwrap();
    assert!(off.cycle as i64 - since as i64 >= ended, "{} {ended}", off.cycle - since);
}

#[test]
fn only_clear_releases_the_emergency_stop() {
    let mut rig = Rig::ready();
    rig.pin(STOP_PIN, false);
    rig.until("no stop", |rig| rig.state() == State::EmergencyStop);
    rig.pin(STOP_PIN, true);
    rig.edges.clear();
    // A new session identifies and configures it.
    rig.sender = Sender::new(77);
    (rig.welcome, rig.status) = (None, None);
    assert_eq!(rig.say(SETTINGS).state, State::EmergencyStop);
    assert_eq!(rig.say(Guard { limits: 0b1 }).state, State::EmergencyStop);
    assert_eq!(rig.say(Filters { least_us: [50, 0, 0, 0, 0, 0, 0, 0] }).state, State::EmergencyStop);
    rig.pass(5 * MILLI);
    let moved = rig.edges.iter().filter(|edge| [RUN_PIN, ALIVE_PIN].contains(&edge.pin)).count();
    assert_eq!((moved, rig.driven[usize::from(RUN_PIN)]), (0, 0));
    assert_eq!(rig.say(Clear {}).state, State::Ready);
    rig.pass(5 * MILLI);
    assert_eq!(rig.driven[usize::from(RUN_PIN)], 1);
    assert!(rig.edges.iter().filter(|edge| edge.pin == ALIVE_PIN).count() > 5);
    // The settings sent meanwhile are in force.
    rig.pin(INPUT_PIN + 1, true);
    rig.pass(MILLI);
    assert_eq!(rig.say(Guard { limits: 0b1 }).state, State::Ready);
    rig.pin(INPUT_PIN, true);
    rig.until("no stop", |rig| rig.state() == State::Limit);
    assert_eq!(rig.driven[usize::from(RUN_PIN)], 0);
}

/// Start of the last pulse, and the last falling edge of a step pin, in cycles after `since`.
pub(crate) fn after(rig: &Rig, since: u64) -> (i64, i64) {
    let pulses: Vec<_> = (0..AXES).flat_map(|axis| rig.pulses(axis)).collect();
    let cycles = |cycle: u64| cycle as i64 - since as i64;
    let began = pulses.iter().map(|pulse| cycles(pulse.cycle)).max().unwrap();
    let ended = pulses.iter().map(|pulse| cycles(pulse.cycle + pulse.width)).max().unwrap();
    (began, ended)
}

#[test]
fn emergency_stop_ends_pulses_and_outputs_within_10_us() {
    let (runs, ticks) = way();
    let mut rig = Rig::ready();
    let (mut latest, mut worst, mut worst_output) = (i64::MIN, i64::MIN, 0);
    for seed in seeds(8) {
        rig.say(Place { index: [0; AXES] });
        rig.say(Outputs { on: 1 });
        rig.forget();
        let mut turns = 0;
        rig.play(&runs, ticks, &RULE, 200_000, |rig| {
            turns += u32::from(rig.state() == State::Running);
            turns > 20
        });
        rig.pass(Chance::new(seed).below(20_000) as u64);
        let since = rig.cycle;
        assert_eq!(rig.driven[usize::from(SPINDLE_PIN)], 1);
        rig.pin(STOP_PIN, false);
        rig.pass(MILLI);
        let (began, ended) = after(&rig, since);
        (latest, worst) = (latest.max(began), worst.max(began.max(ended)));
        let off = rig
            .edges
            .iter()
            .rfind(|edge| edge.pin == SPINDLE_PIN && !edge.level)
            .expect("the spindle went off");
        worst_output = worst_output.max(off.cycle - since);
        rig.until("no stop", |rig| rig.state() == State::EmergencyStop);
        let status = rig.status.unwrap();
        assert_eq!((status.trust, status.outputs, status.inputs >> 15), (Trust::Lost, 0, 1));
        assert!(rig.are_steps_low());
        rig.is_on_path(&runs, ticks);
        assert_eq!(rig.say(Clear {}).refusal, Refusal::Input);
        assert_eq!(rig.say(Outputs { on: 1 }).outputs, 0);
        let count = rig.edges.len();
        rig.pin(STOP_PIN, true);
        rig.pass(5 * MILLI);
        assert_eq!(rig.edges[count..].iter().filter(|edge| edge.pin < 10).count(), 0, "it goes on by itself");
        assert_eq!(rig.say(Clear {}).state, State::Ready);
    }
    println!(
        "measured emergency: the last step pin is low after {:.2} µs, outputs after {:.2} µs",
        worst as f64 / 120.0,
        worst_output as f64 / 120.0
    );
    assert!(latest < 2 * MICRO as i64, "a new pulse {latest} cycles after it");
    assert!(worst < 10 * MICRO as i64 && worst_output < 10 * MICRO);
}

#[test]
fn limit_switch_stops_at_once_with_an_exact_index() {
    let (runs, ticks) = way();
    for (seed, input) in seeds(4).zip([0, 3, 1, 2]) {
        let mut rig = Rig::ready();
        let mut turns = 0;
        rig.play(&runs, ticks, &RULE, 200_000, |rig| {
            turns += u32::from(rig.state() == State::Running);
            turns > 20
        });
        rig.pass(Chance::new(seed).below(20_000) as u64);
        let since = rig.cycle;
        rig.pin(INPUT_PIN + input, true);
        rig.pass(MILLI);
        let (began, ended) = after(&rig, since);
        assert!(began < 2 * MICRO as i64 && ended < 10 * MICRO as i64, "{began} {ended}");
        rig.until("no stop", |rig| rig.state() == State::Limit);
        rig.is_on_path(&runs, ticks);
        let status = rig.status.unwrap();
        assert_eq!((status.trust, status.input, status.inputs), (Trust::Suspect, input, 1 << input));
        // Moving off the switch works only if it does not stop.
        assert_eq!(rig.say(Clear {}).refusal, Refusal::Input);
        rig.say(Guard { limits: SETTINGS.limits & !(1 << input) });
        assert_eq!(rig.say(Clear {}).state, State::Ready);
        rig.forget();
        let (index, back) =
            (status.index, [vec![Run { count: 50, ..Run::one(false, 500) }], vec![], vec![], vec![]]);
        rig.play(&back, 30_000, &RULE, 200_000, |_| false);
        assert_eq!(rig.state(), State::Ready, "{:?}", rig.status);
        assert_eq!(rig.pulses(0).len(), 50);
        assert_eq!(rig.status.unwrap().index[0], index[0] - 50);
    }
}

#[test]
fn touch_shorter_than_1_us_is_noise() {
    let (runs, ticks) = way();
    let mut rig = Rig::ready();
    let mut turns = 0;
    rig.play(&runs, ticks, &RULE, 400_000, |rig| {
        turns += 1;
        rig.pin(INPUT_PIN, true);
        rig.pass(40 + turns % 40);
        rig.pin(INPUT_PIN, false);
        false
    });
    assert_eq!(rig.state(), State::Ready, "{:?}", rig.status);
    rig.is_exact(&runs, ticks);
    assert!(turns > 50);
}

#[test]
fn alive_pin_toggles_only_if_the_firmware_may_pulse() {
    let mut rig = Rig::ready();
    let moved = |rig: &mut Rig| {
        rig.edges.clear();
        rig.pass(20 * MILLI);
        rig.edges.iter().filter(|edge| edge.pin == ALIVE_PIN).count()
    };
    let well = moved(&mut rig);
    assert!((30..=40).contains(&well), "{well} times in 20 ms");
    rig.pin(STOP_PIN, false);
    rig.pass(MILLI);
    assert_eq!(moved(&mut rig), 0, "the emergency stop is pressed");
    let mut rig = Rig::ready();
    rig.hang();
    assert_eq!(moved(&mut rig), 0, "the program hangs");
}

#[test]
fn hung_firmware_is_reset_and_its_pins_released() {
    let (runs, ticks) = way();
    let mut rig = amid_motion(&runs, ticks);
    let since = rig.cycle;
    rig.hang();
    rig.pass(60 * MILLI);
    // Existing words are played, none of them twice.
    let made: usize = (0..AXES).map(|axis| rig.pulses(axis).len()).sum();
    assert!(after(&rig, since).1 < 3 * MILLI as i64);
    assert_eq!(rig.reset, None);
    rig.pass(60 * MILLI);
    let reset = rig.reset.expect("the watchdog resets it");
    println!("reset {:.1} ms after it hung", (reset - since) as f64 / MILLI as f64);
    assert!((90 * MILLI..110 * MILLI).contains(&(reset - since)));
    assert_eq!((0..AXES).map(|axis| rig.pulses(axis).len()).sum::<usize>(), made);
    assert!(rig.driven.iter().all(|level| *level == 2), "{:?}", rig.driven);
    rig.sender = Sender::new(99);
    (rig.welcome, rig.status) = (None, None);
    rig.edges.clear();
    rig.connect();
    rig.until("no welcome", |rig| rig.welcome.is_some() && rig.status.is_some());
    assert_eq!(rig.welcome.unwrap().by_watchdog, 1);
    let status = rig.status.unwrap();
    assert_eq!((status.state, status.trust, status.outputs), (State::Unset, Trust::Lost, 0));
    assert!(
        (2..10).all(|pin| !rig.edges.iter().any(|edge| edge.pin == pin && edge.level)),
        "a step by itself"
    );
}

#[test]
fn outputs_go_off_250_ms_after_the_bridge_is_silent() {
    let mut rig = Rig::ready();
    assert_eq!(rig.say(Outputs { on: 1 }).outputs, 1);
    let since = rig.cycle;
    rig.pass(240 * MILLI);
    assert_eq!(rig.driven[usize::from(SPINDLE_PIN)], 1);
    rig.pass(15 * MILLI);
    assert_eq!(rig.driven[usize::from(SPINDLE_PIN)], 0, "{} ms", (rig.cycle - since) / MILLI);
}

#[test]
fn port_opened_at_1200_baud_boots_only_at_standstill() {
    let (runs, ticks) = way();
    let mut rig = Rig::ready();
    rig.say(Outputs { on: 1 });
    let mut turns = 0;
    rig.play(&runs, ticks, &RULE, 200_000, |rig| {
        turns += u32::from(rig.state() == State::Running);
        if turns == 10 {
            rig.touch(1200);
        }
        false
    });
    rig.is_exact(&runs, ticks);
    rig.touch(115_200);
    rig.say(Outputs { on: 1 });
    rig.touch(1200);
    assert!(!rig.boots, "at rest between two holes");
    // The session falls silent.
    rig.pass(260 * MILLI);
    assert!(!rig.boots, "what was asked for at the wrong moment is not done later");
    // Another program opens the port at another speed.
    rig.touch(115_200);
    rig.touch(1200);
    assert!(rig.boots);
    assert_eq!(rig.driven[usize::from(SPINDLE_PIN)], 0);
    assert!(rig.are_steps_low());
}
