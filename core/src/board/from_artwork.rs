//! The board that chosen drill files and drill layers describe.
//!
//! Comes in: an [`Artwork`] and which of its files to use. Goes out: a [`Board`] and the diagnostics of those files. Knows
//! no words of any format; arcs become chords here.

use super::outline::{contours, nest, shut};
use super::{Board, Hole, Slot, copper, legend, mend, rivals};
use crate::artwork::{Artwork, DrillFile, FileRead, Gerber, Role, ToolEntry, board_name};
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::{Bounds, Path, PathSegment, Placement, Point, Region, area_mm2, chords, path_bounds};
use crate::units::Length;

/// How far a chord may be from its arc, in mm.
const CHORD_ERROR_MM: f64 = 0.005;
/// Copper may reach this far beyond the outline before the two are said to lie apart.
const OVERHANG: Length = Length::from_um(2_000);

/// Outlines whose edges are this near to each other are one.
const SAME_EDGE: Length = Length::from_um(50);

/// What a board shall have besides its holes and its outline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BoardWanted {
    /// The copper of both sides, painted: this takes time; and their legends.
    pub copper: bool,
    /// Layers that do not share the copper's zero point moved to where they fit it. Nobody moves them unasked: a person is
    /// told of the shift and chooses.
    pub aligned: bool,
}

/// Makes the board of the files at `used`, without copper and with everything where its file puts it.
pub fn from_artwork(artwork: &Artwork, used: &[usize]) -> (Board, Vec<Diagnostic>) {
    from_artwork_with(artwork, used, BoardWanted::default())
}

/// Makes the board of the files at `used`. What has neither holes nor copper among them adds nothing. The
/// diagnostics are those of the files used, and those of the board itself.
pub fn from_artwork_with(artwork: &Artwork, used: &[usize], wanted: BoardWanted) -> (Board, Vec<Diagnostic>) {
    from_artwork_telling(artwork, used, wanted, &mut |_, _| {})
}

/// The same; `progress` is told how many sides of the copper are painted, and how many there are.
pub fn from_artwork_telling(
    artwork: &Artwork,
    used: &[usize],
    wanted: BoardWanted,
    progress: &mut dyn FnMut(u64, u64),
) -> (Board, Vec<Diagnostic>) {
    let mut board = Board::default();
    let mut diagnostics = Vec::new();
    for file in used.iter().filter_map(|&index| artwork.files.get(index)) {
        // A drill layer that a person takes for something else makes no holes.
        let Some(drill) = file.drill.as_ref().filter(|_| file.role == Role::Drill) else { continue };
        let source = board.sources.len() as u32;
        board.sources.push(file.name.clone());
        diagnostics.extend(file.diagnostics.iter().cloned());
        let (holes, slots) = (board.holes.len(), board.slots.len());
        add(&mut board, file, drill, source);
        let apart = shift(file);
        if let Some(by) = apart.filter(|_| !wanted.aligned) {
            diagnostics.push(Diagnostic {
                severity: Severity::Warning,
                ..told("board.holes_shifted", &file.name, by)
            });
        }
        if let Some(by) = apart.filter(|_| wanted.aligned) {
            board.holes.iter_mut().skip(holes).for_each(|hole| hole.at = moved(hole.at, by));
            let points = board.slots.iter_mut().skip(slots).flat_map(|slot| &mut slot.path);
            points.for_each(|point| *point = moved(*point, by));
            diagnostics.push(told("board.moved", &file.name, by));
        }
    }
    diagnostics.extend(rivals::drills(artwork, used));
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
            diagnostics.push(Diagnostic::note("board.no_holes"));
        }
    }
    (board, diagnostics)
}

/// What the board is called whose drill files are `drills`: after them and what else lies there of the same board. Where there are
/// none, after its copper; where there is none either, after its outline.
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

/// What has to be added to the holes of a file so that they lie on the copper beside it; none where they do.
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

fn add(board: &mut Board, file: &FileRead, drill: &DrillFile, source: u32) {
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
    let slot = |index: u16, path: Vec<Point>, line: u32| {
        let tool = tool(index);
        let plated = tool.plated.or(file.plated);
        Slot { path, width: tool.diameter, plated, source, tool_code: tool.code, line }
    };
    board.slots.extend(drill.slots.iter().map(|row| slot(row.tool, vec![row.from, row.to], row.line)));
    for route in &drill.routes {
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
        board.slots.push(slot(route.tool, path, route.line));
    }
}

/// The first outline layer whose lines close gives the outline. Lines of it that lead nowhere are reported, and so is
/// copper beyond it: then outline and copper do not share their zero point. Where the holes do not either, and the same
/// shift puts the outline around the copper, it can be moved with them. Where lines lead nowhere and something lies beyond
/// what does close, the board is another one than that: an error.
fn outline(
    board: &mut Board,
    artwork: &Artwork,
    used: &[usize],
    wanted: BoardWanted,
    diagnostics: &mut Vec<Diagnostic>,
) {
    for file in layers(artwork, Role::Outline) {
        let Some(gerber) = &file.gerber else { continue };
        let (region, open, mended) = drawn(gerber, board, artwork);
        diagnostics.extend(mended.map(|diagnostic| diagnostic.at(&file.name, 0, 0)));
        board.outline = region;
        let about = |severity, code| Diagnostic::new(severity, code).at(&file.name, 0, 0);
        let lines: usize = open.iter().map(|path| path.segments.len()).sum();
        let Some(bounds) = board.outline.bounds() else {
            if lines > 0 {
                diagnostics.push(about(Severity::Warning, "board.outline_open").with("count", lines));
            }
            continue;
        };
        diagnostics.extend(other_outlines(file, artwork));
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
            let error = (Severity::Error, "board.outline_broken");
            let (severity, code) = if broken { error } else { (Severity::Warning, "board.outline_rest") };
            diagnostics.push(about(severity, code).with("count", lines));
        }
        match by {
            Some(by) if wanted.aligned => {
                board.outline = Placement::shifted(by).region(&board.outline);
                diagnostics.push(told("board.moved", &file.name, by));
            }
            Some(by) => diagnostics.push(told("board.outline_shifted", &file.name, by)),
            None if fits || broken => {}
            None => elsewhere(board, artwork, wanted, &file.name, diagnostics),
        }
        return;
    }
}

/// Tells that the outline `name` does not lie around the copper; and where its middle would have to lie so that it does,
/// which moves it if that is wanted.
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
        diagnostics.push(proposal(Severity::Warning, "board.outline_centred", found));
        return;
    }
    let body = mend::body(&board.outline);
    let any = centres(artwork).into_iter().any(|at| body.island_at(at).is_some());
    let severity = if any { Severity::Warning } else { Severity::Error };
    diagnostics.push(about(severity, "board.outline_elsewhere"));
    diagnostics.extend(proposed.map(|found| proposal(Severity::Note, "board.outline_could_move", found)));
}

/// What puts the middle of the outline's box on that of copper and holes, if all of these then lie inside of it; and how much
/// room is left beside them either way.
///
/// ```text
///   ┌──────────────┐
///   │◀▶ ▪   ▪ ▪  ◀▶│   ◀▶ the room: the true place may be anywhere in it
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

/// What is said of outlines beside the one that is taken: of one that runs the same way, and of another one.
const TWO: [(Severity, &str); 2] =
    [(Severity::Note, "board.same_outline"), (Severity::Warning, "board.two_outlines")];

/// Tells of closed outlines beside `taken`.
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

/// The files of a role.
fn layers(artwork: &Artwork, role: Role) -> impl Iterator<Item = &FileRead> {
    artwork.files.iter().filter(move |file| file.role == role)
}

/// What the lines of an outline layer enclose, gaps mended where that is plain; the lines that stay open; and what to say
/// of the gaps.
fn drawn(gerber: &Gerber, board: &Board, artwork: &Artwork) -> (Region, Vec<Path>, Option<Diagnostic>) {
    let (mut closed, open) = contours(&gerber.strokes());
    closed.extend(gerber.contours().into_iter().map(shut));
    if open.is_empty() {
        return (nest(closed), open, None);
    }
    let (near, mut rest) = mend::joined(open);
    let mut gaps: Vec<(Length, Point)> = near.iter().map(|(path, gap)| (*gap, path.end())).collect();
    closed.extend(near.into_iter().map(|(path, _)| path));
    let mut region = nest(closed.clone());
    let mut all = centres(artwork);
    all.extend(middles(board));
    if !rest.is_empty() && !all.is_empty() && !mend::holds(&region, &all, Length::ZERO) {
        let whole = mend::whole(&rest, &|region| mend::holds(region, &all, Length::ZERO));
        if let Some(path) = whole.map(|index| rest.swap_remove(index)) {
            gaps.push((mend::gap(path.start, path.end()), path.end()));
            closed.push(mend::straight(&path));
            region = nest(closed);
        }
    }
    let count = gaps.len();
    let mended = gaps.into_iter().max().map(|(gap, at)| {
        let mm = |length: Length| format!("{:.3}", length.mm());
        let diagnostic = Diagnostic::warning("board.outline_mended").with("count", count);
        diagnostic.with("gap", mm(gap)).with("x", mm(at.x)).with("y", mm(at.y))
    });
    (region, rest, mended)
}

/// Whether copper or holes lie beyond the outline, once that is shifted `by` if it is to be; where there are neither,
/// whether its open lines reach beyond it.
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

/// Where the copper is drawn: middles of pads, ends of strokes, corners of areas.
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

/// Where the holes are, and the slots.
fn middles(board: &Board) -> impl Iterator<Item = Point> {
    board
        .holes
        .iter()
        .map(|hole| hole.at)
        .chain(board.slots.iter().flat_map(|slot| slot.path.iter().copied()))
}

impl Board {
    /// The box around all holes and slots at their full size; those without a size count as points.
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
