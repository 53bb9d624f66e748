//! The page as plain data: one [`Model`], one [`Event`], one pure [`update`].
//!
//! ```text
//! screen ─┐                          ┌─▶ the model, as screens read it
//! worker ─┼─ Event ─▶ update(&mut Model) ┤
//! store  ─┘                          └─▶ Effects: what the browser, the worker and the store are asked to do
//! ```
//!
//! Comes in: events, in the order in which they happened; the clock is an event too. Goes out: the next state and effects.
//! Does not know the browser, the screens or the signals they are made of.

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
pub mod network;
pub mod panels;
pub mod planning;
pub mod play;
pub mod rack;
pub mod second_side;
pub mod settings;
pub mod start;
pub mod template;
mod theme;
mod title;
pub mod touch_off;
mod underside;
mod worker;

#[cfg(test)]
mod tests;

pub use asked::WorkerTask;
pub use board::{Document, Job, LaidBoard, OpenBoard, Unseen};
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
pub use network::Network;
pub use panels::Panels;
pub use planning::{OnTheWay, PlanStep};
pub use play::{Play, PlayEvent};
pub use second_side::{Eye, SecondSide, SecondSideEvent, SoughtHole};
pub use settings::{SettingsDraft, SettingsEvent};
pub use start::{Start, StartEvent};
pub use template::{Template, TemplateEvent};
pub use theme::Theme;
pub use touch_off::{TouchOff, TouchOffEvent, TouchTarget, TouchedPart};
pub use underside::Underside;

use crate::engine::Stopped;
use crate::engine::messages::Answer;
use annulus_core::machine::{self, Machine};
use std::sync::Arc;

/// What the clocks say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clocks {
    /// Milliseconds since the page was opened; never goes back.
    pub page_ms: f64,
    /// Milliseconds since 1970.
    pub wall_ms: f64,
}

/// Everything the page knows.
#[derive(Debug)]
pub struct Model {
    /// What the clocks said last.
    pub clock: Clocks,
    /// Which screen, in which units and colours; what is chosen and how it is looked at.
    pub frame: Frame,
    /// The machine that is planned for: the bridge's or the controller's, else the virtual drill.
    pub machine: Arc<Machine>,
    /// The open board and all that follows from it.
    pub board: OpenBoard,
    /// What was open before the review on show, to go back to.
    pub before: Option<Arc<BoardBefore>>,
    /// The job of the open board.
    pub job: JobEdit,
    /// What is on its way from the worker.
    pub on_the_way: OnTheWay,
    /// The job in a controller's words.
    pub export: Export,
    /// The template editor.
    pub template: Template,
    /// The line to the bridge.
    pub link: Link,
    /// Programs of the machine, and the pre-flight.
    pub start: Start,
    /// The height map as it would be touched now.
    pub level: Leveling,
    /// Touching off.
    pub touch_off: TouchOff,
    /// The second side.
    pub second_side: SecondSide,
    /// The Lab.
    pub lab: Lab,
    /// The board editor.
    pub draw: Draw,
    /// The playback.
    pub play: Play,
    /// The lines of the program beside it.
    pub lines: Listing,
    /// What was cut of the other side before.
    pub underside: Underside,
    /// What was typed of the machine's settings.
    pub settings: SettingsDraft,
    /// What is kept in this browser.
    pub keeping: Keeping,
    /// What was opened for the machine's job.
    job_board: job_board::JobBoard,
    /// New exports of the open board.
    pub anew: Anew,
    /// What was planned last, or is being planned.
    asked: Option<asked::Basis>,
    /// When what is planned was changed last; none where the board is planned for the first time.
    changed_ms: Option<f64>,
    /// The number of the last request to the worker.
    request: u32,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The clocks go on; told before every other event.
    Clock {
        /// What they say.
        clock: Clocks,
    },
    /// The page was opened.
    Begun,
    /// Frame and view.
    Frame(FrameEvent),
    /// Files, their reading and its review.
    Files(FilesEvent),
    /// The job.
    Job(JobEvent),
    /// Writing and saving.
    Export(ExportEvent),
    /// The template editor.
    Template(TemplateEvent),
    /// The height map.
    Level(LevelEvent),
    /// Touching off.
    TouchOff(TouchOffEvent),
    /// The second side.
    SecondSide(SecondSideEvent),
    /// The Lab.
    Lab(LabEvent),
    /// The board editor.
    Draw(DrawEvent),
    /// The playback.
    Play(PlayEvent),
    /// The lines of the program beside it.
    Lines(ListingEvent),
    /// What is typed of the machine's settings.
    Settings(SettingsEvent),
    /// What is kept.
    Keep(KeepEvent),
    /// New exports of the open board.
    Anew(AnewEvent),
    /// A request is so far.
    Progress {
        /// Its number.
        number: u32,
        /// From 0 to 1.
        share: f64,
    },
    /// A request is answered.
    Answered {
        /// Its number; the answer to any but those that are waited for is dropped.
        number: u32,
        /// The answer, or why there is none.
        answer: Result<Answer, Stopped>,
    },
    /// Nothing has changed for a while since a plan was made.
    Rested {
        /// Its number.
        number: u32,
    },
    /// The person calls off what the worker does.
    Cancelled,
    /// The line to the bridge.
    Link(LinkEvent),
    /// The pre-flight, and programs of the machine.
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
    Lines(ListingEvent),
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
            board: OpenBoard::default(),
            before: None,
            job: JobEdit::default(),
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
            lines: Listing::default(),
            underside: Underside::default(),
            settings: SettingsDraft::default(),
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
    /// The machine as the bridge describes it; what this page does not know of it stays as in the virtual drill.
    fn describe_machine(&mut self) {
        let preset = machine::virtual_drill();
        let described = machine::apply(&preset, &self.link.settings).unwrap_or(preset);
        if *self.machine != described {
            self.machine = Arc::new(described);
        }
    }

    /// Long work that is told while it lasts.
    pub fn task(&self) -> Option<WorkerTask> {
        self.export.task().or_else(|| self.on_the_way.task())
    }

    /// Whether the plan on show may be exported or sent: it is that of the job, it is proved, every finding was read and every
    /// error seen.
    pub fn cleared(&self) -> bool {
        self.board.proved.is_some() && !self.board.stale && self.board.unread(&self.job.read) == 0
    }

    /// The count of changes of which a rest is waited for.
    #[cfg(test)]
    fn keeping_change(&self) -> u32 {
        self.keeping.change()
    }

    /// A number for the next request.
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

/// Takes one event in. What follows from the new state by itself (planning what is new, keeping it) follows in the same step.
pub fn update(model: &mut Model, event: Event) -> Vec<Effect> {
    let work_before = model.job.work.clone();
    let mut effects = match event {
        Event::Clock { clock } => {
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
        Event::Lines(event) => lines::update(model, event),
        Event::Settings(event) => settings::update(model, event),
        Event::Start(event) => start::update(model, event),
    };
    if work_before.as_ref().map(Arc::as_ptr) != model.job.work.as_ref().map(Arc::as_ptr) {
        // What was written is not what the job says any more.
        export::forget(model);
    }
    files::follow(model);
    effects.extend(files::anew::follow(model));
    effects.extend(drawing::follow(model));
    effects.extend(planning::follow(model));
    effects.extend(keeping::follow(model));
    effects.extend(template::follow(model));
    effects.extend(play::follow(model));
    effects.extend(address::follow(model));
    effects.extend(lines::follow(model));
    effects.extend(underside::follow(model));
    effects.extend(second_side::follow(model));
    effects.extend(start::follow(model));
    effects.extend(job_board::follow(model));
    level::follow(model);
    touch_off::follow(model);
    effects.extend(link::controller::follow(model));
    effects.extend(frame::follow(model));
    settings::follow(model);
    effects
}

/// What a short word offered is done.
fn offered(model: &mut Model, number: u32) -> Vec<Effect> {
    match frame::taken(&mut model.frame, number) {
        Some(ToastAct::Review) => files::update(model, FilesEvent::Review),
        Some(ToastAct::TakeBackBoard { place }) => keeping::taken_back(model, place),
        Some(ToastAct::TakeBackDrawing { place }) => drawing::kept::taken_back(model, place),
        Some(ToastAct::DrawnBefore) => drawing::update(model, DrawEvent::Back),
        Some(ToastAct::BoardBefore) => files::update(model, FilesEvent::Back),
        Some(ToastAct::TakeAnew) => {
            model.anew.want();
            Vec::new()
        }
        Some(ToastAct::Update) => {
            model.frame.update_ready = false;
            vec![Effect::TakeUpdate]
        }
        None => Vec::new(),
    }
}

/// What was kept is opened, where it was wanted and is there.
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

/// What the line tells of the inputs goes to the Lab too.
fn linked(model: &mut Model, event: LinkEvent) -> Vec<Effect> {
    let effects = link::update(model, event);
    if let Some(status) = &model.link.status {
        model.lab.told(model.clock.wall_ms, status.inputs);
    }
    effects
}
