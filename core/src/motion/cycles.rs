//! Basic moves of the machine outside programs: homing, go to, park, jog, lift.
//!
//! ```text
//! homing one axis      | <- edge of the limit switch
//!      Seek     <======|=====     fast, until the switch turns on
//!      BackOff         |==>       slowly, off the switch
//!      Locate          |<-        slowly, until the switch turns on again: the edge
//!      Index           |->        slowly, to the motor's index pulse half a turn from the edge, if used
//!      Offset          |--->      to the rest position, `home_offset` from the edge
//! ```

use super::timeline::Timeline;
use super::writer::Writer;
use crate::diagnostic::Diagnostic;
use crate::job::{Gate, Input, Otherwise, Stage, Switching};
use crate::machine::{AXES, HomeEnd, Machine, ParkAt, Steps, index_input};
use crate::units::{Length, TICK_HZ};

/// Distance by which an axis backs off its switch before the slow search for the edge.
const BACK_OFF: Length = Length::from_um(2_000);

/// Additional distance of the slow search, beyond the back-off.
const LOCATE: Length = Length::from_um(4_000);

const SLOW_SHARE: f64 = 0.1;
/// Speed of probing moves that normally don't touch, as between two survey points, relative to the probing
/// speed.
const NEAR_SHARE: f64 = 5.0;
/// Greatest stopping distance of those moves, in mm: less than their clearance over the points found.
const NEAR_MM: f64 = 0.5;

/// Deadline of a gated move: its planned time plus this.
const GRACE_US: u64 = 500_000;

/// The first step of `axis` at which its home switch is on.
pub fn home_edge(machine: &Machine, axis: usize) -> i64 {
    let settings = machine.axis(axis);
    match settings.home {
        // The switch is one step beyond the travel.
        HomeEnd::Min => settings.scale.steps(settings.min) - 1,
        HomeEnd::Max => settings.scale.steps(settings.max) + 1,
    }
}

/// Motor position of `axis` when homing finds the edge. With backlash and from above, the motor is lower by
/// the backlash.
pub fn home_count(machine: &Machine, axis: usize) -> i64 {
    let settings = machine.axis(axis);
    let play = if axis < 2 { settings.scale.steps(settings.backlash) } else { 0 };
    home_edge(machine, axis) - if settings.home == HomeEnd::Min { play } else { 0 }
}

/// Motor position of `axis` when homing finds its index pulse, assumed to be half a turn from the edge of the
/// limit switch.
pub fn index_count(machine: &Machine, axis: usize) -> i64 {
    let settings = machine.axis(axis);
    let half = settings.scale.steps(settings.index_within) / 2;
    home_edge(machine, axis) + if settings.home == HomeEnd::Min { half } else { -half }
}

/// Rest position of `axis` after homing, in machine steps.
pub fn home_place(machine: &Machine, axis: usize) -> i64 {
    let settings = machine.axis(axis);
    let offset = settings.scale.steps(settings.home_offset);
    home_edge(machine, axis) + if settings.home == HomeEnd::Min { offset } else { -offset }
}

/// Park position of X and Y in machine steps: off the limit switches, even if homing rests on them.
pub fn park_place(machine: &Machine) -> [i64; 2] {
    [0, 1].map(|axis: usize| {
        let settings = machine.axis(axis);
        let place = match machine.park.at {
            ParkAt::Home => home_place(machine, axis),
            ParkAt::Place => settings.scale.steps(machine.park.place[axis]),
        };
        let (low, high) = (settings.scale.steps(settings.min), settings.scale.steps(settings.max));
        place.clamp(low, high.max(low))
    })
}

/// Homing of one axis from any position: the start counts as 0, the end is where it would be without sensors.
pub fn home_axis(machine: &Machine, axis: usize) -> Result<Timeline, Diagnostic> {
    let settings = machine.axis(axis);
    let towards = match settings.home {
        HomeEnd::Min => -1,
        HomeEnd::Max => 1,
    };
    let (fast, slow) = (settings.home_speed_mm_per_s, SLOW_SHARE * settings.home_speed_mm_per_s);
    let (end, pulse) = (machine.home_input(axis), index_input(axis));
    let rows = [
        (Stage::Seek, settings.home_search * towards, fast, Some(end)),
        (Stage::BackOff, BACK_OFF * -towards, slow, None),
        (Stage::Locate, LOCATE * towards, slow, Some(end)),
        (Stage::Index, settings.index_within * -towards, slow, Some(pulse)),
        (Stage::Offset, settings.home_offset * -towards, fast, None),
    ];
    let mut writer = Writer::new(machine, Steps::default());
    for (stage, way, speed, input) in rows.into_iter().filter(|row| settings.index || row.0 != Stage::Index) {
        let mut to = writer.at();
        // A reversal must first remove the backlash.
        let turns = match stage {
            Stage::BackOff | Stage::Index => axis < 2,
            Stage::Offset => axis < 2 && !settings.index,
            _ => false,
        };
        let play = if turns { settings.scale.steps(settings.backlash) } else { 0 };
        for axis in together(machine, axis) {
            let steps = settings.scale.steps(way);
            to[axis] += steps + steps.signum() * play;
        }
        // `give_grace` sets the deadline once the duration is known.
        let gate = input.map(|input| Gate { input, deadline_us: 0, otherwise: Otherwise::Alarm });
        writer.line(stage, to, speed, gate)?;
    }
    let mut timeline = writer.done();
    give_grace(&mut timeline);
    Ok(timeline)
}

/// Homing of the whole machine: first Z, to clear the board, then X, then Y, each from its current position.
pub fn home(machine: &Machine) -> Result<Vec<(usize, Timeline)>, Diagnostic> {
    // Z first, so that no tool is dragged through a board.
    [2, 0, 1].into_iter().map(|axis| Ok((axis, home_axis(machine, axis)?))).collect()
}

/// Moves the spindles up or down to `z_steps` at rapid speed, from rest at `from`.
pub fn retract(machine: &Machine, from: Steps, z_steps: i64) -> Result<Timeline, Diagnostic> {
    let mut to = from;
    for axis in machine.spindle_axes() {
        to[axis] = z_steps;
    }
    one(machine, Stage::Retract, from, to, f64::INFINITY)
}

/// Down to `to` at the machine's feed, after a vertical lift from there.
pub fn back_down(machine: &Machine, from: Steps, to: Steps) -> Result<Timeline, Diagnostic> {
    one(machine, Stage::Approach, from, to, machine.process.feed_mm_per_s)
}

/// A plunge from rest at `from` into a hole: settle, rapid to the feed height, then feed to `bottom` over the
/// board's surface. Each spindle ends at its own bottom. A gate may end the feed early. Empty if all spindles
/// are there already.
pub fn stroke(
    machine: &Machine,
    from: Steps,
    bottom: Length,
    gate: Option<Gate>,
) -> Result<Timeline, Diagnostic> {
    let process = &machine.process;
    let above = machine.z.scale.steps(process.feed_height.min(process.safe_height));
    let (surface, bottoms) = (machine.on_surface(), machine.bottoms(bottom));
    let mut writer = Writer::new(machine, from);
    // A plunge raises no tip.
    let (mut over, mut down) = (from, from);
    for axis in machine.spindle_axes() {
        over[axis] = from[axis].min(bottoms[axis].max(surface[axis] + above));
        down[axis] = from[axis].min(bottoms[axis]);
    }
    if down == from {
        return Ok(writer.done());
    }
    // XY must settle before the tool goes down.
    writer.rest(Stage::Dwell, libm::ceil(machine.settle_ms * 1e-3 * TICK_HZ as f64) as u64, Switching::None);
    writer.line(Stage::Approach, over, f64::INFINITY, None)?;
    writer.line(Stage::Drill, down, process.feed_mm_per_s, gate)?;
    Ok(writer.done())
}

/// The axes that move with `axis`: outside programs, all spindles move together.
pub fn together(machine: &Machine, axis: usize) -> std::ops::Range<usize> {
    match axis {
        0 | 1 => axis..axis + 1,
        _ if axis < AXES => machine.spindle_axes(),
        _ => 0..0,
    }
}

/// From rest at `from` to rest at `to`: first Z if it rises, then X and Y together, then Z if it descends.
pub fn go_to(machine: &Machine, from: Steps, to: Steps) -> Result<Timeline, Diagnostic> {
    let mut writer = Writer::new(machine, from);
    let mut above = from;
    for axis in machine.spindle_axes() {
        above[axis] = from[axis].max(to[axis]);
    }
    writer.line(Stage::Retract, above, f64::INFINITY, None)?;
    let mut beside = to;
    for axis in machine.spindle_axes() {
        beside[axis] = above[axis];
    }
    writer.line(Stage::Travel, beside, f64::INFINITY, None)?;
    writer.line(Stage::Approach, to, f64::INFINITY, None)?;
    Ok(writer.done())
}

/// X and Y in a straight line. After a downward move, an axis with backlash overshoots and returns upwards.
/// So the axis, not only its motor, is at its target.
pub fn travel(machine: &Machine, from: Steps, to: Steps) -> Result<[Timeline; 2], Diagnostic> {
    let mut beyond = to;
    for axis in (0..2).filter(|axis| to[*axis] < from[*axis]) {
        beyond[axis] -= machine.axis(axis).scale.steps(machine.axis(axis).backlash);
    }
    Ok([go_to(machine, from, beyond)?, go_to(machine, beyond, to)?])
}

/// Moves the spindles down to `z_steps`, at most at `speed_mm_per_s`, from rest at `from`.
pub fn lower(
    machine: &Machine,
    from: Steps,
    z_steps: i64,
    speed_mm_per_s: f64,
) -> Result<Timeline, Diagnostic> {
    let mut to = from;
    for axis in machine.spindle_axes() {
        to[axis] = z_steps;
    }
    one(machine, Stage::Approach, from, to, speed_mm_per_s)
}

/// Machine steps of Z at the top: its rest position after homing.
pub fn top(machine: &Machine) -> i64 {
    machine.z.scale.steps(machine.z.max - machine.z.home_offset)
}

/// Moves one axis by `steps`, at most at `speed_mm_per_s`. After a downward move, an axis with backlash
/// overshoots and returns upwards. So motor and table agree, and a work zero set there is exact.
pub fn jog(
    machine: &Machine,
    from: Steps,
    axis: usize,
    steps: i64,
    speed_mm_per_s: f64,
) -> Result<Timeline, Diagnostic> {
    let mut writer = Writer::new(machine, from);
    let mut to = from;
    for axis in together(machine, axis) {
        to[axis] = to[axis].saturating_add(steps);
    }
    if axis < 2 && steps < 0 {
        let mut beyond = to;
        beyond[axis] -= machine.axis(axis).scale.steps(machine.axis(axis).backlash);
        writer.line(Stage::Jog, beyond, speed_mm_per_s, None)?;
    }
    writer.line(Stage::Jog, to, speed_mm_per_s, None)?;
    Ok(writer.done())
}

/// From rest at `from` straight towards `to`, until the contact closes; `otherwise` is the reaction if it
/// doesn't close. Without `otherwise`, goes all the way to `to`, away from the surface. The speed is the
/// machine's probing speed, or up to five times as fast if contact is not expected.
pub fn touch(
    machine: &Machine,
    (from, to): (Steps, Steps),
    otherwise: Option<Otherwise>,
) -> Result<Timeline, Diagnostic> {
    let touch_mm_per_s = machine.process.touch_mm_per_s;
    // Where no contact is expected, the tip may move faster, if it can still stop within its clearance.
    let near_mm_per_s = libm::sqrt(2.0 * NEAR_MM * machine.braking_mm_per_s2(2));
    let speed_mm_per_s = match otherwise {
        Some(Otherwise::GoOn) => near_mm_per_s.min(NEAR_SHARE * touch_mm_per_s).max(touch_mm_per_s),
        _ => touch_mm_per_s,
    };
    let gate = otherwise.map(|otherwise| Gate { input: Input::Contact, deadline_us: 0, otherwise });
    let mut writer = Writer::new(machine, from);
    writer.line(Stage::Touch, to, speed_mm_per_s, gate)?;
    let mut timeline = writer.done();
    give_grace(&mut timeline);
    Ok(timeline)
}

/// Gives every gated move its planned time and [`GRACE_US`].
fn give_grace(timeline: &mut Timeline) {
    for planned in &mut timeline.moves {
        if let Some(gate) = &mut planned.gate {
            let us = planned.duration_ticks / 10 + GRACE_US;
            gate.deadline_us = u32::try_from(us).unwrap_or(u32::MAX);
        }
    }
}

/// The rest of a straight move from `from`, where a sensor ended the previous move. Same stage and end,
/// planned again from rest.
pub fn rejoin(machine: &Machine, stage: Stage, from: Steps, to: Steps) -> Result<Timeline, Diagnostic> {
    one(machine, stage, from, to, f64::INFINITY)
}

fn one(machine: &Machine, stage: Stage, from: Steps, to: Steps, speed: f64) -> Result<Timeline, Diagnostic> {
    let mut writer = Writer::new(machine, from);
    writer.line(stage, to, speed, None)?;
    Ok(writer.done())
}
