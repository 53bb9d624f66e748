//! A raster of dots for the sweep: what tools remove, what the design wants, what is connected. Lengths in
//! mm.

use super::reader::{Piece, Tool};

/// Dots in rows, from the lower left.
#[derive(Clone, Debug)]
pub(crate) struct Raster {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Lower left corner.
    pub(crate) corner: [f64; 2],
    /// Side of a dot.
    pub(crate) dot: f64,
    pub(crate) dots: Vec<u16>,
}

impl Raster {
    /// An empty raster between two corners.
    pub(crate) fn new(low: [f64; 2], high: [f64; 2], dot: f64) -> Self {
        let count = |axis: usize| ((high[axis] - low[axis]) / dot).ceil() as usize;
        let (width, height) = (count(0), count(1));
        Self { width, height, corner: low, dot, dots: vec![0; width * height] }
    }

    /// The dots of a row whose centers are between two positions.
    fn row(&self, low: f64, high: f64) -> std::ops::Range<usize> {
        let first = ((low - self.corner[0]) / self.dot - 0.5).ceil().max(0.0) as usize;
        let last = ((high - self.corner[0]) / self.dot + 0.5).floor().clamp(0.0, self.width as f64) as usize;
        first.min(last)..last
    }

    fn rows(&self, low: f64, high: f64) -> std::ops::Range<usize> {
        let first = ((low - self.corner[1]) / self.dot - 0.5).ceil().max(0.0) as usize;
        let last = ((high - self.corner[1]) / self.dot + 0.5).floor().clamp(0.0, self.height as f64) as usize;
        first.min(last)..last
    }

    /// Center of a row.
    fn y(&self, row: usize) -> f64 {
        self.corner[1] + (row as f64 + 0.5) * self.dot
    }

    fn fill(&mut self, row: usize, low: f64, high: f64, value: u16) {
        let start = row * self.width;
        let range = self.row(low, high);
        self.dots[start + range.start..start + range.end].fill(value);
    }

    /// Fills everything within `radius` of a line.
    pub(crate) fn stroke(&mut self, from: [f64; 2], to: [f64; 2], radius: f64, value: u16) {
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        let length = dx.hypot(dy);
        let normal = if length > 0.0 { [-dy / length * radius, dx / length * radius] } else { [0.0, 0.0] };
        let corners = [
            [from[0] + normal[0], from[1] + normal[1]],
            [to[0] + normal[0], to[1] + normal[1]],
            [to[0] - normal[0], to[1] - normal[1]],
            [from[0] - normal[0], from[1] - normal[1]],
        ];
        for row in self.rows(from[1].min(to[1]) - radius, from[1].max(to[1]) + radius) {
            let y = self.y(row);
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            let mut reach = |x: f64| (low, high) = (low.min(x), high.max(x));
            for end in [from, to] {
                let across = radius * radius - (y - end[1]) * (y - end[1]);
                if across >= 0.0 {
                    reach(end[0] - across.sqrt());
                    reach(end[0] + across.sqrt());
                }
            }
            for index in 0..4 {
                let (a, b) = (corners[index], corners[(index + 1) % 4]);
                if (a[1] <= y) != (b[1] <= y) {
                    reach(a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]));
                }
            }
            if low <= high {
                self.fill(row, low, high, value);
            }
        }
    }

    /// Fills what `tool` removes at `height` and above along a segment.
    pub(crate) fn sweep(&mut self, tool: Tool, piece: Piece, height: f64) {
        let Piece { from, to } = piece;
        // A segment with changing height is divided into steps of one dot.
        let steps = if from[2] == to[2] || from[..2] == to[..2] {
            1.0
        } else {
            ((to[0] - from[0]).hypot(to[1] - from[1]) / self.dot).ceil().max(1.0)
        };
        let at = |share: f64| [0, 1, 2].map(|axis| from[axis] + (to[axis] - from[axis]) * share);
        for step in 0..steps as usize {
            let (a, b) = (at(step as f64 / steps), at((step as f64 + 1.0) / steps));
            let tip = if steps > 1.0 { (a[2] + b[2]) / 2.0 } else { a[2].min(b[2]) };
            if tip <= height {
                self.stroke([a[0], a[1]], [b[0], b[1]], tool.radius_at(height - tip), 1);
            }
        }
    }

    /// Fills the dots inside an odd number of `outlines`.
    pub(crate) fn area(&mut self, outlines: &[Vec<[f64; 2]>], value: u16) {
        let ys = || outlines.iter().flatten().map(|place| place[1]);
        let (low, high) = (ys().fold(f64::INFINITY, f64::min), ys().fold(f64::NEG_INFINITY, f64::max));
        if low > high {
            return;
        }
        for row in self.rows(low, high) {
            let y = self.y(row);
            let mut crossed: Vec<f64> = Vec::new();
            for outline in outlines {
                for (index, a) in outline.iter().enumerate() {
                    let b = outline[(index + 1) % outline.len()];
                    if (a[1] <= y) != (b[1] <= y) {
                        crossed.push(a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]));
                    }
                }
            }
            crossed.sort_by(f64::total_cmp);
            for pair in crossed.chunks_exact(2) {
                self.fill(row, pair[0], pair[1], value);
            }
        }
    }

    /// Labels the connected areas of zeros from 1; other dots get 0.
    pub(crate) fn pieces_of_nothing(&self) -> Vec<u32> {
        let mut labels = vec![0_u32; self.dots.len()];
        let (mut next, mut waiting) = (0, Vec::new());
        for first in 0..self.dots.len() {
            if self.dots[first] != 0 || labels[first] != 0 {
                continue;
            }
            next += 1;
            labels[first] = next;
            waiting.push(first);
            while let Some(here) = waiting.pop() {
                let x = here % self.width;
                let around = [
                    (x > 0).then(|| here - 1),
                    (x + 1 < self.width).then(|| here + 1),
                    here.checked_sub(self.width),
                    (here + self.width < self.dots.len()).then(|| here + self.width),
                ];
                for dot in around.into_iter().flatten() {
                    if self.dots[dot] == 0 && labels[dot] == 0 {
                        labels[dot] = next;
                        waiting.push(dot);
                    }
                }
            }
        }
        labels
    }

    /// Removes dots next to a different one, this many times.
    pub(crate) fn eroded(&self, times: usize) -> Self {
        let mut now = self.clone();
        for _ in 0..times {
            let before = now.dots.clone();
            for (dot, value) in now.dots.iter_mut().enumerate().filter(|(_, value)| **value != 0) {
                let x = dot % self.width;
                let inside = x > 0
                    && x + 1 < self.width
                    && dot >= self.width
                    && dot + self.width < before.len()
                    && [dot - 1, dot + 1, dot - self.width, dot + self.width]
                        .iter()
                        .all(|beside| before[*beside] == *value);
                if !inside {
                    *value = 0;
                }
            }
        }
        now
    }

    /// Center of a dot.
    pub(crate) fn place(&self, dot: usize) -> [f64; 2] {
        [self.corner[0] + ((dot % self.width) as f64 + 0.5) * self.dot, self.y(dot / self.width)]
    }

    /// The dot at a position; none outside the raster.
    pub(crate) fn dot_at(&self, at: [f64; 2]) -> Option<usize> {
        let [x, y] = [0, 1].map(|axis| ((at[axis] - self.corner[axis]) / self.dot).floor());
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        inside.then(|| y as usize * self.width + x as usize)
    }
}
