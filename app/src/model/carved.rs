//! The stock in the 3D view: created on demand, carved frame by frame up to the displayed second. On the
//! second side, also the material that was cut from the other side before.
//!
//! ```text
//! plan, program, box ─▶ Carving ── a frame's work ──▶ carved: the displayed stock    late? ─▶ another frame
//!
//! 3D view of the second side ─▶ the worker carves the first side ─▶ tiles on the underside of the board
//! ```
//!
//! The work per frame is limited, so that the page stays responsive. Frames that change nothing on screen
//! carve ahead.

use super::asked::{Basis, board_is_gone, files_first};
use super::{Effect, Model, OnTheWay};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, Timed, ToUnderside, UnderTile};
use annulus_core::board;
use annulus_core::cam::work::Work;
use annulus_core::geometry::{Bounds, Point};
use annulus_core::job::{Program, touched};
use annulus_core::machine::Machine;
use annulus_core::sim::{self, Carving, Stock, ToolRoom, Warning};
use annulus_core::units::Length;
use std::sync::Arc;

/// Cells to examine in a frame.
const FRAME_CELLS: u64 = 300_000;
/// Cells to examine in a frame that changes nothing on screen; fewer, so that the user does not notice.
const UNSEEN_CELLS: u64 = 200_000;
/// Margin of the blank around the cut area.
const RIM: Length = Length::from_um(1_500);

pub(super) fn carve(carving: &mut Carving, at_s: f64, shown: &mut Option<Arc<Stock>>) {
    carving.seek(at_s, FRAME_CELLS);
    if shown.as_deref() != Some(carving.stock()) {
        *shown = Some(Arc::new(carving.stock().clone()));
    }
}

/// Carves ahead within one frame's limit without showing it; true when nothing is left.
pub(super) fn explore(carving: &mut Carving) -> bool {
    carving.explore(UNSEEN_CELLS)
}

/// True if the stock is not at second `at_s`.
pub(super) fn is_behind(carving: &Carving, at_s: f64) -> bool {
    (carving.at_s() - at_s).abs() > 1e-9
}

/// The uncut stock; needs a program and a playback.
pub(super) fn begin(model: &Model) -> Option<Carving> {
    let (program, playback) = (model.board.program.as_ref()?, model.play.playback.as_ref()?);
    let body = model.board.laid.as_ref().and_then(|laid| laid.laid.body);
    let stock = Stock::new(blank(program, body)?, model.machine.process.board_thickness).ok()?;
    let points_deg = model.job.work.as_ref().and_then(|work| work.point_deg());
    let stock = points_deg.into_iter().fold(stock, Stock::with_points);
    Some(Carving::new(Arc::clone(playback), program.bits.clone(), stock))
}

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

/// Converts a box from the files' coordinates to work coordinates.
fn moved(files: Bounds, origin: Point) -> Bounds {
    let at = |at: Point| Point::new(at.x - origin.x, at.y - origin.y);
    Bounds { min: at(files.min), max: at(files.max) }
}

/// The displayed stock in work coordinates: the board and everything that is cut.
fn blank(program: &Program, body: Option<Bounds>) -> Option<Bounds> {
    let body = body.map(|body| moved(body, program.origin));
    let cut = touched(program);
    let all = body.into_iter().chain(cut).reduce(|a, b| a.with(b.min).with(b.max))?;
    // A board that is cut out along its edge needs a larger blank.
    Some(if body == Some(all) { all } else { all.grown(RIM) })
}

/// The machine's travel in work coordinates, with the work zero that leaves the program the most room.
fn travel(program: &Program, machine: &Machine) -> Option<Bounds> {
    let reach = sim::reach(program)?;
    let low = Point::new(reach.min.x.min(Length::ZERO), reach.min.y.min(Length::ZERO));
    let high = Point::new(low.x + machine.x.max - machine.x.min, low.y + machine.y.max - machine.y.min);
    Some(Bounds { min: low, max: high })
}

/// The cuts from below.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Underside {
    /// Empty for the first side of a job.
    pub tiles: Arc<Vec<UnderTile>>,
    of: Option<Arc<Timed>>,
    /// The awaited request, its contents, and whether the worker was sent the board again.
    asked: Option<(u32, Box<ToUnderside>, bool)>,
}

impl Underside {
    pub(super) fn waits_for(&self, wanted: u32) -> bool {
        self.asked.as_ref().is_some_and(|(number, ..)| *number == wanted)
    }
}

/// Requests the cuts of the side before, once per plan in the 3D view.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let (timed, stock) = (&model.board.timed, &model.play.carved);
    let rests = model.on_the_way == OnTheWay::Nothing && !model.board.stale;
    let (Some(timed), Some(stock), true) = (timed, stock, rests) else { return Vec::new() };
    if model.underside.of.as_ref().is_some_and(|of| Arc::ptr_eq(of, timed)) {
        return Vec::new();
    }
    let (of, bounds) = (timed.clone(), stock.bounds());
    model.underside = Underside { of: Some(of), ..Underside::default() };
    let up = |work: &Work| work.faces().first() != Some(&work.setup.face);
    let Some(basis) = Basis::of(model).filter(|_| model.job.work.as_deref().is_some_and(up)) else {
        return Vec::new();
    };
    let wanted = ToUnderside { plan: basis.to_plan(None), bounds };
    let number = model.next_request();
    model.underside.asked = Some((number, Box::new(wanted.clone()), false));
    vec![Effect::ask(number, Request::Underside(wanted))]
}

/// Stores the tiles. A request that was cancelled with other work is sent again; after a refusal the
/// underside is shown uncut.
pub(super) fn answered(model: &mut Model, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    let Some((_, wanted, reread)) = model.underside.asked.take() else { return Vec::new() };
    if !reread && board_is_gone(&answer) {
        let request = Request::Underside((*wanted).clone());
        let Some((number, effects)) = files_first(model, &wanted.plan, request) else { return Vec::new() };
        model.underside.asked = Some((number, wanted, true));
        return effects;
    }
    match answer {
        Ok(Answer::Underside(tiles)) => model.underside.tiles = Arc::new(tiles),
        Err(Stopped::Cancelled) => model.underside.of = None,
        _ => {}
    }
    Vec::new()
}
