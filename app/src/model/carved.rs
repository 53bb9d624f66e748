//! The board in space while it is played: made where it is looked at, carved frame by frame to the second on show.
//!
//! ```text
//! plan, program, box ─▶ Carving ── a frame's work ──▶ carved: the stock on show        behind? ─▶ one more frame
//! ```
//!
//! Comes in: the plan in time and the open board. Goes out: the stock on show, what is wrong and when. A frame does so many
//! cells and no more, so that the page never waits. Does not know how it is drawn.

use super::Model;
use annulus_core::cam::work::{OperationKind, Work};
use annulus_core::geometry::{Bounds, Point};
use annulus_core::job::{Program, touched};
use annulus_core::machine::Machine;
use annulus_core::sim::{self, Carving, Stock, Warning};
use annulus_core::units::Length;
use std::sync::Arc;

/// So many cells are looked at in a frame.
const FRAME_CELLS: u64 = 300_000;
/// A blank is so much larger than what is cut of it.
const RIM: Length = Length::from_um(1_500);
/// Deeper than this under the board the tip is in more than a spoil board.
const SPOIL: Length = Length::from_um(3_000);
/// Drills whose job says nothing of their points are flat.
const FLAT_DEG: f64 = 180.0;

/// Carves up to the second `at_s`, as far as one frame goes; the stock as it is then is `shown`.
pub(super) fn carve(carving: &mut Carving, at_s: f64, shown: &mut Option<Arc<Stock>>) {
    carving.seek(at_s, FRAME_CELLS);
    if shown.as_deref() != Some(carving.stock()) {
        *shown = Some(Arc::new(carving.stock().clone()));
    }
}

/// Whether the board in space shows another second than `at_s`.
pub(super) fn is_behind(carving: &Carving, at_s: f64) -> bool {
    (carving.at_s() - at_s).abs() > 1e-9
}

/// The uncut board, where there is a plan and what is played of it.
pub(super) fn begin(model: &Model) -> Option<Carving> {
    let (program, playback) = (model.board.program.as_ref()?, model.play.playback.as_ref()?);
    let body = model.board.laid.as_ref().and_then(|laid| laid.laid.body);
    let stock = Stock::new(blank(program, body)?, model.machine.process.board_thickness).ok()?;
    let stock = stock.with_points(point_deg(model.job.work.as_deref()));
    Some(Carving::new(Arc::clone(playback), program.bits.clone(), stock))
}

/// What is wrong in the playback.
pub(super) fn warned(model: &Model) -> Arc<Vec<Warning>> {
    let (Some(program), Some(playback)) = (&model.board.program, &model.play.playback) else {
        return Arc::default();
    };
    let deepest = model.machine.process.board_thickness + SPOIL;
    let travel = travel(program, &model.machine);
    Arc::new(sim::warnings(playback, &program.bits, travel, deepest))
}

/// The box that is shown, in work coordinates: the board and all that is cut.
fn blank(program: &Program, body: Option<Bounds>) -> Option<Bounds> {
    let origin = program.origin;
    let moved = |at: Point| Point::new(at.x - origin.x, at.y - origin.y);
    let body = body.map(|body| Bounds { min: moved(body.min), max: moved(body.max) });
    let cut = touched(program);
    let all = body.into_iter().chain(cut).reduce(|a, b| a.with(b.min).with(b.max))?;
    // What is cut round its edge is cut out of something larger.
    Some(if body == Some(all) { all } else { all.grown(RIM) })
}

/// Where the head can go in work coordinates, with the work zero where it leaves the program the most room.
fn travel(program: &Program, machine: &Machine) -> Option<Bounds> {
    let reach = sim::reach(program)?;
    let low = Point::new(reach.min.x.min(Length::ZERO), reach.min.y.min(Length::ZERO));
    let high = Point::new(low.x + machine.x.max - machine.x.min, low.y + machine.y.max - machine.y.min);
    Some(Bounds { min: low, max: high })
}

/// The angle of the drills' points, as the job says it.
fn point_deg(work: Option<&Work>) -> f64 {
    let operations = work.iter().flat_map(|work| &work.operations);
    let mut angles = operations.filter(|operation| operation.on).filter_map(|one| match &one.action {
        OperationKind::Drill(drill) => Some(drill.point_deg),
        _ => None,
    });
    angles.next().unwrap_or(FLAT_DEG)
}
