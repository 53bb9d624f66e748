//! Grooves round the copper (N7).
//!
//! ```text
//!   ▓▓▓▓▓▓▓   copper
//!   ─ ─ ─ ─   1st way: half the cut's width away
//!   ─ ─ ─ ─   2nd way: further by the width less the overlap
//!
//!   a thinner bit afterwards goes only where the one before was too wide
//! ```
//!
//! Comes in: the copper of one side, an operation. Goes out: tasks, widest bit first. Ways follow the true offset within
//! 2 µm: 1 µm of the offset itself, and 1 µm that they run nearer, so that a gap exactly as wide as the bit stays open.
//! Does not know what was left uncut: the proof tells.

use super::super::work::{Cure, Direction, Isolate, Remedy};
use super::cut::{self, Area};
use super::narrow::{self, NEARER, half};
use super::route::{Rules, arranged};
use super::{Desk, Part, Task};
use super::{shared, slivers};
use crate::board::{COPPER_THICKNESS, DEPTH_MARGIN, THINNEST};
use crate::geometry::{Island, Path, Region, grow, rectangle, union, watershed};
use crate::job::{Bit, Cutter};
use crate::remark::{Remark, Weight};
use crate::units::Length;

/// Links stay this much nearer to the copper than ways, to allow for rounding.
const LINK_SLACK: Length = Length::from_um(4);

/// Plans the operation.
pub(super) fn plan(desk: &mut Desk<'_>, isolate: &Isolate) -> Result<Part, Remark> {
    let mut part = Part::default();
    let Some(copper) = desk.scene.copper(desk.operation.face) else {
        desk.say(Remark::new(Weight::Note, "cam.no_copper"));
        return Ok(part);
    };
    let copper = &copper.region;
    let names: Vec<&str> = std::iter::once(desk.operation.bit.as_str())
        .chain(isolate.further.iter().map(String::as_str))
        .collect();
    let bits = desk.mills(&names, false);
    let depth = desk.depth();
    let mut groove = Groove::of(copper);
    let mut wider: Option<Length> = None;
    for bit in &bits {
        desk.go_on()?;
        let width = cut_width(desk, bit, depth);
        if width <= NEARER + NEARER {
            continue;
        }
        let paths = match wider {
            None if isolate.voronoi => between_islands(desk, copper, width),
            None => rings(desk, copper, isolate, bit)?,
            Some(wider) => groove.rest(wider, width),
        };
        let task = finished(desk, &groove, paths, bit, width, isolate);
        part.tasks.extend(task);
        wider = Some(width);
    }
    if let (Some(bit), Some(thin), Some(_)) = (bits.first(), bits.last(), wider) {
        for cure in &isolate.cures {
            desk.go_on()?;
            part.tasks.extend(cured(desk, &mut groove, isolate, (bit, thin), cure));
        }
    }
    Ok(part)
}

/// The width that `bit` cuts at `depth`; told when the bit is already as wide as it gets.
fn cut_width(desk: &mut Desk<'_>, bit: &Bit, depth: Length) -> Length {
    let width = bit.width_at(depth);
    if matches!(bit.cutter, Cutter::Vee { .. }) && width >= bit.diameter {
        let said = Remark::new(Weight::Doubt, "cam.bit_too_deep");
        desk.say(said.with("bit", &bit.name).with("depth", depth.mm()));
    }
    width
}

/// Copper and what is made of it once.
pub(super) struct Groove<'a> {
    copper: &'a Region,
    islands: Option<Area>,
    narrow: Vec<(Length, Vec<Island>)>,
}

impl<'a> Groove<'a> {
    pub(super) fn of(copper: &'a Region) -> Self {
        Self { copper, islands: None, narrow: Vec::new() }
    }

    /// The places where a cut of `width` does not fit.
    fn narrow(&mut self, width: Length) -> Vec<Island> {
        if let Some((_, places)) = self.narrow.iter().find(|(known, _)| *known == width) {
            return places.clone();
        }
        let islands = self.islands.get_or_insert_with(|| Area::of(self.copper));
        let places = narrow::narrow(self.copper, islands, width);
        self.narrow.push((width, places.clone()));
        places
    }

    /// The ways of a cut of `width` where one of width `wider` did not fit.
    pub(super) fn rest(&mut self, wider: Length, width: Length) -> Vec<Path> {
        let places = self.narrow(wider);
        narrow::ways_through(self.copper, &places, width)
    }
}

/// The rings of the first bit, and the ways along the slivers between them.
fn rings(desk: &mut Desk<'_>, copper: &Region, isolate: &Isolate, bit: &Bit) -> Result<Vec<Path>, Remark> {
    let depth = desk.depth();
    let width = bit.width_at(depth);
    let through = bit.width_at(depth - COPPER_THICKNESS) - NEARER;
    let step = Length::from_mm(width.mm() * (1.0 - isolate.overlap_percent / 100.0));
    // Where a groove narrows downwards, neighbours that overlap at the surface may leave a sliver below.
    let close = isolate.slivers && through > Length::ZERO && step < through + THINNEST;
    let step = if close { step.min(through) } else { step };
    let mut region = grow(copper, half(width) - NEARER);
    let mut paths = Vec::new();
    for pass in 1..=isolate.passes {
        desk.go_on()?;
        let next = (pass < isolate.passes).then_some(step);
        let ways = match isolate.slivers {
            true => slivers::with_slivers(&region, through, next),
            false => region.paths().cloned().collect(),
        };
        paths.extend(turned(shared::once(ways), isolate.direction));
        if next.is_some() {
            region = grow(&region, step);
        }
    }
    Ok(paths)
}

/// The lines midway between islands, as far as they lie on the board, or without an outline in the copper's box, and as
/// far as a cut of `width` has room there.
fn between_islands(desk: &Desk<'_>, copper: &Region, width: Length) -> Vec<Path> {
    let outline = &desk.scene.board.outline;
    let margin = desk.work.setup.margin;
    let around = match copper.bounds() {
        _ if !outline.is_empty() => grow(outline, margin),
        Some(bounds) => union(&[rectangle(bounds.grown(margin))]),
        None => return Vec::new(),
    };
    let too_near = Area::of(&grow(copper, half(width) - NEARER));
    watershed(copper, &around).iter().flat_map(|path| cut::parts(path, &too_near, false)).collect()
}

/// Outlines as regions have them, what is inside on their left, turned so that the cut goes as wanted.
pub(super) fn turned(paths: Vec<Path>, direction: Direction) -> Vec<Path> {
    match direction {
        Direction::Conventional => paths,
        Direction::Climb => paths.iter().map(Path::reversed).collect(),
    }
}

/// Trimmed, in order and joined.
fn finished(
    desk: &mut Desk<'_>,
    groove: &Groove<'_>,
    paths: Vec<Path>,
    bit: &Bit,
    width: Length,
    isolate: &Isolate,
) -> Option<Task> {
    let closed = desk.scene.closed_to(width);
    let (paths, touched) = desk.scene.trimmed(paths, closed.as_ref());
    if touched {
        desk.say(Remark::new(Weight::Doubt, "cam.zone_in_the_way"));
    }
    let islands = (isolate.passes > 1).then(|| Area::of(groove.copper));
    let rules = Rules {
        start: desk.scene.origin,
        overlap: isolate.loop_overlap,
        both_ways: true,
        link: islands.as_ref().map(|islands| (width, half(width) - LINK_SLACK, islands)),
        seed: desk.means.options.seed,
    };
    let paths = arranged(paths, &rules);
    desk.milling(bit, paths, desk.depth())
}

/// How deep `bit` goes through a gap of width `gap`: a V-bit as deep as fits, any other as the operation goes.
fn fitting_depth(bit: &Bit, gap: Length, depth: Length) -> Length {
    let least = COPPER_THICKNESS + DEPTH_MARGIN;
    match bit.cutter {
        Cutter::Vee { .. } => bit.fitting(gap, least).map_or(least, |(depth, _)| depth),
        Cutter::Drill | Cutter::Mill => depth,
    }
}

/// What a cure adds with the operation's first bit or its thinnest; told when its gap is not found, and how much copper it takes.
fn cured(
    desk: &mut Desk<'_>,
    groove: &mut Groove<'_>,
    isolate: &Isolate,
    (own, thin): (&Bit, &Bit),
    cure: &Cure,
) -> Option<Task> {
    let depth = desk.depth();
    let gap = Length::from_mm(cure.from.distance_mm(cure.to));
    let places = groove.narrow(own.width_at(depth));
    let (x, y) = narrow::middle_text(cure);
    let Some(place) = narrow::place_of(cure, &places) else {
        desk.say(Remark::new(Weight::Doubt, "cam.cure_without_gap").with("x", x).with("y", y));
        return None;
    };
    let (bit, width, depth) = match &cure.with {
        Remedy::Bit(name) => {
            let bit = desk.mills(&[name], false).pop()?;
            let depth = fitting_depth(&bit, gap, depth);
            let width = bit.width_at(depth);
            (bit, width, depth)
        }
        Remedy::Depth(depth) => (own.clone(), own.width_at(*depth), *depth),
        Remedy::Centred => {
            let depth = fitting_depth(thin, gap, depth);
            (thin.clone(), thin.width_at(depth), depth)
        }
    };
    let mut paths = narrow::ways_through(groove.copper, std::slice::from_ref(place), width);
    if cure.with == Remedy::Centred {
        let islands = groove.islands.as_ref()?;
        let (ways, lost) = narrow::centred(groove.copper, islands, place, cure, width)?;
        let said = Remark::new(Weight::Note, "cam.cure_takes").with("x", &x).with("y", &y);
        desk.say(said.with("lost", format!("{:.3}", lost.mm())));
        paths = ways;
    }
    if paths.is_empty() {
        desk.say(Remark::new(Weight::Doubt, "cam.cure_in_vain").with("x", x).with("y", y));
        return None;
    }
    let single = Isolate { passes: 1, loop_overlap: Length::ZERO, ..isolate.clone() };
    let mut task = finished(desk, groove, paths, &bit, width, &single)?;
    let depths = desk.depths(depth);
    task.ways.iter_mut().for_each(|way| way.depths.clone_from(&depths));
    Some(task)
}
