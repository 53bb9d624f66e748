//! Layers named copper whose drawing is a mask, a paste layer or an outline. Sides are determined later.
//!
//! ```text
//!   psu_L1 ◎──◎ copper     psu_L2 ◎──◎ copper     psu_L3 ◯  ◯ mask: only copper counts, so L2 is the bottom
//! ```

use super::companion::base;
use super::layer_shape::{Shape, opening};
use super::role::{Contradiction, Ground, Layers, OVERHANG, Row};
use super::{Role, Side};
use crate::note;

/// Changes the role of layers named copper that are drawn differently, if the same board has copper with
/// tracks.
pub(super) fn reclassify(layers: &mut Layers, rows: &mut [Row]) {
    let found: Vec<Option<(Role, Option<Contradiction>)>> =
        rows.iter().map(|row| finding(layers, rows, row)).collect();
    for (row, found) in rows.iter_mut().zip(found) {
        let Some((role, contradiction)) = found else { continue };
        row.contradiction = contradiction;
        row.is_drawn_otherwise = role != Role::Copper;
        let Some(file) = layers.get_mut(row.index).and_then(Option::as_mut) else { continue };
        if role == Role::Outline {
            file.side = None;
        }
        if role != Role::Copper {
            file.role = role;
            let reason = note!("kind.gerber_drawn", ..).with("found", base(&file.name));
            file.reason = reason.with("role", role.name());
        }
    }
}

/// The role of a row by its drawing, with the contradiction to report; none if the drawing agrees. A strong name keeps its role.
fn finding(layers: &Layers, rows: &[Row], row: &Row) -> Option<(Role, Option<Contradiction>)> {
    let file = |row: &Row| layers.get(row.index).and_then(Option::as_ref);
    let own = file(row).filter(|file| file.role == Role::Copper && file.side != Some(Side::Inner))?;
    let is_weak = row.ground <= Ground::Words || row.number.is_some() && row.ground < Ground::Attribute;
    let layer =
        own.gerber.as_ref().filter(|layer| !layer.negative_image && row.ground < Ground::Attribute)?;
    let shape = row.shape.as_ref().filter(|shape| !shape.joined)?;
    let is_copper = |other: &&Row| {
        let role = file(other).map(|file| file.role);
        role == Some(Role::Copper) || role == Some(Role::Other) && other.ground == Ground::Nothing
    };
    let kin = rows.iter().filter(|other| other.index != row.index && other.is_kin(row));
    let copper = kin.filter(is_copper).filter(|other| other.shape.as_ref().is_some_and(|shape| shape.joined));
    let copper: Vec<&Row> = copper.collect();
    let shapes: Vec<&Shape> = copper.iter().filter_map(|other| other.shape.as_ref()).collect();
    let opening = shapes.iter().find_map(|copper| opening(shape, copper));
    if !is_weak {
        let is_opening = shape.drawn == 0 && opening.is_some();
        return is_opening.then_some((Role::Copper, Some(Contradiction::PadsAlone)));
    }
    let around = |other: &&Row| {
        let bounds = layer.centre_bounds().map(|bounds| bounds.grown(OVERHANG));
        let copper = file(other).and_then(|file| file.gerber.as_ref()?.centre_bounds());
        bounds.zip(copper).is_some_and(|(own, copper)| own.contains(copper.min) && own.contains(copper.max))
    };
    if shape.is_loops && shape.under_holes_share == 0.0 && copper.iter().any(around) {
        return Some((Role::Outline, None));
    }
    if let Some(role) = opening {
        return Some((role, Some(Contradiction::Opening(own.side))));
    }
    let beside = shape.has_holes && shape.under_holes_share == 0.0;
    let beside = beside && shapes.iter().any(|copper| copper.under_holes_share > 0.0);
    match (beside, row.number) {
        (true, Some(_)) if own.side.is_none() => Some((Role::Other, Some(Contradiction::Nothing))),
        _ if !shapes.is_empty() && shape.drawn == 0 => Some((Role::Copper, Some(Contradiction::PadsAlone))),
        _ if beside => Some((Role::Copper, Some(Contradiction::MissesHoles))),
        _ => None,
    }
}
