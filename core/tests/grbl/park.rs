//! Tests of parking with a simulated controller: up first, sideways only from there, and STOP during it.

use super::survey::found;
use super::{Bench, Faults};
use annulus_core::control::Trust;
use annulus_core::grbl::{EngineAsk, EngineEvent, EnginePhase};

const APART: EngineAsk = EngineAsk::Park { from_low_mm: Some([250.0, 40.0]) };

/// Homed, X and Y at their switches, the tool some way down.
fn down() -> Bench {
    let mut bench = Bench::new(1, Faults::default());
    // Distance to the switches after homing.
    bench.board.settings.push((27, 1.0));
    assert!(bench.ready());
    bench.until(500, |_| false);
    bench.event(EngineEvent::Ask(EngineAsk::Jog {
        axis: 2,
        um: -20_000,
        mm_per_min: 6_000.0,
        anyway: false,
    }));
    assert!(bench.until(5_000, |bench| bench.engine().phase == EnginePhase::Ready));
    bench.told.clear();
    bench
}

/// Waits until the machine rests. Returns the lowest position of the tool while X or Y moved.
fn rests(bench: &mut Bench) -> f64 {
    let mut lowest = f64::INFINITY;
    let mut before = bench.board.at;
    for _ in 0..20_000 {
        bench.tick();
        let now = bench.board.at;
        if now[..2] != before[..2] {
            lowest = lowest.min(now[2]);
        }
        before = now;
        if bench.engine().phase == EnginePhase::Ready {
            return lowest;
        }
    }
    panic!("it does not rest: {:?}", bench.engine().phase);
}

#[test]
fn parking_lifts_before_xy_motion() {
    let home = EngineAsk::Park { from_low_mm: None };
    for (ask, [x, y]) in [(APART, [-50.0, -260.0]), (home, [-1.0, -1.0])] {
        let mut bench = down();
        bench.event(EngineEvent::Ask(ask));
        assert!(bench.engine().parks());
        assert!(rests(&mut bench) > -1.001);
        let at = bench.board.at;
        let is_near = [x, y, -1.0].into_iter().zip(at).all(|(wanted, at)| (wanted - at).abs() < 1e-6);
        assert!(is_near, "{at:?}");
        assert_eq!((found(&bench), bench.engine().trust), (Vec::new(), Trust::Trusted));
        assert!(!bench.engine().parks());
    }
}

#[test]
fn parking_avoids_switches_without_a_reported_pull_off() {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    bench.until(500, |_| false);
    bench.event(EngineEvent::Ask(EngineAsk::Jog {
        axis: 2,
        um: -20_000,
        mm_per_min: 6_000.0,
        anyway: false,
    }));
    assert!(bench.until(5_000, |bench| bench.engine().phase == EnginePhase::Ready));
    for (ask, [x, y]) in [
        (EngineAsk::Park { from_low_mm: None }, [-1.0, -1.0]),
        (EngineAsk::Park { from_low_mm: Some([0.0, 0.0]) }, [-299.0, -299.0]),
    ] {
        bench.event(EngineEvent::Ask(ask));
        rests(&mut bench);
        let at = bench.board.at;
        assert!([x, y, -1.0].into_iter().zip(at).all(|(wanted, at)| (wanted - at).abs() < 1e-6), "{at:?}");
    }
}

#[test]
fn failed_lift_prevents_parking() {
    let mut bench = down();
    bench.instead = Some((b"$J=G53G90G21Z-1F6000\n", b"$J=G53G90G21Z-9F6000\n"));
    bench.event(EngineEvent::Ask(APART));
    let before = bench.board.at;
    assert_eq!(rests(&mut bench), f64::INFINITY, "X and Y did not move");
    assert_eq!((found(&bench), &bench.board.at[..2]), (vec!["grbl.not_parked".to_owned()], &before[..2]));
}

#[test]
fn stop_ends_parking_at_any_moment() {
    for after_ms in [50, 350, 900] {
        let mut bench = down();
        bench.event(EngineEvent::Ask(APART));
        bench.until(after_ms, |_| false);
        bench.event(EngineEvent::Ask(EngineAsk::Stop));
        rests(&mut bench);
        let at = bench.board.at;
        bench.until(3_000, |_| false);
        assert_eq!((bench.board.at, bench.engine().trust), (at, Trust::Trusted), "{after_ms} ms");
        assert!((at[0] + 50.0).abs() > 1.0, "{at:?} after {after_ms} ms");
    }
}

#[test]
fn parking_is_refused_at_an_unknown_position() {
    let mut bench = down();
    bench.board.power_up();
    bench.until(3_000, |_| false);
    bench.event(EngineEvent::Ask(APART));
    assert!(!bench.engine().parks(), "{:?}", bench.engine().phase);
    assert_ne!(found(&bench), Vec::<String>::new());
}
