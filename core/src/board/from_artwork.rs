//! Makes the board that the chosen drill files and drill layers describe.

use super::boards::{Content, LeftOut, alone, boards};
use super::outline::{contours, nest, shut};
use super::trace::trace;
use super::{Board, Hole, Slot, copper, drill_layers, legend, mend, rivals};
use crate::artwork::{Artwork, DrillFile, FileRead, Gerber, Role, Route, ToolEntry, board_name};
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::{Bounds, Path, PathSegment, Placement, Point, Region, area_mm2, chords, path_bounds};
use crate::units::Length;
use crate::{code, note, warning};

const CHORD_ERROR_MM: f64 = 0.005;
/// Copper may reach this far beyond the outline before the two count as apart.
const OVERHANG: Length = Length::from_um(2_000);

/// A slot with ends no farther apart is a round hole at its middle: every edge is within half of it.
const ROUND: Length = Length::from_um(60);

/// Outlines with edges this near to each other are equal.
const SAME_EDGE: Length = Length::from_um(50);

/// Share of the outline's box. If copper and holes fill no more, the outline may be the frame of a drawing
/// sheet.
const OVERSIZE_SHARE: f64 = 0.25;
/// Most frames around boards that are reported, each by itself.
const MOST_FRAMES: usize = 10;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BoardWanted {
    /// Painted copper and the silkscreen of both sides. Painting is slow.
    pub copper: bool,
    /// Move layers with another zero point to where they fit the copper. Never without a request: the user is
    /// informed of the shift and decides.
    pub aligned: bool,
}

/// Makes the board of the files at `used`, without copper and without shifts.
pub fn from_artwork(artwork: &Artwork, used: &[usize]) -> (Board, Vec<Diagnostic>) {
    from_artwork_with(artwork, used, BoardWanted::default())
}

/// Makes the board of the files at `used`. Files without holes and copper add nothing. The diagnostics are
/// those of the files used, and those of the board itself.
pub fn from_artwork_with(artwork: &Artwork, used: &[usize], wanted: BoardWanted) -> (Board, Vec<Diagnostic>) {
    from_artwork_telling(artwork, used, wanted, &mut |_, _| {})
}

/// As [`from_artwork_with`]; calls `progress` with the painted sides and their number.
pub fn from_artwork_telling(
    artwork: &Artwork,
    used: &[usize],
    wanted: BoardWanted,
    progress: &mut dyn FnMut(u64, u64),
) -> (Board, Vec<Diagnostic>) {
    let mut board = Board::default();
    let mut diagnostics = Vec::new();
    for file in used.iter().filter_map(|&index| artwork.files.get(index)) {
        // The user may have given a drill layer another role: then its holes don't count.
        let Some(drill) = file.drill.as_ref().filter(|_| file.role == Role::Drill) else { continue };
        let source = board.sources.len() as u32;
        board.sources.push(file.name.clone());
        diagnostics.extend(file.diagnostics.iter().cloned());
        let (holes, slots) = (board.holes.len(), board.slots.len());
        diagnostics.extend(add(&mut board, file, drill, source));
        let apart = shift(file);
        if let Some(by) = apart.filter(|_| !wanted.aligned) {
            diagnostics.push(Diagnostic {
                severity: Severity::Warning,
                ..told(code!("board.holes_shifted"), &file.name, by)
            });
        }
        if let Some(by) = apart.filter(|_| wanted.aligned) {
            board.holes.iter_mut().skip(holes).for_each(|hole| hole.at = moved(hole.at, by));
            let points = board.slots.iter_mut().skip(slots).flat_map(|slot| &mut slot.path);
            points.for_each(|point| *point = moved(*point, by));
            diagnostics.push(told(code!("board.moved"), &file.name, by));
        }
    }
    diagnostics.extend(rivals::listed_twice(&mut board, artwork, used));
    diagnostics.extend(rivals::drills(artwork, used));
    diagnostics.extend(drill_layers::unused(&board, artwork, used));
    match rivals::boards(artwork, used) {
        Some(several) => diagnostics.push(several),
        None => diagnostics.extend(rivals::apart(artwork, used)),
    }
    board.slots.sort_by_key(|slot| (slot.source, slot.line));
    board.name = name(artwork, used, &board.sources);
    outline(&mut board, artwork, used, wanted, &mut diagnostics);
    if wanted.copper {
        copper::add(&mut board, (artwork, used), &mut diagnostics, progress);
        legend::add(&mut board, artwork, used);
        if board.holes.is_empty() && board.slots.is_empty() && !board.copper.is_empty() {
            diagnostics.push(note!("board.no_holes"));
        }
    }
    (board, diagnostics)
}

/// Name of the board: common part of its drill files and of the files next to them; else of the copper; else
/// of the outline.
fn name(artwork: &Artwork, used: &[usize], drills: &[String]) -> String {
    let used = || used.iter().filter_map(|&index| artwork.files.get(index));
    let drill = used().find(|file| drills.first() == Some(&file.name));
    let layer =
        |role: Role| used().chain(&artwork.files).find(|file| file.role == role && file.gerber.is_some());
    let first = drill.or_else(|| layer(Role::Copper)).or_else(|| layer(Role::Outline));
    let Some(first) = first else { return String::new() };
    let others = artwork.files.iter().filter(|file| {
        let is_of_it = matches!(file.role, Role::Drill | Role::Copper | Role::Outline);
        is_of_it && !file.board.is_empty() && file.board == first.board && file.name != first.name
    });
    let names: Vec<&str> = std::iter::once(first).chain(others).map(|file| file.name.as_str()).collect();
    board_name(&names)
}

/// Shift that puts the holes of a file onto the copper; `None` if they fit.
fn shift(file: &FileRead) -> Option<Point> {
    let (x, y) = file.evidence.as_ref()?.shift_mm?;
    Some(Point::from_mm(x, y))
}

fn moved(point: Point, by: Point) -> Point {
    Point::new(point.x + by.x, point.y + by.y)
}

fn told(code: &str, name: &str, by: Point) -> Diagnostic {
    let mm = |length: Length| format!("{:+.3}", length.mm());
    Diagnostic::note(code).at(name, 0, 0).with("x", mm(by.x)).with("y", mm(by.y))
}

/// Adds the holes and slots of a file; reports slots that are round holes.
fn add(board: &mut Board, file: &FileRead, drill: &DrillFile, source: u32) -> Option<Diagnostic> {
    let holes = board.holes.len();
    let nameless = ToolEntry { code: 0, diameter: None, plated: None, line: 0 };
    let tool = |index: u16| drill.tools.get(usize::from(index)).unwrap_or(&nameless);
    board.holes.reserve(drill.hits.len());
    for hit in &drill.hits {
        let tool = tool(hit.tool);
        let plated = tool.plated.or(file.plated);
        board.holes.push(Hole {
            at: hit.at,
            diameter: tool.diameter,
            plated,
            source,
            tool_code: tool.code,
            line: hit.line,
        });
    }
    let mut paths: Vec<(u16, Vec<Point>, u32)> =
        drill.slots.iter().map(|row| (row.tool, vec![row.from, row.to], row.line)).collect();
    paths.extend(drill.routes.iter().map(|route| (route.tool, route_points(route), route.line)));
    let first = board.holes.len();
    let slots = paths.len();
    for (index, path, line) in paths {
        let tool = tool(index);
        let plated = tool.plated.or(file.plated);
        let (diameter, tool_code) = (tool.diameter, tool.code);
        match round(&path) {
            Some(at) => board.holes.push(Hole { at, diameter, plated, source, tool_code, line }),
            None => board.slots.push(Slot { path, width: diameter, plated, source, tool_code, line }),
        }
    }
    let count = board.holes.len() - first;
    if let Some(rows) = board.holes.get_mut(holes..).filter(|_| count > 0) {
        rows.sort_by_key(|hole| hole.line);
    }
    (count > 0).then(|| {
        let note = note!("board.slots_round", ..).at(&file.name, 0, 0);
        note.with("count", count).with("slots", slots)
    })
}

/// The middle of a slot so short that it is a round hole.
fn round(path: &[Point]) -> Option<Point> {
    let Bounds { min, max } = Bounds::around(path.iter().copied())?;
    let half = |low: Length, high: Length| Length::from_nm((low.nm() + high.nm()).div_euclid(2));
    (min.distance_mm(max) <= ROUND.mm()).then(|| Point::new(half(min.x, max.x), half(min.y, max.y)))
}

/// The points of a route, arcs cut into chords.
fn route_points(route: &Route) -> Vec<Point> {
    let mut path = vec![route.from];
    for segment in &route.segments {
        let from = path.last().copied().unwrap_or(route.from);
        match *segment {
            PathSegment::Line { to } => path.push(to),
            PathSegment::Arc { to, centre, clockwise } => {
                path.extend(chords::arc(from, to, centre, clockwise, CHORD_ERROR_MM));
            }
        }
    }
    path
}

/// Takes the outline from the first outline layer with closed lines. Reports its open lines, and copper
/// beyond it: then outline and copper have different zero points. If the same shift also fits the holes, the
/// outline can be moved with them. Open lines together with features beyond the closed part mean that the
/// board is not complete: an error. No closed loop is an error too.
fn outline(
    board: &mut Board,
    artwork: &Artwork,
    used: &[usize],
    wanted: BoardWanted,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let mut open_ones = Vec::new();
    for file in layers(artwork, Role::Outline) {
        let Some(gerber) = &file.gerber else { continue };
        // Questions about layers are added with the copper.
        let own = file.diagnostics.iter().filter(|said| !copper::LEFT.contains(&said.code.as_str()));
        let own: Vec<Diagnostic> = own.cloned().collect();
        let (region, open, mended) = drawn(gerber, board, artwork);
        diagnostics.extend(mended.into_iter().map(|diagnostic| diagnostic.at(&file.name, 0, 0)));
        board.outline = region;
        let about = |severity, code| Diagnostic::new(severity, code).at(&file.name, 0, 0);
        let lines: usize = open.iter().map(|path| path.segments.len()).sum();
        let Some(bounds) = board.outline.bounds() else {
            open_ones.extend(own);
            if lines > 0 {
                open_ones.push(about(Severity::Error, code!("board.outline_open")).with("count", lines));
            }
            continue;
        };
        // An open outline stops nothing once another layer gives the board.
        let as_warning = |said: Diagnostic| match said.severity {
            Severity::Error => Diagnostic { severity: Severity::Warning, ..said },
            _ => said,
        };
        diagnostics.extend(open_ones.drain(..).map(as_warning));
        // A job without copper does not need the outline.
        diagnostics.extend(own.into_iter().map(|said| if wanted.copper { said } else { as_warning(said) }));
        diagnostics.extend(other_outlines(file, artwork));
        diagnostics.extend(oversize(board, artwork).map(|large| large.at(&file.name, 0, 0)));
        let copper = layers(artwork, Role::Copper).filter_map(|file| file.gerber.as_ref()?.centre_bounds());
        let copper = copper.reduce(|a, b| a.with(b.min).with(b.max));
        let around = |by: Point| {
            let bounds = Bounds { min: moved(bounds.min, by), max: moved(bounds.max, by) }.grown(OVERHANG);
            copper.is_none_or(|copper| bounds.contains(copper.min) && bounds.contains(copper.max))
        };
        let mut shifts = used.iter().filter_map(|&index| shift(artwork.files.get(index)?));
        let fits = around(Point::default());
        let by = if fits { None } else { shifts.find(|&by| around(by)) };
        let broken = !open.is_empty() && is_broken(board, artwork, by, &open);
        if lines > 0 {
            let error = (Severity::Error, code!("board.outline_broken"));
            let (severity, code) =
                if broken { error } else { (Severity::Warning, code!("board.outline_rest")) };
            diagnostics.push(about(severity, code).with("count", lines));
        }
        match by {
            Some(by) if wanted.aligned => {
                board.outline = Placement::shifted(by).region(&board.outline);
                diagnostics.push(told(code!("board.moved"), &file.name, by));
            }
            Some(by) => diagnostics.push(told(code!("board.outline_shifted"), &file.name, by)),
            None if fits || broken => {}
            None => elsewhere(board, artwork, wanted, &file.name, diagnostics),
        }
        return;
    }
    diagnostics.extend(open_ones);
}

/// Reports that the outline `name` is not around the copper, with the shift that would fix it. Shifts it if
/// wanted.
fn elsewhere(
    board: &mut Board,
    artwork: &Artwork,
    wanted: BoardWanted,
    name: &str,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let about = |severity, code| Diagnostic::new(severity, code).at(name, 0, 0);
    let proposed = centred(board, artwork);
    let proposal = |severity, code, (by, slack): (Point, Point)| {
        let mm = |length: Length| format!("{:.3}", length.mm());
        let diagnostic = Diagnostic { severity, ..told(code, name, by) };
        diagnostic.with("slack_x", mm(slack.x)).with("slack_y", mm(slack.y))
    };
    if let Some(found) = proposed.filter(|_| wanted.aligned) {
        board.outline = Placement::shifted(found.0).region(&board.outline);
        diagnostics.push(proposal(Severity::Warning, code!("board.outline_centred"), found));
        return;
    }
    let body = mend::body(&board.outline);
    let any = centres(artwork).into_iter().any(|at| body.island_at(at).is_some());
    let severity = if any { Severity::Warning } else { Severity::Error };
    diagnostics.push(about(severity, code!("board.outline_elsewhere")));
    diagnostics
        .extend(proposed.map(|found| proposal(Severity::Note, code!("board.outline_could_move"), found)));
}

/// The shift that centres the outline's box on the box of copper and holes, if all of these are then inside.
/// Also the remaining room on each side.
///
/// ```text
///   ┌──────────────┐
///   │◀▶ ▪   ▪ ▪  ◀▶│   ◀▶ the room: the true position may be anywhere in it
///   └──────────────┘
/// ```
fn centred(board: &Board, artwork: &Artwork) -> Option<(Point, Point)> {
    let mut all = centres(artwork);
    all.extend(middles(board));
    let (inner, outer) = (Bounds::around(all.iter().copied())?, board.outline.bounds()?);
    let half = |low: Length, high: Length| Length::from_nm((low.nm() + high.nm()).div_euclid(2));
    let middle =
        |bounds: Bounds| Point::new(half(bounds.min.x, bounds.max.x), half(bounds.min.y, bounds.max.y));
    let size = |bounds: Bounds| Point::new(bounds.max.x - bounds.min.x, bounds.max.y - bounds.min.y);
    let (to, from) = (middle(inner), middle(outer));
    let by = Point::new(to.x - from.x, to.y - from.y);
    let (inside, outside) = (size(inner), size(outer));
    let room = Point::new(half(outside.x, -inside.x), half(outside.y, -inside.y));
    let fits = mend::holds(&Placement::shifted(by).region(&board.outline), &all, Length::ZERO);
    fits.then_some((by, room))
}

/// Report for another outline: an equal one is a note, a different one a warning.
const TWO: [(Severity, &str); 2] =
    [(Severity::Note, code!("board.same_outline")), (Severity::Warning, code!("board.two_outlines"))];

fn other_outlines(taken: &FileRead, artwork: &Artwork) -> Vec<Diagnostic> {
    let shape = |file: &FileRead| {
        let gerber = file.gerber.as_ref()?;
        let mut closed = contours(&gerber.strokes()).0;
        closed.extend(gerber.contours().into_iter().map(shut));
        let region = nest(closed);
        Some((region.bounds()?, area_mm2(&region)))
    };
    let own = shape(taken);
    let others = layers(artwork, Role::Outline).filter(|file| file.name != taken.name);
    let others = others.filter_map(|file| Some((file, shape(file)?))).map(|(file, (bounds, area))| {
        let alike = own.is_some_and(|(own, own_area)| {
            let slack_mm2 = SAME_EDGE.mm() * 4.0 * libm::sqrt(own_area.abs());
            rivals::same_box(own, bounds, SAME_EDGE) && (own_area - area).abs() <= slack_mm2
        });
        rivals::layers(taken, std::iter::once(file), if alike { [TWO[0]; 2] } else { TWO })
    });
    others.flatten().collect()
}

/// The files of a role. Files that the user chose come first.
fn layers(artwork: &Artwork, role: Role) -> impl Iterator<Item = &FileRead> {
    let of_role = move |is_said: bool| {
        artwork.files.iter().filter(move |file| file.role == role && file.is_said() == is_said)
    };
    of_role(true).chain(of_role(false))
}

/// The area inside the lines of an outline layer, its open lines, and diagnostics.
fn drawn(gerber: &Gerber, board: &Board, artwork: &Artwork) -> (Region, Vec<Path>, Vec<Diagnostic>) {
    let content = content(board, artwork);
    let strokes: Vec<_> = gerber.strokes().into_iter().zip(gerber.stroke_widths()).collect();
    let mut traced = trace(&strokes, gerber.contours(), &|stroke| content.crosses(stroke));
    let mut all = centres(artwork);
    all.extend(middles(board));
    let mut sorted = boards(traced.pieces.clone(), &content);
    if !traced.open.is_empty() && !all.is_empty() && !mend::holds(&sorted.region, &all, Length::ZERO) {
        let whole = mend::whole(&traced.open, &|region| mend::holds(region, &all, Length::ZERO));
        if let Some(path) = whole.map(|index| traced.open.swap_remove(index)) {
            traced.gaps.push((mend::gap(path.start, path.end()), path.end()));
            traced.pieces.extend(alone(mend::straight(&path)));
            sorted = boards(traced.pieces, &content);
        }
    }
    let mut told: Vec<Diagnostic> = mended(&traced.gaps, &traced.trimmed);
    told.extend(left_out(&sorted.left_out));
    if sorted.crossed > 0 {
        told.push(warning!("board.outline_rest", count = sorted.crossed));
    }
    (sorted.region, traced.open, told)
}

/// Content that the outline can hold.
fn content(board: &Board, artwork: &Artwork) -> Content {
    let mut content = Content::default();
    for gerber in layers(artwork, Role::Copper).filter_map(|file| file.gerber.as_ref()) {
        content.pads.extend(gerber.pads());
        let contours = gerber.contours();
        content.pads.extend(contours.iter().flat_map(|path| &path.segments).map(|segment| segment.to()));
        content.tracks.extend(gerber.strokes());
    }
    let holes = board.holes.iter().map(|hole| (hole.at, hole.diameter));
    let slots = board.slots.iter().flat_map(|slot| slot.path.iter().map(|&at| (at, slot.width)));
    content.holes.extend(holes.chain(slots).map(|(at, size)| (at, size.unwrap_or_default())));
    content
}

fn mended(gaps: &[(Length, Point)], trimmed: &[(Length, Point)]) -> Vec<Diagnostic> {
    let mm = |length: Length| format!("{:.3}", length.mm());
    let largest = |diagnostic: Diagnostic, rows: &[(Length, Point)]| {
        let (size, at) = rows.iter().max().copied()?;
        let diagnostic = diagnostic.with("count", rows.len()).with("x", mm(at.x)).with("y", mm(at.y));
        Some((diagnostic, mm(size)))
    };
    let gaps = largest(warning!("board.outline_mended", ..), gaps);
    let trimmed = largest(note!("board.outline_trimmed", ..), trimmed);
    let gaps = gaps.map(|(diagnostic, size)| diagnostic.with("gap", size));
    let trimmed = trimmed.map(|(diagnostic, size)| diagnostic.with("length", size));
    gaps.into_iter().chain(trimmed).collect()
}

/// Reports closed loops that are no boards. A loop that shares an edge with a board may belong to it. Each
/// loop around a board that may be its edge, and each frame with holes, has its own message.
fn left_out(loops: &[LeftOut]) -> Vec<Diagnostic> {
    let mm = |length: Length| format!("{:.2}", length.mm());
    let sized = |diagnostic: Diagnostic, Bounds { min, max }: Bounds| {
        let diagnostic = diagnostic.with("x", mm(min.x)).with("y", mm(min.y));
        diagnostic.with("width", mm(max.x - min.x)).with("height", mm(max.y - min.y))
    };
    let long =
        |row: &&LeftOut| (row.bounds.max.x - row.bounds.min.x).max(row.bounds.max.y - row.bounds.min.y);
    let together = |diagnostic: Diagnostic, is_of: &dyn Fn(&&LeftOut) -> bool| {
        let largest = loops.iter().filter(is_of).max_by_key(long)?;
        Some(sized(diagnostic.with("count", loops.iter().filter(is_of).count()), largest.bounds))
    };
    let is_frame = |row: &&LeftOut| !row.adjoins && row.holes > 0;
    let is_apart = |row: &&LeftOut| !row.adjoins && row.holes == 0;
    let apart =
        together(note!("board.outline_frames", ..), &|row: &&LeftOut| is_apart(row) && row.near.is_none());
    let near = loops.iter().filter(is_apart).filter_map(|row| Some((row, row.near?))).take(MOST_FRAMES);
    let nested = near.map(|(row, (inner, gap_mm))| {
        let warning = sized(warning!("board.outline_nested", ..), row.bounds);
        let warning = warning.with("inner_width", mm(inner.max.x - inner.min.x));
        warning.with("inner_height", mm(inner.max.y - inner.min.y)).with("gap", format!("{gap_mm:.2}"))
    });
    let beside = together(warning!("board.outline_part_empty", ..), &|row: &&LeftOut| row.adjoins);
    let frames = loops
        .iter()
        .filter(is_frame)
        .take(MOST_FRAMES)
        .map(|row| sized(warning!("board.outline_frame_around", holes = row.holes, ..), row.bounds));
    apart.into_iter().chain(nested).chain(beside).chain(frames).collect()
}

/// Reports an outline that is much larger than all copper and holes in it: it may be the frame of a drawing
/// sheet.
fn oversize(board: &Board, artwork: &Artwork) -> Option<Diagnostic> {
    let all = centres(artwork).into_iter().chain(middles(board));
    let (inner, outer) = (Bounds::around(all)?, board.outline.bounds()?);
    let size = |bounds: Bounds| ((bounds.max.x - bounds.min.x).mm(), (bounds.max.y - bounds.min.y).mm());
    let ((width, height), (wide, high)) = (size(inner), size(outer));
    let is_sheet = width * height > 0.0 && width * height <= OVERSIZE_SHARE * wide * high;
    let warning = warning!("board.outline_oversize", ..);
    let mm = |length: f64| format!("{length:.1}");
    let warning = warning.with("width", mm(wide)).with("height", mm(high));
    is_sheet.then(|| warning.with("copper_width", mm(width)).with("copper_height", mm(height)))
}

/// True if copper or holes are beyond the outline, shifted by `by`. Without copper and holes, true if its
/// open lines reach beyond it.
fn is_broken(board: &Board, artwork: &Artwork, by: Option<Point>, open: &[Path]) -> bool {
    let outline =
        by.map_or_else(|| board.outline.clone(), |by| Placement::shifted(by).region(&board.outline));
    let mut all = centres(artwork);
    if by.is_none() {
        all.extend(middles(board));
    }
    if all.is_empty() {
        all.extend(open.iter().map(path_bounds).flat_map(|bounds| [bounds.min, bounds.max]));
    }
    !mend::holds(&outline, &all, OVERHANG)
}

/// Centres of pads, ends of strokes, corners of areas.
fn centres(artwork: &Artwork) -> Vec<Point> {
    let mut all = Vec::new();
    for gerber in layers(artwork, Role::Copper).filter_map(|file| file.gerber.as_ref()) {
        all.extend(gerber.pads());
        all.extend(gerber.strokes().into_iter().flat_map(|(from, segment)| [from, segment.to()]));
        let contours = gerber.contours();
        all.extend(contours.iter().flat_map(|path| &path.segments).map(|segment| segment.to()));
    }
    all.sort_unstable();
    all.dedup();
    all
}

fn middles(board: &Board) -> impl Iterator<Item = Point> {
    board
        .holes
        .iter()
        .map(|hole| hole.at)
        .chain(board.slots.iter().flat_map(|slot| slot.path.iter().copied()))
}

impl Board {
    /// Bounds of all holes and slots at their full size; those without a size count as points.
    pub fn outer_bounds(&self) -> Option<Bounds> {
        let holes = self.holes.iter().map(|hole| (hole.at, hole.diameter));
        let slots = self.slots.iter().flat_map(|slot| slot.path.iter().map(|&point| (point, slot.width)));
        holes.chain(slots).fold(None, |bounds: Option<Bounds>, (point, size)| {
            let radius = Length::from_nm(size.map_or(0, |size| size.nm() / 2));
            let around = Bounds::of(point).grown(radius);
            Some(bounds.map_or(around, |bounds| bounds.with(around.min).with(around.max)))
        })
    }
}
