//! Copper of no net that should have been removed: a pass is missing.
//!
//! ```text
//!    ███ island ███ ┆ clearance ┆          required: everything a round tool reaches within it
//!    ██████████████ ┆   ░░░░░   ┆ ░░░░     the rest of it ░ is reported
//!
//!    ███ island ███ (tool)   ░░░   (tool)  a job that clears: everything that its narrowest tool reaches
//! ```
//!
//! A tool reaches the area where its centre may go, grown by half its width at the underside of the copper.

use super::edges::Spot;
use super::finding::{Finding, FindingKind};
use super::scene::{Scene, inner_spot};
use crate::board::Copper;
use crate::geometry::{CombineRule, Region, combine, grow, island_area_mm2, rectangle, union};
use crate::job::Cleared;
use crate::units::Length;

/// Every piece within the clearance, or in a cleared area, that a round tool reaches and that is no fragment.
pub(super) fn remnants(scene: &Scene<'_>) -> Vec<Finding> {
    let mut findings = Vec::new();
    let asked = scene.options.clearance.zip(scene.narrowest_cut);
    if let Some((clearance, (surface, through))) = asked {
        let cut = Cleared { surface, through, margin: Length::ZERO, beyond: clearance + surface };
        // The outermost groove of a V-bit is narrower at the underside.
        let narrower = Length::from_nm((surface - through).nm() / 2);
        let within = grow(&scene.copper, (clearance - narrower - scene.options.tolerance).max(Length::ZERO));
        findings.extend(pieces(
            scene,
            &combine(&within, &left(scene, &cut), CombineRule::Intersection),
            surface,
        ));
    }
    for cleared in &scene.options.cleared {
        findings.extend(pieces(scene, &left(scene, cleared), cleared.surface));
    }
    findings
}

fn left(scene: &Scene<'_>, cut: &Cleared) -> Region {
    let slack = scene.options.tolerance;
    let half = |width: Length| Length::from_nm(width.nm() / 2);
    let outlined = !scene.board.outline.is_empty();
    let field = match scene.board.copper.iter().find(|copper| copper.face == scene.options.face) {
        _ if outlined => grow(&scene.board.outline, cut.beyond.min(half(cut.surface))),
        Some(copper) => around(copper, cut.beyond),
        None => return Region::default(),
    };
    let reach = half(cut.through) - slack;
    if reach <= Length::ZERO {
        return Region::default();
    }
    let kept = grow(&scene.copper, cut.margin + half(cut.surface) + slack);
    // The area closed to its centre, shrunk again.
    let frame = field.bounds().map(|bounds| union(&[rectangle(bounds.grown(cut.surface + cut.surface))]));
    let beyond = combine(&frame.unwrap_or_default(), &field, CombineRule::Difference);
    let unreached = grow(&combine(&kept, &beyond, CombineRule::Union), -reach);
    let reached = combine(&scene.left, &unreached, CombineRule::Difference);
    let wanted = if outlined { reached } else { combine(&reached, &field, CombineRule::Intersection) };
    // Drop hairs between neighbouring toolpaths: they are rounding.
    grow(&grow(&wanted, -slack), slack)
}

fn around(copper: &Copper, by: Length) -> Region {
    let bounds = copper.region.bounds();
    bounds.map_or_else(Region::default, |bounds| union(&[rectangle(bounds.grown(by))]))
}

fn pieces(scene: &Scene<'_>, region: &Region, tool: Length) -> Vec<Finding> {
    let mut findings = Vec::new();
    let least = scene.options.smallest_mm2;
    for island in region.islands.iter().filter(|island| island_area_mm2(island) > least) {
        let Some(spot) = inner_spot(island) else { continue };
        // Two nets in one piece are reported as a short.
        let nets = scene.left_edges.island_at(spot).and_then(|piece| scene.nets_in(piece));
        if nets.is_some_and(|nets| nets.len() > 1) {
            continue;
        }
        if let Some((distance, net)) = nearest_net(scene, spot) {
            let mut finding = Finding::new(
                FindingKind::Remnant,
                spot.point(),
                Length::from_mm(distance),
                vec![scene.label(net)],
            );
            finding.tool = Some(tool);
            findings.push(finding);
        }
    }
    findings
}

fn nearest_net(scene: &Scene<'_>, spot: Spot) -> Option<(f64, u32)> {
    let (distance, _, edge) = scene.design.nearest(spot, scene.design.extent(), &|_| true)?;
    Some((distance, scene.net(edge.island)))
}
