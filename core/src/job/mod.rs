//! The waist of the house: a program of legs. Above it people think in boards, below it axes move.
//!
//! ```text
//! Program ─┬─ leg 0  prepare   [Spindle on, Dwell]
//!          ├─ leg 1  hole 17   [Rapid, Plunge(gate?), Dwell, Retract]
//!          ├─ leg 2  hole 4    [ … ]
//!          └─ leg n  finish    [Spindle off, Rapid home]
//! ```
//!
//! Comes in: a plan. Goes out: a [`Program`] in work coordinates: X and Y from the work zero, Z = 0 on the board's
//! surface and positive upwards. A leg begins and ends at rest with Z at the safe height, so a job can be taken up
//! at any leg. Does not know how fast anything can go.

mod again;
mod asked;
pub mod bite;
mod briefing;
mod cleared;
mod milled;
mod tool;
pub mod worn;

pub use asked::{Asked, AskedEdge};
pub use briefing::{AlignmentPins, Briefing, SideBriefing, ToolBriefing, touched};
pub use cleared::{Cleared, Promised};
pub use milled::{deepest, milled_mm, travel_mm};

use crate::geometry::Point;
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// A whole job. Starts and ends at work X = Y = 0 with Z at `safe_height`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Program {
    /// Name for people.
    pub name: String,
    /// Fingerprint of the machine it was planned for ([`crate::machine::Machine::fingerprint`]).
    pub machine: String,
    /// The place in the files' coordinates that is the work zero: work = file − origin.
    pub origin: Point,
    /// Bits in order of use.
    pub bits: Vec<Bit>,
    /// The spindles that drill, one bit each: bit 0 is Z1.
    pub spindles: u8,
    /// Height of rapid moves over the board's surface.
    pub safe_height: Length,
    /// What to do, in order.
    pub legs: Vec<Leg>,
    /// Every finding that was an error, by code, and that a person has seen and accepted.
    pub accepted: Vec<String>,
}

/// A bit used by a program.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bit {
    /// Its greatest diameter.
    pub diameter: Length,
    /// Name for people, for example `0.8 mm`.
    pub name: String,
    /// Its form.
    pub cutter: Cutter,
    /// How it is handled, beyond its form.
    #[serde(default)]
    pub handling: Handling,
}

/// How a bit is handled on the machine whose rack it is in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Handling {
    /// Speed at which it is lifted, µm/s; 0 for as fast as the machine goes.
    pub up_um_per_s: u32,
    /// How far its edge may run off its axis: a hole is wider by twice that.
    pub run_out: Length,
}

impl Handling {
    /// Speed at which the bit is lifted at most, mm/s.
    pub fn up_mm_per_s(self) -> f64 {
        if self.up_um_per_s == 0 { f64::INFINITY } else { f64::from(self.up_um_per_s) / 1e3 }
    }
}

/// The form of a bit.
///
/// ```text
///   Drill ╲╱      Mill ┌┐       Vee  ╲  ╱  angle between its edges
///                      └┘             ╲╱   flat tip
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cutter {
    /// It goes straight down; dragged sideways it breaks.
    #[default]
    Drill,
    /// A cylinder with a flat end: as wide at every depth.
    Mill,
    /// A cone with a flat tip: the deeper, the wider.
    Vee {
        /// Diameter of its tip.
        tip: Length,
        /// Angle between its edges, in thousandths of a degree, above 0 and below 180 000.
        angle_mdeg: u32,
    },
}

impl Bit {
    /// Width of the cut at the surface when the tip is `depth` below it.
    ///
    /// ```text
    ///  width = tip + 2 · depth · tan(angle / 2), at most the diameter
    /// ```
    pub fn width_at(&self, depth: Length) -> Length {
        let Cutter::Vee { tip, angle_mdeg } = self.cutter else { return self.diameter };
        let half = f64::from(angle_mdeg) * 0.5e-3 * std::f64::consts::PI / 180.0;
        (tip + Length::from_mm(2.0 * depth.mm().max(0.0) * libm::tan(half))).min(self.diameter)
    }

    /// The depth at which it cuts `width` at the surface; none for bits whose width does not depend on depth, and for
    /// widths that it cannot cut.
    pub fn depth_for(&self, width: Length) -> Option<Length> {
        let Cutter::Vee { tip, angle_mdeg } = self.cutter else { return None };
        let half = f64::from(angle_mdeg) * 0.5e-3 * std::f64::consts::PI / 180.0;
        let wanted = (width - tip).mm() / (2.0 * libm::tan(half));
        (width >= tip && width <= self.diameter).then(|| Length::from_mm(wanted))
    }

    /// Depth and width of the widest cut that fits into `gap` and goes at least as deep as `least`; none where none fits. A
    /// V-bit goes no deeper than three times what is needed: its tip does not like it.
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

/// What a leg is for, and the way back to the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mark {
    /// Spindle off, at safe height.
    Prepare,
    /// Put this bit (index into [`Program::bits`]) in; a person or the magazine does it.
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
    /// What it is for.
    pub mark: Mark,
    /// What to do, in order.
    pub commands: Vec<Command>,
}

impl Leg {
    /// Its commands with their places, where it is leg `leg` of its program.
    pub fn placed(&self, leg: u32) -> impl Iterator<Item = (CommandPlace, Command)> {
        (0..).zip(&self.commands).map(move |(command, what)| (CommandPlace { leg, command }, *what))
    }

    /// The place of its last command, where it is leg `leg` of its program.
    pub fn end(&self, leg: u32) -> CommandPlace {
        self.placed(leg).last().map_or(CommandPlace { leg, command: 0 }, |(place, _)| place)
    }

    /// The bottom of the hole that it drills; none where it mills, or a sensor says how deep it goes.
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

/// Which command of a program: in the order in which they are done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct CommandPlace {
    /// Index of its leg.
    pub leg: u32,
    /// Its index in the leg.
    pub command: u32,
}

/// One thing to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Command {
    /// Go to a place in the plane, both axes together, at rapid speed, at safe height.
    Rapid {
        /// Where, in work coordinates.
        to: Point,
    },
    /// Go down into the board. With a gate it ends where the sensor says, and `to` is the furthest it may go.
    Plunge {
        /// Lowest height of the tip.
        to: Length,
        /// Feed in µm/s.
        feed_um_per_s: u32,
        /// The sensor that ends it early, if any.
        gate: Option<Gate>,
    },
    /// Go straight to a place at feed, with the tip in the board. Mill commands that follow each other are one path: it
    /// is run through without a stop where its corners allow.
    Mill {
        /// Where in the plane, in work coordinates.
        to: Point,
        /// Height of the tip there; it changes evenly on the way.
        height: Length,
        /// Feed in µm/s.
        feed_um_per_s: u32,
    },
    /// The same along an arc, or a helix where the height changes; a full circle where it ends where it starts.
    MillArc {
        /// Where it ends in the plane.
        to: Point,
        /// Height of the tip there; it changes evenly on the way.
        height: Length,
        /// Its centre.
        center: Point,
        /// Counter-clockwise.
        ccw: bool,
        /// Feed in µm/s.
        feed_um_per_s: u32,
    },
    /// Go up, at rapid speed.
    Retract {
        /// Height of the tip.
        to: Length,
    },
    /// Stay.
    Dwell {
        /// For how long, in µs.
        us: u32,
    },
    /// Set the spindle's speed; 0 is off.
    Spindle {
        /// Speed in revolutions per minute.
        rpm: u32,
    },
    /// Wait until a person says that this bit is in.
    AwaitBit {
        /// Index into [`Program::bits`].
        bit: u32,
    },
}

/// A move that may end on a sensor: watch `input` while moving; when it turns on, stop there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Gate {
    /// What to watch.
    pub input: Input,
    /// Longest time from the start of the move, in µs.
    pub deadline_us: u32,
    /// What it means when the move ended, or the deadline passed, without the input.
    pub otherwise: Otherwise,
}

/// What an unmet gate means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Otherwise {
    /// Stop and raise an alarm: the bit is dull, the board is missing, the sensor is broken.
    Alarm,
    /// Go on: the end of the move is good enough.
    GoOn,
}

/// What is being done, in the words of the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// XY goes to the next place.
    Travel,
    /// Z goes down to just above the board.
    Approach,
    /// Z goes down through the board.
    Drill,
    /// Z goes up.
    Retract,
    /// From the bottom of one hole, or the top, to the bottom of the next: plane and spindles together.
    NextHole,
    /// X and Y along a path with the tip in the board.
    Mill,
    /// Nothing moves.
    Dwell,
    /// Waiting for a person to change the bit.
    AwaitBit,
    /// Homing: fast towards the end sensor.
    Seek,
    /// Homing: slowly off the end sensor.
    BackOff,
    /// Homing: slowly to the edge of the end sensor.
    Locate,
    /// Homing: from the edge to the resting place.
    Offset,
    /// A short move by hand.
    Jog,
    /// Slowly towards a board or a plate, to where the contact closes.
    Touch,
    /// Homing: slowly away from the end sensor, to the index pulse.
    Index,
}

/// What is switched before a piece of motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Switching {
    /// Nothing.
    #[default]
    None,
    /// Spindle speed in rpm; 0 is off.
    Spindle {
        /// Its speed; 0 is off.
        rpm: u32,
    },
    /// Stop and ask for this bit (index into the program's bits).
    AwaitBit {
        /// Index into the program's bits.
        bit: u32,
    },
    /// The presser foot.
    Foot {
        /// Down onto the board, else up.
        down: bool,
    },
}

/// The inputs of a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Input {
    /// End sensor at the low end of X.
    XMin,
    /// End sensor at the high end of X.
    XMax,
    /// End sensor at the low end of Y.
    YMin,
    /// End sensor at the high end of Y.
    YMax,
    /// Spindle all the way up.
    ZTop,
    /// Spindle all the way down.
    ZBottom,
    /// Tip touches the board.
    Contact,
    /// The presser foot is down.
    FootDown,
    /// The clamp of the spindle is open.
    ClampOpen,
    /// A tool is in the spindle.
    ToolHeld,
    /// A tool lies in the place of the magazine below the spindle.
    PlaceTaken,
    /// The cover of the machine is open.
    CoverOpen,
    /// There is air for clamp and foot.
    Air,
    /// The motor of X is at its index pulse, which comes once a turn.
    XIndex,
    /// The motor of Y is.
    YIndex,
    /// The motor of Z is.
    ZIndex,
}

impl Input {
    /// All of them, in the order of their bits.
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

    /// Those of the axes and of the tip: the first ones.
    pub const OF_AXES: [Self; 7] =
        [Self::XMin, Self::XMax, Self::YMin, Self::YMax, Self::ZTop, Self::ZBottom, Self::Contact];

    /// Its bit in a word of inputs.
    pub const fn bit(self) -> u32 {
        1 << self as u32
    }
}

impl Program {
    /// The same job with all its feeds, into the board and along it, at `percent` of what they were. How fast the axes may
    /// go at all is the machine's business.
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

    /// How many holes it drills.
    pub fn hole_count(&self) -> usize {
        self.legs.iter().filter(|leg| matches!(leg.mark, Mark::Hole(_))).count()
    }

    /// How many toolpaths it mills.
    pub fn toolpath_count(&self) -> usize {
        self.legs.iter().filter(|leg| matches!(leg.mark, Mark::Toolpath(_))).count()
    }

    /// Where the head stands in the plane before leg `index` (work zero before the first).
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
    /// These legs, with no bit, from 2 mm over the board: what a test needs.
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
