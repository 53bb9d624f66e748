//! The preflight before the first move, and programs that the machine has but this page did not plan.
//!
//! ```text
//! Start… ─▶ upload ─▶ Arm ─▶ rows and digest ─▶ [Start the job]   (only this button moves anything)
//! a key from the bridge ─▶ fetched ─▶ timed in a worker ─▶ Job
//! ```

use super::link::ask;
use super::{Effect, Job, Lane, Model, second_side};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, Settings, ToTime};
use crate::said::key;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::job::Program;
use annulus_core::level::{HeightMap, TOLERANCE, level};
use annulus_core::locale;
use annulus_core::units::Length;
use annulus_core::wire::{
    ArmedJob, Ask, HeightMapReport, InterruptedJob, MissingReport, PreflightRow, RowVerdict, program,
};
use annulus_core::{code, warning};
use std::collections::BTreeSet;
use std::sync::Arc;

#[derive(Clone, Debug, PartialEq)]
pub struct Preflight {
    pub job: String,
    pub from_leg: u32,
    pub own_digest: String,
    /// `own_digest` includes the height map.
    pub levelled: bool,
    levelling: Option<u32>,
    /// The machine plans its own motion, so there is no digest to compare.
    pub own_motion: bool,
    /// Warning: the job is aligned to the located board, or the located holes were dropped.
    pub lies: Option<Diagnostic>,
    /// Age of the height map, whole minutes.
    pub map_age_min: Option<u64>,
}

#[derive(Clone, Debug, PartialEq)]
enum Then {
    /// Only to show the machine's job.
    Nothing,
    Preflight {
        from_leg: u32,
    },
    /// Preflight of the missing parts.
    Again {
        missing: MissingReport,
    },
}

#[derive(Clone, Debug, PartialEq)]
enum Coming {
    Fetched { number: u32, key: String, then: Then },
    Timed { number: u32, program: Box<Program>, bytes: Vec<u8>, key: String, then: Then },
}

impl Coming {
    fn number(&self) -> u32 {
        match self {
            Self::Fetched { number, .. } | Self::Timed { number, .. } => *number,
        }
    }
}

#[derive(Clone, Debug, Default)]
pub struct Start {
    /// The machine's job, if this page did not plan it.
    pub fetched: Option<Arc<Job>>,
    pub shown: Option<Arc<Job>>,
    pub preflight: Option<Preflight>,
    pub ticked: BTreeSet<String>,
    coming: Vec<Coming>,
    upload: Option<u32>,
    /// The machine's job at the last update.
    running: Option<String>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum StartEvent {
    Open,
    Resume {
        offer: InterruptedJob,
    },
    /// Open the preflight of the parts that the last run left out.
    Again {
        missing: MissingReport,
    },
    Fetched {
        number: u32,
        answer: Result<Vec<u8>, Diagnostic>,
    },
    Uploaded {
        number: u32,
        /// The program's key, or the error.
        answer: Result<String, Diagnostic>,
    },
    Tick {
        /// See [`ticked_as`].
        warning: String,
    },
    Close,
    /// Start the job. The machine moves.
    Start,
}

/// The bridge's checks, and those of the page: the computer stays awake, and bridge and page computed the
/// same steps. A controller that plans its own motion has no steps to compare.
pub fn rows(preflight: &Preflight, armed: &ArmedJob, awake: Option<bool>) -> Vec<PreflightRow> {
    let lies = preflight.lies.clone().map(|finding| PreflightRow { finding, verdict: RowVerdict::Warn });
    let told = armed.checks.iter().map(|row| aged(row, preflight.map_age_min));
    let bridge = told.chain(lies).chain(awake.map(wakeful));
    if preflight.own_motion {
        return bridge.collect();
    }
    let same = preflight.own_digest == armed.stream_digest;
    let code = if same { key!("page.preflight.same_steps") } else { key!("page.preflight.other_steps") };
    let severity = if same { Severity::Note } else { Severity::Error };
    let digest = PreflightRow {
        finding: Diagnostic::new(severity, code)
            .with("digest", armed.stream_digest.get(..12).unwrap_or_default()),
        verdict: if same { RowVerdict::Pass } else { RowVerdict::Fail },
    };
    bridge.chain([digest]).collect()
}

/// Adds the map's age to the row about the height map: only the user knows whether the board is still the
/// same.
fn aged(row: &PreflightRow, age_min: Option<u64>) -> PreflightRow {
    let Some(min) = age_min.filter(|_| row.finding.code == code!("level.follows")) else {
        return row.clone();
    };
    let mm = row.finding.args.iter().find(|(name, _)| name == "mm").map_or("?", |(_, mm)| mm);
    let finding = warning!("level.follows_aged", mm = mm, ..);
    PreflightRow { finding: finding.with("hours", min / 60).with("minutes", min % 60), verdict: row.verdict }
}

/// Whether the browser keeps the screen on, and thus the computer awake.
fn wakeful(awake: bool) -> PreflightRow {
    let (code, severity, verdict) = if awake {
        (key!("page.preflight.awake"), Severity::Note, RowVerdict::Pass)
    } else {
        (key!("page.preflight.may_sleep"), Severity::Warning, RowVerdict::Warn)
    };
    PreflightRow { finding: Diagnostic::new(severity, code), verdict }
}

pub fn rows_now(
    preflight: Option<&Preflight>,
    armed: Option<&ArmedJob>,
    awake: Option<bool>,
) -> Option<Vec<PreflightRow>> {
    let preflight = preflight?;
    // If the bridge's job follows a height map, the rows wait until this page has computed the same.
    let same = |armed: &&ArmedJob| armed.job == preflight.job && armed.levelled == preflight.levelled;
    armed.filter(same).map(|armed| rows(preflight, armed, awake))
}

/// Identity of a warning: its code and arguments, because several tools may have the same problem.
pub fn ticked_as(finding: &Diagnostic) -> String {
    let said_of = finding.args.iter().map(|(_, value)| value.as_str());
    std::iter::once(finding.code.as_str()).chain(said_of).collect::<Vec<_>>().join(" ")
}

/// True if no row fails and every warning is ticked.
pub fn may_start(rows: &[PreflightRow], ticked: &BTreeSet<String>) -> bool {
    rows.iter().all(|row| match row.verdict {
        RowVerdict::Pass | RowVerdict::Note => true,
        RowVerdict::Warn => ticked.contains(&ticked_as(&row.finding)),
        RowVerdict::Fail => false,
    })
}

pub(super) fn update(model: &mut Model, event: StartEvent) -> Vec<Effect> {
    match event {
        // An aligned job must be timed first.
        StartEvent::Open if model.second_side.waits() => Vec::new(),
        StartEvent::Open => match model.second_side.job.clone().or(model.board.job.clone()) {
            Some(job) => show(model, &job, 0),
            None => Vec::new(),
        },
        StartEvent::Resume { offer } => {
            by_key(model, offer.job, Then::Preflight { from_leg: offer.next_leg })
        }
        StartEvent::Again { missing } => by_key(model, missing.job.clone(), Then::Again { missing }),
        StartEvent::Fetched { number, answer } => fetched(model, number, answer),
        StartEvent::Uploaded { number, answer } => uploaded(model, number, answer),
        StartEvent::Tick { warning } => {
            if !model.start.ticked.remove(&warning) {
                model.start.ticked.insert(warning);
            }
            Vec::new()
        }
        StartEvent::Close => {
            (model.start.preflight, model.start.upload) = (None, None);
            Vec::new()
        }
        StartEvent::Start => start(model),
    }
}

fn show(model: &mut Model, job: &Job, from_leg: u32) -> Vec<Effect> {
    // Results for an earlier job must not appear in this preflight.
    (model.link.armed, model.link.refused, model.link.checked) = (None, None, None);
    model.start.ticked = BTreeSet::new();
    let (key, own_digest) = (job.key.clone(), job.stream_digest.clone());
    let own_motion = model.link.controller.plans();
    let along = model.second_side.job.as_ref().is_some_and(|along| along.key == job.key);
    let lies = model.second_side.lies().filter(|_| along).map(second_side::told);
    let lies = lies.or_else(|| second_side::forgotten(&model.second_side).filter(|_| from_leg == 0));
    let measured_s = Some(model.link.height_map.measured_s).filter(|at| *at > 0);
    let map_age_min = measured_s.map(|at| ((model.clock.wall_ms / 1e3) as u64).saturating_sub(at) / 60);
    let (job_key, levelled, levelling) = (key, false, None);
    model.start.preflight = Some(Preflight {
        job: job_key,
        from_leg,
        own_digest,
        levelled,
        levelling,
        own_motion,
        lies,
        map_age_min,
    });
    let number = model.next_request();
    model.start.upload = Some(number);
    let session = model.link.session.clone();
    vec![Effect::Upload { number, bytes: job.bytes.clone(), session }]
}

fn uploaded(model: &mut Model, number: u32, answer: Result<String, Diagnostic>) -> Vec<Effect> {
    if model.start.upload != Some(number) {
        return Vec::new();
    }
    model.start.upload = None;
    match answer {
        Ok(job) => {
            let from_leg = model.start.preflight.as_ref().map_or(0, |preflight| preflight.from_leg);
            ask(model, &Ask::Arm { job, from_leg })
        }
        Err(why) => {
            model.link.refused = Some(why);
            Vec::new()
        }
    }
}

fn start(model: &mut Model) -> Vec<Effect> {
    let rows = rows_now(model.start.preflight.as_ref(), model.link.armed.as_ref(), model.frame.awake);
    // Checked here and not only by the button, because the rows may have changed since it was shown.
    let may = rows.is_some_and(|rows| may_start(&rows, &model.start.ticked));
    let Some(preflight) = model.start.preflight.take_if(|_| may) else { return Vec::new() };
    let Preflight { job, from_leg, own_digest, .. } = preflight;
    model.link.ended = None;
    model.second_side.forgotten = false;
    ask(model, &Ask::Start { job, stream_digest: own_digest, from_leg })
}

/// Computes the levelled job here too if the bridge's job follows the height map, so that both compare the
/// same steps.
fn level_too(model: &mut Model) -> Vec<Effect> {
    let (Some(preflight), Some(armed)) = (&model.start.preflight, &model.link.armed) else {
        return Vec::new();
    };
    let is_done = preflight.levelled || preflight.levelling.is_some();
    if armed.job != preflight.job || !armed.levelled || is_done {
        return Vec::new();
    }
    let known = [&model.board.job, &model.second_side.job, &model.start.fetched].into_iter().flatten();
    let job = known.into_iter().find(|job| job.key == preflight.job);
    let map = map_of(&model.link.height_map);
    let followed = job.zip(map).and_then(|(job, map)| level(&job.program, &map, TOLERANCE).ok());
    let number = model.next_request();
    let machine = Settings::of(&model.machine);
    let Some(preflight) = &mut model.start.preflight else { return Vec::new() };
    let Some(followed) = followed else {
        // Without a digest to compare, the job must not start.
        (preflight.levelled, preflight.own_digest) = (true, String::new());
        return Vec::new();
    };
    preflight.levelling = Some(number);
    let request = Request::Time(ToTime { program: program::encode(&followed.program), machine });
    vec![Effect::Ask { lane: Lane::Beside, number, request: Box::new(request) }]
}

fn map_of(report: &HeightMapReport) -> Option<HeightMap> {
    let heights = report.heights.iter().copied().collect::<Option<Vec<_>>>()?;
    let (grid, job, measured_s) = (report.grid?, report.job.clone(), report.measured_s);
    Some(HeightMap { grid, heights, job, zero: [Length::ZERO; 2], homed: true, measured_s })
}

/// Follows changes of the machine's job.
fn running(model: &mut Model) -> Vec<Effect> {
    let now = model.link.status.as_ref().and_then(|status| status.job.clone());
    if now == model.start.running {
        return Vec::new();
    }
    model.start.running.clone_from(&now);
    now.map_or_else(Vec::new, |key| by_key(model, key, Then::Nothing))
}

/// The Machine screen shows the machine's job, else the planned one, else the last one. Unknown programs are
/// fetched.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let mut effects = running(model);
    effects.extend(level_too(model));
    let own = |job: &Option<Arc<Job>>, key: &str| job.clone().filter(|job| job.key == key);
    let along = &model.second_side.job;
    let planned = along.as_ref().map_or_else(|| model.board.job.clone(), |job| Some(job.clone()));
    let key = model.link.status.as_ref().and_then(|status| status.job.as_deref());
    model.start.shown = match key {
        None => planned.or_else(|| own(&model.start.fetched, &model.link.ended.as_ref()?.end.job)),
        Some(key) => own(&planned, key)
            .or_else(|| own(&model.board.job, key))
            .or_else(|| own(&model.start.fetched, key)),
    };
    effects
}

/// The job `key`: planned here, or fetched from the bridge.
fn by_key(model: &mut Model, key: String, then: Then) -> Vec<Effect> {
    let all = [&model.board.job, &model.second_side.job, &model.start.fetched];
    let known = all.into_iter().flatten().find(|job| job.key == key);
    if let Some(job) = known.cloned() {
        return proceed(model, &job, then);
    }
    let number = model.next_request();
    model.start.coming.push(Coming::Fetched { number, key: key.clone(), then });
    vec![Effect::Fetch { number, key, session: model.link.session.clone() }]
}

fn take(model: &mut Model, number: u32) -> Option<Coming> {
    let at = model.start.coming.iter().position(|coming| coming.number() == number)?;
    Some(model.start.coming.remove(at))
}

fn fetched(model: &mut Model, number: u32, answer: Result<Vec<u8>, Diagnostic>) -> Vec<Effect> {
    let Some(Coming::Fetched { key, then, .. }) = take(model, number) else { return Vec::new() };
    match answer {
        Ok(bytes) => {
            let Ok(program) = program::decode(&bytes) else { return Vec::new() };
            time(model, program, bytes, key, then)
        }
        Err(why) => {
            model.link.refused = Some(why);
            Vec::new()
        }
    }
}

fn time(model: &mut Model, program: Program, bytes: Vec<u8>, key: String, then: Then) -> Vec<Effect> {
    let number = model.next_request();
    let request = Request::Time(ToTime { program: bytes.clone(), machine: Settings::of(&model.machine) });
    let program = Box::new(program);
    model.start.coming.push(Coming::Timed { number, program, bytes, key, then });
    vec![Effect::Ask { lane: Lane::Beside, number, request: Box::new(request) }]
}

impl Start {
    pub(super) fn waits_for(&self, number: u32) -> bool {
        self.coming.iter().any(|coming| coming.number() == number) || self.levels(number)
    }

    fn levels(&self, number: u32) -> bool {
        self.preflight.as_ref().is_some_and(|preflight| preflight.levelling == Some(number))
    }
}

pub(super) fn timed(model: &mut Model, number: u32, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    let stream_digest = match answer {
        Ok(Answer::Timed(timed)) => timed.stream_digest,
        _ => String::new(),
    };
    if let Some(preflight) = model.start.preflight.as_mut().filter(|one| one.levelling == Some(number)) {
        (preflight.own_digest, preflight.levelled, preflight.levelling) = (stream_digest, true, None);
        return Vec::new();
    }
    let Some(Coming::Timed { program, bytes, key, then, .. }) = take(model, number) else {
        return Vec::new();
    };
    let job = Arc::new(Job { program: *program, bytes, key, stream_digest });
    model.start.fetched = Some(job.clone());
    proceed(model, &job, then)
}

fn proceed(model: &mut Model, job: &Job, then: Then) -> Vec<Effect> {
    match then {
        Then::Nothing => Vec::new(),
        Then::Preflight { from_leg } => show(model, job, from_leg),
        Then::Again { missing } => {
            let wanted = |leg: usize| {
                missing.legs.iter().any(|(from, to)| (*from as usize..*to as usize).contains(&leg))
            };
            let mut program = job.program.only(wanted);
            let name = [("name".to_owned(), program.name)];
            program.name = locale::text(&model.frame.language, key!("page.ended.again_name"), &name);
            let bytes = program::encode(&program);
            let key = program::key(&bytes);
            time(model, program, bytes, key, Then::Preflight { from_leg: 0 })
        }
    }
}
