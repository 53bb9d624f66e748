//! A program as moves in time.
//!
//! ```text
//! one by one        Travel      Dwell    Approach   Drill      Dwell   Retract
//! speed            /‾‾‾‾‾‾\             /‾‾\      _______             /‾‾‾‾\
//!              ___/        \___________/    \____/       \___________/      \__
//!
//! together     |<------------------- one move: Hop ------------------------>|
//! Z up         /‾‾‾‾‾‾‾‾\__                            (from the bottom of the hole before)
//! plane            ____/‾‾‾‾‾‾‾‾\____
//! Z down                       ____/‾‾‾\_______        (to the bottom of this one)
//! ```
//!
//! A [`Move`] begins and ends at rest. Inside it, its [`AxisMove`]s move some axes each, in their own time.
//!
//! Goes out: a [`Timeline`] as data, and where it is at any second. Does not know commands, nor step times.

use super::automaton::SteadyStretch;
use super::path::PlannedPath;
use super::profile::Stroke;
use crate::job::{Gate, Mark, Stage, Switching};
use crate::machine::{AXES, Steps};
use crate::units::TICK_HZ;
use serde::{Deserialize, Serialize};

/// Something that begins and ends at rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Move {
    /// Index of the leg in the program.
    pub leg: u32,
    /// Index of the command in the leg; of several that are one move, of the first.
    pub command: u32,
    /// What the leg is for.
    pub mark: Mark,
    /// What is being done.
    pub stage: Stage,
    /// Where all axes stand before.
    pub from: Steps,
    /// Where all axes stand afterwards.
    pub to: Steps,
    /// First tick, from the start of the timeline.
    pub start_tick: u64,
    /// How long it takes, in ticks.
    pub duration_ticks: u64,
    /// What moves, in order of start. Parts that move the same axis follow each other.
    pub parts: Vec<AxisMove>,
    /// What is switched at its start.
    pub effect: Switching,
    /// The sensor that may end it early.
    pub gate: Option<Gate>,
}

/// A straight line of some axes from rest to rest, within a move.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisMove {
    /// What is being done.
    pub stage: Stage,
    /// When it begins, in ticks from the start of the move.
    pub start_tick: u64,
    /// Where the axes stand before. Only those that stand elsewhere afterwards belong to the part.
    pub from: Steps,
    /// Where they stand afterwards.
    pub to: Steps,
    /// How they go there.
    pub motion: Motion,
}

/// How a part goes along its line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Motion {
    /// By a profile over the length of the line.
    Line(Stroke),
    /// By the table of dynamics, step by step; one axis.
    TableSteps(TableSteps),
    /// X, Y and spindles along lines, arcs and helices, without a stop.
    Path(Box<MotorPath>),
}

/// A path of the motors, what a step of X, Y and Z is along it, and who follows its height.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotorPath {
    /// Where it goes, in mm from the work zero.
    pub path: PlannedPath,
    /// Millimetres of one step.
    pub mm_per_step: [f64; 3],
    /// The spindles that go along, one bit each: bit 0 is Z1.
    pub spindles: u8,
}

impl MotorPath {
    /// Which of its coordinates `axis` follows, if any.
    pub fn coordinate(&self, axis: usize) -> Option<usize> {
        match axis {
            0 | 1 => Some(axis),
            _ => (axis < AXES && self.spindles >> (axis - 2) & 1 == 1).then_some(2),
        }
    }
}

/// The steps of one axis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TableSteps {
    /// Ticks from interrupt to interrupt.
    pub interrupt_ticks: u64,
    /// Steps at equal distances, in interrupts, in order.
    pub stretches: Vec<SteadyStretch>,
}

impl TableSteps {
    /// How long they take, in ticks.
    pub fn duration_ticks(&self) -> u64 {
        let interrupts = self.stretches.iter().map(|some| u64::from(some.interval) * some.count);
        interrupts.sum::<u64>() * self.interrupt_ticks
    }

    /// How many steps have come by `tick`.
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

    /// The tick of step `index`, counted from 0; that of the last one beyond it.
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
    /// How long it takes, s.
    pub fn duration_s(&self) -> f64 {
        match &self.motion {
            Motion::Line(stroke) => stroke.duration_s(),
            Motion::TableSteps(steps) => steps.duration_ticks() as f64 / TICK_HZ as f64,
            Motion::Path(route) => route.path.duration_s(),
        }
    }

    /// How far it goes, in mm; a step table moves one axis.
    pub fn length_mm(&self, mm_per_step: &[f64; AXES]) -> f64 {
        let travel = |axis: usize| (self.to[axis] - self.from[axis]).abs() as f64 * mm_per_step[axis];
        match &self.motion {
            Motion::Line(stroke) => stroke.length_mm(),
            Motion::Path(route) => route.path.length_mm(),
            Motion::TableSteps(_) => (0..AXES).map(travel).fold(0.0, f64::max),
        }
    }

    /// Second of the move at which it begins.
    pub fn start_s(&self) -> f64 {
        self.start_tick as f64 / TICK_HZ as f64
    }

    /// Second of the move at which it ends.
    pub fn end_s(&self) -> f64 {
        self.start_s() + self.duration_s()
    }

    /// Whether `axis` belongs to it.
    pub fn moves(&self, axis: usize) -> bool {
        match &self.motion {
            // A path that closes ends where it starts.
            Motion::Path(route) => route.coordinate(axis).is_some(),
            _ => self.from[axis] != self.to[axis],
        }
    }

    /// Where `axis` is `t_s` seconds after the start of the move, in steps and parts of steps.
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

    /// Share of the way done `t_s` seconds after the start of the move, 0 … 1.
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

    /// Speed along the line `t_s` seconds after the start of the move, mm/s; of steps the mean of the whole move.
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
    /// Where the axes are `t_s` seconds after the start of the move, in steps and parts of steps.
    pub fn at(&self, t_s: f64) -> [f64; AXES] {
        let mut at = self.from.map(|place| place as f64);
        for part in self.parts.iter().filter(|part| part.start_s() <= t_s) {
            for axis in (0..AXES).filter(|axis| part.moves(*axis)) {
                at[axis] = part.at(axis, t_s);
            }
        }
        at
    }

    /// The part that began last and still moves, `t_s` seconds after the start of the move.
    pub fn part_at(&self, t_s: f64) -> Option<&AxisMove> {
        self.parts.iter().rev().find(|part| part.start_s() <= t_s && t_s < part.end_s())
    }

    /// Whether any axis goes anywhere, there or there and back.
    pub fn moves(&self) -> bool {
        !self.parts.is_empty()
    }

    /// The command that is done `t_s` seconds after the start of the move, by its index in the leg.
    pub fn command_at(&self, t_s: f64) -> u32 {
        let route = self.parts.iter().find_map(|part| match &part.motion {
            Motion::Path(route) => Some((part.start_s(), route)),
            _ => None,
        });
        self.command + route.map_or(0, |(start_s, route)| route.path.wanted_at(t_s - start_s))
    }

    /// The second, from the start of the move, at which a later `command` of the leg begins that is done in this move, or would
    /// be if it went anywhere.
    pub fn start_of_command_s(&self, command: u32) -> Option<f64> {
        let later = command.checked_sub(self.command)?;
        self.parts.iter().find_map(|part| match &part.motion {
            Motion::Path(route) => Some(part.start_s() + route.path.start_of_wanted_s(later)),
            _ => None,
        })
    }

    /// The tick, from the start of the timeline, at which the hole is through: the end of the last stroke down in it.
    pub fn drilled_tick(&self) -> Option<u64> {
        let down = self.parts.iter().filter(|part| part.stage == Stage::Drill);
        let end_s = down.map(AxisMove::end_s).reduce(f64::max)?;
        let end = libm::ceil(end_s * TICK_HZ as f64) as u64;
        Some(self.start_tick + end.min(self.duration_ticks))
    }
}

/// Moves one after the other.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Timeline {
    /// Where all axes stand before the first move, in steps from the work zero.
    pub start: Steps,
    /// What happens, in order and without a gap.
    pub moves: Vec<Move>,
    /// Millimetres of one step, for every axis.
    pub mm_per_step: [f64; AXES],
}

impl Timeline {
    /// How long all of it takes, in ticks.
    pub fn total_ticks(&self) -> u64 {
        self.moves.last().map_or(0, |last| last.start_tick + last.duration_ticks)
    }

    /// How long all of it takes, in seconds.
    pub fn total_s(&self) -> f64 {
        self.total_ticks() as f64 / TICK_HZ as f64
    }

    /// Where all axes stand after the last move.
    pub fn end(&self) -> Steps {
        self.moves.last().map_or(self.start, |last| last.to)
    }
}
