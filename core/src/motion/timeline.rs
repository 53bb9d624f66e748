//! Timelines: a program as moves in time.
//!
//! ```text
//! separate          Travel      Dwell    Approach   Drill      Dwell   Retract
//! speed            /‾‾‾‾‾‾\             /‾‾\      _______             /‾‾‾‾\
//!              ___/        \___________/    \____/       \___________/      \__
//!
//! together     |<---------------- one move: NextHole ---------------------->|
//! Z up         /‾‾‾‾‾‾‾‾\__                            (from the bottom of the previous hole)
//! XY               ____/‾‾‾‾‾‾‾‾\____
//! Z down                       ____/‾‾‾\_______        (to the bottom of this one)
//! ```
//!
//! A [`Move`] starts and ends at rest. Inside it, each [`AxisMove`] moves some axes on its own schedule.

use super::automaton::SteadyStretch;
use super::path::PlannedPath;
use super::profile::Stroke;
use crate::job::{Gate, Mark, Stage, Switching};
use crate::machine::{AXES, Steps};
use crate::units::TICK_HZ;
use serde::{Deserialize, Serialize};

/// A move from rest to rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Move {
    pub leg: u32,
    /// Index of the command in the leg; if several form one move, of the first.
    pub command: u32,
    /// Purpose of the leg.
    pub mark: Mark,
    pub stage: Stage,
    pub from: Steps,
    pub to: Steps,
    /// First tick, from the start of the timeline.
    pub start_tick: u64,
    pub duration_ticks: u64,
    /// Parts in order of start. Parts of one axis don't overlap.
    pub parts: Vec<AxisMove>,
    /// Switching at the start.
    pub effect: Switching,
    /// Sensor that may end the move early.
    pub gate: Option<Gate>,
}

/// A straight line, or path, of some axes from rest to rest, within a move.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisMove {
    pub stage: Stage,
    /// Start in ticks from the start of the move.
    pub start_tick: u64,
    /// Position of the axes at the start. Only axes with a different end position belong to the part.
    pub from: Steps,
    pub to: Steps,
    pub motion: Motion,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Motion {
    Line(Stroke),
    TableSteps(TableSteps),
    /// X, Y and spindles along lines, arcs and helices, without a stop.
    Path(Box<MotorPath>),
}

/// A path of the motors, the step sizes of X, Y and Z, and the spindles that follow its height.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotorPath {
    /// In mm from the work zero.
    pub path: PlannedPath,
    pub mm_per_step: [f64; 3],
    /// Bit set of the spindles: bit 0 is Z1.
    pub spindles: u8,
}

impl MotorPath {
    /// Index of the path coordinate that `axis` follows, if any.
    pub fn coordinate(&self, axis: usize) -> Option<usize> {
        match axis {
            0 | 1 => Some(axis),
            _ => (axis < AXES && self.spindles >> (axis - 2) & 1 == 1).then_some(2),
        }
    }
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TableSteps {
    pub interrupt_ticks: u64,
    /// Groups of steps with equal intervals, in interrupts, in order.
    pub stretches: Vec<SteadyStretch>,
}

impl TableSteps {
    pub fn duration_ticks(&self) -> u64 {
        let interrupts = self.stretches.iter().map(|some| u64::from(some.interval) * some.count);
        interrupts.sum::<u64>() * self.interrupt_ticks
    }

    /// Number of steps made until `tick`.
    pub fn count_at(&self, tick: u64) -> u64 {
        let (mut done, mut now) = (0, 0);
        for some in &self.stretches {
            let interval = (u64::from(some.interval) * self.interrupt_ticks).max(1);
            let fit = (tick.saturating_sub(now) / interval).min(some.count);
            done += fit;
            if fit < some.count {
                break;
            }
            now += interval * some.count;
        }
        done
    }

    /// Tick of step `index`, from 0; clamped to the last step.
    pub fn tick_of(&self, index: u64) -> u64 {
        let (mut left, mut now) = (index + 1, 0);
        for some in &self.stretches {
            let here = left.min(some.count);
            now += u64::from(some.interval) * self.interrupt_ticks * here;
            left -= here;
        }
        now
    }

    fn count(&self) -> u64 {
        self.stretches.iter().map(|some| some.count).sum()
    }
}

impl AxisMove {
    pub fn duration_s(&self) -> f64 {
        match &self.motion {
            Motion::Line(stroke) => stroke.duration_s(),
            Motion::TableSteps(steps) => steps.duration_ticks() as f64 / TICK_HZ as f64,
            Motion::Path(route) => route.path.duration_s(),
        }
    }

    /// Length in mm; for table steps, of the one axis.
    pub fn length_mm(&self, mm_per_step: &[f64; AXES]) -> f64 {
        let travel = |axis: usize| (self.to[axis] - self.from[axis]).abs() as f64 * mm_per_step[axis];
        match &self.motion {
            Motion::Line(stroke) => stroke.length_mm(),
            Motion::Path(route) => route.path.length_mm(),
            Motion::TableSteps(_) => (0..AXES).map(travel).fold(0.0, f64::max),
        }
    }

    /// Start in seconds of the move.
    pub fn start_s(&self) -> f64 {
        self.start_tick as f64 / TICK_HZ as f64
    }

    pub fn end_s(&self) -> f64 {
        self.start_s() + self.duration_s()
    }

    pub fn moves(&self, axis: usize) -> bool {
        match &self.motion {
            // A closed path ends at its start, so compare the axes instead of the ends.
            Motion::Path(route) => route.coordinate(axis).is_some(),
            _ => self.from[axis] != self.to[axis],
        }
    }

    /// Position of `axis` at `t_s` seconds of the move, in fractional steps.
    fn at(&self, axis: usize, t_s: f64) -> f64 {
        match &self.motion {
            Motion::Path(route) if t_s < self.end_s() => {
                let place = |of: usize| route.path.at(t_s - self.start_s())[of] / route.mm_per_step[of];
                route.coordinate(axis).map_or(self.from[axis] as f64, place)
            }
            _ => {
                let way = (self.to[axis] - self.from[axis]) as f64;
                self.from[axis] as f64 + way * self.share(t_s)
            }
        }
    }

    /// Completed share at `t_s` seconds of the move, 0 … 1.
    pub fn share(&self, t_s: f64) -> f64 {
        let own_s = t_s - self.start_s();
        match &self.motion {
            Motion::Line(stroke) if stroke.length_mm() > 0.0 => {
                stroke.position_mm(own_s) / stroke.length_mm()
            }
            Motion::Line(_) => 1.0,
            Motion::TableSteps(steps) => {
                let done = steps.count_at((own_s.max(0.0) * TICK_HZ as f64) as u64);
                done as f64 / steps.count().max(1) as f64
            }
            Motion::Path(route) if route.path.length_mm() > 0.0 => {
                route.path.position_mm(own_s) / route.path.length_mm()
            }
            Motion::Path(_) => 1.0,
        }
    }

    /// Speed along the line at `t_s` seconds of the move, mm/s; for table steps, the mean of the part.
    pub fn speed(&self, t_s: f64, mm_per_step: &[f64; AXES]) -> f64 {
        let own_s = t_s - self.start_s();
        match &self.motion {
            Motion::Line(stroke) => stroke.speed(own_s),
            Motion::Path(route) => route.path.speed(own_s),
            Motion::TableSteps(_) if own_s < 0.0 || own_s > self.duration_s() => 0.0,
            Motion::TableSteps(_) => {
                let way = |axis: usize| (self.to[axis] - self.from[axis]).abs() as f64 * mm_per_step[axis];
                (0..AXES).map(way).sum::<f64>() / self.duration_s().max(1e-9)
            }
        }
    }
}

impl Move {
    /// Position of the axes at `t_s` seconds of the move, in fractional steps.
    pub fn at(&self, t_s: f64) -> [f64; AXES] {
        let mut at = self.from.map(|place| place as f64);
        for part in self.parts.iter().filter(|part| part.start_s() <= t_s) {
            for axis in (0..AXES).filter(|axis| part.moves(*axis)) {
                at[axis] = part.at(axis, t_s);
            }
        }
        at
    }

    /// The latest part that moves at `t_s` seconds of the move.
    pub fn part_at(&self, t_s: f64) -> Option<&AxisMove> {
        self.parts.iter().rev().find(|part| part.start_s() <= t_s && t_s < part.end_s())
    }

    /// True if any axis moves, even if it returns to its start.
    pub fn moves(&self) -> bool {
        !self.parts.is_empty()
    }

    /// Index in the leg of the command at `t_s` seconds of the move.
    pub fn command_at(&self, t_s: f64) -> u32 {
        let route = self.parts.iter().find_map(|part| match &part.motion {
            Motion::Path(route) => Some((part.start_s(), route)),
            _ => None,
        });
        self.command + route.map_or(0, |(start_s, route)| route.path.wanted_at(t_s - start_s))
    }

    /// Start, in seconds of the move, of a later `command` of the leg that is part of this move. Defined even
    /// if the command has no length.
    pub fn start_of_command_s(&self, command: u32) -> Option<f64> {
        let later = command.checked_sub(self.command)?;
        self.parts.iter().find_map(|part| match &part.motion {
            Motion::Path(route) => Some(part.start_s() + route.path.start_of_wanted_s(later)),
            _ => None,
        })
    }

    /// Tick, from the start of the timeline, at which the hole is complete: the end of its last downward
    /// stroke.
    pub fn drilled_tick(&self) -> Option<u64> {
        let down = self.parts.iter().filter(|part| part.stage == Stage::Drill);
        let end_s = down.map(AxisMove::end_s).reduce(f64::max)?;
        let end = libm::ceil(end_s * TICK_HZ as f64) as u64;
        Some(self.start_tick + end.min(self.duration_ticks))
    }
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Timeline {
    pub start: Steps,
    /// In order, without gaps.
    pub moves: Vec<Move>,
    pub mm_per_step: [f64; AXES],
}

impl Timeline {
    pub fn total_ticks(&self) -> u64 {
        self.moves.last().map_or(0, |last| last.start_tick + last.duration_ticks)
    }

    pub fn total_s(&self) -> f64 {
        self.total_ticks() as f64 / TICK_HZ as f64
    }

    pub fn end(&self) -> Steps {
        self.moves.last().map_or(self.start, |last| last.to)
    }
}
