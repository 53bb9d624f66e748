//! The spindles of a machine with several: which ones drill, how deep, and how long each tip takes to reach
//! the board.

use annulus_core::job::{Command, Leg, Mark, Program};
use annulus_core::machine::Machine;
use annulus_core::motion::drill_cycles;
use annulus_core::units::Length;

/// The bottom of a hole relative to the board surface, and the plunge feed in µm/s.
type Hole = (Length, u32);

#[derive(Clone, Debug, PartialEq)]
pub struct SpindleInHole {
    /// Z1 to Z6.
    pub name: String,
    /// True if it drills in this job.
    pub drills: bool,
    pub depth_mm: f64,
    /// t_z: time from the top until the tip touches the board, ms.
    pub contact_ms: Option<f64>,
}

fn hole_of(leg: &Leg) -> Option<Hole> {
    let plunges = leg.commands.iter().filter(|_| matches!(leg.mark, Mark::Hole(_)));
    let depths = plunges.filter_map(|command| match *command {
        Command::Plunge { to, feed_um_per_s, .. } => Some((to, feed_um_per_s)),
        _ => None,
    });
    depths.min_by_key(|(to, _)| *to)
}

/// The current hole: that of `leg`, else the next one, else the first of the program.
pub fn hole_in_work(program: &Program, leg: usize) -> Option<Hole> {
    program.legs.iter().skip(leg).find_map(hole_of).or_else(|| program.legs.iter().find_map(hole_of))
}

/// The spindles of `machine` in `hole`, or in a through hole if none. `drilling` is a bit mask of the
/// spindles that the job uses.
pub fn in_hole(machine: &Machine, hole: Option<Hole>, drilling: u8) -> Vec<SpindleInHole> {
    let process = &machine.process;
    let through = Length::ZERO - process.board_thickness - process.breakthrough;
    let (bottom, feed_mm_per_s) = match hole {
        Some((bottom, feed_um_per_s)) => (bottom, f64::from(feed_um_per_s) / 1e3),
        None => (through, process.feed_mm_per_s),
    };
    let spindle = |axis: usize| SpindleInHole {
        name: format!("Z{}", axis - 1),
        drills: machine.enabled & drilling & 1 << (axis - 2) != 0,
        depth_mm: -machine.own(axis).height(bottom, bottom).mm(),
        contact_ms: drill_cycles::in_hole(machine, axis, bottom, feed_mm_per_s)
            .ok()
            .map(|(times, ..)| times.contact_s * 1e3),
    };
    machine.spindle_axes().map(spindle).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::geometry::Point;
    use annulus_core::machine::{Value, apply, six_spindles};

    #[test]
    fn each_spindle_has_its_depth_and_contact_time() {
        let list = |key: &str, numbers: &[f64]| (key.to_owned(), Value::Numbers(numbers.to_vec()));
        let changes = [list("spindle.deeper", &[0.0, 0.3]), list("spindle.enabled", &[1.0, 1.0, 0.0])];
        let machine = apply(&six_spindles(), &changes).unwrap();
        let mm = Length::from_mm;
        let plunge = |to: f64, feed_um_per_s| Command::Plunge { to: mm(to), feed_um_per_s, gate: None };
        let pecked = vec![plunge(-0.6, 9_000), plunge(-1.2, 9_000), Command::Retract { to: mm(2.0) }];
        let legs = vec![
            Leg { mark: Mark::Prepare, commands: vec![plunge(-9.0, 1)] },
            Leg { mark: Mark::Hole(0), commands: pecked },
            Leg { mark: Mark::Hole(1), commands: vec![plunge(-2.0, 3_000)] },
        ];
        let program = Program {
            name: String::new(),
            machine: String::new(),
            origin: Point::default(),
            bits: Vec::new(),
            spindles: 1,
            safe_height: mm(2.0),
            legs,
            accepted: Vec::new(),
        };
        let rows = [(0, Some((mm(-1.2), 9_000))), (2, Some((mm(-2.0), 3_000))), (9, Some((mm(-1.2), 9_000)))];
        for (leg, hole) in rows {
            assert_eq!(hole_in_work(&program, leg), hole, "leg {leg}");
        }
        let own = |hole| in_hole(&machine, hole, 0b1_1111);
        let (fast, slow, through) = (own(Some((mm(-1.2), 9_000))), own(Some((mm(-1.2), 3_000))), own(None));
        let drill: Vec<bool> = fast.iter().map(|spindle| spindle.drills).collect();
        assert_eq!(drill, [true, true, false, true, true, false], "Z3 is off, Z6 is not of the job");
        let depths_mm: Vec<f64> = fast.iter().take(3).map(|spindle| spindle.depth_mm).collect();
        assert_eq!(depths_mm, [1.2, 1.5, 1.2]);
        let process = &machine.process;
        assert_eq!(through[0].depth_mm, (process.board_thickness + process.breakthrough).mm());
        let ms = |spindles: &[SpindleInHole], at: usize| spindles[at].contact_ms.unwrap();
        assert!(ms(&slow, 0) > ms(&fast, 0) && ms(&fast, 0) > 1.0, "{fast:?} {slow:?}");
        assert_eq!(fast[0].name, "Z1");
    }
}
