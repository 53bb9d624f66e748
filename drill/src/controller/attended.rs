//! A controller that is attended: the engine of `core` with what is certainly done of its job, in the order in which that must be
//! written and told. The same behind the bridge and in the page.
//!
//! Comes in: events of the engine, the time. Goes out: bytes for the port, what is to be durable before anybody hears of it, and what
//! is told. Does not know ports, files or clocks.

use super::given::JobGiven;
use super::job_tools::JobTools;
use annulus_core::control::{Ending, Trust};
use annulus_core::controller::{
    BoardHeight, CheckNews, Controller, EngineAction, EngineAsk, EngineEvent, EnginePhase, Info, Routine,
    SurveyNews, ToolSetter, step,
};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{RackTool, ToolWear};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::Arc;

/// A job on a controller.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AttendedJob {
    /// SHA-256 of its programs.
    pub key: String,
    /// Its name.
    pub name: String,
    /// The programs it was read from, where those are files.
    pub files: Vec<PathBuf>,
    /// Sections that are certainly done.
    pub done: usize,
    /// Holes among them.
    pub holes: u32,
    /// Toolpaths among them.
    pub toolpaths: u32,
    /// Work zero in machine coordinates, mm.
    #[serde(rename = "zero")]
    pub zero_mm: Option<[f64; 3]>,
    /// It came to its end.
    pub ended: bool,
    /// The height map that its depth follows.
    #[serde(default)]
    pub levelled: Option<String>,
    /// Where its tools are measured, if they are.
    #[serde(default)]
    pub setter: Option<ToolSetter>,
    /// What else it was given that changes what is sent.
    #[serde(default)]
    pub given: JobGiven,
}

/// What the engine told.
#[derive(Debug)]
pub enum Told {
    /// Who is there is known.
    Greeted(Box<Info>),
    /// The work zero is where it was asked for.
    ZeroSet,
    /// So many sections are done, and it is durable.
    Progress,
    /// A tool is wanted: index into the routine's tools.
    ToolWanted {
        /// Index into the routine's tools.
        tool: u32,
        /// The one of the rack, and what it has done, where its life is over: a new one is to be put in.
        worn: Option<Box<(RackTool, ToolWear)>>,
    },
    /// The machine has put this tool in itself: index into the routine's tools.
    ToolFetched {
        /// Index into the routine's tools.
        tool: u32,
    },
    /// What came of a board that is touched.
    Survey(SurveyNews),
    /// What comes of a job that is read in check mode.
    Check(CheckNews),
    /// The job is over.
    Ended(Ending),
    /// Something to be said.
    Found(Diagnostic),
    /// How it is now; after every change.
    Now(Box<ControllerGlimpse>),
    /// The port is gone; nothing follows.
    Gone,
}

/// How the controller is.
#[derive(Clone, Debug, PartialEq)]
pub struct ControllerGlimpse {
    /// What it does.
    pub phase: EnginePhase,
    /// How well its position is known.
    pub trust: Trust,
    /// Where the tip is in work coordinates, mm.
    pub place_mm: Option<[f64; 3]>,
    /// Work zero in machine coordinates, mm.
    pub zero_mm: Option<[f64; 3]>,
    /// Overrides as they were reported last, percent: feed, rapids, spindle.
    pub overrides: [u16; 3],
    /// Something at the board itself holds it: it goes on by Resume.
    pub stands: bool,
    /// Lines of jobs that were sent.
    pub sent: u64,
    /// Lines of jobs that were answered.
    pub answered: u64,
}

/// What is to be done, in this order.
#[derive(Debug)]
pub enum Due {
    /// Write these bytes to the port.
    Write(Vec<u8>),
    /// Keep what is done of the job, and what of its tools where they are counted ([`Attended::tools`]): it is durable before the next of
    /// these is seen to. Where that cannot be, `!` goes to the port.
    Keep(Box<AttendedJob>),
    /// Tell.
    Tell(Told),
    /// Nobody answers: the port is to be closed.
    Close,
}

/// A controller, and the job that it runs or ran last.
#[derive(Debug, Default)]
pub struct Attended {
    controller: Controller,
    entry: AttendedJob,
    routine: Option<Arc<Routine>>,
    /// The tools of its job, where they are counted.
    tools: Option<JobTools>,
    /// The section before which the engine was asked for a new tool last.
    new_before: Option<usize>,
    /// The tool that is wanted is worn: another one of its kind goes in.
    replaces: bool,
    /// A tool is wanted, and not in yet.
    waits: bool,
    before: Option<ControllerGlimpse>,
}

impl Attended {
    /// One whose job is `entry`, not begun.
    pub fn new(entry: AttendedJob) -> Self {
        Self { entry, ..Self::default() }
    }

    /// Everything that is known of it.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// What is done of its job.
    pub fn entry(&self) -> &AttendedJob {
        &self.entry
    }

    /// The tools of its job, where they are counted.
    pub fn tools(&self) -> Option<&JobTools> {
        self.tools.as_ref()
    }

    /// Counts the tools of the job that is started next, or does not.
    pub fn counts(&mut self, tools: Option<JobTools>) {
        self.tools = tools;
    }

    /// That much a tool has done, by a person's word.
    pub fn set_wear(&mut self, wear: ToolWear) {
        if let Some(tools) = &mut self.tools {
            tools.set(wear);
        }
    }

    /// Lets the engine think.
    pub fn event(&mut self, now_ms: u64, event: EngineEvent) -> Vec<Due> {
        // Where the tool is measured first, it goes on by itself afterwards.
        use EnginePhase::{Changing, Measuring, ToolChange};
        let waited = matches!(self.controller.phase, ToolChange | Measuring | Changing);
        let mut due = self.let_think(now_ms, event);
        if std::mem::take(&mut self.replaces) {
            due.extend(self.let_think(now_ms, EngineEvent::Ask(EngineAsk::NewBit)));
        }
        // What all tools go by is measured before one is wanted.
        if waited && self.controller.phase == EnginePhase::Running && std::mem::take(&mut self.waits) {
            if let Some(tools) = &mut self.tools {
                tools.is_in();
            }
            due.push(self.keep());
        }
        due.extend(self.ask_for_new_tool(now_ms));
        due
    }

    /// Asks the engine for a change between two sections, where the life of the tool that is in ends there.
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
        // Whoever is told what happened, a tool that is wanted or an end, knows already how it is now.
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

    /// Zero of X and Y is where it was when the job began; that of Z goes with the bits, once they are touched off.
    fn keep(&mut self) -> Due {
        let known = self.controller.height() == BoardHeight::OfThisBit;
        if let (Some(before), Some(now), true) =
            (&mut self.entry.zero_mm, self.controller.job_zero_mm(), known)
        {
            before[2] = now[2];
        }
        Due::Keep(Box::new(self.entry.clone()))
    }

    /// How it is, where that has changed.
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
