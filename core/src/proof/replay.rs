//! Replays a program to get its cuts.
//!
//! ```text
//!   Rapid ········●                                surface, Z = 0
//!                 ╲ ramp        ╱ up
//!   ───────────────╲┄┄┄┄┄┄┄┄┄┄┄╱─────────────────  underside of the copper, Z = −thickness
//!                   ●─────────●
//!          shallow ┄┘  through └┄ shallow          a stretch is split there, and where a V-bit's width
//!                                                  changes by 2 µm
//! ```

use crate::geometry::{Path, PathSegment, Point, chords};
use crate::job::{Bit, Command, Cutter, Leg, Mark, Program};
use crate::units::Length;

/// Limit of a V-bit's change of width along one piece.
const WIDTH_STEP_MM: f64 = 0.002;
const MOST_PIECES: usize = 256;
/// Beyond this number of cuts, stretches are no longer split finely.
const MANY_CUTS: usize = 200_000;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PathCut {
    /// Path of the tool centre, in the files' coordinates; a plunge has no segments.
    pub path: Path,
    /// Index into the program's tools.
    pub bit: u32,
    pub program: u32,
    pub leg: u32,
    pub mark: Mark,
    /// Least depth along it, above zero.
    pub depth: Length,
    /// Greatest width at the surface.
    pub surface: Length,
    /// Least width at the underside of the copper; `None` if the copper is not cut through.
    pub through: Option<Length>,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReplayedCuts {
    /// In order of the program.
    pub cuts: Vec<PathCut>,
    /// First position of a cut before any tool was loaded.
    pub without_bit: Option<Point>,
    /// Cuts while the spindle is off: the first position for each time it is off.
    pub still: Vec<Still>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Still {
    /// Start of the cut, in the files' coordinates.
    pub at: Point,
    /// Depth, above zero.
    pub depth: Length,
    pub leg: u32,
    pub mark: Mark,
}

struct Tip<'a> {
    program: &'a Program,
    index: u32,
    copper: Length,
    at: Point,
    height: Length,
    bit: Option<u32>,
    leg: u32,
    mark: Mark,
    turns: bool,
    /// The cut with the spindle off was already reported.
    told: bool,
    out: ReplayedCuts,
}

/// Replays `program`, the one with this `index`, over copper of this thickness.
pub fn replay(program: &Program, index: u32, copper: Length) -> ReplayedCuts {
    let mut tip = Tip {
        program,
        index,
        copper,
        at: program.origin,
        height: program.safe_height,
        bit: None,
        leg: 0,
        mark: Mark::Prepare,
        turns: false,
        told: false,
        out: ReplayedCuts::default(),
    };
    for (number, leg) in (0..).zip(&program.legs) {
        tip.leg = number;
        tip.leg(leg);
        if let Some(last) = tip.out.cuts.last_mut() {
            last.path.segments.shrink_to_fit();
        }
    }
    tip.out
}

impl Tip<'_> {
    fn leg(&mut self, leg: &Leg) {
        self.mark = leg.mark;
        if let Mark::ToolChange(bit) = leg.mark {
            self.bit = Some(bit);
        }
        for command in &leg.commands {
            match *command {
                Command::Rapid { to } => self.segment(PathSegment::Line { to: self.placed(to) }, self.height),
                Command::Plunge { to, .. } => self.plunge(to),
                Command::Mill { to, height, .. } => {
                    self.segment(PathSegment::Line { to: self.placed(to) }, height);
                }
                Command::MillArc { to, height, center, ccw, .. } => {
                    let (to, centre) = (self.placed(to), self.placed(center));
                    self.segment(PathSegment::Arc { to, centre, clockwise: !ccw }, height);
                }
                Command::Retract { to } => self.height = to,
                Command::AwaitBit { bit } => self.bit = Some(bit),
                Command::Spindle { rpm } => {
                    self.turns = rpm > 0;
                    self.told &= !self.turns;
                }
                Command::Dwell { .. } => {}
            }
        }
    }

    /// In the files' coordinates.
    fn placed(&self, work: Point) -> Point {
        Point::new(work.x + self.program.origin.x, work.y + self.program.origin.y)
    }

    fn plunge(&mut self, to: Length) {
        self.height = to;
        let depth = -to;
        if depth > Length::ZERO {
            self.push(self.at, None, depth, depth);
        }
    }

    /// Moves along `segment` to `height`; splits the part below the surface.
    fn segment(&mut self, segment: PathSegment, height: Length) {
        let (from, first, last) = (self.at, -self.height, -height);
        self.at = segment.to();
        self.height = height;
        if first <= Length::ZERO && last <= Length::ZERO {
            return;
        }
        if first == last {
            self.push(from, Some(segment), first, last);
            return;
        }
        let shares = self.shares(first.mm(), last.mm());
        let mut start = from;
        for pair in shares.windows(2) {
            let [begin, end] = *pair else { continue };
            let piece = part(from, segment, end);
            let depth = |share: f64| Length::from_mm(first.mm() + (last.mm() - first.mm()) * share);
            let (a, b) = (depth(begin), depth(end));
            if a.max(b) > Length::ZERO {
                self.push(start, Some(piece), a, b);
            }
            start = piece.to();
        }
    }

    /// Shares, 0 to 1, at which to split a stretch with linear depth from `first` to `last`.
    fn shares(&self, first: f64, last: f64) -> Vec<f64> {
        let mut shares = vec![0.0, 1.0];
        for depth in [0.0, self.copper.mm()] {
            let share = (depth - first) / (last - first);
            if share > 0.0 && share < 1.0 {
                shares.push(share);
            }
        }
        let width = |depth: f64| self.bit().map_or(0.0, |bit| bit.width_at(Length::from_mm(depth)).mm());
        let change = (width(last) - width(first)).abs();
        let count = libm::ceil(change / WIDTH_STEP_MM).clamp(1.0, MOST_PIECES as f64) as usize;
        if self.out.cuts.len() < MANY_CUTS {
            shares.extend((1..count).map(|piece| piece as f64 / count as f64));
        }
        shares.sort_by(f64::total_cmp);
        shares.dedup();
        shares
    }

    fn bit(&self) -> Option<&Bit> {
        self.program.bits.get(self.bit.unwrap_or(0) as usize)
    }

    fn push(&mut self, from: Point, segment: Option<PathSegment>, one: Length, other: Length) {
        let (least, most) = (one.min(other).max(Length::ZERO), one.max(other));
        if !self.turns && !self.told {
            self.told = true;
            self.out.still.push(Still { at: from, depth: most, leg: self.leg, mark: self.mark });
        }
        if self.bit.is_none() && self.out.without_bit.is_none() {
            self.out.without_bit = Some(from);
        }
        let Some(bit) = self.bit() else {
            self.out.without_bit = self.out.without_bit.or(Some(from));
            return;
        };
        let (surface, below) = (bit.width_at(most), bit.width_at(least - self.copper));
        // If a stretch is split at the underside, rounding may leave a nanometre.
        let through = (least + Length::from_nm(1) >= self.copper && below > Length::ZERO).then_some(below);
        let cut = PathCut {
            path: Path { start: from, segments: segment.into_iter().collect() },
            bit: self.bit.unwrap_or(0),
            program: self.index,
            leg: self.leg,
            mark: self.mark,
            depth: least,
            surface,
            through,
        };
        match self.out.cuts.last_mut() {
            Some(last) if continues(last, &cut) => last.path.segments.extend(cut.path.segments),
            _ => self.out.cuts.push(cut),
        }
    }
}

/// True if `next` continues `last` with equal tool and depth.
fn continues(last: &PathCut, next: &PathCut) -> bool {
    last.leg == next.leg
        && last.bit == next.bit
        && last.depth == next.depth
        && last.surface == next.surface
        && last.through == next.through
        && last.path.end() == next.path.start
}

fn part(from: Point, segment: PathSegment, share: f64) -> PathSegment {
    if share >= 1.0 {
        return segment;
    }
    match segment {
        PathSegment::Line { to } => {
            let between = |a: Length, b: Length| Length::from_mm(a.mm() + (b.mm() - a.mm()) * share);
            PathSegment::Line { to: Point::new(between(from.x, to.x), between(from.y, to.y)) }
        }
        PathSegment::Arc { to, centre, clockwise } => {
            let turn = chords::turn(from, to, centre, clockwise) * share;
            let turn = if clockwise { -turn } else { turn };
            let (dx, dy) = ((from.x - centre.x).mm(), (from.y - centre.y).mm());
            let (sine, cosine) = (libm::sin(turn), libm::cos(turn));
            let to = Point::from_mm(
                centre.x.mm() + dx * cosine - dy * sine,
                centre.y.mm() + dx * sine + dy * cosine,
            );
            PathSegment::Arc { to, centre, clockwise }
        }
    }
}

impl PathCut {
    /// True if its tool only moves straight down.
    pub(super) fn is_drilled(&self, programs: &[Program]) -> bool {
        self.bit_of(programs).is_some_and(|bit| bit.cutter == Cutter::Drill)
    }

    /// Runout of its tool: distance of the cutting edge from the axis.
    pub(super) fn run_out(&self, programs: &[Program]) -> Length {
        self.bit_of(programs).map(|bit| bit.handling.run_out).unwrap_or_default()
    }

    fn bit_of<'a>(&self, programs: &'a [Program]) -> Option<&'a Bit> {
        programs.get(self.program as usize).and_then(|program| program.bits.get(self.bit as usize))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COPPER: Length = Length::from_um(35);

    fn vee() -> Bit {
        let cutter = Cutter::Vee { tip: Length::from_um(100), angle_mdeg: 60_000 };
        Bit { diameter: Length::from_mm(3.0), name: "V60".to_owned(), cutter, handling: Default::default() }
    }

    fn program(bits: Vec<Bit>, commands: Vec<Command>) -> Program {
        Program {
            name: String::new(),
            machine: String::new(),
            origin: Point::from_mm(10.0, 0.0),
            bits,
            spindles: 1,
            safe_height: Length::from_mm(2.0),
            legs: vec![Leg { mark: Mark::Toolpath(3), commands }],
            accepted: Vec::new(),
        }
    }

    fn mill(x: f64, y: f64, height_mm: f64) -> Command {
        Command::Mill { to: Point::from_mm(x, y), height: Length::from_mm(height_mm), feed_um_per_s: 1000 }
    }

    fn plunge(height_mm: f64) -> Command {
        Command::Plunge { to: Length::from_mm(height_mm), feed_um_per_s: 1000, gate: None }
    }

    #[test]
    fn toolpath_at_one_depth_is_one_cut_on_the_board() {
        let bit = Command::AwaitBit { bit: 0 };
        let up = Command::Retract { to: Length::from_mm(2.0) };
        let to = Point::from_mm(1.0, 1.0);
        let commands =
            vec![bit, Command::Rapid { to }, plunge(-0.1), mill(4.0, 1.0, -0.1), mill(4.0, 5.0, -0.1), up];
        let replay = replay(&program(vec![vee()], commands), 0, COPPER);
        assert_eq!(replay.without_bit, None);
        assert_eq!(replay.cuts.len(), 1);
        let cut = &replay.cuts[0];
        let corners: Vec<Point> = cut.path.corners().collect();
        let expected = [(11.0, 1.0), (14.0, 1.0), (14.0, 5.0)].map(|(x, y)| Point::from_mm(x, y));
        assert_eq!(corners, expected);
        let wide = |depth: f64| 0.1 + 2.0 * depth * libm::tan(std::f64::consts::PI / 6.0);
        assert!((cut.surface.mm() - wide(0.1)).abs() < 1e-6);
        assert!((cut.through.unwrap().mm() - wide(0.065)).abs() < 1e-6);
        assert_eq!((cut.mark, cut.depth), (Mark::Toolpath(3), Length::from_um(100)));
    }

    #[test]
    fn ramp_pieces_never_claim_too_much_width() {
        let bit = Command::AwaitBit { bit: 0 };
        let to = Point::from_mm(0.0, 0.0);
        let down = Command::Plunge { to: Length::ZERO, feed_um_per_s: 1000, gate: None };
        let replay = replay(
            &program(vec![vee()], vec![bit, Command::Rapid { to }, down, mill(10.0, 0.0, -0.2)]),
            0,
            COPPER,
        );
        let through: Vec<&PathCut> = replay.cuts.iter().filter(|cut| cut.through.is_some()).collect();
        // The cut is through from 35 / 200 of the length.
        assert!((through[0].path.start.x.mm() - 11.75).abs() < 1e-6);
        assert_eq!(replay.cuts.last().unwrap().path.end(), Point::from_mm(20.0, 0.0));
        for cut in &replay.cuts {
            let depth = |point: Point| (point.x.mm() - 10.0) / 10.0 * 0.2;
            assert!((cut.depth.mm() - depth(cut.path.start)).abs() < 2e-6);
            let truth =
                |at: Point, off: f64| 0.1 + 2.0 * (depth(at) - off) * libm::tan(std::f64::consts::PI / 6.0);
            assert!(cut.surface.mm() >= truth(cut.path.end(), 0.0) - 1e-5);
            assert!(cut.surface.mm() <= truth(cut.path.start, 0.0) + WIDTH_STEP_MM + 1e-5);
            assert!(cut.through.is_none_or(|width| width.mm() <= truth(cut.path.start, 0.035) + 1e-5));
        }
    }

    #[test]
    fn helix_stays_on_circle_and_missing_tool_is_reported() {
        let center = Point::from_mm(1.0, 0.0);
        let to = Point::from_mm(0.0, 0.0);
        let height = Length::from_mm(-1.0);
        let turn = Command::MillArc { to, height, center, ccw: true, feed_um_per_s: 1000 };
        let down = Command::Plunge { to: Length::ZERO, feed_um_per_s: 1000, gate: None };
        let replay = replay(&program(vec![vee()], vec![Command::Rapid { to }, down, turn]), 0, COPPER);
        assert_eq!(replay.without_bit, Some(Point::from_mm(10.0, 0.0)));
        for cut in &replay.cuts {
            assert!((cut.path.end().distance_mm(Point::from_mm(11.0, 0.0)) - 1.0).abs() < 1e-5);
        }
        let length: f64 = replay.cuts.iter().map(|cut| cut.path.length_mm()).sum();
        assert!((length - std::f64::consts::TAU).abs() < 1e-3, "{length}");
    }
}
