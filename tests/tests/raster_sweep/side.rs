//! One side of a board: plans, exports and reads it again, and makes its rasters. Contains no checks.

use super::raster::Raster;
use super::reader::{self, Read, Tool};
use super::{BEYOND, DOT};
use annulus_core::board::{Board, Face};
use annulus_core::cam::toolpaths::{Means, Planned, lower_work, plan_work};
use annulus_core::cam::work::Work;
use annulus_core::cam::{PlanOptions, briefing};
use annulus_core::geometry::{Path, PathSegment, Point};
use annulus_core::machine::Machine;
use annulus_core::motion;
use annulus_core::post::{self, Manner};
use annulus_core::proof::{self, Finding};
use std::collections::BTreeMap;

/// A planned side of a board, and its exported files.
pub(super) struct Side {
    pub(super) planned: Planned,
    pub(super) files: Vec<Read>,
    pub(super) findings: Vec<Finding>,
}

pub(super) fn planned_side(board: &Board, work: &Work, machine: &Machine) -> Side {
    let options = PlanOptions::default();
    let rapid_time = |from: Point, to: Point| motion::rapid_time_s(machine, from, to);
    let means = Means { options: &options, rapid_time: &rapid_time };
    let (planned, _) = plan_work(board, work, machine, &means, &mut |_| true).expect("a plan");
    let program = lower_work(&planned, work, machine);
    let mut briefed = briefing::briefing("sweep", work, machine);
    briefing::add_side(&mut briefed, work.setup.face, work, (&planned, &program), &[]);
    let files = post::write_for("grbl", &program, &Manner::on(machine), &briefed, 0).unwrap().expect("files");
    let files = files
        .iter()
        .map(|file| reader::read(&file.text).unwrap_or_else(|why| panic!("{}: {why}", file.name)));
    let files = files.collect();
    let asked = proof::ProofOptions {
        face: work.setup.face,
        owned: work.bits.clone(),
        ..proof::ProofOptions::default()
    };
    let findings = proof::prove(&planned.board, std::slice::from_ref(&program), &asked).findings;
    Side { planned, files, findings }
}

/// The points of a path with arcs as chords, mm from the work zero.
pub(super) fn places(path: &Path, zero: Point) -> Vec<[f64; 2]> {
    let mm = |at: Point| [(at.x - zero.x).mm(), (at.y - zero.y).mm()];
    let (mut from, mut out) = (mm(path.start), vec![mm(path.start)]);
    for segment in &path.segments {
        match *segment {
            PathSegment::Line { to } => out.push(mm(to)),
            PathSegment::Arc { to, centre, clockwise } => {
                let (to, centre) = (mm(to), mm(centre));
                let radius = (from[0] - centre[0]).hypot(from[1] - centre[1]);
                let angle = |at: [f64; 2]| (at[1] - centre[1]).atan2(at[0] - centre[0]);
                let sense = if clockwise { -1.0 } else { 1.0 };
                let mut turn = (angle(to) - angle(from)) * sense;
                if turn <= 1e-9 {
                    turn += std::f64::consts::TAU;
                }
                let count = (turn / (0.1 / radius.max(0.1)).min(0.2)).ceil().max(1.0) as u32;
                out.extend((1..=count).map(|index| {
                    let angle = angle(from) + sense * turn * f64::from(index) / f64::from(count);
                    [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()]
                }));
            }
        }
        from = *out.last().unwrap();
    }
    out
}

/// A raster that contains the board as placed on the machine.
pub(super) fn sheet(side: &Side, dot: f64) -> Raster {
    let zero = side.planned.origin;
    let board = &side.planned.board;
    let around = [board.outline.bounds(), board.bounds()].into_iter().flatten();
    let copper = board.copper.iter().filter_map(|copper| copper.region.bounds());
    let all = around.chain(copper).reduce(|all, next| all.with(next.min).with(next.max)).expect("a board");
    let mm = |at: Point, by: f64| [(at.x - zero.x).mm() + by, (at.y - zero.y).mm() + by];
    Raster::new(mm(all.min, -BEYOND), mm(all.max, BEYOND), dot)
}

/// The copper islands, each with its net number from 1.
pub(super) fn design(side: &Side, face: Face) -> Raster {
    let mut out = sheet(side, DOT);
    let Some(copper) = side.planned.board.copper.iter().find(|copper| copper.face == face) else {
        return out;
    };
    let mut nets: BTreeMap<String, u16> = BTreeMap::new();
    for (index, island) in copper.region.islands.iter().enumerate() {
        let own = (index + 1) as u16;
        let named = copper.nets.get(index).cloned().flatten();
        let net = named.map_or(own, |name| *nets.entry(name).or_insert(own));
        let outlines: Vec<_> = island.paths().map(|path| places(path, side.planned.origin)).collect();
        out.area(&outlines, net);
    }
    out
}

/// Everything that the files remove at `height` and above.
pub(super) fn cut(side: &Side, height: f64, dot: f64, of: impl Fn(Tool) -> bool) -> Raster {
    let mut out = sheet(side, dot);
    for file in side.files.iter().filter(|file| of(file.tool)) {
        for &piece in &file.pieces {
            out.sweep(file.tool, piece, height);
        }
    }
    out
}
