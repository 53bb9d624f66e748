//! Tests of homing with a simulated controller. The position after homing must agree with the settings, and
//! up must be up with every origin.

use super::automaton::Counts;
use super::survey::found;
use super::{Bench, Faults};
use annulus_core::control::Trust;
use annulus_core::grbl::{EngineAsk, EngineEvent, EnginePhase};

/// A homed controller with this origin and this mask of axes homed low, moved some way towards the middle.
fn homed(counts: Counts, low: u32) -> Bench {
    let mut bench = Bench::new(1, Faults::default());
    bench.board.settings.extend([(27, 1.0), (23, f64::from(low))]);
    bench.board.counts = counts;
    bench.plug();
    assert!(bench.until(5_000, |bench| bench.engine().phase == EnginePhase::Locked));
    bench.told.clear();
    bench.event(EngineEvent::Ask(EngineAsk::Home));
    assert!(bench.until(10_000, |bench| bench.engine().phase == EnginePhase::Ready), "{counts:?} {low}");
    bench
}

#[test]
fn parking_lifts_first_for_every_coordinate_sign() {
    // Z always homes up; X and Y home to the low ends in every second case.
    for counts in [Counts::Down, Counts::Up, Counts::FromThere] {
        for low in [0, 3] {
            let mut bench = homed(counts, low);
            assert_eq!((bench.engine().trust, found(&bench)), (Trust::Trusted, vec![]), "{counts:?} {low}");
            let physical =
                |bench: &Bench| [0, 1, 2].map(|axis| bench.board.origin[axis] + bench.board.at[axis]);
            let away = if low == 0 { -50_000 } else { 50_000 };
            for (axis, um) in [(0, away), (1, away), (2, -30_000)] {
                bench.event(EngineEvent::Ask(EngineAsk::Jog {
                    axis,
                    um,
                    mm_per_min: 6_000.0,
                    anyway: false,
                }));
                assert!(bench.until(5_000, |bench| bench.engine().phase == EnginePhase::Ready));
            }
            let mut highest_before = physical(&bench)[2];
            bench.event(EngineEvent::Ask(EngineAsk::Park { from_low_mm: Some([250.0, 40.0]) }));
            for _ in 0..20_000 {
                bench.tick();
                let z = physical(&bench)[2];
                assert!(
                    z >= highest_before - 1e-9,
                    "{counts:?} {low}: it goes down, from {highest_before} to {z}"
                );
                highest_before = z;
                if bench.engine().phase == EnginePhase::Ready {
                    break;
                }
            }
            // Distance from the low ends of the travel, for any origin. Where zero is the position after
            // homing, the ends are shifted by a millimetre.
            let off = match (counts, low) {
                (Counts::FromThere, 0) => -1.0,
                (Counts::FromThere, _) => 1.0,
                _ => 0.0,
            };
            let wanted = [-50.0 + off, -260.0 + off, -1.0];
            let at = physical(&bench);
            let is_there = at.iter().zip(wanted).all(|(at, wanted)| (at - wanted).abs() < 1e-6);
            assert!(is_there, "{counts:?} {low}: {at:?}, not {wanted:?}");
            assert_eq!(found(&bench), Vec::<String>::new(), "{counts:?} {low}");
        }
    }
}

#[test]
fn axis_that_skipped_its_switch_is_not_homed() {
    for axis in 0..3 {
        let mut bench = Bench::new(1, Faults::default());
        bench.board.settings.push((27, 1.0));
        bench.board.homes[axis] = false;
        bench.plug();
        assert!(bench.until(5_000, |bench| bench.engine().phase == EnginePhase::Locked));
        bench.told.clear();
        bench.event(EngineEvent::Ask(EngineAsk::Home));
        assert!(bench.until(10_000, |bench| bench.engine().phase == EnginePhase::Ready));
        assert_eq!(
            (bench.engine().trust, found(&bench)),
            (Trust::Lost, vec!["grbl.home_elsewhere".to_owned()]),
            "{axis}"
        );
        bench.told.clear();
        bench.event(EngineEvent::Ask(EngineAsk::Park { from_low_mm: None }));
        assert_eq!((bench.engine().parks(), found(&bench)), (false, vec!["grbl.not_homed".to_owned()]));
    }
}

#[test]
fn one_damaged_report_does_not_spoil_homing() {
    let mut bench = Bench::new(1, Faults::default());
    bench.board.settings.push((27, 1.0));
    bench.plug();
    assert!(bench.until(5_000, |bench| bench.engine().phase == EnginePhase::Locked));
    bench.event(EngineEvent::Ask(EngineAsk::Home));
    assert!(bench.until(5_000, |bench| bench.engine().status.is_none()), "it was answered");
    bench.heard_instead = Some(("MPos:-1.000,-1.000,-1.000", "MPos:-1.000,-1.400,-1.000"));
    assert!(bench.until(10_000, |bench| bench.engine().phase == EnginePhase::Ready));
    assert_eq!(bench.engine().trust, Trust::Trusted);
    assert!(bench.heard_instead.is_none(), "it was damaged");
}
