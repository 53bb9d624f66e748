//! Passes progress and answers of the workers to the part of the model that waits for them.
//!
//! Unknown numbers belong to older requests and are dropped.

use super::planning::{self, OnTheWay};
use super::{Effect, Model, carved, drawing, export, files, keeping, lines, second_side, start, template};
use crate::engine::Stopped;
use crate::engine::messages::Answer;

pub(super) fn progress(model: &mut Model, number: u32, share: f64) -> Vec<Effect> {
    if model.on_the_way.number() == Some(number) {
        if let OnTheWay::Reading { share: now, .. } | OnTheWay::Planning { share: now, .. } =
            &mut model.on_the_way
        {
            *now = share;
        }
    } else {
        export::progress(model, number, share);
    }
    Vec::new()
}

pub(super) fn answered(model: &mut Model, number: u32, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    if model.on_the_way.number() == Some(number) {
        of_board(model, answer)
    } else if model.on_the_way.times_number() == Some(number) {
        planning::times_came(model, answer);
        Vec::new()
    } else if model.export.waits_for(number) {
        export::answered(model, answer)
    } else if model.template.waits_for(number) {
        template::answered(model, answer)
    } else if model.lines.waits_for(number) {
        lines::answered(model, answer)
    } else if model.underside.waits_for(number) {
        carved::answered(model, answer)
    } else if model.keeping.waits_for(number) {
        keeping::packed(model, answer)
    } else if model.anew.waits_for(number) {
        files::anew::answered(model, answer)
    } else if model.draw.waits_for(number) {
        drawing::answered(model, number, answer)
    } else if model.second_side.waits_for(number) {
        second_side::timed(model, answer)
    } else if model.start.waits_for(number) {
        start::timed(model, number, answer)
    } else {
        Vec::new()
    }
}

fn of_board(model: &mut Model, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    match (std::mem::take(&mut model.on_the_way), answer) {
        (OnTheWay::Opening { job, place, .. }, Ok(Answer::Opened(project))) => {
            files::opened(model, project, job, place)
        }
        (OnTheWay::Reading { wanted, .. }, Ok(Answer::Read(reading))) => {
            files::was_read(model, *wanted, *reading)
        }
        (OnTheWay::Opening { .. } | OnTheWay::Reading { .. }, Err(stopped)) => files::refused(model, stopped),
        (before, answer) => planning::answered(model, before, answer),
    }
}
