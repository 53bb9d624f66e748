//! Cuts segments into the pieces of path that the adapter still has to receive.
//!
//! Ticks, machine steps.

use super::path::{rule, runs};
use annulus_core::pins::Motors;
use annulus_core::steps::Segment;
use annulus_link::AXES;
use annulus_link::chunk::stopping;
use annulus_link::cutter::{ChunkCutter, Piece, Rule};
use annulus_link::message::Status;
use annulus_link::run::Run;
use std::collections::VecDeque;

pub(super) struct Path {
    runs: [Vec<Run>; AXES],
    ticks: u64,
    rule: Rule,
}

/// The path that is still to be sent, and the pieces on their way.
pub(super) struct Feed<'a> {
    paths: &'a [Path],
    cutter: Option<(ChunkCutter<'a>, Rule)>,
    /// The next piece: cut, but not yet offered to the line.
    pub(super) piece: Option<Piece>,
    number: u32,
    pub(super) index: [i32; AXES],
    /// Ticks of each piece that was offered but has not arrived; the number of the first of them; total
    /// ticks that arrived.
    on_the_way: VecDeque<u32>,
    first: u32,
    came: u64,
    /// Longest stopping time of any segment, in ticks: at least this much path must be ahead of the played
    /// position.
    pub(super) tail: u32,
}

impl Path {
    /// Prepares `segment` so that a hold stays within the limits of the motors.
    pub(super) fn of(segment: &Segment, motors: &Motors) -> Self {
        Self { runs: runs(segment), ticks: segment.duration_ticks, rule: rule(segment, motors) }
    }
}

impl<'a> Feed<'a> {
    /// Feeds all of `paths`, starting at the adapter's current chunk number and index.
    pub(super) fn new(paths: &'a [Path], status: &Status) -> Self {
        let (number, index) = (status.chunk, status.index);
        let tail = paths.iter().map(|path| stopping(path.rule.fall)).max().unwrap_or_default();
        let (first, on_the_way) = (number, VecDeque::new());
        Self { paths, cutter: None, piece: None, number, index, on_the_way, first, came: 0, tail }
    }

    pub(super) fn offered(&mut self) {
        self.on_the_way.extend(self.piece.take().map(|piece| piece.head.ticks));
    }

    /// Returns how much of the path the adapter has played, in ticks: what arrived, less what is still
    /// resident.
    pub(super) fn passed(&mut self, status: &Status) -> u64 {
        while self.first != status.chunk
            && let Some(ticks) = self.on_the_way.pop_front()
        {
            self.first = self.first.wrapping_add(1);
            self.came += u64::from(ticks);
        }
        self.came.saturating_sub(u64::from(status.resident))
    }

    /// Cuts until a piece is ready or nothing is left. Returns `false` if the path is too dense for a
    /// frame.
    pub(super) fn cut(&mut self) -> bool {
        while self.piece.is_none() {
            if let Some((cutter, rule)) = &mut self.cutter
                && !cutter.is_done()
            {
                self.piece = cutter.cut(rule);
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

    pub(super) fn is_over(&self) -> bool {
        let is_cut = self.cutter.as_ref().is_none_or(|(cutter, _)| cutter.is_done());
        self.paths.is_empty() && self.piece.is_none() && is_cut
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::holes;
    use annulus_core::job::Program;
    use annulus_core::machine::{Machine, hobby_3018, virtual_drill};
    use annulus_core::steps::stream_of;
    use annulus_link::frame::ON_LINE;
    use annulus_link::sender::Sender;

    /// Bytes per step on the cable, for all chunks of a program.
    fn bytes_a_step(machine: &Machine, program: &Program) -> f64 {
        let (motors, mut bytes, mut steps) = (Motors::of(machine), 0, 0);
        let paths: Vec<Path> = stream_of(program, machine)
            .unwrap()
            .segments
            .iter()
            .map(|segment| Path::of(segment, &motors))
            .collect();
        let mut sender = Sender::new(1);
        sender.hear(&Status { next: 1, limit: 1 << 30, ..Status::default() });
        let mut feed = Feed::new(&paths, &Status::default());
        let mut line = [0; ON_LINE];
        loop {
            assert!(feed.cut());
            let Some(piece) = feed.piece.take() else { break };
            let number = sender.offer_chunk(&piece.head, piece.slices()).unwrap();
            bytes += sender.due(0, &mut line).unwrap();
            sender.hear(&Status { next: number + 1, limit: 1 << 30, ..Status::default() });
            steps += piece.slices().into_iter().flatten().map(|run| run.count as usize).sum::<usize>();
        }
        bytes as f64 / steps as f64
    }

    #[test]
    fn drilled_board_takes_a_quarter_byte_per_step() {
        for machine in [virtual_drill(), hobby_3018()] {
            let found = bytes_a_step(&machine, &holes(&machine, 100, 10, |_| 800));
            println!("{}: {found:.3} byte a step", machine.name);
            assert!(found <= 0.25, "{}: {found:.3}", machine.name);
        }
    }
}
