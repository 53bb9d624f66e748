//! Compares the drilled holes with the program.
//!
//! ```text
//! program   ○   ○   ○   ○        vertical plunges through the board
//! record    ●   ●      ◉ ●●      holes in the simulated board
//!               missing ┘ │└ doubled
//!                 shifted ┘
//! ```

use super::VirtualHole;
use crate::geometry::Point;
use crate::job::{Command, Leg, Mark, Program};
use crate::machine::Machine;
use crate::units::Length;
use std::ops::Range;

/// Tolerance of a hole's position in addition to [`STEPS`], mm.
const BESIDE_MM: f64 = 0.02;

/// Tolerance in steps: both the hole and the homed zero are rounded to whole steps.
const STEPS: f64 = 1.5;

/// Differences between a board and its program. All zero if there are none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Holes of the program that are not in the board.
    pub missing: u32,
    /// Holes drilled again at a drilled position.
    pub doubled: u32,
    /// Holes at positions where the program has none.
    pub shifted: u32,
    pub broken: u32,
    /// Steps that motors lost.
    pub slipped_steps: u64,
}

impl Tally {
    pub fn is_clean(&self) -> bool {
        *self == Self::default()
    }
}

/// Holes of a run that the board already had.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Again {
    /// Holes of the leg at which the job resumed, by order of drilling from 1. Whether they existed was
    /// unknown, so they are no error.
    pub by_design: Vec<u32>,
    pub besides: u32,
}

/// A hole of the program: position from the work zero, and spindle.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wanted {
    x_mm: f64,
    y_mm: f64,
    spindle: u8,
    leg: usize,
    /// The leg was completed, so the hole must exist.
    certain: bool,
}

/// Compares `drilled` with the completed legs `done` of `program`, and the next leg, which may or may not
/// have made its hole. `zero_mm` is the work zero in machine coordinates.
pub fn tally(
    program: &Program,
    machine: &Machine,
    done: Range<usize>,
    zero_mm: [f64; 2],
    drilled: &[VirtualHole],
) -> Tally {
    let (wanted, made, shifted) = matched(program, machine, done, zero_mm, drilled);
    let missing = wanted.iter().zip(&made).filter(|(hole, made)| hole.certain && **made == 0).count();
    // A shifted hole also counts as missing at its planned position; count it once.
    let missing = u32::try_from(missing).unwrap_or(u32::MAX).saturating_sub(shifted);
    let doubled = made.iter().map(|made| made.saturating_sub(1)).sum();
    Tally { missing, doubled, shifted, broken: 0, slipped_steps: 0 }
}

/// Legs of `done` with a missing hole, in order. Empty if any hole is shifted, because the legs can't be
/// matched then.
pub fn missing_legs(
    program: &Program,
    machine: &Machine,
    done: Range<usize>,
    zero_mm: [f64; 2],
    drilled: &[VirtualHole],
) -> Vec<usize> {
    let (wanted, made, shifted) = matched(program, machine, done, zero_mm, drilled);
    let missing = wanted.iter().zip(&made).filter(|(hole, made)| hole.certain && **made == 0);
    let mut legs: Vec<usize> = missing.map(|(hole, _)| hole.leg).collect();
    legs.dedup();
    if shifted > 0 { Vec::new() } else { legs }
}

/// Holes of the legs `run` and the next one that `drilled` repeats although the board `before` had them. The
/// job resumed at the first of these legs.
pub fn made_again(
    program: &Program,
    machine: &Machine,
    run: Range<usize>,
    zero_mm: [f64; 2],
    before: &[VirtualHole],
    drilled: &[VirtualHole],
) -> Again {
    let (wanted, made_before, _) = matched(program, machine, 0..run.end, zero_mm, before);
    let (_, made, _) = matched(program, machine, run.clone(), zero_mm, drilled);
    let earlier = wanted.iter().take_while(|hole| hole.leg < run.start).count();
    let of_run = wanted.iter().zip(&made_before).skip(earlier).zip(&made);
    let twice = of_run.filter(|((_, before), made)| **before > 0 && **made > 0).map(|((hole, _), _)| hole);
    let mut again = Again::default();
    for hole in twice {
        if hole.leg == run.start {
            let legs = program.legs.iter().take(hole.leg + 1);
            let number = legs.filter(|leg| matches!(leg.mark, Mark::Hole(_))).count();
            again.by_design.push(u32::try_from(number).unwrap_or(u32::MAX));
        } else {
            again.besides += 1;
        }
    }
    again.by_design.dedup();
    again
}

fn matched(
    program: &Program,
    machine: &Machine,
    done: Range<usize>,
    zero_mm: [f64; 2],
    drilled: &[VirtualHole],
) -> (Vec<Wanted>, Vec<u32>, u32) {
    let mut wanted = wanted(program, machine, done);
    wanted
        .iter_mut()
        .for_each(|hole| (hole.x_mm, hole.y_mm) = (hole.x_mm + zero_mm[0], hole.y_mm + zero_mm[1]));
    let near_mm = |axis: usize| BESIDE_MM + STEPS / machine.axis(axis).scale.steps_per_mm().abs().max(1e-9);
    let near = [near_mm(0), near_mm(1)];
    let cells = Cells::new(&wanted, near);
    let mut made = vec![0_u32; wanted.len()];
    let mut shifted = 0;
    for hole in drilled {
        match cells.nearest(&wanted, hole, &made) {
            Some(index) => made[index] += 1,
            None => shifted += 1,
        }
    }
    (wanted, made, shifted)
}

/// The holes of the legs `done`, and of the leg after them.
fn wanted(program: &Program, machine: &Machine, done: Range<usize>) -> Vec<Wanted> {
    let in_use = machine.spindle_axes().filter(|axis| program.spindles >> (axis - 2) & 1 == 1);
    let in_use: Vec<usize> = in_use.collect();
    let z = &machine.z.scale;
    let mut wanted = Vec::new();
    let mut at = Point::default();
    for (index, leg) in program.legs.iter().enumerate().take(done.end.saturating_add(1)) {
        let (from, bottom) = (at, leg.bottom());
        for axis in &in_use {
            at = from;
            let own = machine.own(*axis);
            let surface = machine.process.surface + own.longer;
            let under = z.steps(surface - machine.process.board_thickness);
            let goes_to = |to: Length| surface + bottom.map_or(to, |bottom| own.height(to, bottom));
            let places = straight_down(leg, &mut at, &|to| z.steps(goes_to(to)) <= under);
            let hole = |place: Point| Wanted {
                x_mm: place.x.mm(),
                y_mm: place.y.mm(),
                spindle: (axis - 2) as u8,
                leg: index,
                certain: index < done.end,
            };
            if index >= done.start {
                wanted.extend(places.into_iter().map(hole));
            }
        }
    }
    wanted
}

fn straight_down(leg: &Leg, at: &mut Point, through: &impl Fn(Length) -> bool) -> Vec<Point> {
    let mut places = Vec::new();
    let (mut in_board, mut dragged, mut came_through) = (false, false, false);
    for command in &leg.commands {
        match *command {
            Command::Rapid { to } => *at = to,
            Command::Mill { to, height, .. } | Command::MillArc { to, height, .. } => {
                dragged |= in_board;
                (*at, in_board) = (to, height < Length::ZERO);
            }
            Command::Plunge { to, .. } => {
                if through(to) && !dragged && !came_through {
                    places.push(*at);
                    came_through = true;
                }
                in_board |= to < Length::ZERO;
            }
            Command::Retract { to } if to >= Length::ZERO => {
                (in_board, dragged, came_through) = (false, false, false);
            }
            Command::Retract { .. }
            | Command::Dwell { .. }
            | Command::Spindle { .. }
            | Command::AwaitBit { .. } => {}
        }
    }
    places
}

/// The wanted holes in a square grid, for fast lookup.
struct Cells {
    size: [f64; 2],
    /// Square (x, y), spindle and index, sorted.
    rows: Vec<(i64, i64, u8, usize)>,
}

impl Cells {
    fn new(wanted: &[Wanted], size: [f64; 2]) -> Self {
        let mut cells = Self { size, rows: Vec::new() };
        let row = |(index, hole): (usize, &Wanted)| {
            let (x, y) = cells.square(hole.x_mm, hole.y_mm);
            (x, y, hole.spindle, index)
        };
        let mut rows: Vec<_> = wanted.iter().enumerate().map(row).collect();
        rows.sort_unstable();
        cells.rows = rows;
        cells
    }

    fn square(&self, x_mm: f64, y_mm: f64) -> (i64, i64) {
        (libm::floor(x_mm / self.size[0]) as i64, libm::floor(y_mm / self.size[1]) as i64)
    }

    /// The wanted hole nearest to `hole`, for its spindle and within tolerance. Prefers one that is not
    /// drilled yet.
    fn nearest(&self, wanted: &[Wanted], hole: &VirtualHole, made: &[u32]) -> Option<usize> {
        let (x, y) = self.square(hole.x_mm, hole.y_mm);
        // Cells are as large as the tolerance, so the adjacent ones suffice.
        let around = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (x + dx, y + dy)));
        let within = around.flat_map(|(x, y)| {
            let first = self.rows.partition_point(|row| (row.0, row.1, row.2) < (x, y, hole.spindle));
            let same = move |row: &&(i64, i64, u8, usize)| (row.0, row.1, row.2) == (x, y, hole.spindle);
            self.rows.iter().skip(first).take_while(same).map(|row| row.3)
        });
        let off = |index: usize| wanted.get(index).map(|want| [want.x_mm - hole.x_mm, want.y_mm - hole.y_mm]);
        let near = within.filter_map(|index| {
            let [x, y] = off(index)?;
            let is_near = x.abs() <= self.size[0] && y.abs() <= self.size[1];
            is_near.then_some((made.get(index).copied().unwrap_or(0), x * x + y * y, index))
        });
        near.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))).map(|(.., index)| index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::Mark;
    use crate::machine::virtual_drill;

    fn program(machine: &Machine) -> Program {
        let deep = -(machine.process.board_thickness + machine.process.breakthrough);
        let plunge = |to| Command::Plunge { to, feed_um_per_s: 1_000, gate: None };
        let up = Command::Retract { to: machine.process.safe_height };
        let hole = |x: f64| Leg {
            mark: Mark::Hole(0),
            commands: vec![
                Command::Rapid { to: Point::from_mm(x, 1.0) },
                plunge(Length::from_mm(-0.5)),
                up,
                plunge(deep),
                up,
            ],
        };
        let mill =
            |x: f64, height| Command::Mill { to: Point::from_mm(x, 9.0), height, feed_um_per_s: 1_000 };
        // Straight through at 20 and on to 25; sloping down from 30, and deeper at 35.
        let milled = Leg {
            mark: Mark::Toolpath(0),
            commands: vec![
                Command::Rapid { to: Point::from_mm(20.0, 9.0) },
                plunge(deep),
                mill(25.0, deep),
                up,
                Command::Rapid { to: Point::from_mm(30.0, 9.0) },
                plunge(Length::from_mm(-0.2)),
                mill(35.0, deep),
                plunge(deep),
                up,
            ],
        };
        Program {
            name: String::new(),
            machine: String::new(),
            origin: Point::default(),
            bits: vec![],
            spindles: 1,
            safe_height: machine.process.safe_height,
            legs: vec![hole(1.0), hole(2.0), milled, hole(3.0)],
            accepted: vec![],
        }
    }

    fn at(x_mm: f64, y_mm: f64) -> VirtualHole {
        VirtualHole { x_mm: x_mm + 5.0, y_mm: y_mm + 7.0, depth_mm: 1.8, tick: 0, spindle: 0, bit_mm: None }
    }

    fn found(done: Range<usize>, drilled: &[VirtualHole]) -> [u32; 3] {
        let machine = virtual_drill();
        let tally = tally(&program(&machine), &machine, done, [5.0, 7.0], drilled);
        [tally.missing, tally.doubled, tally.shifted]
    }

    #[test]
    fn every_difference_from_the_program_is_counted_once() {
        let good = [at(1.0, 1.0), at(2.01, 0.99), at(20.0, 9.0), at(3.0, 1.0)];
        assert_eq!(found(0..4, &good), [0, 0, 0]);
        assert_eq!(found(0..4, &good[..2]), [2, 0, 0], "two are missing");
        let twice = [good[0], good[1], good[1], good[2], good[3]];
        assert_eq!(found(0..4, &twice), [0, 1, 0]);
        let elsewhere = [good[0], at(2.1, 1.0), good[2], good[3]];
        assert_eq!(found(0..4, &elsewhere), [0, 0, 1], "elsewhere, so not missing");
        let too_many = [good[0], good[1], good[2], good[3], at(8.0, 8.0)];
        assert_eq!(found(0..4, &too_many), [0, 0, 1]);
        let other_spindle = VirtualHole { spindle: 1, ..good[0] };
        assert_eq!(found(0..4, &[other_spindle, good[1], good[2], good[3]]), [0, 0, 1]);
    }

    #[test]
    fn hole_drilled_again_is_expected_only_at_the_resume() {
        let machine = virtual_drill();
        let again = |run: Range<usize>, before: &[VirtualHole], drilled: &[VirtualHole]| {
            let found = made_again(&program(&machine), &machine, run, [5.0, 7.0], before, drilled);
            (found.by_design, found.besides)
        };
        let [one, two, way, three] = [at(1.0, 1.0), at(2.0, 1.0), at(20.0, 9.0), at(3.0, 1.0)];
        assert_eq!(again(1..4, &[one], &[two, way, three]), (vec![], 0), "nothing was repeated");
        assert_eq!(again(1..4, &[one, two], &[two, way, three]), (vec![2], 0), "the one it went on with");
        assert_eq!(
            again(1..4, &[one, two, three], &[two, way, three]),
            (vec![2], 1),
            "and one that it did not"
        );
        assert_eq!(again(1..4, &[one, two, three], &[two, way]), (vec![2], 0), "not made this time");
        assert_eq!(again(1..4, &[at(8.0, 8.0), one], &[two]), (vec![], 0), "something else on the table");
        let mut twice = program(&machine);
        twice.legs.insert(1, twice.legs[0].clone());
        let found = made_again(&twice, &machine, 1..5, [5.0, 7.0], &[one], &[one, two]);
        assert_eq!(found, Again::default(), "the program asks for it twice");
    }

    #[test]
    fn missing_legs_are_named_unless_holes_are_misplaced() {
        let machine = virtual_drill();
        let legs =
            |drilled: &[VirtualHole]| missing_legs(&program(&machine), &machine, 0..4, [5.0, 7.0], drilled);
        let good = [at(1.0, 1.0), at(2.0, 1.0), at(20.0, 9.0), at(3.0, 1.0)];
        assert_eq!(legs(&good), [0_usize; 0]);
        assert_eq!(legs(&good[..1]), [1, 2, 3]);
        assert_eq!(legs(&[good[0], good[2]]), [1, 3]);
        assert_eq!(legs(&[good[0], at(8.0, 8.0)]), [0_usize; 0]);
    }

    #[test]
    fn only_executed_legs_count() {
        assert_eq!(found(1..2, &[at(2.0, 1.0)]), [0, 0, 0]);
        assert_eq!(found(1..2, &[at(2.0, 1.0), at(20.0, 9.0)]), [0, 0, 0], "stopped at the bottom");
        assert_eq!(found(1..2, &[at(20.0, 9.0)]), [1, 0, 0]);
        assert_eq!(found(1..2, &[at(2.0, 1.0), at(3.0, 1.0)]), [0, 0, 1], "that leg was not begun");
        assert_eq!(found(0..0, &[]), [0, 0, 0]);
    }
}
