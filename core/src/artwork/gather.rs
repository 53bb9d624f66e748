//! Collects the files of a set and the members of its archives before parsing, and decides which to ignore.
//! After parsing, [`settle`] lowers the severity for copies of layers and for unreadable archives next to
//! layers.
//!
//! ```text
//!   b.GTL       read                       ._b.GTL, Thumbs.db     left by an operating system: ignored
//!   b.GTL~      the same bytes: a note     b.project              saved by Annulus, next to layers: ignored
//! ```

use super::archive::{Budget, Taken, lists, unpack};
use super::companion::base;
use super::detect::{What, detect};
use super::machine_program::is_our_drill;
use super::names::{is_called_like_drill, is_called_like_layer};
use super::orphans;
use super::text::{decode, holds};
use super::{FileKind, FileRead, Role};
use crate::diagnostic::{Diagnostic, Severity};
use crate::{code, error, note};
use std::collections::BTreeMap;

/// The archive member that marks a saved project.
pub const PROJECT_HEAD: &str = "annulus.json";

pub(super) struct Pending<'a> {
    pub(super) name: String,
    pub(super) bytes: std::borrow::Cow<'a, [u8]>,
    pub(super) what: What,
    /// The result if parsing isn't needed: for an archive, an ignored file or a rejected member.
    pub(super) settled: Option<FileRead>,
}

/// Whether to read files that Annulus wrote, by kind.
#[derive(Clone, Copy, Debug)]
struct Own {
    /// Read saved projects like any other zip.
    projects: bool,
    /// Read drill files of planned jobs like any other drill file.
    drills: bool,
}

/// Between the name of an archive and that of its member.
const INSIDE: &str = "!/";
/// The reason for ignoring a saved project.
const PROJECT: &str = code!("kind.project");
/// Reason for ignoring a drill file of a planned job.
const OWN_DRILL: &str = code!("kind.own_drill");

/// All files, with the members of archives. Ignores saved projects if the set has other layers or holes, and
/// drill files of planned jobs if it has other holes.
pub(super) fn all(files: &[(String, Vec<u8>)]) -> Vec<Pending<'_>> {
    let (mut given, mut budget) = (Vec::new(), Budget::new());
    for (name, bytes) in files {
        let own = Own { projects: false, drills: false };
        collect(name.clone(), bytes.as_slice().into(), (0, own), &mut budget, &mut given);
    }
    let any = |is: &dyn Fn(&Pending<'_>) -> bool| given.iter().any(is);
    let has_holes = any(&has_holes);
    let has_board = has_holes || any(&|file| file.settled.is_none() && file.what == What::Gerber);
    let left = |code: &str| any(&|file| file.settled.as_ref().is_some_and(|file| file.reason.code == code));
    let own = Own { projects: left(PROJECT) && !has_board, drills: left(OWN_DRILL) && !has_holes };
    let mut all = Vec::new();
    for file in given {
        let code = file.settled.as_ref().map(|file| file.reason.code.as_str());
        if own.projects && code == Some(PROJECT) || own.drills && code == Some(OWN_DRILL) {
            let depth = file.name.matches(INSIDE).count() as u32;
            collect(file.name, file.bytes, (depth, own), &mut budget, &mut all);
        } else {
            all.push(file);
        }
    }
    all
}

fn has_holes(file: &Pending<'_>) -> bool {
    let is_layer = || {
        let text = decode(&file.bytes);
        ["FileFunction,Plated", "FileFunction,NonPlated"].iter().any(|function| holds(&text, function))
    };
    file.settled.is_none()
        && (matches!(file.what, What::Drill | What::List) || file.what == What::Gerber && is_layer())
}

/// The result for a file that is ignored unread, with the reason; none for others.
fn ignored(name: &str, bytes: &[u8], own: Own) -> Option<FileRead> {
    let is_project = || !own.projects && lists(bytes, PROJECT_HEAD);
    let is_drill = || {
        let text = decode(bytes);
        !own.drills && is_our_drill(&text) && detect(bytes, &text) == What::Drill
    };
    let code = match () {
        () if is_litter(base(name)) => code!("kind.litter"),
        () if is_project() => PROJECT,
        () if is_drill() => OWN_DRILL,
        () => return None,
    };
    Some(FileRead::new(name, FileKind::Unknown, Role::Other, Diagnostic::note(code)))
}

/// True for files that operating systems and office programs leave in folders.
fn is_litter(base: &str) -> bool {
    let lower = base.to_ascii_lowercase();
    let names = [".ds_store", "thumbs.db", "ehthumbs.db", "desktop.ini", ".directory", "icon\r"];
    let fronts = ["._", "~$", ".~lock."];
    names.contains(&lower.as_str()) || fronts.iter().any(|front| lower.starts_with(front))
}

fn collect<'a>(
    name: String,
    bytes: std::borrow::Cow<'a, [u8]>,
    (depth, own): (u32, Own),
    budget: &mut Budget,
    out: &mut Vec<Pending<'a>>,
) {
    if let Some(settled) = ignored(&name, &bytes, own) {
        out.push(Pending { name, bytes, what: What::Unknown, settled: Some(settled) });
        return;
    }
    let what = detect(&bytes, &decode(&bytes));
    if what != What::Archive {
        out.push(Pending { name, bytes, what, settled: None });
        return;
    }
    let unpacked = if depth > 1 { Err(error!("archive.too_deep")) } else { unpack(&bytes, budget) };
    let at = out.len();
    let members = match unpacked {
        Ok(members) => members,
        Err(why) => {
            let refused = FileRead::refused(&name, why);
            out.push(Pending { name, bytes, what, settled: Some(refused) });
            return;
        }
    };
    let reason = note!("kind.archive", count = members.len());
    let archive = FileRead::new(&name, FileKind::Archive, Role::Other, reason);
    let inside = format!("{name}{INSIDE}");
    out.push(Pending { name, bytes, what, settled: Some(archive) });
    for member in members {
        let name = format!("{inside}{}", member.name);
        match member.taken {
            Taken::Bytes(bytes) => collect(name, bytes.into(), (depth + 1, own), budget, out),
            Taken::Refused(why) => {
                let refused = FileRead::refused(&name, why.clone());
                if let Some(archive) = out.get_mut(at).and_then(|archive| archive.settled.as_mut()) {
                    archive.diagnostics.push(why.at(&name, 0, 0));
                }
                out.push(Pending {
                    name,
                    bytes: Vec::new().into(),
                    what: What::Unknown,
                    settled: Some(refused),
                });
            }
        }
    }
}

pub(super) fn fingerprint(bytes: &[u8]) -> u64 {
    let step = |hash: u64, value: u64| (hash ^ value).wrapping_mul(0x0100_0000_01b3);
    let (words, rest) = bytes.as_chunks::<8>();
    let hash = words.iter().fold(0xcbf2_9ce4_8422_2325, |hash, word| step(hash, u64::from_le_bytes(*word)));
    rest.iter().fold(step(hash, bytes.len() as u64), |hash, &byte| step(hash, u64::from(byte)))
}

/// Withdraws questions about copies of used layers, and lowers unreadable archives to warnings if the set has
/// layers.
pub(super) fn settle(files: &mut [FileRead]) {
    withdraw_copies(files);
    lower_archives(files);
}

/// Replaces the question about an unused layer by a note if a used layer has the same bytes.
fn withdraw_copies(files: &mut [FileRead]) {
    let used = files.iter().filter(|file| file.role == Role::Copper && file.side.is_some());
    let used: BTreeMap<u64, String> = used.map(|file| (file.fingerprint, file.name.clone())).collect();
    for file in files.iter_mut().filter(|file| file.gerber.is_some() && file.role != Role::Copper) {
        let is_question = |said: &Diagnostic| orphans::QUESTIONS.contains(&said.code.as_str());
        let twin = used.get(&file.fingerprint).filter(|_| file.diagnostics.iter().any(is_question));
        let Some(twin) = twin else { continue };
        file.diagnostics.retain(|said| !is_question(said));
        file.diagnostics.push(note!("set.same_layer", twin = twin).at(&file.name, 0, 0));
    }
}

/// Lowers errors of unreadable archives and members to warnings if the set has layers or drill files. A
/// member named like a layer or a drill file stays an error, unless the set has another file of that name.
fn lower_archives(files: &mut [FileRead]) {
    let is_board = |file: &&FileRead| file.gerber.is_some() || file.is_program_with_holes();
    let board: Vec<String> = files.iter().filter(is_board).map(|file| file.name.clone()).collect();
    let may_be_missed = |name: &str| {
        let is_called = is_called_like_layer(base(name)) || is_called_like_drill(base(name));
        let mut namesakes = board.iter().filter(|other| base(other).eq_ignore_ascii_case(base(name)));
        !board.is_empty() && (!is_called || namesakes.next().is_some())
    };
    for file in files.iter_mut() {
        let is_of_archive = |said: &&mut Diagnostic| {
            let is_unread = said.code.starts_with("archive.") && said.code != code!("archive.name_clash");
            is_unread && said.severity == Severity::Error
        };
        for said in file.diagnostics.iter_mut().filter(is_of_archive) {
            let of = said.place.as_ref().map_or(file.name.as_str(), |place| place.file.as_str());
            if may_be_missed(of) {
                said.severity = Severity::Warning;
            }
        }
    }
}
