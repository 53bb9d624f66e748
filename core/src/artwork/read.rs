//! A whole set of files read together.
//!
//! Comes in: names and bytes. Goes out: an [`Artwork`]. Never fails on content: whatever is wrong is a diagnostic of the
//! file it stands in.

use super::archive::{Budget, Taken, unpack};
use super::boards::{self, Item};
use super::companion::{self, Companion, folder};
use super::detect::{self, What, detect};
use super::gerber::{self, Gerber};
use super::neighbours;
use super::registration::Copper;
use super::text::{decode, holds};
use super::{
    Counts, Digits, DrillFile, Evidence, FileKind, Overrides, Role, Side, Units, Zeros, aperture_list,
    decide, drill_list, measure, names, set, witness,
};
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::Bounds;
use std::collections::{BTreeMap, BTreeSet};

/// A set of files, read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Artwork {
    /// Every file in the order given; members follow their archive.
    pub files: Vec<FileRead>,
}

/// One file, read.
#[derive(Clone, Debug, PartialEq)]
pub struct FileRead {
    /// Its name as given; members are called `archive.zip!/dir/name`.
    pub name: String,
    /// What it is.
    pub kind: FileKind,
    /// What it is for.
    pub role: Role,
    /// Which side of the board it shows.
    pub side: Option<Side>,
    /// Whether its holes are plated, if it says so for all of them, or its name does.
    pub plated: Option<bool>,
    /// The program that wrote it.
    pub generator: Option<String>,
    /// Why it is taken for what it is.
    pub reason: Diagnostic,
    /// Units of the first coordinate.
    pub units: Option<Units>,
    /// Digits before and after the point that is not written.
    pub number_format: Option<Digits>,
    /// Zeros left out.
    pub zeros: Option<Zeros>,
    /// Why the numbers are read so.
    pub evidence: Option<Evidence>,
    /// The holes, if it is a drill file or a layer that stands for one.
    pub drill: Option<DrillFile>,
    /// The layer, if it is Gerber.
    pub gerber: Option<Gerber>,
    /// What there is to say about it.
    pub diagnostics: Vec<Diagnostic>,
    /// A number that equal contents share.
    pub fingerprint: u64,
    /// The board it belongs to, by name; empty where it is of none.
    pub board: String,
}

impl FileRead {
    fn new(name: &str, kind: FileKind, role: Role, reason: Diagnostic) -> Self {
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

    /// A file of which nothing is kept.
    pub(super) fn refused(name: &str, why: Diagnostic) -> Self {
        let why = if why.place.is_some() { why } else { why.at(name, 0, 0) };
        let mut file = Self::new(name, FileKind::Refused, Role::Other, why.clone());
        file.diagnostics.push(why);
        file
    }

    /// Whether it is a drill file, and no layer, with something to drill in it.
    pub(crate) fn is_program_with_holes(&self) -> bool {
        self.kind == FileKind::Drill
            && self.drill.as_ref().is_some_and(|drill| drill.totals() != Counts::default())
    }

    /// Whether anything of it is missing from the result.
    pub fn has_error(&self) -> bool {
        self.diagnostics.iter().any(|diagnostic| diagnostic.severity == Severity::Error)
    }
}

impl Artwork {
    /// The files that make the board unless a person says otherwise: every drill file, equal contents once. Where none of
    /// them has a hole, the drill layers.
    pub fn default_use(&self) -> Vec<usize> {
        self.default_use_among(&(0..self.files.len()).collect::<Vec<_>>())
    }

    /// The same where only some of the files are asked for.
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

    /// What is said of the files at `among` that could not be read at all, of drill files not known for what they are, and of
    /// members that were left out: these are missing from the board.
    pub fn missing(&self, among: &[usize]) -> impl Iterator<Item = &Diagnostic> {
        let files = among.iter().filter_map(|&index| self.files.get(index));
        let missing = files
            .filter(|file| matches!(file.kind, FileKind::Refused | FileKind::Archive | FileKind::Unknown));
        missing.flat_map(|file| &file.diagnostics)
    }

    /// A person says what the layer called `name` is. Files that are no layers are what they are.
    pub fn say_role(&mut self, name: &str, role: Role, side: Option<Side>) {
        let layers = self.files.iter_mut().filter(|file| file.gerber.is_some() && file.name == name);
        for file in layers {
            (file.role, file.side) = (role, side);
            file.reason = Diagnostic::note("kind.person");
        }
    }

    /// The boards that the files at `among` are of, each with its files, in the order of their first ones.
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

    /// Leaves out the files at `others`: they are of another board than the one that is worked on.
    pub fn leave_out(&mut self, others: &[usize]) {
        for &index in others {
            if let Some(file) = self.files.get_mut(index) {
                (file.role, file.side) = (Role::Other, None);
                file.reason = Diagnostic::note("kind.other_board").with("board", &file.board);
            }
        }
    }

    /// Says of drill layers that lie beside drill programs that those come first.
    fn diagnostic_layers_beside_programs(&mut self) {
        if !self.files.iter().any(FileRead::is_program_with_holes) {
            return;
        }
        for file in &mut self.files {
            if file.kind == FileKind::Gerber && file.drill.is_some() {
                let told = Diagnostic::note("set.drill_layer_beside").at(&file.name, 0, 0);
                file.diagnostics.push(told);
            }
        }
    }
}

/// What Gerber without its head is refused with.
const HEADLESS: &str = "refused.gerber_without_format";

/// A file before its content is read through.
struct Pending<'a> {
    name: String,
    bytes: std::borrow::Cow<'a, [u8]>,
    what: What,
    /// Settled already: an archive, or a member that is left out.
    settled: Option<FileRead>,
}

/// Reads a set of files together.
pub fn read_set(files: &[(String, Vec<u8>)], overrides: &Overrides) -> Artwork {
    read_set_telling(files, overrides, &mut |_, _| {})
}

/// The same; `progress` is told how many bytes are read, and how many there are, whenever a file is done.
pub fn read_set_telling(
    files: &[(String, Vec<u8>)],
    overrides: &Overrides,
    progress: &mut dyn FnMut(u64, u64),
) -> Artwork {
    let mut pending = Vec::new();
    let mut budget = Budget::new();
    for (name, bytes) in files {
        collect(name.clone(), bytes.as_slice().into(), 0, &mut budget, &mut pending);
    }
    let total = pending.iter().map(|file| file.bytes.len() as u64).sum();
    let mut done = 0;
    let mut read_through = |file: &Pending<'_>| {
        done += file.bytes.len() as u64;
        progress(done, total);
    };
    let companions: Vec<(usize, Companion)> = pending
        .iter()
        .enumerate()
        .filter(|(_, file)| file.what == What::Report)
        .map(|(index, file)| (index, companion::read(&decode(&file.bytes))))
        .collect();
    let mut layers = layers_of(&pending, overrides, &mut read_through);
    set::recognise(&mut layers);
    let of_board = boards_of(&pending, &layers);
    let asking = pending.iter().zip(&of_board).filter(|(file, _)| file.what == What::Drill);
    let witnesses =
        witness::witnesses(&layers, &of_board, &asking.map(|(_, board)| board.as_str()).collect());
    let mut of_folder: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for (file, board) in pending.iter().zip(&of_board).filter(|(_, board)| !board.is_empty()) {
        of_folder.entry(folder(&file.name)).or_default().insert(board);
    }
    let mut out = Vec::new();
    for ((index, file), layer) in pending.iter().enumerate().zip(&mut layers) {
        let is_layer = layer.is_some();
        let mut read = match (&file.settled, layer.take(), file.what) {
            (Some(settled), ..) => settled.clone(),
            (_, Some(layer), _) => layer,
            (_, _, What::Drill | What::List) => {
                let here = of_folder.get(folder(&file.name)).map_or(0, BTreeSet::len);
                let neighbours = Neighbours {
                    one_board: here < 2,
                    companions: companions
                        .iter()
                        .map(|(at, companion)| (pending[*at].name.as_str(), &*pending[*at].bytes, companion))
                        .collect(),
                    ..witnesses.of(&file.name, of_board.get(index))
                };
                drill_file(&file.name, &file.bytes, file.what, &neighbours, overrides)
            }
            (_, _, what) => plain(&file.name, what, &file.bytes),
        };
        read.fingerprint = fingerprint(&pending[index].bytes);
        read.board = of_board.get(index).cloned().unwrap_or_default();
        out.push(read);
        if !is_layer {
            read_through(file);
        }
    }
    neighbours::settle(&mut out);
    let mut artwork = Artwork { files: out };
    artwork.diagnostic_layers_beside_programs();
    artwork
}

/// The layers among `files`, before it is known what each is for. `read_through` is told of each.
fn layers_of<'p>(
    files: &[Pending<'p>],
    overrides: &Overrides,
    read_through: &mut impl FnMut(&Pending<'p>),
) -> Vec<Option<FileRead>> {
    let mut layers = Vec::with_capacity(files.len());
    for file in files {
        let layer = match file.what {
            What::Gerber if file.settled.is_none() => Some(gerber_file(&file.name, &file.bytes, overrides)),
            What::Refused(HEADLESS) if file.settled.is_none() => headless(file, files, overrides),
            _ => None,
        };
        if layer.is_some() {
            read_through(file);
        }
        layers.push(layer);
    }
    layers
}

/// Reads the bytes of one drill file with nothing beside it.
pub fn read_drill(name: &str, bytes: &[u8]) -> FileRead {
    drill_file(name, bytes, What::Drill, &Neighbours::default(), &Overrides::default())
}

/// What lies beside a drill file.
#[derive(Default)]
pub(super) struct Neighbours<'a> {
    /// Reports: name, bytes, content.
    pub(super) companions: Vec<(&'a str, &'a [u8], &'a Companion)>,
    pub(super) copper: Option<&'a Copper>,
    /// The box of the outline of the same board.
    pub(super) outline: Option<Bounds>,
    /// Whether all drill files and layers of its folder are of one board.
    pub(super) one_board: bool,
}

fn collect<'a>(
    name: String,
    bytes: std::borrow::Cow<'a, [u8]>,
    depth: u32,
    budget: &mut Budget,
    out: &mut Vec<Pending<'a>>,
) {
    let what = detect(&bytes, &decode(&bytes));
    if what != What::Archive {
        out.push(Pending { name, bytes, what, settled: None });
        return;
    }
    let unpacked =
        if depth > 1 { Err(Diagnostic::error("archive.too_deep")) } else { unpack(&bytes, budget) };
    let at = out.len();
    let members = match unpacked {
        Ok(members) => members,
        Err(why) => {
            let refused = FileRead::refused(&name, why);
            out.push(Pending { name, bytes, what, settled: Some(refused) });
            return;
        }
    };
    let reason = Diagnostic::note("kind.archive").with("count", members.len());
    let archive = FileRead::new(&name, FileKind::Archive, Role::Other, reason);
    let inside = format!("{name}!/");
    out.push(Pending { name, bytes, what, settled: Some(archive) });
    for member in members {
        let name = format!("{inside}{}", member.name);
        match member.taken {
            Taken::Bytes(bytes) => collect(name, bytes.into(), depth + 1, budget, out),
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

/// The boards that files are of, by name.
fn boards_of(files: &[Pending<'_>], layers: &[Option<FileRead>]) -> Vec<String> {
    let items: Vec<Item<'_>> = files
        .iter()
        .zip(layers)
        .map(|(file, layer)| {
            let drill = file.settled.is_none() && matches!(file.what, What::Drill | What::List);
            let role = layer.as_ref().map(|layer| (layer.role, layer.side));
            let role = role.or(drill.then_some((Role::Drill, None)));
            let project = role.and_then(|_| boards::project(&file.bytes));
            let bounds = layer.as_ref().and_then(|layer| layer.gerber.as_ref()?.centre_bounds());
            Item { name: &file.name, role, project, fingerprint: fingerprint(&file.bytes), bounds }
        })
        .collect();
    boards::boards(&items)
}

/// A layer; what it is for is found when all layers of its folder are known.
fn gerber_file(name: &str, bytes: &[u8], person: &Overrides) -> FileRead {
    let (layer, diagnostics) = gerber::read(name, &decode(bytes), person);
    let unknown = Diagnostic::note("kind.gerber");
    let mut file = FileRead::new(name, FileKind::Gerber, Role::Other, unknown);
    file.diagnostics = diagnostics;
    (file.units, file.number_format, file.zeros) = (layer.units, layer.digits, layer.zeros);
    file.generator = layer.generator.clone();
    file.gerber = Some(layer);
    file
}

/// A layer without head (RS-274-D), if an aperture list lies beside it and a person says its format.
fn headless(file: &Pending<'_>, all: &[Pending<'_>], person: &Overrides) -> Option<FileRead> {
    let beside =
        |other: &&Pending<'_>| other.what == What::Report && folder(&other.name) == folder(&file.name);
    let lists: Vec<_> = all.iter().filter(beside).map(|other| decode(&other.bytes)).collect();
    let lists: Vec<&[u8]> = lists.iter().map(AsRef::as_ref).collect();
    let mut text = aperture_list::head(&lists, person).filter(|_| !lists.is_empty())?.into_bytes();
    text.extend_from_slice(&decode(&file.bytes));
    let mut read = gerber_file(&file.name, &text, person);
    read.diagnostics.push(Diagnostic::note("gerber.head_from_list").at(&file.name, 0, 0));
    Some(read)
}

fn drill_file(
    name: &str,
    bytes: &[u8],
    what: What,
    neighbours: &Neighbours<'_>,
    person: &Overrides,
) -> FileRead {
    let text = decode(bytes);
    let read = if what == What::List {
        list(name, &text, person)
    } else {
        decide::program(name, &text, neighbours, person)
    };
    match read {
        Ok(mut file) => {
            file.plated = file.plated.or_else(|| same_plating(&file)).or_else(|| plated_by_name(name));
            file
        }
        Err(why) => FileRead::refused(name, why),
    }
}

fn list(name: &str, text: &[u8], person: &Overrides) -> Result<FileRead, Diagnostic> {
    let list = drill_list::read(name, text, person)?;
    let mut file = FileRead::new(name, FileKind::Drill, Role::Drill, Diagnostic::note("kind.drill_list"));
    file.units = Some(list.units);
    file.zeros = Some(Zeros::Decimal);
    let source = list.units_by;
    file.evidence = Some(Evidence::plain(source));
    file.diagnostics = list.diagnostics;
    file.diagnostics.extend(measure::faults(name, &list.drill, list.units.name()));
    file.drill = Some(list.drill);
    Ok(file)
}

/// A drill program's file, still without content.
pub(super) fn drill_program(name: &str) -> FileRead {
    FileRead::new(name, FileKind::Drill, Role::Drill, Diagnostic::note("kind.drill_program"))
}

fn same_plating(file: &FileRead) -> Option<bool> {
    let tools = &file.drill.as_ref()?.tools;
    let first = tools.first()?.plated;
    if tools.iter().all(|tool| tool.plated == first) { first } else { None }
}

/// Whether the name says that holes are plated, or that they are not.
pub(super) fn plated_by_name(name: &str) -> Option<bool> {
    let base = companion::base(name).to_ascii_lowercase();
    let not =
        ["npth", "non-plated", "nonplated", "non_plated", "unplated"].iter().any(|word| base.contains(word));
    if not { Some(false) } else { (base.contains("pth") || base.contains("plated")).then_some(true) }
}

/// A file that is neither layer nor drill file nor archive. What has coordinates is never left out without a word.
fn plain(name: &str, what: What, bytes: &[u8]) -> FileRead {
    let mut file = plain_kind(name, what);
    let text = decode(bytes);
    let unread = matches!(what, What::Report | What::Unknown);
    let rows = what == What::Unknown;
    if let Some((count, line)) = unread.then(|| detect::coordinates(&text, rows)).flatten() {
        let warning = Diagnostic::warning("file.coordinates_unread").at(name, line, 1);
        file.diagnostics.push(warning.with("count", count));
    }
    file
}

fn plain_kind(name: &str, what: What) -> FileRead {
    match what {
        What::Refused(code) => match names::foreign(companion::base(name), code) {
            Some(reason) => FileRead::new(name, FileKind::Unknown, Role::Other, Diagnostic::note(reason)),
            None => FileRead::refused(name, Diagnostic::error(code)),
        },
        What::Report => FileRead::new(name, FileKind::Report, Role::Other, Diagnostic::note("kind.report")),
        What::Placement => {
            FileRead::new(name, FileKind::Unknown, Role::Other, Diagnostic::note("kind.placement"))
        }
        What::Packed(format) => {
            let reason = Diagnostic::note("kind.packed").with("format", format);
            let mut file = FileRead::new(name, FileKind::Unknown, Role::Other, reason);
            let warning = Diagnostic::warning("archive.not_opened").at(name, 0, 0);
            file.diagnostics.push(warning.with("format", format));
            file
        }
        _ if names::is_called_like_layer(companion::base(name)) => {
            FileRead::refused(name, Diagnostic::error("gerber.not_recognised"))
        }
        _ => {
            let mut file =
                FileRead::new(name, FileKind::Unknown, Role::Other, Diagnostic::note("kind.unknown"));
            if holds(name.as_bytes(), ".drl")
                || holds(name.as_bytes(), ".xln")
                || holds(name.as_bytes(), ".exc")
            {
                file.diagnostics.push(Diagnostic::error("drill.not_recognised").at(name, 0, 0));
            }
            file
        }
    }
}

/// FNV-1a over the bytes, eight at a time.
fn fingerprint(bytes: &[u8]) -> u64 {
    let step = |hash: u64, value: u64| (hash ^ value).wrapping_mul(0x0100_0000_01b3);
    let (words, rest) = bytes.as_chunks::<8>();
    let hash = words.iter().fold(0xcbf2_9ce4_8422_2325, |hash, word| step(hash, u64::from_le_bytes(*word)));
    rest.iter().fold(step(hash, bytes.len() as u64), |hash, &byte| step(hash, u64::from(byte)))
}
