//! What every layer of a set is for, found for all layers of a folder together.
//!
//! Comes in: the layers as read. Goes out: their roles, sides and reasons. Does not move anything.
//!
//! ```text
//!   X2 file function ─▶ names inside the layer ─▶ what its apertures are for ─▶ the CAD's name tables ─▶ words in the name
//!                                                       the CAD that most names of the folder agree on comes first
//!   then: of two layers for one place the better founded stays; a folder without copper of a side, or without outline, is
//!   searched for one
//! ```

use super::companion::{base, folder};
use super::names::{Meaning, meanings};
use super::role::{by_content, by_function, by_words};
use super::text::holds;
use super::words::stem_words;
use super::{Evidence, FileRead, Gerber, Role, Side, Source, gerber, measure};
use crate::diagnostic::Diagnostic;
use crate::geometry::Bounds;
use crate::units::Length;
use std::collections::BTreeMap;

/// How far an outline may keep within its board's copper.
const OVERHANG: Length = Length::from_um(1_000);

/// How well founded a role is, the best last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Ground {
    Nothing,
    Words,
    Names,
    Content,
    Attribute,
}

struct Found {
    role: Role,
    side: Option<Side>,
    ground: Ground,
    reason: Diagnostic,
}

/// Gives every layer its role.
pub(super) fn recognise(layers: &mut [Option<FileRead>]) {
    let mut folders: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (index, layer) in layers.iter().enumerate() {
        if let Some(layer) = layer {
            folders.entry(folder(&layer.name).to_owned()).or_default().push(index);
        }
    }
    for members in folders.into_values() {
        let names = members.iter().filter_map(|&index| layers.get(index)?.as_ref());
        let cads = votes(&names.collect::<Vec<_>>());
        let mut grounds = Vec::new();
        for &index in &members {
            let Some(file) = layers.get_mut(index).and_then(Option::as_mut) else { continue };
            let Some(gerber) = &file.gerber else { continue };
            let found = find(base(&file.name), gerber, &cads);
            file.plated = plating(gerber);
            (file.role, file.side, file.reason) = (found.role, found.side, found.reason);
            holes(file);
            grounds.push((index, found.ground));
        }
        rivals(layers, &grounds);
        only_copper(layers, &grounds);
        outline(layers, &members);
    }
}

/// How many names of a folder each CAD knows, and twice that where a layer says who wrote it.
fn votes(files: &[&FileRead]) -> BTreeMap<&'static str, usize> {
    let mut votes = BTreeMap::new();
    for file in files {
        for Meaning { cad, .. } in meanings(base(&file.name)) {
            let wrote = file.generator.as_deref().is_some_and(|text| holds(text.as_bytes(), cad));
            *votes.entry(cad).or_default() += if wrote { 3 } else { 1 };
        }
    }
    votes
}

fn find(name: &str, gerber: &Gerber, cads: &BTreeMap<&'static str, usize>) -> Found {
    let reason = |code: &str, word: &str| Diagnostic::note(code).with("found", word);
    if let Some(function) = &gerber.file_function {
        let (role, side) = by_function(function);
        if role != Role::Other || !function.is_empty() && side.is_some() {
            return Found {
                role,
                side,
                ground: Ground::Attribute,
                reason: reason("kind.gerber_x2", function),
            };
        }
    }
    if let Some((role, side)) = gerber.layer_name.as_deref().and_then(by_words) {
        let shown = gerber.layer_name.as_deref().unwrap_or_default();
        return Found {
            role,
            side,
            ground: Ground::Content,
            reason: reason("kind.gerber_layer_name", shown),
        };
    }
    let named =
        meanings(name).into_iter().rev().max_by_key(|meaning| cads.get(meaning.cad).copied().unwrap_or(0));
    if let Some(function) = by_content(gerber) {
        let (role, word) = function;
        let side = named.filter(|meaning| meaning.role == role).and_then(|meaning| meaning.side);
        let side = side.or_else(|| by_words(name).and_then(|(_, side)| side));
        return Found { role, side, ground: Ground::Content, reason: reason("kind.gerber_functions", word) };
    }
    if let Some(Meaning { cad, role, side }) = named {
        let reason = reason("kind.gerber_cad_name", name).with("cad", cad);
        return Found { role, side, ground: Ground::Names, reason };
    }
    if let Some((role, side)) = by_words(name) {
        return Found { role, side, ground: Ground::Words, reason: reason("kind.gerber_file_name", name) };
    }
    Found { role: Role::Other, side: None, ground: Ground::Nothing, reason: reason("kind.gerber", "") }
}

/// The holes of a layer that says it stands for a drill file.
fn holes(file: &mut FileRead) {
    let Some(layer) =
        file.gerber.as_ref().filter(|layer| file.role == Role::Drill && gerber::says_holes(layer))
    else {
        return;
    };
    let (drill, diagnostics) = gerber::holes(&file.name, layer, file.plated);
    let source =
        if layer.digits.is_some() && layer.units.is_some() { Source::Header } else { Source::Default };
    file.evidence = Some(Evidence::plain(source));
    file.diagnostics.extend(diagnostics);
    let units = layer.units.map_or("inch", |units| units.name());
    file.diagnostics.extend(measure::faults(&file.name, &drill, units));
    file.drill = Some(drill);
}

fn plating(gerber: &Gerber) -> Option<bool> {
    let function = gerber.file_function.as_deref()?;
    match function.split(',').next()? {
        "NonPlated" => Some(false),
        "Plated" => Some(true),
        _ => None,
    }
}

/// Of several layers for the same side's copper the better founded stays; equals stay both, and are reported.
fn rivals(layers: &mut [Option<FileRead>], grounds: &[(usize, Ground)]) {
    for side in [Side::Top, Side::Bottom] {
        let of_side = |&(index, ground): &(usize, Ground)| {
            let file = layers.get(index)?.as_ref()?;
            (file.role == Role::Copper && file.side == Some(side)).then_some((index, ground))
        };
        let rows: Vec<(usize, Ground)> = grounds.iter().filter_map(of_side).collect();
        let stem = |index: usize| {
            layers.get(index).and_then(Option::as_ref).map(|file| stem_words(base(&file.name)))
        };
        let stems: Vec<Vec<String>> = rows.iter().map(|row| stem(row.0).unwrap_or_default()).collect();
        for (&(index, ground), own) in rows.iter().zip(&stems) {
            // Layers of another board, by their names, are no rivals.
            let related = |other: &&Vec<String>| own.iter().zip(*other).all(|(a, b)| a == b);
            let kin = || rows.iter().zip(&stems).filter(|(_, other)| related(other)).map(|(row, _)| row.1);
            let Some(best) = kin().max().filter(|_| kin().count() > 1) else { continue };
            let Some(file) = layers.get_mut(index).and_then(Option::as_mut) else { continue };
            let name = file.name.clone();
            if ground < best {
                file.role = Role::Other;
                file.diagnostics.push(Diagnostic::note("set.better_layer").at(&name, 0, 0));
            } else {
                file.diagnostics.push(Diagnostic::warning("set.two_layers").at(&name, 0, 0));
            }
        }
    }
}

/// Where no layer is the copper of a side: the only one that is copper at all, else the only one of unknown purpose that has
/// pads, is taken for the copper of the top.
fn only_copper(layers: &mut [Option<FileRead>], grounds: &[(usize, Ground)]) {
    let file = |index: usize| layers.get(index)?.as_ref();
    let copper: Vec<usize> = grounds
        .iter()
        .map(|row| row.0)
        .filter(|&index| file(index).is_some_and(|file| file.role == Role::Copper))
        .collect();
    let unknown = |&(index, ground): &(usize, Ground)| {
        let layer = file(index)?.gerber.as_ref()?;
        let pads = layer.counts.flashes > 0 && layer.file_function.is_none();
        (ground == Ground::Nothing && pads).then_some(index)
    };
    let of_side = copper.iter().any(|&index| file(index).is_some_and(|file| file.side.is_some()));
    let found = if copper.is_empty() { grounds.iter().filter_map(unknown).collect() } else { copper };
    let ([only], false) = (found.as_slice(), of_side) else { return };
    if let Some(file) = layers.get_mut(*only).and_then(Option::as_mut) {
        (file.role, file.side) = (Role::Copper, Some(Side::Top));
        file.diagnostics.push(Diagnostic::warning("set.only_copper").at(&file.name, 0, 0));
    }
}

/// Where no layer is the outline: one of unknown purpose that is drawn in strokes alone, around all copper.
fn outline(layers: &mut [Option<FileRead>], members: &[usize]) {
    let file = |index: &usize| layers.get(*index)?.as_ref();
    if members.iter().filter_map(file).any(|file| file.role == Role::Outline) {
        return;
    }
    let drawn = |index: &usize| {
        let file = file(index).filter(|file| file.role == Role::Other)?;
        let layer = file.gerber.as_ref().filter(|layer| layer.file_function.is_none())?;
        let strokes = layer.counts.flashes == 0 && layer.counts.lines + layer.counts.arcs >= 2;
        strokes.then_some((*index, layer))
    };
    let drawn: Vec<(usize, &Gerber)> = members.iter().filter_map(drawn).collect();
    if drawn.is_empty() {
        return;
    }
    let copper = members.iter().filter_map(file).filter(|file| file.role == Role::Copper);
    let copper = copper.filter_map(|file| file.gerber.as_ref()?.centre_bounds()).reduce(joined);
    let Some(copper) = copper else { return };
    let around = |(_, layer): &(usize, &Gerber)| {
        let bounds = layer.centre_bounds().map(|bounds| bounds.grown(OVERHANG));
        bounds.is_some_and(|bounds| bounds.contains(copper.min) && bounds.contains(copper.max))
    };
    let mut candidates = drawn.into_iter().filter(around);
    let (Some((only, _)), None) = (candidates.next(), candidates.next()) else { return };
    if let Some(file) = layers.get_mut(only).and_then(Option::as_mut) {
        (file.role, file.side) = (Role::Outline, None);
        file.reason = Diagnostic::note("kind.gerber_outline_shape").with("found", base(&file.name));
    }
}

fn joined(a: Bounds, b: Bounds) -> Bounds {
    a.with(b.min).with(b.max)
}
