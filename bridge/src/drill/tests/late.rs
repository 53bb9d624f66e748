//! Tests that the virtual drill keeps its own time on a slow computer.

use super::disk::Wish;
use super::*;
use std::sync::Mutex;

#[test]
fn late_disk_delays_the_virtual_drill_without_lost_holes() {
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
fn late_host_fault_raises_executor_late() {
    // 10 ms at every step.
    let bench = Bench::new(&machine(), Faults { late_host: Some(100_000), ..Faults::default() });
    bench.home();
    let status = bench.status();
    assert_eq!(status.alarm.unwrap().code, "control.executor_late");
}
