//! Isolation: passes round the copper (N7).
//!
//! ```text
//!   ▓▓▓▓▓▓▓   copper
//!   ─ ─ ─ ─   1st way: half the cut's width away
//!   ─ ─ ─ ─   2nd way: further by the width less the overlap
//!
//!   a thinner bit afterwards goes only where the one before was too wide
//! ```
//!
//! Comes in: the copper of one side, an operation. Goes out: tasks, widest bit first. Toolpaths follow the true offset within
//! 2 µm: 1 µm of the offset itself, and 1 µm that they run nearer, so that a gap exactly as wide as the bit stays open.
//! Does not know what was left uncut: the proof tells.

use super::super::work::{CutDirection, Isolate, LocalIsolation, Remedy};
use super::cut::{self, Area};
use super::narrow::{self, NEARER, Necks, half};
use super::route::{Rules, arranged};
use super::shared;
use super::{BitTask, PlacedBoard, PlanContext, PlannedOperation};
use crate::board::{COPPER_THICKNESS, DEPTH_MARGIN, THINNEST};
use crate::diagnostic::Diagnostic;
use crate::geometry::{Island, Path, Region, grow, rectangle, union, voronoi};
use crate::job::{Bit, Cutter};
use crate::units::Length;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// Links stay this much nearer to the copper than toolpaths, to allow for rounding.
const LINK_SLACK: Length = Length::from_um(4);

/// Plans the operation.
pub(super) fn plan(context: &mut PlanContext<'_>, isolate: &Isolate) -> Result<PlannedOperation, Diagnostic> {
    let mut part = PlannedOperation::default();
    let Some(copper) = context.scene.copper(context.operation.face) else {
        context.report(Diagnostic::note("cam.no_copper"));
        return Ok(part);
    };
    let copper = &copper.region;
    let names: Vec<&str> = std::iter::once(context.operation.bit.as_str())
        .chain(isolate.further.iter().map(String::as_str))
        .collect();
    let bits = context.mills(&names, false);
    let depth = context.depth();
    let mut isolated = Isolated::of(copper, context.scene);
    let mut wider: Option<Length> = None;
    for bit in &bits {
        context.go_on()?;
        let width = cut_width(context, bit, depth);
        if width <= NEARER + NEARER {
            continue;
        }
        let paths = match wider {
            None if isolate.voronoi => between_islands(context, copper, width),
            None => rings(context, copper, isolate, bit)?,
            Some(wider) => isolated.rest(wider, width),
        };
        let task = finished(context, &isolated, paths, bit, width, isolate);
        part.tasks.extend(task);
        wider = Some(width);
    }
    if let (Some(bit), Some(thin), Some(_)) = (bits.first(), bits.last(), wider) {
        part.tasks.extend(cured(context, &mut isolated, isolate, (bit, thin))?);
    }
    Ok(part)
}

/// The width that `bit` cuts at `depth`; told when the bit is already as wide as it gets.
fn cut_width(context: &mut PlanContext<'_>, bit: &Bit, depth: Length) -> Length {
    let width = bit.width_at(depth);
    if matches!(bit.cutter, Cutter::Vee { .. }) && width >= bit.diameter {
        let said = Diagnostic::warning("cam.bit_too_deep");
        context.report(said.with("bit", bit.titled()).with("depth", depth.mm()));
    }
    width
}

/// Copper and what is made of it once.
pub(super) struct Isolated<'a> {
    copper: &'a Region,
    scene: &'a PlacedBoard,
    islands: Option<Area>,
    /// Grown by what the toolpaths of cuts of these widths keep.
    grown: BTreeMap<Length, Region>,
    /// By the width of the wider cut and of the thinner.
    necks: BTreeMap<(Length, Length), Rc<Necks>>,
}

impl<'a> Isolated<'a> {
    pub(super) fn of(copper: &'a Region, scene: &'a PlacedBoard) -> Self {
        Self { copper, scene, islands: None, grown: BTreeMap::new(), necks: BTreeMap::new() }
    }

    /// The copper and what the toolpath of a cut of `width` keeps around it.
    fn keeping(&self, width: Length) -> Region {
        self.scene.making().grown(self.copper, narrow::kept(width))
    }

    /// The islands, to be looked up.
    fn islands(&mut self) -> &Area {
        self.islands.get_or_insert_with(|| Area::of(self.copper))
    }

    /// The places where a cut of `width` goes on from where one of width `wider` had to turn.
    fn necks(&mut self, wider: Length, width: Length) -> Rc<Necks> {
        let (copper, scene) = (self.copper, self.scene);
        let grown = self.grown.entry(wider);
        let grown = grown.or_insert_with(|| scene.making().grown(copper, narrow::kept(wider)));
        let necks = self.necks.entry((wider, width));
        Rc::clone(necks.or_insert_with(|| Rc::new(Necks::of((copper, grown), wider, width))))
    }

    /// The toolpaths of a cut of `width` where one of width `wider` did not fit.
    pub(super) fn rest(&mut self, wider: Length, width: Length) -> Vec<Path> {
        let necks = self.necks(wider, width).of_a_bit(self.islands(), (wider, width));
        narrow::paths_in(&necks, || self.keeping(width))
    }
}

/// The rings of the first bit, and the toolpaths along the slivers between them.
fn rings(
    context: &mut PlanContext<'_>,
    copper: &Region,
    isolate: &Isolate,
    bit: &Bit,
) -> Result<Vec<Path>, Diagnostic> {
    let depth = context.depth();
    let width = bit.width_at(depth);
    let through = bit.width_at(depth - COPPER_THICKNESS) - NEARER;
    let step = Length::from_mm(width.mm() * (1.0 - isolate.overlap_percent / 100.0));
    // Where a groove narrows downwards, neighbours that overlap at the surface may leave a sliver below.
    let close = isolate.slivers && through > Length::ZERO && step < through + THINNEST;
    let step = if close { step.min(through) } else { step };
    let mut region = context.scene.making().grown(copper, half(width) - NEARER);
    let mut paths = Vec::new();
    for pass in 1..=isolate.passes {
        context.go_on()?;
        let next = (pass < isolate.passes).then_some(step);
        let toolpaths = match isolate.slivers {
            true => context.scene.making().with_slivers(&region, through, next),
            false => shared::once(region.paths().cloned().collect()),
        };
        paths.extend(turned(toolpaths, isolate.direction));
        if next.is_some() {
            region = context.scene.making().grown(&region, step);
        }
    }
    Ok(paths)
}

/// The lines midway between islands, as far as they lie on the board, or without an outline in the copper's box, and as
/// far as a cut of `width` has room there.
fn between_islands(context: &PlanContext<'_>, copper: &Region, width: Length) -> Vec<Path> {
    let outline = &context.scene.board.outline;
    let margin = context.work.setup.margin;
    let around = match copper.bounds() {
        _ if !outline.is_empty() => grow(outline, margin),
        Some(bounds) => union(&[rectangle(bounds.grown(margin))]),
        None => return Vec::new(),
    };
    let too_near = Area::of(&context.scene.making().grown(copper, half(width) - NEARER));
    voronoi(copper, &around).iter().flat_map(|path| cut::parts(path, &too_near, false)).collect()
}

/// Outlines as regions have them, what is inside on their left, turned so that the cut goes as wanted.
pub(super) fn turned(paths: Vec<Path>, direction: CutDirection) -> Vec<Path> {
    match direction {
        CutDirection::Conventional => paths,
        CutDirection::Climb => paths.iter().map(Path::reversed).collect(),
    }
}

/// Trimmed, in order and joined.
fn finished(
    context: &mut PlanContext<'_>,
    isolated: &Isolated<'_>,
    paths: Vec<Path>,
    bit: &Bit,
    width: Length,
    isolate: &Isolate,
) -> Option<BitTask> {
    let closed = context.scene.closed_to(width);
    let (paths, touched) = context.scene.trimmed(paths, closed.as_ref());
    if touched {
        context.report(Diagnostic::warning("cam.zone_in_the_way"));
    }
    let islands = (isolate.passes > 1).then(|| Area::of(isolated.copper));
    let rules = Rules {
        start: context.scene.origin,
        overlap: isolate.loop_overlap,
        both_ways: true,
        link: islands.as_ref().map(|islands| (width, half(width) - LINK_SLACK, islands)),
        seed: context.means.options.seed,
    };
    let paths = arranged(paths, &rules);
    context.milling(bit, paths, context.depth())
}

/// How deep `bit` goes through a gap of width `gap`: a V-bit as deep as fits, any other as the operation goes.
fn fitting_depth(bit: &Bit, gap: Length, depth: Length) -> Length {
    let least = COPPER_THICKNESS + DEPTH_MARGIN;
    match bit.cutter {
        Cutter::Vee { .. } => bit.fitting(gap, least).map_or(least, |(depth, _)| depth),
        Cutter::Drill | Cutter::Mill => depth,
    }
}

/// What one cure has done, to be done with others that are done alike.
struct Remedied<'c> {
    cure: &'c LocalIsolation,
    bit: Bit,
    depth: Length,
    /// The necks that it is looked for in: those that a cut of this width gets into.
    fits: Length,
}

/// How a cure is done, with the operation's first bit or its thinnest.
fn remedied<'c>(
    context: &mut PlanContext<'_>,
    (own, thin): (&Bit, &Bit),
    cure: &'c LocalIsolation,
) -> Option<Remedied<'c>> {
    let depth = context.depth();
    let gap = Length::from_mm(cure.from.distance_mm(cure.to));
    let (bit, depth) = match &cure.with {
        Remedy::Bit(name) => {
            let bit = context.mills(&[name], false).pop()?;
            let depth = fitting_depth(&bit, gap, depth);
            (bit, depth)
        }
        Remedy::Depth(depth) => (own.clone(), *depth),
        Remedy::Centred => (thin.clone(), fitting_depth(thin, gap, depth)),
    };
    let fits = if cure.with == Remedy::Centred { narrow::fitting(gap) } else { bit.width_at(depth) };
    Some(Remedied { cure, bit, depth, fits })
}

/// What cures add, a task for all that one bit does at one depth; told where a gap is not found, and how much copper one takes.
fn cured(
    context: &mut PlanContext<'_>,
    isolated: &mut Isolated<'_>,
    isolate: &Isolate,
    bits: (&Bit, &Bit),
) -> Result<Vec<BitTask>, Diagnostic> {
    let wider = bits.0.width_at(context.depth());
    let mut alike: Vec<(Bit, Length, Vec<Path>)> = Vec::new();
    let mut fitted: Vec<(Bit, Length, BTreeSet<Island>)> = Vec::new();
    let mut taken = Vec::new();
    for cure in &isolate.cures {
        context.go_on()?;
        let Some(Remedied { cure, bit, depth, fits }) = remedied(context, bits, cure) else { continue };
        let necks = isolated.necks(wider, fits);
        let (x, y) = narrow::middle_text(cure);
        let Some(neck) = necks.at(cure) else {
            context.report(Diagnostic::warning("cam.cure_without_gap").with("x", x).with("y", y));
            continue;
        };
        if cure.with != Remedy::Centred {
            let known = fitted.iter_mut().find(|(known, deep, _)| (known, *deep) == (&bit, depth));
            match known {
                Some((_, _, necks)) => drop(necks.insert(neck.clone())),
                None => fitted.push((bit, depth, BTreeSet::from([neck.clone()]))),
            }
            continue;
        }
        let toolpaths = narrow::centred(isolated.copper, isolated.islands(), neck, cure);
        let gap = Length::from_mm(cure.from.distance_mm(cure.to));
        let lost = (half(bit.width_at(depth)) - half(gap)).max(Length::ZERO);
        if toolpaths.is_empty() {
            context.report(Diagnostic::warning("cam.cure_in_vain").with("x", x).with("y", y));
        } else {
            taken.push((lost, x, y));
        }
        match alike.iter_mut().find(|(known, deep, _)| (known, *deep) == (&bit, depth)) {
            Some((_, _, known)) => known.extend(toolpaths),
            None => alike.push((bit, depth, toolpaths)),
        }
    }
    tell_taken(context, taken);
    let fitted = fitted.into_iter().map(|(bit, depth, necks)| {
        let necks: Vec<Island> = necks.into_iter().collect();
        let toolpaths = narrow::paths_in(&necks, || isolated.keeping(bit.width_at(depth)));
        (bit, depth, toolpaths)
    });
    let all: Vec<(Bit, Length, Vec<Path>)> = fitted.chain(alike).collect();
    Ok(all.into_iter().filter_map(|cut| at_depth(context, isolated, isolate, cut)).collect())
}

/// Tells once of all the places where a centred pass takes copper on each side: how many, and the worst.
fn tell_taken(context: &mut PlanContext<'_>, taken: Vec<(Length, String, String)>) {
    let count = taken.len();
    if let Some((most, x, y)) = taken.into_iter().rev().max_by_key(|(lost, ..)| *lost) {
        let note = Diagnostic::note("cam.cure_takes").with("count", count);
        context.report(note.with("lost", format!("{:.3}", most.mm())).with("x", x).with("y", y));
    }
}

/// Single toolpaths of a bit at a depth of their own.
fn at_depth(
    context: &mut PlanContext<'_>,
    isolated: &Isolated<'_>,
    isolate: &Isolate,
    (bit, depth, paths): (Bit, Length, Vec<Path>),
) -> Option<BitTask> {
    let single = Isolate { passes: 1, loop_overlap: Length::ZERO, ..isolate.clone() };
    let mut task = finished(context, isolated, paths, &bit, bit.width_at(depth), &single)?;
    let depths = context.depths(depth);
    task.toolpaths.iter_mut().for_each(|way| way.depths.clone_from(&depths));
    Some(task)
}
