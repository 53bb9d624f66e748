//! Files of a set that describe the same thing of one board, and what to say of those.
//!
//! ```text
//!   board-F_Cu.gbr       taken        ┐ the same drawing: a note
//!   old/board-F_Cu.gbr   left out     ┘ another one:      an error, because a person has to choose
//!
//!   board.drl ─┐ both are drilled; where they have a name or most places in common and
//!   old/b.drl ─┘ are not equal, one of them is probably not of this board: a warning
//! ```
//!
//! Comes in: an [`Artwork`], which of its files are used, which layer was taken. Goes out: diagnostics. Takes nothing itself.

use crate::artwork::{Aperture, Artwork, FileRead, Gerber, Object, Role};
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::{Bounds, Point};
use crate::units::Length;

/// So many places that two drill files have in common make them two states of one.
const MANY: usize = 3;
/// So many holes of a file say where its board is; fewer may be those of a fixture or of the corners.
const FEWEST: usize = 8;
/// Holes may lie this far beyond copper or outline.
const OVERHANG: Length = Length::from_um(2_000);
/// More drill files than this are not compared with each other.
const MOST_COMPARED: usize = 40;

/// Tells of the `others` beside the layer `taken`, which was taken for the same thing as they are: of those that draw the
/// same with the code `equal`, of the others with `differs`.
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

/// Whether two layers draw the same, whatever else they say.
fn draw_the_same(a: &Gerber, b: &Gerber) -> bool {
    let form = |aperture: &Aperture| (aperture.form.clone(), aperture.opening);
    let drawn = |object: &Object| (object.shape.clone(), object.clear, object.aperture, object.transform);
    a.objects.len() == b.objects.len()
        && a.negative_image == b.negative_image
        && a.transforms == b.transforms
        && a.apertures.iter().map(form).eq(b.apertures.iter().map(form))
        && a.objects.iter().map(drawn).eq(b.objects.iter().map(drawn))
}

/// Tells of drill files among `used` that are two states of one: the holes of both are made. And of drill files that are
/// another one once more.
pub(super) fn drills(artwork: &Artwork, used: &[usize]) -> Vec<Diagnostic> {
    let made = used.iter().filter_map(|&index| artwork.files.get(index));
    let made: Vec<&FileRead> = made.filter(|file| file.role == Role::Drill).take(MOST_COMPARED).collect();
    let alone = made.len() < 2;
    let files: Vec<(&FileRead, Vec<Point>)> = made
        .into_iter()
        .filter_map(|file| Some((file, if alone { Vec::new() } else { places(file)? })))
        .collect();
    let mut diagnostics = Vec::new();
    for (at, (file, places)) in files.iter().enumerate() {
        for (other, others) in files.iter().take(at) {
            let common = places.iter().filter(|place| others.binary_search(place).is_ok()).count();
            let most = common >= MANY && 2 * common > places.len().min(others.len());
            let namesakes = base(&file.name).eq_ignore_ascii_case(base(&other.name));
            if file.fingerprint != other.fingerprint && (most || namesakes) {
                let warning = Diagnostic::warning("board.two_drills").at(&file.name, 0, 0);
                let warning = warning.with("file", &file.name).with("other", &other.name);
                diagnostics.push(warning.with("common", common).with("holes", places.len()));
            }
        }
    }
    let programs = artwork.files.iter().enumerate().filter(|(index, file)| {
        !used.contains(index) && file.role == Role::Drill && file.is_program_with_holes()
    });
    for (_, file) in programs {
        if let Some((twin, _)) = files.iter().find(|(twin, _)| twin.fingerprint == file.fingerprint) {
            let note = Diagnostic::note("board.same_drill").at(&file.name, 0, 0);
            diagnostics.push(note.with("file", &file.name).with("taken", &twin.name));
        }
    }
    diagnostics
}

/// Tells that what would be made is of several boards: the drill files among `used`, and copper.
pub(super) fn boards(artwork: &Artwork, used: &[usize]) -> Option<Diagnostic> {
    let made = |index: usize, file: &FileRead| match file.role {
        Role::Drill => used.contains(&index) && file.drill.is_some(),
        Role::Copper => true,
        _ => false,
    };
    let all = artwork.files.iter().enumerate().filter(|(index, file)| made(*index, file));
    let all: Vec<usize> = all.map(|(index, _)| index).collect();
    let names: Vec<String> = artwork.boards(&all).into_iter().map(|(name, _)| name).collect();
    let told = Diagnostic::error("board.several").with("count", names.len());
    (names.len() > 1).then(|| told.with("names", names.join(", ")))
}

/// Tells of files that cannot be of one board by their places: two layers of copper that lie apart, and drill files with more than
/// half of their holes beyond all copper, or where there is none beyond the outline. Drill files that a shift puts on the copper are
/// told elsewhere; unplated holes need no copper.
pub(super) fn apart(artwork: &Artwork, used: &[usize]) -> Vec<Diagnostic> {
    let boxes = |role: Role| {
        let layers = artwork.files.iter().filter(move |file| file.role == role);
        layers.filter_map(|file| Some((file, file.gerber.as_ref()?.centre_bounds()?.grown(OVERHANG))))
    };
    let copper: Vec<(&FileRead, Bounds)> = boxes(Role::Copper).collect();
    let first = copper.first();
    let away = first.and_then(|(_, own)| copper.iter().find(|(_, other)| !own.meets(*other)));
    if let Some(((file, _), (other, _))) = first.zip(away) {
        let error = Diagnostic::error("board.copper_apart").at(&other.name, 0, 0);
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
        let error = Diagnostic::error("board.holes_apart").at(&file.name, 0, 0);
        let error = error.with("file", &file.name).with("other", &layer.name);
        (2 * outside > holes.len()).then(|| error.with("count", outside).with("holes", holes.len()))
    });
    told.collect()
}

/// Where a file drills, in order, each place once.
fn places(file: &FileRead) -> Option<Vec<Point>> {
    let mut places: Vec<Point> = file.drill.as_ref()?.centres().map(|(at, _)| at).collect();
    places.sort_unstable();
    places.dedup();
    Some(places)
}

/// Whether two boxes are the same within `slack` at every side.
pub(super) fn same_box(a: Bounds, b: Bounds, slack: crate::units::Length) -> bool {
    let near = |a: Point, b: Point| (a.x - b.x).abs() <= slack && (a.y - b.y).abs() <= slack;
    near(a.min, b.min) && near(a.max, b.max)
}

/// The last part of a path.
fn base(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}
