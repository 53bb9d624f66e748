//! Tests of a path that the adapter refuses: the first reason is reported, and nothing moves beyond the
//! accepted part.

use super::deaths::Ordered;
use super::port::machine;
use super::world::World;
use super::*;
use crate::adapter::{AdapterLine, attend, greeted};
use crate::executor::{Report, Shared, Task};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::{Mark, Stage};
use annulus_core::steps::{Run, Segment, Steps, Switching};
use annulus_link::message::State as At;
use std::pin::pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};

fn way(runs: Vec<Run>, ticks: u64) -> Task {
    let (mark, stage, effect) = (Mark::Prepare, Stage::Travel, Switching::None);
    let (end, gate, lift_to) = (Steps::default(), None, None);
    let segments = vec![Segment { leg: 0, mark, stage, duration_ticks: ticks, runs, effect, gate, end }];
    let (surface_steps, board_steps, needs_durable) = (0, 0, 0);
    Task {
        id: 1,
        segments,
        follows: false,
        surface_steps,
        board_steps,
        needs_durable,
        lift_to,
        granted: false,
    }
}

/// Plays a task. Returns the error, the adapter's state half a minute later, and its number of pulses.
fn played(task: Task) -> (Diagnostic, At, usize) {
    NOW.set(Duration::from_secs(1));
    let machine = machine();
    let mut world = World::new(&machine, &Memory::default());
    world.written_down = Some(Vec::new());
    let mut line = AdapterLine::new(Box::new(world.port.clone()), 99, now);
    let shared = Arc::new(Shared::new(now));
    let host = async {
        greeted(&mut line, &machine).await?;
        let report = |report: Report| panic!("{report:?}");
        attend(line, &machine, &shared, Ordered([task].into()), report).await
    };
    let (mut host, mut context) = (pin!(host), Context::from_waker(Waker::noop()));
    let why = loop {
        match host.as_mut().poll(&mut context) {
            Poll::Ready(ended) => break ended.unwrap_err(),
            Poll::Pending => assert!(now() < Duration::from_secs(60), "{:?}", world.status()),
        }
        NOW.set(NOW.get() + Duration::from_millis(2));
        world.go_on();
    };
    NOW.set(NOW.get() + Duration::from_secs(30));
    world.go_on();
    (why, world.status().state, world.written_down.unwrap().len())
}

fn reason(why: &Diagnostic) -> &str {
    assert_eq!(why.code, "adapter.refused");
    assert!(!why.message("en").contains('{'), "{}", why.message("en"));
    let reason = why.args.iter().find(|(name, _)| name == "reason").map_or("", |(_, reason)| reason);
    reason.split(',').next().unwrap_or_default()
}

#[test]
fn too_dense_path_is_refused_before_it_starts() {
    let there_and_back =
        (0..200).map(|step| Run::even(1, step % 2 == 0, if step == 0 { 1_000 } else { 0 }, 1));
    let (why, state, pulses) = played(way(there_and_back.collect(), 10_000));
    assert_eq!((why.code.as_str(), state, pulses), ("adapter.too_dense", At::Ready, 0));
    assert!(!why.message("en").contains('{'), "{}", why.message("en"));
}

#[test]
fn refused_path_reports_its_first_reason() {
    // Steps one microsecond apart, closer than a pulse is long; the later pieces begin with a gap.
    for (slow, some) in [(100, false), (60_000, true)] {
        let runs = vec![
            Run::even(1, true, 1_000, slow),
            Run::even(1, true, 10, 100),
            Run::even(1, true, 1_000, 60_000),
        ];
        let (why, state, pulses) = played(way(runs, u64::from(slow + 60_001) * 1_000));
        assert_eq!((reason(&why), pulses > 0), ("Rate", some), "{why:?} {state:?}");
        assert!(state != At::Running && pulses <= slow as usize, "{state:?} {pulses}");
    }
}
