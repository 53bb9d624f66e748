//! The benchmarked functions, identical natively and in WebAssembly.

pub mod copper;
pub mod layer;
mod pace;
pub mod simulation;
pub mod slider;
pub mod works;

pub use pace::{Pace, pace};

use annulus_core::board::Board;
use annulus_core::cam::toolpaths::{Means, Planned, lower_work, plan_work};
use annulus_core::cam::work::Work;
use annulus_core::cam::{self, HoleOrder, PlanOptions};
use annulus_core::machine::{Machine, virtual_drill};
use annulus_core::motion::{self, Timeline};
use annulus_core::steps;

/// The benchmarked machine: the virtual drill with room for the scattered board.
pub fn machine() -> Machine {
    virtual_drill()
}

/// A planned job of `holes` scattered holes, in file order, on [`machine`].
pub fn timeline(holes: usize) -> Timeline {
    timeline_on(&machine(), holes)
}

/// Like [`timeline`], on any machine.
pub fn timeline_on(machine: &Machine, holes: usize) -> Timeline {
    let board = cam::bench::scattered_board(holes, 1);
    let work = Work::drilling(&board, machine, HoleOrder::File);
    let program = lower_work(&drilled(&board, &work, machine), &work, machine);
    motion::timeline(&program, machine).expect("the machine is sound")
}

/// The plan of a drill job.
pub fn drilled(board: &Board, work: &Work, machine: &Machine) -> Planned {
    let rapid_time = |from, to| motion::rapid_time_s(machine, from, to);
    let means = Means { options: &PlanOptions::default(), rapid_time: &rapid_time };
    plan_work(board, work, machine, &means, &mut |_| true).expect("0.8 mm is in the rack").0
}

/// Total number of steps of a timeline, in both directions.
pub fn steps_of(timeline: &Timeline) -> u64 {
    let parts = timeline.moves.iter().flat_map(|planned| &planned.parts);
    let toolpaths = parts.flat_map(|part| part.from.iter().zip(&part.to));
    toolpaths.map(|(from, to)| to.abs_diff(*from)).sum()
}

/// Encodes the stream of `timeline`; returns its length in bytes, so that nothing is optimised away.
pub fn make_stream(timeline: &Timeline) -> u64 {
    make_stream_on(&machine(), timeline)
}

/// Like [`make_stream`], on any machine.
pub fn make_stream_on(machine: &Machine, timeline: &Timeline) -> u64 {
    steps::stream(timeline, machine).map_or(0, |stream| steps::encoded_len(&stream))
}

static PREPARED: std::sync::OnceLock<Timeline> = std::sync::OnceLock::new();

/// For WebAssembly: prepares a job of `holes` holes and returns its number of steps.
#[unsafe(no_mangle)]
pub extern "C" fn prepare(holes: u32) -> u64 {
    steps_of(PREPARED.get_or_init(|| timeline(holes as usize)))
}

/// For WebAssembly: encodes the stream of the prepared job.
#[unsafe(no_mangle)]
pub extern "C" fn make() -> u64 {
    PREPARED.get().map_or(0, make_stream)
}

/// For WebAssembly: runs one of the [`works`]; returns a count of its output.
#[unsafe(no_mangle)]
pub extern "C" fn work(number: u32) -> u64 {
    works::run(number as usize)
}
