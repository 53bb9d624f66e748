//! Finds the disc under the pointer, exactly and without reading pixels back.

use super::scene::Disc;
use rstar::{AABB, RTree, RTreeObject};

#[derive(Clone, Copy, Debug)]
struct Spot {
    index: u32,
    centre: [f32; 2],
    radius: f32,
}

impl RTreeObject for Spot {
    type Envelope = AABB<[f32; 2]>;
    fn envelope(&self) -> Self::Envelope {
        let [x, y] = self.centre;
        let r = self.radius;
        AABB::from_corners([x - r, y - r], [x + r, y + r])
    }
}

/// A spatial index of discs.
#[derive(Debug, Default)]
pub struct Picker {
    tree: RTree<Spot>,
}

impl Picker {
    pub fn new(discs: &[Disc]) -> Self {
        let spots = discs.iter().enumerate().map(|(index, disc)| Spot {
            index: index as u32,
            centre: disc.centre_mm,
            radius: disc.radius_mm,
        });
        let finite =
            |spot: &Spot| spot.centre.iter().all(|number| number.is_finite()) && spot.radius.is_finite();
        Self { tree: RTree::bulk_load(spots.filter(finite).collect()) }
    }

    /// The disc whose edge is nearest to `at_mm`, within `tolerance_mm`. If inside several: the one with the
    /// nearest center, then the lowest index.
    pub fn nearest(&self, at_mm: [f64; 2], tolerance_mm: f64) -> Option<usize> {
        let reach = tolerance_mm as f32;
        let at = [at_mm[0] as f32, at_mm[1] as f32];
        let window = AABB::from_corners([at[0] - reach, at[1] - reach], [at[0] + reach, at[1] + reach]);
        let ranked = self.tree.locate_in_envelope_intersecting(&window).filter_map(|spot| {
            let dx = f64::from(spot.centre[0]) - at_mm[0];
            let dy = f64::from(spot.centre[1]) - at_mm[1];
            let from_centre = libm::sqrt(dx * dx + dy * dy);
            let from_edge = (from_centre - f64::from(spot.radius)).max(0.0);
            (from_edge <= tolerance_mm).then_some((from_edge, from_centre, spot.index))
        });
        let best = ranked.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        best.map(|(_, _, index)| index as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::{Colour, HoleState};
    use annulus_core::chance::Chance;

    fn disc(x: f32, y: f32, radius_mm: f32) -> Disc {
        Disc { centre_mm: [x, y], radius_mm, colour: Colour::rgb(0), state: HoleState::Planned, order: 0 }
    }

    #[test]
    fn nearest_disc_is_picked_within_tolerance() {
        let discs = [disc(0.0, 0.0, 1.0), disc(3.0, 0.0, 0.4), disc(0.2, 0.0, 3.0), disc(f32::NAN, 0.0, 1.0)];
        let picker = Picker::new(&discs);
        let rows = [
            ([0.0, 0.0], 0.0, Some(0), "inside two: the nearer centre"),
            ([0.15, 0.0], 0.0, Some(2), "inside two: the nearer centre again"),
            ([3.3, 0.0], 0.0, Some(1), "inside the small one, just outside the large one"),
            ([3.45, 0.0], 0.1, Some(1), "outside, within tolerance"),
            ([3.55, 0.0], 0.1, None, "outside tolerance"),
            ([0.2, 3.1], 0.2, Some(2), "edge of the large one"),
            ([50.0, 50.0], 1.0, None, "nothing there"),
        ];
        for (at, tolerance, expected, why) in rows {
            assert_eq!(picker.nearest(at, tolerance), expected, "{why}");
        }
        assert_eq!(Picker::new(&[]).nearest([0.0, 0.0], 9.0), None);
    }

    #[test]
    fn picker_agrees_with_an_exhaustive_search() {
        let mut chance = Chance::new(1);
        let mut chance = || chance.unit() as f32;
        let discs: Vec<_> =
            (0..400).map(|_| disc(chance() * 30.0, chance() * 30.0, 0.1 + chance())).collect();
        let picker = Picker::new(&discs);
        for _ in 0..2000 {
            let at = [f64::from(chance()) * 30.0, f64::from(chance()) * 30.0];
            let apart = |d: &Disc| {
                let (dx, dy) = (f64::from(d.centre_mm[0]) - at[0], f64::from(d.centre_mm[1]) - at[1]);
                (dx * dx + dy * dy).sqrt()
            };
            let edge = |d: &Disc| (apart(d) - f64::from(d.radius_mm)).max(0.0);
            let nearest = (0..discs.len()).filter(|i| edge(&discs[*i]) <= 0.3).min_by(|a, b| {
                (edge(&discs[*a]), apart(&discs[*a]))
                    .partial_cmp(&(edge(&discs[*b]), apart(&discs[*b])))
                    .unwrap()
            });
            assert_eq!(picker.nearest(at, 0.3), nearest, "at {at:?}");
        }
    }
}
