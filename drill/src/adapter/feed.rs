//! What is left to be fed of some segments: pieces of path, one behind the other, each with its tail.
//!
//! Comes in: segments. Goes out: pieces, numbered on from what the adapter has. Ticks, machine steps. Does not know frames.

use super::path::{rule, runs, steeper};
use annulus_core::pins::Motors;
use annulus_core::steps::Segment;
use annulus_link::AXES;
use annulus_link::cutter::{ChunkCutter, Piece, Rule};
use annulus_link::message::Status;
use annulus_link::run::Run;

/// A segment as it is fed.
pub(super) struct Path {
    runs: [Vec<Run>; AXES],
    ticks: u64,
    rule: Rule,
}

/// What is left to be fed.
pub(super) struct Feed<'a> {
    paths: &'a [Path],
    cutter: Option<(ChunkCutter<'a>, Rule)>,
    /// Cut, and not yet offered.
    pub(super) piece: Option<Piece>,
    number: u32,
    /// Index of every axis behind what was cut.
    pub(super) index: [i32; AXES],
    /// Ticks of what was offered.
    pub(super) sent: u64,
}

impl Path {
    /// Of `segment`, so that a hold stays within what the motors can do.
    pub(super) fn of(segment: &Segment, motors: &Motors) -> Self {
        Self { runs: runs(segment), ticks: segment.duration_ticks, rule: rule(segment, motors) }
    }
}

impl<'a> Feed<'a> {
    /// All of `paths`, from where the adapter is.
    pub(super) fn new(paths: &'a [Path], status: &Status) -> Self {
        let (number, index) = (status.chunk, status.index);
        Self { paths, cutter: None, piece: None, number, index, sent: 0 }
    }

    /// Cuts until a piece is there or nothing is left. False where the path is too dense for a frame.
    pub(super) fn cut(&mut self) -> bool {
        while self.piece.is_none() {
            if let Some((cutter, rule)) = &mut self.cutter
                && !cutter.is_done()
            {
                let steep = steeper(rule);
                self.piece = cutter.cut(rule).or_else(|| cutter.cut(&steep?));
                (self.number, self.index) = (cutter.number(), cutter.index());
                return self.piece.is_some();
            }
            let Some((path, later)) = self.paths.split_first() else { return true };
            self.paths = later;
            let lists = path.runs.each_ref().map(Vec::as_slice);
            self.cutter = Some((ChunkCutter::new(lists, path.ticks, self.number, self.index), path.rule));
        }
        true
    }

    /// Whether everything was offered.
    pub(super) fn is_over(&self) -> bool {
        let is_cut = self.cutter.as_ref().is_none_or(|(cutter, _)| cutter.is_done());
        self.paths.is_empty() && self.piece.is_none() && is_cut
    }
}
