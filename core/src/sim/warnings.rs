//! Finds problems in a playback and their times.
//!
//! ```text
//!  safe height ┄┄┄┄┄┄┄┄┄╲┄┄┄┄┄┄┄┄┄┄┄┄┄┄        low: XY moves before the tip is up
//!                         ╲__________  ┌───┐
//!  surface     ────────────────────────┤   ├─   clamp: the tip is over or in a forbidden zone
//! ```

use super::playback::Playback;
use super::swept::{Swept, start_s, swept};
use crate::geometry::{Bounds, Point};
use crate::job::{Bit, Cutter, Mark, Stage};
use crate::machine::AXES;
use crate::motion::path::Curve;
use crate::motion::{AxisMove, Motion, Move};
use crate::units::Length;
use std::ops::Range;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fault {
    /// The tool would leave the travel of the machine.
    Outside,
    /// The tip is deeper than allowed.
    TooDeep,
    /// XY moves at rapid speed with the tip in the board.
    RapidInMaterial,
    /// XY moves at rapid speed with the tip above the board, but too low.
    Low,
    /// The bit is over or in a forbidden zone, for example a clamp.
    Clamp,
    /// Cutting without a tool, or milling with a drill.
    WrongTool,
}

/// Limits of the tool's motion, in work coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolRoom {
    /// Travel of the machine; none if unknown.
    pub travel: Option<Bounds>,
    /// Greatest depth of the tip below the surface.
    pub deepest: Length,
    pub pins: Range<u32>,
    /// Greatest depth in those holes.
    pub deepest_pin: Length,
    /// Least height of the tip over the surface while XY moves at rapid speed.
    pub lowest: Length,
    /// Forbidden zones.
    pub zones: Vec<Bounds>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Warning {
    pub at_s: f64,
    pub fault: Fault,
    pub leg: u32,
    /// Depth of the tip, mm; negative above the board.
    pub depth_mm: f64,
}

const MOST: usize = 500;

const ARC_PIECES: u32 = 24;

/// A straight path of the tip, and its start time.
struct Course {
    from_mm: [f64; 3],
    to_mm: [f64; 3],
    at_s: f64,
    rapid: bool,
}

/// Problems in `playback`, for a program with these `bits`.
pub fn warnings(playback: &Playback, bits: &[Bit], room: &ToolRoom) -> Vec<Warning> {
    let timeline = playback.timeline();
    let mut found: Vec<Warning> = Vec::new();
    // Motors rest up to half a step off the programmed position.
    let [x_mm, y_mm, z_mm, ..] = timeline.mm_per_step.map(f64::abs);
    // Spindles that the machine lacks stay at the surface.
    let spindles: Vec<usize> = (2..AXES).filter(|axis| timeline.start[*axis] != 0).collect();
    let travel = room.travel.map(|travel| travel.grown(Length::from_mm(x_mm.max(y_mm))));
    for planned in &timeline.moves {
        let bit = playback.bit_of_leg(planned.leg).and_then(|bit| bits.get(bit as usize));
        let end = |axis: usize| Length::from_mm(planned.to[axis] as f64 * timeline.mm_per_step[axis]);
        let beyond = travel.is_some_and(|travel| !travel.contains(Point::new(end(0), end(1))));
        let mut told = |fault, at_s, depth_mm| {
            // One warning of each kind per leg.
            let known = found.iter().rev().take_while(|one| one.leg == planned.leg);
            if found.len() < MOST && !known.into_iter().any(|one| one.fault == fault) {
                found.push(Warning { at_s, fault, leg: planned.leg, depth_mm });
            }
        };
        if beyond {
            told(Fault::Outside, start_s(planned), 0.0);
        }
        let is_pin = matches!(planned.mark, Mark::Hole(hole) if room.pins.contains(&hole));
        let deepest = if is_pin { room.deepest_pin } else { room.deepest };
        for one in swept(planned, &timeline.mm_per_step) {
            let depth_mm = -one.way.from_mm[2].min(one.way.to_mm[2]);
            for fault in faults(&one, bit, planned.mark, depth_mm > deepest.mm()) {
                told(fault, one.from_s, depth_mm);
            }
        }
        let radius = bit.map_or(Length::ZERO, |bit| Length::from_nm(bit.diameter.nm() / 2));
        for course in courses(planned, &timeline.mm_per_step, &spindles, !room.zones.is_empty()) {
            let low_mm = course.from_mm[2].min(course.to_mm[2]);
            // Between holes, XY and Z move together; the tip is down only once XY has settled.
            let low = planned.stage != Stage::NextHole && (0.0..room.lowest.mm() - z_mm).contains(&low_mm);
            if course.rapid && low {
                told(Fault::Low, course.at_s, -low_mm);
            }
            if room.zones.iter().any(|zone| enters(&course, zone.grown(radius))) {
                told(Fault::Clamp, course.at_s, -low_mm);
            }
        }
    }
    found.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    found
}

fn faults(one: &Swept, bit: Option<&Bit>, mark: Mark, deep: bool) -> impl Iterator<Item = Fault> {
    let drill = bit.is_some_and(|bit| bit.cutter == Cutter::Drill);
    let sideways = one.way.from_mm[..2] != one.way.to_mm[..2] || one.way.shape != super::cuts::CutShape::Line;
    let wrong = bit.is_none() || (drill && sideways && !one.rapid && matches!(mark, Mark::Toolpath(_)));
    let rows = [(deep, Fault::TooDeep), (one.rapid, Fault::RapidInMaterial), (wrong, Fault::WrongTool)];
    rows.into_iter().filter(|row| row.0).map(|row| row.1)
}

/// All paths of the tip in a move, above the board and in it.
fn courses(planned: &Move, mm_per_step: &[f64; AXES], spindles: &[usize], on_paths: bool) -> Vec<Course> {
    let begin_s = start_s(planned);
    let tip = |t_s: f64| {
        let steps = planned.at(t_s);
        let mm = |axis: usize| steps[axis] * mm_per_step[axis];
        [mm(0), mm(1), spindles.iter().map(|axis| mm(*axis)).fold(f64::INFINITY, f64::min)]
    };
    let straight = |part: &AxisMove| {
        let [from_mm, to_mm] = [part.start_s(), part.end_s()].map(tip);
        let (over, down) = (part.moves(0) || part.moves(1), to_mm[2] < from_mm[2]);
        // While XY moves next to it, a plunge is over its hole for as long as it is in the board.
        let (from_mm, to_mm) = match (over, down) {
            (true, _) => (from_mm, to_mm),
            (false, true) => ([to_mm[0], to_mm[1], from_mm[2]], to_mm),
            (false, false) => (from_mm, [from_mm[0], from_mm[1], to_mm[2]]),
        };
        let rapid = over && part.stage != Stage::Mill;
        Course { from_mm, to_mm, at_s: begin_s + part.start_s(), rapid }
    };
    let mut found = Vec::new();
    for part in &planned.parts {
        let Motion::Path(route) = &part.motion else {
            found.push(straight(part));
            continue;
        };
        // Paths are only checked against zones.
        if !on_paths {
            continue;
        }
        for (index, piece) in route.path.pieces.iter().enumerate() {
            let at_s = begin_s + part.start_s() + route.path.start_of_piece_s(index);
            let pieces = if matches!(piece.curve, Curve::Line { .. }) { 1 } else { ARC_PIECES };
            let at = |end: u32| piece.curve.at(piece.curve.length_mm() * f64::from(end) / f64::from(pieces));
            let chord = |one: u32| Course { from_mm: at(one), to_mm: at(one + 1), at_s, rapid: false };
            found.extend((0..pieces).map(chord));
        }
    }
    found
}

fn enters(course: &Course, zone: Bounds) -> bool {
    let (low, high) = ([zone.min.x.mm(), zone.min.y.mm()], [zone.max.x.mm(), zone.max.y.mm()]);
    let (mut first, mut last) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        let (from, way) = (course.from_mm[axis], course.to_mm[axis] - course.from_mm[axis]);
        if way == 0.0 {
            if from < low[axis] || from > high[axis] {
                return false;
            }
            continue;
        }
        let shares = [(low[axis] - from) / way, (high[axis] - from) / way];
        first = first.max(shares[0].min(shares[1]));
        last = last.min(shares[0].max(shares[1]));
    }
    first <= last
}
