//! Files of a set that describe one thing of a board twice, and the reports about them.
//!
//! ```text
//!   board-F_Cu.gbr       used         ┐ the same drawing: a note
//!   old/board-F_Cu.gbr   not used     ┘ a different one:  an error, because the user has to choose
//!
//!   board.drl ─┐ both are drilled. Most positions in common, but not equal: an error,
//!   old/b.drl ─┘ because the user has to choose. Only the name in common: a warning
//! ```
//!
//! This file only reports; the choice is made elsewhere.

use super::Board;
use crate::artwork::{Aperture, Artwork, DrillFile, FileRead, Gerber, Object, Role};
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::{Bounds, Point};
use crate::units::Length;
use crate::{code, error, note};
use std::collections::BTreeMap;

/// Two drill files with at least this many common positions may be two versions of one file.
const MANY: usize = 3;
/// Greatest distance between positions of one hole in files of different units: half of 0.001 inch, rounded.
const ROUNDED: Length = Length::from_um(15);
/// Least number of holes from which a file's board is located; fewer may be of a fixture or the corners.
const FEWEST: usize = 8;
/// Holes may be this far beyond copper or outline.
const OVERHANG: Length = Length::from_um(2_000);
/// More drill files than this are not compared with each other.
const MOST_COMPARED: usize = 40;

/// Reports the `others` with the same role as the layer `taken`: those that draw the same with the code
/// `equal`, the rest with `differs`.
pub(super) fn layers<'a>(
    taken: &FileRead,
    others: impl Iterator<Item = &'a FileRead>,
    [equal, differs]: [(Severity, &str); 2],
) -> Vec<Diagnostic> {
    let diagnostic = |other: &FileRead| {
        let same = other.fingerprint == taken.fingerprint
            || taken.gerber.as_ref().zip(other.gerber.as_ref()).is_some_and(|(a, b)| draw_the_same(a, b));
        let (severity, code) = if same { equal } else { differs };
        Diagnostic::new(severity, code)
            .at(&other.name, 0, 0)
            .with("file", &other.name)
            .with("taken", &taken.name)
    };
    others.map(diagnostic).collect()
}

/// True if two layers draw the same, ignoring everything else.
fn draw_the_same(a: &Gerber, b: &Gerber) -> bool {
    let form = |aperture: &Aperture| (aperture.form.clone(), aperture.opening);
    let drawn = |object: &Object| (object.shape.clone(), object.clear, object.aperture, object.transform);
    a.objects.len() == b.objects.len()
        && a.negative_image == b.negative_image
        && a.transforms == b.transforms
        && a.apertures.iter().map(form).eq(b.apertures.iter().map(form))
        && a.objects.iter().map(drawn).eq(b.objects.iter().map(drawn))
}

/// Reports drill files among `used` that look like two versions of one: the holes of both are drilled. Also
/// reports unused drill files that equal a used one.
pub(super) fn drills(artwork: &Artwork, used: &[usize]) -> Vec<Diagnostic> {
    let made = used.iter().filter_map(|&index| artwork.files.get(index));
    let made: Vec<&FileRead> = made.filter(|file| file.role == Role::Drill).take(MOST_COMPARED).collect();
    let alone = made.len() < 2;
    let files: Vec<(&FileRead, Vec<Point>, Holes)> = made
        .into_iter()
        .filter_map(|file| Some((file, if alone { Vec::new() } else { places(file)? })))
        .map(|(file, places)| (file, Holes::of(places.iter().map(|at| (*at, None))), places))
        .map(|(file, holes, places)| (file, places, holes))
        .collect();
    let mut diagnostics = Vec::new();
    for (at, (file, places, _)) in files.iter().enumerate() {
        for (other, others, holes) in files.iter().take(at) {
            let common = places.iter().filter(|place| holes.has(**place, None)).count();
            let most = common >= MANY && 2 * common > places.len().min(others.len());
            let namesakes = are_versions(base(&file.name), base(&other.name));
            if most && !namesakes && (holds(file, other) || holds(other, file)) {
                continue;
            }
            if file.fingerprint != other.fingerprint && (most || namesakes) {
                let is_one = most || common >= MANY;
                let severity = if is_one { Severity::Error } else { Severity::Warning };
                let versions = Diagnostic::new(severity, code!("board.two_drills")).at(&file.name, 0, 0);
                let versions = versions.with("file", &file.name).with("other", &other.name);
                diagnostics.push(versions.with("common", common).with("holes", places.len()));
            }
        }
    }
    let programs = artwork.files.iter().enumerate().filter(|(index, file)| {
        !used.contains(index) && file.role == Role::Drill && file.is_program_with_holes()
    });
    for (_, file) in programs {
        if let Some((twin, ..)) = files.iter().find(|(twin, ..)| twin.fingerprint == file.fingerprint) {
            let note = note!("board.same_drill", ..).at(&file.name, 0, 0);
            diagnostics.push(note.with("file", &file.name).with("taken", &twin.name));
        }
    }
    diagnostics
}

/// True if two file names look like two versions. They may differ in words such as `old` and `bak`, a version
/// number, a date, or the extension.
fn are_versions(one: &str, other: &str) -> bool {
    let words = |name: &str| {
        let name = name.to_ascii_lowercase();
        let words = name.split(|letter: char| !letter.is_alphanumeric()).filter(|word| !word.is_empty());
        let words: Vec<String> = words.map(str::to_owned).collect();
        let copy = name.contains('(');
        let is_own = |word: &String| !(is_version_word(word) || copy && word.parse::<u8>().is_ok());
        words.into_iter().filter(is_own).collect::<Vec<_>>()
    };
    let stem = |name: &str| name.rsplit_once('.').map_or(name, |(stem, _)| stem).to_ascii_lowercase();
    words(one) == words(other) || stem(one) == stem(other)
}

fn is_version_word(word: &str) -> bool {
    const WORDS: [&str; 16] = [
        "old", "new", "bak", "backup", "copy", "orig", "original", "final", "prev", "previous", "alt", "neu",
        "kopie", "stary", "nowy", "kopia",
    ];
    let digits = word.trim_start_matches("rev").trim_start_matches(['v', 'r']);
    let is_number = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    WORDS.contains(&word) || is_number && (digits.len() < word.len() || digits.len() >= 6)
}

fn sized(file: &FileRead) -> impl Iterator<Item = (Point, Option<Length>)> {
    file.drill.iter().flat_map(|drill| {
        let size = |tool: u16| drill.tools.get(usize::from(tool)).and_then(|tool| tool.diameter);
        drill.hits.iter().map(move |hit| (hit.at, size(hit.tool)))
    })
}

/// Holes by their places. Files in different units round places and sizes apart.
struct Holes(BTreeMap<(i64, i64), Vec<Option<Length>>>);

impl Holes {
    fn of(holes: impl Iterator<Item = (Point, Option<Length>)>) -> Self {
        let mut cells: BTreeMap<_, Vec<_>> = BTreeMap::new();
        holes.for_each(|(at, size)| cells.entry(cell(at)).or_default().push(size));
        Self(cells)
    }

    fn has(&self, at: Point, size: Option<Length>) -> bool {
        let (x, y) = cell(at);
        let is_size = |found: &Option<Length>| match (*found, size) {
            (Some(found), Some(size)) => (found - size).abs() <= ROUNDED,
            (found, size) => found == size,
        };
        let mut cells = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (x + dx, y + dy)));
        cells.any(|cell| self.0.get(&cell).is_some_and(|sizes| sizes.iter().any(is_size)))
    }
}

fn cell(at: Point) -> (i64, i64) {
    (at.x.nm().div_euclid(ROUNDED.nm()), at.y.nm().div_euclid(ROUNDED.nm()))
}

/// True if `whole`, of the same board, includes all holes of `part` with their sizes. An example is a list of
/// vias next to one of all holes.
fn holds(whole: &FileRead, part: &FileRead) -> bool {
    let is_round = |drill: &DrillFile| drill.slots.is_empty() && drill.routes.is_empty();
    let count = part.drill.as_ref().filter(|drill| is_round(drill)).map_or(0, |drill| drill.hits.len());
    if whole.board != part.board || whole.drill.is_none() || count < MANY {
        return false;
    }
    let all = Holes::of(sized(whole));
    sized(part).all(|(at, size)| all.has(at, size))
}

/// Removes holes that two drill files list with one size, if all holes of one file are in the other.
pub(super) fn listed_twice(board: &mut Board, artwork: &Artwork, used: &[usize]) -> Vec<Diagnostic> {
    let files: Vec<&FileRead> = used.iter().filter_map(|&index| artwork.files.get(index)).collect();
    let made = |name: &String| files.iter().find(|file| file.name == *name).copied();
    let mut notes = Vec::new();
    let mut dropped: Vec<u32> = Vec::new();
    for (part, name) in (0_u32..).zip(&board.sources).take(MOST_COMPARED) {
        let wholes = (0_u32..).zip(&board.sources).take(MOST_COMPARED);
        let mut wholes = wholes.filter(|(whole, _)| *whole != part && !dropped.contains(whole));
        let Some(file) = made(name) else { continue };
        let whole = wholes.find(|(_, whole)| made(whole).is_some_and(|whole| holds(whole, file)));
        let Some((_, whole)) = whole else { continue };
        let count = file.drill.as_ref().map_or(0, |drill| drill.hits.len());
        let note = note!("board.holes_in_both", count = count, ..).at(name, 0, 0);
        notes.push(note.with("file", base(name)).with("taken", base(whole)));
        dropped.push(part);
    }
    board.holes.retain(|hole| !dropped.contains(&hole.source));
    notes
}

/// Reports that the used drill files and the copper belong to several boards.
pub(super) fn boards(artwork: &Artwork, used: &[usize]) -> Option<Diagnostic> {
    let made = |index: usize, file: &FileRead| match file.role {
        Role::Drill => used.contains(&index) && file.drill.is_some(),
        Role::Copper => true,
        _ => false,
    };
    let all = artwork.files.iter().enumerate().filter(|(index, file)| made(*index, file));
    let all: Vec<usize> = all.map(|(index, _)| index).collect();
    let names: Vec<String> = artwork.boards(&all).into_iter().map(|(name, _)| name).collect();
    let told = error!("board.several", count = names.len(), ..);
    (names.len() > 1).then(|| told.with("names", names.join(", ")))
}

/// Reports files whose positions can't belong to one board. These are copper layers that are apart, and drill
/// files with more than half of their holes beyond all copper. Without copper the outline is used. Shifted
/// drill files are reported elsewhere; unplated holes need no copper.
pub(super) fn apart(artwork: &Artwork, used: &[usize]) -> Vec<Diagnostic> {
    let boxes = |role: Role| {
        let layers = artwork.files.iter().filter(move |file| file.role == role);
        layers.filter_map(|file| Some((file, file.gerber.as_ref()?.centre_bounds()?.grown(OVERHANG))))
    };
    let copper: Vec<(&FileRead, Bounds)> = boxes(Role::Copper).collect();
    let first = copper.first();
    let away = first.and_then(|(_, own)| copper.iter().find(|(_, other)| !own.meets(*other)));
    if let Some(((file, _), (other, _))) = first.zip(away) {
        let error = error!("board.copper_apart", ..).at(&other.name, 0, 0);
        return vec![error.with("file", &other.name).with("other", &file.name)];
    }
    let outlines: Vec<(&FileRead, Bounds)> = boxes(Role::Outline).collect();
    let within = if copper.is_empty() { outlines } else { copper };
    let Some((layer, _)) = within.first() else { return Vec::new() };
    let drills = used.iter().filter_map(|&index| artwork.files.get(index));
    let drills = drills.filter(|file| file.role == Role::Drill && file.plated != Some(false));
    let shifted =
        |file: &&FileRead| file.evidence.as_ref().is_some_and(|evidence| evidence.shift_mm.is_some());
    let told = drills.filter(|file| !shifted(file)).filter_map(|file| {
        let holes = places(file).filter(|holes| holes.len() >= FEWEST)?;
        let outside =
            holes.iter().filter(|at| !within.iter().any(|(_, bounds)| bounds.contains(**at))).count();
        let error = error!("board.holes_apart", ..).at(&file.name, 0, 0);
        let error = error.with("file", &file.name).with("other", &layer.name);
        (2 * outside > holes.len()).then(|| error.with("count", outside).with("holes", holes.len()))
    });
    told.collect()
}

/// Drilled positions of a file, sorted, without duplicates.
fn places(file: &FileRead) -> Option<Vec<Point>> {
    let mut places: Vec<Point> = file.drill.as_ref()?.centres().map(|(at, _)| at).collect();
    places.sort_unstable();
    places.dedup();
    Some(places)
}

pub(super) fn same_box(a: Bounds, b: Bounds, slack: crate::units::Length) -> bool {
    let near = |a: Point, b: Point| (a.x - b.x).abs() <= slack && (a.y - b.y).abs() <= slack;
    near(a.min, b.min) && near(a.max, b.max)
}

fn base(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}
