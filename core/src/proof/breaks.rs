//! Islands that were cut apart or are gone.
//!
//! ```text
//!    ██████╲  ╲██████      parts of one island in different pieces: reported at the narrowest cut
//!    ███████╲  ╲█████
//! ```

use super::edges::{Edge, Edges, Spot};
use super::finding::{Finding, FindingKind};
use super::scene::{Kept, Scene, inner_spot};
use crate::units::Length;
use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};

const STEP_MM: f64 = 0.02;
/// Gaps within this of the narrowest, in mm, count as equal.
const EQUAL_MM: f64 = 0.002;

pub(super) fn breaks(scene: &Scene<'_>) -> Vec<Finding> {
    let mut pieces: BTreeMap<u32, Vec<(u32, Kept)>> = BTreeMap::new();
    for (index, kept) in (0..).zip(&scene.kept) {
        if let Some(kept) = kept.filter(|kept| kept.area_mm2 >= scene.options.smallest_mm2) {
            pieces.entry(kept.island).or_default().push((index, kept));
        }
    }
    let mut findings = Vec::new();
    let edges = OnceCell::new();
    for (island, shape) in (0..).zip(&scene.copper.islands) {
        match pieces.get(&island) {
            None => {
                // An island this small that is still there is not gone.
                let there = scene.kept.iter().flatten().any(|kept| kept.island == island);
                if let Some(spot) = inner_spot(shape).filter(|_| !there) {
                    findings.push(finding(scene, FindingKind::Gone, island, spot, 0.0));
                }
            }
            Some(pieces) => findings.extend(broken(scene, island, pieces, &edges)),
        }
    }
    findings
}

fn finding(scene: &Scene<'_>, kind: FindingKind, island: u32, spot: Spot, width: f64) -> Finding {
    let mut finding =
        Finding::new(kind, spot.point(), Length::from_mm(width), vec![scene.label(scene.net(island))]);
    finding.tool = scene.narrowest();
    finding
}

/// One finding for every group of pieces separated from the largest. `edges` are those of the remaining
/// copper, computed when needed.
fn broken(scene: &Scene<'_>, island: u32, pieces: &[(u32, Kept)], edges: &OnceCell<Edges>) -> Vec<Finding> {
    let groups: BTreeSet<u32> = pieces.iter().map(|(_, kept)| kept.piece).collect();
    let area = |group: u32| -> f64 {
        pieces.iter().filter(|(_, kept)| kept.piece == group).map(|(_, kept)| kept.area_mm2).sum()
    };
    let largest = groups.iter().copied().max_by(|&a, &b| area(a).total_cmp(&area(b)));
    let of_group = |group: u32| -> BTreeSet<u32> {
        pieces.iter().filter(|(_, kept)| kept.piece == group).map(|(index, _)| *index).collect()
    };
    let apart = groups.iter().filter(|group| Some(**group) != largest).map(|&group| of_group(group));
    let all: BTreeSet<u32> = pieces.iter().map(|(index, _)| *index).collect();
    let place = |ours: BTreeSet<u32>| {
        let theirs = &all - &ours;
        let edges = edges.get_or_init(|| Edges::of(&scene.kept_region));
        let (width, spot) = narrowest(scene, edges, (&ours, &theirs))?;
        Some(finding(scene, FindingKind::Break, island, spot, width))
    };
    apart.filter_map(place).collect()
}

/// Nearest points of two sets of remaining pieces; of equally near ones the middle one.
fn narrowest(
    scene: &Scene<'_>,
    edges: &Edges,
    (ours, theirs): (&BTreeSet<u32>, &BTreeSet<u32>),
) -> Option<(f64, Spot)> {
    let mut places: Vec<(f64, Spot)> = Vec::new();
    let extent = scene.design.extent();
    let wanted = |edge: &Edge| theirs.contains(&edge.island);
    for (_, edge) in edges.iter().filter(|(_, edge)| ours.contains(&edge.island)) {
        let count = libm::ceil(edge.length() / STEP_MM).clamp(1.0, 1_000.0) as usize;
        for index in 0..count {
            let spot = edge.from.towards(edge.to, (index as f64 + 0.5) / count as f64);
            let best = places.iter().fold(extent, |best, (width, _)| best.min(*width));
            if let Some((width, at, _)) = edges.nearest(spot, best + EQUAL_MM, &wanted) {
                places.retain(|(known, _)| *known <= width + EQUAL_MM);
                places.push((width, spot.towards(at, 0.5)));
            }
        }
    }
    places.sort_by_key(|(_, spot)| spot.point());
    places.get(places.len() / 2).copied()
}
