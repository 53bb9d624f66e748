//! Which bit drills which hole (S5, N9): each size goes to the nearest bit one owns, if it is within tolerance.
//!
//! ```text
//!   file sizes   0.79  0.80  0.82        1.00        4.00
//!                  \    |    /            |            ✗  no bit within tolerance: a loss
//!   rack          [   0.80   ]         [ 1.00 ]
//! ```
//!
//! Comes in: a board and a machine's rack. Goes out: bits with their holes, and what cannot be drilled. Does not know
//! the order of drilling.

use super::places::{Places, Twice};
use crate::board::Board;
use crate::job::{Bit, Cutter};
use crate::locale;
use crate::machine::{Machine, Process};
use crate::remark::{Remark, Weight};
use crate::units::Length;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// A bit and what it is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BitUse {
    /// Diameter of the bit.
    pub bit: Length,
    /// The sizes in the files that it stands in for, ascending.
    pub sizes: Vec<Length>,
    /// The holes, as indices into the board's holes, in file order.
    pub holes: Vec<u32>,
}

/// A size in millimetres as people write it: without trailing zeros.
pub fn size_text(size: Length) -> String {
    format!("{}", size.mm())
}

/// The drill of this size; it is called what it is.
pub fn drill(diameter: Length) -> Bit {
    let unnamed = Bit { diameter, name: String::new(), cutter: Cutter::Drill };
    Bit { name: unnamed.title(locale::FALLBACK), ..unnamed }
}

/// How deep the drill of `diameter` goes below the surface so that its whole width comes `below` under the board:
///
/// ```text
///     surface ──┐     ┌──
///               │     │        the board + `below`, and by the height of the point more:
///     bottom  ──┤     ├──      diameter / 2 / tan(point / 2)
///               ╲     ╱
///                ╲___╱
/// ```
pub(super) fn through(process: &Process, below: Length, diameter: Length, point_deg: f64) -> Length {
    process.board_thickness + below + point_height(diameter, point_deg)
}

/// How high the point of a drill is: so much deeper it goes before its whole width is through. `point_deg` is the whole
/// angle in degrees; 180 is flat.
fn point_height(diameter: Length, point_deg: f64) -> Length {
    let half = (point_deg / 2.0).clamp(1.0, 90.0) * PI / 180.0;
    if point_deg >= 180.0 { Length::ZERO } else { Length::from_mm(diameter.mm() / 2.0 / libm::tan(half)) }
}

/// The bit of `rack` nearest to `size` within `tolerance` (the bound included); of two equally near the larger, because
/// a wire still fits.
pub fn nearest(rack: &[Length], size: Length, tolerance: Length) -> Option<Length> {
    let within = rack.iter().copied().filter(|&bit| (bit - size).abs() <= tolerance);
    within.min_by_key(|&bit| ((bit - size).abs(), -bit))
}

/// Bits ascending with their holes. Holes without a bit or without a size, and slots, are in no bit's list and told as
/// losses. Of holes at the same place that the same bit makes only the first is in its list; a note tells of the others.
pub fn assign(board: &Board, machine: &Machine) -> (Vec<BitUse>, Vec<Remark>) {
    let mut by_size: BTreeMap<Length, Vec<u32>> = BTreeMap::new();
    let mut unsized_holes = 0_usize;
    for (index, hole) in (0..).zip(&board.holes) {
        match hole.diameter {
            Some(size) => by_size.entry(size).or_default().push(index),
            None => unsized_holes += 1,
        }
    }
    let mut bits: BTreeMap<Length, BitUse> = BTreeMap::new();
    let mut without = Vec::new();
    for (size, holes) in by_size {
        let Some(bit) = nearest(&machine.rack, size, machine.rack_tolerance) else {
            without.push((size, holes.len()));
            continue;
        };
        let entry = bits.entry(bit).or_insert_with(|| BitUse { bit, sizes: Vec::new(), holes: Vec::new() });
        entry.sizes.push(size);
        entry.holes.extend(holes);
    }
    let mut bits: Vec<BitUse> = bits.into_values().collect();
    let twice = once(board, &mut bits);
    let rack = (machine.rack.as_slice(), machine.rack_tolerance);
    let mut remarks = losses(&without, unsized_holes, board.slots.len(), rack);
    remarks.extend(twice.note("plan.holes_twice"));
    (bits, remarks)
}

/// Puts the holes of every bit in file order, each place once; what came again.
fn once(board: &Board, bits: &mut [BitUse]) -> Twice {
    let (mut places, mut twice) = (Places::default(), Twice::default());
    for BitUse { bit, holes, .. } in bits {
        holes.sort_unstable();
        holes.retain(|&hole| {
            let at = board.holes.get(hole as usize).map(|hole| hole.at).unwrap_or_default();
            let again = places.again(*bit, at, Length::ZERO);
            if again {
                twice.add(at);
            }
            !again
        });
    }
    twice
}

/// Sizes that are told one by one.
const MOST_SIZES: usize = 40;

/// Holes of sizes `without` a bit of the rack within its tolerance, holes without a size, and slots, as losses.
pub(super) fn losses(
    without: &[(Length, usize)],
    unsized_holes: usize,
    slots: usize,
    (rack, tolerance): (&[Length], Length),
) -> Vec<Remark> {
    let mut remarks = Vec::new();
    if !without.is_empty() {
        let told = |(size, holes): &(Length, usize)| match nearest(rack, *size, Length::from_nm(i64::MAX)) {
            Some(bit) => format!("{} mm ({holes}; {} mm)", size_text(*size), size_text(bit)),
            None => format!("{} mm ({holes})", size_text(*size)),
        };
        let mut sizes: Vec<String> = without.iter().take(MOST_SIZES).map(told).collect();
        sizes.extend((without.len() > MOST_SIZES).then(|| "…".to_owned()));
        let holes: usize = without.iter().map(|(_, holes)| holes).sum();
        let remark =
            Remark::new(Weight::Loss, "plan.no_bit").with("holes", holes).with("sizes", sizes.join(", "));
        remarks.push(remark.with("tolerance", size_text(tolerance)));
    }
    if unsized_holes > 0 {
        remarks.push(Remark::new(Weight::Loss, "plan.no_size").with("holes", unsized_holes));
    }
    if slots > 0 {
        remarks.push(Remark::new(Weight::Loss, "plan.slots_not_drilled").with("slots", slots));
    }
    remarks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::{Hole, Slot};
    use crate::geometry::Point;
    use crate::machine::virtual_drill;

    fn um(value: i64) -> Length {
        Length::from_um(value)
    }

    #[test]
    fn each_size_finds_its_bit() {
        let rack = [800, 900, 1000, 3200].map(um);
        // size, tolerance, expected bit; all in µm
        let rows = [
            (800, 0, Some(800)),
            (801, 0, None),
            (850, 50, Some(900)), // a tie goes to the larger
            (849, 50, Some(800)),
            (851, 50, Some(900)),
            (750, 50, Some(800)), // the bound is inside
            (749, 50, None),
            (3250, 50, Some(3200)),
            (3251, 50, None),
            (1500, 100, None),
            (1500, 600, Some(1000)),
        ];
        for (size, tolerance, bit) in rows {
            assert_eq!(nearest(&rack, um(size), um(tolerance)), bit.map(um), "{size} ± {tolerance}");
        }
        assert_eq!(nearest(&[], um(800), um(50)), None);
    }

    #[test]
    fn a_drill_goes_deeper_by_the_height_of_its_point() {
        let process = virtual_drill().process;
        // Diameter and what is below the board in µm, angle, and the height of the point in µm.
        let rows = [
            (1_000, 500, 90.0, 500),
            (3_200, 500, 130.0, 746),
            (3_200, 0, 118.0, 961),
            (800, 6_000, 180.0, 0),
            (0, 500, 130.0, 0),
        ];
        for (diameter, below, degrees, height) in rows {
            let depth = through(&process, um(below), um(diameter), degrees);
            let over = (depth - process.board_thickness - um(below)).mm() * 1e3;
            assert_eq!(libm::round(over) as i64, height, "{diameter} {degrees}");
        }
    }

    #[test]
    fn sizes_share_a_bit_and_what_has_none_is_told() {
        let hole = |diameter: Option<i64>| Hole {
            at: Point::default(),
            diameter: diameter.map(um),
            plated: None,
            source: 0,
            tool_code: 1,
            line: 1,
        };
        let slot = Slot {
            path: vec![Point::default(); 2],
            width: None,
            plated: None,
            source: 0,
            tool_code: 1,
            line: 1,
        };
        let board = Board {
            holes: [Some(1020), Some(800), Some(4000), None, Some(780), Some(1000), Some(4000)]
                .map(hole)
                .into_iter()
                .zip(0..)
                .map(|(hole, place)| Hole { at: Point::new(um(place * 5_000), um(0)), ..hole })
                .collect(),
            slots: vec![slot],
            ..Board::default()
        };
        let (bits, remarks) = assign(&board, &virtual_drill());
        let found: Vec<_> = bits.iter().map(|b| (b.bit, b.sizes.clone(), b.holes.clone())).collect();
        assert_eq!(
            found,
            [(um(800), vec![um(780), um(800)], vec![1, 4]), (um(1000), vec![um(1000), um(1020)], vec![0, 5]),]
        );
        let codes: Vec<_> = remarks.iter().map(|r| (r.weight, r.code.as_str())).collect();
        assert_eq!(
            codes,
            ["plan.no_bit", "plan.no_size", "plan.slots_not_drilled"].map(|code| (Weight::Loss, code))
        );
        assert!(remarks[0].message("en").contains("4 mm (2; 3.2 mm)"), "{}", remarks[0].message("en"));
    }

    #[test]
    fn a_hole_that_two_files_have_is_drilled_once() {
        let hole = |x: i64, size: i64, source: u32| Hole {
            at: Point::new(um(x), um(0)),
            diameter: Some(um(size)),
            plated: None,
            source,
            tool_code: 1,
            line: 1,
        };
        let holes = [(0, 800, 0), (5_000, 800, 0), (5_000, 800, 0), (0, 800, 1), (1, 790, 1), (0, 1_000, 1)];
        let board =
            Board { holes: holes.map(|(x, size, file)| hole(x, size, file)).to_vec(), ..Board::default() };
        let (bits, remarks) = assign(&board, &virtual_drill());
        let found: Vec<_> = bits.iter().map(|bit| (bit.bit, bit.holes.clone())).collect();
        assert_eq!(found, [(um(800), vec![0, 1]), (um(1000), vec![5])]);
        let [note] = remarks.as_slice() else { panic!("{remarks:?}") };
        assert_eq!((note.weight, note.code.as_str()), (Weight::Note, "plan.holes_twice"));
        assert_eq!(note.args[0].1, "3");
        assert!(note.message("en").contains("3 holes"), "{}", note.message("en"));
    }
}
