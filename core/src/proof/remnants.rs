//! Copper that belongs to nothing and is nearer to a net than was asked: a pass that is missing.
//!
//! ```text
//!    ███ island ███ ┆ clearance ┆
//!    ██████████████ ┆   ░░░░░   ┆ ░░░░     what is left within the clearance, apart from what a round tool cannot reach
//! ```
//!
//! Comes in: the scene, with a clearance asked for. Goes out: findings. Does not know passes.

use super::edges::Spot;
use super::finding::{Finding, Kind};
use super::scene::{Scene, inner_spot};
use crate::geometry::{Region, Rule, combine, grow, island_area_mm2};
use crate::units::Length;

/// Every piece within the clearance that is larger than what a round tool leaves in corners.
pub(super) fn remnants(scene: &Scene<'_>) -> Vec<Finding> {
    let Some(clearance) = scene.options.clearance else { return Vec::new() };
    // Sloping walls of a V-bit leave a little at the underside on both sides.
    let through = scene.cuts.iter().filter_map(|cut| Some((cut.surface - cut.through?).nm() / 2)).max();
    let slack = Length::from_nm(through.unwrap_or(0)) + scene.options.tolerance;
    if clearance <= slack + slack {
        return Vec::new();
    }
    let tool = scene.narrowest().unwrap_or_default().mm();
    let wanted = grow(&scene.copper, clearance - slack);
    let inner = grow(&scene.copper, slack);
    let band = combine(&combine(&wanted, &scene.left, Rule::Intersection), &inner, Rule::Difference);
    remnant_pieces(scene, &band, tool * tool)
}

fn remnant_pieces(scene: &Scene<'_>, band: &Region, least: f64) -> Vec<Finding> {
    let mut findings = Vec::new();
    for island in band.islands.iter().filter(|island| island_area_mm2(island) > least) {
        let Some(spot) = inner_spot(island) else { continue };
        // Where two nets are in one piece, that is told.
        let nets = scene.left_edges.island_at(spot).and_then(|piece| scene.nets_in(piece));
        if nets.is_some_and(|nets| nets.len() > 1) {
            continue;
        }
        if let Some((distance, net)) = nearest_net(scene, spot) {
            let mut finding =
                Finding::new(Kind::Remnant, spot.point(), Length::from_mm(distance), vec![scene.label(net)]);
            finding.tool = scene.narrowest();
            findings.push(finding);
        }
    }
    findings
}

fn nearest_net(scene: &Scene<'_>, spot: Spot) -> Option<(f64, u32)> {
    let (distance, _, edge) = scene.design.nearest(spot, scene.design.extent(), &|_| true)?;
    Some((distance, scene.net(edge.island)))
}
