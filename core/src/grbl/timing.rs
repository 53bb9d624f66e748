//! Duration of a job on a controller that plans its own motion. Models GRBL's planner: trapezoids, junction
//! deviation, and a look-ahead of `blocks`.
//!
//! ```text
//!  speed ▲    ┌────────┐            limit of a block: its feed, or the limit of its slowest axis
//!        │   ╱          ╲──┐        junction: limited by its angle; zero at the end of the last known block
//!        └──╱──────────────╲─▶
//! ```

use super::lines::LinePath;
use super::settings::{self, Values};

/// Look-ahead of an 8-bit controller, in blocks.
pub const USUAL_BLOCKS: usize = 15;
/// GRBL's MINIMUM_FEED_RATE: 1 mm/min.
const SLOWEST_MM_PER_S: f64 = 1.0 / 60.0;

#[derive(Clone, Debug, PartialEq)]
pub struct PlannerLimits {
    /// Speed limit of each axis, mm/s.
    pub fastest_mm_per_s: [f64; 3],
    pub acceleration_mm_per_s2: [f64; 3],
    pub junction_mm: f64,
    /// Tolerance of the chords of an arc, mm.
    pub arc_mm: f64,
    /// Look-ahead in blocks.
    pub blocks: usize,
}

impl PlannerLimits {
    /// From the settings; `None` if they are incomplete.
    pub fn of(values: &Values, blocks: usize) -> Option<Self> {
        Some(Self {
            fastest_mm_per_s: settings::axes(values, 110)?.map(|rate| rate / 60.0),
            acceleration_mm_per_s2: settings::axes(values, 120)?,
            // GRBL's defaults of `$11` and `$12`.
            junction_mm: values.get(&11).copied().filter(|value| *value > 0.0).unwrap_or(0.01),
            arc_mm: values.get(&12).copied().filter(|value| *value > 0.0).unwrap_or(0.002),
            blocks: if blocks == 0 { USUAL_BLOCKS } else { blocks },
        })
    }

    fn along(most: &[f64; 3], unit: &[f64; 3]) -> f64 {
        let parts = (0..3).filter(|axis| unit[*axis] != 0.0);
        parts.map(|axis| most[axis] / libm::fabs(unit[axis])).fold(f64::INFINITY, f64::min)
    }
}

#[derive(Clone, Copy, Debug)]
struct Block {
    length: f64,
    /// Nominal speed, mm/s.
    nominal: f64,
    acceleration: f64,
    junction: f64,
}

/// Planner model that measures the duration of paths.
#[derive(Clone, Debug)]
pub struct Clockwork {
    limits: PlannerLimits,
    /// Blocks not started, oldest first.
    queue: std::collections::VecDeque<Block>,
    before: Option<([f64; 3], f64)>,
    /// Entry speed of the oldest block, squared.
    entry: f64,
    spent_s: f64,
}

impl Clockwork {
    pub fn new(limits: PlannerLimits) -> Self {
        Self { limits, queue: std::collections::VecDeque::new(), before: None, entry: 0.0, spent_s: 0.0 }
    }

    /// Duration without the blocks that have not started, s.
    pub fn spent_s(&self) -> f64 {
        self.spent_s
    }

    /// Runs all queued blocks to standstill, then waits.
    pub fn rest(&mut self, wait_s: f64) {
        while !self.queue.is_empty() {
            self.run_oldest();
        }
        (self.before, self.entry) = (None, 0.0);
        self.spent_s += wait_s;
    }

    /// Queues a path.
    pub fn go(&mut self, piece: &LinePath) {
        let Some(bow) = piece.bow else {
            return self.line(piece.from_mm, piece.to_mm, piece.feed_mm_per_min);
        };
        let arc = self.limits.arc_mm;
        // As `mc_arc` of GRBL splits an arc.
        let reach = arc * (2.0 * bow.radius_mm - arc);
        let parts = if reach > 0.0 { libm::floor(0.5 * bow.length() / libm::sqrt(reach)) } else { 0.0 };
        let parts = parts.clamp(1.0, 100_000.0) as u32;
        let mut from = piece.from_mm;
        for part in 1..=parts {
            let t = f64::from(part) / f64::from(parts);
            let [x, y] = bow.at(t);
            let to = if part == parts {
                piece.to_mm
            } else {
                [x, y, piece.from_mm[2] + (piece.to_mm[2] - piece.from_mm[2]) * t]
            };
            self.line(from, to, piece.feed_mm_per_min);
            from = to;
        }
    }

    fn line(&mut self, from: [f64; 3], to: [f64; 3], feed: Option<f64>) {
        let way: [f64; 3] = core::array::from_fn(|axis| to[axis] - from[axis]);
        let length = libm::sqrt(way.iter().map(|part| part * part).sum());
        if length < 1e-6 {
            return;
        }
        let unit = way.map(|part| part / length);
        let fastest = PlannerLimits::along(&self.limits.fastest_mm_per_s, &unit);
        let nominal = feed.map_or(fastest, |feed| (feed / 60.0).min(fastest)).max(SLOWEST_MM_PER_S);
        let acceleration = PlannerLimits::along(&self.limits.acceleration_mm_per_s2, &unit);
        let junction = match self.before {
            None => 0.0,
            Some((before, speed)) => self.corner(&before, &unit).min(speed * speed).min(nominal * nominal),
        };
        self.before = Some((unit, nominal));
        self.queue.push_back(Block { length, nominal, acceleration, junction });
        if self.queue.len() > self.limits.blocks {
            self.run_oldest();
        }
    }

    fn corner(&self, before: &[f64; 3], unit: &[f64; 3]) -> f64 {
        // As GRBL's planner: 1 is a reversal, −1 straight on; both need no square root.
        let cos = -(0..3).map(|axis| before[axis] * unit[axis]).sum::<f64>();
        if cos > 0.999_999 {
            return 0.0;
        }
        if cos < -0.999_999 {
            return f64::INFINITY;
        }
        let turn: [f64; 3] = core::array::from_fn(|axis| unit[axis] - before[axis]);
        let length = libm::sqrt(turn.iter().map(|part| part * part).sum());
        let along =
            PlannerLimits::along(&self.limits.acceleration_mm_per_s2, &turn.map(|part| part / length));
        let sin = libm::sqrt(0.5 * (1.0 - cos));
        along * self.limits.junction_mm * sin / (1.0 - sin)
    }

    /// Runs the oldest block as planned now: speed zero at the end of all known blocks.
    fn run_oldest(&mut self) {
        let mut exit = 0.0;
        for block in self.queue.iter().skip(1).rev() {
            exit = block.junction.min(exit + 2.0 * block.acceleration * block.length);
        }
        let Some(block) = self.queue.pop_front() else { return };
        let (a, entry) = (block.acceleration, self.entry);
        let exit = exit.min(entry + 2.0 * a * block.length).min(block.nominal * block.nominal);
        let peak = (0.5 * (entry + exit) + a * block.length).min(block.nominal * block.nominal);
        let (v0, v1, top) = (libm::sqrt(entry), libm::sqrt(exit), libm::sqrt(peak.max(entry).max(exit)));
        let ramps = ((top * top - entry) + (top * top - exit)) / (2.0 * a);
        let even = (block.length - ramps).max(0.0);
        self.spent_s += (top - v0) / a + (top - v1) / a + if top > 0.0 { even / top } else { 0.0 };
        self.entry = exit;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits() -> PlannerLimits {
        PlannerLimits {
            fastest_mm_per_s: [50.0; 3],
            acceleration_mm_per_s2: [100.0; 3],
            junction_mm: 0.01,
            arc_mm: 0.002,
            blocks: 15,
        }
    }

    fn straight(from: [f64; 3], to: [f64; 3], feed: Option<f64>) -> LinePath {
        LinePath { from_mm: from, to_mm: to, bow: None, feed_mm_per_min: feed }
    }

    #[test]
    fn single_moves_take_their_theoretical_time() {
        // Length, feed in mm/min, seconds: v/a + s/v, or 2·√(s/a) if the feed is not reached.
        for (length, feed, seconds) in
            [(100.0, 1200.0, 5.2), (1.0, 6000.0, 0.2), (0.04, 6000.0, 0.04), (10.0, 600.0, 1.1)]
        {
            let mut clock = Clockwork::new(limits());
            clock.go(&straight([0.0; 3], [length, 0.0, 0.0], Some(feed)));
            clock.rest(0.0);
            assert!((clock.spent_s() - seconds).abs() < 1e-9, "{length} {}", clock.spent_s());
        }
    }

    #[test]
    fn split_line_is_slower_only_by_the_look_ahead() {
        let run = |parts: u32, blocks: usize| {
            let mut clock = Clockwork::new(PlannerLimits { blocks, ..limits() });
            for part in 0..parts {
                let at = |n: u32| [100.0 * f64::from(n) / f64::from(parts), 0.0, 0.0];
                clock.go(&straight(at(part), at(part + 1), Some(1200.0)));
            }
            clock.rest(0.0);
            clock.spent_s()
        };
        assert!((run(1, 15) - 5.2).abs() < 1e-9 && (run(100, 15) - 5.2).abs() < 1e-9);
        // 15 blocks of 0.05 mm are 0.75 mm, in which the machine must be able to stop: √(2·100·0.75) = 12.2
        // mm/s.
        assert!(run(2_000, 15) > 100.0 / 12.3 && run(2_000, 15) < 100.0 / 11.0, "{}", run(2_000, 15));
        assert!(run(2_000, 1_000) < 5.3);
    }

    #[test]
    fn sharp_corner_stops_and_flat_one_does_not() {
        let run = |to: [f64; 3]| {
            let mut clock = Clockwork::new(limits());
            clock.go(&straight([0.0; 3], [10.0, 0.0, 0.0], Some(600.0)));
            clock.go(&straight([10.0, 0.0, 0.0], to, Some(600.0)));
            clock.rest(0.0);
            clock.spent_s()
        };
        assert!((run([20.0, 0.0, 0.0]) - 2.1).abs() < 1e-9);
        assert!((run([0.0, 0.0, 0.0]) - 2.2).abs() < 1e-9);
        let square = run([10.0, 10.0, 0.0]);
        assert!(square > 2.1 && square < 2.2, "{square}");
    }
}
