//! Tests of homing on the virtual drill: every setting changes the stop position, the time or the search
//! distance.

use super::*;
use annulus_core::machine::{Machine, Value, apply};
use annulus_core::virtual_drill::faults::read as faults;

const SPEED: f64 = 10.0;

type Changes = Vec<(String, Value)>;

fn number(key: &str, value: f64) -> Changes {
    vec![(key.to_owned(), Value::Number(value))]
}

fn word(key: &str, value: &str) -> Changes {
    vec![(key.to_owned(), Value::Text(value.to_owned()))]
}

/// Result of a homing: axis positions in mm, seconds of machine time, the alarm.
#[derive(Debug, PartialEq)]
struct Homed {
    rests_mm: [f64; 3],
    took_s: f64,
    alarm: Option<String>,
}

fn homed(changes: &Changes, fault: Option<&str>) -> Homed {
    let mut bench = Bench::open_at(&Memory::default(), SPEED);
    if !changes.is_empty() {
        bench.ask(&Ask::Configure { changes: changes.clone() });
    }
    if let Some(fault) = fault {
        assert!(faults([fault]).is_ok());
        bench.ask(&Ask::Provoke { faults: vec![fault.to_owned()] });
    }
    let since = now();
    bench.ask(&Ask::Home);
    let status =
        bench.until(|status| matches!(status.state, State::Ready | State::Alarm) && status.stage.is_none());
    let took_s = now().saturating_sub(since).as_secs_f64() * SPEED;
    Homed { rests_mm: status.machine_mm, took_s, alarm: status.alarm.map(|why| why.code) }
}

fn machine_with(changes: &Changes) -> Machine {
    apply(&virtual_drill(), changes).unwrap()
}

#[test]
fn home_offset_sets_the_rest_position() {
    let usual = homed(&Changes::new(), None);
    assert_eq!(usual.alarm, None);
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        for offset in [0.5, 3.0] {
            let found = homed(&number(&format!("{name}.home_offset"), offset), None);
            let moved = (found.rests_mm[axis] - usual.rests_mm[axis]).abs();
            assert!((moved - (offset - 1.0_f64).abs()).abs() < 0.02, "{name} {offset}: {found:?} {usual:?}");
            for other in (0..3).filter(|other| *other != axis) {
                assert_eq!(found.rests_mm[other], usual.rests_mm[other], "{name} {offset}");
            }
        }
    }
}

#[test]
fn home_end_sets_the_side_of_rest() {
    for (axis, name) in ["x", "y"].into_iter().enumerate() {
        let changes = word(&format!("{name}.home_end"), "max");
        let (machine, found) = (machine_with(&changes), homed(&changes, None));
        let end = machine.axis(axis).max.mm() - 1.0;
        assert!((found.rests_mm[axis] - end).abs() < 0.02, "{name}: {found:?}");
    }
}

#[test]
fn lower_home_speed_takes_longer() {
    let usual = homed(&Changes::new(), None);
    for (name, speed) in [("x", 10.0), ("y", 10.0), ("z", 5.0)] {
        let slow = homed(&number(&format!("{name}.home_speed"), speed), None);
        assert_eq!((slow.rests_mm, &slow.alarm), (usual.rests_mm, &None), "{name}");
        assert!(slow.took_s > usual.took_s * 1.1, "{name}: {slow:?} {usual:?}");
    }
}

#[test]
fn home_search_limits_the_seek_distance() {
    let looks = |search: f64| homed(&number("y.home_search", search), Some("missing-switch"));
    let (near, far) = (looks(210.0), looks(400.0));
    for found in [&near, &far] {
        assert_eq!(found.alarm.as_deref(), Some("control.sensor_not_found"), "{found:?}");
    }
    // At 40 mm/s, 190 mm more take 4.75 s.
    assert!((far.took_s - near.took_s - 4.75).abs() < 0.5, "{near:?} {far:?}");
}
