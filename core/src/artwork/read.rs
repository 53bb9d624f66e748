//! Reads a set of files together. Never fails on content: problems become diagnostics of their file.

use super::boards::{self, Item};
use super::companion::{self, Companion, folder};
use super::detect::{self, What};
use super::drill_format::Neighbours;
use super::file::plated_by_name;
use super::gather::{self, Pending, fingerprint};
use super::gerber::{self, Gerber};
use super::registration::Copper;
use super::text::decode;
use super::{
    Artwork, Evidence, FileKind, FileRead, Overrides, Role, Zeros, aperture_list, drill_format, drill_list,
    names, set, through,
};
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::{code, error, note, warning};
use std::collections::{BTreeMap, BTreeSet};

/// The code for Gerber without its head.
const HEADLESS: &str = code!("refused.gerber_without_format");

pub fn read_set(files: &[(String, Vec<u8>)], overrides: &Overrides) -> Artwork {
    read_set_telling(files, overrides, &mut |_, _| {})
}

/// Like [`read_set`]; calls `progress` with the bytes read and the total after each file.
pub fn read_set_telling(
    files: &[(String, Vec<u8>)],
    overrides: &Overrides,
    progress: &mut dyn FnMut(u64, u64),
) -> Artwork {
    let pending = gather::all(files);
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
    let is_drill =
        |file: &&Pending<'_>| file.settled.is_none() && matches!(file.what, What::Drill | What::List);
    let drills: Vec<&str> = pending.iter().filter(is_drill).map(|file| file.name.as_str()).collect();
    set::recognise(&mut layers, &drills, &mut |of, copper| holes_beside(&pending, of, copper));
    let of_board = boards_of(&pending, &layers);
    let asking = pending.iter().zip(&of_board).filter(|(file, _)| file.what == What::Drill);
    let witnesses =
        drill_format::witnesses(&layers, &of_board, &asking.map(|(_, board)| board.as_str()).collect());
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
    drill_format::settle(&mut out);
    let is_program = |file: &&Pending<'_>| file.settled.is_none() && file.what == What::Drill;
    let spans = pending
        .iter()
        .map(|file| Some(file).filter(is_program).and_then(|file| through::span(&decode(&file.bytes))));
    gather::settle(&mut out);
    let reports = companions.iter().filter_map(|(at, _)| pending.get(*at));
    let pairs: Vec<_> =
        reports.flat_map(|report| through::pairs(&report.name, &decode(&report.bytes))).collect();
    through::settle(&mut out, &spans.collect::<Vec<_>>(), &pairs);
    let mut artwork = Artwork { files: out };
    artwork.diagnostic_layers_beside_programs();
    artwork
}

/// The holes of the drill programs in folder `of`, read with layers that may be copper. If the folder has no
/// drill program, those of all folders.
fn holes_beside(files: &[Pending<'_>], of: &str, copper: &[(&str, &Gerber)]) -> Vec<Point> {
    let drills = || {
        files.iter().filter(|file| file.settled.is_none() && matches!(file.what, What::Drill | What::List))
    };
    let has_own = drills().any(|file| folder(&file.name) == of);
    let copper = Copper::new(copper.iter().copied());
    let neighbours = Neighbours { copper: copper.as_ref(), ..Neighbours::default() };
    let mut holes = Vec::new();
    for file in drills().filter(|file| !has_own || folder(&file.name) == of) {
        let read = drill_file(&file.name, &file.bytes, file.what, &neighbours, &Overrides::default());
        let (x, y) = read.evidence.as_ref().and_then(|evidence| evidence.shift_mm).unwrap_or_default();
        let by = Point::from_mm(x, y);
        let drill = read.drill.iter().flat_map(|drill| drill.centres());
        holes.extend(drill.map(|(at, _)| Point::new(at.x + by.x, at.y + by.y)));
    }
    holes
}

/// The layers among `files`, before their roles are known. Calls `read_through` for each.
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

/// Reads a single drill file, without any other evidence.
pub fn read_drill(name: &str, bytes: &[u8]) -> FileRead {
    drill_file(name, bytes, What::Drill, &Neighbours::default(), &Overrides::default())
}

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

/// A layer. Its role is determined once all layers of its folder are known.
fn gerber_file(name: &str, bytes: &[u8], person: &Overrides) -> FileRead {
    let (layer, diagnostics) = gerber::read(name, &decode(bytes), person);
    let unknown = note!("kind.gerber");
    let mut file = FileRead::new(name, FileKind::Gerber, Role::Other, unknown);
    file.diagnostics = diagnostics;
    (file.units, file.number_format, file.zeros) = (layer.units, layer.digits, layer.zeros);
    file.generator = layer.generator.clone();
    file.gerber = Some(layer);
    file
}

/// A layer without a head (RS-274-D), if there is an aperture list in its folder and the user states the
/// format.
fn headless(file: &Pending<'_>, all: &[Pending<'_>], person: &Overrides) -> Option<FileRead> {
    let beside =
        |other: &&Pending<'_>| other.what == What::Report && folder(&other.name) == folder(&file.name);
    let lists: Vec<_> = all.iter().filter(beside).map(|other| decode(&other.bytes)).collect();
    let lists: Vec<&[u8]> = lists.iter().map(AsRef::as_ref).collect();
    let mut text = aperture_list::head(&lists, person).filter(|_| !lists.is_empty())?.into_bytes();
    text.extend_from_slice(&decode(&file.bytes));
    let mut read = gerber_file(&file.name, &text, person);
    read.diagnostics.push(note!("gerber.head_from_list").at(&file.name, 0, 0));
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
        drill_format::program(name, &text, neighbours, person)
    };
    match read {
        Ok(mut file) => {
            file.plated = file.plated.or_else(|| same_plating(&file)).or_else(|| plated_by_name(name));
            let blind = through::blind(name, &text).filter(|_| file.is_program_with_holes());
            file.diagnostics.extend(blind);
            let tools = file.drill.iter_mut().flat_map(|drill| &mut drill.tools);
            tools.for_each(|tool| tool.plated = tool.plated.or(file.plated));
            file
        }
        Err(why) => FileRead::refused(name, why),
    }
}

fn list(name: &str, text: &[u8], person: &Overrides) -> Result<FileRead, Diagnostic> {
    let list = drill_list::read(name, text, person)?;
    let mut file = FileRead::new(name, FileKind::Drill, Role::Drill, note!("kind.drill_list"));
    file.units = Some(list.units);
    file.zeros = Some(Zeros::Decimal);
    let source = list.units_by;
    file.evidence = Some(Evidence::plain(source));
    file.diagnostics = list.diagnostics;
    file.diagnostics.extend(drill_format::faults(name, &list.drill, list.units.name()));
    file.drill = Some(list.drill);
    Ok(file)
}

fn same_plating(file: &FileRead) -> Option<bool> {
    let tools = &file.drill.as_ref()?.tools;
    let first = tools.first()?.plated;
    if tools.iter().all(|tool| tool.plated == first) { first } else { None }
}

/// A file that is no layer, drill file or archive. Warns if it has coordinates, so that no holes are lost
/// silently.
fn plain(name: &str, what: What, bytes: &[u8]) -> FileRead {
    let mut file = plain_kind(name, what);
    let text = decode(bytes);
    let unread = matches!(what, What::Report | What::Unknown);
    let rows = what == What::Unknown;
    if let Some((count, line)) = unread.then(|| detect::coordinates(&text, rows)).flatten() {
        let warning = warning!("file.coordinates_unread", ..).at(name, line, 1);
        file.diagnostics.push(warning.with("count", count));
    }
    file
}

fn plain_kind(name: &str, what: What) -> FileRead {
    let base = companion::base(name);
    let other = |code: &str| FileRead::new(name, FileKind::Unknown, Role::Other, Diagnostic::note(code));
    match what {
        What::Refused(code) => match names::foreign(base, code) {
            Some(reason) => other(reason),
            None => FileRead::refused(name, Diagnostic::error(code)),
        },
        What::Report => FileRead::new(name, FileKind::Report, Role::Other, note!("kind.report")),
        What::Placement => other(code!("kind.placement")),
        What::Machine if names::is_called_like_drill(base) => {
            missed_drill(other(code!("kind.machine_program")))
        }
        What::Machine if !names::is_called_like_layer(base) => other(code!("kind.machine_program")),
        What::Packed(format) => {
            let reason = note!("kind.packed", format = format);
            let mut file = FileRead::new(name, FileKind::Unknown, Role::Other, reason);
            let warning = warning!("archive.not_opened", ..).at(name, 0, 0);
            file.diagnostics.push(warning.with("format", format));
            file
        }
        _ if names::is_called_like_layer(base) => FileRead::refused(name, error!("gerber.not_recognised")),
        _ if names::is_called_like_drill(base) => missed_drill(other(code!("kind.unknown"))),
        _ => other(code!("kind.unknown")),
    }
}

/// A file named like a drill file without one inside: an error, because its holes are missing.
fn missed_drill(mut file: FileRead) -> FileRead {
    file.diagnostics.push(error!("drill.not_recognised").at(&file.name, 0, 0));
    file
}
