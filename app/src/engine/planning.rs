//! Plans a job; unchanged operations come from the cache. Also carves the side that was made before, as seen
//! on the underside.
//!
//! ```text
//! board ─ placed for the job ─▶ scene ─┬─ operation 1   key known: from the cache
//!                                      ├─ operation 2   else planned
//!                                      └─ … ─▶ assemble ─▶ lower ─▶ program
//!
//!   side before ─ plan ─▶ cuts ─▶ stock as it was then ─ flipped ─▶ tiles of depths from below
//! ```

use super::cache::{Cache, Last};
use super::mesh::layers;
use super::messages::{Laid, PlanReady, PlannedBit, ToPlan, ToUnderside, UnderTile};
use crate::picture;
use annulus_core::board::{Board, Face};
use annulus_core::cam::figures::figures;
use annulus_core::cam::toolpaths::{self, DrillCycle, Means, PlacedBoard, PlannedOperation};
use annulus_core::cam::work::{Flip, Operation, Work};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::{Bounds, Point};
use annulus_core::job::Program;
use annulus_core::machine::Machine;
use annulus_core::sim::{self, Stock};
use annulus_core::units::Length;
use annulus_core::wire::program;
use annulus_core::{cam, motion, proof};
use std::collections::BTreeSet;

pub(super) struct Side {
    pub(super) planned: toolpaths::Planned,
    pub(super) program: Program,
    pub(super) diagnostics: Vec<Diagnostic>,
    /// Areas that tools must avoid, on the placed board.
    zones: Vec<Bounds>,
    pub(super) laid_key: String,
}

pub(super) fn side(
    wanted: &ToPlan,
    cache: &mut Cache,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Side, Vec<Diagnostic>> {
    let machine = wanted.machine.machine()?;
    let work = &wanted.work;
    refuse_too_large(cache.board(wanted.board_key)?, &[])?;
    let scene = PlacedBoard::of(cache.board(wanted.board_key)?, work).remembering(cache.take_kept());
    let options = cam::PlanOptions {
        group: if wanted.loaded.is_some() { cam::BitOrder::LoadedFirst } else { cam::BitOrder::Ascending },
        loaded: wanted.loaded,
        accept: wanted.accept.clone(),
        lost: cache.lost(),
        ..cam::PlanOptions::default()
    };
    let rapid_time = |from, to| motion::rapid_time_s(&machine, from, to);
    let means = Means { options: &options, rapid_time: &rapid_time };
    let parts = parts(wanted, cache, (&scene, &machine, &means), progress);
    cache.keep_kept(scene.kept());
    let parts = parts?;
    let zones = scene.zones().to_vec();
    let (planned, diagnostics) = toolpaths::assemble(scene, work, &machine, &means, parts)?;
    let program = toolpaths::lower_work(&planned, work, &machine);
    Ok(Side { planned, program, diagnostics, zones, laid_key: laid_key(wanted.board_key, work) })
}

/// The side's operations, from the cache where unchanged.
fn parts(
    wanted: &ToPlan,
    cache: &mut Cache,
    (scene, machine, means): (&PlacedBoard, &Machine, &Means<'_>),
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Vec<PlannedOperation>, Vec<Diagnostic>> {
    let work = &wanted.work;
    let operations: Vec<usize> = toolpaths::planned_operations(work).map(|(index, _)| index).collect();
    let mut parts = Vec::new();
    for (done, &index) in operations.iter().enumerate() {
        let (before, total) = (done as u64 * toolpaths::WHOLE, operations.len() as u64 * toolpaths::WHOLE);
        progress(before, total);
        let mut tick = |part: u64| {
            progress(before + part, total);
            true
        };
        let key = format!("{}|{:?}", toolpaths::key(work, index, machine), wanted.loaded);
        let known = cache.part(&key).map(|part| PlannedOperation { operation: index as u32, ..part });
        let part = match known {
            Some(part) => part,
            None => {
                cache.makes_part();
                let made = toolpaths::plan_operation(scene, work, index, machine, means, &mut tick);
                made.map_err(|why| vec![why])?
            }
        };
        cache.keep_part(key, part.clone(), operations.len());
        parts.push(part);
    }
    Ok(parts)
}

pub(super) fn plan(
    wanted: &ToPlan,
    cache: &mut Cache,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<PlanReady, Vec<Diagnostic>> {
    let machine = wanted.machine.machine()?;
    let work = &wanted.work;
    let Side { planned, program, diagnostics, zones, laid_key } = side(wanted, cache, progress)?;
    let made = program::encode(&program);
    let (titles, key) = (work.operations.iter().map(Operation::title).collect(), program::key(&made));
    let laid = (wanted.laid.as_ref() != Some(&laid_key)).then(|| laid(&planned.board, work, cache));
    let bits = bits(&planned.parts, &planned.board);
    let figures = figures(&planned, &|from, to| motion::rapid_time_s(&machine, from, to));
    let toolpath_operations = planned.parts.iter().flat_map(|part| {
        let count: usize = part.tasks.iter().map(|task| task.toolpaths.len()).sum();
        std::iter::repeat_n(part.operation as u16, count)
    });
    let answer = PlanReady {
        origin: planned.origin,
        zones,
        toolpath_operations: toolpath_operations.collect(),
        bits,
        laid_key: laid_key.clone(),
        laid,
        key: key.clone(),
        program: made,
        diagnostics,
        travel_before_mm: figures.travel_before_mm,
        travel_after_mm: figures.travel_after_mm,
        hop_time_before_s: figures.hop_time_before_s,
        hop_time_after_s: figures.hop_time_after_s,
    };
    cache.keep_last(Last { planned, titles, program: key, laid_key });
    Ok(answer)
}

/// Key of the placement: equal keys mean equally placed boards.
fn laid_key(board_key: u32, work: &Work) -> String {
    format!("{board_key} {}", serde_json::to_string(&work.setup).unwrap_or_default())
}

fn laid(board: &Board, work: &Work, cache: &Cache) -> Laid {
    let panel = work.setup.panel;
    let turned = work.setup.face == Face::Bottom || panel.columns > 1 || panel.rows > 1;
    let body = picture::body(board);
    let layers = cache.copper(board, body).unwrap_or_else(|| layers(board, body));
    Laid { turned, board: board.without_areas(), body, layers }
}

fn bits(parts: &[PlannedOperation], board: &Board) -> Vec<PlannedBit> {
    let mut bits: Vec<PlannedBit> = Vec::new();
    for task in parts.iter().flat_map(|part| &part.tasks) {
        let holes: Vec<u32> =
            task.drill_cycles.iter().filter_map(|stroke: &DrillCycle| stroke.hole).collect();
        if holes.is_empty() {
            continue;
        }
        let size = |hole: &u32| board.holes.get(*hole as usize).and_then(|hole| hole.diameter);
        let sizes: BTreeSet<Length> = holes.iter().filter_map(size).collect();
        bits.push(PlannedBit { diameter: task.bit.diameter, sizes: sizes.into_iter().collect(), holes });
    }
    bits
}

/// Refuses a board whose proof needs more memory than a worker may have, because the worker would crash.
pub(super) fn refuse_too_large(board: &Board, programs: &[Program]) -> Result<(), Vec<Diagnostic>> {
    proof::too_large(board, programs).map_or(Ok(()), |why| Err(vec![why]))
}

/// The cuts from below when the current side starts; empty for the first side.
pub(super) fn underside(wanted: &ToUnderside, cache: &mut Cache) -> Result<Vec<UnderTile>, Vec<Diagnostic>> {
    let work = &wanted.plan.work;
    let scene = PlacedBoard::of(cache.board(wanted.plan.board_key)?, work);
    let before = work.faces().into_iter().next().filter(|face| *face != work.setup.face);
    let (Some(before), Some(turning)) = (before, scene.turning()) else { return Ok(Vec::new()) };
    let mut plan: ToPlan = wanted.plan.clone();
    plan.work.setup.face = before;
    let side = side(&plan, cache, &mut |_, _| {})?;
    let origin = side.program.origin;
    let as_it_lay = |at: Point| {
        let at = turning.point(Point::new(at.x + scene.origin.x, at.y + scene.origin.y));
        Point::new(at.x - origin.x, at.y - origin.y)
    };
    let bounds = Bounds::of(as_it_lay(wanted.bounds.min)).with(as_it_lay(wanted.bounds.max));
    let thickness = plan.machine.machine()?.process.board_thickness;
    let uncut = Stock::new(bounds, thickness).map_err(|why| vec![why])?;
    let mut stock = work.point_deg().into_iter().fold(uncut, Stock::with_points);
    for cut in sim::cuts(&side.program) {
        if let Some(bit) = side.program.bits.get(cut.bit as usize) {
            stock.carve(&cut.way, bit, 0.0, 1.0);
        }
    }
    let turned = stock.flipped(work.setup.flip == Flip::LeftRight, wanted.bounds.min);
    let tiles = turned.tiles().filter_map(|tile| {
        let first = tile.first.map(|cell| cell as u32);
        Some(UnderTile { first, depths_um: tile.depths_um?.to_vec() })
    });
    Ok(tiles.collect())
}
