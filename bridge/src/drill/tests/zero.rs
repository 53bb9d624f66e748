//! Tests that a work zero is valid only while the steps of X and Y keep their meaning.

use super::*;

#[test]
fn changed_steps_per_mm_discard_the_work_zero() {
    let bench = Bench::new(&machine(), Faults::default());
    bench.home();
    bench.drill.ask(Ask::SetZero).unwrap();
    let finer = vec![("x.scale".to_owned(), Value::Number(machine().x.scale.steps_per_mm() * 2.0))];
    bench.drill.ask(Ask::Configure { changes: finer }).unwrap();
    bench.home();
    assert_eq!(bench.status().zero_mm, None);
    let (.., checks) = bench.arm(&grid(&machine(), 1));
    assert!(checks.iter().any(|row| row.finding.code == "preflight.no_zero"), "{checks:?}");
}

/// Settings that change the meaning of X steps: the scale, and the position of the home sensor.
fn recounted() -> [Vec<(String, Value)>; 2] {
    let finer = machine().x.scale.steps_per_mm() * 2.0;
    [vec![("x.scale".to_owned(), Value::Number(finer))], vec![("x.min".to_owned(), Value::Number(-5.0))]]
}

#[test]
fn machine_file_edited_offline_discards_the_work_zero() {
    for changes in recounted() {
        let bench = Bench::new(&machine(), Faults::default());
        bench.home();
        bench.drill.ask(Ask::SetZero).unwrap();
        assert!(bench.status().zero_mm.is_some());
        bench.drill.shutdown();
        let edited = annulus_core::machine::apply(&machine(), &changes).unwrap();
        let same = Drill::open(bench.folder.path(), machine(), SPEED).unwrap();
        assert!(zero_mm(&same).is_some(), "nothing changed, the zero stands");
        same.shutdown();
        let drill = Drill::open(bench.folder.path(), edited, SPEED).unwrap();
        assert_eq!(zero_mm(&drill), None, "{changes:?}");
        drill.shutdown();
    }
}

#[test]
fn changed_axes_refuse_resume_of_an_interrupted_job() {
    let moved = recounted()[1].clone();
    let program = grid(&machine(), 60);
    for while_down in [false, true] {
        let mut bench = Bench::new(&machine(), Faults::default());
        bench.start(&program);
        bench.wait(|status| status.holes_done >= 2);
        bench.drill.ask(Ask::Stop).unwrap();
        assert_eq!(bench.ended().0, Ending::Stopped);
        bench.wait(|status| status.state == State::Ready);
        if while_down {
            bench.drill.shutdown();
            let edited = annulus_core::machine::apply(&machine(), &moved).unwrap();
            bench.drill = Drill::open(bench.folder.path(), edited, SPEED).unwrap();
            bench.tells = bench.drill.watch();
        } else {
            bench.drill.ask(Ask::Configure { changes: moved.clone() }).unwrap();
        }
        assert_eq!(zero_mm(&bench.drill), None, "down {while_down}");
        bench.home();
        let (.., checks) = bench.arm(&program);
        let no_zero = checks.iter().any(|row| row.finding.code == "preflight.no_zero");
        assert!(no_zero, "down {while_down}: {checks:?}");
        // With a new zero it may start again, but not resume.
        bench.drill.ask(Ask::SetZero).unwrap();
        let (job, stream_digest, _) = bench.arm(&program);
        let from_leg = bench.offer().unwrap();
        let refused = bench.drill.ask(Ask::Start { job, stream_digest, from_leg }).unwrap_err();
        assert_eq!(refused.code, "control.zero_moved", "down {while_down}");
    }
}

fn zero_mm(drill: &Drill) -> Option<[f64; 2]> {
    let status = drill.greeting().into_iter().find_map(|tell| match tell {
        Tell::Status(status) => Some(status),
        _ => None,
    });
    status.unwrap().zero_mm
}
