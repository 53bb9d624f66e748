//! What is on its way from the worker of the board, and what follows when it comes: planned, proved, timed, and again whenever
//! something it depends on has changed.
//!
//! ```text
//! Nothing ─▶ Opening ─▶ Reading ─▶ Nothing ─▶ Planning: Plan ─▶ Rest ─▶ Prove ─▶ Time ─▶ Nothing
//!    ▲ called off, refused ◀┘          ▲──────────────┘ another job is wanted meanwhile: planned again after this step
//! ```
//!
//! A worker of its own times what the worker of the board proves; what is not timed when the proof is there is waited for.
//!
//! While a slider moves every change is planned and shown; proof and times follow once nothing has changed for a while, so that
//! new toolpaths do not wait for the proof of old ones.
//!
//! Comes in: answers with their numbers. Goes out: requests. An answer whose number is not waited for is dropped: it is of an
//! older generation. Does not know the worker.

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

/// After a change of what was planned before, a proof is not begun for so long: a hand that moves a slider comes again sooner.
const REST_MS: f64 = 200.0;

/// New exports of the open board, as they were brought.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Brought {
    /// What becomes of the open files.
    pub anew: ExportedAnew,
    /// The files as they were brought.
    pub files: Vec<(String, Vec<u8>)>,
}

/// Files to be read, and what for.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// Names and bytes.
    pub files: Vec<(String, Vec<u8>)>,
    /// What the person says of them.
    pub said: SaidOfFiles,
    /// The job that comes with them.
    pub job: Option<String>,
    /// They are open already: the person's job and the screen stay.
    pub again: bool,
    /// Where they were kept in this browser.
    pub place: Option<u32>,
    /// They are new exports of the open board.
    pub anew: Option<Box<Brought>>,
}

/// How far a plan is.
#[derive(Clone, Debug, PartialEq)]
pub enum PlanStep {
    /// The operations are planned.
    Plan,
    /// Nothing, until it is certain that no other change follows at once.
    Rest {
        /// The plan.
        planned: Arc<PlanReady>,
    },
    /// What copper that leaves is looked at, while it is timed beside.
    Prove {
        /// The plan.
        planned: Arc<PlanReady>,
        /// Its times.
        times: Times,
    },
    /// Its times are waited for: the number is that of their request.
    Time {
        /// The plan.
        planned: Arc<PlanReady>,
    },
}

/// The times of a program that is proved meanwhile.
#[derive(Clone, Debug, PartialEq)]
pub enum Times {
    /// They are asked for.
    Asked {
        /// The request.
        number: u32,
    },
    /// They came before the proof, or cannot be had.
    Came(Box<Result<Answer, Stopped>>),
}

/// What is on its way from the worker of the board. Numbers are those of the requests; a later one is larger.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum OnTheWay {
    /// Nothing.
    #[default]
    Nothing,
    /// A saved project is taken apart.
    Opening {
        /// The request.
        number: u32,
        /// The job that goes before its own.
        job: Option<String>,
        /// Where it was kept in this browser.
        place: Option<u32>,
    },
    /// Files are read.
    Reading {
        /// The request.
        number: u32,
        /// What is read, and what for.
        wanted: Box<Wanted>,
        /// From 0 to 1.
        share: f64,
    },
    /// A plan is made.
    Planning {
        /// The request.
        number: u32,
        /// How far it is.
        step: PlanStep,
        /// How far that step is, from 0 to 1.
        share: f64,
        /// What is planned.
        wanted: Box<ToPlan>,
        /// The worker was given the files anew, because it did not know the board.
        reread: bool,
        /// Something else is wanted meanwhile: it is planned once this step is answered.
        again: bool,
    },
}

impl OnTheWay {
    /// The request that is waited for.
    pub fn number(&self) -> Option<u32> {
        match self {
            Self::Nothing => None,
            Self::Opening { number, .. } | Self::Reading { number, .. } | Self::Planning { number, .. } => {
                Some(*number)
            }
        }
    }

    /// The request for times beside the one that is waited for.
    pub(super) fn times_number(&self) -> Option<u32> {
        match self {
            Self::Planning { step: PlanStep::Prove { times: Times::Asked { number }, .. }, .. } => {
                Some(*number)
            }
            _ => None,
        }
    }

    /// Ends the worker of times, where it works for this.
    fn end_times(&self) -> Option<Effect> {
        let times = self.times_number().is_some()
            || matches!(self, Self::Planning { step: PlanStep::Time { .. }, .. });
        times.then_some(Effect::CallOff { lane: Lane::Times })
    }

    /// Where in this browser what is being opened was kept.
    pub(super) fn place(&self) -> Option<u32> {
        match self {
            Self::Opening { place, .. } => *place,
            Self::Reading { wanted, .. } => wanted.place,
            Self::Nothing | Self::Planning { .. } => None,
        }
    }

    /// What is said of it.
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

/// Plans what is wanted now, where that is another thing than what was planned last.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    if model.board.reviewing {
        model.asked = None;
        return Vec::new();
    }
    // What is being opened is planned when it is there.
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
        // The worker of the board does nothing.
        OnTheWay::Planning { step: PlanStep::Rest { .. } | PlanStep::Time { .. }, .. } => plan(model),
        OnTheWay::Planning { again, .. } => {
            *again = true;
            Vec::new()
        }
        _ => plan(model),
    }
}

/// Asks for a plan of what was asked for last; nobody waits for the times of one before it.
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

/// Whatever is on its way is not waited for any more.
pub(super) fn called_off(model: &mut Model) -> Vec<Effect> {
    let before = std::mem::take(&mut model.on_the_way);
    if matches!(before, OnTheWay::Planning { .. }) {
        // A plan that was not finished is made once there is time again.
        model.asked = None;
    }
    export::called_off(model);
    Vec::from_iter([Effect::CallOff { lane: Lane::Board }].into_iter().chain(before.end_times()))
}

/// The person calls off what the worker does; it is not begun again by itself.
pub(super) fn cancelled(model: &mut Model) -> Vec<Effect> {
    let asked = model.asked.take();
    let effects = called_off(model);
    model.asked = asked;
    effects
}

/// Nothing is planned, nothing is chosen.
pub(super) fn clear(model: &mut Model) {
    model.board.clear_plan();
    model.frame.selected = None;
}

/// The answer to a step of the plan `before`.
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
        // Nobody was asked for anything.
        OnTheWay::Planning { step: PlanStep::Rest { .. }, .. }
        | OnTheWay::Nothing
        | OnTheWay::Opening { .. }
        | OnTheWay::Reading { .. } => Vec::new(),
    }
}

/// The worker does not know the board: it is given the files first.
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

/// Nothing has changed for a while since the plan with this number was made.
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

/// Asks what copper the plan leaves, and how long each step takes.
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

/// The times are there before the proof is.
pub(super) fn times_came(model: &mut Model, answer: Result<Answer, Stopped>) {
    if let OnTheWay::Planning { step: PlanStep::Prove { times, .. }, .. } = &mut model.on_the_way {
        *times = Times::Came(Box::new(answer));
    }
}

/// Plans what is wanted by now.
fn plan_again(model: &mut Model) -> Vec<Effect> {
    model.board.stale = true;
    plan(model)
}

/// The next step of the same plan.
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
