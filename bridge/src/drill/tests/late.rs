//! A slow computer under the virtual drill: it keeps its own time.

use super::disk::Wish;
use super::*;
use std::sync::Mutex;

#[test]
fn a_late_disk_makes_the_virtual_drill_wait_and_lose_nothing() {
    for (speed, holes) in [(SPEED, 100), (200.0, 60), (20.0, 12)] {
        let chance = Arc::new(Mutex::new(Chance::new(77)));
        let mut bench = Bench::on_disk(speed, move |wish| {
            if wish == Wish::Sync {
                let us = chance.lock().unwrap().below(9_000);
                std::thread::sleep(Duration::from_micros(us as u64));
            }
            Ok(())
        });
        bench.start(&grid(&machine(), holes));
        assert_eq!(bench.ended(), (Ending::Done, holes), "speed {speed}");
        let status = bench.wait(|status| matches!(status.state, State::Ready | State::Alarm));
        assert_eq!((status.alarm, status.slips), (None, Vec::new()), "speed {speed}");
        assert_eq!(counts(&bench.record(), holes), vec![1; holes as usize], "speed {speed}");
    }
}

#[test]
fn a_late_computer_is_a_fault_that_one_provokes() {
    // 10 ms with every step.
    let bench = Bench::new(&machine(), Faults { late_host: Some(100_000), ..Faults::default() });
    bench.home();
    let status = bench.status();
    assert_eq!(status.alarm.unwrap().code, "control.executor_late");
}
