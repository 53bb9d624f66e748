//! Determines the role of every layer of a set, for all layers of a folder together.
//!
//! ```text
//!   names and attributes (role) ─▶ drawings that contradict a name (content) ─▶ numbers: L1, L2
//!   ─▶ of two layers for one side, the better evidence, else shapes
//!   ─▶ layers that may be copper: used or asked about (orphans) ─▶ missing outline
//! ```

use super::companion::{base, folder};
use super::layer_shape::{Shape, has_links};
use super::names::{Meaning, meanings};
use super::role::{Found, Ground, OVERHANG, Row, find};
use super::text::holds;
use super::words::stem_words;
use super::{Evidence, FileRead, Gerber, Role, Side, Source, content, drill_format, gerber, orphans};
use crate::geometry::{Bounds, Point};
use crate::{note, warning};
use std::collections::{BTreeMap, BTreeSet};

/// Returns the holes of a folder's drill programs. Reads them with these layers, which may be copper, as
/// evidence.
pub(super) type Holes<'h> = dyn FnMut(&str, &[(&str, &Gerber)]) -> Vec<Point> + 'h;

/// Gives every layer its role. `drills` are the names of the drill programs.
pub(super) fn recognise(layers: &mut [Option<FileRead>], drills: &[&str], holes_of: &mut Holes<'_>) {
    let mut folders: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (index, layer) in layers.iter().enumerate() {
        if let Some(layer) = layer {
            folders.entry(folder(&layer.name).to_owned()).or_default().push(index);
        }
    }
    let all: BTreeSet<String> =
        folders.keys().cloned().chain(drills.iter().map(|name| folder(name).to_owned())).collect();
    for (of, members) in folders {
        let inside = if all.iter().any(|other| !is_within(other, &of)) { base(&of) } else { "" };
        let files: Vec<&FileRead> = members.iter().filter_map(|&index| layers.get(index)?.as_ref()).collect();
        let cads = votes(&files);
        let beside = drills.iter().filter(|name| folder(name) == of).map(|name| base(name));
        let common = common_front(files.iter().map(|file| base(&file.name)).chain(beside.clone()));
        let one_board = is_one_board(beside.map(stem_words).collect());
        let mut rows = Vec::new();
        for &index in &members {
            let Some(file) = layers.get_mut(index).and_then(Option::as_mut) else { continue };
            let Some(gerber) = &file.gerber else { continue };
            let name = base(&file.name);
            let Found { role, side, number, unsure, is_disputed, is_numbered_otherwise, ground, reason } =
                find([name, own(name, common), inside], gerber, &cads);
            let stem = stem_words(name);
            file.plated = plating(gerber);
            (file.role, file.side, file.reason) = (role, side, reason);
            holes(file);
            rows.push(Row {
                index,
                ground,
                unsure,
                is_disputed,
                is_numbered_otherwise,
                number,
                stem,
                one_board,
                shape: None,
                contradiction: None,
                is_drawn_otherwise: false,
            });
        }
        measured(layers, &mut rows, &of, holes_of);
        content::reclassify(layers, &mut rows);
        numbered(layers, &mut rows);
        rivals(layers, &rows);
        orphans::settle(layers, &mut rows);
        orphans::report_contradictions(layers, &rows);
        orphans::report_unused_copper(layers, &rows);
        orphans::report_disputed_sides(layers, &rows);
        outline(layers, &members);
    }
    orphans::shorten_names(layers);
}

fn is_within(folder: &str, of: &str) -> bool {
    let rest = folder.strip_prefix(of);
    rest.is_some_and(|rest| of.is_empty() || rest.is_empty() || rest.starts_with(['/', '\\', '!']))
}

/// True if the names of drill files, as words of their boards, allow one board.
fn is_one_board(stems: Vec<Vec<String>>) -> bool {
    let named: Vec<Vec<String>> = stems.into_iter().filter(|stem| !stem.is_empty()).collect();
    named.iter().all(|stem| named.iter().all(|other| stem.iter().zip(other).all(|(a, b)| a == b)))
}

/// Length of the common prefix of all names, up to the end of a word; 0 if the names are equal or have
/// nothing else.
fn common_front<'n>(mut names: impl Iterator<Item = &'n str>) -> usize {
    let Some(first) = names.next() else { return 0 };
    let (mut same, mut others) = (first.len(), 0);
    for name in names {
        let equal = first.bytes().zip(name.bytes()).take_while(|(a, b)| a.eq_ignore_ascii_case(b)).count();
        same = same.min(equal);
        others += 1;
    }
    let front = first.get(..same).unwrap_or_default();
    let end = front.rfind(|letter: char| !letter.is_alphanumeric()).map_or(0, |at| at + 1);
    if others == 0 { 0 } else { end }
}

/// A name without its first `common` bytes, unless nothing remains.
fn own(name: &str, common: usize) -> &str {
    let rest = name.get(common..).unwrap_or(name);
    let stem = rest.rsplit_once('.').map_or(rest, |(stem, _)| stem);
    if stem.is_empty() { name } else { rest }
}

/// The number of names in a folder that each CAD would write. A layer that names this CAD as its generator
/// counts three times.
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

/// Sides by number: the lowest number of the copper is the top, the highest the bottom. The lowest is the top
/// only if it is 0 or 1, or if every lower number belongs to a layer whose drawing isn't copper.
fn numbered(layers: &mut [Option<FileRead>], rows: &mut [Row]) {
    let copper = |layers: &[Option<FileRead>], row: &Row| {
        layers
            .get(row.index)
            .and_then(Option::as_ref)
            .filter(|file| file.role == Role::Copper)
            .map(|file| file.side)
    };
    let numbers = rows.iter().filter(|row| copper(layers, row).is_some()).filter_map(|row| row.number);
    let numbers: Vec<u32> = numbers.collect();
    let (Some(&first), Some(&last)) = (numbers.iter().min(), numbers.iter().max()) else { return };
    let is_dropped = |number| rows.iter().any(|row| row.is_drawn_otherwise && row.number == Some(number));
    let has_first = first < 2 || (1..first).all(is_dropped);
    let has = |row: &Row, side: Side| {
        rows.iter().any(|other| other.is_kin(row) && copper(layers, other) == Some(Some(side)))
    };
    let sides: Vec<_> = rows.iter().map(|row| (has(row, Side::Top), has(row, Side::Bottom))).collect();
    for (row, (has_top, has_bottom)) in rows.iter_mut().zip(sides) {
        let (Some(None), Some(number)) = (copper(layers, row), row.number) else { continue };
        let side = match number {
            number if has_first && number == first => Side::Top,
            number if number == last && (has_first || has_top) && !has_bottom => Side::Bottom,
            _ => Side::Inner,
        };
        // Without the first layer, the last one can also be an inner layer.
        row.unsure |= number == 0 || side == Side::Bottom && !has_first;
        if let Some(file) = layers.get_mut(row.index).and_then(Option::as_mut) {
            file.side = Some(side);
        }
    }
}

/// Measures the layers of a folder if shapes must decide: two layers for one side, an unknown layer, or an
/// unknown side.
fn measured(layers: &[Option<FileRead>], rows: &mut [Row], of: &str, holes_of: &mut Holes<'_>) {
    let file = |index: usize| layers.get(index)?.as_ref();
    let sides = |side: Side| {
        let of_side = |row: &&Row| {
            file(row.index).is_some_and(|file| (file.role, file.side) == (Role::Copper, Some(side)))
        };
        rows.iter().filter(of_side).count()
    };
    let open = |row: &&Row| {
        let Some(file) = file(row.index) else { return false };
        let is_unknown = file.role == Role::Other && row.ground == Ground::Nothing;
        let is_weak = row.ground <= Ground::Words || row.unsure;
        is_unknown || file.role == Role::Copper && (file.side.is_none() || is_weak)
    };
    let is_misread = |row: &Row| {
        let other = file(row.index).filter(|_| row.ground < Ground::Attribute);
        let other = other.filter(|file| file.role != Role::Copper);
        other.and_then(|file| file.gerber.as_ref()).is_some_and(has_links)
    };
    // Copper of pads alone, under a certain name, may be a mask.
    let is_pads = |row: &Row| {
        let copper =
            file(row.index).filter(|file| row.ground < Ground::Attribute && file.role == Role::Copper);
        copper
            .and_then(|file| file.gerber.as_ref())
            .is_some_and(|layer| layer.counts.flashes > 0 && layer.counts.flashes == layer.counts.total())
    };
    let is_asked = sides(Side::Top) > 1
        || sides(Side::Bottom) > 1
        || rows.iter().any(|row| open(&row))
        || sides(Side::Top) + sides(Side::Bottom) == 0
        || rows.iter().any(|row| is_misread(row) || is_pads(row));
    if !is_asked {
        return;
    }
    let may_be =
        |row: &&Row| file(row.index).is_some_and(|file| matches!(file.role, Role::Copper | Role::Other));
    let candidates: Vec<(&str, &Gerber)> = rows
        .iter()
        .filter(may_be)
        .filter_map(|row| Some((file(row.index)?.name.as_str(), file(row.index)?.gerber.as_ref()?)))
        .collect();
    let mut holes = holes_of(of, &candidates);
    let drilled = rows.iter().filter_map(|row| file(row.index)?.drill.as_ref());
    holes.extend(drilled.flat_map(|drill| drill.centres().map(|(at, _)| at)));
    for row in rows {
        let layer = file(row.index).and_then(|file| Some((file.name.as_str(), file.gerber.as_ref()?)));
        row.shape = layer.map(|(name, layer)| Shape::of(name, layer, &holes));
    }
}

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
    file.diagnostics.extend(drill_format::faults(&file.name, &drill, units));
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

/// Of several copper layers for one side, keeps the one with the best evidence, then the one drawn like
/// copper. Keeps and reports all that are still equal.
fn rivals(layers: &mut [Option<FileRead>], rows: &[Row]) {
    for side in [Side::Top, Side::Bottom] {
        let of_side = |row: &&Row| {
            let file = layers.get(row.index).and_then(Option::as_ref);
            file.is_some_and(|file| (file.role, file.side) == (Role::Copper, Some(side)))
        };
        let all: Vec<&Row> = rows.iter().filter(of_side).collect();
        for row in &all {
            // Layers named for another board don't compete.
            let kin: Vec<&Row> = all.iter().copied().filter(|other| row.is_kin(other)).collect();
            let Some(best) = kin.iter().map(|row| rank(row, &kin)).max().filter(|_| kin.len() > 1) else {
                continue;
            };
            let won = kin.iter().filter(|row| rank(row, &kin) == best);
            let shape = won.clone().next().and_then(|row| row.shape.as_ref());
            let winners = won.count();
            let Some(file) = layers.get_mut(row.index).and_then(Option::as_mut) else { continue };
            if rank(row, &kin) < best {
                orphans::lost(file, row, shape);
            } else if winners > 1 {
                file.diagnostics.push(warning!("set.two_layers").at(&file.name, 0, 0));
            }
        }
    }
}

/// Rank of a layer among those for the same side: by source, then by shape. Strokes from pad to pad mean
/// copper; of pads-only layers, the one with the smaller pads is copper.
fn rank(row: &Row, kin: &[&Row]) -> (Ground, u8, Ground) {
    let Some(shape) = &row.shape else { return (row.ground, 0, row.ground) };
    let covered = |of: &dyn Fn(&Shape) -> bool| {
        kin.iter().filter_map(|other| other.shape.as_ref()).any(|other| of(other) && shape.covers(other))
    };
    if row.ground <= Ground::Names && covered(&|other| other.joined) {
        return (Ground::Nothing, 0, row.ground);
    }
    let is_mask = covered(&|_| true);
    let drawn = if shape.joined { 2 } else { u8::from(shape.has_pads() && !is_mask) };
    // A side from a name is no better than a word.
    (if row.ground == Ground::Words { Ground::Side } else { row.ground }, drawn, row.ground)
}

/// Without an outline: takes the only unknown layer that has just strokes, around all copper.
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
        file.reason = note!("kind.gerber_outline_shape").with("found", base(&file.name));
    }
}

fn joined(a: Bounds, b: Bounds) -> Bounds {
    a.with(b.min).with(b.max)
}
