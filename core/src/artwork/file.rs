//! What is known of each file of a set.

use super::companion::{self, folder};
use super::gerber::Gerber;
use super::words::stem_words;
use super::{Counts, Digits, DrillFile, Evidence, FileKind, Role, Side, Units, Zeros};
use crate::diagnostic::{Diagnostic, Severity};
use crate::{code, note};
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Artwork {
    /// In the given order; members follow their archive.
    pub files: Vec<FileRead>,
}

/// Serialized without `drill` and `gerber`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FileRead {
    /// As given; members are called `archive.zip!/dir/name`.
    pub name: String,
    pub kind: FileKind,
    pub role: Role,
    pub side: Option<Side>,
    /// Whether its holes are plated, if content or name gives one answer for all.
    pub plated: Option<bool>,
    pub generator: Option<String>,
    pub reason: Diagnostic,
    /// Units of the first coordinate.
    pub units: Option<Units>,
    /// Digits before and after the implied point.
    pub number_format: Option<Digits>,
    pub zeros: Option<Zeros>,
    pub evidence: Option<Evidence>,
    /// The holes of a drill file or of a Gerber drill layer.
    #[serde(skip)]
    pub drill: Option<DrillFile>,
    #[serde(skip)]
    pub gerber: Option<Gerber>,
    pub diagnostics: Vec<Diagnostic>,
    pub fingerprint: u64,
    /// Name of its board; empty if it belongs to none.
    pub board: String,
}

impl FileRead {
    pub(super) fn new(name: &str, kind: FileKind, role: Role, reason: Diagnostic) -> Self {
        Self {
            name: name.to_owned(),
            kind,
            role,
            side: None,
            plated: None,
            generator: None,
            reason,
            units: None,
            number_format: None,
            zeros: None,
            evidence: None,
            drill: None,
            gerber: None,
            diagnostics: Vec::new(),
            fingerprint: 0,
            board: String::new(),
        }
    }

    /// A rejected file without content.
    pub(super) fn refused(name: &str, why: Diagnostic) -> Self {
        let why = if why.place.is_some() { why } else { why.at(name, 0, 0) };
        let mut file = Self::new(name, FileKind::Refused, Role::Other, why.clone());
        file.diagnostics.push(why);
        file
    }

    /// True for a drill file (not a layer) with something to drill.
    pub(crate) fn is_program_with_holes(&self) -> bool {
        self.kind == FileKind::Drill
            && self.drill.as_ref().is_some_and(|drill| drill.totals() != Counts::default())
    }

    pub(crate) fn is_said(&self) -> bool {
        self.reason.code == code!("kind.person")
    }

    /// True if something of it is missing from the result.
    pub fn has_error(&self) -> bool {
        self.diagnostics.iter().any(|diagnostic| diagnostic.severity == Severity::Error)
    }
}

impl Artwork {
    /// The files to use unless the user chooses: every drill file, without duplicates; if none has a hole,
    /// the drill layers.
    pub fn default_use(&self) -> Vec<usize> {
        self.default_use_among(&(0..self.files.len()).collect::<Vec<_>>())
    }

    /// Like [`Self::default_use`], among some of the files.
    pub fn default_use_among(&self, files: &[usize]) -> Vec<usize> {
        let file = |index: &usize| self.files.get(*index);
        let programs = files.iter().filter_map(file).any(FileRead::is_program_with_holes);
        let mut seen = Vec::new();
        let mut used = Vec::new();
        for &index in files {
            let Some(file) = file(&index) else { continue };
            let layer = !programs && file.kind == FileKind::Gerber && file.drill.is_some();
            if (file.kind == FileKind::Drill && file.role == Role::Drill || layer)
                && !seen.contains(&file.fingerprint)
            {
                seen.push(file.fingerprint);
                used.push(index);
            }
        }
        used
    }

    /// Diagnostics about unreadable files, unrecognised drill files, and members left out, among the files at
    /// `among`. All of these are missing from the board.
    pub fn missing(&self, among: &[usize]) -> impl Iterator<Item = &Diagnostic> {
        let files = among.iter().filter_map(|&index| self.files.get(index));
        let files = files.filter(|file| !self.is_elsewhere(file));
        let missing = files
            .filter(|file| matches!(file.kind, FileKind::Refused | FileKind::Archive | FileKind::Unknown));
        // An archive repeats the diagnostics of its members: count them once.
        let is_own = |file: &FileRead, said: &Diagnostic| {
            let of_other = said.place.as_ref().is_some_and(|place| place.file != file.name);
            file.kind != FileKind::Archive || !of_other
        };
        missing.flat_map(move |file| file.diagnostics.iter().filter(move |said| is_own(file, said)))
    }

    /// True if a file belongs to a board that is left out: as one of its files, or by name, or because its
    /// folder has only such files.
    fn is_elsewhere(&self, file: &FileRead) -> bool {
        let is_left = |file: &FileRead| file.reason.code == code!("kind.other_board");
        if is_left(file) || !file.board.is_empty() {
            return is_left(file);
        }
        let here = || {
            let beside = self.files.iter().filter(|other| folder(&other.name) == folder(&file.name));
            beside.filter(|other| !other.board.is_empty())
        };
        let own = stem_words(companion::base(&file.name));
        let is_namesake = |other: &&FileRead| {
            let stem = stem_words(companion::base(&other.name));
            !own.is_empty() && !stem.is_empty() && own.iter().zip(&stem).all(|(a, b)| a == b)
        };
        if here().any(|other| is_namesake(&other)) {
            return here().filter(is_namesake).all(is_left);
        }
        here().next().is_some() && here().all(is_left)
    }

    /// The boards of the files at `among`, each with its files, in order of first appearance.
    pub fn boards(&self, among: &[usize]) -> Vec<(String, Vec<usize>)> {
        let mut boards: Vec<(String, Vec<usize>)> = Vec::new();
        for &index in among {
            let Some(file) = self.files.get(index).filter(|file| !file.board.is_empty()) else { continue };
            match boards.iter_mut().find(|(name, _)| *name == file.board) {
                Some((_, files)) => files.push(index),
                None => boards.push((file.board.clone(), vec![index])),
            }
        }
        boards
    }

    pub fn leave_out(&mut self, others: &[usize]) {
        for &index in others {
            if let Some(file) = self.files.get_mut(index) {
                (file.role, file.side) = (Role::Other, None);
                file.reason = note!("kind.other_board", board = &file.board);
            }
        }
    }

    /// Adds a note to drill layers next to drill programs: the programs are used.
    pub(super) fn diagnostic_layers_beside_programs(&mut self) {
        if !self.files.iter().any(FileRead::is_program_with_holes) {
            return;
        }
        for file in &mut self.files {
            if file.kind == FileKind::Gerber && file.drill.is_some() {
                let told = note!("set.drill_layer_beside").at(&file.name, 0, 0);
                file.diagnostics.push(told);
            }
        }
    }
}

/// The result for a drill program, still without content.
pub(super) fn drill_program(name: &str) -> FileRead {
    FileRead::new(name, FileKind::Drill, Role::Drill, note!("kind.drill_program"))
}

pub(super) fn plated_by_name(name: &str) -> Option<bool> {
    let base = companion::base(name).to_ascii_lowercase();
    let not =
        ["npth", "non-plated", "nonplated", "non_plated", "unplated"].iter().any(|word| base.contains(word));
    if not { Some(false) } else { (base.contains("pth") || base.contains("plated")).then_some(true) }
}
