//! The machine's own moves, outside any program: homing, going somewhere, parking, jogging, lifting.
//!
//! ```text
//! homing one axis      | <- end sensor's edge
//!      Seek     <======|=====     fast, until the sensor turns on
//!      BackOff         |==>       slowly, off the sensor
//!      Locate          |<-        slowly, until the sensor turns on again: the edge
//!      Index           |->        slowly, until the motor's index pulse: half a turn from the edge, where the axis has one
//!      Offset          |--->      to the resting place, `home_offset` from the edge
//! ```
//!
//! Comes in: a machine, and where things stand. Goes out: a [`Timeline`]; a gated move of it may end early, so what
//! follows is to be taken relative to where it really ended. Does not know why, nor what the sensors say.

use super::timeline::Timeline;
use super::writer::Writer;
use crate::diagnostic::Diagnostic;
use crate::job::{Gate, Input, Otherwise, Stage, Switching};
use crate::machine::{AXES, HomeEnd, Machine, ParkAt, Steps, index_input};
use crate::units::{Length, TICK_HZ};

/// How far an axis backs off a sensor before it looks for the edge slowly.
const BACK_OFF: Length = Length::from_um(2_000);

/// The slow look for the edge goes this much further than the axis backed off.
const LOCATE: Length = Length::from_um(4_000);

/// Slow homing moves go at this share of the homing speed.
const SLOW_SHARE: f64 = 0.1;
/// How much faster the tip goes where it need not touch, as between two places of a survey.
const NEAR_SHARE: f64 = 5.0;
/// And within which way it comes to rest there: less than it stays above what was touched so far, in mm.
const NEAR_MM: f64 = 0.5;

/// A gated move's deadline is its planned time and this much.
const GRACE_US: u64 = 500_000;

/// The first step of `axis` at which its home sensor is on.
pub fn home_edge(machine: &Machine, axis: usize) -> i64 {
    let settings = machine.axis(axis);
    match settings.home {
        HomeEnd::Min => settings.scale.steps(settings.min) - 1,
        HomeEnd::Max => settings.scale.steps(settings.max) + 1,
    }
}

/// Where the motor of `axis` stands when homing finds the edge: a motor with play that comes from above stands lower by it.
pub fn home_count(machine: &Machine, axis: usize) -> i64 {
    let settings = machine.axis(axis);
    let play = if axis < 2 { settings.scale.steps(settings.backlash) } else { 0 };
    home_edge(machine, axis) - if settings.home == HomeEnd::Min { play } else { 0 }
}

/// Where the motor of `axis` stands when homing finds its index pulse: that is taken to lie half a turn from the edge of the end
/// sensor.
pub fn index_count(machine: &Machine, axis: usize) -> i64 {
    let settings = machine.axis(axis);
    let half = settings.scale.steps(settings.index_within) / 2;
    home_edge(machine, axis) + if settings.home == HomeEnd::Min { half } else { -half }
}

/// Machine steps of `axis` where it rests after homing.
pub fn home_place(machine: &Machine, axis: usize) -> i64 {
    let settings = machine.axis(axis);
    let offset = settings.scale.steps(settings.home_offset);
    home_edge(machine, axis) + if settings.home == HomeEnd::Min { offset } else { -offset }
}

/// Machine steps of X and Y where the head is parked: off the end sensors, also where homing leaves it on them.
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

/// Homing of one axis, from wherever it stands: its start counts as 0, its end would be there without sensors.
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
        // A turn takes the play up first.
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
        let gate = input.map(|input| Gate { input, deadline_us: 0, otherwise: Otherwise::Alarm });
        writer.line(stage, to, speed, gate)?;
    }
    let mut timeline = writer.done();
    give_grace(&mut timeline);
    Ok(timeline)
}

/// Homing of the whole machine: first Z up out of the way, then X, then Y, each from where it stands.
pub fn home(machine: &Machine) -> Result<Vec<(usize, Timeline)>, Diagnostic> {
    [2, 0, 1].into_iter().map(|axis| Ok((axis, home_axis(machine, axis)?))).collect()
}

/// The spindle up, or down, to `z_steps` at rapid speed, from rest at `from`.
pub fn retract(machine: &Machine, from: Steps, z_steps: i64) -> Result<Timeline, Diagnostic> {
    let mut to = from;
    for axis in machine.spindle_axes() {
        to[axis] = z_steps;
    }
    one(machine, Stage::Retract, from, to, f64::INFINITY)
}

/// A stroke down from rest at `from` into a hole: the time to settle, rapidly to the feed height, then at the machine's feed to
/// `bottom` over the board's surface, each spindle to its own, which a gate may end early; nothing where all stand there or below.
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
    // No tip goes up.
    let (mut over, mut down) = (from, from);
    for axis in machine.spindle_axes() {
        over[axis] = from[axis].min(bottoms[axis].max(surface[axis] + above));
        down[axis] = from[axis].min(bottoms[axis]);
    }
    if down == from {
        return Ok(writer.done());
    }
    writer.rest(Stage::Dwell, libm::ceil(machine.settle_ms * 1e-3 * TICK_HZ as f64) as u64, Switching::None);
    writer.line(Stage::Approach, over, f64::INFINITY, None)?;
    writer.line(Stage::Drill, down, process.feed_mm_per_s, gate)?;
    Ok(writer.done())
}

/// The axes that move with `axis`: all spindles go together outside programs.
pub fn together(machine: &Machine, axis: usize) -> std::ops::Range<usize> {
    match axis {
        0 | 1 => axis..axis + 1,
        _ if axis < AXES => machine.spindle_axes(),
        _ => 0..0,
    }
}

/// From rest at `from` to rest at `to`: Z up first where it goes up, then X and Y together, then Z down where it goes
/// down.
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

/// X and Y in a straight line. An axis with play that goes down comes up through it at the end, as it does by hand: so the axis
/// is where it is to be, not its motor.
pub fn travel(machine: &Machine, from: Steps, to: Steps) -> Result<[Timeline; 2], Diagnostic> {
    let mut beyond = to;
    for axis in (0..2).filter(|axis| to[*axis] < from[*axis]) {
        beyond[axis] -= machine.axis(axis).scale.steps(machine.axis(axis).backlash);
    }
    Ok([go_to(machine, from, beyond)?, go_to(machine, beyond, to)?])
}

/// The spindle down to `z_steps`, not faster than `speed_mm_per_s`, from rest at `from`.
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

/// Machine steps of Z with the tip all the way up, where it rests after homing.
pub fn top(machine: &Machine) -> i64 {
    machine.z.scale.steps(machine.z.max - machine.z.home_offset)
}

/// One axis by `steps`, not faster than `speed_mm_per_s`. An axis with play that went down comes up through it at the end, so
/// that its motor stands where the table does: a work zero set there is where the bit is.
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

/// From rest at `from` straight towards `to` at most, to where the contact closes; `otherwise` says what it means that it does not.
/// Without that it goes all the way, off what it touches. At the machine's speed for that; where it need not touch, at up to five times that.
pub fn touch(
    machine: &Machine,
    (from, to): (Steps, Steps),
    otherwise: Option<Otherwise>,
) -> Result<Timeline, Diagnostic> {
    let touch_mm_per_s = machine.process.touch_mm_per_s;
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

/// Every gated move may take its planned time and a little more.
fn give_grace(timeline: &mut Timeline) {
    for planned in &mut timeline.moves {
        if let Some(gate) = &mut planned.gate {
            let us = planned.duration_ticks / 10 + GRACE_US;
            gate.deadline_us = u32::try_from(us).unwrap_or(u32::MAX);
        }
    }
}

/// What is left of a planned straight move when its axes stand at `from` instead of at its start, because a sensor
/// ended the move before it: the same stage and the same end, planned anew from rest.
pub fn rejoin(machine: &Machine, stage: Stage, from: Steps, to: Steps) -> Result<Timeline, Diagnostic> {
    one(machine, stage, from, to, f64::INFINITY)
}

fn one(machine: &Machine, stage: Stage, from: Steps, to: Steps, speed: f64) -> Result<Timeline, Diagnostic> {
    let mut writer = Writer::new(machine, from);
    writer.line(stage, to, speed, None)?;
    Ok(writer.done())
}
