//! Requirements that a job sets for its proof: copper of a side, and holes, slots and edges of the board.

use super::work::{CutOut, CutSide, Holes, Lines, Operation, OperationKind, Remedy, Work};
use crate::board::{COPPER_THICKNESS, Face};
use crate::geometry::Point;
use crate::job::{Asked, AskedEdge, Cleared, Cutter, Promised};
use crate::machine::Machine;
use crate::units::Length;

impl Work {
    /// Requirements of the operations on `face`.
    pub fn promised(&self, face: Face) -> Promised {
        Promised {
            owned: self.bits.clone(),
            agreed: self.agreed(face),
            cleared: self.cleared(face),
            isolates: Some(self.on(face).any(|operation| separates(&operation.action))),
        }
    }

    /// Requirements of the operations on `faces` other than copper, for a board of this thickness on
    /// `machine`.
    pub fn asked(&self, faces: &[Face], thickness: Length, machine: &Machine) -> Asked {
        let reach = |operation: &Operation| match operation.depth {
            depth if depth > Length::ZERO => depth.min(thickness),
            _ => thickness,
        };
        let mut asked = Asked {
            holes: Some(false),
            slots: Some(false),
            tolerance: Length::ZERO,
            ..Asked::nothing(thickness)
        };
        let (mut drilled, mut milled): (Option<Length>, Option<Length>) = (None, None);
        for operation in faces.iter().flat_map(|face| self.on(*face)) {
            match &operation.action {
                OperationKind::Drill(drill) if drill.holes == Holes::Board => {
                    asked.holes = Some(true);
                    asked.tolerance = asked.tolerance.max(drill.tolerance_on(machine));
                    drilled = drilled.max(Some(reach(operation)));
                }
                OperationKind::Drill(_) => asked.pins = true,
                OperationKind::MillHoles(mill) => {
                    asked.holes = asked.holes.max(Some(mill.holes));
                    asked.slots = asked.slots.max(Some(mill.slots));
                    milled = milled.max(Some(reach(operation)));
                }
                OperationKind::CutOut(cut_out) => {
                    asked.cut_out = Some(self.edge(operation, cut_out, reach(operation)));
                }
                OperationKind::Isolate(_) | OperationKind::Clear(_) | OperationKind::Engrave(_) => {}
            }
        }
        if asked.tolerance == Length::ZERO {
            asked.tolerance = Asked::TOLERANCE;
        }
        Asked { drilled: drilled.unwrap_or(thickness), milled: milled.unwrap_or(thickness), ..asked }
    }

    fn edge(&self, operation: &Operation, cut_out: &CutOut, depth: Length) -> AskedEdge {
        let widest =
            operation.bit_names().into_iter().filter_map(|name| self.bit(name)).map(|bit| bit.diameter).max();
        let tab = (cut_out.tab_width + widest.unwrap_or_default()).nm();
        let tabs = i64::from(cut_out.tabs).max(cut_out.tab_at.len() as i64);
        let by_hand = cut_out.tab_at.len() as u32;
        let left = if by_hand > 0 { by_hand } else { cut_out.tabs };
        let holds = cut_out.bites || cut_out.tab_height > Length::ZERO;
        let main = self.bit(&operation.bit).map(|bit| bit.diameter);
        AskedEdge {
            depth,
            on_line: cut_out.side == CutSide::On,
            spared: Length::from_nm(tab.saturating_mul(tabs)),
            zones: !self.setup.exclusions.is_empty(),
            bit: main.or(widest).unwrap_or_default(),
            bites: cut_out.bites,
            tabs: if holds { left } else { 0 },
            tabs_together: by_hand > 0,
            tab_width: cut_out.tab_width,
        }
    }

    /// The active operations on `face`.
    fn on(&self, face: Face) -> impl Iterator<Item = &Operation> {
        self.operations.iter().filter(move |operation| operation.on && operation.face == face)
    }

    fn agreed(&self, face: Face) -> Vec<(Point, Point)> {
        let cures = self.on(face).flat_map(|operation| match &operation.action {
            OperationKind::Isolate(isolate) => isolate.cures.as_slice(),
            _ => &[],
        });
        cures.filter(|cure| cure.with == Remedy::Centred).map(|cure| (cure.from, cure.to)).collect()
    }

    /// Empty if zones block tools. Unknown tools are skipped.
    fn cleared(&self, face: Face) -> Vec<Cleared> {
        let here = self.on(face).filter(|_| self.setup.exclusions.is_empty());
        let cleared = here.filter_map(|operation| {
            let OperationKind::Clear(clear) = &operation.action else { return None };
            let depth = if operation.depth > Length::ZERO { operation.depth } else { Length::LIMIT };
            let bits = operation.bit_names().into_iter().filter_map(|name| self.bit(name));
            let mills = bits.filter(|bit| bit.cutter != Cutter::Drill);
            let kept = (clear.margin, self.setup.margin);
            mills
                .filter_map(|bit| Cleared::by(bit, depth, COPPER_THICKNESS, kept))
                .min_by_key(|cut| cut.surface)
        });
        cleared.collect()
    }
}

/// True if the operation must separate nets.
fn separates(action: &OperationKind) -> bool {
    match action {
        OperationKind::Isolate(_) | OperationKind::Clear(_) => true,
        OperationKind::Engrave(engrave) => engrave.of == Lines::Copper,
        OperationKind::Drill(_) | OperationKind::MillHoles(_) | OperationKind::CutOut(_) => false,
    }
}
