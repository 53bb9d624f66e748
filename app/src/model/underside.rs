//! What was cut of the other side before: asked for where the board is looked at in space and is not at its first side.
//!
//! ```text
//! board in space, of its second side ─▶ the worker carves the first ─▶ tiles under the board
//! ```
//!
//! Comes in: the model, answers of the worker. Goes out: requests, tiles. Does not know how they are carved nor drawn.

use super::asked::{Basis, board_is_gone, files_first};
use super::{Effect, Model, OnTheWay};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, Timed, ToUnderside, UnderTile};
use annulus_core::cam::work::Work;
use std::sync::Arc;

/// What is cut from below.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Underside {
    /// Its tiles; none on the first side of a job.
    pub tiles: Arc<Vec<UnderTile>>,
    /// The plan in time that they are for.
    of: Option<Arc<Timed>>,
    /// The request whose answer is waited for, what was asked, and whether the worker was given the board anew.
    asked: Option<(u32, Box<ToUnderside>, bool)>,
}

impl Underside {
    /// Whether this request is waited for.
    pub(super) fn waits_for(&self, wanted: u32) -> bool {
        self.asked.as_ref().is_some_and(|(number, ..)| *number == wanted)
    }
}

/// Asks for what was cut before, once for each plan that is looked at in space.
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

/// The answer; what was called off with other work of that worker is asked for again. Refused, the board is shown uncut from below.
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
