//! Tests of a full disk during a job, and of a damaged journal, in a temporary folder.

use super::*;
use redb::StorageBackend;
use redb::backends::InMemoryBackend;
use std::sync::atomic::{AtomicBool, Ordering};
use std::{fmt, io};

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Wish {
    Write,
    Sync,
}

/// A disk in memory; a hook may delay or refuse each operation.
#[derive(Clone)]
struct Disk<F>(Arc<InMemoryBackend>, F);

impl<F> fmt::Debug for Disk<F> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a disk in memory")
    }
}

impl<F: Fn(Wish) -> io::Result<()> + Send + Sync + 'static> StorageBackend for Disk<F> {
    fn len(&self) -> io::Result<u64> {
        self.0.len()
    }
    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        self.0.read(offset, out)
    }
    fn set_len(&self, len: u64) -> io::Result<()> {
        (self.1)(Wish::Write).and_then(|()| self.0.set_len(len))
    }
    fn sync_data(&self) -> io::Result<()> {
        (self.1)(Wish::Sync).and_then(|()| self.0.sync_data())
    }
    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        (self.1)(Wish::Write).and_then(|()| self.0.write(offset, data))
    }
}

impl Bench {
    /// A drill whose journal is on a disk in memory with the hook `first`.
    pub(super) fn on_disk(
        speed: f64,
        first: impl Fn(Wish) -> io::Result<()> + Clone + Send + Sync + 'static,
    ) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let disk = Disk(Arc::new(InMemoryBackend::new()), first);
        let journal = Journal::on(move || disk.clone()).unwrap();
        let parts = (journal, Contents::default(), None, None);
        let drill = Drill::assemble(folder.path(), machine(), speed, Faults::default(), parts).unwrap();
        let tells = drill.watch();
        Self { drill, folder, tells }
    }
}

/// A drill whose disk is full while the flag is set.
fn on_a_disk_that_fills_up() -> (Bench, Arc<AtomicBool>) {
    let is_full = Arc::new(AtomicBool::new(false));
    let full = Arc::clone(&is_full);
    let room =
        move |_| if full.load(Ordering::SeqCst) { Err(io::ErrorKind::StorageFull.into()) } else { Ok(()) };
    (Bench::on_disk(SPEED, room), is_full)
}

#[test]
fn unsaved_work_zero_raises_an_alarm_without_a_job() {
    let (bench, is_full) = on_a_disk_that_fills_up();
    bench.home();
    is_full.store(true, Ordering::SeqCst);
    bench.drill.ask(Ask::SetZero).unwrap();
    let status = bench.wait(|status| status.state == State::Alarm);
    assert_eq!((status.alarm.unwrap().code.as_str(), status.trust), ("journal.cannot_write", Trust::Trusted));
    is_full.store(false, Ordering::SeqCst);
    bench.wait(|_| bench.drill.ask(Ask::AcknowledgeAlarm).is_ok());
    bench.drill.ask(Ask::SetZero).unwrap();
    let status = bench.status();
    assert_eq!((status.state, status.alarm), (State::Ready, None));
    assert!(status.zero_mm.is_some());
}

#[test]
fn full_disk_stops_the_job_after_a_complete_hole() {
    let (mut bench, is_full) = on_a_disk_that_fills_up();
    bench.start(&grid(&machine(), 60));
    bench.wait(|status| status.holes_done >= 5);
    is_full.store(true, Ordering::SeqCst);
    let (ending, done) = bench.ended();
    assert_eq!(ending, Ending::Alarm);
    let status = bench.wait(|status| status.state == State::Alarm);
    assert_eq!((status.alarm.unwrap().code.as_str(), status.trust), ("journal.cannot_write", Trust::Trusted));
    let counts = counts(&bench.record(), 60);
    assert_eq!(
        counts.iter().sum::<u32>(),
        done,
        "no hole was begun that the journal may not know: {counts:?}"
    );
    assert!(counts.iter().all(|count| *count <= 1) && done < 60);
    // With room again, the job continues where it was, without a restart of the bridge.
    is_full.store(false, Ordering::SeqCst);
    bench.drill.ask(Ask::AcknowledgeAlarm).unwrap();
    bench.take_up(&grid(&machine(), 60));
    assert_eq!(bench.ended(), (Ending::Done, 60));
}

#[test]
fn damaged_journals_are_moved_aside() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(JOURNAL);
    let mut bench = Bench::new(&machine(), Faults::default());
    bench.start(&grid(&machine(), 8));
    bench.wait(|status| status.holes_done >= 2);
    bench.drill.ask(Ask::Stop).unwrap();
    bench.ended();
    bench.drill.shutdown();
    let good = fs::read(bench.folder.path().join(JOURNAL)).unwrap();
    fs::write(&path, &good).unwrap();
    let known = journal::open(&path, false).unwrap().1.job.expect("an interrupted job").1.done;
    let mut chance = Chance::new(5);
    let mut damaged = 0;
    for round in 0..100_usize {
        let mut bytes = good.clone();
        if round < 20 {
            bytes.truncate(bytes.len() * round / 20);
        } else {
            for _ in 0..(1 << (round % 12)) {
                let at = chance.below(if round % 2 == 0 { bytes.len() } else { 4096 });
                bytes[at] = chance.bits() as u8;
            }
        }
        fs::write(&path, &bytes).unwrap();
        let (journal, contents) =
            journal::open(&path, false).unwrap_or_else(|why| panic!("round {round}: {why:?}"));
        let Some(damage) = contents.damage else {
            // If accepted, it is what was written, perhaps without the last record.
            let (job, progress) =
                contents.job.unwrap_or_else(|| panic!("round {round}: forgotten in silence"));
            assert_eq!(job.holes_total, 8, "round {round}");
            assert!(progress.done <= known && progress.done + 1 >= known, "round {round}: {progress:?}");
            continue;
        };
        damaged += 1;
        assert!(damage.job.is_none_or(|name| name == "grid"), "round {round}");
        assert_eq!(contents.job, None);
        // The damage is remembered until the user acknowledges it.
        drop(journal);
        let (mut journal, again) = journal::open(&path, false).unwrap();
        assert!(again.damage.is_some(), "round {round}");
        journal.forget_damage().unwrap();
        drop(journal);
        assert_eq!(journal::open(&path, false).unwrap().1.damage, None);
    }
    assert!(damaged > 30, "{damaged} of 100 were found damaged");
    fs::write(&path, b"not a journal at all").unwrap();
    let drill = Drill::open(folder.path(), machine(), SPEED).unwrap();
    let tells = drill.greeting();
    let damaged = tells.iter().any(|tell| matches!(tell, Tell::Status(status)
        if status.alarm.as_ref().is_some_and(|why| why.code == "journal.damaged") && status.trust == Trust::Lost));
    assert!(damaged, "{tells:?}");
    assert_eq!(Drill::open(folder.path(), machine(), SPEED).err().unwrap().why.code, "journal.in_use");
    drill.shutdown();
}
