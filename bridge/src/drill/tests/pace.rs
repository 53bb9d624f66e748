//! The pace of a job, as a person orders it.

use super::*;

#[test]
fn the_pace_is_ordered_within_its_bounds_and_told() {
    let mut bench = Bench::new(&machine(), Faults::default());
    bench.start(&grid(&machine(), 12));
    for wrong in [0, 9, 101] {
        let refused = bench.drill.ask(Ask::Pace { percent: wrong }).unwrap_err();
        assert_eq!(refused.code, "control.bad_pace");
    }
    bench.drill.ask(Ask::Pace { percent: 40 }).unwrap();
    bench.wait(|status| status.pace_percent == 40);
    assert_eq!(bench.ended(), (Ending::Done, 12));
    assert_eq!(bench.record().len(), 12);
}
