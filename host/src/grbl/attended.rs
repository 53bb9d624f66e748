//! One GRBL controller and the progress of its job: turns engine actions into writes, saves and notices, in
//! the order in which they must happen.

use super::given::JobGiven;
use super::job_tools::JobTools;
use annulus_core::control::{Ending, Trust};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::{
    BoardHeight, CheckNews, Controller, EngineAction, EngineAsk, EngineEvent, EnginePhase, Info, Routine,
    SurveyNews, ToolSetter, step,
};
use annulus_core::machine::{RackTool, ToolWear};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::Arc;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AttendedJob {
    /// SHA-256 of its programs.
    pub key: String,
    pub name: String,
    /// The program files that it was read from, if any.
    pub files: Vec<PathBuf>,
    pub done: usize,
    pub holes: u32,
    pub toolpaths: u32,
    /// Work zero in machine coordinates, mm.
    #[serde(rename = "zero")]
    pub zero_mm: Option<[f64; 3]>,
    /// The job ended normally.
    pub ended: bool,
    /// Key of the height map that its depths follow.
    #[serde(default)]
    pub levelled: Option<String>,
    /// Position of the tool setter, if its tools are measured.
    #[serde(default)]
    pub setter: Option<ToolSetter>,
    /// Other options that change the lines sent.
    #[serde(default)]
    pub given: JobGiven,
}

/// News from the engine.
#[derive(Debug)]
pub enum Told {
    Greeted(Box<Info>),
    ZeroSet,
    /// More sections are completed, and that is durable.
    Progress,
    /// The user must insert a tool: index into the routine's tools.
    ToolWanted {
        /// Index into the routine's tools.
        tool: u32,
        /// The tool of the machine's list and its wear, if its life is over: insert a new one.
        worn: Option<Box<(RackTool, ToolWear)>>,
    },
    /// The machine fetched this tool itself: index into the routine's tools.
    ToolFetched {
        /// Index into the routine's tools.
        tool: u32,
    },
    Survey(SurveyNews),
    /// Progress or result of reading a job in check mode.
    Check(CheckNews),
    Ended(Ending),
    Found(Diagnostic),
    /// The controller's state; sent after every change.
    Now(Box<ControllerGlimpse>),
    /// The oldest request of the command line was handled, and its results are reported.
    Handled,
    /// The port is closed; no more news follow.
    Gone,
}

#[derive(Clone, Debug, PartialEq)]
pub struct ControllerGlimpse {
    pub phase: EnginePhase,
    pub trust: Trust,
    /// Position of the tool in work coordinates, mm.
    pub place_mm: Option<[f64; 3]>,
    /// Work zero in machine coordinates, mm.
    pub zero_mm: Option<[f64; 3]>,
    /// Overrides in the latest report, percent: feed, rapids, spindle.
    pub overrides: [u16; 3],
    /// A button or door at the machine holds it: Resume continues.
    pub stands: bool,
    pub sent: u64,
    pub answered: u64,
}

/// Work for the host, in this order.
#[derive(Debug)]
pub enum Due {
    /// Write these bytes to the port.
    Write(Vec<u8>),
    /// Save the job's progress and, if counted, the wear of its tools ([`Attended::tools`]). The save must
    /// be durable before the next entry is handled. If saving fails, send `!` to the port.
    Keep(Box<AttendedJob>),
    Tell(Told),
    /// The controller does not respond: close the port.
    Close,
}

#[derive(Debug, Default)]
pub struct Attended {
    controller: Controller,
    entry: AttendedJob,
    routine: Option<Arc<Routine>>,
    tools: Option<JobTools>,
    new_before: Option<usize>,
    /// The requested tool is worn: another one of its kind replaces it.
    replaces: bool,
    waits: bool,
    before: Option<ControllerGlimpse>,
}

impl Attended {
    /// A session whose job is `entry`, not started.
    pub fn new(entry: AttendedJob) -> Self {
        Self { entry, ..Self::default() }
    }

    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// Takes over from `before`, the same controller at a port that was lost.
    pub fn succeed(&mut self, before: &Self) {
        self.controller.succeed(&before.controller);
    }

    pub fn entry(&self) -> &AttendedJob {
        &self.entry
    }

    pub fn tools(&self) -> Option<&JobTools> {
        self.tools.as_ref()
    }

    /// Sets the tools of the next job; `None` to count no wear.
    pub fn counts(&mut self, tools: Option<JobTools>) {
        self.tools = tools;
    }

    /// Sets the wear of a tool, as the user states it.
    pub fn set_wear(&mut self, wear: ToolWear) {
        if let Some(tools) = &mut self.tools {
            tools.set(wear);
        }
    }

    pub fn event(&mut self, now_ms: u64, event: EngineEvent) -> Vec<Due> {
        // After a tool length measurement the engine continues by itself, without `ToolReady`.
        use EnginePhase::{Changing, Measuring, ToolChange};
        let waited = matches!(self.controller.phase, ToolChange | Measuring | Changing);
        let mut due = self.let_think(now_ms, event);
        if std::mem::take(&mut self.replaces) {
            due.extend(self.let_think(now_ms, EngineEvent::Ask(EngineAsk::NewBit)));
        }
        // The reference length is measured before any tool is requested, so check that one was.
        if waited && self.controller.phase == EnginePhase::Running && std::mem::take(&mut self.waits) {
            if let Some(tools) = &mut self.tools {
                tools.is_in();
            }
            due.push(self.keep());
        }
        due.extend(self.ask_for_new_tool(now_ms));
        due
    }

    /// Requests a tool change between two sections, if the current tool's life ends there.
    fn ask_for_new_tool(&mut self, now_ms: u64) -> Vec<Due> {
        let runs = self.controller.phase == EnginePhase::Running;
        let wanted = self.tools.as_ref().filter(|_| runs).and_then(JobTools::new_before);
        match wanted.filter(|section| self.new_before != Some(*section)) {
            Some(section) => {
                self.new_before = Some(section);
                self.let_think(now_ms, EngineEvent::Ask(EngineAsk::ToolBefore { section }))
            }
            None => Vec::new(),
        }
    }

    fn let_think(&mut self, now_ms: u64, event: EngineEvent) -> Vec<Due> {
        let start =
            if let EngineEvent::Ask(EngineAsk::Start(start)) = &event { Some(start.clone()) } else { None };
        let (controller, actions) = step(std::mem::take(&mut self.controller), now_ms, event);
        self.controller = controller;
        let mut due = Vec::new();
        if let Some(start) = start.filter(|_| self.controller.phase == EnginePhase::Running) {
            (self.entry.key, self.entry.done) = (start.routine.key.clone(), start.from);
            (self.entry.name, self.entry.ended) = (start.routine.name.clone(), false);
            self.entry.levelled.clone_from(&start.routine.levelled);
            self.entry.setter = start.setter;
            (self.entry.holes, self.entry.toolpaths) = start.routine.counted(start.from);
            (self.new_before, self.waits) = (None, false);
            if let Some(tools) = &mut self.tools {
                tools.begins(start.from);
            }
            self.routine = Some(start.routine);
            self.entry.zero_mm = self.controller.job_zero_mm().or(self.entry.zero_mm);
            due.push(self.keep());
        }
        // Send the snapshot first: the receiver of any other notice already knows the current state.
        due.extend(self.glimpse().map(Due::Tell));
        for action in actions {
            self.act(action, &mut due);
        }
        due
    }

    fn act(&mut self, action: EngineAction, due: &mut Vec<Due>) {
        let told = match action {
            EngineAction::Write(bytes) => return due.push(Due::Write(bytes)),
            EngineAction::Close => return due.push(Due::Close),
            EngineAction::Greeted => Told::Greeted(Box::new(self.controller.info.clone())),
            EngineAction::ZeroSet => Told::ZeroSet,
            EngineAction::Progress { sections: done } => {
                self.entry.done = done;
                if let Some(routine) = &self.routine {
                    (self.entry.holes, self.entry.toolpaths) = routine.counted(done);
                }
                if let Some(tools) = &mut self.tools {
                    tools.done(done);
                }
                due.push(self.keep());
                Told::Progress
            }
            EngineAction::ToolWanted { tool } => {
                self.waits = true;
                let worn = self.tools.as_mut().and_then(JobTools::is_asked);
                self.replaces |= worn.is_some();
                Told::ToolWanted { tool, worn: worn.map(|(tool, wear)| Box::new((tool.clone(), wear))) }
            }
            EngineAction::ToolFetched { tool } => {
                self.waits = true;
                if let Some(tools) = &mut self.tools {
                    tools.is_fetched();
                }
                Told::ToolFetched { tool }
            }
            EngineAction::Survey(news) => Told::Survey(news),
            EngineAction::Check(news) => Told::Check(news),
            EngineAction::Ended(ending) => {
                self.entry.ended = ending == Ending::Done;
                due.push(self.keep());
                Told::Ended(ending)
            }
            EngineAction::Found(found) => Told::Found(found),
        };
        due.push(Due::Tell(told));
    }

    /// X and Y keep the zero from the start of the job. Z takes the zero of each new tool once it is
    /// touched off.
    fn keep(&mut self) -> Due {
        let known = self.controller.height() == BoardHeight::OfThisBit;
        if let (Some(before), Some(now), true) =
            (&mut self.entry.zero_mm, self.controller.job_zero_mm(), known)
        {
            before[2] = now[2];
        }
        Due::Keep(Box::new(self.entry.clone()))
    }

    fn glimpse(&mut self) -> Option<Told> {
        let controller = &self.controller;
        let now = ControllerGlimpse {
            phase: controller.phase,
            trust: controller.trust,
            place_mm: controller.place(),
            zero_mm: controller.zero_mm,
            overrides: controller.status.as_ref().and_then(|status| status.overrides).unwrap_or([100; 3]),
            stands: controller.stands(),
            sent: controller.sent_lines,
            answered: controller.answered_lines,
        };
        (self.before.as_ref() != Some(&now)).then(|| {
            self.before = Some(now.clone());
            Told::Now(Box::new(now))
        })
    }
}
