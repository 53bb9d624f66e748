//! What the page is called: by the open board, else by the job that the machine has.
//!
//! Comes in: the model. Goes out: a name, none where nothing has one. Does not know languages.

use super::Model;

impl Model {
    /// The name of the open board; without one, as after a reload while a job is in work, that of the job on the Machine screen.
    pub fn title(&self) -> Option<&str> {
        let board = self.board.document.as_ref().map(|document| document.reading.board.name.as_str());
        let shown = self.start.shown.as_ref().map(|job| job.program.name.as_str());
        let told = self.link.status.as_ref().and_then(|status| status.job_name.as_deref());
        [board, shown, told].into_iter().flatten().find(|name| !name.is_empty())
    }
}
