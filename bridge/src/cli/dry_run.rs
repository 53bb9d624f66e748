//! `--dry-run`: what a command would move. The job is read, planned and checked as usual; no port is opened and
//! nothing moves.

use super::grbl::how::Place;
use super::{Answer, as_objects, diagnostic_lines, rounded, sentence};
use annulus_core::diagnostic::Diagnostic;
use serde::Serialize;
use serde_json::json;
use std::fmt::Display;

/// What would move.
#[derive(Default, Serialize)]
pub(super) struct DryRun {
    pub(super) dry_run: bool,
    /// `None` for G-code without a named machine.
    pub(super) machine: Option<String>,
    pub(super) driven_by: &'static str,
    pub(super) port: Option<String>,
    pub(super) holes: usize,
    pub(super) toolpaths: usize,
    /// Positions that would be probed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) points: Option<usize>,
    /// Without tool changes; `None` if it depends on the controller's settings.
    pub(super) time_s: Option<f64>,
    pub(super) tool_changes: usize,
    pub(super) zero: Zero,
    #[serde(serialize_with = "as_objects")]
    pub(super) diagnostics: Vec<Diagnostic>,
}

/// Origin of the work zero.
#[derive(Clone, Copy, Default, Serialize)]
#[serde(tag = "from", rename_all = "snake_case")]
pub(super) enum Zero {
    /// The position where the tool is.
    Here,
    /// Machine coordinates of a flag, mm.
    At { at_mm: [f64; 2] },
    /// The zero that controller or machine has saved.
    #[default]
    Saved,
    /// The position after homing, at the corner of the virtual drill.
    Homed,
}

impl Zero {
    /// The zero of these options on a real machine.
    pub(super) fn of(zero_at: Option<Place>, here: bool) -> Self {
        match zero_at {
            Some(place) => Self::At { at_mm: place.plane },
            None if here => Self::Here,
            None => Self::Saved,
        }
    }

    fn text(self) -> String {
        match self {
            Self::Here => sentence("dry_run.zero.here", &[]),
            Self::Saved => sentence("dry_run.zero.saved", &[]),
            Self::Homed => sentence("dry_run.zero.homed", &[]),
            Self::At { at_mm: [x, y] } => sentence("dry_run.zero.at", &[("x", &x), ("y", &y)]),
        }
    }
}

impl DryRun {
    /// A dry run on `machine`, which `driver` drives at `port`.
    pub(super) fn on(machine: Option<String>, driver: &'static str, port: Option<String>) -> Self {
        Self { dry_run: true, machine, driven_by: driver, port, ..Self::default() }
    }

    pub(super) fn answer(self) -> Answer {
        let none = || sentence("dry_run.none", &[]);
        let machine = self.machine.clone().unwrap_or_else(none);
        let port = self.port.clone().unwrap_or_else(none);
        let unknown = || sentence("dry_run.no_time", &[]);
        let time = self.time_s.map_or_else(unknown, |time_s| format!("{time_s:.0} s"));
        let line = |key: &str, words: &[(&str, &dyn Display)]| sentence(key, words) + "\n";
        let mut text = line("dry_run.head", &[]);
        text += &line("dry_run.machine", &[("machine", &machine), ("port", &port)]);
        let counts: [(&str, &dyn Display); 4] = [
            ("holes", &self.holes),
            ("toolpaths", &self.toolpaths),
            ("changes", &self.tool_changes),
            ("time", &time),
        ];
        text += &line("dry_run.job", &counts);
        if let Some(points) = self.points {
            text += &line("dry_run.points", &[("points", &points)]);
        }
        text += &line("dry_run.zero.line", &[("zero", &self.zero.text())]);
        text += &diagnostic_lines(&self.diagnostics);
        Answer::new(&Self { time_s: self.time_s.map(rounded), ..self }, text)
    }
}

/// Marks an answer that already describes the motion.
pub(super) fn marked(mut answer: Answer) -> Answer {
    answer.object["dry_run"] = json!(true);
    answer.text = format!("{}\n{}", sentence("dry_run.head", &[]), answer.text);
    answer
}
