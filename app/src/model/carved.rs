//! The board in space while it is played: made where it is looked at, carved frame by frame to the second on show.
//!
//! ```text
//! plan, program, box ─▶ Carving ── a frame's work ──▶ carved: the stock on show        behind? ─▶ one more frame
//! ```
//!
//! Comes in: the plan in time and the open board. Goes out: the stock on show, what is wrong and when. A frame does so many
//! cells and no more, so that the page never waits; frames in which nothing is to be shown carve ahead. Does not know how it is
//! drawn.

use super::Model;
use annulus_core::board;
use annulus_core::geometry::{Bounds, Point};
use annulus_core::job::{Program, touched};
use annulus_core::machine::Machine;
use annulus_core::sim::{self, Carving, Stock, ToolRoom, Warning};
use annulus_core::units::Length;
use std::sync::Arc;

/// So many cells are looked at in a frame.
const FRAME_CELLS: u64 = 300_000;
/// In one in which nothing is to be shown: nobody waits, and nobody shall notice.
const UNSEEN_CELLS: u64 = 200_000;
/// A blank is so much larger than what is cut of it.
const RIM: Length = Length::from_um(1_500);

/// Carves up to the second `at_s`, as far as one frame goes; the stock as it is then is `shown`.
pub(super) fn carve(carving: &mut Carving, at_s: f64, shown: &mut Option<Arc<Stock>>) {
    carving.seek(at_s, FRAME_CELLS);
    if shown.as_deref() != Some(carving.stock()) {
        *shown = Some(Arc::new(carving.stock().clone()));
    }
}

/// Carves what was never carved, as far as one frame goes, without showing it; true once nothing is left.
pub(super) fn explore(carving: &mut Carving) -> bool {
    carving.explore(UNSEEN_CELLS)
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
    let points_deg = model.job.work.as_ref().and_then(|work| work.point_deg());
    let stock = points_deg.into_iter().fold(stock, Stock::with_points);
    Some(Carving::new(Arc::clone(playback), program.bits.clone(), stock))
}

/// What is wrong in the playback.
pub(super) fn warned(model: &Model) -> Arc<Vec<Warning>> {
    let (Some(program), Some(playback)) = (&model.board.program, &model.play.playback) else {
        return Arc::default();
    };
    let origin = program.origin;
    let zones = model.board.plan.iter().flat_map(|plan| &plan.zones);
    let thickness = model.machine.process.board_thickness;
    let (work, laid) = (model.job.work.as_ref(), model.board.laid.as_ref());
    let pins = work.zip(laid).map(|(work, laid)| work.setup.pins(&laid.laid.board));
    let room = ToolRoom {
        travel: travel(program, &model.machine),
        deepest: thickness + board::bed(false),
        pins: pins.unwrap_or_default(),
        deepest_pin: thickness + board::bed(true),
        lowest: program.safe_height,
        zones: zones.map(|zone| moved(*zone, origin)).collect(),
    };
    Arc::new(sim::warnings(playback, &program.bits, &room))
}

/// A box of the files' coordinates in work coordinates.
fn moved(files: Bounds, origin: Point) -> Bounds {
    let at = |at: Point| Point::new(at.x - origin.x, at.y - origin.y);
    Bounds { min: at(files.min), max: at(files.max) }
}

/// The box that is shown, in work coordinates: the board and all that is cut.
fn blank(program: &Program, body: Option<Bounds>) -> Option<Bounds> {
    let body = body.map(|body| moved(body, program.origin));
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
