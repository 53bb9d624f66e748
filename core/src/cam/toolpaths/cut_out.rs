//! Cuts out the board: inner contours first, passes in depth, tabs or mouse-bites.
//!
//! ```text
//!   ╭──────╌╌──────╮     ╌╌ tabs: the tool stays above them; with mouse-bites it does not cut there,
//!   │  ╭───────╮   │        and a row of holes lets them break
//!   ╎  │ inner │   ╎
//!   ╎  ╰───────╯   ╎     the tool is outside the outline, and inside inner contours
//!   ╰──────╌╌──────╯
//! ```
//!
//! Smaller tools go first, for parts too narrow for the main tool: the board is still held then.

use super::super::rack;
use super::super::work::{CutOut, CutSide, POINT_DEG};
use super::checks::no_clearance::{Closed, closed, made};
use super::checks::tab_strength::{self, BITE_TOLERANCE};
use super::cut::{self, Area};
use super::hand_tabs;
use super::isolate::turned;
use super::joints::joints;
use super::narrow::{self, NEARER, half};
use super::route::{Rules, arranged};
use super::{BitTask, DrillCycle, EntryMove, PlanContext, PlannedOperation, Toolpath, with_position};
use crate::diagnostic::Diagnostic;
use crate::geometry::{Path, PathSegment, Point, grow, path_area_mm2, path_bounds};
use crate::job::Bit;
use crate::units::Length;
use crate::{code, error, warning};
use std::f64::consts::PI;

/// Lengths along a path, in mm, of the ends of each tab.
type Tabs = Vec<(f64, f64)>;

pub(super) fn plan(context: &mut PlanContext<'_>, cut_out: &CutOut) -> Result<PlannedOperation, Diagnostic> {
    context.go_on()?;
    let mut part = PlannedOperation::default();
    let outline = &context.scene.board.outline;
    if outline.is_empty() {
        context.report(warning!("cam.no_outline", ..));
        return Ok(part);
    }
    let bits = context.own_mills();
    let Some((bit, smaller)) = bits.split_first() else { return Ok(part) };
    let offset = half(bit.diameter) - NEARER;
    let region = match cut_out.side {
        CutSide::Outside => grow(outline, offset),
        CutSide::On => outline.clone(),
    };
    let panel = &context.work.setup.panel;
    let drawn = panel.gap > Length::ZERO || (panel.columns, panel.rows) == (1, 1);
    let joints = if drawn && cut_out.side == CutSide::Outside { joints(outline) } else { Vec::new() };
    if cut_out.side == CutSide::Outside {
        let thin = smaller.last().unwrap_or(bit);
        let between = Closed {
            inner: closed(&context.scene.board, half(thin.diameter) - NEARER).inner,
            ..closed(&context.scene.board, offset)
        };
        told(context, &between, (bit, thin), &joints);
    }
    untabbed(context, cut_out, &joints, bit);
    pins_hit(context, cut_out, bit);
    tab_strength::tabs(context, cut_out);
    let (inner, outer): (Vec<Path>, Vec<Path>) =
        turned(region.paths().cloned().collect(), cut_out.direction).into_iter().partition(|path| {
            let area = path_area_mm2(path);
            (area < 0.0) != (cut_out.direction == super::super::work::CutDirection::Climb)
        });
    let first =
        if cut_out.side == CutSide::Outside { narrower(context, cut_out, bit, smaller)? } else { Vec::new() };
    let closed = context.scene.closed_to(bit.diameter);
    let mut bites = Vec::new();
    let mut toolpaths = Vec::new();
    let mut start = context.scene.origin;
    for (paths, held) in [(inner, Held::No), (joints, Held::InTheMiddle), (outer, Held::All)] {
        let rules = Rules {
            start,
            overlap: Length::ZERO,
            both_ways: false,
            link: None,
            seed: context.means.options.seed,
        };
        let paths = arranged(paths, &rules);
        let by_hand =
            if held == Held::All { hand_tabs::middles(context, cut_out, &paths, bit) } else { Vec::new() };
        for (index, path) in paths.into_iter().enumerate() {
            start = path.end();
            let hand = by_hand.get(index).map_or(&[][..], Vec::as_slice);
            let middles = match held {
                Held::No => Vec::new(),
                Held::InTheMiddle => joint_tabs(cut_out, &path, bit),
                Held::All => tab_middles(context, cut_out, &path, bit, hand),
            };
            contour(context, cut_out, path, &middles, closed.as_ref(), bit, (&mut toolpaths, &mut bites));
        }
    }
    part.tasks.extend(bite_task(context, cut_out, bites));
    part.tasks.extend(first);
    part.tasks.extend((!toolpaths.is_empty()).then(|| BitTask { toolpaths, ..BitTask::with(bit) }));
    Ok(part)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Held {
    No,
    /// An edge that two boards share: they hold each other until the board is removed.
    InTheMiddle,
    All,
}

/// Tabs along an edge that two boards share. They are at its middle; a closed edge has the job's number of
/// tabs. None if it is too short or if no tabs are wanted.
fn joint_tabs(cut_out: &CutOut, path: &Path, bit: &Bit) -> Vec<f64> {
    let whole = path.length_mm();
    let count = if path.is_closed() { cut_out.tabs } else { cut_out.tabs.min(1) };
    let wide = (cut_out.tab_width + bit.diameter).mm();
    if 2.0 * wide * f64::from(count) > whole {
        return Vec::new();
    }
    (0..count).map(|tab| (f64::from(tab) + 0.5) * whole / f64::from(count)).collect()
}

/// Reports shared edges that are too short for a tab: a board without another edge gets loose.
fn untabbed(context: &mut PlanContext<'_>, cut_out: &CutOut, joints: &[Path], bit: &Bit) {
    let mut short = joints.iter().filter(|path| joint_tabs(cut_out, path, bit).is_empty());
    let Some(first) = short.next().filter(|_| cut_out.tabs > 0) else { return };
    let error = error!("cam.shared_edge_short", count = 1 + short.count(), ..);
    context.report(with_position(error, first.start));
}

/// Cuts of each `smaller` tool in inlets and inner contours too narrow for the previous tools. Holes and
/// slots of the board are left out.
fn narrower(
    context: &mut PlanContext<'_>,
    cut_out: &CutOut,
    bit: &Bit,
    smaller: &[Bit],
) -> Result<Vec<BitTask>, Diagnostic> {
    let (outline, mut wider) = (&context.scene.board.outline, bit.diameter);
    let mut tasks = Vec::new();
    for thin in smaller {
        context.go_on()?;
        let mut places = narrow::inlets(outline, wider);
        places.retain(|place| !made(&context.scene.board, path_bounds(&place.outer)));
        let paths = turned(narrow::paths_through(outline, &places, thin.diameter), cut_out.direction);
        let rules = Rules { both_ways: true, ..context.free() };
        let closed = context.scene.closed_to(thin.diameter);
        let mut toolpaths = Vec::new();
        for path in arranged(paths, &rules) {
            contour(context, cut_out, path, &[], closed.as_ref(), thin, (&mut toolpaths, &mut Vec::new()));
        }
        tasks.extend((!toolpaths.is_empty()).then(|| BitTask { toolpaths, ..BitTask::with(thin) }));
        wider = thin.diameter;
    }
    Ok(tasks)
}

/// Reports contours closed to the tools: the widest around the boards, the narrowest inside.
fn told(context: &mut PlanContext<'_>, closed: &Closed, (bit, thin): (&Bit, &Bit), joints: &[Path]) {
    let merged = closed.merged + if joints.is_empty() { closed.touching } else { 0 };
    if !joints.is_empty() {
        let shared = warning!("cam.edges_shared", count = joints.len(), ..);
        let half_mm = format!("{:.2}", half(bit.diameter).mm());
        context.report(shared.with("half", half_mm).with("bit", bit.titled()));
    }
    let inner = closed
        .inner
        .errors(code!("cam.cut_outs_missing"))
        .into_iter()
        .map(|error| error.with("bit", thin.titled()));
    let merged = (merged > 0).then(|| error!("cam.contours_merged", missing = merged, ..));
    inner.chain(merged.map(|error| error.with("bit", bit.titled()))).for_each(|error| context.report(error));
}

const BESIDE_PINS: Length = Length::from_um(100);

/// Reports that the tool hits pins: they stay in their holes while the board is cut out.
fn pins_hit(context: &mut PlanContext<'_>, cut_out: &CutOut, bit: &Bit) {
    let scene = context.scene;
    let width = if cut_out.side == CutSide::On { half(bit.diameter) } else { bit.diameter };
    let clear = half(context.work.setup.alignment.diameter) + width + BESIDE_PINS;
    let edge = Area::of(&scene.board.outline);
    let near = |pin: &Point| edge.index().nearest(*pin, clear).is_some_and(|near| near.distance < clear);
    let pins = scene.pins.clone().filter_map(|pin| Some(scene.board.holes.get(pin as usize)?.at));
    let hit: Vec<Point> = pins.filter(near).collect();
    let Some(first) = hit.first() else { return };
    let error = error!("cam.pins_hit", count = hit.len(), bit = bit.titled(), ..);
    context.report(with_position(error, *first).with("margin", format!("{:.2}", clear.mm())));
}

fn contour(
    context: &mut PlanContext<'_>,
    cut_out: &CutOut,
    path: Path,
    middles: &[f64],
    closed: Option<&Area>,
    bit: &Bit,
    (toolpaths, bites): (&mut Vec<Toolpath>, &mut Vec<Point>),
) {
    let wide = (cut_out.tab_width + bit.diameter).mm();
    let tabs = spans(&path, middles, wide);
    let mut paths = vec![(path.clone(), tabs.clone())];
    if cut_out.bites && !tabs.is_empty() {
        let inwards = if cut_out.side == CutSide::On { Length::ZERO } else { half(bit.diameter) };
        bites.extend(bite_places(cut_out, &path, &tabs, bit, inwards));
        paths = without(&path, &tabs).into_iter().map(|path| (path, Vec::new())).collect();
    }
    if let Some(zone) = closed {
        paths = kept_out(context, paths, (&path, middles), zone, bit);
    }
    let depths = context.depths(context.depth());
    let thickness = context.machine.process.board_thickness;
    let tab_depth = (thickness - cut_out.tab_height).max(Length::ZERO);
    for (path, tabs) in paths {
        let slope = libm::tan(cut_out.ramp_deg * PI / 180.0);
        let entry = if path.is_closed() && slope > 0.0 { EntryMove::Ramp(slope) } else { EntryMove::Plunge };
        toolpaths.push(Toolpath { path, depths: depths.clone(), entry, tabs, tab_depth, clears: None });
    }
}

/// The parts of toolpaths outside a zone, with their tabs. Reports a zone that removes less than the tool's
/// width, which holds nothing. Also reports tabs, with these `middles` along the whole contour, that are in
/// the zone.
fn kept_out(
    context: &mut PlanContext<'_>,
    toolpaths: Vec<(Path, Tabs)>,
    (whole, middles): (&Path, &[f64]),
    zone: &Area,
    bit: &Bit,
) -> Vec<(Path, Tabs)> {
    let mut left = Vec::new();
    let mut touched = false;
    let mut cut_through: Vec<(Point, Point)> = Vec::new();
    for (path, tabs) in toolpaths {
        let parts = cut::parts(&path, zone, false);
        if parts.len() == 1 && parts.iter().all(|part| (part.length_mm() - path.length_mm()).abs() < 1e-6) {
            left.push((path, tabs));
            continue;
        }
        let follows = parts.iter().skip(1).chain(parts.iter().take(usize::from(path.is_closed())));
        let gaps = parts.iter().zip(follows).map(|(part, next)| (part.end(), next.start));
        let (thin, wide): (Vec<_>, Vec<_>) = gaps.partition(|(a, b)| a.distance_mm(*b) < bit.diameter.mm());
        let ends = |first: &Path, last: &Path| first.start == path.start && last.end() == path.end();
        let shortened =
            !path.is_closed() && !parts.first().zip(parts.last()).is_some_and(|(a, b)| ends(a, b));
        touched |= parts.is_empty() || shortened || !wide.is_empty();
        cut_through.extend(thin);
        left.extend(parts.iter().map(|part| (part.clone(), spans_on(part, &path, &tabs))));
    }
    if touched {
        context.report(warning!("cam.zone_in_the_way", ..));
    }
    for (from, to) in &cut_through {
        let middle = Point::new(half(from.x + to.x), half(from.y + to.y));
        context.report(with_position(warning!("cam.zone_too_short", ..), middle).with("bit", bit.titled()));
    }
    let through = |place: Point| {
        let within =
            |(a, b): &(Point, Point)| a.distance_mm(place).max(b.distance_mm(place)) < bit.diameter.mm();
        cut_through.iter().any(within)
    };
    for place in middles.iter().filter_map(|middle| place_at(whole, *middle)) {
        if zone.contains(place) && !through(place) {
            context.report(with_position(warning!("cam.tab_in_zone", ..), place));
        }
    }
    left
}

fn place_at(path: &Path, length: f64) -> Option<Point> {
    cut::between(path, 0.0, length.max(1e-3)).map(|part| part.end())
}

/// The tabs of the closed `path` on `part`, a part of it: as lengths along the part.
fn spans_on(part: &Path, path: &Path, tabs: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let (own, whole) = (part.length_mm(), path.length_mm());
    let Some((_, begin)) = cut::nearest(path, part.start, 0.1) else { return Vec::new() };
    let on_part = |from: f64| tabs.iter().map(move |tab| ((tab.0 + from).max(0.0), (tab.1 + from).min(own)));
    // Positions before its start along the whole path appear again after its end.
    let all = on_part(-begin).chain(on_part(whole - begin));
    all.filter(|(from, to)| to > from).collect()
}

/// Middles of the tabs: lengths along the path; `hand` are those of tabs that the user placed.
fn tab_middles(
    context: &mut PlanContext<'_>,
    cut_out: &CutOut,
    path: &Path,
    bit: &Bit,
    hand: &[f64],
) -> Vec<f64> {
    let whole = path.length_mm();
    let wide = (cut_out.tab_width + bit.diameter).mm();
    let middles: Vec<f64> = if cut_out.tab_at.is_empty() {
        let count = f64::from(cut_out.tabs);
        (0..cut_out.tabs).map(|tab| (f64::from(tab) + 0.5) * whole / count).collect()
    } else {
        hand.to_vec()
    };
    if middles.is_empty() && !cut_out.tab_at.is_empty() {
        context.report(with_position(error!("cam.cut_free", ..), path.start));
    }
    if wide * middles.len() as f64 > 0.8 * whole {
        context.report(error!("cam.no_room_for_tabs", tabs = middles.len(), ..));
        return Vec::new();
    }
    middles
}

/// Spans above tabs around these `middles`: pairs of lengths along the path, ascending and disjoint.
fn spans(path: &Path, middles: &[f64], wide: f64) -> Vec<(f64, f64)> {
    let whole = path.length_mm();
    let mut spans: Vec<(f64, f64)> = Vec::new();
    for middle in middles {
        let (begin, end) = (middle - wide / 2.0, middle + wide / 2.0);
        // A tab across the start becomes two.
        if begin < 0.0 {
            spans.push((begin + whole, whole));
        }
        if end > whole {
            spans.push((0.0, end - whole));
        }
        spans.push((begin.max(0.0), end.min(whole)));
    }
    spans.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut apart: Vec<(f64, f64)> = Vec::new();
    for (begin, end) in spans {
        match apart.last_mut().filter(|last| begin <= last.1) {
            Some(last) => last.1 = last.1.max(end),
            None => apart.push((begin, end)),
        }
    }
    apart
}

fn without(path: &Path, tabs: &[(f64, f64)]) -> Vec<Path> {
    let whole = path.length_mm();
    let ends: Vec<(f64, f64)> =
        tabs.iter().zip(tabs.iter().skip(1)).map(|((_, end), (next, _))| (*end, *next)).collect();
    let parts = ends.into_iter().filter_map(|(begin, end)| cut::between(path, begin, end));
    let mut parts: Vec<Path> = parts.collect();
    let (first, last) = (tabs.first().map_or(0.0, |tab| tab.0), tabs.last().map_or(0.0, |tab| tab.1));
    let tail = cut::between(path, last, whole);
    let head = cut::between(path, 0.0, first);
    match (tail, head) {
        (Some(mut tail), Some(head)) => {
            tail.segments.extend(head.segments);
            parts.push(tail);
        }
        (tail, head) => parts.extend(tail.into_iter().chain(head)),
    }
    parts
}

/// Rows of holes along the board's edge within the tabs. The board is on the right of a climb path.
fn bite_places(cut_out: &CutOut, path: &Path, tabs: &[(f64, f64)], bit: &Bit, inwards: Length) -> Vec<Point> {
    let whole = path.length_mm();
    let right = cut_out.direction == super::super::work::CutDirection::Climb;
    let mut places = Vec::new();
    for &(begin, end) in tabs {
        // The tool's radius at both ends is cut away: the tab itself is between.
        let radius = bit.diameter.mm() / 2.0;
        let joined = tabs.len() > 1 && (begin <= 0.0 || end >= whole);
        let (begin, end) = if joined { (begin, end) } else { (begin + radius, end - radius) };
        let count = ((end - begin) / cut_out.bite_pitch.mm().max(0.05)) as u32;
        let first = (begin + end - f64::from(count) * cut_out.bite_pitch.mm()) / 2.0;
        let at: Vec<f64> = (0..=count).map(|n| first + f64::from(n) * cut_out.bite_pitch.mm()).collect();
        for length in at {
            let Some(part) = cut::between(path, 0.0, length.clamp(1e-3, whole)) else { continue };
            places.extend(beside(&part, inwards, right));
        }
    }
    places
}

/// The point `by` to the right, or left, of the end of `path`.
fn beside(path: &Path, by: Length, right: bool) -> Option<Point> {
    let (from, segment) = path.pieces().last()?;
    let to = segment.to();
    let (x, y) = match segment {
        PathSegment::Line { .. } => ((to.x - from.x).mm(), (to.y - from.y).mm()),
        PathSegment::Arc { centre, clockwise, .. } => {
            let (x, y) = ((to.x - centre.x).mm(), (to.y - centre.y).mm());
            if clockwise { (y, -x) } else { (-y, x) }
        }
    };
    let length = libm::sqrt(x * x + y * y).max(1e-9);
    let by = if right { by.mm() } else { -by.mm() };
    Some(Point::from_mm(to.x.mm() + y / length * by, to.y.mm() - x / length * by))
}

fn bite_task(context: &mut PlanContext<'_>, cut_out: &CutOut, places: Vec<Point>) -> Option<BitTask> {
    if places.is_empty() {
        return None;
    }
    let closed = context.scene.closed_to(cut_out.bite_hole);
    let free = |at: &Point| closed.as_ref().is_none_or(|zone| !zone.contains(*at));
    let places: Vec<Point> = places.into_iter().filter(free).collect();
    let Some(diameter) = rack::nearest(&context.machine.drills(), cut_out.bite_hole, BITE_TOLERANCE) else {
        let size = rack::size_text(cut_out.bite_hole);
        context.report(error!("cam.no_bit_for_bites", size = size, ..));
        return None;
    };
    let process = &context.machine.process;
    let drill_cycles = places.into_iter().map(|at| DrillCycle { at, hole: None }).collect();
    let depth = rack::through(process, process.breakthrough, diameter, POINT_DEG);
    Some(BitTask { drill_cycles, depth, ..BitTask::with(&rack::drill(diameter)) })
}
