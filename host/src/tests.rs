//! Boards for the tests: holes on a grid, planned as usual.

use annulus_core::board::{Board, Hole};
use annulus_core::cam::toolpaths::{Means, lower_work, plan_work};
use annulus_core::cam::work::Work;
use annulus_core::cam::{HoleOrder, PlanOptions};
use annulus_core::geometry::Point;
use annulus_core::job::Program;
use annulus_core::machine::Machine;
use annulus_core::motion;
use annulus_core::units::Length;

/// `count` holes, 2.5 mm apart, in rows of `columns`; `diameter` gives each hole's diameter in µm.
pub(crate) fn holes(
    machine: &Machine,
    count: usize,
    columns: usize,
    diameter_um: fn(usize) -> i64,
) -> Program {
    let hole = |n: usize| Hole {
        at: Point::from_mm((n % columns) as f64 * 2.5 + 1.0, (n / columns) as f64 * 2.5 + 1.0),
        diameter: Some(Length::from_um(diameter_um(n))),
        plated: None,
        source: 0,
        tool_code: 1,
        line: 1,
    };
    let board = Board { holes: (0..count).map(hole).collect(), ..Board::default() };
    let work = Work::drilling(&board, machine, HoleOrder::Shortest);
    let rapid_time = |from, to| motion::rapid_time_s(machine, from, to);
    let means = Means { options: &PlanOptions::default(), rapid_time: &rapid_time };
    let planned = plan_work(&board, &work, machine, &means, &mut |_| true).unwrap().0;
    lower_work(&planned, &work, machine)
}
