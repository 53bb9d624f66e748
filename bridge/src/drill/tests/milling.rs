//! Tests of milling on the virtual drill: toolpaths are counted, stopped in the middle, and milled again
//! from their start.

#[path = "../../../tests/programs/mod.rs"]
mod programs;

use super::*;
use annulus_core::steps::Stage;
use annulus_core::wire::InterruptedJob;
use programs::{HOLES, WAYS, milling};

fn slow() -> Bench {
    let folder = tempfile::tempdir().unwrap();
    let drill = Drill::open_with(folder.path(), machine(), 60.0, Faults::default()).unwrap();
    let tells = drill.watch();
    Bench { drill, folder, tells }
}

/// How often each expected hole was drilled; panics at any other hole.
fn drilled(bench: &Bench) -> [u32; 2] {
    let mut counts = [0; 2];
    for [x, y, _] in bench.record() {
        // Work zero is 1 mm from the sensors.
        let hole = HOLES.iter().position(|at| (at.0 + 1.0 - x).abs() < 0.03 && (at.1 + 1.0 - y).abs() < 0.03);
        counts[hole.unwrap_or_else(|| panic!("a hole where none should be: {x} {y}"))] += 1;
    }
    counts
}

#[test]
fn milling_reports_progress_and_ends_with_an_unbroken_tool() {
    let mut bench = slow();
    bench.start(&milling(&machine()));
    let status = bench.wait(|status| status.stage == Some(Stage::Mill));
    assert_eq!((status.toolpaths_total, status.command.as_deref()), (WAYS, Some("mill")));
    assert!((0.0..0.9).contains(&status.done_share), "{}", status.done_share);
    let later = bench.wait(|status| status.toolpath == Some(WAYS - 1) && status.stage == Some(Stage::Mill));
    assert!(
        later.done_share > status.done_share,
        "toolpaths count too: {} {}",
        status.done_share,
        later.done_share
    );
    assert!(status.toolpath.is_some() && status.hole.is_none() && status.bit == Some(1), "{status:?}");
    assert!(status.lower_dead_point_mm.is_some_and(|low| low < -0.1), "{status:?}");
    assert_eq!(bench.ended(), (Ending::Done, 2));
    // The end mill of all toolpaths also drills the last hole.
    assert_eq!(drilled(&bench), [1, 1]);
    assert_eq!(bench.wait(|status| status.state == State::Ready).trust, Trust::Trusted);
}

#[test]
fn stopped_toolpath_is_milled_again_from_its_start() {
    let program = milling(&machine());
    for way in 0..WAYS {
        let mut bench = slow();
        bench.start(&program);
        bench.wait(|status| status.toolpath == Some(way) && status.stage == Some(Stage::Mill));
        bench.drill.ask(Ask::Stop).unwrap();
        let status = bench.wait(|status| status.state == State::Ready);
        assert_eq!((status.trust, status.spindle_rpm), (Trust::Trusted, 0), "way {way}");
        assert!(status.machine_mm[2] > -1.01, "the tip is up: {status:?}");
        if bench.ended().0 == Ending::Done {
            continue;
        }
        let offer = bench.drill.greeting().into_iter().find_map(|tell| match tell {
            Tell::Interrupted(InterruptedJob { next_leg, toolpaths_done, toolpaths_total, .. }) => {
                Some((next_leg, toolpaths_done, toolpaths_total))
            }
            _ => None,
        });
        let (from_leg, toolpaths_done, toolpaths_total) = offer.unwrap();
        assert!(toolpaths_done >= way && toolpaths_total == WAYS, "way {way}: {offer:?}");
        let at = program.legs[from_leg as usize].mark;
        assert!(
            !matches!(at, Mark::Toolpath(next) if next != toolpaths_done),
            "{at:?} after {toolpaths_done} toolpaths"
        );
        let (job, stream_digest, _) = bench.arm(&program);
        bench.drill.ask(Ask::Start { job, stream_digest, from_leg }).unwrap();
        let again = bench.wait(|status| status.stage == Some(Stage::Mill) || status.state == State::Ready);
        assert!(again.toolpaths_done >= toolpaths_done || again.state == State::Ready);
        assert_eq!(bench.ended(), (Ending::Done, 2));
        assert_eq!(drilled(&bench), [1, 1], "way {way}");
    }
}

#[test]
fn stop_after_hole_stops_after_a_toolpath() {
    let mut bench = slow();
    bench.start(&milling(&machine()));
    bench.wait(|status| status.toolpath == Some(0) && status.stage == Some(Stage::Mill));
    bench.drill.ask(Ask::StopAfterHole).unwrap();
    let (ending, holes) = bench.ended();
    assert_eq!((ending, holes), (Ending::StoppedAfterHole, 1));
}
