//! Programs: the interface between planning (boards, toolpaths) and motion (axes).
//!
//! ```text
//! Program ─┬─ leg 0  prepare   [Spindle on, Dwell]
//!          ├─ leg 1  hole 17   [Rapid, Plunge(gate?), Dwell, Retract]
//!          ├─ leg 2  hole 4    [ … ]
//!          └─ leg n  finish    [Spindle off, Rapid home]
//! ```
//!
//! A leg starts and ends at rest with Z at the safe height, so a job can resume at any leg.

mod again;
mod asked;
pub mod bite;
mod briefing;
mod milled;
mod tool;
pub mod worn;

pub use asked::{Asked, AskedEdge, Cleared, Promised};
pub use briefing::{AlignmentPins, Briefing, SideBriefing, ToolBriefing, touched};
pub use milled::{deepest, milled_mm, travel_mm};

use crate::geometry::Point;
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// A whole job. Starts and ends at work X = Y = 0 with Z at `safe_height`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Program {
    pub name: String,
    /// Fingerprint of the machine it was planned for ([`crate::machine::Machine::fingerprint`]).
    pub machine: String,
    /// Position of the work zero in the files' coordinates: work = file − origin.
    pub origin: Point,
    /// Bits in order of use.
    pub bits: Vec<Bit>,
    /// Bit set of the spindles that drill: bit 0 is Z1.
    pub spindles: u8,
    /// Height of rapids over the board's surface.
    pub safe_height: Length,
    pub legs: Vec<Leg>,
    /// Codes of the errors that the user accepted.
    pub accepted: Vec<String>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bit {
    pub diameter: Length,
    /// Display name, for example `0.8 mm`.
    pub name: String,
    pub cutter: Cutter,
    /// Settings that don't affect its shape.
    #[serde(default)]
    pub handling: Handling,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Handling {
    /// Retract speed, µm/s; 0 for the machine's fastest.
    pub up_um_per_s: u32,
    /// Greatest run-out of the edge: holes are wider by twice that.
    pub run_out: Length,
}

impl Handling {
    pub fn up_mm_per_s(self) -> f64 {
        if self.up_um_per_s == 0 { f64::INFINITY } else { f64::from(self.up_um_per_s) / 1e3 }
    }
}

/// The shape of a tool.
///
/// ```text
///   Drill ╲╱      Mill ┌┐       Vee  ╲  ╱  angle between its edges
///                      └┘             ╲╱   flat tip
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cutter {
    /// Cuts straight down; breaks if dragged sideways.
    #[default]
    Drill,
    /// End mill: a cylinder with a flat end.
    Mill,
    /// V-bit: a cone with a flat tip; the deeper, the wider.
    Vee {
        tip: Length,
        /// Angle between the edges, in thousandths of a degree, above 0 and below 180 000.
        angle_mdeg: u32,
    },
}

impl Bit {
    /// Width of the cut at the surface, with the tip `depth` below it.
    ///
    /// ```text
    ///  width = tip + 2 · depth · tan(angle / 2), at most the diameter
    /// ```
    pub fn width_at(&self, depth: Length) -> Length {
        let Cutter::Vee { tip, angle_mdeg } = self.cutter else { return self.diameter };
        let half = f64::from(angle_mdeg) * 0.5e-3 * std::f64::consts::PI / 180.0;
        (tip + Length::from_mm(2.0 * depth.mm().max(0.0) * libm::tan(half))).min(self.diameter)
    }

    /// Depth at which the tool cuts `width` at the surface. None for tools of constant width, and for
    /// impossible widths.
    pub fn depth_for(&self, width: Length) -> Option<Length> {
        let Cutter::Vee { tip, angle_mdeg } = self.cutter else { return None };
        let half = f64::from(angle_mdeg) * 0.5e-3 * std::f64::consts::PI / 180.0;
        let wanted = (width - tip).mm() / (2.0 * libm::tan(half));
        (width >= tip && width <= self.diameter).then(|| Length::from_mm(wanted))
    }

    /// Depth and width of the widest cut that fits into `gap` and is at least `least` deep; none if there is
    /// none. A V-bit cuts at most three times as deep as `least`, to protect its tip.
    pub fn fitting(&self, gap: Length, least: Length) -> Option<(Length, Length)> {
        let narrowest = self.width_at(least);
        if self.cutter == Cutter::Drill || narrowest > gap {
            return None;
        }
        let Some(depth) = self.depth_for(gap.min(self.diameter)) else { return Some((least, narrowest)) };
        let depth = depth.max(least).min(least * 3);
        Some((depth, self.width_at(depth)))
    }
}

/// Purpose of a leg, and its link to the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mark {
    /// Spindle off, at safe height.
    Prepare,
    /// Insert this bit (index into [`Program::bits`]), by the user or the magazine.
    ToolChange(u32),
    /// Drill this hole (index into the board's holes).
    Hole(u32),
    /// Mill along this toolpath (index into the job's toolpaths).
    Toolpath(u32),
    /// Spindle off, back to the work zero.
    Finish,
}

/// Commands between two moments of rest at safe height.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Leg {
    pub mark: Mark,
    pub commands: Vec<Command>,
}

impl Leg {
    /// The commands with their locations, if this is leg `leg` of its program.
    pub fn placed(&self, leg: u32) -> impl Iterator<Item = (CommandPlace, Command)> {
        (0..).zip(&self.commands).map(move |(command, what)| (CommandPlace { leg, command }, *what))
    }

    /// Location of the last command, if this is leg `leg` of its program.
    pub fn end(&self, leg: u32) -> CommandPlace {
        self.placed(leg).last().map_or(CommandPlace { leg, command: 0 }, |(place, _)| place)
    }

    /// Bottom of the drilled hole; none if the leg mills, or if a sensor ends the plunge.
    pub fn bottom(&self) -> Option<Length> {
        let mut bottom = Length::ZERO;
        for command in &self.commands {
            match *command {
                Command::Plunge { to, gate: None, .. } => bottom = bottom.min(to),
                Command::Plunge { .. } | Command::Mill { .. } | Command::MillArc { .. } => return None,
                _ => {}
            }
        }
        (matches!(self.mark, Mark::Hole(_)) && bottom < Length::ZERO).then_some(bottom)
    }
}

/// Location of a command in a program; ordered by execution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct CommandPlace {
    pub leg: u32,
    /// Index within the leg.
    pub command: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Command {
    /// Rapid to a position in XY, both axes together, at safe height.
    Rapid {
        /// Target, in work coordinates.
        to: Point,
    },
    /// Plunge into the board. With a gate, the sensor ends the plunge, and `to` is the limit.
    Plunge {
        to: Length,
        feed_um_per_s: u32,
        gate: Option<Gate>,
    },
    /// Straight move at feed, with the tip in the board. Consecutive mill commands form one path, without
    /// stops where its corners allow.
    Mill {
        /// XY target, in work coordinates.
        to: Point,
        /// Height of the tip at the target; changes linearly on the way.
        height: Length,
        feed_um_per_s: u32,
    },
    /// Like [`Self::Mill`], along an arc, or a helix if the height changes. A full circle if it ends at its
    /// start.
    MillArc {
        to: Point,
        /// Height of the tip at the target; changes linearly on the way.
        height: Length,
        center: Point,
        ccw: bool,
        feed_um_per_s: u32,
    },
    Retract {
        to: Length,
    },
    Dwell {
        us: u32,
    },
    /// Set the spindle speed; 0 is off.
    Spindle {
        rpm: u32,
    },
    /// Wait until the user reports that this bit is in the spindle.
    AwaitBit {
        bit: u32,
    },
}

/// A move that ends when `input` turns on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Gate {
    pub input: Input,
    /// Longest time from the start of the move, in µs.
    pub deadline_us: u32,
    /// Reaction if the move ends, or the deadline passes, without the input.
    pub otherwise: Otherwise,
}

/// Reaction to an unmet gate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Otherwise {
    /// Stop and raise an alarm: the bit is dull, the board is missing, or the sensor is broken.
    Alarm,
    /// Continue: the end of the move is good enough.
    GoOn,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    Travel,
    /// Z moves down to just above the board.
    Approach,
    /// Z moves down through the board.
    Drill,
    Retract,
    /// XY and spindles together: from one hole to the bottom of the next.
    NextHole,
    /// X and Y along a path, with the tip in the board.
    Mill,
    Dwell,
    AwaitBit,
    /// Homing: fast towards the limit switch.
    Seek,
    /// Homing: slowly off the limit switch.
    BackOff,
    /// Homing: slowly to the edge of the limit switch.
    Locate,
    /// Homing: from the edge to the rest position.
    Offset,
    /// A short jog.
    Jog,
    /// Slowly towards a board or a plate, until the contact closes.
    Touch,
    /// Homing: slowly away from the limit switch, to the index pulse.
    Index,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Switching {
    #[default]
    None,
    Spindle {
        /// In rpm; 0 is off.
        rpm: u32,
    },
    /// Stop and request this bit.
    AwaitBit {
        /// Index into the program's bits.
        bit: u32,
    },
    Foot {
        /// Down onto the board, else up.
        down: bool,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Input {
    /// Limit switch at the low end of X.
    XMin,
    /// Limit switch at the high end of X.
    XMax,
    /// Limit switch at the low end of Y.
    YMin,
    /// Limit switch at the high end of Y.
    YMax,
    ZTop,
    ZBottom,
    /// The tip touches the board.
    Contact,
    FootDown,
    ClampOpen,
    ToolHeld,
    /// The magazine slot below the spindle holds a tool.
    PlaceTaken,
    CoverOpen,
    /// Compressed air is present for clamp and foot.
    Air,
    /// Index pulse of the X motor, once per turn.
    XIndex,
    YIndex,
    ZIndex,
}

impl Input {
    /// All inputs, in the order of their bits.
    pub const ALL: [Self; 16] = [
        Self::XMin,
        Self::XMax,
        Self::YMin,
        Self::YMax,
        Self::ZTop,
        Self::ZBottom,
        Self::Contact,
        Self::FootDown,
        Self::ClampOpen,
        Self::ToolHeld,
        Self::PlaceTaken,
        Self::CoverOpen,
        Self::Air,
        Self::XIndex,
        Self::YIndex,
        Self::ZIndex,
    ];

    /// Limit switches and the contact sensor: the first inputs.
    pub const OF_AXES: [Self; 7] =
        [Self::XMin, Self::XMax, Self::YMin, Self::YMax, Self::ZTop, Self::ZBottom, Self::Contact];

    /// Name in messages. Pages of other versions read it, so it never changes.
    pub const fn name(self) -> &'static str {
        match self {
            Self::XMin => "XMin",
            Self::XMax => "XMax",
            Self::YMin => "YMin",
            Self::YMax => "YMax",
            Self::ZTop => "ZTop",
            Self::ZBottom => "ZBottom",
            Self::Contact => "Contact",
            Self::FootDown => "FootDown",
            Self::ClampOpen => "ClampOpen",
            Self::ToolHeld => "ToolHeld",
            Self::PlaceTaken => "PlaceTaken",
            Self::CoverOpen => "CoverOpen",
            Self::Air => "Air",
            Self::XIndex => "XIndex",
            Self::YIndex => "YIndex",
            Self::ZIndex => "ZIndex",
        }
    }

    pub const fn bit(self) -> u32 {
        1 << self as u32
    }
}

impl Program {
    /// The program with all feeds scaled to `percent`. The speed limits of the axes still apply.
    #[must_use]
    pub fn at_feed(&self, percent: u8) -> Self {
        let mut program = self.clone();
        for command in program.legs.iter_mut().flat_map(|leg| &mut leg.commands) {
            let (Command::Plunge { feed_um_per_s, .. }
            | Command::Mill { feed_um_per_s, .. }
            | Command::MillArc { feed_um_per_s, .. }) = command
            else {
                continue;
            };
            let feed = u64::from(*feed_um_per_s) * u64::from(percent) / 100;
            *feed_um_per_s = u32::try_from(feed).unwrap_or(u32::MAX);
        }
        program
    }

    pub fn hole_count(&self) -> usize {
        self.legs.iter().filter(|leg| matches!(leg.mark, Mark::Hole(_))).count()
    }

    pub fn toolpath_count(&self) -> usize {
        self.legs.iter().filter(|leg| matches!(leg.mark, Mark::Toolpath(_))).count()
    }

    /// XY position before leg `index`; the work zero before the first.
    pub fn start_of_leg(&self, index: usize) -> Point {
        let before = self.legs[..index.min(self.legs.len())].iter().rev();
        let mut commands = before.flat_map(|leg| leg.commands.iter().rev());
        let place = commands.find_map(|command| match command {
            Command::Rapid { to } | Command::Mill { to, .. } | Command::MillArc { to, .. } => Some(*to),
            _ => None,
        });
        place.unwrap_or_default()
    }
}

#[cfg(test)]
impl Program {
    /// A program of these legs without bits, with a safe height of 2 mm, for tests.
    pub(crate) fn of_legs(legs: Vec<Leg>) -> Self {
        Self {
            name: String::new(),
            machine: String::new(),
            origin: Point::default(),
            bits: Vec::new(),
            spindles: 1,
            safe_height: Length::from_um(2_000),
            legs,
            accepted: Vec::new(),
        }
    }
}
