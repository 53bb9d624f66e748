//! Finds where a move must be split so that straight pieces follow the surface.
//!
//! ```text
//!      │    ╭──┼──╮            split at every grid line, because the surface bends there; between lines
//!   ───┼───╯   │   ╲           split evenly, as the twist of the cell and the curve of an arc require:
//!      │       │               a piece of length L deviates by at most L²/8 · |h″|
//! ```

use super::HeightMap;
use crate::geometry::{Point, chords};
use crate::units::Length;
use std::f64::consts::{PI, TAU};

/// Shortest piece: a shorter arc might be mistaken for a full circle.
const SHORTEST_MM: f64 = 0.02;
/// Most pieces of one move; beyond that the error grows.
const MOST_PIECES: usize = 4_096;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlaneCourse {
    from: [f64; 2],
    to: [f64; 2],
    arc: Option<Turned>,
    length_mm: f64,
    end: Point,
}

/// An arc. Its radius changes evenly if the ends are not on one circle.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Turned {
    centre: [f64; 2],
    radius: [f64; 2],
    begin_rad: f64,
    sweep_rad: f64,
}

impl PlaneCourse {
    pub(super) fn line(from: Point, to: Point) -> Self {
        let place = |point: Point| [point.x.mm(), point.y.mm()];
        Self { from: place(from), to: place(to), arc: None, length_mm: from.distance_mm(to), end: to }
    }

    /// An arc; a full circle if it ends at its start.
    pub(super) fn arc(from: Point, to: Point, centre: Point, ccw: bool) -> Self {
        let turn = chords::turn(from, to, centre, !ccw);
        let radius = [from.distance_mm(centre), to.distance_mm(centre)];
        let arc = Turned {
            centre: [centre.x.mm(), centre.y.mm()],
            radius,
            begin_rad: libm::atan2((from.y - centre.y).mm(), (from.x - centre.x).mm()),
            sweep_rad: if ccw { turn } else { -turn },
        };
        Self { arc: Some(arc), length_mm: radius[0].max(radius[1]) * turn, ..Self::line(from, to) }
    }

    pub(super) fn at(&self, share: f64) -> Point {
        if share >= 1.0 {
            return self.end;
        }
        let [x, y] = self.place_mm(share);
        Point::from_mm(x, y)
    }

    fn place_mm(&self, share: f64) -> [f64; 2] {
        let Some(arc) = self.arc else {
            return [0, 1].map(|axis| self.from[axis] + (self.to[axis] - self.from[axis]) * share);
        };
        let angle = arc.begin_rad + arc.sweep_rad * share;
        let radius = arc.radius[0] + (arc.radius[1] - arc.radius[0]) * share;
        [arc.centre[0] + radius * libm::cos(angle), arc.centre[1] + radius * libm::sin(angle)]
    }

    /// The shares at which the path must be split, in order, including its end.
    pub(super) fn cuts(&self, map: &HeightMap, tolerance: Length) -> Vec<f64> {
        if self.length_mm < 2.0 * SHORTEST_MM {
            return vec![1.0];
        }
        let shortest = SHORTEST_MM / self.length_mm;
        let mut bends: Vec<f64> = (0..2).flat_map(|axis| self.crossings(map, axis)).collect();
        bends.retain(|share| (shortest..=1.0 - shortest).contains(share));
        bends.sort_unstable_by(f64::total_cmp);
        bends.dedup_by(|next, before| *next - *before < shortest);
        bends.push(1.0);
        let mut cuts = Vec::new();
        let mut before = 0.0;
        for bend in bends {
            let pieces = self.pieces(map, [before, bend], tolerance.mm());
            cuts.extend((1..pieces).map(|piece| before + (bend - before) * piece as f64 / pieces as f64));
            cuts.push(bend);
            before = bend;
        }
        cuts
    }

    /// Shares at which the path crosses the inner grid lines of `axis`.
    fn crossings(&self, map: &HeightMap, axis: usize) -> Vec<f64> {
        let lines = (1..map.grid.lines(axis) - 1).map(|index| map.grid.line(axis, index).mm());
        let Some(arc) = self.arc else {
            let (from, way) = (self.from[axis], self.to[axis] - self.from[axis]);
            return lines.filter(|_| way != 0.0).map(|line| (line - from) / way).collect();
        };
        let mut shares = Vec::new();
        for line in lines {
            let ratio = (line - arc.centre[axis]) / arc.radius[0];
            if !(-1.0..=1.0).contains(&ratio) {
                continue;
            }
            let angle = libm::acos(ratio);
            let angles = if axis == 0 { [angle, -angle] } else { [PI / 2.0 - angle, PI / 2.0 + angle] };
            for angle in angles {
                let turned = (angle - arc.begin_rad) * if arc.sweep_rad < 0.0 { -1.0 } else { 1.0 };
                // Normalise to less than one turn in the direction of the arc.
                let turned = turned - TAU * libm::floor(turned / TAU);
                shares.push(turned / libm::fabs(arc.sweep_rad));
            }
        }
        shares
    }

    fn pieces(&self, map: &HeightMap, [from, to]: [f64; 2], tolerance_mm: f64) -> usize {
        let middle = self.at((from + to) / 2.0);
        let patch = map.patch(middle);
        let length_mm = self.length_mm * (to - from);
        let twist = libm::fabs(patch.twist_per_mm());
        let bend = match self.arc {
            None => {
                let way = [0, 1].map(|axis| (self.to[axis] - self.from[axis]) / self.length_mm);
                2.0 * libm::fabs(way[0] * way[1]) * twist
            }
            Some(arc) => {
                let shares = [from, (from + to) / 2.0, to].map(|share| self.place_mm(share));
                let far = |[x, y]: [f64; 2]| {
                    let [u, v] = patch.share(x, y);
                    libm::fabs(u - 0.5).max(libm::fabs(v - 0.5))
                };
                // The outermost cells are extrapolated, and get steeper with distance.
                let most = 1.0 + shares.map(far).into_iter().fold(0.0, f64::max);
                twist + patch.steepest(most) / arc.radius[0].min(arc.radius[1]).max(SHORTEST_MM)
            }
        };
        let wanted = length_mm * libm::sqrt(bend / (8.0 * tolerance_mm));
        let most = (length_mm / SHORTEST_MM).clamp(1.0, MOST_PIECES as f64);
        libm::ceil(wanted).clamp(1.0, most) as usize
    }
}
