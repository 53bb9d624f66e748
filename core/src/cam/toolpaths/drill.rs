//! Drills round holes with the available drills.
//!
//! ```text
//!   holes of the board ─ nearest drill ─┬─ 0.8 mm   ● ● ● ●    through including the point, or the
//!   or pin holes          within         └─ 1.0 mm   ● ●      operation's depth
//!                        tolerance
//! ```

use super::super::places::{Places, Twice};
use super::super::tour::Effort;
use super::super::work::{Drill, Holes};
use super::super::{HoleOrder, default_iterations, loaded_first, order, rack};
use super::checks::outside_outline::Beside;
use super::{BitTask, DrillCycle, PlanContext, PlannedOperation, WHOLE};
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::units::Length;
use crate::{code, error, note};
use std::collections::BTreeMap;

pub(super) fn plan(context: &mut PlanContext<'_>, drill: &Drill) -> Result<PlannedOperation, Diagnostic> {
    let mut part = PlannedOperation::default();
    let mut by_bit: BTreeMap<Length, Vec<(u32, Point)>> = BTreeMap::new();
    let mut missing = 0_usize;
    let drills = context.machine.drills();
    let tolerance = drill.tolerance_on(context.machine);
    for (index, hole) in (0..).zip(&context.scene.board.holes) {
        if context.scene.pins.contains(&index) != (drill.holes == Holes::Alignment) {
            continue;
        }
        let Some(size) = hole.diameter else { continue };
        match rack::nearest(&drills, size, tolerance) {
            Some(bit) => by_bit.entry(bit).or_default().push((index, hole.at)),
            None if drill.holes == Holes::Alignment => missing += 1,
            None => {}
        }
    }
    if missing > 0 {
        let size = rack::size_text(context.work.setup.alignment.diameter);
        context.report(error!("cam.no_bit_for_pins", size = size, ..));
    }
    let mut kept_out = 0_usize;
    once(context, &mut part, &mut by_bit);
    for (bit, holes) in &mut by_bit {
        let Some(zone) = context.scene.closed_to(*bit) else { break };
        let (out, free): (Vec<_>, Vec<_>) = holes.iter().partition(|(_, at)| zone.contains(*at));
        part.left_holes.extend(out.iter().map(|(index, _)| *index));
        kept_out += out.len();
        *holes = free;
    }
    if drill.holes == Holes::Board {
        let mut beside = Beside::default();
        let holes = by_bit.iter().flat_map(|(bit, holes)| holes.iter().map(move |(_, at)| (*bit, *at)));
        holes.for_each(|(bit, at)| beside.look(context.scene, &[at], bit));
        beside.error().into_iter().for_each(|error| context.report(error));
    }
    if kept_out > 0 {
        context.report(error!("cam.holes_in_zone", count = kept_out, ..));
    }
    by_bit.retain(|_, holes| !holes.is_empty());
    let total: usize = by_bit.values().map(Vec::len).sum();
    if total == 0 {
        context.report(note!("cam.no_holes", ..));
    }
    let kicks = match drill.order {
        HoleOrder::File => 0,
        _ => context.means.options.iterations.unwrap_or_else(|| default_iterations(total)),
    };
    let mut holes_done = 0;
    for (diameter, holes) in in_order(context, drill, by_bit) {
        context.go_on()?;
        part.holes.extend(holes.iter().map(|(index, _)| *index));
        holes_done += holes.len() as u64;
        // Each tool's share grows with its holes, and the shares add up to the whole.
        let until = share(kicks, holes_done, total as u64);
        part.tasks.push(task(context, drill, diameter, &holes, (part.iterations, until, kicks))?);
        part.iterations = until;
        context.done = share(WHOLE, holes_done, total as u64);
    }
    part.holes.sort_unstable();
    Ok(part)
}

fn share(whole: u64, part: u64, all: u64) -> u64 {
    (u128::from(whole) * u128::from(part) / u128::from(all.max(1))) as u64
}

/// Removes repeated holes of one tool at one position, except the first in the file; they count as made.
fn once(
    context: &mut PlanContext<'_>,
    part: &mut PlannedOperation,
    by_bit: &mut BTreeMap<Length, Vec<(u32, Point)>>,
) {
    let (mut places, mut twice) = (Places::default(), Twice::default());
    for (bit, holes) in by_bit {
        holes.retain(|(index, at)| {
            let again = places.again(*bit, *at, Length::ZERO);
            if again {
                part.holes.push(*index);
                twice.add(*at);
            }
            !again
        });
    }
    twice.note(code!("cam.holes_twice")).into_iter().for_each(|note| context.report(note));
}

/// The tools in order of use: ascending, or the loaded one first if wanted.
fn in_order<T>(
    context: &mut PlanContext<'_>,
    drill: &Drill,
    by_bit: BTreeMap<Length, T>,
) -> Vec<(Length, T)> {
    let sizes: Vec<Length> = by_bit.keys().copied().collect();
    let mut bits: Vec<_> = by_bit.into_iter().collect();
    if drill.holes == Holes::Alignment {
        return bits;
    }
    match loaded_first(&sizes, context.means.options, drill.tolerance_on(context.machine)) {
        Ok(first) => bits[..=first].rotate_right(1),
        Err(why) => why.into_iter().for_each(|diagnostic| context.report(diagnostic)),
    }
    bits
}

/// Holes of one tool, in order. `kicks` are those already made, those made afterwards and those of all tools.
fn task(
    context: &mut PlanContext<'_>,
    drill: &Drill,
    diameter: Length,
    holes: &[(u32, Point)],
    (made, until, all): (u64, u64, u64),
) -> Result<BitTask, Diagnostic> {
    let effort = Effort { kicks: until - made, seed: context.means.options.seed };
    let (rapid_time, origin, tick, before) =
        (context.means.rapid_time, context.scene.origin, &mut *context.tick, context.done);
    let mut tick = |done: u64| tick(before.max(share(WHOLE, made + done, all)));
    let order = order::arrange(holes, origin, drill.order, rapid_time, effort, &mut tick);
    let order = order.ok_or_else(|| error!("plan.cancelled"))?;
    let places: BTreeMap<u32, Point> = holes.iter().copied().collect();
    let stroke =
        |hole: u32| DrillCycle { at: places.get(&hole).copied().unwrap_or(origin), hole: Some(hole) };
    let bit = rack::drill(diameter);
    let drill_cycles = order.into_iter().map(stroke).collect();
    Ok(BitTask {
        drill_cycles,
        depth: depth(context, drill, diameter),
        peck: drill.peck,
        ..BitTask::with(&bit)
    })
}

/// Depth of a drill: the operation's, else through the board; for pins into the bed.
fn depth(context: &PlanContext<'_>, drill: &Drill, diameter: Length) -> Length {
    if context.operation.depth > Length::ZERO {
        return context.operation.depth;
    }
    let own = drill.points.iter().find(|(drill, _)| *drill == diameter);
    let degrees = own.map_or(drill.point_deg, |(_, degrees)| *degrees);
    let below = match drill.holes {
        Holes::Board => context.machine.process.breakthrough,
        Holes::Alignment => context.work.setup.alignment.depth,
    };
    rack::through(&context.machine.process, below, diameter, degrees)
}
