//! Cuts into copper that must stay, and cuts that do not go through the copper.
//!
//! ```text
//!           ┄┄┄┄ path of the tool centre ┄┄┄┄
//!      ════════════════╗   ↕ half the width
//!      ████ island ████║▒▒ ← bite: half the width minus the distance from the path to the edge;
//!      ████████████████║     the whole width where the path is inside
//! ```
//!
//! Copper in a hole or slot of the board is to be removed and is not reported.

use super::cures;
use super::edges::{Edge, Edges, Spot, around, between, spots};
use super::finding::{Finding, FindingKind};
use super::replay::PathCut;
use super::scene::{Scene, about};
use crate::geometry::{CombineRule, Island, Path, Region, area_mm2, circle, combine, stroke, union};
use crate::job::Mark;
use crate::units::Length;
use std::collections::{BTreeMap, BTreeSet};

const SAME_BITE_MM: f64 = 0.5;
const MIDDLE_MM: f64 = 0.01;
const STEP_MM: f64 = 0.1;
/// A shallow path is reported if it leaves at least this length uncut, in mm.
const SHALLOW_MM: f64 = 0.2;
/// Toolpaths beyond the edge of a hole or slot by this, in mm, still belong to it.
const OPENING_MM: f64 = 0.01;

/// A bite in progress: its deepest point, and its last position along the path.
struct Bite {
    depth: f64,
    spot: Spot,
    last: f64,
}

/// Every place where a cut removes copper that must stay.
pub(super) fn lost(scene: &Scene<'_>) -> Vec<Finding> {
    let mut findings = Vec::new();
    // Pieces of a ramp are separate cuts: a bite may span several cuts of one leg.
    let mut open: BTreeMap<u32, Bite> = BTreeMap::new();
    let (mut leg, mut along) = ((u32::MAX, u32::MAX), 0.0);
    let mut previous: Option<&PathCut> = None;
    let mut clear = Clear::default();
    let meant = |cut: &&PathCut| cut.through.is_some() && !matches!(cut.mark, Mark::Hole(_));
    for cut in scene.cuts.iter().filter(meant) {
        if leg != (cut.program, cut.leg) {
            close(scene, previous, &mut open, &mut findings);
            leg = (cut.program, cut.leg);
        }
        previous = Some(cut);
        let spots = spots(&cut.path);
        let dot = spots.first().map(|&spot| (spot, spot)).filter(|_| spots.len() == 1);
        let pairs = spots.iter().copied().zip(spots.iter().skip(1).copied()).chain(dot);
        for (from, to) in pairs {
            let edge = Edge { from, to, island: 0, ring: 0 };
            let before = along;
            along += edge.length();
            for (island, depth, spot) in bites(scene, &edge, cut.surface.mm(), &mut clear) {
                feel(scene, cut, (island, depth, spot), (before, along), &mut open, &mut findings);
            }
        }
    }
    close(scene, previous, &mut open, &mut findings);
    agree(scene, &mut findings);
    findings
}

/// Marks losses of a centred pass through an agreed gap, if they are no larger than its excess width.
fn agree(scene: &Scene<'_>, findings: &mut [Finding]) {
    if scene.options.agreed.is_empty() || findings.is_empty() {
        return;
    }
    // Toolpaths of all cuts that go through; `island` is the index of the leg.
    let (mut legs, mut toolpaths): (Vec<(u32, u32)>, Vec<Edge>) = (Vec::new(), Vec::new());
    for cut in scene.cuts.iter().filter(|cut| cut.through.is_some()) {
        let spots = spots(&cut.path);
        let pairs = spots.iter().zip(spots.iter().skip(1));
        let island = legs.len() as u32;
        toolpaths.extend(pairs.map(|(&from, &to)| Edge { from, to, island, ring: 0 }));
        legs.push((cut.program, cut.leg));
    }
    let toolpaths = Edges::loose(toolpaths);
    let mut by_leg: BTreeMap<(u32, u32), Vec<usize>> = BTreeMap::new();
    for (index, finding) in findings.iter().enumerate() {
        if let Some(leg) = finding.leg {
            by_leg.entry(leg).or_default().push(index);
        }
    }
    for (from, to) in &scene.options.agreed {
        let middle = Spot::of(*from).towards(Spot::of(*to), 0.5);
        let (low, high) = around(middle, middle, MIDDLE_MM);
        let mut here: BTreeSet<(u32, u32)> = BTreeSet::new();
        toolpaths.in_box(low, high, &mut |_, edge| {
            if edge.near(middle).distance(middle) <= MIDDLE_MM {
                here.extend(legs.get(edge.island as usize));
            }
        });
        let gap = from.distance_mm(*to);
        for index in here.iter().filter_map(|leg| by_leg.get(leg)).flatten() {
            let Some(finding) = findings.get_mut(*index) else { continue };
            let tool = finding.tool.map_or(0.0, Length::mm);
            let costs = ((tool - gap) / 2.0).max(0.0) + scene.options.tolerance.mm();
            finding.agreed |= finding.width.mm() <= costs;
        }
    }
}

fn feel(
    scene: &Scene<'_>,
    cut: &PathCut,
    (island, depth, spot): (u32, f64, Spot),
    stretch: (f64, f64),
    open: &mut BTreeMap<u32, Bite>,
    findings: &mut Vec<Finding>,
) {
    let fresh = Bite { depth, spot, last: stretch.1 };
    match open.get_mut(&island) {
        Some(bite) if stretch.0 - bite.last <= SAME_BITE_MM => {
            if depth > bite.depth {
                (bite.depth, bite.spot) = (depth, spot);
            }
            bite.last = stretch.1;
        }
        _ => {
            if let Some(old) = open.insert(island, fresh) {
                findings.push(bitten(scene, cut, island, &old));
            }
        }
    }
}

fn close(
    scene: &Scene<'_>,
    cut: Option<&PathCut>,
    open: &mut BTreeMap<u32, Bite>,
    findings: &mut Vec<Finding>,
) {
    let old = std::mem::take(open);
    let Some(cut) = cut else { return };
    findings.extend(old.iter().map(|(&island, bite)| bitten(scene, cut, island, bite)));
}

fn bitten(scene: &Scene<'_>, cut: &PathCut, island: u32, bite: &Bite) -> Finding {
    let net = scene.label(scene.net(island));
    let mut finding =
        Finding::new(FindingKind::Lost, bite.spot.point(), Length::from_mm(bite.depth), vec![net]);
    finding.tool = Some(cut.surface);
    finding.leg = Some((cut.program, cut.leg));
    finding
}

/// The end of the last stretch, if it touched nothing and was in no island.
type Clear = Option<Spot>;

/// Islands that a straight stretch of this width bites into, with depth and position.
fn bites(scene: &Scene<'_>, stretch: &Edge, width: f64, clear: &mut Clear) -> Vec<(u32, f64, Spot)> {
    let half = width / 2.0;
    let tolerance = scene.options.tolerance.mm();
    let (low, high) = around(stretch.from, stretch.to, half);
    let mut touched = false;
    scene.design.in_box(low, high, &mut |_, edge| {
        touched = touched || half - between(stretch, edge).0 > tolerance;
    });
    // Away from all edges a stretch is entirely inside or outside, and so is the next one.
    let goes_on = clear.take() == Some(stretch.from) && tolerance < half;
    let middle = stretch.from.towards(stretch.to, 0.5);
    if !touched && (goes_on || scene.design.island_at(middle).is_none()) {
        *clear = Some(stretch.to);
        return Vec::new();
    }
    let mut nearest: BTreeMap<u32, (f64, Spot)> = BTreeMap::new();
    scene.design.in_box(low, high, &mut |_, edge| {
        let (distance, _, at) = between(stretch, edge);
        if half - distance > tolerance {
            let known = nearest.entry(edge.island).or_insert((distance, at));
            if distance < known.0 {
                *known = (distance, at);
            }
        }
    });
    let mut bites: BTreeMap<u32, (f64, Spot)> =
        nearest.into_iter().map(|(island, (distance, at))| (island, (half - distance, at))).collect();
    // If the path itself is inside, the whole width is lost.
    for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let spot = stretch.from.towards(stretch.to, share);
        if let Some(island) = scene.design.island_at(spot) {
            let edge = scene.design.nearest(spot, half, &|edge| edge.island == island);
            let depth = half + edge.map_or(half, |(distance, _, _)| distance);
            let known = bites.entry(island).or_insert((depth, spot));
            if depth > known.0 {
                *known = (depth, spot);
            }
        }
    }
    let told = bites.into_iter().filter(|(_, (_, spot))| !meant_to_go(scene, *spot));
    told.map(|(island, (depth, spot))| (island, depth, spot)).collect()
}

/// True if a point is in a hole or slot of the board.
fn meant_to_go(scene: &Scene<'_>, spot: Spot) -> bool {
    let hole = scene.board.holes.iter().any(|hole| {
        let radius = hole.diameter.map_or(0.0, Length::mm) / 2.0;
        Spot::of(hole.at).distance(spot) <= radius + OPENING_MM
    });
    let slot = || {
        scene.board.slots.iter().any(|slot| {
            let radius = slot.width.map_or(0.0, Length::mm) / 2.0;
            let pairs = slot.path.iter().zip(slot.path.iter().skip(1));
            pairs.into_iter().any(|(&from, &to)| {
                let edge = Edge { from: Spot::of(from), to: Spot::of(to), island: 0, ring: 0 };
                edge.near(spot).distance(spot) <= radius + OPENING_MM
            })
        })
    };
    hole || slot()
}

/// Copper of nets that is lost, in mm², without the board's holes and slots.
pub(super) fn lost_mm2(scene: &Scene<'_>) -> f64 {
    // An island that is as it was has lost nothing.
    let kept: BTreeSet<&Island> = scene.kept_region.islands.iter().collect();
    let changed = scene.copper.islands.iter().filter(|island| !kept.contains(island)).cloned();
    let changed = Region { islands: changed.collect() };
    let gone = combine(&changed, &about(&scene.left, &changed), CombineRule::Difference);
    let margin = Length::from_mm(2.0 * OPENING_MM);
    let sized = scene.board.holes.iter().filter_map(|hole| Some((hole.at, hole.diameter?)));
    let mut openings: Vec<Path> = sized.map(|(at, diameter)| circle(at, diameter + margin)).collect();
    for slot in &scene.board.slots {
        let path = Path::through(&slot.path);
        openings
            .extend(path.zip(slot.width).into_iter().flat_map(|(path, width)| stroke(&path, width + margin)));
    }
    area_mm2(&combine(&gone, &union(&openings), CombineRule::Difference))
}

/// Legs with a path below the surface that is not through the copper, unless another cut is through there.
pub(super) fn shallow(scene: &Scene<'_>) -> Vec<Finding> {
    /// Uncut part of a leg: length, least depth, a position, the cut.
    type Uncut<'c> = (f64, Length, Spot, &'c PathCut);
    let mut legs: BTreeMap<(u32, u32), Uncut<'_>> = BTreeMap::new();
    for cut in scene.cuts.iter().filter(|cut| cut.through.is_none()) {
        let spots = spots(&cut.path);
        for (from, to) in spots.iter().zip(spots.iter().skip(1)) {
            let count = libm::ceil(from.distance(*to) / STEP_MM).clamp(1.0, 10_000.0);
            let step = from.distance(*to) / count;
            for index in 0..count as usize {
                let spot = from.towards(*to, (index as f64 + 0.5) / count);
                if scene.left_edges.island_at(spot).is_some() {
                    let uncut = legs.entry((cut.program, cut.leg)).or_insert((0.0, cut.depth, spot, cut));
                    uncut.0 += step;
                    uncut.1 = uncut.1.min(cut.depth);
                }
            }
        }
    }
    let told = legs.into_iter().filter(|(_, (length, ..))| *length >= SHALLOW_MM);
    told.map(|(leg, (_, depth, spot, cut))| {
        let near = scene.design.nearest(spot, cut.surface.mm(), &|_| true);
        let net = near.map(|(_, _, edge)| scene.label(scene.net(edge.island)));
        let mut finding = Finding::new(FindingKind::Shallow, spot.point(), depth, net.into_iter().collect());
        finding.tool = Some(cut.surface);
        finding.leg = Some(leg);
        finding.cures = scene.bit(cut).map(|bit| cures::for_shallow(scene, bit)).into_iter().collect();
        finding
    })
    .collect()
}
