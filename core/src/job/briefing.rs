//! Contents of the run sheet: facts that the user needs at the machine to run the programs of a job in order.
//!
//! ```text
//!  Briefing ─┬─ job, machine, position of the zero, thickness of the board
//!            ├─ pins: position, diameter, depth in the bed; how to flip the board
//!            └─ sides, in order ─┬─ least size of the blank, from the work zero
//!                                └─ tools, in order of use: operations and time
//! ```
//!
//! Lengths in work coordinates.

use super::{Bit, Command, Mark, Program};
use crate::geometry::{Bounds, Point};
use crate::units::Length;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Briefing {
    pub job: String,
    pub machine: String,
    /// Position of the work zero: a key of `run_sheet.zero`.
    pub zero: Option<String>,
    pub thickness: Option<Length>,
    pub pins: Option<AlignmentPins>,
    /// Number of tabs that hold the board while it is cut out; none without a cut-out.
    pub tabs: Option<u32>,
    /// How to flip the board between sides: a key of `run_sheet.flip`.
    pub flip: Option<String>,
    /// Sides in machining order.
    pub sides: Vec<SideBriefing>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SideBriefing {
    /// A key of `page.cam.word`; empty if unknown.
    pub side: String,
    /// Least blank: everything cut on any side, the board, and a rim around cut-outs and pins.
    pub blank: Option<Bounds>,
    /// The bits of its program, in order.
    pub tools: Vec<ToolBriefing>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToolBriefing {
    pub tool: Bit,
    /// Keys of its operations, in order, without duplicates.
    pub operations: Vec<String>,
    /// Seconds, without waits for the user; none if not calculated.
    pub time_s: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlignmentPins {
    pub diameter: Length,
    /// Depth in the bed, below the board.
    pub below: Length,
    /// Positions in the work coordinates of the first side.
    pub at: Vec<Point>,
}

impl Briefing {
    /// Tool numbers of side `side`, for each of its bits: from 1 in order of use over all sides up to it.
    /// Bits of equal shape and size share one number, so a magazine can stay loaded for the whole job.
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

/// Bounds of everything that the bits of a program touch, including their radius; none if they touch nothing.
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
    fn touched_area_includes_tool_width_and_arcs() {
        let at = Point::from_mm;
        let (height, feed_um_per_s) = (Length::from_mm(-1.0), 1);
        let down = Command::Plunge { to: height, feed_um_per_s, gate: None };
        let arc = |to, center, ccw| Command::MillArc { to, height, center, ccw, feed_um_per_s };
        let rows = [
            (vec![Command::Rapid { to: at(50.0, 50.0) }], None),
            (vec![Command::Rapid { to: at(5.0, 6.0) }, down], Some((at(4.0, 5.0), at(6.0, 7.0)))),
            // The upper half of a circle about 10, 10, then the lower.
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
    fn briefing_lists_the_operations_of_each_tool() {
        let briefing = Briefing::of(&program(vec![Command::Rapid { to: Point::default() }]));
        assert_eq!(briefing.sides[0].tools[0].operations, ["mill"]);
    }
}
