//! Material that was cut from the other side before, for the 3D view of the second side.
//!
//! ```text
//! 3D view of the second side ─▶ the worker carves the first side ─▶ tiles on the underside of the board
//! ```

use super::asked::{Basis, board_is_gone, files_first};
use super::{Effect, Model, OnTheWay};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, Timed, ToUnderside, UnderTile};
use annulus_core::cam::work::Work;
use std::sync::Arc;

/// The cuts from below.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Underside {
    /// Empty for the first side of a job.
    pub tiles: Arc<Vec<UnderTile>>,
    /// The timed plan that the tiles belong to.
    of: Option<Arc<Timed>>,
    /// The awaited request, its contents, and whether the worker was sent the board again.
    asked: Option<(u32, Box<ToUnderside>, bool)>,
}

impl Underside {
    /// True if the model waits for the answer to this request.
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
