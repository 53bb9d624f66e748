//! Height maps: the measured surface of the board, and programs with a depth that follows it.
//!
//! ```text
//!  Bounds ─ grid ─▶ ProbeGrid ─ survey ─▶ points to probe ◀─ heights ─ driver of the machine
//!                                   │
//!                                HeightMap ─ follow ─▶ moves split so that depth follows the surface
//! ```
//!
//! Lengths in whole nanometres, work coordinates.
//!
//! A map is applied to the planned program just before it runs. The result, [`Levelled`], is never saved or
//! planned from, so no program is levelled twice.

mod along;
mod follow;
mod grid;
mod survey;

use crate::error;
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

/// Hexadecimal digits of the first part of a job key (name and zero). The second part, for the cut positions,
/// follows.
const JOB_DIGITS: usize = 64;
/// Greatest shift of the work zero since the measurement: less than the rounding of any report.
const SAME_ZERO: Length = Length::from_um(10);
/// Distance beyond the outermost points and their margin that a tool may reach.
const BEYOND: Length = Length::from_um(5_000);
/// Greatest plausible distance of the surface from the work zero. Beyond it, the measurement is wrong or
/// found no board.
const FURTHEST: Length = Length::from_um(5_000);

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HeightMap {
    pub grid: ProbeGrid,
    /// Height of each point over the work zero, row by row from the lowest corner.
    pub heights: Vec<Length>,
    /// Key of its job: made by [`job_key`], compared by [`same_job`].
    pub job: String,
    /// Work zero in machine coordinates, X and Y.
    pub zero: [Length; 2],
    /// True if the machine was homed: then the zero is valid after a power cycle, too.
    pub homed: bool,
    /// Time of the measurement, seconds since 1970.
    pub measured_s: u64,
}

/// Key of the job that a map belongs to: its name, the position of its zero in its files, and where it cuts.
/// Depths, feeds and the order may change; the board may not. With `holes`, only they count, because
/// toolpaths change with every tool. Without holes, the positions of `toolpaths` count.
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

/// True if two keys may belong to one board. A job with holes and a job without can be parts of one board.
pub fn same_job(one: &str, other: &str) -> bool {
    let ((one, places), (other, others)) = (parts_of(one), parts_of(other));
    let kind = |places: &str| places.chars().next();
    one == other && (kind(places) != kind(others) || places == others)
}

fn parts_of(key: &str) -> (&str, &str) {
    key.split_at_checked(JOB_DIGITS).unwrap_or((key, ""))
}

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
    /// True if the map is valid: one plausible height for every point.
    pub fn is_whole(&self) -> bool {
        self.grid.is_sound()
            && self.heights.len() == self.grid.count()
            && self.heights.iter().all(|height| (-FURTHEST..=FURTHEST).contains(height))
            && self.zero.iter().all(|zero| (-Length::LIMIT..=Length::LIMIT).contains(zero))
    }

    /// SHA-256 of the map, hexadecimal.
    pub fn key(&self) -> String {
        hexadecimal(&postcard::to_allocvec(self).unwrap_or_default())
    }

    pub fn span(&self) -> [Length; 2] {
        let heights = || self.heights.iter().copied();
        [heights().min().unwrap_or_default(), heights().max().unwrap_or_default()]
    }

    /// Why the map can't be used for the job with key `job` and the work zero `zero` (machine coordinates).
    /// `homed`: the machine is homed.
    pub fn refused(&self, job: &str, zero: [Length; 2], homed: bool) -> Option<Diagnostic> {
        if !self.is_whole() {
            return Some(error!("level.damaged"));
        }
        if !same_job(&self.job, job) {
            return Some(error!("level.other_job"));
        }
        let apart = |axis: usize| (self.zero[axis] - zero[axis]).abs();
        if self.homed != homed || apart(0).max(apart(1)) > SAME_ZERO {
            let far = libm::hypot(apart(0).mm(), apart(1).mm());
            return Some(error!("level.other_zero", mm = format!("{far:.3}")));
        }
        None
    }

    /// Distance beyond the outermost points up to which a tool may cut.
    pub fn reach(&self) -> Length {
        self.grid.margin + BEYOND
    }

    pub fn knows(&self, at: Point) -> bool {
        let (low, high, reach) = (self.grid.low, self.grid.high, self.reach());
        (low.x - reach <= at.x && at.x <= high.x + reach) && (low.y - reach <= at.y && at.y <= high.y + reach)
    }

    /// Surface height at `at`, bilinear between the four points around it. Outside the grid, the outermost
    /// cell is extrapolated up to [`Self::reach`], and constant beyond.
    pub fn height(&self, at: Point) -> Length {
        let reach = self.reach();
        let (low, high) = (self.grid.low, self.grid.high);
        let x = at.x.max(low.x - reach).min(high.x + reach);
        let y = at.y.max(low.y - reach).min(high.y + reach);
        let patch = self.patch(Point::new(x, y));
        Length::from_mm(patch.height_mm(x.mm(), y.mm()))
    }

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

    /// Upper bound of the slope for |u| and |v| up to `most`, mm per mm.
    fn steepest(&self, most: f64) -> f64 {
        let twist = libm::fabs(self.twist_mm) * most;
        let x = (libm::fabs(self.slope_mm[0]) + twist) / self.size_mm[0];
        let y = (libm::fabs(self.slope_mm[1]) + twist) / self.size_mm[1];
        libm::hypot(x, y)
    }

    /// Change of the X slope along Y, per mm.
    fn twist_per_mm(&self) -> f64 {
        self.twist_mm / (self.size_mm[0] * self.size_mm[1])
    }
}

#[cfg(test)]
mod tests;
