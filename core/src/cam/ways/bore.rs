//! Slots, and holes for which there is no drill, milled (N9).
//!
//! ```text
//!   hole wider than the bit: a helix down        slot wider than the bit: rings, the innermost first,
//!   and once round at the bottom                 each a ramp all along
//!       ╭───╮                                       ╭──────────────╮
//!      │ ╭─╮ │                                      │ ╭──────────╮ │
//!      │ ╰─╯ │                                      │ ╰──────────╯ │
//!       ╰───╯                                       ╰──────────────╯
//! ```
//!
//! Comes in: holes and slots, mills of the job. Goes out: one task for each bit, widest first. Does not know the rack but for
//! telling which holes have a drill.

use super::super::places::{Places, Twice};
use super::super::rack;
use super::super::work::{Bore, Direction};
use super::beside::Beside;
use super::missing::Missing;
use super::route::{Rules, arranged};
use super::{Desk, Entry, Part, Task, Way};
use crate::geometry::{Path, Point, circle, grow, sweep};
use crate::job::Bit;
use crate::remark::{Remark, Weight};
use crate::units::Length;
use std::collections::BTreeSet;

/// A bit is not too wide for what it is wider than by no more than this.
const SLACK: Length = Length::from_um(2);
/// Neighbouring rings share so much of the bit's width.
const SHARED: f64 = 0.55;
/// More rings than this are not made in one hole.
const MOST_RINGS: usize = 200;

/// What is milled: where its middle line goes, and how wide it is to be.
struct Shape {
    middle: Vec<Point>,
    width: Length,
}

/// Shapes that are milled already.
#[derive(Default)]
struct Made {
    holes: Places,
    slots: BTreeSet<(Length, Vec<Point>)>,
}

impl Made {
    /// Whether a shape as `shape` was here before, a slot from whichever end.
    fn again(&mut self, shape: &Shape) -> bool {
        if let [at] = shape.middle.as_slice() {
            return self.holes.again(shape.width, *at, Length::ZERO);
        }
        let turned: Vec<Point> = shape.middle.iter().rev().copied().collect();
        !self.slots.insert((shape.width, turned.min(shape.middle.clone())))
    }
}

/// Plans the operation.
pub(super) fn plan(desk: &mut Desk<'_>, bore: &Bore) -> Result<Part, Remark> {
    let mut part = Part::default();
    let names: Vec<&str> =
        std::iter::once(desk.operation.bit.as_str()).chain(bore.further.iter().map(String::as_str)).collect();
    let bits = desk.mills(&names, true);
    let tolerance = desk.scene.tolerance(desk.work, desk.machine);
    let undrilled = |size: Length| rack::nearest(&desk.machine.rack, size, tolerance).is_none();
    let board = &desk.scene.board;
    let mut shapes = Vec::new();
    if bore.holes {
        let holes = (0..).zip(&board.holes).filter_map(|(index, hole)| Some((index, hole, hole.diameter?)));
        let wanted = holes.filter(|(index, _, size)| undrilled(*size) && !desk.scene.pins.contains(index));
        shapes.extend(wanted.map(|(index, hole, width)| (Shape { middle: vec![hole.at], width }, Ok(index))));
    }
    if bore.slots {
        let slots = (0..).zip(&board.slots).filter_map(|(index, slot)| Some((index, slot, slot.width?)));
        shapes.extend(
            slots.map(|(index, slot, width)| (Shape { middle: slot.path.clone(), width }, Err(index))),
        );
    }
    let mut by_bit: Vec<Vec<Path>> = bits.iter().map(|_| Vec::new()).collect();
    let (mut no_hole, mut no_slot) = (Missing::default(), Missing::default());
    let (mut beside, mut twice) = (Beside::default(), Twice::default());
    let mut made = Made::default();
    for (shape, index) in shapes {
        desk.go_on()?;
        let again = made.again(&shape);
        // The widest bit that fits; else the thinnest, if it is too wide by no more than a drill may be.
        let fits = |slack: Length| move |bit: &Bit| bit.diameter <= shape.width + slack;
        let fits = bits.iter().position(fits(SLACK)).or_else(|| bits.iter().rposition(fits(tolerance)));
        let Some((bit, paths)) = fits.and_then(|fits| bits.get(fits).zip(by_bit.get_mut(fits))) else {
            let at = shape.middle.first().copied().unwrap_or_default();
            match index {
                Ok(hole) => {
                    no_hole.add(shape.width, at);
                    part.left_holes.push(hole);
                }
                Err(slot) => {
                    no_slot.add(shape.width, at);
                    part.left_slots.push(slot);
                }
            }
            continue;
        };
        match shape.middle.first().filter(|_| again) {
            Some(at) => twice.add(*at),
            None => {
                beside.look(desk.scene, &shape.middle, shape.width);
                paths.extend(rings(&shape, bit, bore.direction));
            }
        }
        match index {
            Ok(hole) => part.holes.push(hole),
            Err(slot) => part.slots.push(slot),
        }
    }
    let losses = no_hole
        .losses("cam.holes_missing")
        .into_iter()
        .chain(no_slot.losses("cam.slots_missing"))
        .chain(beside.loss());
    losses.chain(twice.note("cam.holes_twice")).for_each(|remark| desk.say(remark));
    for (bit, paths) in bits.iter().zip(by_bit) {
        part.tasks.extend(task(desk, bit, paths));
    }
    Ok(part)
}

/// The ways that `bit` clears `shape` with, the innermost first.
fn rings(shape: &Shape, bit: &Bit, direction: Direction) -> Vec<Path> {
    let room = shape.width - bit.diameter;
    let around = |path: Path| if direction == Direction::Climb { path } else { path.reversed() };
    if room <= SLACK {
        return Path::through(&shape.middle).into_iter().map(around).collect();
    }
    let step = Length::from_mm(bit.diameter.mm() * (1.0 - SHARED));
    if let [at] = shape.middle.as_slice() {
        let count = ((room.nm() + 2 * step.nm() - 1) / (2 * step.nm())).clamp(1, MOST_RINGS as i64);
        let ring = |ring: i64| around(circle(*at, Length::from_nm(room.nm() * ring / count)));
        return (1..=count).map(ring).collect();
    }
    let mut region = Path::through(&shape.middle).map_or_else(Default::default, |path| sweep(&[path], room));
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

fn task(desk: &mut Desk<'_>, bit: &Bit, paths: Vec<Path>) -> Option<Task> {
    let closed = desk.scene.closed_to(bit.diameter);
    let (points, paths): (Vec<Path>, Vec<Path>) =
        paths.into_iter().partition(|path| path.segments.is_empty());
    let (points, paths, touched) = match &closed {
        Some(zone) => {
            let before = points.len() + paths.len();
            let free: Vec<Path> = paths.into_iter().filter(|path| whole(path, zone)).collect();
            let points: Vec<Path> = points.into_iter().filter(|path| !zone.contains(path.start)).collect();
            let touched = free.len() + points.len() != before;
            (points, free, touched)
        }
        None => (points, paths, false),
    };
    if touched {
        desk.say(Remark::new(Weight::Doubt, "cam.zone_in_the_way"));
    }
    let depth = desk.depth();
    let depths = desk.depths(depth);
    let way = |path: Path| {
        let entry = if path.is_closed() { Entry::Helix } else { Entry::Plunge };
        Way { path, depths: depths.clone(), entry, tabs: Vec::new(), tab_depth: Length::ZERO }
    };
    let rules = desk.free();
    let mut ways: Vec<Way> = points.into_iter().map(way).collect();
    ways.extend(grouped(paths, &rules).into_iter().map(way));
    (!ways.is_empty()).then(|| Task { ways, ..Task::with(bit) })
}

/// Whether a way keeps out of a zone altogether.
fn whole(path: &Path, zone: &super::cut::Area) -> bool {
    super::cut::parts(path, zone, false).first() == Some(path)
}

/// Rings of one shape follow each other from the inside out; the shapes are put in order by their last rings.
fn grouped(paths: Vec<Path>, rules: &Rules<'_>) -> Vec<Path> {
    let mut groups: Vec<Vec<Path>> = Vec::new();
    let mut last: Option<crate::geometry::Bounds> = None;
    for path in paths {
        let bounds = crate::geometry::path_bounds(&path);
        let inside = last.is_some_and(|last| bounds.contains(last.min) && bounds.contains(last.max));
        match groups.last_mut().filter(|_| inside) {
            Some(group) => group.push(path),
            None => groups.push(vec![path]),
        }
        last = Some(bounds);
    }
    let outer: Vec<Path> = groups.iter().filter_map(|group| group.last().cloned()).collect();
    let mut out = Vec::new();
    for outer in arranged(outer, rules) {
        let bounds = crate::geometry::path_bounds(&outer);
        let found = groups
            .iter()
            .position(|group| group.last().is_some_and(|last| crate::geometry::path_bounds(last) == bounds));
        if let Some(found) = found {
            let mut group = groups.swap_remove(found);
            group.pop();
            out.append(&mut group);
        }
        out.push(outer);
    }
    out
}
