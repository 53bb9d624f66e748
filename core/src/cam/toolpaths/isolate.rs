//! Isolation: passes around the copper.
//!
//! ```text
//!   ▓▓▓▓▓▓▓   copper
//!   ─ ─ ─ ─   1st path: half the cut's width away
//!   ─ ─ ─ ─   2nd path: further by the width minus the overlap
//!
//!   a narrower tool then cuts only where the previous one was too wide
//! ```
//!
//! Toolpaths follow the true offset within 2 µm: 1 µm from the offset itself, and 1 µm that they are nearer.
//! So a gap exactly as wide as the tool stays open.

use super::super::work::{CutDirection, Isolate, LocalIsolation, Remedy};
use super::cut::{self, Area};
use super::kept::REFIT;
use super::linked::{LONGEST_MM, Links, along_and_back, linked};
use super::narrow::{self, NEARER, Necks, half};
use super::refit::refitted;
use super::route::{Rules, arranged};
use super::{BitTask, PlacedBoard, PlanContext, PlannedOperation};
use super::{shared, slivers};
use crate::board::{COPPER_THICKNESS, DEPTH_MARGIN, THINNEST};
use crate::diagnostic::Diagnostic;
use crate::geometry::{Island, Path, Region, grow, rectangle, union, voronoi};
use crate::job::{Bit, Cutter};
use crate::units::Length;
use crate::{note, warning};
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// Links may be nearer to the copper than half a cut by this, like toolpaths.
pub(super) const LINK_SLACK: Length = Length::from_um(2);

/// The longest link of one pass, as a share of the cut's width: the toolpaths at both ends already cut its
/// whole area.
const ACROSS_SHARE: f64 = 0.7;

/// The longest link across copper that belongs to no net. There and back takes less time than a retract and a plunge.
const ACROSS_STRIP: Length = Length::from_um(1_000);
/// Open toolpaths up to this length, in mm, run forwards and back if such a link joins them.
const BACK_MM: f64 = 2.0;
/// The distance between places from which links across such copper are searched.
const STRIP_SPACING: Length = Length::from_um(250);

pub(super) fn plan(context: &mut PlanContext<'_>, isolate: &Isolate) -> Result<PlannedOperation, Diagnostic> {
    let mut part = PlannedOperation::default();
    let Some(copper) = context.scene.copper(context.operation.face) else {
        context.report(note!("cam.no_copper", ..));
        return Ok(part);
    };
    let copper = &copper.region;
    let bits = context.own_mills();
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

/// The width that `bit` cuts at `depth`; warns if the tool is already at its full width.
fn cut_width(context: &mut PlanContext<'_>, bit: &Bit, depth: Length) -> Length {
    let width = bit.width_at(depth);
    if matches!(bit.cutter, Cutter::Vee { .. }) && width >= bit.diameter {
        let said = warning!("cam.bit_too_deep", ..);
        context.report(said.with("bit", bit.titled()).with("depth", depth.mm()));
    }
    width
}

pub(super) struct Isolated<'a> {
    copper: &'a Region,
    scene: &'a PlacedBoard,
    islands: Option<Area>,
    /// Copper grown by the distance of toolpaths, by cut width.
    grown: BTreeMap<Length, Region>,
    /// By the width of the wider and of the narrower cut.
    necks: BTreeMap<(Length, Length), Rc<Necks>>,
}

impl<'a> Isolated<'a> {
    pub(super) fn of(copper: &'a Region, scene: &'a PlacedBoard) -> Self {
        Self { copper, scene, islands: None, grown: BTreeMap::new(), necks: BTreeMap::new() }
    }

    fn keeping(&self, width: Length) -> Region {
        self.scene.making().grown(self.copper, narrow::kept(width))
    }

    fn islands(&mut self) -> &Area {
        self.islands.get_or_insert_with(|| Area::of(self.copper))
    }

    /// The necks where a cut of `width` continues and a cut of `wider` had to turn.
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

fn rings(
    context: &mut PlanContext<'_>,
    copper: &Region,
    isolate: &Isolate,
    bit: &Bit,
) -> Result<Vec<Path>, Diagnostic> {
    let depth = context.depth();
    let width = bit.width_at(depth);
    let through = bit.width_at(depth - COPPER_THICKNESS) - NEARER;
    let step = pass_step(width, isolate);
    // A groove narrows downwards: neighbours that overlap at the surface may leave a sliver below.
    let close = isolate.slivers && through > Length::ZERO && step < through + THINNEST;
    let step = if close { step.min(through) } else { step };
    let mut region = context.scene.making().grown(copper, half(width) - NEARER);
    let mut paths = Vec::new();
    for pass in 1..=isolate.passes {
        context.go_on()?;
        let next = (pass < isolate.passes).then_some(step);
        let toolpaths = match isolate.slivers {
            true => context.scene.making().with_slivers(&region, through, next),
            false => {
                let ways = shared::once(region.paths().cloned().collect());
                ways.into_iter().map(|way| refitted(&way, REFIT)).collect()
            }
        };
        paths.extend(turned(toolpaths, isolate.direction));
        if next.is_some() {
            region = context.scene.making().grown(&region, step);
        }
    }
    Ok(paths)
}

fn pass_step(width: Length, isolate: &Isolate) -> Length {
    Length::from_mm(width.mm() * (1.0 - isolate.overlap_percent / 100.0))
}

/// The lines midway between islands, clipped to the board (or to the copper's bounds), where a cut of `width`
/// has room.
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

/// Region outlines, with their inside on the left, in the wanted cutting direction.
pub(super) fn turned(paths: Vec<Path>, direction: CutDirection) -> Vec<Path> {
    match direction {
        CutDirection::Conventional => paths,
        CutDirection::Climb => paths.into_iter().map(|path| path.reversed()).collect(),
    }
}

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
        context.report(warning!("cam.zone_in_the_way", ..));
    }
    let islands = Area::of(isolated.copper);
    let (step, min_distance) = (pass_step(width, isolate), half(width) - LINK_SLACK);
    let beyond = Length::from_mm(step.mm() * f64::from(isolate.passes.saturating_sub(1)));
    let across = Length::from_mm(width.mm() * ACROSS_SHARE);
    let outside = if isolate.slivers { slivers::room(width, None) } else { across };
    let links = Links {
        reach: across.max(step) + LINK_SLACK,
        longest_mm: LONGEST_MM * f64::from(isolate.passes.max(1)),
        spacing: across.max(step) + LINK_SLACK,
        min_distance,
        max_distance: half(width) + beyond + half(outside.max(across)) + LINK_SLACK,
        copper: &islands,
        closed: closed.as_ref(),
    };
    let paths = linked(paths, &links);
    let strips = Links {
        reach: ACROSS_STRIP,
        spacing: STRIP_SPACING,
        max_distance: links.max_distance + half(ACROSS_STRIP),
        ..links
    };
    let paths = linked(paths.into_iter().map(|path| along_and_back(path, BACK_MM)).collect(), &strips);
    let rules = Rules {
        start: context.scene.origin,
        overlap: isolate.loop_overlap,
        both_ways: true,
        link: Some(&links),
        seed: context.means.options.seed,
    };
    let paths = arranged(paths, &rules);
    context.milling(bit, paths, context.depth())
}

/// Depth of `bit` for a gap of width `gap`: a V-bit as deep as fits, other tools as in the operation.
fn fitting_depth(bit: &Bit, gap: Length, depth: Length) -> Length {
    let least = COPPER_THICKNESS + DEPTH_MARGIN;
    match bit.cutter {
        Cutter::Vee { .. } => bit.fitting(gap, least).map_or(least, |(depth, _)| depth),
        Cutter::Drill | Cutter::Mill => depth,
    }
}

/// A local fix, to be planned together with similar ones.
struct Remedied<'c> {
    cure: &'c LocalIsolation,
    bit: Bit,
    depth: Length,
    /// Its necks: those that a cut of this width can enter.
    fits: Length,
}

/// Plans a fix with the operation's first tool or its narrowest.
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

/// Toolpaths of the fixes, one task for each tool and depth. Reports gaps that were not found, and the loss
/// of copper.
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
            context.report(warning!("cam.cure_without_gap", x = x, y = y, ..));
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
            context.report(warning!("cam.cure_in_vain", x = x, y = y, ..));
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

/// Reports once all places where a centred pass removes copper: count, and the worst.
fn tell_taken(context: &mut PlanContext<'_>, taken: Vec<(Length, String, String)>) {
    let count = taken.len();
    if let Some((most, x, y)) = taken.into_iter().rev().max_by_key(|(lost, ..)| *lost) {
        let note = note!("cam.cure_takes", count = count, ..);
        context.report(note.with("lost", format!("{:.3}", most.mm())).with("x", x).with("y", y));
    }
}

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
