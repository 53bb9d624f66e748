//! The open board: what was read, what is planned, what was found in it.
//!
//! Goes out: plain data; the heavy things behind an `Arc`, which is the same as long as nothing new was read or planned. Does
//! not know how it came.

use crate::engine::messages::{Laid, LayerRow, PlanReady, Proved, Reading, Timed};
use crate::view::Mesh;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::job::Program;
use annulus_core::project::saved::SaidOfFiles;
use annulus_core::proof::to_be_read;
use annulus_core::units::Length;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Files and what was read from them.
#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    /// Names and bytes as they were given.
    pub files: Vec<(String, Vec<u8>)>,
    /// What the person says of them.
    pub said: SaidOfFiles,
    /// The job file that came with them, in a saved project.
    pub job: Option<String>,
    /// What came of it.
    pub reading: Reading,
    /// The triangles of each of its layers.
    pub meshes: Vec<Arc<Mesh>>,
    /// The same of each board to choose from.
    pub boards: Vec<Arc<Mesh>>,
}

impl Document {
    /// What was read, its triangles apart from the rest.
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

    /// Every finding, file by file, then those about the board.
    pub fn diagnostics(&self) -> impl Iterator<Item = &Diagnostic> {
        self.reading.files.iter().flat_map(|file| &file.diagnostics).chain(self.board_diagnostics())
    }

    /// Findings about the board that no file has said already.
    pub fn board_diagnostics(&self) -> impl Iterator<Item = &Diagnostic> {
        let said = |diagnostic: &Diagnostic| {
            self.reading.files.iter().any(|file| file.diagnostics.contains(diagnostic))
        };
        self.reading.diagnostics.iter().filter(move |diagnostic| !said(diagnostic))
    }

    /// What a person has to see first, of errors whose codes are not among those `accepted`.
    pub fn unseen(&self, accepted: &BTreeSet<String>) -> Option<Unseen> {
        let kinds = self.unseen_errors(accepted).map(|diagnostic| match diagnostic.code.as_str() {
            "board.several" => Unseen::Several,
            code if code.starts_with("board.") => Unseen::Board,
            _ => Unseen::Unread,
        });
        kinds.min()
    }

    /// Errors whose codes are not among those `accepted`.
    pub fn unseen_errors(&self, accepted: &BTreeSet<String>) -> impl Iterator<Item = &Diagnostic> {
        let open = move |diagnostic: &&Diagnostic| {
            diagnostic.severity == Severity::Error && !accepted.contains(&diagnostic.code)
        };
        self.diagnostics().filter(open)
    }

    /// Whether there is anything of a board in the files.
    pub fn usable(&self) -> bool {
        let board = &self.reading.board;
        !(board.holes.is_empty()
            && board.slots.is_empty()
            && board.outline.is_empty()
            && self.meshes.is_empty())
    }

    /// Whether a person has to look before anything is planned.
    pub fn doubtful(&self) -> bool {
        !self.usable() || self.diagnostics().any(|diagnostic| diagnostic.severity > Severity::Note)
    }
}

/// What has to be seen before a board is used, the first thing first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Unseen {
    /// The files are of several boards.
    Several,
    /// Something in them could not be read.
    Unread,
    /// All was read, and yet something of the board is missing or not certain.
    Board,
}

/// The triangles of `layers`, which have none of their own from then on.
pub(super) fn take_meshes(layers: &mut [LayerRow]) -> Vec<Arc<Mesh>> {
    layers.iter_mut().map(|layer| Arc::new(std::mem::take(&mut layer.mesh))).collect()
}

/// The board as it lies for a plan: copied, turned over.
#[derive(Clone, Debug, PartialEq)]
pub struct LaidBoard {
    /// Tells it from other ways to lie.
    pub key: String,
    /// The board without copper, its box, its layers without their triangles.
    pub laid: Laid,
    /// The triangles of each of its layers.
    pub meshes: Vec<Arc<Mesh>>,
}

/// A program with its bytes and the digest of its steps as this page computed them.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// What to do.
    pub program: Program,
    /// The same as bytes.
    pub bytes: Vec<u8>,
    /// SHA-256 of the bytes.
    pub key: String,
    /// SHA-256 of the step stream.
    pub stream_digest: String,
}

/// The most problems shown at once.
const MOST_PROBLEMS: usize = 100;

/// The open board and all that follows from it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OpenBoard {
    /// The board.
    pub document: Option<Arc<Document>>,
    /// Its import review is on show.
    pub reviewing: bool,
    /// Errors that were seen, by code.
    pub accepted: BTreeSet<String>,
    /// The bit in the spindle, if it is to go first.
    pub loaded: Option<Length>,
    /// The plan.
    pub plan: Option<Arc<PlanReady>>,
    /// The plan in time.
    pub timed: Option<Arc<Timed>>,
    /// The board as it lies for the plan.
    pub laid: Option<Arc<LaidBoard>>,
    /// What the plan does.
    pub program: Option<Arc<Program>>,
    /// What the proof says of the plan.
    pub proved: Option<Arc<Proved>>,
    /// The planned job, once it is timed.
    pub job: Option<Arc<Job>>,
    /// Why there is no plan.
    pub refused: Vec<Diagnostic>,
    /// The plan on show is that of an older job.
    pub stale: bool,
    /// The board was just opened and all in it is certain; said once it is planned.
    pub(super) just_opened: bool,
}

impl OpenBoard {
    /// Nothing is planned.
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

    /// What files and plan have to say that is more than a note, the first hundred.
    pub fn problems(&self) -> Vec<Diagnostic> {
        problems(&self.refused, self.plan.as_deref(), self.document.as_deref())
    }

    /// How many findings nobody has read yet (`read` has the names of those that were), and how many errors of the plan nobody
    /// has seen.
    pub fn unread(&self, read: &BTreeSet<String>) -> usize {
        unread(self.plan.as_deref(), self.proved.as_deref(), &self.accepted, read)
    }
}

/// What refusals, plan and files have to say that is more than a note, the first hundred.
pub fn problems(
    refused: &[Diagnostic],
    plan: Option<&PlanReady>,
    document: Option<&Document>,
) -> Vec<Diagnostic> {
    let of_plan = plan.into_iter().flat_map(|plan| &plan.diagnostics);
    let of_files = document.into_iter().flat_map(Document::diagnostics);
    let all = refused.iter().chain(of_plan).chain(of_files);
    all.filter(|diagnostic| diagnostic.severity > Severity::Note).take(MOST_PROBLEMS).cloned().collect()
}

/// The most errors of a plan that are listed.
const MOST_ERRORS: usize = 200;

/// Errors of a plan: what of the board it leaves out.
pub fn left_out(plan: Option<&PlanReady>) -> impl Iterator<Item = &Diagnostic> {
    let errors = |diagnostic: &&Diagnostic| diagnostic.severity == Severity::Error;
    plan.into_iter().flat_map(move |plan| plan.diagnostics.iter().filter(errors)).take(MOST_ERRORS)
}

/// Errors of the plan that are not among those `accepted`, and findings that must be read and are not among those `read`.
pub fn unread(
    plan: Option<&PlanReady>,
    proved: Option<&Proved>,
    accepted: &BTreeSet<String>,
    read: &BTreeSet<String>,
) -> usize {
    let findings = proved.into_iter().flat_map(|proved| to_be_read(&proved.groups));
    let new = findings.filter(|(_, id)| !read.contains(*id)).count();
    left_out(plan).filter(|error| !accepted.contains(&error.code)).count() + new
}
