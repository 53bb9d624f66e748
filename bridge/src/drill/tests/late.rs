//! A slow computer under the virtual drill: it keeps its own time.

use super::*;
use std::sync::Mutex;

/// A disk on which every record takes its time.
#[derive(Debug)]
struct SlowDisk(InMemoryBackend, Mutex<Chance>);

impl SlowDisk {
    fn wait(&self) {
        let us = self.1.lock().unwrap().below(9_000);
        std::thread::sleep(Duration::from_micros(us as u64));
    }
}

impl StorageBackend for SlowDisk {
    fn len(&self) -> std::io::Result<u64> {
        self.0.len()
    }
    fn read(&self, offset: u64, out: &mut [u8]) -> std::io::Result<()> {
        self.0.read(offset, out)
    }
    fn set_len(&self, len: u64) -> std::io::Result<()> {
        self.0.set_len(len)
    }
    fn sync_data(&self) -> std::io::Result<()> {
        self.wait();
        self.0.sync_data()
    }
    fn write(&self, offset: u64, data: &[u8]) -> std::io::Result<()> {
        self.0.write(offset, data)
    }
}

#[test]
fn a_late_disk_makes_the_virtual_drill_wait_and_lose_nothing() {
    for (speed, holes) in [(SPEED, 100), (200.0, 60), (20.0, 12)] {
        let folder = tempfile::tempdir().unwrap();
        let disk = || SlowDisk(InMemoryBackend::new(), Mutex::new(Chance::new(77)));
        let parts = (Journal::on(disk).unwrap(), Contents::default(), None);
        let drill = Drill::assemble(folder.path(), machine(), speed, Faults::default(), parts).unwrap();
        let tells = drill.watch();
        let mut bench = Bench { drill, folder, tells };
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
