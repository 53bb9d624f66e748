//! Inner contours, and tabs that hold the cut-out board.
//!
//! ```text
//!   ┄┄┄┄┄╳━━━━╳┄┄┄┄┄    path of the tool centre; a tab is an uncut part ━ of it, and is measured there
//!   ┌──────────────┐
//!   │   ╭┄┄┄┄╮     │    an inner contour: all of its edge that the tool can reach must be cut
//! ```

use super::body::along;
use super::deep::{Deep, Swept};
use super::edges::{Spot, spots};
use super::sides::{DrillingProof, Layer};
use crate::board::Board;
use crate::geometry::{Path, Region, grow};
use crate::job::{Asked, AskedEdge, Bit, Cutter};
use crate::units::Length;

const STEP_MM: f64 = 0.1;
/// Tolerance for digits of files and chords of arcs, in mm.
const SLACK_MM: f64 = 0.03;
const REACHED_SHARE: f64 = 0.95;
/// With at least this share of an inner contour out of the tool's reach, another tool makes it.
const OTHERWISE_SHARE: f64 = 0.3;
/// A contour with at least this share cut is meant to be cut out.
const MEANT_SHARE: f64 = 0.5;
/// Tolerance of a tab's width, as share and in mm: chords and steps.
const NARROWER: (f64, f64) = (0.1, 0.15);

/// Reports inner contours that are not cut, and outer contours with too few tabs.
pub(super) fn held(layers: &[Layer<'_>], asked: &Asked, out: &mut DrillingProof) {
    let nobody_says = asked.holes.is_none();
    if asked.cut_out.is_some() || nobody_says && out.edges_cut > 0 {
        inner(layers, asked, out);
    }
    let through = asked.cut_out.is_none_or(|edge| edge.depth >= asked.thickness);
    if (asked.cut_out.is_some() || nobody_says) && through {
        for layer in layers {
            tabs(layer, asked, out);
        }
    }
}

/// The path of the tool centre for this tool diameter: outside the board and inside its inner contours.
fn middle(board: &Board, asked: &Asked, bit: Length) -> Region {
    let on_line = asked.cut_out.is_some_and(|edge| edge.on_line);
    if on_line { board.outline.clone() } else { grow(&board.outline, Length::from_nm(bit.nm() / 2)) }
}

/// The tool that cuts out the board: from the job, else the widest mill that cuts through.
fn bit(layer: &Layer<'_>, asked: &Asked) -> Length {
    let mills =
        layer.legs.iter().filter(|leg| leg.bit.cutter == Cutter::Mill && leg.lowest >= asked.thickness);
    let widest = || mills.map(|leg| leg.bit.diameter).max();
    asked.cut_out.map(|edge| edge.bit).filter(|bit| *bit > Length::ZERO).or_else(widest).unwrap_or_default()
}

fn inner(layers: &[Layer<'_>], asked: &Asked, out: &mut DrillingProof) {
    let contours = |layer: &Layer<'_>| -> Vec<Path> {
        layer.board.outline.islands.iter().flat_map(|island| island.holes.iter().cloned()).collect()
    };
    let Some(first) = layers.first().map(contours).filter(|first| !first.is_empty()) else { return };
    let zones = asked.cut_out.is_some_and(|edge| edge.zones);
    let depth = asked.cut_out.map_or(asked.thickness, |edge| edge.depth);
    let mut is_cut = vec![false; first.len()];
    for layer in layers {
        let swept = Swept::of(layer.legs.iter());
        let width = bit(layer, asked);
        let made =
            Bit { diameter: width, name: String::new(), cutter: Cutter::Mill, handling: Default::default() };
        let way = middle(layer.board, asked, width);
        let paths = way.islands.iter().flat_map(|island| &island.holes);
        let stretches = paths.flat_map(|path| {
            let places = spots(path);
            let pairs = places.iter().zip(places.iter().skip(1));
            pairs.map(|(from, to)| (*from, *to, asked.thickness)).collect::<Vec<_>>()
        });
        let leg = Deep { bit: &made, lowest: asked.thickness, stretches: stretches.collect(), round: None };
        let reach = Swept::of([&leg].into_iter());
        for (is_cut, path) in is_cut.iter_mut().zip(contours(layer)) {
            let places = along(&spots(&path), STEP_MM);
            let within: Vec<&Spot> =
                places.iter().filter(|spot| reach.cover(**spot, SLACK_MM, Length::ZERO)).collect();
            let cut = |spot: &&&Spot| swept.cover(***spot, 2.0 * SLACK_MM, depth);
            let all: Vec<&Spot> = places.iter().collect();
            let (asked_for, least) = match (zones, within.is_empty()) {
                (true, _) => (&all, 0.0),
                (false, true) => (&all, OTHERWISE_SHARE),
                (false, false) => (&within, REACHED_SHARE),
            };
            let done = asked_for.iter().filter(cut).count() as f64;
            *is_cut |= done > 0.0 && done >= least * asked_for.len() as f64;
        }
    }
    let missing = first.iter().zip(is_cut).filter(|(_, is_cut)| !is_cut);
    out.inner_missing.extend(missing.map(|(path, _)| path.start));
}

/// Checks the uncut parts along the outer contours of a side.
fn tabs(layer: &Layer<'_>, asked: &Asked, out: &mut DrillingProof) {
    let mills = layer.legs.iter().filter(|leg| leg.bit.cutter == Cutter::Mill);
    let swept = Swept::of(mills);
    let (mut together, mut first) = (0, None);
    for island in &middle(layer.board, asked, bit(layer, asked)).islands {
        let places = along(&spots(&island.outer), STEP_MM);
        let left: Vec<bool> =
            places.iter().map(|spot| !swept.cover(*spot, SLACK_MM, asked.thickness)).collect();
        let cut = left.iter().filter(|left| !**left).count() as f64;
        let Some(place) = places.first().filter(|_| cut > 0.0 && cut >= MEANT_SHARE * left.len() as f64)
        else {
            continue;
        };
        let runs = runs(&left);
        if runs.is_empty() {
            out.loose.push(place.point());
        }
        let count = asked.cut_out.map_or(0, |edge| count(&runs, &edge));
        let Some(edge) = asked.cut_out.filter(|edge| !edge.zones) else { continue };
        together += count;
        first = first.or(Some(place.point()));
        if !edge.tabs_together && count < edge.tabs {
            out.tabs_missing.push(place.point());
        }
    }
    if let (Some(edge), Some(place)) = (asked.cut_out.filter(|edge| edge.tabs_together), first)
        && together < edge.tabs
    {
        out.tabs_missing.push(place);
    }
}

/// Number of tabs of the required width in these runs; tabs placed side by side by the user are one run.
fn count(runs: &[f64], edge: &AskedEdge) -> u32 {
    let wide = edge.tab_width.mm();
    let least = wide * (1.0 - NARROWER.0) - NARROWER.1;
    let tabs = |run: &f64| match (*run >= least.max(STEP_MM), edge.tabs_together && wide > 0.0) {
        (false, _) => 0,
        (true, true) => ((run + NARROWER.1) / wide).max(1.0) as u32,
        (true, false) => 1,
    };
    runs.iter().map(tabs).sum()
}

/// Lengths of the uncut runs along a closed path, in mm.
fn runs(left: &[bool]) -> Vec<f64> {
    let Some(start) = left.iter().position(|left| !left) else { return Vec::new() };
    let (mut runs, mut now) = (Vec::new(), 0_u32);
    let round = left.iter().cycle().skip(start).take(left.len() + 1);
    for left in round {
        if *left {
            now += 1;
        } else if now > 0 {
            runs.push(f64::from(now) * STEP_MM);
            now = 0;
        }
    }
    runs
}
