//! What is asked of the worker of the board, put together from the model.
//!
//! Comes in: the model. Goes out: what a plan depends on, and requests. Does not know what is on its way.

use super::{Effect, Model};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, Settings, ToPlan, ToRead};
use annulus_core::cam::work::Work;
use annulus_core::machine::Machine;
use annulus_core::units::Length;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Long work in the worker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkerTask {
    /// Key of its word.
    pub word: &'static str,
    /// How far, from 0 to 1.
    pub share: f64,
}

/// What a plan depends on: the same handles mean the same plan.
#[derive(Clone, Debug)]
pub(super) struct Basis {
    board_key: u32,
    work: Arc<Work>,
    machine: Arc<Machine>,
    loaded: Option<Length>,
    accepted: BTreeSet<String>,
}

impl Basis {
    /// Whether both make the same plan.
    pub(super) fn same(&self, other: &Self) -> bool {
        self.board_key == other.board_key
            && Arc::ptr_eq(&self.work, &other.work)
            && Arc::ptr_eq(&self.machine, &other.machine)
            && self.loaded == other.loaded
            && self.accepted == other.accepted
    }

    /// Whether both are of one board.
    pub(super) fn is_of_board(&self, other: &Self) -> bool {
        self.board_key == other.board_key
    }

    /// What there is to plan; nothing without a board.
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

    /// As the worker takes it; `laid` tells how the board lies in the picture.
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

/// Asks a worker that does not know the board for something of the plan `of`: it is given the files first. Goes out: the number of
/// what is asked.
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

/// Whether a worker refuses because it does not know the board.
pub(super) fn board_is_gone(answer: &Result<Answer, Stopped>) -> bool {
    matches!(answer, Err(Stopped::Refused(why)) if why.iter().any(|diagnostic| diagnostic.code == "engine.board_gone"))
}
