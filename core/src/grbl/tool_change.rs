//! A job waits for its tool. The user jogs, probes, sets the height, and confirms.

use super::activity::{Activity, Work};
use super::asks::EngineAction;
use super::context::Context;
use super::job::{Job, JobTool};
use super::measuring::Measuring;
use super::running::Running;
use crate::control::Ending;
use crate::{code, error};

/// Time in which a controller reports a position with the new zero.
const TOLD_MS: u64 = 4_000;

#[derive(Debug)]
pub(super) struct ToolChange {
    pub(super) job: Box<Job>,
    /// When the user confirmed the tool, while a zero is still being written.
    pub(super) ready_ms: Option<u64>,
}

impl ToolChange {
    /// If the machine can't change this tool itself, asks the user, once for each change.
    pub(super) fn start(cx: &mut Context, mut job: Box<Job>) -> Activity {
        if job.changes().is_some() && !std::mem::replace(&mut job.is_user_asked, true) {
            let tool = match job.tool {
                JobTool::Reference => 0,
                JobTool::Wanted(tool) | JobTool::In(tool) => tool,
            };
            cx.out.push(EngineAction::ToolWanted { tool });
        }
        Activity::ToolChange(Self { job, ready_ms: None })
    }

    pub(super) fn back(cx: &mut Context, job: Box<Job>) -> Activity {
        let is_reference = job.tool == JobTool::Reference;
        let waits = Self::start(cx, job);
        // The reference for all tools could not be measured: the tip is up and nothing has started.
        if is_reference { waits.stop(cx, Ending::Alarm) } else { waits }
    }

    /// A user who confirms the tool right after setting zero can't see that the zero is still being written.
    /// The confirmation waits until the zero is stored and reported.
    pub(super) fn on_time(mut self, cx: &mut Context) -> Activity {
        let Some(asked_ms) = self.ready_ms else { return Activity::ToolChange(self) };
        // A damaged zero is discarded; the controller reports it again.
        if cx.known.zero_off_mm().is_some() {
            cx.known.zero_mm = None;
        }
        let is_to_come = cx.known.place().is_none() && cx.now_ms < asked_ms + TOLD_MS;
        if !cx.line.is_idle() || is_to_come {
            return Activity::ToolChange(self);
        }
        self.ready_ms = None;
        self.on_ready(cx)
    }

    /// The tool is in: continue if its height over the board is known; with a tool setter measure it first.
    fn on_ready(self, cx: &mut Context) -> Activity {
        let known = cx.known.height.may_cut();
        let Some(place) = cx.known.place() else {
            cx.error(code!("grbl.no_report"));
            return Activity::ToolChange(self);
        };
        // Before the height is known, the room above the board can't be judged.
        if let Some(why) = cx.known.no_room(&self.job).filter(|_| known) {
            cx.found(why);
            return Activity::ToolChange(self);
        }
        match self.job.setter() {
            Some(setter) if !known || cx.known.reference_mm.is_none() => {
                Measuring::start(cx, self.job, setter)
                    .unwrap_or_else(|job| Activity::ToolChange(Self { job, ready_ms: None }))
            }
            _ if known => Running::continue_with_tool(cx, self.job, place),
            _ => {
                cx.found(error!("grbl.height_first"));
                Activity::ToolChange(self)
            }
        }
    }
}

impl Activity {
    /// Returns to the state before a jog or a measurement; if that moved the machine, stops first.
    pub(super) fn rest(self, cx: &mut Context) -> Self {
        cx.line.queue.clear();
        match self {
            Self::Measuring(measuring) => super::jogging::Jogging::sent(Some(measuring.job)),
            Self::ToolChange(_) => self,
            activity => match activity.into_work() {
                Work::Job(job) => ToolChange::back(cx, job),
                _ => Self::Ready,
            },
        }
    }
}
