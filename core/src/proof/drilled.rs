//! Compares the holes that programs make with those of the board: missing, doubled, shifted, wrong size, not
//! through.
//!
//! ```text
//!    ◯ board    ● program      ◉ made      ◯  missing      ◉● twice      ◯ ● shifted
//! ```
//!
//! Pins are no error. `extra` reports holes where the board has none.

use super::body::Body;
use super::deep::Deep;
use super::extra::extra_holes;
use super::sides::{BESIDE_MM, DrillingProof, Layer, Places, SideRun};
use super::{cut_out, held, outside, repeated, slots};
use crate::geometry::Point;
use crate::job::{Asked, Bit, Cutter};
use crate::units::Length;
use std::collections::{BTreeMap, BTreeSet};

/// Sizes and depths within this, in mm, are equal: digits of files.
const EQUAL_MM: f64 = 0.01;

/// A leg that makes a hole of the right size.
struct Fit {
    tool: Tool,
    /// Diameter in steps of [`EQUAL_MM`].
    steps: i64,
    depth: Length,
}

#[derive(Default)]
struct Done {
    fits: Vec<Fit>,
    /// Something narrower is made there, or with a V-bit, for instance inner rings of a milled hole.
    narrower: bool,
    wider: bool,
}

/// Equal for equal tools: the cutter and its diameter in nm.
type Tool = (u8, i64);

/// The cutter type of a drill.
const DRILL: u8 = 0;

fn tool(bit: &Bit) -> Tool {
    let form = match bit.cutter {
        Cutter::Drill => DRILL,
        Cutter::Mill => 1,
        Cutter::Vee { .. } => 2,
    };
    (form, bit.diameter.nm())
}

/// Compares holes, slots and the edge of boards with their programs.
pub fn drilled(sides: &[SideRun<'_>], asked: &Asked) -> DrillingProof {
    let layers: Vec<Layer<'_>> = sides.iter().map(|side| Layer::of(side, asked)).collect();
    let repeated = sides.iter().map(|side| repeated::repeated(side.programs)).sum();
    let cuts = layers.iter().any(|layer| layer.cuts);
    let mut out = DrillingProof { repeated, cuts, ..DrillingProof::default() };
    let (any, judged) = holes(&layers, asked, &mut out);
    slots::slots(&layers, (asked, any), &mut out);
    cut_out::cut_out(&layers, asked, &mut out);
    let extra = layers.iter().zip(&judged).flat_map(|(layer, judged)| extra_holes(layer, judged, asked));
    out.bitten.extend(extra);
    held::held(&layers, asked, &mut out);
    if out.made == 0 && out.edges_cut == 0 {
        out.outside = outside::outside(sides, &layers);
    }
    out
}

/// Compares the holes. Returns whether any is made, and for each side the numbers of the legs that make a
/// hole.
fn holes(layers: &[Layer<'_>], asked: &Asked, out: &mut DrillingProof) -> (bool, Vec<BTreeSet<usize>>) {
    let Some(first) = layers.first() else { return (false, Vec::new()) };
    let drills = |leg: &Deep<'_>| leg.bit.cutter == Cutter::Drill && leg.round.is_some();
    let mut any = layers.iter().flat_map(|layer| &layer.legs).any(drills);
    let mut taken: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); layers.len()];
    let own = Places::of(first.board.holes.iter().map(|hole| Some(hole.at)));
    let (mut open, mut pins_begun) = (Vec::new(), false);
    for (number, hole) in first.board.holes.iter().enumerate() {
        let Some(wide) = hole.diameter else { continue };
        let mates =
            || own.near(hole.at).filter_map(|other| Some((other, first.board.holes.get(other)?.diameter?)));
        // Some files list holes twice.
        if mates().any(|(other, size)| other < number && size == wide) {
            continue;
        }
        let sizes: Vec<Length> = mates().map(|(_, size)| size).collect();
        let mut done = Done::default();
        for (layer, taken) in layers.iter().zip(&mut taken) {
            let Some(at) = layer.board.holes.get(number).map(|hole| hole.at) else { continue };
            for index in layer.rounds.near(at) {
                taken.insert(index);
                if let Some(leg) = layer.legs.get(index) {
                    done.look(leg, (wide, &sizes), &layer.body, asked);
                }
            }
        }
        any |= !done.fits.is_empty();
        pins_begun |= !done.fits.is_empty() && first.pins.contains(&(number as u32));
        if done.judge(hole.at, asked, out) {
            out.made += 1;
        } else {
            open.push((number, hole.at));
        }
    }
    any |= open.iter().any(|(number, _)| layers.iter().any(|layer| is_meant_for(layer, *number)));
    // Without a job, pins are optional; but if one of them is made, the others must be as well.
    let pins = asked.pins || asked.holes.is_none() && pins_begun;
    for (number, at) in open {
        let pin = first.pins.contains(&(number as u32));
        if !(if pin { pins } else { asked.holes.unwrap_or(any) }) {
            out.holes_left.extend((!pin && asked.holes.is_none()).then_some(at));
            continue;
        }
        let mut beside = layers.iter().zip(&mut taken);
        let beside = beside.any(|(layer, taken)| take_beside(layer, number, taken));
        if beside { out.shifted.push(at) } else { out.missing.push(at) }
    }
    (any, taken)
}

impl Done {
    /// Records a leg at a hole of this width; `sizes` are those of all holes at this position.
    fn look(&mut self, leg: &Deep<'_>, (wide, sizes): (Length, &[Length]), body: &Body, asked: &Asked) {
        let Some(round) = leg.round else { return };
        let vee = matches!(leg.bit.cutter, Cutter::Vee { .. });
        let fits = |size: &Length| {
            !vee && libm::fabs(round.wide_mm - size.mm()) <= asked.tolerance.mm() + EQUAL_MM / 2.0
        };
        if fits(&wide) {
            let steps = libm::round(round.wide_mm / EQUAL_MM) as i64;
            self.fits.push(Fit { tool: tool(leg.bit), steps, depth: leg.lowest });
        } else if !sizes.iter().any(fits) {
            let widest = sizes.iter().max().copied().unwrap_or(wide);
            if vee || round.wide_mm < widest.mm() {
                self.narrower = true;
            } else if round.stroke || body.is_bitten(leg) {
                self.wider |= wide == widest;
            }
        }
    }

    /// Reports a hole at `at` according to the recorded legs. True if anything was made.
    fn judge(&self, at: Point, asked: &Asked, out: &mut DrillingProof) -> bool {
        if self.wider || (self.fits.is_empty() && self.narrower) {
            out.wrong_size.push(at);
            return true;
        }
        let Some(deepest) = self.fits.iter().max_by_key(|fit| fit.depth) else { return false };
        let least = if deepest.tool.0 == DRILL { asked.drilled } else { asked.milled };
        if (least - deepest.depth).mm() > EQUAL_MM {
            out.shallow.push(at);
        }
        let mut times: BTreeMap<(Tool, i64), u32> = BTreeMap::new();
        for fit in self.fits.iter().filter(|fit| (deepest.depth - fit.depth).mm() <= EQUAL_MM) {
            *times.entry((fit.tool, fit.steps)).or_default() += 1;
        }
        if times.values().any(|times| *times > 1) {
            out.doubled.push(at);
        }
        true
    }
}

/// True if a mill moves around a point next to the hole's centre: the path is meant for the hole, but misses
/// it.
fn is_meant_for(layer: &Layer<'_>, hole: usize) -> bool {
    beside(layer, hole).any(|(index, _)| {
        let leg = layer.legs.get(index).filter(|leg| leg.bit.cutter == Cutter::Mill);
        leg.is_some_and(|leg| layer.body.is_bitten(leg))
    })
}

/// Takes the nearest unassigned hole made next to a hole's position, if any.
fn take_beside(layer: &Layer<'_>, hole: usize, taken: &mut BTreeSet<usize>) -> bool {
    let free = beside(layer, hole).filter(|(index, _)| !taken.contains(index));
    let nearest = free.min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    nearest.is_some_and(|(index, _)| taken.insert(index))
}

/// The round legs that may be meant for a hole, with their distance in mm.
fn beside<'l>(layer: &'l Layer<'_>, hole: usize) -> impl Iterator<Item = (usize, f64)> + 'l {
    let hole = layer.board.holes.get(hole);
    let reach = hole.and_then(|hole| hole.diameter).map_or(0.0, Length::mm).max(BESIDE_MM);
    let at = hole.map(|hole| hole.at).unwrap_or_default();
    let first = layer.by_x.partition_point(|(x, _)| (at.x - *x).mm() > reach);
    let near = layer.by_x.iter().skip(first).take_while(move |(x, _)| (*x - at.x).mm() <= reach);
    near.filter_map(move |(_, index)| {
        let round = layer.legs.get(*index)?.round.filter(|round| round.wide_mm <= 2.0 * reach)?;
        Some((*index, round.at.distance_mm(at))).filter(|(_, distance)| *distance <= reach)
    })
}
