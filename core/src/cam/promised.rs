//! What a job promises of the copper of a side: what the proof of its programs is measured against.
//!
//! Comes in: a [`Work`], a side. Goes out: [`Promised`]. Does not know how anything is proved.

use super::work::{Action, Lines, Operation, Remedy, Work};
use crate::board::{COPPER_THICKNESS, Face};
use crate::geometry::Point;
use crate::job::{Cleared, Cutter, Promised};
use crate::units::Length;

impl Work {
    /// What the operations on `face` promise.
    pub fn promised(&self, face: Face) -> Promised {
        Promised {
            owned: self.bits.clone(),
            agreed: self.agreed(face),
            cleared: self.cleared(face),
            isolates: Some(self.on(face).any(|operation| separates(&operation.action))),
        }
    }

    /// The operations on `face` that are done.
    fn on(&self, face: Face) -> impl Iterator<Item = &Operation> {
        self.operations.iter().filter(move |operation| operation.on && operation.face == face)
    }

    fn agreed(&self, face: Face) -> Vec<(Point, Point)> {
        let cures = self.on(face).flat_map(|operation| match &operation.action {
            Action::Isolate(isolate) => isolate.cures.as_slice(),
            _ => &[],
        });
        cures.filter(|cure| cure.with == Remedy::Centred).map(|cure| (cure.from, cure.to)).collect()
    }

    /// Nothing where zones keep bits out. Bits that there are not are left out.
    fn cleared(&self, face: Face) -> Vec<Cleared> {
        let here = self.on(face).filter(|_| self.setup.exclusions.is_empty());
        let cleared = here.filter_map(|operation| {
            let Action::Clear(clear) = &operation.action else { return None };
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

/// Whether this is to separate nets.
fn separates(action: &Action) -> bool {
    match action {
        Action::Isolate(_) | Action::Clear(_) => true,
        Action::Engrave(engrave) => engrave.of == Lines::Copper,
        Action::Drill(_) | Action::MillHoles(_) | Action::CutOut(_) => false,
    }
}
