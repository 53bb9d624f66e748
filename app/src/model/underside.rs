//! What was cut of the other side before: asked for where the board is looked at in space and is not at its first side.
//!
//! ```text
//! board in space, of its second side ─▶ the worker carves the first ─▶ tiles under the board
//! ```
//!
//! Comes in: the model, answers of the worker. Goes out: requests, tiles. Does not know how they are carved nor drawn.

use super::asked::Basis;
use super::{Effect, Model};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, Timed, ToUnderside, UnderTile};
use std::sync::Arc;

/// What is cut from below.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Underside {
    /// Its tiles; none on the first side of a job.
    pub tiles: Arc<Vec<UnderTile>>,
    /// The plan in time that they are for.
    of: Option<Arc<Timed>>,
    number: Option<u32>,
}

impl Underside {
    /// Whether this request is waited for.
    pub(super) fn waits_for(&self, number: u32) -> bool {
        self.number == Some(number)
    }
}

/// Asks for what was cut before, once for each plan that is looked at in space.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let (timed, stock) = (&model.board.timed, &model.play.carved);
    let (Some(timed), Some(stock), false) = (timed, stock, model.board.stale) else { return Vec::new() };
    if model.underside.of.as_ref().is_some_and(|of| Arc::ptr_eq(of, timed)) {
        return Vec::new();
    }
    let (of, bounds) = (timed.clone(), stock.bounds());
    model.underside = Underside { of: Some(of), ..Underside::default() };
    let up = |work: &annulus_core::cam::work::Work| work.faces().first() != Some(&work.setup.face);
    let Some(basis) = Basis::of(model).filter(|_| model.job.work.as_deref().is_some_and(up)) else {
        return Vec::new();
    };
    let number = model.next_request();
    model.underside.number = Some(number);
    vec![Effect::ask(number, Request::Underside(ToUnderside { plan: basis.to_plan(None), bounds }))]
}

/// The answer; without one the board is shown uncut from below.
pub(super) fn answered(model: &mut Model, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    model.underside.number = None;
    if let Ok(Answer::Underside(tiles)) = answer {
        model.underside.tiles = Arc::new(tiles);
    }
    Vec::new()
}
