//! Functions timed both natively and in WebAssembly, for comparison. Their input is created at the first run
//! and cached.

use crate::simulation::Simulation;
use crate::slider::Slider;
use crate::{copper, layer};
use annulus_core::board::Board;
use annulus_core::geometry::{self, Region, grow};
use annulus_core::job::Program;
use annulus_core::proof::{self, ProofOptions};
use annulus_core::units::Length;
use std::sync::OnceLock;

/// Name and function.
type Work = (&'static str, fn() -> u64);

const WORKS: [Work; 13] = [
    ("union, 1,122 outlines", || sizes(&geometry::union(&layer::outlines()))),
    ("isolation, 1 pass", || passes(1)),
    ("isolation, 3 passes", || passes(3)),
    ("slivers of a pass", slivers),
    ("narrow places", || geometry::gaps(layer(), mm(0.3)).len() as u64),
    ("slider, 60 islands", slide),
    ("proof, 1,000 islands", proof),
    ("a million carved", || million().carved()),
    ("a million, 100 frames", || million().frames()),
    ("a million, 100 jumps", || million().jumps()),
    ("a million, 10,000 seconds", || million().moments()),
    ("a million, a press", || million().pressed()),
    ("a million, its lines", || million().lines()),
];

pub const COUNT: usize = WORKS.len();

pub fn name(work: usize) -> &'static str {
    WORKS.get(work).map_or("", |work| work.0)
}

/// Runs one; returns a count of its output.
pub fn run(work: usize) -> u64 {
    WORKS.get(work).map_or(0, |work| work.1())
}

fn mm(value: f64) -> Length {
    Length::from_mm(value)
}

/// The number of segments of a region.
fn sizes(region: &Region) -> u64 {
    region.paths().map(|path| path.segments.len() as u64).sum()
}

fn layer() -> &'static Region {
    static LAYER: OnceLock<Region> = OnceLock::new();
    LAYER.get_or_init(|| geometry::union(&layer::outlines()))
}

/// Like isolation: each pass from the previous one.
fn passes(count: usize) -> u64 {
    let more = |pass: &Region| Some(grow(pass, mm(0.1)));
    std::iter::successors(more(layer()), more).take(count).map(|pass| sizes(&pass)).sum()
}

fn slivers() -> u64 {
    static PASS: OnceLock<Region> = OnceLock::new();
    let pass = PASS.get_or_init(|| grow(layer(), mm(0.1)));
    geometry::strips(pass, mm(0.124), mm(0.178)).len() as u64
}

fn slide() -> u64 {
    static SLIDER: OnceLock<Slider> = OnceLock::new();
    SLIDER.get_or_init(Slider::new).moved_to(90) as u64
}

fn million() -> &'static Simulation {
    static MILLION: OnceLock<Simulation> = OnceLock::new();
    MILLION.get_or_init(|| Simulation::new(1_000_000))
}

fn proof() -> u64 {
    static JOB: OnceLock<(Board, [Program; 1])> = OnceLock::new();
    let (board, programs) = JOB.get_or_init(|| {
        let board = copper::islands(1_000);
        let programs = [copper::isolated(&board)];
        (board, programs)
    });
    proof::prove(board, programs, &ProofOptions::default()).findings.len() as u64
}
