//! Assigns holes to drills: each size gets the nearest available drill within the tolerance.
//!
//! ```text
//!   file sizes   0.79  0.80  0.82        1.00        4.00
//!                  \    |    /            |            ✗  no drill within tolerance: an error
//!   tools         [   0.80   ]         [ 1.00 ]
//! ```

use crate::diagnostic::Diagnostic;
use crate::error;
use crate::job::{Bit, Cutter};
use crate::locale;
use crate::machine::Process;
use crate::units::Length;
use std::f64::consts::PI;

/// A size in millimetres without trailing zeros.
pub fn size_text(size: Length) -> String {
    format!("{}", size.mm())
}

/// The drill of this size; its name is its title.
pub fn drill(diameter: Length) -> Bit {
    let unnamed = Bit { diameter, name: String::new(), cutter: Cutter::Drill, handling: Default::default() };
    Bit { name: unnamed.title(locale::FALLBACK), ..unnamed }
}

/// Depth of the drill of `diameter` below the surface, at which its full width is `below` under the board:
///
/// ```text
///     surface ──┐     ┌──
///               │     │        the board + `below`, plus the height of the point:
///     bottom  ──┤     ├──      diameter / 2 / tan(point / 2)
///               ╲     ╱
///                ╲___╱
/// ```
pub(super) fn through(process: &Process, below: Length, diameter: Length, point_deg: f64) -> Length {
    process.board_thickness + below + point_height(diameter, point_deg)
}

/// Height of a drill's point: the additional depth until its full width is through. `point_deg` is the
/// included angle in degrees; 180 is flat.
fn point_height(diameter: Length, point_deg: f64) -> Length {
    let half = (point_deg / 2.0).clamp(1.0, 90.0) * PI / 180.0;
    if point_deg >= 180.0 { Length::ZERO } else { Length::from_mm(diameter.mm() / 2.0 / libm::tan(half)) }
}

/// The drill of `rack` nearest to `size` within `tolerance` (inclusive); of two equally near the larger,
/// because a wire still fits.
pub fn nearest(rack: &[Length], size: Length, tolerance: Length) -> Option<Length> {
    let within = rack.iter().copied().filter(|&bit| (bit - size).abs() <= tolerance);
    within.min_by_key(|&bit| ((bit - size).abs(), -bit))
}

/// Sizes that are listed individually.
const MOST_SIZES: usize = 40;

pub(super) fn errors(
    without: &[(Length, usize)],
    unsized_holes: usize,
    slots: usize,
    (rack, tolerance): (&[Length], Length),
) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    if !without.is_empty() {
        let told = |(size, holes): &(Length, usize)| match nearest(rack, *size, Length::from_nm(i64::MAX)) {
            Some(bit) => format!("{} mm ({holes}; {} mm)", size_text(*size), size_text(bit)),
            None => format!("{} mm ({holes})", size_text(*size)),
        };
        let mut sizes: Vec<String> = without.iter().take(MOST_SIZES).map(told).collect();
        sizes.extend((without.len() > MOST_SIZES).then(|| "…".to_owned()));
        let holes: usize = without.iter().map(|(_, holes)| holes).sum();
        let diagnostic = error!("plan.no_bit", holes = holes, sizes = sizes.join(", "), ..);
        diagnostics.push(diagnostic.with("tolerance", size_text(tolerance)));
    }
    if unsized_holes > 0 {
        diagnostics.push(error!("plan.no_size", holes = unsized_holes));
    }
    if slots > 0 {
        diagnostics.push(error!("plan.slots_not_drilled", slots = slots));
    }
    diagnostics
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::virtual_drill;

    fn um(value: i64) -> Length {
        Length::from_um(value)
    }

    #[test]
    fn nearest_drill_within_tolerance_is_chosen() {
        let rack = [800, 900, 1000, 3200].map(um);
        // size, tolerance, expected drill; all in µm
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
    fn drill_depth_includes_the_point() {
        let process = virtual_drill().process;
        // Diameter and depth below the board in µm, angle, and the height of the point in µm.
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
}
