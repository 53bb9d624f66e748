//! The title of the page.

use super::Model;

impl Model {
    /// The open board's name. Without a board, for example after a reload during a job, the name of the
    /// machine's job.
    pub fn title(&self) -> Option<&str> {
        let board = self.board.document.as_ref().map(|document| document.reading.board.name.as_str());
        let shown = self.start.shown.as_ref().map(|job| job.program.name.as_str());
        let told = self.link.status.as_ref().and_then(|status| status.job_name.as_deref());
        [board, shown, told].into_iter().flatten().find(|name| !name.is_empty())
    }
}
