//! Copper rings around drilled holes.
//!
//! ```text
//!      ╭──────╮        ring = distance from centre to the pad's edge − radius; below 0: breaks out
//!      │  ◯ ↔ │
//!                       a drill with runout makes a wider hole
//!      ╰──────╯        a hole centred on no copper or on another net, with its edge in copper: a hit
//! ```
//!
//! Copper with a sufficient clear hole around the drill is not touched by it.

use super::edges::{Spot, spots};
use super::finding::{Finding, FindingKind};
use super::replay::PathCut;
use super::scene::Scene;
use crate::geometry::Bounds;
use crate::job::Mark;
use crate::units::Length;
use std::collections::BTreeMap;

struct Hole {
    at: Spot,
    radius: f64,
    leg: (u32, u32),
}

/// Holes with too little copper around them, and holes in copper of other nets.
pub(super) fn rings(scene: &Scene<'_>) -> Vec<Finding> {
    holes(scene).iter().flat_map(|hole| around(scene, hole)).collect()
}

/// Plunges of drills, and legs that mill a circle as a hole.
fn holes(scene: &Scene<'_>) -> Vec<Hole> {
    let mut milled: BTreeMap<(u32, u32), Vec<&PathCut>> = BTreeMap::new();
    let mut holes = Vec::new();
    for cut in scene.cuts.iter().filter(|cut| cut.through.is_some()) {
        let leg = (cut.program, cut.leg);
        if cut.is_drilled(scene.programs) && cut.path.segments.is_empty() {
            let radius = cut.surface.mm() / 2.0 + cut.run_out(scene.programs).mm();
            holes.push(Hole { at: Spot::of(cut.path.start), radius, leg });
        } else if matches!(cut.mark, Mark::Hole(_)) {
            milled.entry(leg).or_default().push(cut);
        }
    }
    for (leg, cuts) in milled {
        let corners = cuts.iter().flat_map(|cut| spots(&cut.path)).map(Spot::point);
        let widest = cuts.iter().map(|cut| cut.surface.mm()).fold(0.0, f64::max);
        let Some(bounds) = Bounds::around(corners) else { continue };
        let (wide, high) = ((bounds.max.x - bounds.min.x).mm(), (bounds.max.y - bounds.min.y).mm());
        // Only equal sides are a round hole; others are a slot.
        if libm::fabs(wide - high) <= 0.02 {
            let at = Spot::of(bounds.min).towards(Spot::of(bounds.max), 0.5);
            holes.push(Hole { at, radius: (wide.max(high) + widest) / 2.0, leg });
        }
    }
    holes
}

/// The island of a hole, and for a pad with an open centre the ring that the drill removes.
fn own(scene: &Scene<'_>, hole: &Hole) -> Option<(u32, Option<u32>)> {
    let edge = scene.design.right_of(hole.at)?;
    if edge.to.y > edge.from.y {
        return Some((edge.island, None));
    }
    let bare = scene.design.rings.get(edge.ring as usize).is_some_and(|ring| ring.area_mm2 < 0.0);
    let near = || scene.design.nearest(hole.at, hole.radius, &|near| near.ring == edge.ring).is_some();
    (bare && near()).then_some((edge.island, Some(edge.ring)))
}

fn around(scene: &Scene<'_>, hole: &Hole) -> Vec<Finding> {
    let tolerance = scene.options.tolerance.mm();
    let (own, bare) = own(scene, hole).map_or((None, None), |(island, ring)| (Some(island), ring));
    let reach = hole.radius + scene.options.ring.mm();
    // The nearest edge of each island; of the hole's island only edges that stay.
    let mut nearest: BTreeMap<u32, (f64, Spot)> = BTreeMap::new();
    let (low, high) = super::edges::around(hole.at, hole.at, reach);
    scene.design.in_box(low, high, &mut |_, edge| {
        if bare == Some(edge.ring) {
            return;
        }
        let at = edge.near(hole.at);
        let distance = at.distance(hole.at);
        let known = nearest.entry(edge.island).or_insert((distance, at));
        if distance < known.0 {
            *known = (distance, at);
        }
    });
    let mut findings = Vec::new();
    for (&island, &(distance, at)) in &nearest {
        let net = scene.label(scene.net(island));
        let told = if own == Some(island) {
            let ring = distance - hole.radius;
            (ring < scene.options.ring.mm() - 1e-6).then(|| (FindingKind::Ring, ring, vec![net]))
        } else {
            let bite = hole.radius - distance;
            let nets = own.map(|own| scene.label(scene.net(own))).into_iter().chain([net]).collect();
            let same = own.is_some_and(|own| scene.net(own) == scene.net(island));
            (bite > tolerance && !same).then_some((FindingKind::Hit, bite, nets))
        };
        if let Some((kind, width, nets)) = told {
            let mut finding = Finding::new(kind, at.point(), Length::from_mm(width), nets);
            finding.tool = Some(Length::from_mm(hole.radius * 2.0));
            finding.leg = Some(hole.leg);
            findings.push(finding);
        }
    }
    findings
}
