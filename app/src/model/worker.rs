//! What comes from the workers goes to whoever waits for it.
//!
//! Comes in: numbers of requests with shares and answers. Goes out: what follows. A number that nobody waits for is of an older
//! generation, and dropped.

use super::planning::{OnTheWay, Step};
use super::{Effect, Model, export, keeping, planning, template};
use crate::engine::Stopped;
use crate::engine::messages::Answer;

/// A request is so far.
pub(super) fn progress(model: &mut Model, number: u32, share: f64) -> Vec<Effect> {
    if model.on_the_way.number() == Some(number) {
        if let OnTheWay::Planning { step: Step::Plan, share: now, .. } = &mut model.on_the_way {
            *now = share;
        }
    } else {
        export::progress(model, number, share);
    }
    Vec::new()
}

/// A request is answered.
pub(super) fn answered(model: &mut Model, number: u32, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    if model.on_the_way.number() == Some(number) {
        planning::answered(model, answer)
    } else if model.export.waits_for(number) {
        export::answered(model, answer)
    } else if model.template.waits_for(number) {
        template::answered(model, answer)
    } else if model.keeping.waits_for(number) {
        keeping::packed(model, answer)
    } else {
        Vec::new()
    }
}
