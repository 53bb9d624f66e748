//! Builds requests to the board's worker from the model.

use super::{Effect, Model};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, Settings, ToPlan, ToRead};
use annulus_core::cam::work::Work;
use annulus_core::code;
use annulus_core::machine::Machine;
use annulus_core::units::Length;
use std::collections::BTreeSet;
use std::sync::Arc;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkerTask {
    pub word: &'static str,
    /// Progress from 0 to 1.
    pub share: f64,
}

/// The inputs of a plan; the same handles give the same plan.
#[derive(Clone, Debug)]
pub(super) struct Basis {
    board_key: u32,
    work: Arc<Work>,
    machine: Arc<Machine>,
    loaded: Option<Length>,
    accepted: BTreeSet<String>,
}

impl Basis {
    /// True if both give the same plan.
    pub(super) fn same(&self, other: &Self) -> bool {
        self.board_key == other.board_key
            && Arc::ptr_eq(&self.work, &other.work)
            && Arc::ptr_eq(&self.machine, &other.machine)
            && self.loaded == other.loaded
            && self.accepted == other.accepted
    }

    /// True if both belong to one board.
    pub(super) fn is_of_board(&self, other: &Self) -> bool {
        self.board_key == other.board_key
    }

    /// The current inputs; `None` without a board.
    pub(super) fn of(model: &Model) -> Option<Self> {
        let (document, work) = model.board.document.as_ref().zip(model.job.work.as_ref())?;
        Some(Self {
            board_key: document.reading.board_key,
            work: work.clone(),
            machine: model.machine.clone(),
            loaded: model.board.loaded,
            accepted: model.board.accepted.clone(),
        })
    }

    /// As a request; `laid` is the key of the placed board that the page already has.
    pub(super) fn to_plan(&self, laid: Option<String>) -> ToPlan {
        ToPlan {
            board_key: self.board_key,
            machine: Settings::of(&self.machine),
            work: (*self.work).clone(),
            loaded: self.loaded,
            accept: self.accepted.iter().cloned().collect(),
            laid,
        }
    }
}

/// Requests something about plan `of` from a worker that does not know the board: sends the files first.
/// Returns the number of `request`.
pub(super) fn files_first(model: &mut Model, of: &ToPlan, request: Request) -> Option<(u32, Vec<Effect>)> {
    let document = model.board.document.clone()?;
    let files = Request::Read(ToRead {
        board_key: of.board_key,
        files: document.files.clone(),
        said: document.said.clone(),
        job: None,
        machine: Some(of.machine.clone()),
    });
    let (first, number) = (model.next_request(), model.next_request());
    Some((number, vec![Effect::ask(first, files), Effect::ask(number, request)]))
}

pub(super) fn board_is_gone(answer: &Result<Answer, Stopped>) -> bool {
    matches!(answer, Err(Stopped::Refused(why)) if why.iter().any(|diagnostic| diagnostic.code == code!("engine.board_gone")))
}
