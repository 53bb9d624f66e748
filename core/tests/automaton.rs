//! Tests of the integer automaton: events against the reference, every distance and every change of target
//! reached exactly, and tables checked by running them.

use crate::reference::vectors;
use annulus_core::chance::Chance;
use annulus_core::machine::Dynamics;
use annulus_core::steps::automaton::{
    Automaton, FARTHEST, MOST_STATES, capped, check, state_within, steps, stretches, total,
};
use serde_json::Value;

fn chance(chance: &mut Chance, below: u64) -> u64 {
    chance.bits() % below.max(1)
}

fn row(value: &Value) -> Vec<u32> {
    value.as_array().unwrap().iter().map(|number| number.as_u64().unwrap() as u32).collect()
}

fn table(value: &Value) -> Dynamics {
    Dynamics { period: row(&value["period"]), enter: row(&value["enter"]), leave: row(&value["leave"]) }
}

fn dynamics(period: &[u32], enter: &[u32], leave: &[u32]) -> Dynamics {
    Dynamics { period: period.to_vec(), enter: enter.to_vec(), leave: leave.to_vec() }
}

/// Serves interrupts until the motor rests. Returns (interrupt, position, state) of every step.
fn run(automaton: &mut Automaton, most: u64) -> Vec<(u64, i64, i32)> {
    let mut log = Vec::new();
    for interrupt in 1..=most {
        if automaton.is_at_rest() {
            return log;
        }
        log.extend(automaton.interrupt().map(|step| (interrupt, step.position, step.state)));
    }
    assert!(automaton.is_at_rest(), "no rest after {most} interrupts: {automaton:?}");
    log
}

#[test]
fn automaton_events_match_the_reference() {
    let file = vectors("step_automaton.json");
    let mut events = 0;
    for case in file["cases"].as_array().unwrap() {
        let id = &case["id"];
        let dynamics = table(&file["tables"][case["table"].as_str().unwrap()]);
        let mut automaton = Automaton::new(dynamics, 0);
        automaton.retarget(case["target"].as_i64().unwrap());
        let commands = case["retarget"].as_array().unwrap();
        let last = commands.iter().map(|row| row[0].as_u64().unwrap()).max().unwrap_or(0);
        let (mut found, mut now) = (Vec::new(), 0);
        while now < last || !automaton.is_at_rest() {
            now += 1;
            for command in commands.iter().filter(|row| row[0].as_u64() == Some(now)) {
                automaton.retarget(command[1].as_i64().unwrap());
            }
            let step = automaton.interrupt();
            found.extend(step.map(|step| [now as i64, step.position, i64::from(step.state)]));
        }
        let expected: Vec<[i64; 3]> = serde_json::from_value(case["steps"].clone()).unwrap();
        assert_eq!(found, expected, "{id}");
        let interrupts = found.last().map_or(0, |event| event[0]);
        assert_eq!(interrupts, case["total_interrupts"].as_i64().unwrap(), "{id}");
        assert_eq!(automaton.position(), case["final_position"].as_i64().unwrap(), "{id}");
        assert_eq!(i64::from(automaton.state()), case["final_state"].as_i64().unwrap(), "{id}");
        events += found.len();
    }
    assert!(events > 300, "only {events} events");
}

#[test]
fn totals_and_table_conditions_match_the_reference() {
    let file = vectors("step_automaton.json");
    let arendt = Dynamics::arendt();
    for case in file["totals"].as_array().unwrap() {
        let interrupts = total(&arendt, case["n"].as_u64().unwrap()).unwrap();
        assert_eq!(interrupts, case["interrupts"].as_u64().unwrap(), "{case}");
        for (hertz, seconds) in case["seconds"].as_object().unwrap() {
            let found = interrupts as f64 / hertz.parse::<f64>().unwrap();
            assert!((found - seconds.as_f64().unwrap()).abs() < 1e-12, "{case}");
        }
    }
    let rows = file["table_conditions"].as_array().unwrap();
    assert!(!rows.is_empty());
    for case in rows {
        let (enter, leave) = (row(&case["enter"]), row(&case["leave"]));
        let period: Vec<u32> = (0..=enter.len() as u32).rev().map(|state| state + 1).collect();
        let table = Dynamics { period, enter, leave };
        let conditions = Conditions::of(&table);
        assert_eq!(conditions.exact, case["exact"].as_bool().unwrap(), "{case}");
        assert_eq!(conditions.unimodal, case["unimodal"].as_bool().unwrap(), "{case}");
        assert_eq!(conditions.slow_last, case["slow_last"].as_bool().unwrap(), "{case}");
        conditions.agree_with_running(&table);
    }
}

struct Conditions {
    exact: bool,
    unimodal: bool,
    slow_last: bool,
}

impl Conditions {
    fn of(table: &Dynamics) -> Self {
        let all = |holds: &dyn Fn(u32, u32, u32) -> bool| {
            (1..)
                .zip(&table.enter)
                .zip(&table.leave)
                .all(|((state, enter), leave)| holds(state, *enter, *leave))
        };
        Self {
            exact: all(&|state, enter, leave| enter + 1 >= state && leave >= state),
            unimodal: all(&|_, enter, leave| enter + 2 >= leave),
            slow_last: all(&|state, enter, leave| enter >= state && leave > state),
        }
    }

    /// Running a table must never reveal a fault that the conditions exclude.
    fn agree_with_running(&self, table: &Dynamics) {
        match check(table) {
            Ok(warnings) => {
                let fast_end = warnings.iter().any(|diagnostic| diagnostic.code == "automaton.fast_end");
                assert!(!(self.slow_last && fast_end), "{table:?}: {warnings:?}");
            }
            Err(refusals) => {
                assert!(!(self.exact && self.unimodal), "{table:?}: {refusals:?}");
            }
        }
    }
}

#[test]
fn every_distance_takes_the_closed_formula_time_both_ways() {
    let table = Dynamics::arendt();
    for distance in 1..=2000_i64 {
        let mut logs = Vec::new();
        for target in [distance, -distance] {
            let mut automaton = Automaton::new(table.clone(), 0);
            automaton.retarget(target);
            let log = run(&mut automaton, 20_000);
            assert_eq!((automaton.position(), automaton.state()), (target, 0));
            logs.push(log);
        }
        let mirrored: Vec<_> = logs[1].iter().map(|(at, place, state)| (*at, -place, -state)).collect();
        assert_eq!(logs[0], mirrored, "{distance}");
        let closed = [7, 14, 18, 22, 24, 26, 27];
        let expected = closed.get(distance as usize - 1).copied().unwrap_or(distance as u64 + 21);
        assert_eq!(logs[0].last().unwrap().0, expected, "{distance}");
        assert_eq!(total(&table, distance as u64).unwrap(), expected, "{distance}");
        let found: Vec<u64> = steps(&table, distance as u64).unwrap().collect();
        let log: Vec<u64> = logs[0].iter().map(|(at, ..)| *at).collect();
        assert_eq!(found, log, "{distance}");
    }
}

#[test]
fn long_moves_need_few_stretches() {
    let table = Dynamics::arendt();
    let found: Vec<(u32, u64)> = stretches(&table, 1_000_000_000_000)
        .unwrap()
        .iter()
        .map(|stretch| (stretch.interval, stretch.count))
        .collect();
    let middle = 1_000_000_000_000 - 7;
    assert_eq!(found, [(7, 1), (4, 1), (2, 1), (1, middle), (2, 2), (4, 1), (7, 1)]);
    assert_eq!(total(&table, 1_000_000_000_000).unwrap(), 1_000_000_000_021);
    assert!(total(&table, u64::MAX).is_ok());
    assert_eq!(stretches(&table, 0).unwrap(), []);
    assert_eq!(total(&dynamics(&[], &[], &[]), 5).unwrap_err().code, "automaton.lengths");
}

#[test]
fn changed_targets_are_reached_exactly() {
    let tables = [
        Dynamics::arendt(),
        dynamics(&[7, 4, 2, 1], &[0, 1, 2], &[1, 2, 4]),
        dynamics(&[6, 3, 1], &[1, 2], &[2, 4]),
        dynamics(&[9], &[], &[]),
    ];
    for (index, table) in (1..).zip(tables) {
        let mut seed = Chance::new(index);
        println!("seed {index}");
        for _ in 0..5_000 {
            let start = chance(&mut seed, 200) as i64 - 100;
            let mut automaton = Automaton::new(table.clone(), start);
            let mut target = start;
            for _ in 0..=chance(&mut seed, 6) {
                target = start + chance(&mut seed, 80) as i64 - 40;
                automaton.retarget(target);
                for _ in 0..chance(&mut seed, 60) {
                    automaton.interrupt();
                }
            }
            run(&mut automaton, 2_000);
            assert_eq!((automaton.position(), automaton.state()), (target, 0), "{table:?}");
        }
    }
}

#[test]
fn invalid_tables_are_refused_with_the_reason() {
    /// Periods, `enter`, `leave`, code of the first refusal, part of its message.
    type Row<'a> = (&'a [u32], &'a [u32], &'a [u32], &'a str, &'a str);
    let rows: [Row<'_>; 11] = [
        (&[], &[], &[], "automaton.lengths", "0"),
        (&[7, 4], &[1, 2], &[2], "automaton.lengths", "2"),
        (&[7, 0], &[1], &[2], "automaton.period_range", "state 1"),
        (&[7, 2, 4], &[1, 2], &[2, 3], "automaton.period_order", "state 2"),
        (&[7, 4], &[FARTHEST + 1], &[2], "automaton.distance_range", "10000"),
        (
            &[1; MOST_STATES + 2],
            &[9; MOST_STATES + 1],
            &[9; MOST_STATES + 1],
            "automaton.too_many_states",
            "16",
        ),
        // A move of 3 steps reaches state 1 with 2 steps left and state 2 with 1 left.
        (&[7, 4, 2], &[0, 0], &[1, 2], "automaton.overshoots", "3 steps"),
        // This table never slows down before the target.
        (&[7, 4], &[1], &[0], "automaton.overshoots", "3 steps"),
        // The motor slows down five steps before the end, and then has room to accelerate again.
        (&[7, 4, 2], &[1, 2], &[2, 6], "automaton.hunts", "steps"),
        // Exact from rest. A new target shortly before a fast motor is overshot, although the motor could
        // have stopped.
        (&[7, 4, 2], &[2, 0], &[1, 2], "automaton.overshoots_retargeted", "state 1"),
        (&[3, 2], &[0], &[4], "automaton.hunts", "steps"),
    ];
    for (period, enter, leave, code, part) in rows {
        let table = dynamics(period, enter, leave);
        let refusals = check(&table).expect_err(&format!("{table:?} was accepted"));
        let message = refusals[0].message("en");
        assert_eq!(refusals[0].code, code, "{table:?}: {message}");
        assert!(message.contains(part) && !message.contains('{'), "{message}");
        assert!(!refusals[0].advice("en").contains('{') && refusals[0].advice("en") != refusals[0].code);
    }
}

#[test]
fn accepted_table_can_have_warnings() {
    let warnings = |table: Dynamics| -> Vec<String> {
        check(&table).unwrap().into_iter().map(|diagnostic| diagnostic.message("en")).collect()
    };
    assert!(warnings(Dynamics::arendt()).is_empty());
    assert!(warnings(dynamics(&[7], &[], &[])).is_empty());
    let early = warnings(dynamics(&[7, 4, 2, 1], &[0, 1, 2], &[1, 2, 4]));
    assert!(early.len() == 1 && early[0].contains("2 steps") && early[0].contains('4'), "{early:?}");
}

/// Returns `true` if interrupts alone reach every target: from rest, and after a change of target in every
/// state. Distances are all those that leave room to stop.
fn does_well(table: &Dynamics) -> bool {
    let far = i64::from(table.enter.iter().chain(&table.leave).max().copied().unwrap_or(0)) + 20;
    let top = table.enter.len() as i32;
    let goes_well = |automaton: &mut Automaton| {
        let (mut fell, mut before) = (false, automaton.state());
        for _ in 0..50_000 {
            if automaton.is_at_rest() {
                return true;
            }
            let Some(step) = automaton.interrupt() else { continue };
            let over = step.position == automaton.target() && step.state != 0;
            if over || (fell && step.state > before) {
                return false;
            }
            fell |= step.state < before;
            before = step.state;
        }
        false
    };
    let mut fine = true;
    for distance in 1..=far {
        let mut automaton = Automaton::new(table.clone(), 0);
        automaton.retarget(distance);
        fine &= goes_well(&mut automaton);
    }
    for state in 1..=top {
        for distance in i64::from(state)..=far {
            let mut automaton = Automaton::new(table.clone(), 0);
            automaton.retarget(i64::MAX / 4);
            while automaton.state() < state {
                automaton.interrupt();
            }
            automaton.retarget(automaton.position() + distance);
            fine &= goes_well(&mut automaton);
        }
    }
    fine
}

#[test]
fn table_check_agrees_with_simulated_interrupts() {
    let mut seed = Chance::new(20_260_101);
    println!("seed 20260101");
    let (mut accepted, mut refused) = (0, 0);
    for _ in 0..4_000 {
        let states = 1 + chance(&mut seed, 4) as usize;
        let mut numbers = |base: u64, spread: u64| -> Vec<u32> {
            (0..states).map(|state| (base + state as u64 + chance(&mut seed, spread)) as u32).collect()
        };
        let (enter, leave) = (numbers(0, 4), numbers(0, 4));
        let period: Vec<u32> = (0..=states as u32).rev().map(|state| state + 1).collect();
        let table = Dynamics { period, enter, leave };
        Conditions::of(&table).agree_with_running(&table);
        let verdict = check(&table);
        assert_eq!(verdict.is_ok(), does_well(&table), "{table:?}: {verdict:?}");
        if verdict.is_ok() {
            accepted += 1;
            for top in 0..=states {
                let slower = capped(&table, top);
                assert_eq!(slower.enter.len(), top);
                assert!(check(&slower).is_ok(), "{table:?} capped at {top}");
            }
            for distance in 1..60 {
                let mut automaton = Automaton::new(table.clone(), 0);
                automaton.retarget(distance);
                let log: Vec<u64> = run(&mut automaton, 2_000).iter().map(|(at, ..)| *at).collect();
                assert_eq!(steps(&table, distance as u64).unwrap().collect::<Vec<_>>(), log, "{table:?}");
            }
        } else {
            refused += 1;
        }
    }
    assert!(accepted > 200 && refused > 200, "{accepted} accepted, {refused} refused");
}

#[test]
fn extreme_tables_do_not_panic() {
    let top = MOST_STATES as u32;
    let rising = |first: u32| (0..top).map(|state| (first + state * 600).min(FARTHEST)).collect::<Vec<_>>();
    let period: Vec<u32> = (1..=top + 1).rev().collect();
    let rows = [
        Dynamics { period: period.clone(), enter: rising(100), leave: rising(100) },
        Dynamics { period: period.clone(), enter: vec![FARTHEST; 16], leave: vec![FARTHEST; 16] },
        Dynamics { period: period.clone(), enter: vec![0; 16], leave: vec![FARTHEST; 16] },
        Dynamics { period, enter: vec![FARTHEST; 16], leave: vec![0; 16] },
    ];
    let verdicts: Vec<bool> = rows.iter().map(|table| check(table).is_ok()).collect();
    assert_eq!(verdicts, [true, true, false, false]);
    // Even with a refused table the automaton must not panic or overflow: counting is all that it does.
    for table in [dynamics(&[], &[1], &[2]), dynamics(&[0, 0], &[0, 5], &[]), dynamics(&[3, 1], &[0], &[0])] {
        let mut automaton = Automaton::new(table, i64::MAX - 2);
        automaton.retarget(i64::MIN);
        for _ in 0..100 {
            automaton.interrupt();
        }
    }
}

#[test]
fn feed_limits_the_automaton_state() {
    let table = Dynamics::arendt();
    // (maximum steps per second at 500 Hz, state)
    for (most_hz, state) in [(1.0, 0), (72.0, 0), (125.0, 1), (249.0, 1), (250.0, 2), (500.0, 3), (9e9, 3)] {
        assert_eq!(state_within(&table, 500.0, most_hz), state, "{most_hz}");
        let slower = capped(&table, state);
        let quickest = stretches(&slower, 500).unwrap().iter().map(|stretch| stretch.interval).min();
        assert_eq!(quickest, slower.period.last().copied());
    }
}
