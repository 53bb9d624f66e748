//! Tests of a host that dies during a job: after any last packet, the adapter stops on the path.
//!
//! The adapter's executor plays the job on an adapter in memory; the same job always gives the same
//! packets. `cargo xtask bench --adapter` reads the lines that begin with `measured`.

use super::port::{machine, milled};
use super::world::{Pulse, World};
use super::*;
use crate::adapter::{AdapterLine, attend, greeted};
use crate::executor::{Ended, Instruction, Shared, Task};
use crate::place::{Next, Orders};
use annulus_core::artwork::{Overrides, read_set};
use annulus_core::board::from_artwork;
use annulus_core::cam::PlanOptions;
use annulus_core::cam::toolpaths::{Means, lower_work, plan_work};
use annulus_core::cam::work::{OperationKind, Work};
use annulus_core::motion;
use annulus_core::steps::{Segment, stream_of};
use annulus_link::message::{State as At, Status as Said, Trust as Known};
use std::collections::VecDeque;
use std::pin::pin;
use std::sync::Arc;
use std::task::{Context, Waker};

const ALL: u64 = u64::MAX;

pub(super) struct Ordered(pub(super) VecDeque<Task>);

impl Orders for Ordered {
    fn next(&mut self, _: Option<Duration>) -> Next {
        self.0.pop_front().map_or(Next::Over, |task| Next::Order(Instruction::Task(task)))
    }
}

fn tasks(program: &Program) -> VecDeque<Task> {
    let mut tasks = VecDeque::<Task>::new();
    for segment in stream_of(program, &machine()).unwrap().segments {
        let leg = |segment: &Segment| segment.leg;
        match tasks.back_mut() {
            Some(task) if task.segments.first().map(leg) == Some(segment.leg) => task.segments.push(segment),
            _ => tasks.push_back(Task {
                id: tasks.len() as u64 + 1,
                segments: vec![segment],
                follows: false,
                surface_steps: 0,
                board_steps: 0,
                needs_durable: 0,
                lift_to: None,
                granted: false,
            }),
        }
    }
    tasks
}

/// A job, played until this many packets had arrived.
struct Played {
    pulses: Vec<Pulse>,
    before: usize,
    died_us: u64,
    status: Said,
    packets: u64,
    bytes: u64,
    of_path: u64,
    is_whole: bool,
}

fn played(tasks: &VecDeque<Task>, packets: u64) -> Played {
    NOW.set(Duration::from_secs(1));
    let machine = machine();
    let mut world = World::new(&machine, &Memory::default());
    (world.written_down, world.packets) = (Some(Vec::new()), Some(packets));
    let mut line = AdapterLine::new(Box::new(world.port.clone()), 99, now);
    let (shared, completed) = (Arc::new(Shared::new(now)), Cell::new(0));
    let host = async {
        greeted(&mut line, &machine).await.unwrap();
        let report = |report: crate::executor::Report| {
            assert_eq!(report.ended, Ended::Completed);
            completed.set(completed.get() + 1);
        };
        attend(line, &machine, &shared, Ordered(tasks.clone()), report).await.unwrap();
    };
    let (mut host, mut context) = (pin!(host), Context::from_waker(Waker::noop()));
    let mut is_whole = false;
    while world.packets != Some(0) && !is_whole {
        is_whole = host.as_mut().poll(&mut context).is_ready();
        NOW.set(NOW.get() + Duration::from_millis(2));
        world.go_on();
    }
    assert!(!is_whole || completed.get() == tasks.len());
    let (before, died_us) = (world.written_down.as_ref().map_or(0, Vec::len), now().as_micros() as u64);
    // Outputs go off when it stops, at the latest after 2 s.
    let until = now() + Duration::from_millis(2_500);
    while now() < until && (world.status().state == At::Running || world.status().outputs != 0) {
        NOW.set(NOW.get() + Duration::from_millis(10));
        world.go_on();
    }
    NOW.set(NOW.get() + Duration::from_millis(300));
    world.go_on();
    let packets = packets - world.packets.unwrap();
    let (status, pulses) = (world.status(), world.written_down.take().unwrap());
    Played { pulses, before, died_us, status, packets, bytes: world.bytes, of_path: world.of_path, is_whole }
}

fn of_axis(pulses: &[Pulse], axis: usize) -> impl Iterator<Item = &Pulse> {
    pulses.iter().filter(move |pulse| pulse.axis == axis)
}

fn place(pulses: &[Pulse]) -> [i32; 4] {
    std::array::from_fn(|axis| of_axis(pulses, axis).map(|pulse| if pulse.forward { 1 } else { -1 }).sum())
}

#[derive(Default)]
struct Deaths {
    count: u32,
    starved: u32,
    /// Longest time from the last packet to the last pulse, and longest travel in that time, all axes
    /// together.
    longest_ms: f64,
    farthest_mm: f64,
    /// Greatest difference between the adapter's count and the pins.
    most_off: i32,
}

impl Deaths {
    /// Checks that the adapter stopped on the path of the `whole` job, all axes at the same moment, with
    /// counts that agree with its pins.
    fn judge(&mut self, whole: &[Pulse], dead: &Played) {
        let (mut last, mut next) = (0, u64::MAX);
        for axis in 0..4 {
            let (mut wanted, mut made) = (of_axis(whole, axis), of_axis(&dead.pulses, axis));
            for made in &mut made {
                let wanted = wanted.next().expect("no step more than the job has");
                assert_eq!(made.forward, wanted.forward, "axis {axis} left the path");
                last = last.max(wanted.tick);
            }
            next = next.min(wanted.next().map_or(u64::MAX, |pulse| pulse.tick));
        }
        assert!(last <= next, "the axes rest at two moments of the path: {last} {next}");
        let (index, rests) = (dead.status.index, place(&dead.pulses));
        let off = (0..4).map(|axis| index[axis] - rests[axis]).map(i32::abs).max().unwrap();
        assert!(matches!(dead.status.state, At::Starved | At::Ready | At::Unset), "{:?}", dead.status);
        assert_eq!(dead.status.outputs, 0);
        assert!(dead.pulses.is_empty() || dead.status.trust == Known::Trusted, "{:?}", dead.status);
        let (there, machine) = (place(&dead.pulses[..dead.before]), machine());
        let far = |axis: usize| machine.axis(axis).scale.length(i64::from(rests[axis] - there[axis])).mm();
        let last_us = dead.pulses.last().map_or(0, |pulse| pulse.tick / 10);
        self.count += 1;
        self.starved += u32::from(dead.status.state == At::Starved);
        self.longest_ms = self.longest_ms.max(last_us.saturating_sub(dead.died_us) as f64 / 1e3);
        self.farthest_mm = self.farthest_mm.max((0..3).map(far).map(|mm| mm * mm).sum::<f64>().sqrt());
        self.most_off = self.most_off.max(off);
    }

    fn tell(&self, what: &str) {
        let Self { count, starved, longest_ms, farthest_mm, most_off } = self;
        println!(
            "measured deaths {what}: {count} deaths, {starved} amid the path; at rest after {longest_ms:.0} ms and {farthest_mm:.1} mm at \
             most; index off by {most_off} steps"
        );
        assert!(*most_off == 0 && *starved > count / 8, "{most_off} {starved}");
    }
}

#[test]
fn host_death_at_any_packet_leaves_the_path_at_rest() {
    let tasks = tasks(&drilled::holes(&machine(), 2, 2, |_| 800));
    let whole = played(&tasks, ALL);
    assert!(whole.is_whole && whole.pulses.len() > 1_000);
    let mut deaths = Deaths::default();
    for packets in 1..whole.packets {
        let dead = played(&tasks, packets);
        assert_eq!((dead.packets, dead.is_whole), (packets, false));
        deaths.judge(&whole.pulses, &dead);
    }
    deaths.tell("at every packet of a small job");
}

#[test]
fn host_death_at_random_packets_leaves_the_path_at_rest() {
    let jobs = [drilled::holes(&machine(), 6, 3, |_| 800), milled()].map(|program| tasks(&program));
    let mut deaths = Deaths::default();
    for (seed, tasks) in (1..).zip(&jobs) {
        let (whole, mut chance) = (played(tasks, ALL), Chance::new(seed));
        for _ in 0..if std::env::var_os("ANNULUS_LONG").is_some() { 5_000 } else { 500 } {
            let dead = played(tasks, 1 + chance.below(whole.packets as usize - 1) as u64);
            deaths.judge(&whole.pulses, &dead);
        }
    }
    deaths.tell("at packets of chance of two jobs");
}

/// The sample board that the page offers, as two programs: its holes, and everything else.
fn sample() -> [Program; 2] {
    let file = |name: &str| {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../www/examples");
        (name.to_owned(), std::fs::read(std::path::Path::new(folder).join(name)).unwrap())
    };
    let artwork =
        read_set(&["sensor.drl", "sensor-top.gbr", "sensor-outline.gbr"].map(file), &Overrides::default());
    let (board, _) = from_artwork(&artwork, &artwork.default_use());
    let machine = machine();
    [true, false].map(|drills| {
        let mut work = Work::default_for(&board, &machine);
        work.operations.retain(|operation| matches!(operation.action, OperationKind::Drill(_)) == drills);
        let rapid_time = |from, to| motion::rapid_time_s(&machine, from, to);
        let means = Means { options: &PlanOptions::default(), rapid_time: &rapid_time };
        let planned = plan_work(&board, &work, &machine, &means, &mut |_| true).unwrap().0;
        lower_work(&planned, &work, &machine)
    })
}

#[test]
fn sample_board_takes_few_bytes_per_step() {
    // At 80 steps/mm and 6 mm/s around pads of 1 mm, a run has few steps, and 50 ms have 24.
    for ((what, most), program) in [("drilling", 0.25), ("milling", 1.0)].into_iter().zip(sample()) {
        let whole = played(&tasks(&program), ALL);
        let (steps, bytes) = (whole.pulses.len(), whole.bytes);
        let [path, all] = [whole.of_path, bytes].map(|bytes| bytes as f64 / steps as f64);
        println!(
            "measured bytes {what}: {path:.2} bytes a step, heads and tails included; {all:.2} with everything else that is said ({steps} \
             steps)"
        );
        assert!(steps > 10_000 && path <= most && path <= all, "{path} {all}");
    }
}
