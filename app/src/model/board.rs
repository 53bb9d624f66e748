//! The open board: the files as read, the plan, and the proof.

use crate::engine::messages::{Laid, LayerRow, PlanReady, Reading, Timed};
use crate::view::Mesh;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::job::Program;
use annulus_core::project::saved::SaidOfFiles;
use annulus_core::proof::{Verdict, to_be_read};
use annulus_core::units::Length;
use std::collections::BTreeSet;
use std::sync::Arc;

#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    /// Names and bytes as opened.
    pub files: Vec<(String, Vec<u8>)>,
    /// The user's choices for the import.
    pub said: SaidOfFiles,
    pub job: Option<String>,
    pub reading: Reading,
    pub meshes: Vec<Arc<Mesh>>,
    pub boards: Vec<Arc<Mesh>>,
}

impl Document {
    /// Moves the triangles out of `reading` into handles of their own.
    pub fn new(
        files: Vec<(String, Vec<u8>)>,
        said: SaidOfFiles,
        job: Option<String>,
        mut reading: Reading,
    ) -> Self {
        let meshes = take_meshes(&mut reading.layers);
        let boards =
            reading.boards.iter_mut().map(|board| Arc::new(std::mem::take(&mut board.mesh))).collect();
        Self { files, said, job, reading, meshes, boards }
    }

    /// All problems: those of the files in order, then those of the board.
    pub fn diagnostics(&self) -> impl Iterator<Item = &Diagnostic> {
        self.reading.files.iter().flat_map(|file| &file.read.diagnostics).chain(self.board_diagnostics())
    }

    /// Problems of the board that no file reports already.
    pub fn board_diagnostics(&self) -> impl Iterator<Item = &Diagnostic> {
        let said = |diagnostic: &Diagnostic| {
            self.reading.files.iter().any(|file| file.read.diagnostics.contains(diagnostic))
        };
        self.reading.diagnostics.iter().filter(move |diagnostic| !said(diagnostic))
    }

    /// The gravest kind of error whose code is not in `accepted`.
    pub fn unseen(&self, accepted: &BTreeSet<String>) -> Option<Unseen> {
        let kinds = self.unseen_errors(accepted).map(|diagnostic| match diagnostic.code.as_str() {
            "board.several" => Unseen::Several,
            code if code.starts_with("board.") => Unseen::Board,
            _ => Unseen::Unread,
        });
        kinds.min()
    }

    /// Errors whose codes are not in `accepted`.
    pub fn unseen_errors(&self, accepted: &BTreeSet<String>) -> impl Iterator<Item = &Diagnostic> {
        let open = move |diagnostic: &&Diagnostic| {
            diagnostic.severity == Severity::Error && !accepted.contains(&diagnostic.code)
        };
        self.diagnostics().filter(open)
    }

    /// True if the files have any part of a board.
    pub fn usable(&self) -> bool {
        let board = &self.reading.board;
        !(board.holes.is_empty()
            && board.slots.is_empty()
            && board.outline.is_empty()
            && self.meshes.is_empty())
    }

    /// True if the user must review the import before planning.
    pub fn doubtful(&self) -> bool {
        !self.usable() || self.diagnostics().any(|diagnostic| diagnostic.severity > Severity::Note)
    }
}

/// Why a review is needed, the first reason first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Unseen {
    Several,
    /// Something could not be read.
    Unread,
    /// Everything was read, but a part of the board is missing or uncertain.
    Board,
}

pub(super) fn take_meshes(layers: &mut [LayerRow]) -> Vec<Arc<Mesh>> {
    layers.iter_mut().map(|layer| Arc::new(std::mem::take(&mut layer.mesh))).collect()
}

/// The board as placed for a plan: repeated, flipped.
#[derive(Clone, Debug, PartialEq)]
pub struct LaidBoard {
    pub key: String,
    /// The board without copper, its box, and its layers without triangles.
    pub laid: Laid,
    pub meshes: Vec<Arc<Mesh>>,
}

/// A program with its bytes and digests.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    pub program: Program,
    /// `program`, encoded.
    pub bytes: Vec<u8>,
    /// SHA-256 of the bytes.
    pub key: String,
    /// SHA-256 of the step stream, computed by this page.
    pub stream_digest: String,
}

const MOST_PROBLEMS: usize = 100;
const MOST_ERRORS: usize = 200;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct OpenBoard {
    pub document: Option<Arc<Document>>,
    pub reviewing: bool,
    /// Codes of the errors that the user has accepted.
    pub accepted: BTreeSet<String>,
    /// Diameter of the tool in the spindle, if it is used first.
    pub loaded: Option<Length>,
    pub plan: Option<Arc<PlanReady>>,
    pub timed: Option<Arc<Timed>>,
    pub laid: Option<Arc<LaidBoard>>,
    pub program: Option<Arc<Program>>,
    pub proved: Option<Arc<Verdict>>,
    pub job: Option<Arc<Job>>,
    pub refused: Vec<Diagnostic>,
    /// The displayed plan belongs to an older job.
    pub stale: bool,
    /// The board was just opened without doubts; a toast reports that after planning.
    pub(super) just_opened: bool,
}

impl OpenBoard {
    pub(super) fn clear_plan(&mut self) {
        let kept = std::mem::take(self);
        *self = Self {
            document: kept.document,
            reviewing: kept.reviewing,
            accepted: kept.accepted,
            loaded: kept.loaded,
            stale: kept.stale,
            just_opened: kept.just_opened,
            ..Self::default()
        };
    }

    /// Warnings and errors of refusals, plan and files, at most `MOST_PROBLEMS`.
    pub fn problems(&self) -> Vec<Diagnostic> {
        let all = self.refused.iter().chain(self.of_plan()).chain(self.of_files());
        all.filter(|diagnostic| diagnostic.severity > Severity::Note).take(MOST_PROBLEMS).cloned().collect()
    }

    fn of_plan(&self) -> impl Iterator<Item = &Diagnostic> {
        let of_plan = self.plan.iter().flat_map(|plan| &plan.diagnostics);
        of_plan.filter(|diagnostic| diagnostic.severity > Severity::Note)
    }

    fn of_files(&self) -> impl Iterator<Item = &Diagnostic> {
        let of_files = self.document.iter().flat_map(|document| document.diagnostics());
        of_files.filter(|diagnostic| diagnostic.severity > Severity::Note)
    }

    /// Number of problems that the proof found, accepted or not.
    pub fn found(&self) -> usize {
        let groups = self.proved.iter().flat_map(|proved| &proved.groups);
        groups.map(|group| group.count as usize).sum()
    }

    /// Number of problems that only the Board screen lists: refusals, warnings and errors of the files.
    pub fn of_files_count(&self) -> usize {
        self.refused.len() + self.of_files().count()
    }

    /// Number of all problems, accepted or not. The same on every screen.
    pub fn problem_count(&self) -> usize {
        self.of_files_count() + self.of_plan().count() + self.found()
    }

    /// True if the plan has warnings or errors, or the proof found problems.
    pub(super) fn has_job_problems(&self) -> bool {
        self.found() > 0 || self.of_plan().next().is_some()
    }

    /// Errors of the plan: parts of the board that it leaves out.
    pub fn left_out(&self) -> impl Iterator<Item = &Diagnostic> {
        let errors = |diagnostic: &&Diagnostic| diagnostic.severity == Severity::Error;
        self.plan.iter().flat_map(move |plan| plan.diagnostics.iter().filter(errors)).take(MOST_ERRORS)
    }

    pub fn unseen(&self) -> Option<Unseen> {
        self.document.as_ref()?.unseen(&self.accepted)
    }

    /// True if errors of files or plan are not accepted; planning waits for that.
    pub fn waits_for_person(&self) -> bool {
        let unseen = |diagnostic: &Diagnostic| {
            diagnostic.severity == Severity::Error && !self.accepted.contains(&diagnostic.code)
        };
        self.problems().iter().any(unseen)
    }

    /// Number of problems that must be read and are not in `read`, plus errors of the plan that are not
    /// accepted.
    pub fn unread(&self, read: &BTreeSet<String>) -> usize {
        let findings = self.proved.iter().flat_map(|proved| to_be_read(&proved.groups));
        let new = findings.filter(|(_, id)| !read.contains(*id)).count();
        self.left_out().filter(|error| !self.accepted.contains(&error.code)).count() + new
    }
}
