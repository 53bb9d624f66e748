//! What the model wants done outside of it. Each effect is plain data; who runs it sends an event back where one is due.
//!
//! Goes out: effects. Does not know who runs them.

use super::Event;
use crate::engine::messages::Request;

/// Which worker is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    /// The one that knows the board; [`Effect::CallOff`] ends what it does.
    Board,
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
    /// End whatever the worker of the board does; who waits is told that it was cancelled.
    CallOff,
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
    /// Let the person choose files; comes back as [`super::FilesEvent::Chosen`].
    ChooseFiles,
    /// Let the person choose a dialect; comes back as [`super::TemplateEvent::Keep`].
    ChooseDialect,
    /// Fetch the sample board; comes back as [`super::FilesEvent::Chosen`].
    Sample,
    /// Look for what was kept; comes back as [`super::KeepEvent::Found`].
    LookInStore,
    /// Keep a job, and the files where they are not in the store yet; comes back as [`super::KeepEvent::Written`].
    WriteStore {
        /// Where.
        place: u32,
        /// The name of the board.
        name: String,
        /// The job as text.
        job: String,
        /// The files, packed.
        files: Option<Vec<u8>>,
        /// When, in ms since 1970.
        at_ms: f64,
    },
    /// Take what is kept at a place; comes back as [`super::KeepEvent::Taken`].
    TakeFromStore {
        /// Where.
        place: u32,
    },
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
