//! Works that are timed here and in WebAssembly, so that the two can be compared.
//!
//! Comes in: the number of a work. Goes out: its name, and a count of what it made, which is the same everywhere. What
//! a work starts from is made on its first run and kept. Knows no clock.

use crate::simulation::Simulation;
use crate::slider::Slider;
use crate::{copper, layer};
use annulus_core::board::Board;
use annulus_core::geometry::{self, Region, grow};
use annulus_core::job::Program;
use annulus_core::proof::{self, ProofOptions};
use annulus_core::units::Length;
use std::sync::OnceLock;

/// A work: what it is called, and what it does.
type Work = (&'static str, fn() -> u64);

/// All works.
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

/// How many works there are.
pub const COUNT: usize = WORKS.len();

/// What a work is called.
pub fn name(work: usize) -> &'static str {
    WORKS.get(work).map_or("", |work| work.0)
}

/// Does a work; gives a count of what it made.
pub fn run(work: usize) -> u64 {
    WORKS.get(work).map_or(0, |work| work.1())
}

fn mm(value: f64) -> Length {
    Length::from_mm(value)
}

/// How many segments a region has.
fn sizes(region: &Region) -> u64 {
    region.paths().map(|path| path.segments.len() as u64).sum()
}

fn layer() -> &'static Region {
    static LAYER: OnceLock<Region> = OnceLock::new();
    LAYER.get_or_init(|| geometry::union(&layer::outlines()))
}

/// As isolation makes them: every pass from the one before.
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

/// A million segments.
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
