//! Mills slots, and holes without a suitable drill.
//!
//! ```text
//!   hole wider than the tool: a helix down       slot wider than the tool: rings, the innermost first,
//!   and one lap at the bottom                    each a ramp over its whole length
//!       ╭───╮                                       ╭──────────────╮
//!      │ ╭─╮ │                                      │ ╭──────────╮ │
//!      │ ╰─╯ │                                      │ ╰──────────╯ │
//!       ╰───╯                                       ╰──────────────╯
//! ```

use super::super::places::Twice;
use super::super::rack;
use super::super::work::{CutDirection, MillHoles};
use super::checks::duplicates::Milled;
use super::checks::no_tool::Missing;
use super::checks::outside_outline::Beside;
use super::route::{Rules, arranged};
use super::{BitTask, EntryMove, HoleOrSlot, PlanContext, PlannedOperation, Toolpath};
use crate::diagnostic::Diagnostic;
use crate::geometry::{Path, Point, circle, grow, path_bounds, sweep};
use crate::job::Bit;
use crate::units::Length;
use crate::{code, warning};

const SLACK: Length = Length::from_um(2);
/// Share of the tool's width that neighbouring rings overlap.
const OVERLAP_SHARE: f64 = 0.55;
const MOST_RINGS: usize = 200;

/// A shape to mill: centre line, width, and its hole or slot.
struct Wanted {
    middle: Vec<Point>,
    width: Length,
    shape: HoleOrSlot,
}

pub(super) fn plan(context: &mut PlanContext<'_>, bore: &MillHoles) -> Result<PlannedOperation, Diagnostic> {
    let mut part = PlannedOperation::default();
    let bits = context.own_mills();
    let tolerance = context.scene.tolerance(context.work, context.machine);
    let mut by_bit: Vec<Vec<(HoleOrSlot, Vec<Path>)>> = bits.iter().map(|_| Vec::new()).collect();
    let (mut no_hole, mut no_slot) = (Missing::default(), Missing::default());
    let (mut beside, mut twice) = (Beside::default(), Twice::default());
    let mut milled = Milled::default();
    for wanted in wanted(context, bore, tolerance) {
        context.go_on()?;
        let again = milled.again(&wanted.middle, wanted.width, Length::ZERO);
        // The widest tool that fits; else the narrowest, if its excess is within the tolerance of a drill.
        let fits = |slack: Length| move |bit: &Bit| bit.diameter <= wanted.width + slack;
        let fits = bits.iter().position(fits(SLACK)).or_else(|| bits.iter().rposition(fits(tolerance)));
        let Some((bit, paths)) = fits.and_then(|fits| bits.get(fits).zip(by_bit.get_mut(fits))) else {
            let at = wanted.middle.first().copied().unwrap_or_default();
            match wanted.shape {
                HoleOrSlot::Hole(hole) => {
                    no_hole.add(wanted.width, at);
                    part.left_holes.push(hole);
                }
                HoleOrSlot::Slot(slot) => {
                    no_slot.add(wanted.width, at);
                    part.left_slots.push(slot);
                }
            }
            continue;
        };
        match wanted.middle.first().filter(|_| again) {
            Some(at) => twice.add(*at),
            None => {
                beside.look(context.scene, &wanted.middle, wanted.width);
                paths.push((wanted.shape, rings(&wanted, bit, bore.direction)));
            }
        }
        match wanted.shape {
            HoleOrSlot::Hole(hole) => part.holes.push(hole),
            HoleOrSlot::Slot(slot) => part.slots.push(slot),
        }
    }
    let errors = no_hole
        .errors(code!("cam.holes_missing"))
        .into_iter()
        .chain(no_slot.errors(code!("cam.slots_missing")))
        .chain(beside.error());
    errors.chain(twice.note(code!("cam.holes_twice"))).for_each(|diagnostic| context.report(diagnostic));
    for (bit, paths) in bits.iter().zip(by_bit) {
        part.tasks.extend(task(context, bit, paths));
    }
    Ok(part)
}

/// Shapes to mill: holes that no available drill fits, except pin holes, and slots.
fn wanted(context: &PlanContext<'_>, bore: &MillHoles, tolerance: Length) -> Vec<Wanted> {
    let drills = context.machine.drills();
    let undrilled = |size: Length| rack::nearest(&drills, size, tolerance).is_none();
    let board = &context.scene.board;
    let holes = (0..).zip(&board.holes).filter(|_| bore.holes).filter_map(|(index, hole)| {
        let width = hole.diameter.filter(|size| undrilled(*size) && !context.scene.pins.contains(&index))?;
        Some(Wanted { middle: vec![hole.at], width, shape: HoleOrSlot::Hole(index) })
    });
    let slots = (0..).zip(&board.slots).filter(|_| bore.slots).filter_map(|(index, slot)| {
        Some(Wanted { middle: slot.path.clone(), width: slot.width?, shape: HoleOrSlot::Slot(index) })
    });
    holes.chain(slots).collect()
}

fn rings(wanted: &Wanted, bit: &Bit, direction: CutDirection) -> Vec<Path> {
    let room = wanted.width - bit.diameter;
    let around = |path: Path| if direction == CutDirection::Climb { path } else { path.reversed() };
    if room <= SLACK {
        return Path::through(&wanted.middle).into_iter().map(around).collect();
    }
    let step = Length::from_mm(bit.diameter.mm() * (1.0 - OVERLAP_SHARE));
    if let [at] = wanted.middle.as_slice() {
        let count = ((room.nm() + 2 * step.nm() - 1) / (2 * step.nm())).clamp(1, MOST_RINGS as i64);
        let ring = |ring: i64| around(circle(*at, Length::from_nm(room.nm() * ring / count)));
        return (1..=count).map(ring).collect();
    }
    let mut region = Path::through(&wanted.middle).map_or_else(Default::default, |path| sweep(&[path], room));
    let mut inwards: Vec<Path> = Vec::new();
    for _ in 0..MOST_RINGS {
        if region.is_empty() {
            break;
        }
        inwards.extend(region.paths().cloned().map(around));
        region = grow(&region, -step);
    }
    inwards.reverse();
    inwards
}

/// Toolpaths of `bit`: single plunges first, then the others.
fn task(context: &mut PlanContext<'_>, bit: &Bit, shapes: Vec<(HoleOrSlot, Vec<Path>)>) -> Option<BitTask> {
    let closed = context.scene.closed_to(bit.diameter);
    let mut touched = false;
    let mut free = |path: &Path| {
        let open = closed.as_ref().is_none_or(|zone| {
            if path.segments.is_empty() { !zone.contains(path.start) } else { whole(path, zone) }
        });
        touched |= !open;
        open
    };
    let (mut points, mut rings) = (Vec::new(), Vec::new());
    for (shape, mut paths) in shapes {
        let wanted = paths.len();
        paths.retain(&mut free);
        // A shape cut short by a zone is not cleared: another operation may still clear it.
        let shape = (paths.len() == wanted).then_some(shape);
        let (point, ring): (Vec<Path>, Vec<Path>) =
            paths.into_iter().partition(|path| path.segments.is_empty());
        points.extend(point.into_iter().map(|path| (shape, path)));
        rings.extend((!ring.is_empty()).then_some((shape, ring)));
    }
    if touched {
        context.report(warning!("cam.zone_in_the_way", ..));
    }
    let depth = context.depth();
    let depths = context.depths(depth);
    let way = |(clears, path): (Option<HoleOrSlot>, Path)| {
        let entry = if path.is_closed() { EntryMove::Helix } else { EntryMove::Plunge };
        Toolpath { path, depths: depths.clone(), entry, tabs: Vec::new(), tab_depth: Length::ZERO, clears }
    };
    let rules = context.free();
    let mut toolpaths: Vec<Toolpath> = points.into_iter().map(way).collect();
    toolpaths.extend(grouped(rings, &rules).into_iter().map(way));
    (!toolpaths.is_empty()).then(|| BitTask { toolpaths, ..BitTask::with(bit) })
}

/// True if a toolpath is entirely outside a zone.
fn whole(path: &Path, zone: &super::cut::Area) -> bool {
    super::cut::parts(path, zone, false).first() == Some(path)
}

/// Rings of one shape are in order from the inside out; shapes are ordered by their last rings.
fn grouped(
    mut shapes: Vec<(Option<HoleOrSlot>, Vec<Path>)>,
    rules: &Rules<'_>,
) -> Vec<(Option<HoleOrSlot>, Path)> {
    let outer: Vec<Path> = shapes.iter().filter_map(|(_, rings)| rings.last().cloned()).collect();
    let mut out = Vec::new();
    for outer in arranged(outer, rules) {
        let bounds = path_bounds(&outer);
        let found =
            shapes.iter().position(|(_, rings)| rings.last().is_some_and(|last| path_bounds(last) == bounds));
        let Some(found) = found else { continue };
        let (shape, mut rings) = shapes.swap_remove(found);
        rings.pop();
        out.extend(rings.into_iter().map(|ring| (shape, ring)));
        out.push((shape, outer));
    }
    out
}
