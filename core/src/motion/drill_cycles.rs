//! Holes drilled in a chain: the plane and the spindles move together from the bottom of one hole to the bottom of the next.
//!
//! ```text
//! height ^  |‾‾‾‾\                 from the top: the first of a chain
//!        |  |     \__|‾\           from the bottom: all others
//!        |           |/ \__| …     each ends at rest at its bottom, so a chain can be left after any hole
//!        +-----------------------> t
//! ```
//!
//! The strokes of a spindle are worked out once for a bit and then only triggered (P4): down with the machine's law for the
//! way down, fast and then at feed; up with the law for the way up. When the plane is released and the stroke triggered
//! follows the rules in [`coordination`](super::coordination): spindles with a depth or a margin of their own go down each in
//! their own time, all go up at once when the last is down, and the plane leaves when the last one is clear.
//!
//! Comes in: legs of plain holes, where everything stands. Goes out: parts of one move. Does not know legs before and after.

use super::coordination::{SpindleRules, SpindleTimes, stroke};
use super::limits::{Limits, line, mm_per_step, shape};
use super::profile::{self, Stroke, two_speeds};
use super::timeline::{AxisMove, Motion};
use super::writer::{REST_TICKS, lines, start_tick};
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::job::{Command, Leg, Mark, Stage};
use crate::machine::{AXES, DriveKind, Machine, OwnStroke, Steps, StrokeEnd};
use crate::units::{Length, TICK_HZ};

/// A hole that can be part of a chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hole {
    pub(super) to: Point,
    pub(super) bottom: Length,
    pub(super) top: Length,
    feed_um_per_s: u32,
    dwell_us: u32,
    /// How fast the spindles go up at most.
    lift_mm_per_s: f64,
}

impl Hole {
    /// The same, and the spindles go up no faster than that.
    pub(super) fn lifted(self, lift_mm_per_s: f64) -> Self {
        Self { lift_mm_per_s, ..self }
    }
}

/// Axes of spindles that stroke alike.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Alike {
    axes: Vec<usize>,
    own: OwnStroke,
}

/// A chain at the bottom of a hole: what it takes to get up, for each of the spindles that stroke alike.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Low {
    ways: Vec<(Stroke, SpindleTimes)>,
    top_steps: i64,
}

/// The parts of the move to the next hole, without a place in the timeline.
pub(super) struct NextHole {
    pub(super) parts: Vec<AxisMove>,
    pub(super) to: Steps,
    pub(super) duration_ticks: u64,
}

/// The strokes of the bit in use, worked out once.
#[derive(Clone, Debug, Default)]
pub(super) struct DrillCycles {
    known: Vec<Stored>,
}

/// What strokes depend on, besides the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
struct StrokeKey {
    top_steps: i64,
    bottom_steps: i64,
    feed_um_per_s: u32,
    lift_mm_per_s: f64,
    margin_ms: f64,
}

#[derive(Clone, Debug)]
struct Stored {
    key: StrokeKey,
    down: Stroke,
    up: Stroke,
    times: SpindleTimes,
}

/// Whether plane and spindles of `machine` move together, from the bottom of one hole to the bottom of the next.
pub fn overlaps(machine: &Machine) -> bool {
    let counted = machine.stroke_end == StrokeEnd::Counted && machine.drive == DriveKind::Planned;
    machine.overlap.on && counted
}

/// The hole that `leg` is, where chains may be made of it: to a place, down without a sensor, perhaps wait, and up.
pub(super) fn plain_hole(machine: &Machine, leg: &Leg) -> Option<Hole> {
    let together = machine.overlap.on && machine.drive == DriveKind::Planned && !machine.foot.on;
    if !together || !matches!(leg.mark, Mark::Hole(_)) {
        return None;
    }
    let (to, plunge, dwell_us, top) = match *leg.commands.as_slice() {
        [Command::Rapid { to }, plunge, Command::Retract { to: top }] => (to, plunge, 0, top),
        [Command::Rapid { to }, plunge, Command::Dwell { us }, Command::Retract { to: top }] => {
            (to, plunge, us, top)
        }
        _ => return None,
    };
    let Command::Plunge { to: bottom, feed_um_per_s, gate: None } = plunge else { return None };
    let clear = Length::from_mm(machine.overlap.clear_mm);
    let plain = feed_um_per_s > 0 && bottom < Length::ZERO && top > clear;
    let lift_mm_per_s = f64::INFINITY;
    plain.then_some(Hole { to, bottom, top, feed_um_per_s, dwell_us, lift_mm_per_s })
}

/// The axes `spindles` as those that stroke alike; where there are none, as one group without any.
pub(super) fn alike(machine: &Machine, spindles: &[usize]) -> Vec<Alike> {
    let mut groups: Vec<Alike> = Vec::new();
    for axis in spindles {
        let own = OwnStroke { longer: Length::ZERO, ..machine.own(*axis) };
        match groups.iter_mut().find(|group| group.own == own) {
            Some(group) => group.axes.push(*axis),
            None => groups.push(Alike { axes: vec![*axis], own }),
        }
    }
    if groups.is_empty() {
        groups.push(Alike { axes: Vec::new(), own: OwnStroke::default() });
    }
    groups
}

impl Alike {
    /// `steps` with these spindles at `height`.
    fn at(&self, steps: Steps, height: i64) -> Steps {
        let mut steps = steps;
        for axis in &self.axes {
            steps[*axis] = height;
        }
        steps
    }
}

impl DrillCycles {
    /// The move to `hole` from rest at `at`, where the motors of X and Y go to `plane`: from the bottom of a hole when the
    /// chain is `low`, else from the top.
    pub(super) fn next_hole(
        &mut self,
        machine: &Machine,
        groups: &[Alike],
        (at, plane, turned): (Steps, Steps, [bool; AXES]),
        hole: Hole,
        low: Option<Low>,
    ) -> Result<(NextHole, Low), Diagnostic> {
        let latency_s = machine.overlap.latency_ms * 1e-3;
        let mut parts = Vec::new();
        let (mut now, mut release_s, mut tops_s) = (at, 0.0, vec![None; groups.len()]);
        if let Some(low) = low {
            let mut clear_s = 0.0_f64;
            for ((group, (up, times)), top_s) in groups.iter().zip(low.ways).zip(&mut tops_s) {
                let above = group.at(now, low.top_steps);
                let begin = start_tick(machine, 0.0, &up, &now, &above);
                let begin_s = begin as f64 / TICK_HZ as f64;
                clear_s = clear_s.max(begin_s + times.leave_s);
                *top_s = Some(begin_s + times.up_s);
                parts.push(part(Stage::Retract, begin, now, above, up));
                now = above;
            }
            release_s = clear_s + latency_s;
        }
        let mut there = now;
        (there[0], there[1]) = (plane[0], plane[1]);
        let mut arrive_s = release_s;
        let release_tick = libm::ceil(release_s * TICK_HZ as f64) as u64;
        for line in lines(machine, Stage::Travel, now, there, f64::INFINITY, turned)? {
            let line = AxisMove { start_tick: line.start_tick + release_tick, ..line };
            arrive_s = line.end_s();
            parts.push(line);
        }
        let settle_s = if there == now { 0.0 } else { machine.settle_ms * 1e-3 };
        let rules = SpindleRules { settle_s, latency_s };
        let (mut to, mut downs, mut ways) = (there, Vec::new(), Vec::new());
        for (group, top_s) in groups.iter().zip(tops_s) {
            let stored = self.stored(machine, group, now, hole)?;
            let stroked = stroke(&stored.times, rules, release_s, arrive_s + settle_s, top_s);
            let below = group.at(to, stored.key.bottom_steps);
            let begin = start_tick(machine, stroked.start_s, &stored.down, &to, &below);
            downs.push(part(Stage::Drill, begin, to, below, stored.down));
            ways.push((stored.up, stored.times));
            to = below;
        }
        downs.sort_by_key(|down| down.start_tick);
        let end_s = downs.iter().map(AxisMove::end_s).fold(0.0, f64::max);
        parts.append(&mut downs);
        let end_tick = libm::ceil(end_s * TICK_HZ as f64) as u64;
        let dwell_ticks = u64::from(hole.dwell_us) * (TICK_HZ / 1_000_000);
        let low = Low { ways, top_steps: machine.z.scale.steps(hole.top) };
        Ok((NextHole { parts, to, duration_ticks: end_tick + dwell_ticks + REST_TICKS }, low))
    }

    /// The strokes of `group` from the top of `hole` to its own bottom of it and back.
    fn stored(
        &mut self,
        machine: &Machine,
        group: &Alike,
        top: Steps,
        hole: Hole,
    ) -> Result<Stored, Diagnostic> {
        let scale = machine.z.scale;
        let key = StrokeKey {
            top_steps: scale.steps(hole.top),
            bottom_steps: scale.steps(group.own.height(hole.bottom, hole.bottom)),
            feed_um_per_s: hole.feed_um_per_s,
            lift_mm_per_s: hole.lift_mm_per_s,
            margin_ms: group.own.margin_ms,
        };
        if let Some(known) = self.known.iter().find(|known| known.key == key) {
            return Ok(known.clone());
        }
        let (high, low) = (group.at(top, key.top_steps), group.at(top, key.bottom_steps));
        let mm = mm_per_step(machine)[2];
        let (height_mm, depth_mm) = (key.top_steps as f64 * mm, -key.bottom_steps as f64 * mm);
        let down = down(machine, height_mm, depth_mm, f64::from(hole.feed_um_per_s) * 1e-3)?;
        let up = Stroke::One(line(machine, &low, &high, hole.lift_mm_per_s)?);
        let times = times(machine, &group.own, &down, &up, height_mm);
        if self.known.len() >= AXES {
            self.known.clear();
        }
        let stored = Stored { key, down, up, times };
        self.known.push(stored.clone());
        Ok(stored)
    }
}

/// What the strokes of a spindle of `machine` take that is `own`. The margin is at least so much that the plane rests before the
/// tip is lower than clear, not only before it touches (C2.3, invariants I1 and I2).
fn times(machine: &Machine, own: &OwnStroke, down: &Stroke, up: &Stroke, height_mm: f64) -> SpindleTimes {
    let overlap = &machine.overlap;
    let times = SpindleTimes::of(down, up, height_mm, overlap.clear_mm);
    let low_s = times.contact_s - down.time_at(height_mm - overlap.clear_mm) - machine.settle_ms * 1e-3;
    SpindleTimes {
        dwell_top_s: overlap.dwell_top_ms * 1e-3,
        margin_s: ((overlap.margin_ms + own.margin_ms) * 1e-3).max(low_s),
        ..times
    }
}

/// What the machine's own stroke of the spindle on `axis` takes, from its safe height to the bottom of a hole through its board
/// and back, and the two strokes themselves: down and up.
pub fn own(machine: &Machine, axis: usize) -> Result<(SpindleTimes, Stroke, Stroke), Diagnostic> {
    let process = &machine.process;
    in_hole(machine, axis, -(process.board_thickness + process.breakthrough), process.feed_mm_per_s)
}

/// The same in a hole that all spindles drill to `bottom` over the board's surface, at this feed.
pub fn in_hole(
    machine: &Machine,
    axis: usize,
    bottom: Length,
    feed_mm_per_s: f64,
) -> Result<(SpindleTimes, Stroke, Stroke), Diagnostic> {
    let process = &machine.process;
    let (scale, spindle) = (machine.z.scale, machine.own(axis));
    let (top, bottom) = (scale.steps(process.safe_height), scale.steps(spindle.height(bottom, bottom)));
    let mm = mm_per_step(machine)[2];
    let (height_mm, depth_mm) = (top as f64 * mm, -bottom as f64 * mm);
    let (mut low, mut high) = (Steps::default(), Steps::default());
    (low[2], high[2]) = (bottom, top);
    let down = down(machine, height_mm, depth_mm, feed_mm_per_s)?;
    let up = Stroke::One(line(machine, &low, &high, f64::INFINITY)?);
    let times = SpindleTimes {
        dwell_bottom_s: process.dwell_bottom_ms * 1e-3,
        ..times(machine, &spindle, &down, &up, height_mm)
    };
    Ok((times, down, up))
}

/// What the machine's own strokes of all its spindles take.
pub fn own_times(machine: &Machine) -> Result<Vec<SpindleTimes>, Diagnostic> {
    machine.spindle_axes().map(|axis| Ok(own(machine, axis)?.0)).collect()
}

/// The abort horizon of the machine's own stroke `down`: until how long after its start, in s, it can still be stopped with the
/// tip clear of the board (C2.3), by the least that Z can do either way.
pub fn last_stop_s(machine: &Machine, down: &Stroke) -> Result<f64, Diagnostic> {
    let (own, limits) = (Limits::of_axis(machine, &machine.z), Limits::of_down(machine));
    let limits = Limits {
        acceleration_mm_per_s2: limits.acceleration_mm_per_s2.min(own.acceleration_mm_per_s2),
        jerk_mm_per_s3: limits.jerk_mm_per_s3.min(own.jerk_mm_per_s3),
        ..limits
    };
    let process = &machine.process;
    let height_mm = machine.z.scale.steps(process.safe_height) as f64 * mm_per_step(machine)[2];
    profile::point_of_no_return_s(down, height_mm, machine.overlap.clear_mm.min(height_mm), limits)
}

/// The stroke down: fast to the feed height, then at feed; where the way is too short to change speeds, all of it at feed.
pub fn down(
    machine: &Machine,
    height_mm: f64,
    depth_mm: f64,
    feed_mm_per_s: f64,
) -> Result<Stroke, Diagnostic> {
    let limits = Limits::of_down(machine);
    let length_mm = height_mm + depth_mm;
    let law = shape(machine, machine.motion.down, length_mm, limits)?;
    if feed_mm_per_s < limits.speed_mm_per_s {
        let slow_mm = machine.process.feed_height.mm().min(height_mm);
        if let Ok(stroke) = two_speeds(law, height_mm - slow_mm, depth_mm + slow_mm, feed_mm_per_s, limits) {
            return Ok(stroke);
        }
    }
    Ok(Stroke::One(profile::plan(law, length_mm, limits.slowed(feed_mm_per_s))?))
}

fn part(stage: Stage, start_tick: u64, from: Steps, to: Steps, stroke: Stroke) -> AxisMove {
    AxisMove { stage, start_tick, from, to, motion: Motion::Line(stroke) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::virtual_drill;

    #[test]
    fn margin_and_settling_act_where_they_are_longer_than_the_way_from_clear() {
        // 0.3 mm at 12 mm/s.
        let rows = [((5.0, 10.0), 25.0), ((0.0, 0.0), 25.0), ((20.0, 10.0), 30.0), ((5.0, 40.0), 45.0)];
        for ((margin_ms, settle_ms), wanted_ms) in rows {
            let mut machine = virtual_drill();
            (machine.overlap.margin_ms, machine.settle_ms) = (margin_ms, settle_ms);
            let waits_ms = settle_ms + 1e3 * own(&machine, 2).expect("a stroke").0.margin_s;
            assert!((waits_ms - wanted_ms).abs() < 0.1, "{margin_ms} {settle_ms}: {waits_ms}");
        }
    }
}
