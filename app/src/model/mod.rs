//! The page as plain data: one [`Model`], one [`Event`], one pure [`update`].
//!
//! ```text
//! screen ─┐                               ┌─▶ Model, which the screens read
//! worker ─┼─ Event ─▶ update(&mut Model) ─┤
//! store  ─┘                               └─▶ Effects: requests to the browser, the workers and the store
//! ```

pub mod address;
pub mod asked;
pub mod board;
mod carved;
pub mod drawing;
pub mod effect;
pub mod export;
pub mod files;
pub mod frame;
pub mod job;
pub mod job_board;
pub mod keeping;
pub mod lab;
pub mod level;
pub mod lines;
pub mod link;
pub mod machines;
pub mod next;
pub mod planning;
pub mod play;
pub mod presses;
pub mod rack;
pub mod second_side;
pub mod settings;
pub mod start;
pub mod template;
pub mod touch_off;
pub mod window;
mod worker;

#[cfg(test)]
mod tests;

pub use asked::WorkerTask;
pub use board::{Document, Job, LaidBoard, OpenBoard, Unseen};
pub use carved::Underside;
pub use drawing::{Draw, DrawEvent};
pub use effect::{Effect, Lane};
pub use export::{Export, ExportEvent};
pub use files::anew::{Anew, AnewEvent, NewExports};
pub use files::{BoardBefore, FilesEvent};
pub use frame::{Frame, FrameEvent, Overlay, Toast, ToastAct};
pub use job::{JobEdit, JobEvent};
pub use keeping::{KeepEvent, Keeping, Offer};
pub use lab::{Lab, LabEvent};
pub use level::{LevelEvent, Leveling, PlannedMap};
pub use lines::{Listing, ListingEvent};
pub use link::{ControllerEvent, HandEvent, Link, LinkEvent, Support};
pub use machines::{ChoiceOrigin, MachineEvent, MachineOwner, Machines};
pub use next::{NextStep, ProofSentence, ProofState, Visited};
pub use planning::{OnTheWay, PlanStep};
pub use play::{Play, PlayEvent};
pub use presses::{PressEvent, Presses};
pub use second_side::{Eye, SecondSide, SecondSideEvent, SoughtHole};
pub use settings::{SettingsDraft, SettingsEvent};
pub use start::{Start, StartEvent};
pub use template::{Template, TemplateEvent};
pub use touch_off::{TouchOff, TouchOffEvent, TouchTarget, TouchedPart};
pub use window::{Network, Panels, Theme};

use crate::engine::Stopped;
use crate::engine::messages::Answer;
use crate::keys::Tab;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{self, Machine};
use std::sync::Arc;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clocks {
    /// Milliseconds since the page was opened; monotonic.
    pub page_ms: f64,
    /// Milliseconds since 1970.
    pub wall_ms: f64,
}

#[derive(Debug)]
pub struct Model {
    pub clock: Clocks,
    pub frame: Frame,
    /// The machine that jobs are planned for: that of the bridge or controller, else the chosen one, else the
    /// virtual drill.
    pub machine: Arc<Machine>,
    /// The choice of the machine, and the user's own machines.
    pub machines: Machines,
    pub board: OpenBoard,
    /// The board that was open before the review on screen, to go back to.
    pub before: Option<Arc<BoardBefore>>,
    pub job: JobEdit,
    /// The screens that the user has seen for this board.
    pub visited: Visited,
    /// Number of files that the browser is reading for the page; 0 if none.
    pub coming: usize,
    /// Requests that wait for a worker's answer.
    pub on_the_way: OnTheWay,
    pub export: Export,
    pub template: Template,
    pub link: Link,
    pub start: Start,
    pub level: Leveling,
    pub touch_off: TouchOff,
    pub second_side: SecondSide,
    pub lab: Lab,
    pub draw: Draw,
    pub play: Play,
    /// Ignores presses on motion buttons that have just appeared or moved.
    pub presses: Presses,
    /// The program's lines next to the simulation.
    pub lines: Listing,
    /// Material that was already removed from the other side.
    pub underside: Underside,
    /// Edits of the machine's settings that are not applied yet.
    pub settings: SettingsDraft,
    applied: settings::Applied,
    pub keeping: Keeping,
    job_board: job_board::JobBoard,
    /// Newer exports of the open board's files.
    pub anew: Anew,
    asked: Option<asked::Basis>,
    /// When the plan's inputs changed last; `None` while a board is planned for the first time.
    changed_ms: Option<f64>,
    request: u32,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// Sets the clocks; sent before every other event.
    Clock {
        clock: Clocks,
    },
    Begun,
    Frame(FrameEvent),
    Files(FilesEvent),
    Job(JobEvent),
    Export(ExportEvent),
    Template(TemplateEvent),
    Level(LevelEvent),
    TouchOff(TouchOffEvent),
    SecondSide(SecondSideEvent),
    Lab(LabEvent),
    Draw(DrawEvent),
    Play(PlayEvent),
    Press(PressEvent),
    Lines(ListingEvent),
    Machines(MachineEvent),
    Settings(SettingsEvent),
    Keep(KeepEvent),
    /// Newer exports of the open board's files.
    Anew(AnewEvent),
    Progress {
        number: u32,
        /// From 0 to 1.
        share: f64,
    },
    Answered {
        /// The request's number; only answers that the model waits for are used.
        number: u32,
        answer: Result<Answer, Stopped>,
    },
    /// The plan's inputs have not changed for a while.
    Rested {
        number: u32,
    },
    Cancelled,
    Link(LinkEvent),
    Start(StartEvent),
}

macro_rules! from_parts {
    ($($part:ident($event:ident)),*) => {
        $(impl From<$event> for Event {
            fn from(event: $event) -> Self {
                Self::$part(event)
            }
        })*
    };
}
from_parts!(
    Frame(FrameEvent),
    Files(FilesEvent),
    Job(JobEvent),
    Export(ExportEvent),
    Template(TemplateEvent),
    Keep(KeepEvent),
    Anew(AnewEvent),
    Level(LevelEvent),
    TouchOff(TouchOffEvent),
    SecondSide(SecondSideEvent),
    Lab(LabEvent),
    Draw(DrawEvent),
    Play(PlayEvent),
    Press(PressEvent),
    Lines(ListingEvent),
    Machines(MachineEvent),
    Settings(SettingsEvent),
    Link(LinkEvent),
    Start(StartEvent)
);

impl Default for Model {
    fn default() -> Self {
        Self {
            clock: Clocks::default(),
            frame: Frame::default(),
            machine: Arc::new(machine::virtual_drill()),
            machines: Machines::default(),
            board: OpenBoard::default(),
            before: None,
            job: JobEdit::default(),
            visited: Visited::default(),
            coming: 0,
            on_the_way: OnTheWay::default(),
            export: Export::default(),
            template: Template::default(),
            link: Link::default(),
            start: Start::default(),
            level: Leveling::default(),
            touch_off: TouchOff::default(),
            second_side: SecondSide::default(),
            lab: Lab::default(),
            draw: Draw::default(),
            play: Play::default(),
            presses: Presses::default(),
            lines: Listing::default(),
            underside: Underside::default(),
            settings: SettingsDraft::default(),
            applied: settings::Applied::default(),
            keeping: Keeping::default(),
            job_board: job_board::JobBoard::default(),
            anew: Anew::default(),
            asked: None,
            changed_ms: None,
            request: 0,
        }
    }
}

impl Model {
    pub fn task(&self) -> Option<WorkerTask> {
        self.export.task().or_else(|| self.on_the_way.task())
    }

    /// True if the displayed plan may be exported or sent: it matches the job, is proved, and the user has
    /// accepted every problem.
    pub fn cleared(&self) -> bool {
        self.board.proved.is_some() && !self.board.stale && self.board.unread(&self.job.read) == 0
    }

    /// Number of the latest change that waits to be saved.
    #[cfg(test)]
    fn keeping_change(&self) -> u32 {
        self.keeping.change()
    }

    /// Number of open points on a screen: errors that are not accepted, and problems of the job.
    pub fn to_fix(&self, tab: Tab) -> usize {
        let board = &self.board;
        match tab {
            Tab::Board => {
                board.document.as_ref().map_or(0, |document| document.unseen_errors(&board.accepted).count())
            }
            Tab::Cam => {
                let unseen = |why: &&Diagnostic| !board.accepted.contains(&why.code);
                board.unread(&self.job.read) + board.refused.iter().filter(unseen).count()
            }
            _ => 0,
        }
    }

    fn next_request(&mut self) -> u32 {
        self.request += 1;
        self.request
    }
}

impl From<HandEvent> for Event {
    fn from(event: HandEvent) -> Self {
        Self::Link(LinkEvent::Hand(event))
    }
}

/// What follows from the new state after every event. Each makes one part of the model agree with the others;
/// the order matters.
const RECONCILERS: [fn(&mut Model) -> Vec<Effect>; 20] = [
    // Before `keeping`, which saves the board to go back to only while it is offered.
    files::follow,
    // These two may start a reading, which planning waits for.
    files::anew::follow,
    drawing::follow,
    // A changed job or machine needs another plan.
    planning::follow,
    // A changed board or job is saved; slots that nothing needs any longer are released.
    keeping::follow,
    // A changed postprocessor or program is checked.
    template::follow,
    // A new plan starts from its beginning: before the address, which may name a second of it.
    play::follow,
    address::follow,
    // After the address, which may open another screen.
    next::follow,
    // The list of lines shows the plan, and the underside the stock, of the playback above.
    lines::follow,
    carved::follow,
    // Aligns the planned job: before `start`, which shows the aligned one.
    second_side::follow,
    start::follow,
    // These two look at the job that `start` shows.
    job_board::follow,
    level::follow,
    // A touched part is done once the machine is idle again.
    touch_off::follow,
    // The page's virtual drill plays the chosen machine.
    machines::follow,
    // What the browser must know: confirm before leaving, keep the screen on.
    link::controller::follow,
    frame::follow,
    // A draft of the settings, and the way back from the last ones, exist only on their screen.
    settings::follow,
];

/// Handles one event, and then everything that follows from the new state, for example planning and saving.
pub fn update(model: &mut Model, event: Event) -> Vec<Effect> {
    let work_before = model.job.work.clone();
    let mut effects = match event {
        Event::Clock { clock } => {
            // Precedes every other event, after which the steps below run anyway.
            model.clock = clock;
            return Vec::new();
        }
        Event::Begun => keeping::begun(),
        Event::Frame(FrameEvent::Taken { number }) => offered(model, number),
        Event::Frame(FrameEvent::Go { address }) => address::go(model, &address),
        Event::Frame(event) => frame::update(model, event),
        Event::Files(event) => files::update(model, event),
        Event::Job(event) => job::update(model, event),
        Event::Export(event) => export::update(model, event),
        Event::Template(event) => template::update(model, event),
        Event::Keep(KeepEvent::Taken { place, files, job, own }) => taken(model, (place, own), files, job),
        Event::Keep(event) => {
            let of_drawing = match event {
                KeepEvent::Looked => drawing::kept::looked(model),
                KeepEvent::Leaving => drawing::kept::left(model),
                KeepEvent::Listed => drawing::kept::listed(model),
                KeepEvent::DropAll => drawing::kept::drop_all(model),
                _ => Vec::new(),
            };
            let mut effects = keeping::update(model, event);
            effects.extend(of_drawing);
            effects
        }
        Event::Anew(event) => files::anew::update(model, event),
        Event::Progress { number, share } => worker::progress(model, number, share),
        Event::Answered { number, answer } => worker::answered(model, number, answer),
        Event::Rested { number } => planning::rested(model, number),
        Event::Cancelled => planning::cancelled(model),
        Event::Level(event) => level::update(model, event),
        Event::TouchOff(event) => touch_off::update(model, event),
        Event::SecondSide(event) => second_side::update(model, event),
        Event::Lab(event) => lab::update(model, event),
        Event::Draw(event) => drawing::update(model, event),
        Event::Link(event) => linked(model, event),
        Event::Play(event) => play::update(model, event),
        Event::Press(event) => presses::update(model, event),
        Event::Lines(event) => lines::update(model, event),
        Event::Machines(event) => machines::update(model, event),
        Event::Settings(event) => settings::update(model, event),
        Event::Start(event) => start::update(model, event),
    };
    if work_before.as_ref().map(Arc::as_ptr) != model.job.work.as_ref().map(Arc::as_ptr) {
        // The written G-code no longer matches the job.
        export::forget(model);
    }
    effects.extend(RECONCILERS.iter().flat_map(|reconcile| reconcile(model)));
    effects
}

fn offered(model: &mut Model, number: u32) -> Vec<Effect> {
    match frame::taken(&mut model.frame, number) {
        Some(ToastAct::Review) => files::update(model, FilesEvent::Review),
        Some(ToastAct::TakeBackBoard { place }) => keeping::taken_back(model, place),
        Some(ToastAct::TakeBackDrawing { place }) => drawing::kept::taken_back(model, place),
        Some(ToastAct::DrawnBefore) => drawing::update(model, DrawEvent::Back),
        Some(ToastAct::BoardBefore) => files::update(model, FilesEvent::Back),
        Some(ToastAct::MachineBefore) => machines::taken_back(model),
        Some(ToastAct::TakeAnew) => {
            model.anew.want();
            Vec::new()
        }
        Some(ToastAct::UndoSettings) => settings::undo(model),
        Some(ToastAct::Update) => {
            model.frame.update_ready = false;
            vec![Effect::TakeUpdate]
        }
        None => Vec::new(),
    }
}

/// Opens a restored project if it still exists and the user still wants it.
fn taken(
    model: &mut Model,
    (place, own): (u32, bool),
    files: Option<Vec<u8>>,
    job: Option<String>,
) -> Vec<Effect> {
    match keeping::taken(model, place, files, own) {
        Ok(Some((project, held))) => {
            if held.is_none() {
                keeping::say_elsewhere(model, &project.name);
            }
            files::open_project(model, project, job, held)
        }
        Ok(None) => Vec::new(),
        Err(effect) => vec![effect],
    }
}

/// Handles an event of the link; the Lab also records the machine's inputs.
fn linked(model: &mut Model, event: LinkEvent) -> Vec<Effect> {
    let effects = link::update(model, event);
    if let Some(status) = &model.link.status {
        model.lab.told(model.clock.wall_ms, status.inputs);
    }
    effects
}
