//! Splits moves so that their depth follows the surface, for programs and for a controller's routines.
//!
//! ```text
//!  as planned   ───────────────╲________________╱─────      z, from the work zero
//!  followed     ───────────────╲__──‾‾‾──__     ╱─────      z + h(x, y) below the safe height, else z
//! ```
//!
//! Lengths in whole nanometres.

use super::HeightMap;
use super::along::PlaneCourse;
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::geometry::Point;
use crate::job::{Command, Leg, Program};
use crate::units::Length;

/// Greatest deviation of the depth from the measured surface along a path: less than a step of most machines.
pub const TOLERANCE: Length = Length::from_um(2);

/// Correction of the cutting depth: lowest and highest surface height where the program cuts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Correction {
    pub low: Length,
    pub high: Length,
}

impl Correction {
    /// The larger absolute value of the two.
    pub fn largest(&self) -> Length {
        self.low.abs().max(self.high.abs())
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Levelled {
    pub program: Program,
    pub correction: Correction,
    /// Key of the map ([`HeightMap::key`]).
    pub map: String,
}

/// Course of a move in XY.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FollowedCourse {
    Line,
    /// An arc; a full circle if it ends at its start.
    Arc {
        centre: Point,
        ccw: bool,
    },
}

#[derive(Clone, Debug)]
pub struct Follower<'m> {
    map: &'m HeightMap,
    safe: Length,
    tolerance: Length,
    correction: Option<Correction>,
}

impl<'m> Follower<'m> {
    /// For moves with the safe height `safe`, with a deviation from the surface of at most `tolerance`.
    /// Nothing at or above `safe` is corrected. Fails if the surface is too near to that height.
    pub fn new(map: &'m HeightMap, safe: Length, tolerance: Length) -> Result<Self, Diagnostic> {
        let [_, high] = map.span();
        if !map.is_whole() {
            return Err(error!("level.damaged"));
        }
        // At least half of the safe height must remain over the surface.
        if high * 2 > safe {
            let why = error!("level.too_high", mm = format!("{:.3}", high.mm()), ..);
            return Err(why.with("safe", format!("{:.3}", safe.mm())));
        }
        Ok(Self { map, safe, tolerance: tolerance.max(Length::from_nm(100)), correction: None })
    }

    pub fn correction(&self) -> Correction {
        self.correction.unwrap_or_default()
    }

    pub fn height(&mut self, at: Point, height: Length) -> Result<Length, Diagnostic> {
        if height >= self.safe {
            return Ok(height);
        }
        let surface = self.map.height(at);
        // Only cuts need a measured surface, so moves above the board are never refused.
        if height < Length::ZERO {
            if !self.map.knows(at) {
                let why = error!("level.outside", x = format!("{:.3}", at.x.mm()), ..);
                return Err(why.with("y", format!("{:.3}", at.y.mm())));
            }
            let known = self.correction.get_or_insert(Correction { low: surface, high: surface });
            (known.low, known.high) = (known.low.min(surface), known.high.max(surface));
        }
        Ok(height + surface)
    }

    pub fn pieces(
        &mut self,
        (from, start): (Point, Length),
        (to, end): (Point, Length),
        course: FollowedCourse,
    ) -> Result<Vec<(Point, Length)>, Diagnostic> {
        let whole = match course {
            FollowedCourse::Line => PlaneCourse::line(from, to),
            FollowedCourse::Arc { centre, ccw } => PlaneCourse::arc(from, to, centre, ccw),
        };
        if start >= self.safe && end >= self.safe {
            return Ok(vec![(to, end)]);
        }
        let rise = (end - start).mm();
        let mut pieces = Vec::new();
        for share in whole.cuts(self.map, self.tolerance) {
            let (place, height) = if share >= 1.0 {
                (to, end)
            } else {
                (whole.at(share), start + Length::from_mm(rise * share))
            };
            pieces.push((place, self.height(place, height)?));
        }
        Ok(pieces)
    }
}

pub fn level(program: &Program, map: &HeightMap, tolerance: Length) -> Result<Levelled, Diagnostic> {
    let mut follower = Follower::new(map, program.safe_height, tolerance)?;
    let mut head = (Point::default(), program.safe_height);
    let mut legs = Vec::with_capacity(program.legs.len());
    for leg in &program.legs {
        let mut commands = Vec::with_capacity(leg.commands.len());
        for command in &leg.commands {
            followed(&mut follower, &mut head, *command, &mut commands)?;
        }
        legs.push(Leg { mark: leg.mark, commands });
    }
    let program = Program { legs, ..program.clone() };
    Ok(Levelled { program, correction: follower.correction(), map: map.key() })
}

/// Converts one command; `head` is its planned start.
fn followed(
    follower: &mut Follower<'_>,
    head: &mut (Point, Length),
    command: Command,
    commands: &mut Vec<Command>,
) -> Result<(), Diagnostic> {
    match command {
        Command::Rapid { to } => {
            head.0 = to;
            commands.push(command);
        }
        Command::Plunge { to, feed_um_per_s, gate } => {
            head.1 = to;
            let to = follower.height(head.0, to)?;
            commands.push(Command::Plunge { to, feed_um_per_s, gate });
        }
        Command::Retract { to } => {
            head.1 = to;
            commands.push(Command::Retract { to: follower.height(head.0, to)? });
        }
        Command::Mill { to, height, feed_um_per_s } => {
            let pieces = follower.pieces(*head, (to, height), FollowedCourse::Line)?;
            commands.extend(pieces.into_iter().map(|(to, height)| Command::Mill {
                to,
                height,
                feed_um_per_s,
            }));
            *head = (to, height);
        }
        Command::MillArc { to, height, center, ccw, feed_um_per_s } => {
            let course = FollowedCourse::Arc { centre: center, ccw };
            let pieces = follower.pieces(*head, (to, height), course)?;
            let piece = |(to, height)| Command::MillArc { to, height, center, ccw, feed_um_per_s };
            commands.extend(pieces.into_iter().map(piece));
            *head = (to, height);
        }
        Command::Dwell { .. } | Command::Spindle { .. } | Command::AwaitBit { .. } => commands.push(command),
    }
    Ok(())
}
