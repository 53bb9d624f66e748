//! What the model wants done outside of it. Each effect is plain data; who runs it sends an event back where one is due.
//!
//! Goes out: effects. Does not know who runs them.

use super::Event;
use crate::engine::messages::Request;
use annulus_core::wire::Paired;

/// Which worker is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    /// The one that knows the board.
    Board,
    /// The one that times what that one proves; it ends with its answer.
    Times,
    /// The one that looks through templates.
    Template,
    /// One for this request alone, beside the others.
    Beside,
}

/// Something to be done.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// Ask a worker; comes back as [`Event::Progress`] and [`Event::Answered`].
    Ask {
        /// Which worker.
        lane: Lane,
        /// The number that its answer bears.
        number: u32,
        /// What is wanted.
        request: Box<Request>,
    },
    /// End whatever a worker does; who waits is told that it was cancelled.
    CallOff {
        /// Which worker.
        lane: Lane,
    },
    /// Send `event` after a while.
    Wake {
        /// How long, in ms.
        after_ms: u32,
        /// What then.
        event: Box<Event>,
    },
    /// Give a file to the person.
    Save {
        /// Its name.
        name: String,
        /// Its kind, as browsers call it.
        kind: &'static str,
        /// Its bytes.
        bytes: Vec<u8>,
    },
    /// Let the person choose files; comes back as [`super::FilesEvent::Chosen`], new exports as [`super::AnewEvent::Chosen`].
    ChooseFiles {
        /// New exports of the open board.
        anew: bool,
    },
    /// Let the person choose a dialect; comes back as [`super::TemplateEvent::Keep`].
    ChooseDialect,
    /// Fetch the sample board; comes back as [`super::FilesEvent::Chosen`].
    Sample,
    /// Fetch the file behind a link; comes back as [`super::FilesEvent::Chosen`], or it is told why not.
    FollowLink {
        /// The link.
        address: String,
    },
    /// Tell when the browser draws; comes as [`super::PlayEvent::Frame`].
    Frame,
    /// Exchange the token of the address for a session; comes back as [`super::LinkEvent::Paired`].
    Pair {
        /// The token.
        token: String,
    },
    /// Open a socket; what is heard on it comes as [`super::LinkEvent::Heard`], its end as [`super::LinkEvent::Closed`].
    Connect,
    /// Let the person choose a port; comes back as [`super::ControllerEvent::Chosen`].
    ChoosePort,
    /// Open the port that was chosen, or one that is known, in place of the socket; what the controller there says comes in the same
    /// way.
    ConnectController,
    /// Tell the other tabs of this site of STOP: the one that has the machine stops it.
    StopBeside {
        /// This is the tab that has it, and heard.
        heard: bool,
    },
    /// Let go of the port.
    LeavePort,
    /// Keep over a reload that this tab has a controller, or that it let go of it.
    KeepController {
        /// It has one.
        on: bool,
    },
    /// Keep over a reload how the board greeted that this tab has.
    KeepBoard {
        /// What it said of itself, as one text.
        greeting: String,
    },
    /// Have the browser ask before the page is left, or not.
    Guard {
        /// It asks.
        on: bool,
    },
    /// Hold whatever the controller moves, at once: the page is being left.
    HoldPort,
    /// Send text on the socket; comes back as [`super::LinkEvent::NotSent`] where it is not open.
    Send {
        /// A message of `wire`.
        text: String,
    },
    /// Keep over a reload that this tab has control, or that it has not.
    KeepControl {
        /// It has, or had it and did not give it away.
        had: bool,
    },
    /// Keep the bench of the Lab in this tab over a reload.
    KeepBench {
        /// As text.
        text: String,
    },
    /// Forget the session of this tab.
    ForgetSession,
    /// Begin the beat of a move by hand, or end it; comes as [`super::LinkEvent::Renew`].
    Renew {
        /// Begin.
        on: bool,
    },
    /// Bring a program to the bridge; comes back as [`super::StartEvent::Uploaded`].
    Upload {
        /// The request.
        number: u32,
        /// Its bytes.
        bytes: Vec<u8>,
        /// Who asks.
        session: Option<Paired>,
    },
    /// Fetch a program from the bridge; comes back as [`super::StartEvent::Fetched`].
    Fetch {
        /// The request.
        number: u32,
        /// SHA-256 of its bytes.
        key: String,
        /// Who asks.
        session: Option<Paired>,
    },
    /// Have the table of a language; comes back as [`super::FrameEvent::Spoken`].
    Speak {
        /// Its word.
        language: String,
    },
    /// Show the page in these colours, and keep the choice for the next time.
    Colours {
        /// Their word in the style sheet.
        word: &'static str,
    },
    /// Keep which keys a person moved.
    KeepOwnKeys {
        /// They, as text; empty for none.
        text: String,
    },
    /// Keep how wide the panels are.
    KeepPanels {
        /// As text; empty for as they are by themselves.
        text: String,
    },
    /// Keep whether keys that type something do anything alone.
    KeepSigns {
        /// They do.
        on: bool,
    },
    /// Open the camera, or let go of it; what becomes of it comes as [`super::SecondSideEvent::Eye`].
    Camera {
        /// Open it.
        on: bool,
    },
    /// Keep where the camera looks, for the next time.
    KeepCamera {
        /// From the spindle, mm.
        offset_mm: [f64; 2],
    },
    /// Have the screen stay lit, or not; comes back as [`super::FrameEvent::Awake`].
    StayAwake {
        /// It stays lit.
        on: bool,
    },
    /// Look for what was kept; comes back as [`super::KeepEvent::Found`].
    LookInStore,
    /// Keep a job, and the files where they are not in the store yet; comes back as [`super::KeepEvent::Written`]. This tab holds the
    /// place then.
    WriteStore {
        /// Where; none for a place that no tab holds: a free one, else the one that was written longest ago.
        place: Option<u32>,
        /// The name of the board.
        name: String,
        /// The job as text.
        job: String,
        /// The files, packed.
        files: Option<Vec<u8>>,
        /// When, in ms since 1970.
        at_ms: f64,
    },
    /// Keep a job at once, while the page is being left, until the store is written again.
    LeaveInStore {
        /// Where.
        place: u32,
        /// The job as text.
        job: String,
        /// When, in ms since 1970.
        at_ms: f64,
    },
    /// Let other tabs have this place.
    LetGoOfPlace {
        /// Which.
        place: u32,
    },
    /// Take what is kept at a place, and hold it where no other tab does; comes back as [`super::KeepEvent::Taken`].
    TakeFromStore {
        /// Where.
        place: u32,
        /// Nobody is known to have it: who still does is just leaving.
        is_free: bool,
    },
    /// Look for drawings that are kept; comes back as [`super::DrawEvent::Found`].
    LookForDrawings {
        /// With the text of the one of this tab.
        own: bool,
    },
    /// Keep a drawing; comes back as [`super::DrawEvent::Kept`].
    KeepDrawing {
        /// Which, by the count of drawings.
        of: u32,
        /// Where; none for a place that is free.
        place: Option<u32>,
        /// Its name.
        name: String,
        /// Its text.
        text: String,
        /// When, in ms since 1970.
        at_ms: f64,
    },
    /// Keep a drawing at once, while the page is being left, until the store is written again.
    LeaveDrawing {
        /// Where.
        place: u32,
        /// Its text.
        text: String,
        /// When, in ms since 1970.
        at_ms: f64,
    },
    /// Take a drawing that is kept; comes back as [`super::DrawEvent::Opened`].
    TakeDrawing {
        /// Where.
        place: u32,
    },
    /// Forget a drawing; comes back as [`super::DrawEvent::Found`].
    DropDrawing {
        /// Where.
        place: u32,
    },
    /// The drawing kept there is that of this tab, over a reload.
    OwnDrawing {
        /// Where; none for a drawing that is not kept yet.
        place: Option<u32>,
    },
    /// Fetch the example of a drawing; comes back as [`super::DrawEvent::Opened`].
    DrawExample,
    /// Let the new version of the site take over and show it; where another window is open, that is said.
    TakeUpdate,
    /// Forget what is kept at a place; comes back as [`super::KeepEvent::Dropped`].
    DropFromStore {
        /// Where.
        place: u32,
    },
}

impl Effect {
    /// Asks the worker of the board.
    pub(super) fn ask(number: u32, request: Request) -> Self {
        Self::Ask { lane: Lane::Board, number, request: Box::new(request) }
    }
}
