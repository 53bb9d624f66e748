//! Checks that files written for a controller cut what their program cuts.
//!
//! ```text
//!   program ─ stretches ─┐  by tool    each point of one is on a stretch of the other, within the digits
//!   files ──── stretches ─┴──────────▶  written, and not deeper: then both cut equally, within this
//!
//!      program  ●━━━━━━━━━━━━●          the part of a stretch in the capsule ( ) of another is covered;
//!      file    (●━━━━━━●)                the rest is missing; the other way round it is an extra cut
//! ```
//!
//! Two equal tools at positions less than t apart sweep areas with edges less than t apart. So a proof of the
//! program holds for the files within t. The check follows the cuts and reports the first difference, without
//! computing areas. Long programs are checked band by band and tool by tool, so that about [`MOST_STRETCHES`]
//! are in memory at once.

use super::edges::{Edge, Edges, Spot, around};
use crate::diagnostic::Diagnostic;
use crate::geometry::{Point, chords};
use crate::job::{Bit, Command, Cutter, Leg, Mark, Program};
use crate::units::Length;
use crate::{code, error};
use std::collections::BTreeMap;

const CHORD_ERROR_MM: f64 = 0.000_5;
const PIECE_MM: f64 = 2.0;
/// An uncovered part between two covered parts is a gap if it is longer than this many tolerances.
const GAP_TOLERANCES: f64 = 4.0;
/// Stretches of one tool that are compared at once.
const MOST_STRETCHES: usize = 200_000;
/// Cuts less deep than this, in mm, are ignored: they don't go through the copper.
const SKIN_MM: f64 = 0.005;
/// Tolerance of a reported shift of the zero, in tolerances.
const SHIFT_TOLERANCES: f64 = 2.0;

/// Tolerances in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tolerance {
    place_mm: f64,
    depth_mm: f64,
}

/// Equal for tools that cut alike: type and size, for a V-bit tip and angle.
type Tool = (Cutter, Length);

struct Cuts {
    /// Straight, in XY; for a plunge both ends are equal.
    edges: Edges,
    /// The heights at both ends of each, in mm.
    heights: Vec<(f64, f64)>,
    orders: Vec<u32>,
    /// Stretches with their middle in this band, in mm, are compared; others are only candidates to cover
    /// them.
    band: Band,
}

/// A range of X, in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Band {
    low: f64,
    high: f64,
}

impl Band {
    const WHOLE: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };

    fn holds(self, x: f64) -> bool {
        x >= self.low && x < self.high
    }

    /// True if a range of X is in the band or within a stretch length of it.
    fn is_near(self, (from, to): (f64, f64)) -> bool {
        to >= self.low - PIECE_MM && from <= self.high + PIECE_MM
    }
}

/// Statistics of a tool: name, number of stretches, least and greatest X in mm.
#[derive(Clone, Debug)]
struct Surveyed {
    title: String,
    count: usize,
    low: f64,
    high: f64,
}

/// The parts of some cuts that no other cuts cover.
#[derive(Clone, Copy, Debug, Default)]
struct Uncovered {
    length_mm: f64,
    /// Plunges without a counterpart.
    plunges: u32,
    /// The first position, and the depth there, in mm.
    first: Option<(Spot, f64)>,
    /// Number of stretches before the first position.
    order: u32,
}

impl Uncovered {
    fn is_any(&self) -> bool {
        self.first.is_some()
    }

    fn note(&mut self, order: u32, at: (Spot, f64)) {
        if self.first.is_none() || order < self.order {
            (self.first, self.order) = (Some(at), order);
        }
    }

    /// Adds the result of another band.
    fn with(mut self, other: Self) -> Self {
        self.length_mm += other.length_mm;
        self.plunges += other.plunges;
        if let Some(first) = other.first {
            self.note(other.order, first);
        }
        self
    }
}

/// Differences of the `files`, run one after the other, from the program `meant`, within tolerances for
/// positions and heights in mm.
pub fn differences(meant: &Program, files: &[Program], (place_mm, depth_mm): (f64, f64)) -> Vec<Diagnostic> {
    let tolerance = Tolerance { place_mm, depth_mm };
    let meant = std::slice::from_ref(meant);
    let ((wanted, stands), (found, stands_too)) = (surveyed(meant), surveyed(files));
    let still = stands_too.filter(|_| stands.is_none());
    let mut diagnostics: Vec<Diagnostic> =
        still.map(|(at, depth)| placed(code!("written.still"), at, depth)).into_iter().collect();
    diagnostics.extend(tools(&wanted, &found));
    let (mut missing, mut extra) = (Vec::new(), Vec::new());
    for (tool, own) in &wanted {
        let Some(other) = found.get(tool) else { continue };
        let (mut less, mut more) = (Uncovered::default(), Uncovered::default());
        for band in bands(own, other) {
            let (meant, made) = (cuts(meant, *tool, band), cuts(files, *tool, band));
            less = less.with(meant.beyond(&made, tolerance));
            more = more.with(made.beyond(&meant, tolerance));
        }
        missing.extend(less.is_any().then_some((&own.title, less)));
        extra.extend(more.is_any().then_some((&other.title, more)));
    }
    if !missing.is_empty() && !extra.is_empty() && diagnostics.is_empty() {
        let is_small = wanted.values().chain(found.values()).all(|tool| tool.count <= MOST_STRETCHES);
        if let Some(by) = is_small.then(|| shifted((meant, files), &wanted, tolerance)).flatten() {
            let said = error!("written.shifted", ..);
            return vec![said.with("x", micro(by.x)).with("y", micro(by.y))];
        }
    }
    diagnostics
        .extend(missing.iter().map(|(title, uncovered)| told(code!("written.missing"), title, uncovered)));
    diagnostics.extend(extra.iter().map(|(title, uncovered)| told(code!("written.extra"), title, uncovered)));
    diagnostics
}

fn shifted(
    (meant, files): (&[Program], &[Program]),
    tools: &BTreeMap<Tool, Surveyed>,
    tolerance: Tolerance,
) -> Option<Spot> {
    let both = |tool: &Tool| (cuts(meant, *tool, Band::WHOLE), cuts(files, *tool, Band::WHOLE));
    let pairs: Vec<(Cuts, Cuts)> = tools.keys().map(both).collect();
    let by = pairs.first().and_then(|(meant, made)| shift((meant, made), tolerance))?;
    pairs.iter().all(|(meant, made)| is_shifted((meant, made), by, tolerance)).then_some(by)
}

fn bands(one: &Surveyed, other: &Surveyed) -> Vec<Band> {
    let count = one.count.max(other.count).div_ceil(MOST_STRETCHES).max(1);
    let (low, high) = (one.low.min(other.low), one.high.max(other.high));
    let at = |index: usize| match index {
        0 => f64::NEG_INFINITY,
        index if index == count => f64::INFINITY,
        index => low + (high - low) * index as f64 / count as f64,
    };
    (0..count).map(|index| Band { low: at(index), high: at(index + 1) }).collect()
}

/// Tools that only one of both uses.
fn tools(wanted: &BTreeMap<Tool, Surveyed>, found: &BTreeMap<Tool, Surveyed>) -> Vec<Diagnostic> {
    let only = |one: &BTreeMap<Tool, Surveyed>, other: &BTreeMap<Tool, Surveyed>, code: &str| {
        let alone = one.iter().filter(|(tool, _)| !other.contains_key(tool));
        let said = alone.map(|(_, tool)| Diagnostic::error(code).with("tool", &tool.title));
        said.collect::<Vec<_>>()
    };
    [only(wanted, found, code!("written.tool_missing")), only(found, wanted, code!("written.tool_extra"))]
        .concat()
}

fn told(code: &str, tool: &str, uncovered: &Uncovered) -> Diagnostic {
    let (at, depth) = uncovered.first.unwrap_or_default();
    let said = placed(code, at, depth).with("tool", tool);
    said.with("length", format!("{:.2}", uncovered.length_mm)).with("plunges", uncovered.plunges)
}

fn placed(code: &str, at: Spot, depth: f64) -> Diagnostic {
    let said = Diagnostic::error(code).with("x", format!("{:.2}", at.x));
    said.with("y", format!("{:.2}", at.y)).with("depth", format!("{depth:.3}"))
}

fn micro(mm: f64) -> String {
    format!("{mm:.3}")
}

/// The offset between both first cuts, if it exceeds the digits.
fn shift((meant, made): (&Cuts, &Cuts), tolerance: Tolerance) -> Option<Spot> {
    let by = made.edges.edge(0)?.from.minus(meant.edges.edge(0)?.from);
    (by.length() > tolerance.place_mm).then_some(by)
}

fn is_shifted((meant, made): (&Cuts, &Cuts), by: Spot, tolerance: Tolerance) -> bool {
    let moved = meant.moved(by);
    let tolerance = Tolerance { place_mm: SHIFT_TOLERANCES * tolerance.place_mm, ..tolerance };
    !moved.beyond(made, tolerance).is_any() && !made.beyond(&moved, tolerance).is_any()
}

impl Cuts {
    fn of(band: Band, stretches: Vec<(u32, Stretch)>) -> Self {
        let edge = |stretch: &Stretch| {
            let (from, to) = (stretch.from, stretch.to);
            Edge { from, to, island: 0, ring: 0 }
        };
        let edges = Edges::loose(stretches.iter().map(|(_, stretch)| edge(stretch)).collect());
        let (orders, heights) =
            stretches.into_iter().map(|(order, stretch)| (order, stretch.heights)).unzip();
        Self { edges, heights, orders, band }
    }

    fn moved(&self, by: Spot) -> Self {
        let at = |spot: Spot| Spot { x: spot.x + by.x, y: spot.y + by.y };
        let moved = |(order, own): (u32, Stretch)| {
            (order, Stretch { from: at(own.from), to: at(own.to), heights: own.heights })
        };
        Self::of(self.band, self.stretches().map(moved).collect())
    }

    fn stretches(&self) -> impl Iterator<Item = (u32, Stretch)> + '_ {
        let all = self.edges.iter().zip(&self.heights).zip(&self.orders);
        all.map(|(((_, edge), &heights), &order)| (order, Stretch { from: edge.from, to: edge.to, heights }))
    }

    fn beyond(&self, other: &Self, tolerance: Tolerance) -> Uncovered {
        let mut out = Uncovered::default();
        // Most files follow the order of their program, so try the next stretch of the other first.
        let mut next = 0_usize;
        let middle_x = |own: &Stretch| own.from.towards(own.to, 0.5).x;
        for (order, own) in self.stretches().filter(|(_, own)| self.band.holds(middle_x(own))) {
            let Some(own) = own.below() else { continue };
            let whole = |part: Option<(f64, f64)>| part.is_some_and(|(from, to)| from <= 0.0 && to >= 1.0);
            if whole(other.covers(next, &own, tolerance)) {
                next += 1;
                continue;
            }
            let mut parts = Vec::new();
            let (low, high) = around(own.from, own.to, tolerance.place_mm);
            other.edges.in_box(low, high, &mut |index, _| {
                let part = other.covers(index as usize, &own, tolerance);
                if whole(part) {
                    next = index as usize + 1;
                }
                parts.extend(part);
            });
            let length = own.from.distance(own.to);
            match uncovered(&mut parts, GAP_TOLERANCES * tolerance.place_mm / length.max(tolerance.place_mm))
            {
                None => {}
                Some((share, _)) if length == 0.0 => {
                    out.plunges += 1;
                    out.note(order, (own.at(share).0, -own.at(share).1));
                }
                Some((share, sum)) => {
                    out.length_mm += sum * length;
                    out.note(order, (own.at(share).0, -own.at(share).1));
                }
            }
        }
        out
    }

    /// The part of `stretch` along stretch `index` of the other, with at least equal depth, as shares of the
    /// length.
    fn covers(&self, index: usize, stretch: &Stretch, tolerance: Tolerance) -> Option<(f64, f64)> {
        let (edge, &(first, last)) = (self.edges.edge(index as u32)?, self.heights.get(index)?);
        let (from, to) = within(stretch, &edge, tolerance.place_mm)?;
        let deep = |share: f64| {
            let (at, height) = stretch.at(share);
            // A plunge has the depth of its end.
            let there = match edge.length() > 0.0 {
                true => first + (last - first) * edge.share_near(at),
                false => first.min(last),
            };
            there <= height + tolerance.depth_mm + stretch.slope() * tolerance.place_mm
        };
        [from, f64::midpoint(from, to), to].into_iter().all(deep).then_some((from, to))
    }
}

/// The first uncovered share, and the sum of all; gaps up to `slack` are ignored.
fn uncovered(parts: &mut [(f64, f64)], slack: f64) -> Option<(f64, f64)> {
    if parts.is_empty() {
        return Some((0.0, 1.0));
    }
    parts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut reached, mut sum, mut first) = (0.0_f64, 0.0, None);
    for &(from, to) in parts.iter().chain([&(1.0, 1.0)]) {
        if from - reached > slack {
            first = first.or(Some(reached));
            sum += from - reached;
        }
        reached = reached.max(to);
    }
    first.map(|first| (first, sum))
}

/// A straight piece of a cut, with the heights of the tip at its ends in mm.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    from: Spot,
    to: Spot,
    heights: (f64, f64),
}

impl Stretch {
    /// The part of it that cuts deeper than the skin.
    fn below(self) -> Option<Self> {
        let (first, last) = self.heights;
        if first.max(last) <= -SKIN_MM || self.from == self.to {
            return (first.min(last) < 0.0).then_some(self);
        }
        let share = (-SKIN_MM - first) / (last - first);
        let (at, _) = self.at(share.clamp(0.0, 1.0));
        match (first < -SKIN_MM, last < -SKIN_MM) {
            (true, _) => Some(Self { to: at, heights: (first, -SKIN_MM), ..self }),
            (_, true) => Some(Self { from: at, heights: (-SKIN_MM, last), ..self }),
            _ => None,
        }
    }

    /// Position and height at a share of it; for a plunge the lowest height.
    fn at(&self, share: f64) -> (Spot, f64) {
        let (first, last) = self.heights;
        let height = if self.from == self.to { first.min(last) } else { first + (last - first) * share };
        (self.from.towards(self.to, share), height)
    }

    fn slope(&self) -> f64 {
        let (first, last) = self.heights;
        let length = self.from.distance(self.to);
        if length > 0.0 { libm::fabs(last - first) / length } else { 0.0 }
    }
}

/// The part of `stretch` within `reach` of `edge`, as shares of its length: one part, because the capsule is
/// convex.
fn within(stretch: &Stretch, edge: &Edge, reach: f64) -> Option<(f64, f64)> {
    let way = stretch.to.minus(stretch.from);
    if way.dot(way) == 0.0 {
        return (edge.near(stretch.from).distance(stretch.from) <= reach).then_some((0.0, 1.0));
    }
    let disc = |centre: Spot| {
        let off = stretch.from.minus(centre);
        let (a, b, c) = (way.dot(way), off.dot(way), off.dot(off) - reach * reach);
        let root = b * b - a * c;
        (root >= 0.0).then(|| ((-b - libm::sqrt(root)) / a, (-b + libm::sqrt(root)) / a))
    };
    let band = || {
        let length = edge.length();
        let along = edge.to.minus(edge.from);
        let unit = Spot { x: along.x / length, y: along.y / length };
        let across = Spot { x: -unit.y, y: unit.x };
        let off = stretch.from.minus(edge.from);
        let mut part = (f64::MIN, f64::MAX);
        for (axis, low, high) in [(unit, 0.0, length), (across, -reach, reach)] {
            let (start, speed) = (off.dot(axis), way.dot(axis));
            if libm::fabs(speed) < 1e-12 {
                (start >= low && start <= high).then_some(())?;
            } else {
                let (a, b) = ((low - start) / speed, (high - start) / speed);
                part = (part.0.max(a.min(b)), part.1.min(a.max(b)));
            }
        }
        (part.0 <= part.1).then_some(part)
    };
    let strip = if edge.length() > 0.0 { band() } else { None };
    let parts = [disc(edge.from), disc(edge.to), strip];
    let hull = parts.into_iter().flatten().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
    let (from, to) = (hull.0.max(0.0), hull.1.min(1.0));
    (from <= to).then_some((from, to))
}

/// The cuts of consecutive programs with one tool near a band.
fn cuts(programs: &[Program], wanted: Tool, band: Band) -> Cuts {
    let (mut stretches, mut order) = (Vec::new(), 0_u32);
    walk(programs, &mut |bit, cut| {
        if tool(bit) == wanted {
            order = order.saturating_add(1);
            if band.is_near(cut.reach()) {
                let near = |stretch: &Stretch| {
                    let (from, to) = (stretch.from.x, stretch.to.x);
                    band.is_near((from.min(to), from.max(to)))
                };
                cut.stretches(&mut |stretch| stretches.extend(near(&stretch).then_some((order, stretch))));
            }
        }
    });
    Cuts::of(band, stretches)
}

/// The cuts of consecutive programs by tool; also the first position and depth of a cut with the spindle off.
fn surveyed(programs: &[Program]) -> (BTreeMap<Tool, Surveyed>, Option<(Spot, f64)>) {
    let mut by_tool: BTreeMap<Tool, Surveyed> = BTreeMap::new();
    let still = walk(programs, &mut |bit, cut| {
        let new = || Surveyed { title: bit.titled(), count: 0, low: f64::INFINITY, high: f64::NEG_INFINITY };
        let known = by_tool.entry(tool(bit)).or_insert_with(new);
        let (low, high) = cut.reach();
        known.count += cut.count();
        (known.low, known.high) = (known.low.min(low), known.high.max(high));
    });
    (by_tool, still)
}

/// Calls `each` with every cut of consecutive programs. Returns the first position and depth of a cut with
/// the spindle off.
fn walk(programs: &[Program], each: &mut dyn FnMut(&Bit, Cut)) -> Option<(Spot, f64)> {
    let mut still = None;
    for program in programs {
        let mut walk =
            Walk { program, at: program.origin, height: program.safe_height, turns: false, bit: 0 };
        for leg in &program.legs {
            walk.leg(leg, each, &mut still);
        }
    }
    still
}

#[derive(Clone, Copy)]
struct Cut {
    from: Point,
    to: Point,
    /// The centre of an arc, and whether it is clockwise.
    arc: Option<(Point, bool)>,
    /// Heights at both ends, in mm.
    heights: (f64, f64),
}

impl Cut {
    /// The range of X that it may reach, in mm.
    fn reach(&self) -> (f64, f64) {
        let (from, to) = (self.from.x.mm(), self.to.x.mm());
        match self.arc {
            None => (from.min(to), from.max(to)),
            Some((centre, _)) => {
                let radius = self.from.distance_mm(centre).max(self.to.distance_mm(centre));
                (centre.x.mm() - radius, centre.x.mm() + radius)
            }
        }
    }

    fn places(&self) -> Vec<Point> {
        match self.arc {
            Some((centre, clockwise)) => chords::arc(self.from, self.to, centre, clockwise, CHORD_ERROR_MM),
            None => vec![self.to],
        }
    }

    /// Number of stretches that it becomes, about.
    fn count(&self) -> usize {
        match self.arc {
            None => pieces(self.from.distance_mm(self.to)) as usize,
            Some(_) => {
                let (low, high) = self.reach();
                let flat =
                    (1.0 - 2.0 * CHORD_ERROR_MM / (high - low).max(2.0 * CHORD_ERROR_MM)).clamp(-1.0, 1.0);
                (std::f64::consts::TAU / (2.0 * libm::acos(flat)).max(1e-3)) as usize + 1
            }
        }
    }

    /// Calls `each` with its straight pieces, with linear height.
    fn stretches(&self, each: &mut dyn FnMut(Stretch)) {
        let (places, (first, last)) = (self.places(), self.heights);
        let (mut from, count) = (Spot::of(self.from), places.len() as f64);
        for (index, place) in places.iter().enumerate() {
            let to = Spot::of(*place);
            let height = |share: f64| first + (last - first) * (index as f64 + share) / count;
            let pieces = pieces(from.distance(to));
            for piece in 0..pieces as u32 {
                let (begin, end) = (f64::from(piece) / pieces, f64::from(piece + 1) / pieces);
                let heights = (height(begin), height(end));
                each(Stretch { from: from.towards(to, begin), to: from.towards(to, end), heights });
            }
            from = to;
        }
    }
}

fn pieces(length_mm: f64) -> f64 {
    libm::ceil(length_mm / PIECE_MM).clamp(1.0, 10_000.0)
}

struct Walk<'a> {
    program: &'a Program,
    at: Point,
    height: Length,
    turns: bool,
    bit: u32,
}

impl Walk<'_> {
    fn leg(&mut self, leg: &Leg, each: &mut dyn FnMut(&Bit, Cut), still: &mut Option<(Spot, f64)>) {
        if let Mark::ToolChange(bit) = leg.mark {
            self.bit = bit;
        }
        for command in &leg.commands {
            let (to, height) = match *command {
                Command::Rapid { to } => (self.placed(to), self.height),
                Command::Plunge { to, .. } | Command::Retract { to } => (self.at, to),
                Command::Mill { to, height, .. } | Command::MillArc { to, height, .. } => {
                    (self.placed(to), height)
                }
                Command::Spindle { rpm } => {
                    self.turns = rpm > 0;
                    continue;
                }
                Command::AwaitBit { bit } => {
                    self.bit = bit;
                    continue;
                }
                Command::Dwell { .. } => continue,
            };
            let (from, first) =
                (std::mem::replace(&mut self.at, to), std::mem::replace(&mut self.height, height));
            let lowest = first.min(height);
            if lowest >= Length::ZERO || matches!(command, Command::Retract { .. }) {
                continue;
            }
            if !self.turns && still.is_none() {
                *still = Some((Spot::of(from), -lowest.mm()));
            }
            let arc = match *command {
                Command::MillArc { center, ccw, .. } => Some((self.placed(center), !ccw)),
                _ => None,
            };
            if let Some(bit) = self.program.bits.get(self.bit as usize) {
                each(bit, Cut { from, to, arc, heights: (first.mm(), height.mm()) });
            }
        }
    }

    /// In the files' coordinates.
    fn placed(&self, work: Point) -> Point {
        Point::new(work.x + self.program.origin.x, work.y + self.program.origin.y)
    }
}

fn tool(bit: &Bit) -> Tool {
    match bit.cutter {
        Cutter::Vee { .. } => (bit.cutter, Length::ZERO),
        Cutter::Drill | Cutter::Mill => (bit.cutter, bit.diameter),
    }
}
