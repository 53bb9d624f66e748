//! The files of a drill without threads, and of a controller: what they are called, and what is asked of the place where they lie.
//!
//! Goes out: names. Does not know what is in them, nor where they lie.

/// A file of the drill.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum File {
    /// One of the two halves of the journal.
    Slot(bool),
    /// The program of a job, in turns too: that of the job before stays until the new one is in the journal.
    Program(bool),
    /// A journal that could not be believed.
    Aside,
    /// The drilled-board record.
    Drilled,
    /// The machine's settings.
    Settings,
    /// The height map of the board on the drill.
    Surface,
    /// One of the two halves of what is done of a controller's job.
    Done(bool),
    /// The program of that job, in turns too.
    ControllerProgram(bool),
    /// The same as it is sent.
    Sent(bool),
    /// What a person set for jobs on a controller.
    ControllerSettings,
    /// The height map of the board on a controller.
    HeightMap,
}

impl File {
    /// Those of the virtual drill.
    pub const DRILL: [Self; 8] = [
        Self::Slot(false),
        Self::Slot(true),
        Self::Program(false),
        Self::Program(true),
        Self::Aside,
        Self::Drilled,
        Self::Settings,
        Self::Surface,
    ];

    /// Those of a controller.
    pub const CONTROLLER: [Self; 8] = [
        Self::Done(false),
        Self::Done(true),
        Self::ControllerProgram(false),
        Self::ControllerProgram(true),
        Self::Sent(false),
        Self::Sent(true),
        Self::ControllerSettings,
        Self::HeightMap,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Slot(false) => "journal-0",
            Self::Slot(true) => "journal-1",
            Self::Program(false) => "program-0",
            Self::Program(true) => "program-1",
            Self::Aside => "journal-damaged",
            Self::Drilled => "drilled.txt",
            Self::Settings => "settings",
            Self::Surface => "height-map",
            Self::Done(false) => "controller-0",
            Self::Done(true) => "controller-1",
            Self::ControllerProgram(false) => "controller-program-0",
            Self::ControllerProgram(true) => "controller-program-1",
            Self::Sent(false) => "controller-sent-0.nc",
            Self::Sent(true) => "controller-sent-1.nc",
            Self::ControllerSettings => "controller-settings",
            Self::HeightMap => "controller-height-map",
        }
    }
}

/// Where files lie. A file that was never written is empty.
pub trait Files {
    /// What is in a file.
    fn read(&mut self, file: File) -> Result<Vec<u8>, String>;

    /// Puts `bytes` into a file in place of what was there; they are durable when this returns.
    fn write(&mut self, file: File, bytes: &[u8]) -> Result<(), String>;

    /// Puts `bytes` behind what is there.
    fn append(&mut self, file: File, bytes: &[u8]) -> Result<(), String>;
}
