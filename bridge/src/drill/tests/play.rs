//! Tests of axes with backlash: holes are in their planned positions, from homing on and in resumed jobs.

use super::*;
use annulus_core::queue::Mode;

fn played() -> Machine {
    let mut machine = machine();
    (machine.x.backlash, machine.y.backlash) = (Length::from_um(150), Length::from_um(90));
    machine
}

#[test]
fn backlash_does_not_shift_holes() {
    let mut bench = Bench::new(&played(), Faults::default());
    let mut program = grid(&played(), 30);
    // There and back, so that both axes turn.
    program.legs[2..32].reverse();
    program.legs[8..20].reverse();
    bench.start(&program);
    assert_eq!(bench.ended(), (Ending::Done, 30));
    assert_eq!(counts(&bench.record(), 30), [1; 30]);
}

#[test]
fn resumed_job_compensates_backlash() {
    let mut program = grid(&played(), 20);
    program.legs[2..22].reverse();
    let mut stops = 0;
    for round in 0..6_u64 {
        let mut bench = Bench::new(&played(), Faults::default());
        bench.start(&program);
        std::thread::sleep(Duration::from_micros(1_500 + 700 * round));
        bench.drill.ask(Ask::Stop).unwrap();
        bench.wait(|status| status.state == State::Ready);
        if bench.ended().0 == Ending::Stopped {
            stops += 1;
            bench.take_up(&program);
            assert_eq!(bench.ended().0, Ending::Done);
        }
        let counts = counts(&bench.record(), 20);
        assert!(counts.iter().all(|count| (1..=2).contains(count)), "round {round}: {counts:?}");
    }
    assert!(stops > 0, "never stopped in the middle");
}

#[test]
fn work_zero_set_after_a_job_compensates_backlash() {
    let mut bench = Bench::new(&played(), Faults::default());
    let program = grid(&played(), 20);
    bench.start(&program);
    assert_eq!(bench.ended(), (Ending::Done, 20));
    // The job returned to its work zero from above, with the backlash on the other side.
    bench.wait(|status| status.state == State::Ready);
    bench.start_here(&program);
    assert_eq!(bench.ended(), (Ending::Done, 20));
    assert_eq!(counts(&bench.record(), 20), [2; 20]);
}

#[test]
fn queue_rows_compensate_backlash() {
    let bench = Bench::new(&played(), Faults::default());
    bench.home();
    bench.drill.ask(Ask::SetZero).unwrap();
    // Holes 0, 12 and 1 of the grid: up, then down in both axes, and up again.
    let text = "SPINDLE 20000\nMOVE_TO 6 3.5\nDRILL_DOWN\nDRILL_UP\nMOVE_TO 1 1\nDRILL_DOWN\nDRILL_UP\nMOVE_TO 3.5 1\nDRILL_DOWN\nDRILL_UP\n";
    bench.drill.ask(Ask::Queue { text: text.to_owned() }).unwrap();
    bench.drill.ask(Ask::QueueRun { mode: Mode::ToEnd }).unwrap();
    bench.wait(|status| status.state == State::Ready);
    let counts = counts(&bench.record(), 20);
    assert_eq!((counts[12], counts[0], counts[1]), (1, 1, 1), "{counts:?}");
}
