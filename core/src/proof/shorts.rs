//! Pieces of copper that hold two or more nets: where the gaps between these are narrowest.
//!
//! ```text
//!    ███ A ███┐                what is left between the nets (░) touches A and B: from every place where it touches
//!      ░░░░░░░│░░              one net, the nearest place of another net that can be seen through copper
//!    ███ B ███████
//! ```
//!
//! Comes in: the scene. Goes out: findings with place, gap, nets, tool and cures. Does not know why the gap is not cut.

use super::cures;
use super::edges::{Edge, Spot, around, between, spots};
use super::finding::{Finding, Kind};
use super::scene::Scene;
use crate::geometry::{Island, Region, Rule, combine};
use crate::units::Length;
use std::collections::{BTreeMap, BTreeSet};

/// Copper between nets touches a net where it is this near, in mm: chords and whole nanometres.
const TOUCH_MM: f64 = 0.004;
/// Places along an edge are this far apart, in mm.
const STEP_MM: f64 = 0.05;
/// At most so many places along the edges of one piece.
const MOST_PLACES: f64 = 20_000.0;
/// Gaps that differ by less than this, in mm, are as narrow: the middle one of these is told.
const EQUAL_MM: f64 = 0.001;
/// A first look for another net goes this far, in mm.
const REACH_MM: f64 = 3.0;

/// Where two nets are nearest to each other.
#[derive(Clone, Copy, Debug)]
struct Gap {
    width: f64,
    from: Spot,
    to: Spot,
}

/// By nets; the narrowest, and those as narrow.
type Gaps = BTreeMap<(u32, u32), Vec<Gap>>;

/// Every pair of nets that one piece of copper holds, where nothing separates them.
pub(super) fn shorts(scene: &Scene<'_>) -> Vec<Finding> {
    let shorted = |piece: u32| scene.nets_in(piece).is_some_and(|nets| nets.len() > 1);
    let pieces = (0..).zip(&scene.left.islands).filter(|(piece, _)| shorted(*piece));
    let bad = Region { islands: pieces.map(|(_, island)| island.clone()).collect() };
    if bad.is_empty() {
        return Vec::new();
    }
    let between_nets = combine(&bad, &scene.copper, Rule::Difference);
    let mut findings = Vec::new();
    let mut told: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for island in &between_nets.islands {
        let touched = touched(scene, island);
        let Some(piece) = touched.piece else { continue };
        let gaps = gaps(scene, &touched, piece);
        let joined = groups(&touched.nets, &narrow(scene, &gaps));
        for ((one, other), mut equal) in gaps {
            told.entry(piece).or_default().extend([one, other]);
            equal.sort_by_key(|gap| micrometres(gap.from.towards(gap.to, 0.5)));
            let Some(&gap) = equal.get(equal.len() / 2) else { continue };
            let finding = finding(scene, one, other, gap);
            // Nets that narrow gaps join are not told again where they are far apart.
            if finding.kind == Kind::Gap || joined.get(&one) != joined.get(&other) {
                findings.push(finding);
            }
        }
    }
    findings.extend(untold(scene, &told));
    findings
}

/// In whole micrometres, so that what rounding leaves does not decide an order.
fn micrometres(spot: Spot) -> (i64, i64) {
    (libm::round(spot.x * 1e3) as i64, libm::round(spot.y * 1e3) as i64)
}

/// The places where copper between nets touches these.
struct Touched {
    /// The piece of the copper left.
    piece: Option<u32>,
    nets: BTreeSet<u32>,
    places: Vec<(Spot, u32)>,
}

fn touched(scene: &Scene<'_>, island: &Island) -> Touched {
    let rings: Vec<Vec<Spot>> = island.paths().map(spots).collect();
    let pairs = || rings.iter().flat_map(|ring| ring.iter().zip(ring.iter().skip(1)));
    let length: f64 = pairs().map(|(a, b)| a.distance(*b)).sum();
    let step = STEP_MM.max(length / MOST_PLACES);
    let mut found = Touched { piece: None, nets: BTreeSet::new(), places: Vec::new() };
    for (&a, &b) in pairs() {
        let count = libm::ceil(a.distance(b) / step).max(1.0) as usize;
        for index in 0..count {
            let spot = a.towards(b, (index as f64 + 0.5) / count as f64);
            if let Some((_, _, edge)) = scene.design.nearest(spot, TOUCH_MM, &|_| true) {
                let net = scene.net(edge.island);
                found.nets.insert(net);
                found.places.push((spot, net));
            }
        }
    }
    if found.nets.len() > 1 {
        found.piece = super::scene::inner_spot(island).and_then(|spot| scene.left_edges.island_at(spot));
    }
    found
}

/// The narrowest gap of every pair of neighbours; then of every group of nets that no gap joins with the others yet.
fn gaps(scene: &Scene<'_>, touched: &Touched, piece: u32) -> Gaps {
    let mut gaps = Gaps::new();
    look(scene, touched, REACH_MM, Some(piece), &|one, other| one != other, &mut gaps);
    // Each round at least halves the number of groups.
    for sight in [Some(piece), None, None, None, None, None, None, None, None, None] {
        let group = groups(&touched.nets, &gaps);
        let apart = |one: u32, other: u32| group.get(&one) != group.get(&other);
        if group.values().collect::<BTreeSet<_>>().len() < 2 {
            break;
        }
        look(scene, touched, f64::MAX, sight, &apart, &mut gaps);
    }
    gaps
}

/// The gaps that no bit of the program fits into.
fn narrow(scene: &Scene<'_>, gaps: &Gaps) -> Gaps {
    let tool = scene.narrowest().map_or(0.0, Length::mm);
    let fits_not = |gap: &Gap| gap.width < tool;
    let narrow = gaps.iter().filter(|(_, equal)| equal.first().is_some_and(fits_not));
    narrow.map(|(pair, equal)| (*pair, equal.clone())).collect()
}

/// Which nets are joined by gaps: every net with the least net that it is joined with.
fn groups(nets: &BTreeSet<u32>, gaps: &Gaps) -> BTreeMap<u32, u32> {
    let mut group: BTreeMap<u32, u32> = nets.iter().map(|&net| (net, net)).collect();
    for (one, other) in gaps.keys() {
        let (Some(&a), Some(&b)) = (group.get(one), group.get(other)) else { continue };
        let (least, most) = (a.min(b), a.max(b));
        group.values_mut().filter(|net| **net == most).for_each(|net| *net = least);
    }
    group
}

/// Looks from every place for the nearest other net; `sight` is the piece of copper through which it must be seen.
fn look(
    scene: &Scene<'_>,
    touched: &Touched,
    reach: f64,
    sight: Option<u32>,
    other: &impl Fn(u32, u32) -> bool,
    gaps: &mut Gaps,
) {
    let extent = scene.design.extent();
    for &(spot, net) in &touched.places {
        let wanted = |edge: &Edge| {
            let theirs = scene.net(edge.island);
            touched.nets.contains(&theirs) && other(net, theirs) && seen(scene, spot, edge, sight)
        };
        let Some((width, at, edge)) = scene.design.nearest(spot, reach.min(extent), &wanted) else {
            continue;
        };
        let theirs = scene.net(edge.island);
        // From the net with the lesser number to the other.
        let (from, to) = if net < theirs { (spot, at) } else { (at, spot) };
        let gap = Gap { width, from, to };
        let known = gaps.entry((net.min(theirs), net.max(theirs))).or_default();
        let narrowest = known.first().map_or(f64::MAX, |gap| gap.width);
        if width < narrowest - EQUAL_MM {
            known.clear();
        }
        if width <= narrowest + EQUAL_MM {
            known.push(gap);
        }
    }
}

/// Whether the way from `spot` to `edge` leads through this piece of copper.
fn seen(scene: &Scene<'_>, spot: Spot, edge: &Edge, sight: Option<u32>) -> bool {
    let Some(piece) = sight else { return true };
    let to = edge.near(spot);
    [0.12, 0.31, 0.5, 0.69, 0.88].iter().all(|&share| {
        let here = spot.towards(to, share);
        scene.left_edges.island_at(here) == Some(piece)
    })
}

/// The same gap where it is narrowest near by: places were only looked at every so often.
fn refined(scene: &Scene<'_>, one: u32, other: u32, gap: Gap) -> Gap {
    let mut best = gap;
    let (low, high) = around(gap.from, gap.to, STEP_MM * 2.0);
    let mut near: [Vec<Edge>; 2] = [Vec::new(), Vec::new()];
    scene.design.in_box(low, high, &mut |_, edge| {
        let net = scene.net(edge.island);
        match near.each_mut() {
            [ours, _] if net == one => ours.push(*edge),
            [_, theirs] if net == other => theirs.push(*edge),
            _ => {}
        }
    });
    let [ours, theirs] = near;
    if ours.len() * theirs.len() > 40_000 {
        return best;
    }
    for a in &ours {
        for b in &theirs {
            let (width, from, to) = between(a, b);
            let middle = from.towards(to, 0.5);
            let near = middle.distance(gap.from.towards(gap.to, 0.5)) <= STEP_MM * 2.0;
            if width < best.width - EQUAL_MM && near && scene.left_edges.island_at(middle).is_some() {
                best = Gap { width, from, to };
            }
        }
    }
    best
}

fn finding(scene: &Scene<'_>, one: u32, other: u32, gap: Gap) -> Finding {
    let gap = refined(scene, one, other, gap);
    let middle = gap.from.towards(gap.to, 0.5).point();
    let width = Length::from_mm(gap.width);
    let tool = scene.narrowest();
    let kind = if tool.is_some_and(|tool| width < tool) { Kind::Gap } else { Kind::Short };
    let mut finding = Finding::new(kind, middle, width, vec![scene.label(one), scene.label(other)]);
    finding.tool = tool;
    finding.ends = Some((gap.from.point(), gap.to.point()));
    // Where the bit fits, a way is missing, and no other bit or depth is needed.
    if kind == Kind::Gap {
        finding.cures = cures::for_gap(scene, width);
    }
    finding
}

/// Nets that share a piece with others without any gap that was found: told at a place on them.
fn untold(scene: &Scene<'_>, told: &BTreeMap<u32, BTreeSet<u32>>) -> Vec<Finding> {
    let mut findings = Vec::new();
    for kept in scene.kept.iter().flatten() {
        let net = scene.net(kept.island);
        let Some(nets) = scene.nets_in(kept.piece).filter(|nets| nets.len() > 1) else { continue };
        let known = told.get(&kept.piece);
        if known.is_some_and(|known| known.contains(&net)) {
            continue;
        }
        // With a net that was told, if there is one: else with the least other one.
        let partner = known
            .and_then(|known| known.iter().next())
            .or_else(|| nets.iter().find(|&&other| other != net))
            .copied()
            .unwrap_or(net);
        let names = vec![scene.label(net), scene.label(partner)];
        let mut finding = Finding::new(Kind::Short, kept.spot.point(), Length::ZERO, names);
        finding.tool = scene.narrowest();
        findings.push(finding);
    }
    findings
}
