//! Moves whose depth follows the surface: whoever has moves, of a program or of a controller's routine, asks here what becomes of each.
//!
//! ```text
//!  as planned   ───────────────╲________________╱─────      z, from the work zero
//!  followed     ───────────────╲__──‾‾‾──__     ╱─────      z + h(x, y) below the safe height; at it and above, z
//! ```
//!
//! Comes in: moves one after the other, a map. Goes out: the same moves in pieces, and by how much depth was corrected. Lengths in whole
//! nanometres. Does not know how fast anything goes.

use super::HeightMap;
use super::along::PlaneCourse;
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::job::{Command, Leg, Program};
use crate::units::Length;

/// How far depth may be from the touched surface along a path: less than a step of most machines.
pub const TOLERANCE: Length = Length::from_um(2);

/// By how much the depth of what is cut was corrected: the lowest and the highest height of the surface there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Correction {
    /// The lowest.
    pub low: Length,
    /// The highest.
    pub high: Length,
}

impl Correction {
    /// The largest of the two, without its sign.
    pub fn largest(&self) -> Length {
        self.low.abs().max(self.high.abs())
    }
}

/// A program that follows a surface. It is made to be run at once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Levelled {
    /// The program.
    pub program: Program,
    /// By how much it was corrected.
    pub correction: Correction,
    /// The map that it follows: [`HeightMap::key`].
    pub map: String,
}

/// How a move goes in the plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FollowedCourse {
    /// Straight.
    Line,
    /// Along an arc; a full circle where it ends where it begins.
    Arc {
        /// Its centre.
        centre: Point,
        /// Counter-clockwise.
        ccw: bool,
    },
}

/// One that follows a map.
#[derive(Clone, Debug)]
pub struct Follower<'m> {
    map: &'m HeightMap,
    safe: Length,
    tolerance: Length,
    correction: Option<Correction>,
}

impl<'m> Follower<'m> {
    /// Of moves whose safe height is `safe`, off the touched surface by at most `tolerance`. Refused where the surface comes too near
    /// to that height: at it and above nothing is corrected.
    pub fn new(map: &'m HeightMap, safe: Length, tolerance: Length) -> Result<Self, Diagnostic> {
        let [_, high] = map.span();
        if !map.is_whole() {
            return Err(Diagnostic::error("level.damaged"));
        }
        if high * 2 > safe {
            let why = Diagnostic::error("level.too_high").with("mm", format!("{:.3}", high.mm()));
            return Err(why.with("safe", format!("{:.3}", safe.mm())));
        }
        Ok(Self { map, safe, tolerance: tolerance.max(Length::from_nm(100)), correction: None })
    }

    /// By how much was corrected so far.
    pub fn correction(&self) -> Correction {
        self.correction.unwrap_or_default()
    }

    /// The height that is planned as `height`, at `at`.
    pub fn height(&mut self, at: Point, height: Length) -> Result<Length, Diagnostic> {
        if height >= self.safe {
            return Ok(height);
        }
        let surface = self.map.height(at);
        if height < Length::ZERO {
            if !self.map.knows(at) {
                let why = Diagnostic::error("level.outside").with("x", format!("{:.3}", at.x.mm()));
                return Err(why.with("y", format!("{:.3}", at.y.mm())));
            }
            let known = self.correction.get_or_insert(Correction { low: surface, high: surface });
            (known.low, known.high) = (known.low.min(surface), known.high.max(surface));
        }
        Ok(height + surface)
    }

    /// The ends of the pieces of a move from one place and planned height to another.
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

/// The program as it follows the surface of `map`.
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

/// One command; `head` is where it begins, as planned.
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
