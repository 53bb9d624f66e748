//! What a person must know who runs the programs of a job one after the other: at the machine, with a tool in the hand.
//!
//! ```text
//!  Briefing ─┬─ job, machine, where the zero is, how thick the board is
//!            ├─ pins: where, how thick, how far into the bed; how the board is turned over
//!            └─ sides, in order ─┬─ what any side needs, from the work zero: the blank must reach so far
//!                                └─ tools, in order of use: what each does, how long it takes
//! ```
//!
//! Comes in: of a plan, or of a program alone. Goes out: plain data for heads of files and run sheets. Lengths in work
//! coordinates. Does not know any controller, nor words: it names keys of the locale tables.

use super::{Bit, Command, Mark, Program};
use crate::geometry::{Bounds, Point};
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// A job as the person at the machine sees it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Briefing {
    /// What the job is called.
    pub job: String,
    /// What the machine is called.
    pub machine: String,
    /// Where the work zero is: a word of `run_sheet.zero`.
    pub zero: Option<String>,
    /// Thickness of the board.
    pub thickness: Option<Length>,
    /// Pins that hold the board when it is turned over.
    pub pins: Option<AlignmentPins>,
    /// How many tabs hold the board while it is cut out; none where nothing is.
    pub tabs: Option<u32>,
    /// How it is turned over between its sides: a word of `run_sheet.flip`.
    pub flip: Option<String>,
    /// Its sides in the order in which they are done.
    pub sides: Vec<SideBriefing>,
}

/// One side of a job.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SideBriefing {
    /// Which: a word of `page.cam.word`; empty where nobody knows.
    pub side: String,
    /// All that is cut on any side, the board, and a rim around cut-outs and pins: so large the blank must be.
    pub blank: Option<Bounds>,
    /// The bits of its program, in order.
    pub tools: Vec<ToolBriefing>,
}

/// What one bit does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToolBriefing {
    /// The bit.
    pub tool: Bit,
    /// The words of its operations, in order, each once.
    pub operations: Vec<String>,
    /// Seconds, without the waits for people; none where nobody reckoned.
    pub time_s: Option<f64>,
}

/// Pins that hold the board when it is turned over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlignmentPins {
    /// Their diameter.
    pub diameter: Length,
    /// How far they go below the board into the bed.
    pub below: Length,
    /// Where, in the work coordinates of the side that is done first.
    pub at: Vec<Point>,
}

impl Briefing {
    /// The numbers of the tools of side `side`, for each of its bits: from 1 in the order of use over all sides up to it. Bits of
    /// one form and size are one tool with one number, so that what stands in a magazine stays there for the whole job.
    pub fn numbers(&self, side: usize) -> Vec<u32> {
        let mut known: Vec<&Bit> = Vec::new();
        let mut numbers = Vec::new();
        for own in self.sides.iter().take(side + 1) {
            numbers.clear();
            for ToolBriefing { tool, .. } in &own.tools {
                let found = known.iter().position(|known| known.is_same_tool(tool));
                numbers.push(1 + found.unwrap_or(known.len()) as u32);
                known.extend(found.is_none().then_some(tool));
            }
        }
        numbers
    }

    /// What a program alone says of itself.
    pub fn of(program: &Program) -> Self {
        let (mut drilled, mut milled) = (vec![false; program.bits.len()], vec![false; program.bits.len()]);
        let mut bit = 0;
        for leg in &program.legs {
            match leg.mark {
                Mark::ToolChange(next) => bit = next as usize,
                Mark::Hole(_) => drilled.iter_mut().skip(bit).take(1).for_each(|does| *does = true),
                Mark::Toolpath(_) => milled.iter_mut().skip(bit).take(1).for_each(|does| *does = true),
                Mark::Prepare | Mark::Finish => {}
            }
        }
        let does = drilled.into_iter().zip(milled);
        let tools = program.bits.iter().zip(does).map(|(tool, (drills, mills))| {
            let words = [drills.then_some("drill"), mills.then_some("mill")];
            let operations = words.into_iter().flatten().map(str::to_owned).collect();
            ToolBriefing { tool: tool.clone(), operations, time_s: None }
        });
        let side = SideBriefing { side: String::new(), blank: touched(program), tools: tools.collect() };
        Self { job: program.name.clone(), sides: vec![side], ..Self::default() }
    }
}

/// The box around all that the bits of a program touch, each as wide as it is; none where they touch nothing.
pub fn touched(program: &Program) -> Option<Bounds> {
    let (mut at, mut radius) = (Point::default(), Length::ZERO);
    let mut all: Option<Bounds> = None;
    let mut add = |place: Point, radius: Length| {
        let own = Bounds::of(place).grown(radius);
        all = Some(all.map_or(own, |all| all.with(own.min).with(own.max)));
    };
    for command in program.legs.iter().flat_map(|leg| &leg.commands) {
        let wide = |height: Length, bit: &Bit| Length::from_nm(bit.width_at(-height).nm() / 2);
        match *command {
            Command::AwaitBit { bit } => {
                let bit = program.bits.get(bit as usize);
                radius = bit.map_or(Length::ZERO, |bit| wide(-Length::from_um(100), bit));
            }
            Command::Rapid { to } => at = to,
            Command::Plunge { to, .. } if to < Length::ZERO => add(at, radius),
            Command::Mill { to, .. } => {
                add(at, radius);
                add(to, radius);
                at = to;
            }
            Command::MillArc { to, center, ccw, .. } => {
                add(at, radius);
                add(to, radius);
                for place in extremes(at, to, center, ccw) {
                    add(place, radius);
                }
                at = to;
            }
            _ => {}
        }
    }
    all
}

/// The places of an arc that are furthest to either side.
fn extremes(from: Point, to: Point, center: Point, ccw: bool) -> impl Iterator<Item = Point> {
    let radius = Length::from_mm(from.distance_mm(center));
    let turn = crate::geometry::chords::turn(from, to, center, !ccw);
    let quarters =
        [(radius, Length::ZERO), (Length::ZERO, radius), (-radius, Length::ZERO), (Length::ZERO, -radius)];
    let places = quarters.map(|(x, y)| Point::new(center.x + x, center.y + y));
    places.into_iter().filter(move |place| crate::geometry::chords::turn(from, *place, center, !ccw) <= turn)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::{Cutter, Leg};

    fn program(commands: Vec<Command>) -> Program {
        let tool = Bit {
            diameter: Length::from_mm(2.0),
            name: String::new(),
            cutter: Cutter::Mill,
            handling: Default::default(),
        };
        Program {
            name: "a board".to_owned(),
            machine: String::new(),
            origin: Point::default(),
            bits: vec![tool],
            spindles: 1,
            safe_height: Length::from_mm(2.0),
            legs: vec![
                Leg { mark: Mark::ToolChange(0), commands: vec![Command::AwaitBit { bit: 0 }] },
                Leg { mark: Mark::Toolpath(0), commands },
            ],
            accepted: Vec::new(),
        }
    }

    #[test]
    fn what_is_touched_is_as_wide_as_bits_and_arcs() {
        let at = Point::from_mm;
        let (height, feed_um_per_s) = (Length::from_mm(-1.0), 1);
        let down = Command::Plunge { to: height, feed_um_per_s, gate: None };
        let arc = |to, center, ccw| Command::MillArc { to, height, center, ccw, feed_um_per_s };
        let rows = [
            (vec![Command::Rapid { to: at(50.0, 50.0) }], None),
            (vec![Command::Rapid { to: at(5.0, 6.0) }, down], Some((at(4.0, 5.0), at(6.0, 7.0)))),
            // The upper half of a circle about 10, 10, and the lower.
            (
                vec![Command::Rapid { to: at(15.0, 10.0) }, down, arc(at(5.0, 10.0), at(10.0, 10.0), true)],
                Some((at(4.0, 9.0), at(16.0, 16.0))),
            ),
            (
                vec![Command::Rapid { to: at(15.0, 10.0) }, down, arc(at(5.0, 10.0), at(10.0, 10.0), false)],
                Some((at(4.0, 4.0), at(16.0, 11.0))),
            ),
        ];
        for (commands, corners) in rows {
            let found = touched(&program(commands));
            assert_eq!(found.map(|bounds| (bounds.min, bounds.max)), corners);
        }
    }

    #[test]
    fn a_program_says_what_its_bits_do() {
        let briefing = Briefing::of(&program(vec![Command::Rapid { to: Point::default() }]));
        assert_eq!(briefing.sides[0].tools[0].operations, ["mill"]);
    }
}
