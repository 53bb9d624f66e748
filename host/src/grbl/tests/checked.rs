//! Tests of a job that the controller reads in check mode and then runs.

use super::*;
use annulus_core::wire::CheckModeReport;

impl Bench {
    fn was_checked(&self) -> Option<CheckModeReport> {
        let mut told = self.heard.iter().rev();
        told.find_map(
            |tell| if let Tell::Checked(report) = tell { Some(report.as_ref().clone()) } else { None },
        )
    }
}

#[test]
fn job_is_checked_without_motion_and_then_run() {
    let mut bench = Bench::ready(&Memory::default());
    let program = holes(4);
    let key = bench.upload(&program);
    assert_eq!(bench.fails(&key, 0), Vec::<String>::new());
    let cuts = bench.board.cuts.len();
    assert_eq!(bench.refused(&Ask::Check { job: key.clone() }), None);
    bench.state(State::Checking);
    assert_eq!(bench.refused(&Ask::Home).as_deref(), Some("grbl.not_now"));
    let status = bench.state(State::Ready);
    let report = bench.was_checked().unwrap();
    assert!(!report.goes && report.done == report.of && report.of > 20, "{report:?}");
    assert_eq!((report.job, report.refused, report.why), (key.clone(), 0, None));
    assert_eq!((status.trust, bench.board.cuts.len()), (Trust::Trusted, cuts));
    // The job is still armed.
    let start = Ask::Start { job: key, stream_digest: String::new(), from_leg: 0 };
    assert_eq!(bench.refused(&start), None);
    assert_eq!(bench.finish(), (Ending::Done, 4));
    assert_eq!(bench.made(&program), (vec![1; 4], 0));
}

#[test]
fn missing_check_mode_and_unknown_job_are_reported() {
    let mut bench = Bench::ready(&Memory::default());
    bench.board.checks = false;
    let key = bench.upload(&holes(4));
    assert_eq!(bench.refused(&Ask::Check { job: "0".to_owned() }).as_deref(), Some("control.no_such_job"));
    assert_eq!(bench.refused(&Ask::Check { job: key }), None);
    (0..5_000).for_each(|_| bench.millisecond());
    let report = bench.was_checked().unwrap();
    assert_eq!((report.goes, report.why.map(|why| why.code)), (false, Some("grbl.no_check_mode".to_owned())));
}

#[test]
fn check_is_refused_unless_the_controller_is_idle() {
    let probe = Ask::Probe { depth_um: 2_000, plate_um: 0 };
    for busy in [Ask::Home, probe, level::wish(&level::one_bit(6))] {
        let mut bench = Bench::ready(&Memory::default());
        assert_eq!(bench.refused(&busy), None);
        // The program is not even looked up: STOP would wait while its G-code is written.
        let check = Ask::Check { job: "0".to_owned() };
        assert_eq!(bench.refused(&check).as_deref(), Some("grbl.not_now"), "{busy:?}");
    }
}

#[test]
fn stop_ends_the_check() {
    let mut bench = Bench::ready(&Memory::default());
    let key = bench.upload(&holes(10));
    assert_eq!(bench.refused(&Ask::Check { job: key }), None);
    bench.state(State::Checking);
    bench.ask(&Ask::Stop);
    assert_eq!(bench.state(State::Ready).trust, Trust::Trusted);
    let why = bench.was_checked().and_then(|report| report.why).map(|why| why.code);
    assert_eq!(why.as_deref(), Some("grbl.check_stopped"));
}
