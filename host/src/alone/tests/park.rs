//! Tests of parking: up first, then aside; automatic only if set, and never after a STOP.

use super::*;

const PLACE_MM: [f64; 2] = [120.0, 80.0];

/// A drill with its own park position; parks after a job as `after_job` sets it.
fn parked_apart(speed: f64, after_job: &str) -> Bench {
    let word = |word: &str| Value::Text(word.to_owned());
    let rows = [
        ("park.at", word("place")),
        ("park.x", Value::Number(PLACE_MM[0])),
        ("park.y", Value::Number(PLACE_MM[1])),
        ("park.after_job", word(after_job)),
    ];
    let changes = rows.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    let mut bench = Bench::open_at(&Memory::default(), speed);
    bench.ask(&Ask::Configure { changes });
    assert_eq!(bench.refused(), None);
    bench
}

fn by_hand(bench: &mut Bench, axis: u8, distance_um: i32) {
    bench.ask(&Ask::Jog { axis, distance_um, anyway: false });
    bench.until(|status| status.state == State::Jogging);
    while bench.status().state == State::Jogging {
        bench.ask(&Ask::JogOn);
        bench.turn(TURN);
    }
}

fn is_parked(status: &Status) -> bool {
    (0..2).all(|axis| (status.machine_mm[axis] - PLACE_MM[axis]).abs() < 0.01)
}

fn was_parking(bench: &Bench) -> bool {
    bench.heard.iter().any(|tell| matches!(tell, Tell::Status(status) if status.state == State::Parking))
}

#[test]
fn parking_lifts_first_and_preserves_the_position() {
    let mut bench = parked_apart(1.0, "no");
    bench.ask(&Ask::Park);
    assert_eq!(bench.refused(), Some("control.not_homed"));
    bench.home();
    by_hand(&mut bench, 2, -20_000);
    let from_mm = bench.status().machine_mm;
    assert!(from_mm[2] < -15.0, "{from_mm:?}");
    bench.ask(&Ask::Park);
    assert_eq!(bench.status().state, State::Parking);
    while bench.status().state == State::Parking {
        let at_mm = bench.status().machine_mm;
        let is_over_start = (0..2).all(|axis| (at_mm[axis] - from_mm[axis]).abs() < 0.01);
        assert!(is_over_start || at_mm[2] > -1.01, "{at_mm:?}");
        bench.turn(TURN);
    }
    let status = bench.status().clone();
    assert!(is_parked(&status) && status.machine_mm[2] > -1.01, "{status:?}");
    assert_eq!((status.state, status.trust, status.spindle_rpm), (State::Ready, Trust::Trusted, 0));
    bench.home();
    assert_eq!(bench.status().alarm, None, "no step was lost");
}

#[test]
fn stop_ends_parking_on_its_way() {
    let mut bench = parked_apart(1.0, "no");
    bench.home();
    bench.ask(&Ask::Park);
    bench.until(|status| status.machine_mm[0] > 20.0);
    bench.ask(&Ask::Stop);
    let status = bench.until(|status| status.state != State::Parking && status.state != State::Stopping);
    assert_eq!((status.state, status.trust), (State::Ready, Trust::Trusted));
    assert!(status.machine_mm[0] > 20.0 && !is_parked(&status), "{status:?}");
    bench.home();
    assert_eq!(bench.status().alarm, None, "no step was lost");
}

fn drill(bench: &mut Bench) {
    bench.home();
    bench.ask(&Ask::SetZero);
    bench.turn(Duration::from_millis(200));
    bench.start(&holes(4), 0);
    bench.until(|status| status.state == State::ToolChange);
    bench.ask(&Ask::ToolChanged);
}

fn done(bench: &mut Bench) -> Status {
    assert_eq!(bench.finish(), (Ending::Done, 4));
    bench.until(|status| status.state == State::Ready)
}

#[test]
fn parking_after_a_job_depends_on_its_setting() {
    for (after_job, parks) in [("no", false), ("yes", true)] {
        let mut bench = parked_apart(200.0, after_job);
        drill(&mut bench);
        let status = done(&mut bench);
        assert_eq!((is_parked(&status), was_parking(&bench)), (parks, parks), "{after_job}: {status:?}");
        assert_eq!((status.trust, status.alarm), (Trust::Trusted, None), "{after_job}");
    }
}

#[test]
fn stop_in_the_last_lift_of_a_job_prevents_parking() {
    let mut bench = parked_apart(1.0, "yes");
    drill(&mut bench);
    bench.until(|status| status.state == State::Stopping);
    bench.ask(&Ask::Stop);
    let status = done(&mut bench);
    assert!(!is_parked(&status) && !was_parking(&bench), "{status:?}");
}
