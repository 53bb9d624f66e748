//! The parts of a program as people count them: a stretch of holes or of toolpaths, of one operation, with one bit.
//!
//! ```text
//! bit V · way way way │ bit 0.8 · hole hole │ bit 2.0 · way        three parts; "2 of 3: hole 1 of 2"
//! ```
//!
//! Comes in: a [`Program`], and of which operation each toolpath is where that is known. Goes out: parts, and where a leg lies
//! in them. Knows no words.

use annulus_core::job::{Mark, Program};

/// A stretch of the same work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WorkPart {
    /// Holes are drilled; else toolpaths are milled.
    pub drills: bool,
    /// The bit, an index into the program's bits.
    pub bit: Option<u32>,
    /// The operation of its toolpaths, where that is known.
    pub operation: Option<u16>,
    /// Its first leg.
    pub from_leg: u32,
    /// How many holes or toolpaths it has.
    pub count: u32,
}

/// Where a leg lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LegPlace {
    /// Which part, from 0.
    pub at: usize,
    /// Holes or toolpaths of the part before this leg.
    pub done: u32,
}

/// Holes and toolpaths of a job, each as (made, in all).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorkCount {
    /// Holes.
    pub holes: (u32, u32),
    /// Toolpaths.
    pub toolpaths: (u32, u32),
}

impl WorkCount {
    /// The same, of a machine that has a job; of one that has none, what the last job `made` of the holes and toolpaths of `shown`.
    pub fn or_ended(self, made: (u32, u32), shown: (u32, u32)) -> Self {
        if self.holes.1 + self.toolpaths.1 > 0 {
            return self;
        }
        Self { holes: (made.0, shown.0), toolpaths: (made.1, shown.1) }
    }

    /// How much of it is made, from 0 to 1; none of a job without anything to make.
    pub fn share(self) -> Option<f64> {
        let all = self.holes.1 + self.toolpaths.1;
        (all > 0).then(|| f64::from(self.holes.0 + self.toolpaths.0) / f64::from(all))
    }
}

/// The parts of `program`; `operations` has the operation of each toolpath, by its index.
pub fn parts(program: &Program, operations: &[u16]) -> Vec<WorkPart> {
    let mut parts: Vec<WorkPart> = Vec::new();
    let mut bit = None;
    for (leg, mark) in (0..).zip(program.legs.iter().map(|leg| leg.mark)) {
        let (drills, operation) = match mark {
            Mark::ToolChange(index) => {
                bit = Some(index);
                continue;
            }
            Mark::Hole(_) => (true, None),
            Mark::Toolpath(way) => (false, operations.get(way as usize).copied()),
            Mark::Prepare | Mark::Finish => continue,
        };
        match parts.last_mut() {
            Some(last) if (last.drills, last.bit, last.operation) == (drills, bit, operation) => {
                last.count += 1;
            }
            _ => parts.push(WorkPart { drills, bit, operation, from_leg: leg, count: 1 }),
        }
    }
    parts
}

/// Where leg `leg` lies; before the first part it is the first that comes.
pub fn place(program: &Program, parts: &[WorkPart], leg: u32) -> Option<LegPlace> {
    let at = parts.partition_point(|part| part.from_leg <= leg).saturating_sub(1);
    let part = parts.get(at)?;
    let legs = program.legs.get(part.from_leg as usize..(leg as usize).min(program.legs.len()));
    let stops =
        legs.unwrap_or_default().iter().filter(|leg| matches!(leg.mark, Mark::Hole(_) | Mark::Toolpath(_)));
    Some(LegPlace { at, done: (stops.count() as u32).min(part.count) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::geometry::Point;
    use annulus_core::job::Leg;
    use annulus_core::units::Length;

    fn program(marks: &[Mark]) -> Program {
        Program {
            name: String::new(),
            machine: String::new(),
            origin: Point::default(),
            bits: Vec::new(),
            spindles: 1,
            safe_height: Length::ZERO,
            legs: marks.iter().map(|mark| Leg { mark: *mark, commands: Vec::new() }).collect(),
            accepted: Vec::new(),
        }
    }

    #[test]
    fn holes_and_toolpaths_are_counted_apart_also_when_the_job_is_over() {
        let told = |holes, toolpaths| WorkCount { holes, toolpaths };
        let rows = [
            // told by the machine │ made by the last job, planned in all │ shown, share
            ((5, 22), (13, 13), (0, 0), (22, 13), told((5, 22), (13, 13)), Some(18.0 / 35.0)),
            ((0, 0), (0, 0), (22, 13), (22, 13), told((22, 22), (13, 13)), Some(1.0)),
            ((0, 0), (0, 0), (0, 7), (0, 14), told((0, 0), (7, 14)), Some(0.5)),
            ((0, 0), (0, 0), (0, 0), (0, 0), WorkCount::default(), None),
        ];
        for (holes, toolpaths, made, shown, expected, share) in rows {
            let counted = told(holes, toolpaths).or_ended(made, shown);
            assert_eq!((counted, counted.share()), (expected, share), "{holes:?} {toolpaths:?} {made:?}");
        }
    }

    #[test]
    fn a_program_in_parts_and_every_leg_in_its_part() {
        use Mark::{Finish, Hole, Prepare, ToolChange, Toolpath};
        let marks = [
            Prepare,
            ToolChange(0),
            Toolpath(0),
            Toolpath(1),
            Toolpath(2),
            ToolChange(1),
            Hole(4),
            Hole(2),
            Toolpath(3),
            Finish,
        ];
        let program = program(&marks);
        let parts = parts(&program, &[0, 0, 3, 2]);
        let told: Vec<_> = parts
            .iter()
            .map(|part| (part.drills, part.bit, part.operation, part.from_leg, part.count))
            .collect();
        let expected = [
            (false, Some(0), Some(0), 2, 2),
            (false, Some(0), Some(3), 4, 1),
            (true, Some(1), None, 6, 2),
            (false, Some(1), Some(2), 8, 1),
        ];
        assert_eq!(told, expected);
        let rows = [
            (0, 0, 0),
            (2, 0, 0),
            (3, 0, 1),
            (4, 1, 0),
            (5, 1, 1),
            (6, 2, 0),
            (7, 2, 1),
            (8, 3, 0),
            (9, 3, 1),
        ];
        for (leg, at, done) in rows {
            assert_eq!(place(&program, &parts, leg), Some(LegPlace { at, done }), "leg {leg}");
        }
        assert_eq!(super::parts(&program, &[]).len(), 3, "without operations by bit and kind alone");
        assert_eq!(place(&program, &[], 3), None);
    }
}
