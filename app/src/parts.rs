//! The parts of a program: runs of holes or toolpaths of one operation with one tool.
//!
//! ```text
//! tool V · path path path │ tool 0.8 · hole hole │ tool 2.0 · path     three parts; "2 of 3: hole 1 of 2"
//! ```

use annulus_core::job::{Mark, Program};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WorkPart {
    /// True for drilling, false for milling.
    pub drills: bool,
    /// Index into the program's tools.
    pub bit: Option<u32>,
    /// The operation of its toolpaths, if known.
    pub operation: Option<u16>,
    pub from_leg: u32,
    /// Number of holes or toolpaths.
    pub count: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LegPlace {
    /// Index of the part.
    pub at: usize,
    /// Holes or toolpaths of the part before this leg.
    pub done: u32,
}

/// Holes and toolpaths of a job, each as (done, total).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorkCount {
    pub holes: (u32, u32),
    pub toolpaths: (u32, u32),
}

impl WorkCount {
    /// These counts if the machine has a job; else what the last job completed (`made`) of the totals in
    /// `shown`.
    pub fn or_ended(self, made: (u32, u32), shown: (u32, u32)) -> Self {
        if self.holes.1 + self.toolpaths.1 > 0 {
            return self;
        }
        Self { holes: (made.0, shown.0), toolpaths: (made.1, shown.1) }
    }

    /// Completed share, 0 to 1; none if the job has nothing to do.
    pub fn share(self) -> Option<f64> {
        let all = self.holes.1 + self.toolpaths.1;
        (all > 0).then(|| f64::from(self.holes.0 + self.toolpaths.0) / f64::from(all))
    }
}

/// The parts of `program`. `operations` has the operation of each toolpath, by index.
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

/// The position of leg `leg`; a leg before the first part counts as the start of that part.
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
    fn holes_and_toolpaths_are_counted_separately() {
        let told = |holes, toolpaths| WorkCount { holes, toolpaths };
        let rows = [
            // (reported by the machine, completed by the last job, planned total, shown, share)
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
    fn program_is_split_into_parts_by_tool_and_operation() {
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
