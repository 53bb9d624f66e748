//! Height maps: how high the board's surface really is, place by place, and programs whose depth follows it (N17).
//!
//! ```text
//!  Bounds ─ grid ─▶ ProbeGrid ─ survey ─▶ places to touch ◀─ heights ─ whoever moves the machine
//!                                   │
//!                                HeightMap ─ follow ─▶ moves split so that depth follows the surface
//! ```
//!
//! Comes in: what is cut, heights that were touched, a program. Goes out: places to touch, a [`HeightMap`], a program that follows it
//! and the largest correction. Lengths in whole nanometres, work coordinates. Does not know who touches, nor with what.
//!
//! A map is applied when a program is about to run, to the program as it was planned; what comes out is a [`Levelled`], that runs and is
//! neither kept nor planned from. So none is levelled twice.

mod along;
mod follow;
mod grid;
mod survey;

pub use follow::{Correction, FollowedCourse, Follower, Levelled, TOLERANCE, level};
pub use grid::ProbeGrid;
pub use survey::Survey;

use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::job::{Command, Mark, Program};
use crate::units::Length;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fmt::Write;

/// Hexadecimal digits of the name and the zero in the key of a job; where it cuts stands behind them.
const JOB_DIGITS: usize = 64;
/// A work zero may be so far from where it was when the map was measured: less than the rounding of any report.
const SAME_ZERO: Length = Length::from_um(10);
/// What a tool may reach beyond the outermost touched places and their margin.
const BEYOND: Length = Length::from_um(5_000);
/// A surface that is further from the work zero than this was not measured well, or is no board.
const FURTHEST: Length = Length::from_um(5_000);

/// A surface as it was touched.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HeightMap {
    /// Where it was touched.
    pub grid: ProbeGrid,
    /// Height over the work zero at each of those places, row by row from the lowest corner.
    pub heights: Vec<Length>,
    /// Of which job: [`job_key`], compared by [`same_job`].
    pub job: String,
    /// Where the work zero was, machine coordinates of X and Y.
    pub zero: [Length; 2],
    /// The machine knew its place by its end sensors: the zero is the same place after it was turned off, too.
    pub homed: bool,
    /// When it was measured, seconds since 1970.
    pub measured_s: u64,
}

/// What a map is for: the name of a job, where its zero lies in its files, and where it cuts. Depths, feeds and the order may change;
/// the board may not. A job with `holes` is told by these alone, for its toolpaths change with every tool; another by the places of its
/// `toolpaths`.
pub fn job_key(name: &str, origin: Point, holes: Vec<Point>, toolpaths: Vec<Point>) -> String {
    let job = hexadecimal(format!("{name}\n{} {}", origin.x.nm(), origin.y.nm()).as_bytes());
    let (kind, mut places) = if holes.is_empty() { ('t', toolpaths) } else { ('h', holes) };
    if places.is_empty() {
        return job;
    }
    places.sort_unstable_by_key(|at| (at.x, at.y));
    places.dedup();
    let text = places.iter().fold(String::new(), |mut text, at| {
        let _ = writeln!(text, "{} {}", at.x.nm(), at.y.nm());
        text
    });
    format!("{job}{kind}{}", hexadecimal(text.as_bytes()))
}

/// Whether two of these may be keys of one board: a job with holes and one without can be parts of the same.
pub fn same_job(one: &str, other: &str) -> bool {
    let ((one, places), (other, others)) = (parts_of(one), parts_of(other));
    let kind = |places: &str| places.chars().next();
    one == other && (kind(places) != kind(others) || places == others)
}

/// The job, and where it cuts.
fn parts_of(key: &str) -> (&str, &str) {
    key.split_at_checked(JOB_DIGITS).unwrap_or((key, ""))
}

/// The same of a program.
pub fn key_of(program: &Program) -> String {
    let (mut holes, mut toolpaths) = (Vec::new(), Vec::new());
    for leg in &program.legs {
        let places = leg.commands.iter().filter_map(|command| match *command {
            Command::Rapid { to } | Command::Mill { to, .. } | Command::MillArc { to, .. } => Some(to),
            _ => None,
        });
        match leg.mark {
            Mark::Hole(_) => holes.extend(places),
            Mark::Toolpath(_) => toolpaths.extend(places),
            _ => {}
        }
    }
    job_key(&program.name, program.origin, holes, toolpaths)
}

fn hexadecimal(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

impl HeightMap {
    /// Whether it is one: as many heights as places, none further away than a board can be.
    pub fn is_whole(&self) -> bool {
        self.grid.is_sound()
            && self.heights.len() == self.grid.count()
            && self.heights.iter().all(|height| (-FURTHEST..=FURTHEST).contains(height))
            && self.zero.iter().all(|zero| (-Length::LIMIT..=Length::LIMIT).contains(zero))
    }

    /// SHA-256 of all that it says, as hexadecimal digits.
    pub fn key(&self) -> String {
        hexadecimal(&postcard::to_allocvec(self).unwrap_or_default())
    }

    /// The lowest and the highest height that was touched.
    pub fn span(&self) -> [Length; 2] {
        let heights = || self.heights.iter().copied();
        [heights().min().unwrap_or_default(), heights().max().unwrap_or_default()]
    }

    /// Why it cannot be used for a job whose key is `job`, with the work zero at `zero` in machine coordinates; `homed` says that the
    /// machine knows its place by its end sensors.
    pub fn refused(&self, job: &str, zero: [Length; 2], homed: bool) -> Option<Diagnostic> {
        if !self.is_whole() {
            return Some(Diagnostic::error("level.damaged"));
        }
        if !same_job(&self.job, job) {
            return Some(Diagnostic::error("level.other_job"));
        }
        let apart = |axis: usize| (self.zero[axis] - zero[axis]).abs();
        if self.homed != homed || apart(0).max(apart(1)) > SAME_ZERO {
            let far = libm::hypot(apart(0).mm(), apart(1).mm());
            return Some(Diagnostic::error("level.other_zero").with("mm", format!("{far:.3}")));
        }
        None
    }

    /// How far beyond the outermost touched places a tool may cut.
    pub fn reach(&self) -> Length {
        self.grid.margin + BEYOND
    }

    /// Whether the surface is known well enough at `at`.
    pub fn knows(&self, at: Point) -> bool {
        let (low, high, reach) = (self.grid.low, self.grid.high, self.reach());
        (low.x - reach <= at.x && at.x <= high.x + reach) && (low.y - reach <= at.y && at.y <= high.y + reach)
    }

    /// Height of the surface at `at`: bilinear between the four touched places around it; beyond the outermost ones their cell goes on,
    /// as far as it is believed, and stays level from there.
    pub fn height(&self, at: Point) -> Length {
        let reach = self.reach();
        let (low, high) = (self.grid.low, self.grid.high);
        let x = at.x.max(low.x - reach).min(high.x + reach);
        let y = at.y.max(low.y - reach).min(high.y + reach);
        let patch = self.patch(Point::new(x, y));
        Length::from_mm(patch.height_mm(x.mm(), y.mm()))
    }

    /// The cell of the grid that counts at `at`.
    fn patch(&self, at: Point) -> Patch {
        let grid = &self.grid;
        let (column, row) = (grid.cell(0, at.x), grid.cell(1, at.y));
        let height = |column: usize, row: usize| {
            let index = row * usize::from(grid.columns) + column;
            self.heights.get(index).map_or(0.0, |height| height.mm())
        };
        let (h00, h10) = (height(column, row), height(column + 1, row));
        let (h01, h11) = (height(column, row + 1), height(column + 1, row + 1));
        let low = grid.place(column, row);
        let high = grid.place(column + 1, row + 1);
        let size_mm = [(high.x - low.x).mm(), (high.y - low.y).mm()];
        let slope_mm = [h10 - h00, h01 - h00];
        Patch {
            low_mm: [low.x.mm(), low.y.mm()],
            size_mm,
            base_mm: h00,
            slope_mm,
            twist_mm: h11 - h10 - h01 + h00,
        }
    }
}

/// The surface over one cell: `base + slope·u + slope·v + twist·u·v`, u and v from 0 to 1.
#[derive(Clone, Copy, Debug)]
struct Patch {
    low_mm: [f64; 2],
    size_mm: [f64; 2],
    base_mm: f64,
    slope_mm: [f64; 2],
    twist_mm: f64,
}

impl Patch {
    fn share(&self, x_mm: f64, y_mm: f64) -> [f64; 2] {
        [(x_mm - self.low_mm[0]) / self.size_mm[0], (y_mm - self.low_mm[1]) / self.size_mm[1]]
    }

    fn height_mm(&self, x_mm: f64, y_mm: f64) -> f64 {
        let [u, v] = self.share(x_mm, y_mm);
        self.base_mm + self.slope_mm[0] * u + self.slope_mm[1] * v + self.twist_mm * u * v
    }

    /// How steep it is at most where u and v are not above `most` in size, mm in a mm.
    fn steepest(&self, most: f64) -> f64 {
        let twist = libm::fabs(self.twist_mm) * most;
        let x = (libm::fabs(self.slope_mm[0]) + twist) / self.size_mm[0];
        let y = (libm::fabs(self.slope_mm[1]) + twist) / self.size_mm[1];
        libm::hypot(x, y)
    }

    /// How its slope along X changes on the way along Y, in a mm.
    fn twist_per_mm(&self) -> f64 {
        self.twist_mm / (self.size_mm[0] * self.size_mm[1])
    }
}

#[cfg(test)]
mod tests;
