//! A moving slider: changes one value of a small board's isolation and recomputes everything that the page
//! would.
//!
//! ```text
//!   board ─ laid ─▶ scene ─ key ─▶ toolpaths around 60 islands ─ assemble ─ lower ─▶ program
//! ```

use annulus_core::board::{Board, Face};
use annulus_core::cam::PlanOptions;
use annulus_core::cam::toolpaths::{self, Means, PlacedBoard};
use annulus_core::cam::usual;
use annulus_core::cam::work::{Isolate, Operation, OperationKind, Work};
use annulus_core::geometry::Point;
use annulus_core::machine::Machine;
use annulus_core::motion;
use annulus_core::units::Length;

/// A board of 60 islands with its job: one groove around each.
pub struct Slider {
    board: Board,
    work: Work,
    machine: Machine,
}

impl Slider {
    pub fn new() -> Self {
        let machine = crate::machine();
        let action = OperationKind::Isolate(Isolate { passes: 1, ..Isolate::default() });
        let usual = Operation::usual("isolate", Face::Top);
        let operations = usual.into_iter().map(|operation| Operation { action: action.clone(), ..operation });
        let work = Work { bits: usual::usual_bits(), operations: operations.collect(), ..Work::default() };
        Self { board: crate::copper::cells(10, 6), work, machine }
    }

    /// Recomputes everything for another depth.
    pub fn moved_to(&self, depth_um: u32) -> usize {
        let mut work = self.work.clone();
        for operation in &mut work.operations {
            operation.depth = Length::from_um(i64::from(depth_um));
        }
        let scene = PlacedBoard::of(&self.board, &work);
        let options = PlanOptions::default();
        let rapid_time = |from: Point, to: Point| motion::rapid_time_s(&self.machine, from, to);
        let means = Means { options: &options, rapid_time: &rapid_time };
        // The page also computes this key, to look up its cache.
        std::hint::black_box(toolpaths::key(&work, 0, &self.machine));
        let part = toolpaths::plan_operation(&scene, &work, 0, &self.machine, &means, &mut |_| true);
        let Ok(part) = part else { return 0 };
        let planned = toolpaths::assemble(scene, &work, &self.machine, &means, vec![part]);
        planned.map_or(0, |(planned, _)| toolpaths::lower_work(&planned, &work, &self.machine).legs.len())
    }
}

impl Default for Slider {
    fn default() -> Self {
        Self::new()
    }
}
