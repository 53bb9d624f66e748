//! Copper so thin or so small that it may come off.
//!
//! ```text
//!   ┌──────────┐   ┌────────        two edges face each other through copper: a sliver or neck
//!   │          └───┘  ↕
//!   │          ┌───┐                consecutive edges around a corner are its tip, and no sliver
//!   └──────────┘   └────────
//! ```

use super::edges::{Edge, Edges, Spot, around, between};
use super::finding::{Finding, FindingKind};
use super::scene::{Scene, inner_spot};
use crate::geometry::island_area_mm2;
use crate::units::Length;
use std::collections::BTreeMap;

/// Cosine for edges in opposite directions within 60°: they face each other.
const FACING_COSINE: f64 = -0.5;
const HAIR_MM: f64 = 0.001;
/// Two edges within this many times the limit along their ring are one corner.
const CORNER_FACTOR: f64 = 6.0;
const JOINED_MM: f64 = 0.3;

#[derive(Clone, Copy)]
struct Thin {
    width: f64,
    spot: Spot,
    piece: u32,
    /// If it tears, more than a fragment is lost.
    neck: bool,
}

/// Every place where the copper left is thinner than the limit; connected ones are merged.
pub(super) fn slivers(scene: &Scene<'_>) -> Vec<Finding> {
    let limit = scene.options.thinnest.mm();
    let edges = &scene.left_edges;
    let mut thin = Vec::new();
    for (index, edge) in edges.iter() {
        let (low, high) = around(edge.from, edge.to, limit);
        edges.in_box(low, high, &mut |other_index, other| {
            if other_index > index && other.island == edge.island {
                let pair = [(index, &edge), (other_index, other)];
                thin.extend(facing(pair, limit, edges, scene.options.smallest_mm2));
            }
        });
    }
    // A net depends on a neck in that net's copper.
    for thin in thin.iter_mut().filter(|thin| thin.neck) {
        thin.neck = scene.design.island_at(thin.spot).is_some();
    }
    // Pieces that leave with the chips are not reported.
    let dust = |thin: &Thin| {
        let loose = scene.nets_in(thin.piece).is_none_or(|nets| nets.is_empty());
        let island = scene.left.islands.get(thin.piece as usize).filter(|_| loose);
        island.is_some_and(|island| island_area_mm2(island) <= dust_mm2(scene))
    };
    let told = groups(&thin).into_iter().filter(|thin| !dust(thin));
    told.map(|thin| sliver(scene, thin)).collect()
}

/// Points along two edges, given by number, where the copper between them is thinner than the limit. Copper
/// of more than `small` mm² is no tip.
fn facing(
    [(first, one), (second, other)]: [(u32, &Edge); 2],
    limit: f64,
    edges: &Edges,
    small: f64,
) -> Vec<Thin> {
    let (u, v) = (one.to.minus(one.from), other.to.minus(other.from));
    // Edges in one direction do not face each other; this test needs no square root.
    let along = u.dot(v);
    if along >= 0.0 {
        return Vec::new();
    }
    let lengths = u.length() * v.length();
    if lengths <= 0.0 || along > FACING_COSINE * lengths {
        return Vec::new();
    }
    let (width, from, to) = between(one, other);
    if width >= limit || width < HAIR_MM {
        return Vec::new();
    }
    // Copper is on the left of an edge.
    let left = Spot { x: -u.y, y: u.x };
    if left.dot(to.minus(from)) < 0.7 * left.length() * width {
        return Vec::new();
    }
    let mut neck = false;
    if one.ring == other.ring {
        let ring = edges.rings.get(one.ring as usize).copied().unwrap_or_default();
        let apart = libm::fabs(edges.along_mm(first, from) - edges.along_mm(second, to));
        if apart.min(ring.length_mm - apart) < CORNER_FACTOR * limit {
            return Vec::new();
        }
        // A cut across a ring splits the piece: an outer ring into two parts, a hole's edge into a pocket.
        let part = edges.area_between((first, from), (second, to));
        let rest = ring.area_mm2 - part;
        neck = if ring.area_mm2 > 0.0 { part.min(rest) } else { part.max(rest) } > small;
    }
    // Long edges face each other over a length.
    let count = libm::ceil(2.0 * u.length() / JOINED_MM).clamp(1.0, 10_000.0) as usize;
    let places = (0..=count).filter(|_| count > 1).map(|index| {
        let spot = one.from.towards(one.to, index as f64 / count as f64);
        let across = other.near(spot);
        (spot.distance(across), spot.towards(across, 0.5))
    });
    let places = places.chain([(width, from.towards(to, 0.5))]);
    places
        .filter(|(width, _)| *width < limit)
        .map(|(width, spot)| Thin { width, spot, piece: one.island, neck })
        .collect()
}

/// The thinner of two places; a neck before a tip, because a net depends on it.
fn thinner(one: Thin, other: Thin) -> Thin {
    let rank = |thin: &Thin| (!thin.neck, thin.width, thin.spot.point());
    if rank(&other) < rank(&one) { other } else { one }
}

/// The thinnest place of every group of nearby places in one piece.
fn groups(thin: &[Thin]) -> Vec<Thin> {
    let cell = |thin: &Thin| {
        let cell = |value: f64| libm::floor(value / JOINED_MM) as i64;
        (thin.piece, cell(thin.spot.x), cell(thin.spot.y))
    };
    let mut cells: BTreeMap<(u32, i64, i64), Thin> = BTreeMap::new();
    for place in thin {
        cells.entry(cell(place)).and_modify(|known| *known = thinner(*known, *place)).or_insert(*place);
    }
    let mut groups = Vec::new();
    while let Some((first, mut thinnest)) = cells.pop_first() {
        let mut open = vec![first];
        while let Some((piece, column, row)) = open.pop() {
            for (dx, dy) in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy))) {
                let next = (piece, column + dx, row + dy);
                if let Some(place) = cells.remove(&next) {
                    open.push(next);
                    thinnest = thinner(thinnest, place);
                }
            }
        }
        groups.push(thinnest);
    }
    groups
}

fn sliver(scene: &Scene<'_>, thin: Thin) -> Finding {
    let nets = scene.nets_in(thin.piece).into_iter().flatten();
    // A piece with many nets is reported as shorts; its slivers need no complete list.
    let nets = nets.take(2).map(|&net| scene.label(net)).collect();
    let mut finding = Finding::new(FindingKind::Sliver, thin.spot.point(), Length::from_mm(thin.width), nets);
    finding.tool = scene.narrowest();
    finding.slight = !thin.neck;
    finding
}

/// Loose pieces up to this, in mm², leave with the chips: a square as wide as the thinnest stable copper.
fn dust_mm2(scene: &Scene<'_>) -> f64 {
    scene.options.thinnest.mm() * scene.options.thinnest.mm()
}

pub(super) fn fragments(scene: &Scene<'_>) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (piece, island) in (0..).zip(&scene.left.islands) {
        if scene.nets_in(piece).is_some_and(|nets| !nets.is_empty()) {
            continue;
        }
        let area = island_area_mm2(island);
        // Pieces from rounding are not reported.
        let small = area < scene.options.smallest_mm2 && area > dust_mm2(scene);
        if let Some(spot) = inner_spot(island).filter(|_| small) {
            let width = Length::from_mm(libm::sqrt(area));
            findings.push(Finding::new(FindingKind::Fragment, spot.point(), width, Vec::new()));
        }
    }
    findings
}
