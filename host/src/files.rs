//! The names of the files that a drill or controller in a page uses, and the storage interface.

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum File {
    /// One of the two halves of the journal.
    Slot(bool),
    /// The program of a job. There are two, so that the previous one survives until the journal names the
    /// new one.
    Program(bool),
    Aside,
    Drilled,
    Settings,
    Surface,
    /// One of the two halves of the progress of a controller's job.
    Done(bool),
    /// The program of that job; two files, like [`Self::Program`].
    ControllerProgram(bool),
    /// The lines that are sent for it.
    Sent(bool),
    /// The user's settings for jobs on a controller.
    ControllerSettings,
    /// The height map of the board on a controller.
    HeightMap,
}

impl File {
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

/// Storage. A file that was never written is empty.
pub trait Files {
    fn read(&mut self, file: File) -> Result<Vec<u8>, String>;

    /// Replaces the contents of a file; durable when it returns.
    fn write(&mut self, file: File, bytes: &[u8]) -> Result<(), String>;

    fn append(&mut self, file: File, bytes: &[u8]) -> Result<(), String>;
}
