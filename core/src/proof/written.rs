//! Whether files written for a controller cut what the program cuts that they were written from (N8, C6, S6).
//!
//! ```text
//!   program ─ stretches ─┐  by tool    every place of one lies on a stretch of the other, within the digits written, and no
//!   files ──── stretches ─┴──────────▶  deeper: then both sweep the same copper, but for a rim as wide as these digits
//!
//!      program  ●━━━━━━━━━━━━●          the part of a stretch that lies in the capsule ( ) about another one is covered:
//!      file    (●━━━━━━●)                what is left over is missing; the other way round it is cut too much
//! ```
//!
//! Two tools of one form at places less than t apart sweep areas whose edges are less than t apart. So a proof of the program holds
//! for the files, give or take t, without sweeping both: it takes a walk along the cuts, and names the place where they part.
//!
//! Comes in: the program as its files are to have it, the files read back, tolerances in mm. Goes out: diagnostics. Does not know
//! boards or dialects, nor order and direction of cuts, nor feeds.

use super::edges::{Edge, Edges, Spot, around};
use crate::diagnostic::Diagnostic;
use crate::geometry::{Point, chords};
use crate::job::{Bit, Command, Cutter, Leg, Mark, Program};
use crate::units::Length;
use std::collections::BTreeMap;

/// Chords are at most this far from their arcs, in mm.
const CHORD_ERROR_MM: f64 = 0.000_5;
/// Stretches are looked at in pieces of this length, in mm.
const PIECE_MM: f64 = 2.0;
/// What is left over between two covered parts is a gap when it is longer than so many tolerances.
const GAP_TOLERANCES: f64 = 4.0;
/// What is less deep than this, in mm, is not looked for: it goes through no copper.
const SKIN_MM: f64 = 0.005;
/// A zero that is said to be elsewhere is there within so many tolerances.
const SHIFT_TOLERANCES: f64 = 2.0;

/// How near places and depths must be, in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tolerance {
    place_mm: f64,
    depth_mm: f64,
}

/// Tools that cut alike: by form and size, a V-bit by tip and angle.
type Tool = (Cutter, Length);

/// What a program cuts with one tool.
struct Cuts {
    /// How the tool is called.
    title: String,
    /// Straight, in the plane; of one that only goes down both ends are one place.
    edges: Edges,
    /// The heights at both ends of each, in mm.
    heights: Vec<(f64, f64)>,
}

/// What of some cuts no other cuts cover.
#[derive(Clone, Copy, Debug, Default)]
struct Uncovered {
    /// Length of all of it, in mm.
    length_mm: f64,
    /// Places where a tool goes down and none does.
    plunges: u32,
    /// The first place, and how deep the cut is there, in mm.
    first: Option<(Spot, f64)>,
}

impl Uncovered {
    fn is_any(&self) -> bool {
        self.first.is_some()
    }
}

/// What the `files`, one after the other, do otherwise than the program `meant`, where places may be off by `place_mm` and heights
/// by `depth_mm`. Nothing where they do the same.
pub fn differences(meant: &Program, files: &[Program], (place_mm, depth_mm): (f64, f64)) -> Vec<Diagnostic> {
    let tolerance = Tolerance { place_mm, depth_mm };
    let (wanted, stands) = walked(std::slice::from_ref(meant));
    let (found, stands_too) = walked(files);
    let still = stands_too.filter(|_| stands.is_none());
    let mut diagnostics: Vec<Diagnostic> =
        still.map(|(at, depth)| placed("written.still", at, depth)).into_iter().collect();
    diagnostics.extend(tools(&wanted, &found));
    let both = || wanted.iter().filter_map(|(tool, cuts)| Some((cuts, found.get(tool)?)));
    let missing: Vec<_> = both().map(|(meant, made)| (meant, meant.beyond(made, tolerance))).collect();
    let extra: Vec<_> = both().map(|(meant, made)| (made, made.beyond(meant, tolerance))).collect();
    let missing: Vec<_> = missing.into_iter().filter(|(_, uncovered)| uncovered.is_any()).collect();
    let extra: Vec<_> = extra.into_iter().filter(|(_, uncovered)| uncovered.is_any()).collect();
    if !missing.is_empty() && !extra.is_empty() && diagnostics.is_empty() {
        let shifted = both().next().and_then(|pair| shift(pair, tolerance));
        if let Some(by) = shifted.filter(|by| both().all(|pair| is_shifted(pair, *by, tolerance))) {
            let said = Diagnostic::error("written.shifted");
            return vec![said.with("x", micro(by.x)).with("y", micro(by.y))];
        }
    }
    diagnostics
        .extend(missing.iter().map(|(cuts, uncovered)| told("written.missing", &cuts.title, uncovered)));
    diagnostics.extend(extra.iter().map(|(cuts, uncovered)| told("written.extra", &cuts.title, uncovered)));
    diagnostics
}

/// Tools with which only one of both cuts.
fn tools(wanted: &BTreeMap<Tool, Cuts>, found: &BTreeMap<Tool, Cuts>) -> Vec<Diagnostic> {
    let only = |one: &BTreeMap<Tool, Cuts>, other: &BTreeMap<Tool, Cuts>, code: &str| {
        let alone = one.iter().filter(|(tool, _)| !other.contains_key(tool));
        let said = alone.map(|(_, cuts)| Diagnostic::error(code).with("tool", &cuts.title));
        said.collect::<Vec<_>>()
    };
    [only(wanted, found, "written.tool_missing"), only(found, wanted, "written.tool_extra")].concat()
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

/// The way from the first cut of one to the first of the other, where that is more than digits.
fn shift((meant, made): (&Cuts, &Cuts), tolerance: Tolerance) -> Option<Spot> {
    let by = made.edges.edges.first()?.from.minus(meant.edges.edges.first()?.from);
    (by.length() > tolerance.place_mm).then_some(by)
}

fn is_shifted((meant, made): (&Cuts, &Cuts), by: Spot, tolerance: Tolerance) -> bool {
    let moved = meant.moved(by);
    let tolerance = Tolerance { place_mm: SHIFT_TOLERANCES * tolerance.place_mm, ..tolerance };
    !moved.beyond(made, tolerance).is_any() && !made.beyond(&moved, tolerance).is_any()
}

impl Cuts {
    fn of(title: String, stretches: Vec<Stretch>) -> Self {
        let edge = |stretch: &Stretch| {
            let (from, to) = (stretch.from, stretch.to);
            Edge { from, to, island: 0, ring: 0, along_mm: 0.0 }
        };
        let edges = Edges::gridded(stretches.iter().map(edge).collect(), Vec::new());
        Self { title, edges, heights: stretches.into_iter().map(|stretch| stretch.heights).collect() }
    }

    fn moved(&self, by: Spot) -> Self {
        let at = |spot: Spot| Spot { x: spot.x + by.x, y: spot.y + by.y };
        let moved = |(edge, heights): (&Edge, &(f64, f64))| Stretch {
            from: at(edge.from),
            to: at(edge.to),
            heights: *heights,
        };
        Self::of(self.title.clone(), self.edges.edges.iter().zip(&self.heights).map(moved).collect())
    }

    /// What of it `other` does not cover.
    fn beyond(&self, other: &Self, tolerance: Tolerance) -> Uncovered {
        let mut out = Uncovered::default();
        // Most files are in the order of their program: the next stretch of the other is tried first.
        let mut next = 0_usize;
        for (edge, &heights) in self.edges.edges.iter().zip(&self.heights) {
            let Some(own) = (Stretch { from: edge.from, to: edge.to, heights }).below() else { continue };
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
                    out.first = out.first.or(Some((own.at(share).0, -own.at(share).1)));
                }
                Some((share, sum)) => {
                    out.length_mm += sum * length;
                    out.first = out.first.or(Some((own.at(share).0, -own.at(share).1)));
                }
            }
        }
        out
    }

    /// The part of `stretch` that lies by its stretch `index`, which is as deep there, as shares of the length.
    fn covers(&self, index: usize, stretch: &Stretch, tolerance: Tolerance) -> Option<(f64, f64)> {
        let (edge, &(first, last)) = (self.edges.edges.get(index)?, self.heights.get(index)?);
        let (from, to) = within(stretch, edge, tolerance.place_mm)?;
        let deep = |share: f64| {
            let (at, height) = stretch.at(share);
            // What only goes down is as deep as it ends.
            let there = match edge.length() > 0.0 {
                true => first + (last - first) * edge.share_near(at),
                false => first.min(last),
            };
            there <= height + tolerance.depth_mm + stretch.slope() * tolerance.place_mm
        };
        [from, f64::midpoint(from, to), to].into_iter().all(deep).then_some((from, to))
    }
}

/// The first share that no part covers, and how much all these are; gaps no longer than `slack` are none.
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

/// A straight piece of a cut: where from, where to, and the heights of the tip there in mm.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    from: Spot,
    to: Spot,
    heights: (f64, f64),
}

impl Stretch {
    /// The part of it that cuts anything: deeper than a skin of the board.
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

    /// Place and height at a share of it; of what only goes down the lowest.
    fn at(&self, share: f64) -> (Spot, f64) {
        let (first, last) = self.heights;
        let height = if self.from == self.to { first.min(last) } else { first + (last - first) * share };
        (self.from.towards(self.to, share), height)
    }

    /// How steep it is.
    fn slope(&self) -> f64 {
        let (first, last) = self.heights;
        let length = self.from.distance(self.to);
        if length > 0.0 { libm::fabs(last - first) / length } else { 0.0 }
    }
}

/// The part of `stretch` within `reach` of `edge`, as shares of its length: one part, for what lies about an edge is convex.
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

/// The cuts of programs run one after the other, by tool; and the first place where one cuts while the spindle stands, and how deep.
fn walked(programs: &[Program]) -> (BTreeMap<Tool, Cuts>, Option<(Spot, f64)>) {
    let mut by_tool: BTreeMap<Tool, (String, Vec<Stretch>)> = BTreeMap::new();
    let mut still = None;
    for program in programs {
        let mut walk =
            Walk { program, at: program.origin, height: program.safe_height, turns: false, bit: 0 };
        for leg in &program.legs {
            walk.leg(leg, &mut by_tool, &mut still);
        }
    }
    let cuts = by_tool.into_iter().map(|(tool, (title, stretches))| (tool, Cuts::of(title, stretches)));
    (cuts.collect(), still)
}

/// The tip on its way.
struct Walk<'a> {
    program: &'a Program,
    at: Point,
    height: Length,
    turns: bool,
    bit: u32,
}

/// Stretches by tool, with what the tool is called.
type ByTool = BTreeMap<Tool, (String, Vec<Stretch>)>;

impl Walk<'_> {
    fn leg(&mut self, leg: &Leg, out: &mut ByTool, still: &mut Option<(Spot, f64)>) {
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
            let places = match *command {
                Command::MillArc { center, ccw, .. } => {
                    chords::arc(from, to, self.placed(center), !ccw, CHORD_ERROR_MM)
                }
                _ => vec![to],
            };
            self.push(from, &places, (first.mm(), height.mm()), out);
        }
    }

    /// In the files' coordinates.
    fn placed(&self, work: Point) -> Point {
        Point::new(work.x + self.program.origin.x, work.y + self.program.origin.y)
    }

    /// Notes a way through `places`, whose height changes evenly from one to the next.
    fn push(&self, from: Point, places: &[Point], (first, last): (f64, f64), out: &mut ByTool) {
        let Some(bit) = self.program.bits.get(self.bit as usize) else { return };
        let (_, stretches) = out.entry(tool(bit)).or_insert_with(|| (bit.titled(), Vec::new()));
        let (mut from, count) = (Spot::of(from), places.len() as f64);
        for (index, place) in places.iter().enumerate() {
            let to = Spot::of(*place);
            let height = |share: f64| first + (last - first) * (index as f64 + share) / count;
            let pieces = libm::ceil(from.distance(to) / PIECE_MM).clamp(1.0, 10_000.0);
            for piece in 0..pieces as u32 {
                let (begin, end) = (f64::from(piece) / pieces, f64::from(piece + 1) / pieces);
                let heights = (height(begin), height(end));
                stretches.push(Stretch { from: from.towards(to, begin), to: from.towards(to, end), heights });
            }
            from = to;
        }
    }
}

/// What makes tools cut alike.
fn tool(bit: &Bit) -> Tool {
    match bit.cutter {
        Cutter::Vee { .. } => (bit.cutter, Length::ZERO),
        Cutter::Drill | Cutter::Mill => (bit.cutter, bit.diameter),
    }
}
