//! What several views compute from the open board, its job and its playback.

use super::{memo, peek, read, send, shared, watch};
use crate::keys::Tab;
use crate::model::{JobEvent, Model, NextStep, ProofSentence, Unseen};
use crate::picture;
use crate::toolpaths::Toolpaths;
use annulus_core::cam::work::{Operation, Work};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::sim::Moment;
use leptos::prelude::*;
use std::sync::Arc;

/// `get` of the model, for a memo that runs again when files, plan or proof change, or what was accepted.
fn of_plan<T>(get: fn(&Model) -> T) -> T {
    shared(|m| &m.board.document).track();
    shared(|m| &m.board.plan).track();
    shared(|m| &m.board.proved).track();
    watch(|m| &m.board.refused).track();
    watch(|m| &m.board.accepted).track();
    watch(|m| &m.job.read).track();
    watch(|m| &m.board.stale).track();
    peek(get)
}

/// Warnings and errors of files and plan, at most a hundred.
pub fn problems() -> Memo<Vec<Diagnostic>> {
    memo(|| of_plan(|m| m.board.problems()))
}

/// Number of all problems of files, plan and proof, accepted or not.
pub fn problem_count() -> usize {
    memo(|| of_plan(|m| m.board.problem_count())).get()
}

/// Number of problems that only the Board screen lists.
pub fn of_files_count() -> usize {
    memo(|| of_plan(|m| m.board.of_files_count())).get()
}

pub fn proof_sentence() -> Memo<Option<ProofSentence>> {
    memo(|| {
        read(|m| m.board.reviewing);
        of_plan(Model::proof_sentence)
    })
}

pub fn next_step() -> Memo<Option<NextStep>> {
    memo(|| {
        read(|m| m.board.reviewing);
        read(|m| m.visited);
        of_plan(Model::next_step)
    })
}

/// Errors of the displayed plan: parts of the board that it leaves out.
pub fn left_out() -> Memo<Vec<Diagnostic>> {
    memo(|| of_plan(|m| m.board.left_out().cloned().collect()))
}

pub fn unseen() -> Option<Unseen> {
    memo(|| of_plan(|m| m.board.unseen())).get()
}

/// True if errors of files or plan are not accepted; planning waits for that.
pub fn waits_for_person() -> bool {
    memo(|| of_plan(|m| m.board.waits_for_person())).get()
}

/// Number of open points on a screen: errors that are not accepted, and problems of the job.
pub fn to_fix(tab: Tab) -> usize {
    match tab {
        Tab::Board => memo(|| of_plan(|m| m.to_fix(Tab::Board))).get(),
        Tab::Cam => memo(|| of_plan(|m| m.to_fix(Tab::Cam))).get(),
        _ => 0,
    }
}

/// Number of unread problems and of errors of the plan that are not accepted.
pub fn unread() -> usize {
    memo(|| of_plan(|m| m.board.unread(&m.job.read))).get()
}

/// True if the displayed plan may be exported or sent.
pub fn cleared() -> bool {
    memo(|| of_plan(Model::cleared)).get()
}

pub fn toolpaths() -> Memo<Option<Arc<Toolpaths>>> {
    memo(|| {
        let program = shared(|m| &m.board.program).get()?;
        let laid = shared(|m| &m.board.laid);
        let body = laid.with(|laid| laid.as_ref().and_then(|laid| laid.laid.body));
        Some(Arc::new(picture::program_in(&program, body)))
    })
}

pub fn operation() -> Memo<Option<Operation>> {
    memo(|| {
        shared(|m| &m.job.work).track();
        read(|m| m.job.chosen);
        peek(|m| m.job.operation().cloned())
    })
}

/// Replaces the job by the result of `act`. Consecutive changes of one `field` are one undo step.
pub fn change_job(field: Option<&'static str>, act: impl FnOnce(&Work) -> Work) {
    if let Some(work) = peek(|m| m.job.work.clone()) {
        send(JobEvent::Change { field, work: Box::new(act(&work)) });
    }
}

pub fn moment() -> Option<Moment> {
    let at_s = read(|m| m.play.at_s);
    shared(|m| &m.play.playback).with(|playback| playback.as_ref()?.at(at_s))
}
