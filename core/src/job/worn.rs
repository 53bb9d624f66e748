//! Tool wear by a program: drilled holes and milled distance.
//!
//! ```text
//! leg 1  hole 17     1 hole              leg 2  toolpath 4     its length at or below the surface
//! ```

use super::{Command, Mark, Program, milled_mm};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wear {
    pub hits: u64,
    /// Milled distance, µm.
    pub milled_um: u64,
}

impl Wear {
    /// True if there is no wear.
    pub fn is_nothing(self) -> bool {
        self == Self::default()
    }

    #[must_use]
    pub fn plus(self, more: Self) -> Self {
        Self {
            hits: self.hits.saturating_add(more.hits),
            milled_um: self.milled_um.saturating_add(more.milled_um),
        }
    }
}

/// For each leg of `program`, its bit (0 before the first tool change) and its wear.
pub fn by_leg(program: &Program) -> Vec<(u32, Wear)> {
    let mut bit = 0;
    let legs = program.legs.iter().zip(milled_mm(program)).map(|(leg, mm)| {
        let awaited = leg.commands.iter().rev().find_map(|command| match command {
            Command::AwaitBit { bit } => Some(*bit),
            _ => None,
        });
        bit = awaited.unwrap_or(bit);
        let hits = u64::from(matches!(leg.mark, Mark::Hole(_)));
        (bit, Wear { hits, milled_um: libm::round(mm * 1e3) as u64 })
    });
    legs.collect()
}

/// Wear of each bit of `program` from leg `from` on.
pub fn by_bit(program: &Program, from: usize) -> Vec<Wear> {
    let mut bits = vec![Wear::default(); program.bits.len()];
    for (bit, wear) in by_leg(program).into_iter().skip(from) {
        if let Some(sum) = bits.get_mut(bit as usize) {
            *sum = sum.plus(wear);
        }
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::job::{Bit, Cutter, Leg};
    use crate::units::Length;

    #[test]
    fn wear_counts_holes_and_toolpath_length() {
        let mm = Length::from_mm;
        let change = |bit| Leg { mark: Mark::ToolChange(bit), commands: vec![Command::AwaitBit { bit }] };
        let start = Command::Rapid { to: Point::from_mm(0.0, 0.0) };
        let down = Command::Plunge { to: mm(-1.0), feed_um_per_s: 1, gate: None };
        let along = Command::Mill { to: Point::from_mm(3.0, 4.0), height: mm(-1.0), feed_um_per_s: 1 };
        let up = Command::Retract { to: mm(2.0) };
        let hole = |hole| Leg { mark: Mark::Hole(hole), commands: vec![start, down, up, down, up] };
        let way = Leg { mark: Mark::Toolpath(0), commands: vec![start, down, along, up] };
        let bit =
            |cutter| Bit { diameter: mm(1.0), name: String::new(), cutter, handling: Default::default() };
        let legs = vec![change(0), hole(0), hole(1), change(1), way.clone(), way, hole(2)];
        let bits = vec![bit(Cutter::Drill), bit(Cutter::Mill)];
        let program = Program { bits, ..Program::of_legs(legs) };
        let wear = |hits, milled_um| Wear { hits, milled_um };
        let rows = [
            (0, [wear(2, 0), wear(1, 10_000)]),
            (2, [wear(1, 0), wear(1, 10_000)]),
            (5, [wear(0, 0), wear(1, 5_000)]),
            (9, [wear(0, 0), wear(0, 0)]),
        ];
        for (from, wanted) in rows {
            assert_eq!(by_bit(&program, from), wanted, "from leg {from}");
        }
        assert_eq!(by_leg(&program).iter().filter(|(_, wear)| !wear.is_nothing()).count(), 5);
    }
}
