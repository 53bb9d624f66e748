//! Programs that are not meant to isolate: one report, instead of one for each pair of nets.
//!
//! ```text
//!   drill, cut out        no path is milled among the copper ▓: all nets stay one piece, as on the blank
//!   ┌─ ─ ─ ─ ─ ─ ─ ─┐
//!     ▓▓ ◯ ▓▓   ▓▓
//!   └─ ─ ─ ─ ─ ─ ─ ─┘
//! ```

use super::edges::{Spot, spots};
use super::finding::{Finding, FindingKind};
use super::scene::Scene;
use crate::geometry::Bounds;
use crate::job::Mark;
use crate::units::Length;
use std::collections::BTreeSet;

const STEP_MM: f64 = 0.2;

pub(super) fn not_isolated(scene: &Scene<'_>) -> Option<Finding> {
    if isolates(scene) {
        return None;
    }
    let joined: usize = scene.nets_in.iter().map(BTreeSet::len).filter(|count| *count > 1).sum();
    let place = scene.copper.bounds()?.min;
    let mut finding = Finding::new(FindingKind::NotIsolated, place, Length::ZERO, Vec::new());
    finding.count = joined as u32;
    (joined > 0).then_some(finding)
}

/// True if the programs must isolate the nets, or mill among them.
pub(super) fn isolates(scene: &Scene<'_>) -> bool {
    scene.options.isolates.unwrap_or_else(|| mills_among_copper(scene))
}

/// True if a path through the copper is inside the copper's bounds; paths along the outline are outside.
fn mills_among_copper(scene: &Scene<'_>) -> bool {
    let Some(Bounds { min, max }) = scene.copper.bounds() else { return false };
    let toolpaths = scene.cuts.iter().filter(|cut| {
        cut.through.is_some() && matches!(cut.mark, Mark::Toolpath(_)) && !cut.path.segments.is_empty()
    });
    let within = |x: f64, y: f64| x > min.x.mm() && x < max.x.mm() && y > min.y.mm() && y < max.y.mm();
    let crosses = |from: Spot, to: Spot| {
        let count = libm::ceil(from.distance(to) / STEP_MM).clamp(1.0, 10_000.0);
        (0..=count as u32).any(|index| {
            let spot = from.towards(to, f64::from(index) / count);
            within(spot.x, spot.y)
        })
    };
    toolpaths
        .map(|cut| spots(&cut.path))
        .any(|spots| spots.iter().zip(spots.iter().skip(1)).any(|(&from, &to)| crosses(from, to)))
}
