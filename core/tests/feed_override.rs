//! Tests of the feed override: holds and stops at any moment keep to the path and the machine's limits, and
//! every step is counted.

use annulus_core::chance::Chance;
use annulus_core::job::{Gate, Input, Otherwise};
use annulus_core::machine::{Machine, Output, Steps, virtual_drill};
use annulus_core::motion::cycles;
use annulus_core::pins::{
    Clock, Motors, Operator, Order, Outcome, Playhead, Recorder, Written, play, play_on_by_turns, through,
};
use annulus_core::steps::{Segment, TICK_HZ, replay, segment};

struct TestClock {
    late_by: u64,
    chance: Chance,
    now: u64,
}

impl Clock for TestClock {
    fn now(&mut self) -> u64 {
        self.now
    }
    fn wait_until(&mut self, tick: u64) -> u64 {
        let late = if self.late_by > 0 { chance(&mut self.chance, self.late_by) } else { 0 };
        self.now = self.now.max(tick + late);
        self.now
    }
}

struct Script(Vec<(u64, Order)>, u64);

impl Operator for Script {
    fn order(&mut self) -> Order {
        self.0.iter().rev().find(|(from, _)| *from <= self.1).map_or(Order::Go, |(_, order)| *order)
    }
    fn passed(&mut self, tick: u64, _: &Steps, _: u32) {
        assert!(tick >= self.1, "time goes forward");
        self.1 = tick;
    }
}

fn chance(chance: &mut Chance, below: u64) -> u64 {
    chance.bits() % below.max(1)
}

fn travel(machine: &Machine, to: [i64; 2]) -> Segment {
    let mut end = Steps::default();
    [end[0], end[1]] = to;
    let timeline = cycles::go_to(machine, Steps::default(), end).unwrap();
    segment(&timeline.moves[0], machine)
}

struct Played {
    outcome: Outcome,
    line: Playhead,
    pins: Recorder,
}

fn run(
    machine: &Machine,
    segment: &Segment,
    orders: Vec<(u64, Order)>,
    pins: Recorder,
    late_by: u64,
) -> Played {
    let (mut line, mut pins) = (Playhead::default(), pins);
    let mut clock = TestClock { late_by, chance: Chance::new(3), now: 0 };
    let outcome =
        play(segment, &Motors::of(machine), &mut line, &mut pins, &mut clock, &mut Script(orders, 0));
    Played { outcome, line, pins }
}

fn ticks(pins: &Recorder, axis: usize) -> Vec<u64> {
    let steps = pins.written.iter().filter_map(|call| match call {
        Written::Step { tick, axes, .. } if axes >> axis & 1 == 1 => Some(*tick),
        _ => None,
    });
    steps.collect()
}

/// Largest mean speed over 8 steps in steps/s, and its largest change over 16 steps in steps/s².
fn extremes(ticks: &[u64]) -> (f64, f64) {
    let s = |ticks: u64| ticks as f64 / TICK_HZ as f64;
    let speeds: Vec<(f64, f64)> = ticks
        .windows(9)
        .map(|window| ((s(window[0]) + s(window[8])) / 2.0, 8.0 / s(window[8] - window[0])))
        .collect();
    let fastest = speeds.iter().fold(0.0_f64, |fastest, (_, speed)| fastest.max(*speed));
    let changes = speeds.iter().zip(speeds.iter().skip(16));
    let hardest =
        changes.fold(0.0_f64, |hardest, ((t0, v0), (t1, v1))| hardest.max(((v1 - v0) / (t1 - t0)).abs()));
    (fastest, hardest)
}

#[test]
fn pulses_without_orders_match_the_plan() {
    let machine = virtual_drill();
    let travel = travel(&machine, [8_000, -3_000]);
    let played = run(&machine, &travel, vec![], Recorder::default(), 0);
    assert_eq!(played.outcome, Outcome::Completed);
    let planned: Vec<_> = replay(&travel)
        .map(|pulse| Written::Step { tick: pulse.tick, axes: pulse.axes, forward: pulse.forward })
        .collect();
    assert_eq!(played.pins.written, planned);
    assert_eq!((played.line.position, played.line.tick), (travel.end, travel.duration_ticks));
}

#[test]
fn stops_and_holds_stay_on_the_path_and_within_limits() {
    let machine = virtual_drill();
    let mut seed = Chance::new(11);
    let axis = &machine.x;
    let per_mm = axis.scale.steps_per_mm();
    let (speed, acceleration) = (axis.max_speed_mm_per_s * per_mm, axis.max_acceleration_mm_per_s2 * per_mm);
    let (mut stopped, mut held, mut hardest_seen) = (0, 0, 0.0_f64);
    for round in 0..1_500 {
        let span = 200 + chance(&mut seed, 12_000) as i64;
        let to = [span, (chance(&mut seed, 2 * span as u64) as i64) - span];
        let travel = travel(&machine, to);
        let at = chance(&mut seed, travel.duration_ticks);
        let stop = round % 2 == 0;
        let orders = if stop {
            vec![(at, Order::Stop)]
        } else {
            let on = at + chance(&mut seed, 3_000_000);
            vec![(at, Order::Hold), (on, Order::Go)]
        };
        let played = run(&machine, &travel, orders.clone(), Recorder::default(), 0);
        let trace = format!("round {round}: to {to:?}, {orders:?}");
        assert_eq!(played.pins.position, played.line.position, "every step is counted: {trace}");
        // The pulses must be the planned ones in the planned order, and only later.
        let planned: Vec<_> = replay(&travel).collect();
        for (call, pulse) in played.pins.written.iter().zip(&planned) {
            let Written::Step { tick, axes, forward } = call else { panic!("{trace}") };
            assert_eq!((*axes, *forward), (pulse.axes, pulse.forward), "{trace}");
            assert!(*tick + 2 >= pulse.tick, "never early: {trace}");
        }
        match played.outcome {
            Outcome::Completed => assert_eq!(played.line.position, travel.end, "{trace}"),
            Outcome::Stopped => assert!(stop && played.pins.written.len() < planned.len(), "{trace}"),
            other => panic!("{other:?}: {trace}"),
        }
        stopped += u32::from(played.outcome == Outcome::Stopped);
        held += u32::from(!stop && played.line.tick > travel.duration_ticks + 10);
        for axis in 0..2 {
            let (fastest, hardest) = extremes(&ticks(&played.pins, axis));
            // Steps are integers: over 16 of them the mean is off by a fraction of a step at both ends.
            // Steps of the slower axis are spaced evenly between two steps of the faster one.
            let leads = to[axis].abs() >= to[1 - axis].abs();
            let tolerance = if leads { 1.25 } else { 1.5 };
            hardest_seen = hardest_seen.max(hardest / acceleration);
            assert!(fastest <= speed * 1.01, "{fastest} steps/s: {trace}");
            assert!(hardest <= acceleration * tolerance, "{hardest} steps/s² on axis {axis}: {trace}");
        }
    }
    println!("{stopped} stopped on the way, {held} held and went on; hardest {hardest_seen:.2} of the limit");
    assert!(stopped > 500 && held > 500, "{stopped} {held}");
}

#[test]
fn hold_at_the_first_steps_adds_only_its_own_time() {
    let machine = virtual_drill();
    let travel = travel(&machine, [8_000, 1_000]);
    let first = replay(&travel).next().unwrap().tick;
    for (from, hold) in [(0, 500_000), (first, 500_000), (first + 1, 2_000_000), (first + 40_000, 500_000)] {
        let orders = vec![(from, Order::Hold), (from + hold, Order::Go)];
        let played = run(&machine, &travel, orders, Recorder::default(), 0);
        assert_eq!(played.outcome, Outcome::Completed);
        let longer = played.line.tick - travel.duration_ticks;
        // In addition to the hold: deceleration, acceleration, and the wait between two checks.
        assert!(longer < hold + 400_000, "held at {from} for {hold}: {longer} ticks longer");
        let last: Vec<u64> = ticks(&played.pins, 0).into_iter().rev().take(4_000).collect();
        let planned: Vec<u64> =
            replay(&travel).filter(|pulse| pulse.axes & 1 == 1).map(|pulse| pulse.tick).collect();
        let planned: Vec<u64> = planned.into_iter().rev().take(4_000).collect();
        for (step, plan) in last.windows(2).zip(planned.windows(2)) {
            assert_eq!(step[0] - step[1], plan[0] - plan[1], "held at {from} for {hold}");
        }
    }
}

#[test]
fn lateness_is_never_caught_up() {
    let machine = virtual_drill();
    let travel = travel(&machine, [2_000, 500]);
    let on_time = run(&machine, &travel, vec![], Recorder::default(), 0);
    let late = run(&machine, &travel, vec![], Recorder::default(), 5_000);
    assert_eq!(on_time.pins.written, late.pins.written, "stream time does not know lateness");
    assert!(late.line.late > 0);
}

/// A clock that is late once, by `by`, when asked for a tick from `at` on.
struct LateOnce {
    at: u64,
    by: u64,
    now: u64,
}

impl Clock for LateOnce {
    fn now(&mut self) -> u64 {
        self.now
    }
    fn wait_until(&mut self, tick: u64) -> u64 {
        let late = if tick >= self.at { std::mem::take(&mut self.by) } else { 0 };
        self.now = self.now.max(tick + late);
        self.now
    }
}

#[test]
fn late_step_of_a_turning_motor_ends_the_move() {
    let mut machine = virtual_drill();
    let travel = travel(&machine, [20_000, 0]);
    let middle = travel.duration_ticks / 2;
    let interval = {
        let (mut before, mut found) = (0, 0);
        for pulse in replay(&travel).take_while(|pulse| pulse.tick <= middle) {
            (found, before) = (pulse.tick - before, pulse.tick);
        }
        found
    };
    let mut outcome = |output: Output, at: u64, by: u64| {
        machine.output = output;
        let (mut line, mut pins) = (Playhead::default(), Recorder::default());
        let mut clock = LateOnce { at, by, now: 0 };
        let motors = Motors::of(&machine);
        let outcome = play(&travel, &motors, &mut line, &mut pins, &mut clock, &mut Script(vec![], 0));
        (outcome, line.position[0])
    };
    let (late, rest) = outcome(Output::Card, middle, 20 * interval);
    assert_eq!(late, Outcome::Late { ticks: 20 * interval });
    assert!((10_000..20_000).contains(&rest), "it comes to rest on its way: {rest}");
    assert_eq!(outcome(Output::Card, middle, interval / 4).0, Outcome::Completed, "a little late");
    assert_eq!(outcome(Output::Card, 0, 20 * interval).0, Outcome::Completed, "late before the first step");
    // The virtual drill runs by stream time; real time only paces it.
    assert_eq!(outcome(Output::Virtual, middle, 20 * interval).0, Outcome::Completed);
}

#[test]
fn gate_deadline_counts_planned_time() {
    let machine = virtual_drill();
    let mut seek = travel(&machine, [-4_000, 0]);
    let half_way = 2 * seek.duration_ticks;
    seek.gate = Some(Gate {
        input: Input::XMin,
        deadline_us: u32::try_from(seek.duration_ticks / 10).unwrap() + 500_000,
        otherwise: Otherwise::Alarm,
    });
    let pins = Recorder { script: vec![(half_way, Input::XMin.bit())], ..Recorder::default() };
    // At a feed override of 25 % the sensor turns on after twice the planned duration of the whole move.
    let slow = run(&machine, &seek, vec![(0, Order::At { percent: 25 })], pins, 0);
    assert!(matches!(slow.outcome, Outcome::Gated(_)), "{:?}", slow.outcome);
    let never = run(&machine, &seek, vec![(0, Order::At { percent: 25 })], Recorder::default(), 0);
    assert_eq!(never.outcome, Outcome::Unmet(seek.gate.unwrap()));
}

#[test]
fn gates_end_a_move_and_guards_stop_it() {
    let machine = virtual_drill();
    let mut seek = travel(&machine, [-4_000, 0]);
    let half = seek.duration_ticks / 2;
    let on = |input: Input| Recorder { script: vec![(half, input.bit())], ..Recorder::default() };
    let guarded = run(&machine, &seek, vec![], on(Input::XMin), 0);
    assert_eq!(guarded.outcome, Outcome::Guarded(Input::XMin));
    let otherwise = run(&machine, &seek, vec![], on(Input::XMax), 0);
    assert_eq!(otherwise.outcome, Outcome::Completed, "only the sensor ahead counts");

    let gate = Gate { input: Input::XMin, deadline_us: 60_000_000, otherwise: Otherwise::Alarm };
    seek.gate = Some(gate);
    let gated = run(&machine, &seek, vec![], on(Input::XMin), 0);
    let Outcome::Gated(at) = gated.outcome else { panic!("{:?}", gated.outcome) };
    let beyond = at[0] - gated.line.position[0];
    // Braking from 150 mm/s at nine tenths of 2000 mm/s² takes 6.25 mm, 500 steps.
    assert!((100..=510).contains(&beyond), "{beyond} steps to come to rest");
    assert_eq!(run(&machine, &seek, vec![], Recorder::default(), 0).outcome, Outcome::Unmet(gate));
    let hasty = Gate { deadline_us: 50_000, ..gate };
    seek.gate = Some(hasty);
    let unmet = run(&machine, &seek, vec![], Recorder::default(), 0);
    assert_eq!(unmet.outcome, Outcome::Unmet(hasty));
    assert!(unmet.line.position[0] > -4_000 && unmet.pins.position == unmet.line.position);
    let already = Recorder { script: vec![(0, Input::XMin.bit())], ..Recorder::default() };
    let none = run(&machine, &seek, vec![], already, 0);
    assert_eq!((none.outcome, none.line.position), (Outcome::Gated(Steps::default()), Steps::default()));
}

#[test]
fn slow_sensor_seek_stops_on_the_edge() {
    let mut machine = virtual_drill();
    // At 160 steps a second the motor may stop at once, at 12,000 it has to brake.
    for (speed_mm_per_s, beyond) in [(2.0, 0..=0), (150.0, 100..=510)] {
        machine.x.max_speed_mm_per_s = speed_mm_per_s;
        let mut seek = travel(&machine, [-4_000, 0]);
        let input = Input::XMin;
        let gate = Gate { input, deadline_us: 60_000_000, otherwise: Otherwise::Alarm };
        seek.gate = Some(gate);
        let ticks: Vec<u64> = replay(&seek).map(|pulse| pulse.tick).collect();
        // A motor needs time for its step: the switch closes between two of them.
        let made = ticks.len() / 2;
        let edge = (ticks[made - 1] + ticks[made]) / 2;
        let pins = Recorder { script: vec![(edge, input.bit())], ..Recorder::default() };
        let played = run(&machine, &seek, vec![], pins, 0);
        let Outcome::Gated(at) = played.outcome else { panic!("{:?}", played.outcome) };
        assert_eq!(at[0], -(made as i64), "where the edge was seen, at {speed_mm_per_s} mm/s");
        let more = at[0] - played.line.position[0];
        assert!(beyond.contains(&more), "{more} steps after it at {speed_mm_per_s} mm/s");
        assert_eq!(played.pins.position, played.line.position);
    }
}

/// Interrupts a segment at each tick of `at`, and continues it later.
fn left_and_gone_on(machine: &Machine, segment: &Segment, at: &[u64]) -> Played {
    let (mut line, mut pins) = (Playhead::default(), Recorder::default());
    let mut clock = TestClock { late_by: 0, chance: Chance::new(3), now: 0 };
    let (motors, mut made) = (Motors::of(machine), 0);
    for tick in at.iter().copied().map(Some).chain([None]) {
        let mut operator = Script(tick.map(|tick| (tick, Order::Leave)).into_iter().collect(), line.tick);
        let played =
            play_on_by_turns(segment, made, &motors, &mut line, &mut pins, &mut clock, &mut operator);
        match through(played) {
            Outcome::Left { pulses } => made = pulses,
            outcome => return Played { outcome, line, pins },
        }
        // Something else moves meanwhile and returns to the same place: time passes.
        line.tick += 5_000_000;
    }
    panic!("it never ended")
}

#[test]
fn interrupted_path_continues_from_its_step_within_limits() {
    let machine = virtual_drill();
    let per_mm = machine.x.scale.steps_per_mm();
    let limit = machine.x.max_acceleration_mm_per_s2 * per_mm;
    let (mut seed, mut left) = (Chance::new(5), 0);
    for round in 0..300 {
        let span = 200 + chance(&mut seed, 12_000) as i64;
        let travel = travel(&machine, [span, chance(&mut seed, 2 * span as u64) as i64 - span]);
        let first = chance(&mut seed, travel.duration_ticks);
        let at = [first, first + 6_000_000 + chance(&mut seed, 1_000_000)];
        let played = left_and_gone_on(&machine, &travel, &at);
        assert_eq!((played.outcome, played.line.position), (Outcome::Completed, travel.end), "round {round}");
        let made: Vec<_> = played
            .pins
            .written
            .iter()
            .filter_map(|call| match call {
                Written::Step { axes, forward, .. } => Some((*axes, *forward)),
                _ => None,
            })
            .collect();
        let planned: Vec<_> = replay(&travel).map(|pulse| (pulse.axes, pulse.forward)).collect();
        assert_eq!(made, planned, "round {round}: the same pulses in the same order");
        left += u32::from(played.line.tick > travel.duration_ticks + 5_000_000);
        for axis in 0..2 {
            let (_, hardest) = extremes(&ticks(&played.pins, axis));
            assert!(hardest <= limit * 1.5, "round {round}: {hardest} steps/s² on axis {axis}");
        }
    }
    assert!(left > 150, "{left}");
}
