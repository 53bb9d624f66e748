//! The title of the page.

use super::line;
use crate::model::{Job, Model};
use annulus_core::control::State;
use annulus_core::job::Program;
use std::sync::Arc;

#[test]
fn page_title_names_the_running_job() {
    let mut model = Model::default();
    assert_eq!(model.title(), None);
    let mut status = line::status(State::Running, Some("k"));
    status.job_name = Some("amplifier".to_owned());
    model.link.status = Some(Arc::new(status));
    assert_eq!(model.title(), Some("amplifier"), "as soon as the machine tells of it");
    let program = Program { name: "amplifier bottom".to_owned(), ..line::empty() };
    let job = Job { program, bytes: Vec::new(), key: "k".to_owned(), stream_digest: String::new() };
    model.start.shown = Some(Arc::new(job));
    assert_eq!(model.title(), Some("amplifier bottom"), "as its program says");
}
