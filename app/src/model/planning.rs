//! Requests to the board's worker, and what follows its answers: plan, proof and times, repeated after every
//! change.
//!
//! ```text
//! Nothing ─▶ Opening ─▶ Reading ─▶ Nothing ─▶ Planning: Plan ─▶ Rest ─▶ Prove ─▶ Time ─▶ Nothing
//!    ▲ cancelled, refused ◀┘           ▲──────────────┘ the job changed: plan again after this step
//! ```
//!
//! A second worker computes the times during the proof; step `Time` waits for them if the proof ends first.
//!
//! While the user drags a slider, every change is planned and shown. Proof and times wait until the changes
//! pause, so that new toolpaths do not wait for the proof of old ones.
//!
//! An answer with an unknown number belongs to an older request and is dropped.

use super::asked::{Basis, WorkerTask, board_is_gone, files_first};
use super::board::take_meshes;
use super::{Effect, Event, Job, LaidBoard, Lane, Model, OpenBoard, ToastAct, export, frame};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, PlanReady, Request, Timed, ToPlan, ToProve, ToTime};
use crate::said::{Text, key};
use annulus_core::project::anew::ExportedAnew;
use annulus_core::project::saved::SaidOfFiles;
use annulus_core::wire::program;
use std::sync::Arc;

/// Delay from a change to the proof, in ms; a dragged slider sends its next change sooner.
const REST_MS: f64 = 200.0;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Brought {
    /// Their effect on the open files.
    pub anew: ExportedAnew,
    pub files: Vec<(String, Vec<u8>)>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    pub files: Vec<(String, Vec<u8>)>,
    /// The user's choices for the import.
    pub said: SaidOfFiles,
    pub job: Option<String>,
    /// The files are open already: keep the user's job and the screen.
    pub again: bool,
    pub place: Option<u32>,
    pub anew: Option<Box<Brought>>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum PlanStep {
    Plan,
    Rest {
        planned: Arc<PlanReady>,
    },
    /// Proves the remaining copper, while the other worker computes the times.
    Prove {
        planned: Arc<PlanReady>,
        times: Times,
    },
    /// The proof is done; waits for the times. The plan's number is that of the request for times.
    Time {
        planned: Arc<PlanReady>,
    },
}

/// The times, which are computed during the proof.
#[derive(Clone, Debug, PartialEq)]
pub enum Times {
    Asked {
        number: u32,
    },
    /// Received before the proof ended; may be an error.
    Came(Box<Result<Answer, Stopped>>),
}

/// The request that the board's worker handles. Request numbers ascend.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum OnTheWay {
    #[default]
    Nothing,
    Opening {
        number: u32,
        /// Replaces the project's own job.
        job: Option<String>,
        place: Option<u32>,
    },
    Reading {
        number: u32,
        wanted: Box<Wanted>,
        /// From 0 to 1.
        share: f64,
    },
    Planning {
        number: u32,
        step: PlanStep,
        /// Progress of the step, from 0 to 1.
        share: f64,
        wanted: Box<ToPlan>,
        /// The worker had lost the board and was sent the files again.
        reread: bool,
        /// The job changed meanwhile: plan again after this step.
        again: bool,
    },
}

impl OnTheWay {
    pub fn number(&self) -> Option<u32> {
        match self {
            Self::Nothing => None,
            Self::Opening { number, .. } | Self::Reading { number, .. } | Self::Planning { number, .. } => {
                Some(*number)
            }
        }
    }

    pub(super) fn times_number(&self) -> Option<u32> {
        match self {
            Self::Planning { step: PlanStep::Prove { times: Times::Asked { number }, .. }, .. } => {
                Some(*number)
            }
            _ => None,
        }
    }

    /// Terminates the worker that computes the times, if it is busy for this plan.
    fn end_times(&self) -> Option<Effect> {
        let times = self.times_number().is_some()
            || matches!(self, Self::Planning { step: PlanStep::Time { .. }, .. });
        times.then_some(Effect::CallOff { lane: Lane::Times })
    }

    pub(super) fn place(&self) -> Option<u32> {
        match self {
            Self::Opening { place, .. } => *place,
            Self::Reading { wanted, .. } => wanted.place,
            Self::Nothing | Self::Planning { .. } => None,
        }
    }

    pub fn task(&self) -> Option<WorkerTask> {
        match self {
            Self::Nothing | Self::Opening { .. } => None,
            Self::Reading { share, .. } => {
                Some(WorkerTask { word: key!("page.task.reading"), share: *share })
            }
            Self::Planning { step, share, .. } => {
                let word = match step {
                    PlanStep::Plan => key!("page.task.planning"),
                    PlanStep::Rest { .. } | PlanStep::Prove { .. } => key!("page.task.proving"),
                    PlanStep::Time { .. } => key!("page.task.timing"),
                };
                Some(WorkerTask { word, share: *share })
            }
        }
    }
}

pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    if model.board.reviewing {
        model.asked = None;
        return Vec::new();
    }
    // A board that is being opened is planned after it was read.
    if matches!(model.on_the_way, OnTheWay::Opening { .. } | OnTheWay::Reading { .. }) {
        return Vec::new();
    }
    let Some(basis) = Basis::of(model) else { return Vec::new() };
    if model.asked.as_ref().is_some_and(|asked| asked.same(&basis)) {
        return Vec::new();
    }
    let is_change = model.asked.as_ref().is_some_and(|asked| asked.is_of_board(&basis));
    model.changed_ms = is_change.then_some(model.clock.page_ms);
    model.asked = Some(basis);
    model.board.stale = true;
    match &mut model.on_the_way {
        // In these steps the board's worker is idle.
        OnTheWay::Planning { step: PlanStep::Rest { .. } | PlanStep::Time { .. }, .. } => plan(model),
        OnTheWay::Planning { again, .. } => {
            *again = true;
            Vec::new()
        }
        _ => plan(model),
    }
}

/// Requests a plan of the latest inputs, and cancels the times of the plan before it.
fn plan(model: &mut Model) -> Vec<Effect> {
    let mut effects = Vec::from_iter(model.on_the_way.end_times());
    let Some(basis) = model.asked.clone() else { return effects };
    let wanted = basis.to_plan(model.board.laid.as_ref().map(|laid| laid.key.clone()));
    let number = model.next_request();
    let request = Request::Plan(wanted.clone());
    let (wanted, step) = (Box::new(wanted), PlanStep::Plan);
    model.on_the_way = OnTheWay::Planning { number, step, share: 0.0, wanted, reread: false, again: false };
    effects.push(Effect::ask(number, request));
    effects
}

pub(super) fn called_off(model: &mut Model) -> Vec<Effect> {
    let before = std::mem::take(&mut model.on_the_way);
    if matches!(before, OnTheWay::Planning { .. }) {
        // Plan again at the next opportunity.
        model.asked = None;
    }
    export::called_off(model);
    Vec::from_iter([Effect::CallOff { lane: Lane::Board }].into_iter().chain(before.end_times()))
}

/// The user cancels the running request; it does not restart until the inputs change.
pub(super) fn cancelled(model: &mut Model) -> Vec<Effect> {
    let asked = model.asked.take();
    let effects = called_off(model);
    model.asked = asked;
    effects
}

pub(super) fn clear(model: &mut Model) {
    model.board.clear_plan();
    model.frame.selected = None;
}

pub(super) fn answered(model: &mut Model, before: OnTheWay, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    match before {
        OnTheWay::Planning { wanted, reread: false, again, step: PlanStep::Plan, .. }
            if board_is_gone(&answer) =>
        {
            planned_anew(model, *wanted, again)
        }
        OnTheWay::Planning { step: PlanStep::Plan, wanted, again, .. } => {
            was_planned(model, *wanted, again, answer)
        }
        OnTheWay::Planning { again: true, .. } => {
            model.on_the_way = before;
            plan(model)
        }
        OnTheWay::Planning { step: PlanStep::Prove { planned, times }, wanted, .. } => {
            was_proved(model, (planned, times), *wanted, answer)
        }
        OnTheWay::Planning { step: PlanStep::Time { planned }, .. } => {
            was_timed(model, &planned, answer);
            Vec::new()
        }
        // No request of these is answered here.
        OnTheWay::Planning { step: PlanStep::Rest { .. }, .. }
        | OnTheWay::Nothing
        | OnTheWay::Opening { .. }
        | OnTheWay::Reading { .. } => Vec::new(),
    }
}

/// The worker lost the board, for example after a restart: sends it the files first.
fn planned_anew(model: &mut Model, wanted: ToPlan, again: bool) -> Vec<Effect> {
    let request = Request::Plan(wanted.clone());
    let Some((number, effects)) = files_first(model, &wanted, request) else { return Vec::new() };
    let (wanted, step) = (Box::new(wanted), PlanStep::Plan);
    model.on_the_way = OnTheWay::Planning { number, step, share: 0.0, wanted, reread: true, again };
    effects
}

fn was_planned(
    model: &mut Model,
    wanted: ToPlan,
    again: bool,
    answer: Result<Answer, Stopped>,
) -> Vec<Effect> {
    let just_opened = std::mem::take(&mut model.board.just_opened);
    let planned = match answer {
        Ok(Answer::Planned(planned)) => Arc::new(*planned),
        other => {
            clear(model);
            model.board.stale = false;
            if let Err(Stopped::Refused(why)) = other {
                model.board.refused = why;
            }
            return if again { plan_again(model) } else { Vec::new() };
        }
    };
    let board = &mut model.board;
    board.refused = Vec::new();
    if let Some(laid) = &planned.laid {
        let (mut laid, key) = (laid.clone(), planned.laid_key.clone());
        let meshes = take_meshes(&mut laid.layers);
        board.laid = Some(Arc::new(LaidBoard { key, laid, meshes }));
    }
    board.plan = Some(planned.clone());
    board.program = program::decode(&planned.program).ok().map(Arc::new);
    let mut effects = Vec::new();
    if just_opened && OpenBoard::problems(board).is_empty() && frame::looks_at_board(model) {
        let text = Text::of(key!("page.open.certain"));
        effects.push(frame::toast(model, text, Some(ToastAct::Review)));
    }
    if again {
        effects.extend(plan_again(model));
        return effects;
    }
    let rest_ms = model.changed_ms.map_or(0.0, |changed_ms| changed_ms + REST_MS - model.clock.page_ms);
    if rest_ms <= 0.0 {
        effects.extend(prove(model, planned, wanted));
        return effects;
    }
    let number = model.next_request();
    proceed(model, number, PlanStep::Rest { planned }, wanted);
    effects.push(Effect::Wake { after_ms: rest_ms as u32 + 1, event: Box::new(Event::Rested { number }) });
    effects
}

/// The delay before the proof is over.
pub(super) fn rested(model: &mut Model, number: u32) -> Vec<Effect> {
    match &model.on_the_way {
        OnTheWay::Planning { number: own, step: PlanStep::Rest { planned }, wanted, .. }
            if *own == number =>
        {
            let (planned, wanted) = (Arc::clone(planned), (**wanted).clone());
            prove(model, planned, wanted)
        }
        _ => Vec::new(),
    }
}

/// Requests the proof and, from the other worker, the times.
fn prove(model: &mut Model, planned: Arc<PlanReady>, wanted: ToPlan) -> Vec<Effect> {
    let number = model.next_request();
    let times = model.next_request();
    let (board_key, work, program) = (wanted.board_key, wanted.work.clone(), planned.program.clone());
    let timed = Request::Time(ToTime { program: program.clone(), machine: wanted.machine.clone() });
    proceed(model, number, PlanStep::Prove { planned, times: Times::Asked { number: times } }, wanted);
    vec![
        Effect::ask(number, Request::Prove(ToProve { board_key, program, work })),
        Effect::Ask { lane: Lane::Times, number: times, request: Box::new(timed) },
    ]
}

/// The times arrived before the proof.
pub(super) fn times_came(model: &mut Model, answer: Result<Answer, Stopped>) {
    if let OnTheWay::Planning { step: PlanStep::Prove { times, .. }, .. } = &mut model.on_the_way {
        *times = Times::Came(Box::new(answer));
    }
}

fn plan_again(model: &mut Model) -> Vec<Effect> {
    model.board.stale = true;
    plan(model)
}

fn proceed(model: &mut Model, number: u32, step: PlanStep, wanted: ToPlan) {
    let wanted = Box::new(wanted);
    model.on_the_way = OnTheWay::Planning { number, step, share: 0.0, wanted, reread: false, again: false };
}

fn was_proved(
    model: &mut Model,
    (planned, times): (Arc<PlanReady>, Times),
    wanted: ToPlan,
    answer: Result<Answer, Stopped>,
) -> Vec<Effect> {
    // The mark refers to a problem of the proof before.
    model.job.marked = None;
    model.board.proved = match answer {
        Ok(Answer::Proved(proved)) => Some(Arc::new(proved)),
        _ => None,
    };
    match times {
        Times::Asked { number } => proceed(model, number, PlanStep::Time { planned }, wanted),
        Times::Came(answer) => was_timed(model, &planned, *answer),
    }
    Vec::new()
}

fn was_timed(model: &mut Model, planned: &PlanReady, answer: Result<Answer, Stopped>) {
    match answer {
        Ok(Answer::Timed(timed)) => finish(model, planned, timed),
        Err(Stopped::Refused(why)) => model.board.refused = why,
        _ => {}
    }
}

fn finish(model: &mut Model, planned: &PlanReady, timed: Timed) {
    let Some(program) = model.board.program.clone() else { return };
    let (bytes, key) = (planned.program.clone(), planned.key.clone());
    let stream_digest = timed.stream_digest.clone();
    model.board.job = Some(Arc::new(Job { program: (*program).clone(), bytes, key, stream_digest }));
    model.board.timed = Some(Arc::new(timed));
    model.board.stale = false;
}
