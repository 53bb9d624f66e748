//! Tests of the saved progress: a full disk, and a ledger that was written while the port was lost.

use super::draft::station;
use super::level::one_bit;
use super::{Bench, Memory, holes};
use crate::grbl::{AttendedJob, Ledger, Station};
use crate::owner::Message;
use annulus_core::control::State;
use annulus_core::wire::{Ask, Tell};
use std::sync::mpsc::channel;

/// Completed holes of the job that the station offers to resume.
fn offered(station: &Station<Memory>) -> Option<u32> {
    if let Some(Tell::Interrupted(job)) = station.offer_tell() { Some(job.holes_done) } else { None }
}

#[test]
fn full_disk_holds_a_job_but_not_its_end() {
    let program = one_bit(4);
    // The last hole and the end of the job are saved together.
    for (done, holds) in [(1, true), (3, false)] {
        let files = Memory::default();
        let mut bench = Bench::ready(&files);
        let key = bench.upload(&program);
        bench.start(&key, 0);
        bench.state(State::ToolChange);
        assert_eq!(bench.refused(&Ask::ToolChanged), None);
        bench.until(|status| status.holes_done == done);
        files.0.borrow_mut().1 = true;
        (0..30_000).for_each(|_| bench.millisecond());
        assert!(bench.said("journal.cannot_write") > 0, "{done} holes");
        if holds {
            bench.state(State::Paused);
            assert_eq!(bench.made(&program).0.iter().sum::<usize>(), 2, "the hole in work is finished");
            files.0.borrow_mut().1 = false;
            assert_eq!(bench.refused(&Ask::Resume), None);
        }
        bench.state(State::Ready);
        assert_eq!(bench.board.held, None, "{done} holes");
        let (times, elsewhere) = bench.made(&program);
        assert_eq!((times.iter().sum::<usize>(), elsewhere), (4, 0), "{times:?}");
    }
}

#[test]
fn newest_ledger_counts_after_a_reconnect() {
    let files = Memory::default();
    let mut bench = Bench::ready(&files);
    let key = bench.upload(&holes(10));
    bench.stopped(&key);
    let saved = files.0.borrow().clone();
    for (meanwhile, expected) in
        [("nothing", Some(3)), ("resumed", Some(4)), ("finished", None), ("forgotten", None)]
    {
        *files.0.borrow_mut() = saved.clone();
        let mut before = station(&files);
        assert_eq!(offered(&before), Some(3));
        // Another process continues the job.
        let mut other = Ledger::open(files.clone()).unwrap();
        let entry = other.entry().clone();
        let later = match meanwhile {
            "resumed" => Some(AttendedJob { done: entry.done + 1, ..entry }),
            "finished" => Some(AttendedJob { ended: true, ..entry }),
            _ => None,
        };
        if let Some(later) = later {
            other.save(&later, Vec::new()).unwrap();
        }
        let mut next = station(&files);
        if meanwhile == "forgotten" {
            // The user tells the old station, which answers until the new one takes over.
            let (reply, answer) = channel();
            before.take(Message::Ask { ask: Ask::ForgetInterrupted, ticket: None, reply });
            assert_eq!(answer.try_recv().unwrap(), Ok(Vec::new()));
        }
        next.succeed(before);
        assert_eq!(offered(&next), expected, "{meanwhile}");
    }
}
