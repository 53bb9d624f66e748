//! Requests of the model to the outside, as plain data. Many of them come back as an event.

use super::Event;
use crate::engine::messages::Request;
use annulus_core::wire::Paired;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    Board,
    /// Computes the times of the plan that the board's worker proves; ends with its answer.
    Times,
    /// Checks postprocessor templates.
    Template,
    /// A worker for this request only, in parallel with the others.
    Beside,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// Ask a worker; answered by [`Event::Progress`] and [`Event::Answered`].
    Ask {
        lane: Lane,
        /// Repeated in the answer.
        number: u32,
        request: Box<Request>,
    },
    /// Terminate a worker; its waiting request is answered as cancelled.
    CallOff {
        lane: Lane,
    },
    Wake {
        after_ms: u32,
        event: Box<Event>,
    },
    /// Download a file.
    Save {
        name: String,
        kind: &'static str,
        bytes: Vec<u8>,
    },
    /// Open the file dialog; answered by [`super::FilesEvent::Chosen`], or by [`super::AnewEvent::Chosen`]
    /// for new exports.
    ChooseFiles {
        anew: bool,
    },
    /// Open the file dialog for a postprocessor; answered by [`super::TemplateEvent::Keep`].
    ChooseDialect,
    /// Fetch the sample board; answered by [`super::FilesEvent::Chosen`].
    Sample,
    /// Fetch a linked file; answered by [`super::FilesEvent::Chosen`], or the page shows the error.
    FollowLink {
        address: String,
    },
    /// Request an animation frame; answered by [`super::PlayEvent::Frame`].
    Frame,
    /// Exchange the token in the address for a session; answered by [`super::LinkEvent::Paired`].
    Pair {
        token: String,
    },
    /// Open a socket; sends [`super::LinkEvent::Heard`] for each message and [`super::LinkEvent::Closed`] at
    /// the end.
    Connect,
    /// Open the browser's port dialog; answered by [`super::ControllerEvent::Chosen`].
    ChoosePort,
    /// Open the chosen port, or a known one, in place of the socket; its messages arrive as for a socket.
    ConnectController,
    /// Send STOP to the other tabs of this site: the tab that owns the machine stops it.
    StopBeside {
        /// This tab owns the machine and confirms STOP to the others.
        heard: bool,
    },
    LeavePort,
    /// Remember across a reload whether this tab uses a controller.
    KeepController {
        on: bool,
    },
    /// Remember across a reload the identity of this tab's controller.
    KeepBoard {
        /// Firmware, version and settings, as one text.
        greeting: String,
    },
    /// Turn the browser's confirmation before leaving the page on or off.
    Guard {
        on: bool,
    },
    /// Send feed hold to the controller at once: the page is closing.
    HoldPort,
    /// Send a text on the socket; answered by [`super::LinkEvent::NotSent`] if the socket isn't open.
    Send {
        text: String,
    },
    /// Remember across a reload whether this tab has control.
    KeepControl {
        /// This tab has control, or lost it without giving it away.
        had: bool,
    },
    /// Remember the Lab's setup across a reload of this tab.
    KeepBench {
        text: String,
    },
    ForgetSession,
    /// Start or stop the timer that sends [`super::LinkEvent::Renew`] while the machine jogs.
    Renew {
        on: bool,
    },
    /// Upload a program to the bridge; answered by [`super::StartEvent::Uploaded`].
    Upload {
        number: u32,
        bytes: Vec<u8>,
        session: Option<Paired>,
    },
    /// Fetch a program from the bridge; answered by [`super::StartEvent::Fetched`].
    Fetch {
        number: u32,
        /// SHA-256 of the program's bytes.
        key: String,
        session: Option<Paired>,
    },
    /// Load the table of a language; answered by [`super::FrameEvent::Spoken`].
    Speak {
        language: String,
    },
    Colours {
        /// The scheme's name in the style sheet.
        word: &'static str,
    },
    /// Save the user's own keyboard shortcuts.
    KeepOwnKeys {
        /// Empty if there are none.
        text: String,
    },
    /// Save the widths of the panels.
    KeepPanels {
        text: String,
    },
    /// Save the chosen machine and the user's own machines.
    KeepMachines {
        text: String,
    },
    /// Save whether shortcuts of a single character are on.
    KeepSigns {
        on: bool,
    },
    /// Open or close the camera; answered by [`super::SecondSideEvent::Eye`].
    Camera {
        on: bool,
    },
    KeepCamera {
        /// From the spindle axis, mm.
        offset_mm: [f64; 2],
    },
    /// Take or release the screen wake lock; answered by [`super::FrameEvent::Awake`].
    StayAwake {
        on: bool,
    },
    /// List the saved projects; answered by [`super::KeepEvent::Found`].
    LookInStore,
    /// Save a job, with its files if they are not in the store yet; answered by
    /// [`super::KeepEvent::Written`]. This tab then holds the slot.
    WriteStore {
        /// `None`: a free slot, else the slot written longest ago that no tab holds.
        place: Option<u32>,
        name: String,
        job: String,
        files: Option<Vec<u8>>,
        /// Ms since 1970.
        at_ms: f64,
    },
    /// Save a job synchronously while the page closes; the next write of the store replaces it.
    LeaveInStore {
        place: u32,
        job: String,
        at_ms: f64,
    },
    /// Release a slot, so that other tabs can use it.
    LetGoOfPlace {
        place: u32,
    },
    /// Read a slot, and hold it unless another tab does; answered by [`super::KeepEvent::Taken`].
    TakeFromStore {
        place: u32,
        /// No tab is known to hold the slot; a tab that still does is just closing.
        is_free: bool,
    },
    /// List the saved drawings; answered by [`super::DrawEvent::Found`].
    LookForDrawings {
        /// Include the text of this tab's own drawing.
        own: bool,
    },
    /// Save a drawing; answered by [`super::DrawEvent::Kept`].
    KeepDrawing {
        of: u32,
        /// `None` for a free slot.
        place: Option<u32>,
        name: String,
        text: String,
        /// Ms since 1970.
        at_ms: f64,
    },
    /// Save a drawing synchronously while the page closes; the next write of the store replaces it.
    LeaveDrawing {
        place: u32,
        text: String,
        at_ms: f64,
    },
    /// Read a saved drawing; answered by [`super::DrawEvent::Opened`].
    TakeDrawing {
        place: u32,
    },
    /// Delete a saved drawing; answered by [`super::DrawEvent::Found`].
    DropDrawing {
        place: u32,
    },
    /// Remember across a reload which saved drawing this tab has open.
    OwnDrawing {
        /// `None` if the drawing isn't saved yet.
        place: Option<u32>,
    },
    /// Fetch the example drawing; answered by [`super::DrawEvent::Opened`].
    DrawExample,
    /// Activate the new version of the site and reload; if another window is open, the page shows a message
    /// instead.
    TakeUpdate,
    /// Delete a saved project; answered by [`super::KeepEvent::Dropped`].
    DropFromStore {
        place: u32,
    },
}

impl Effect {
    pub(super) fn ask(number: u32, request: Request) -> Self {
        Self::Ask { lane: Lane::Board, number, request: Box::new(request) }
    }
}
