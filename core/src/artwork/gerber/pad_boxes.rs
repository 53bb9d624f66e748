//! Bounding boxes of the pads of a layer, at their positions. Pads in blocks count separately.

use super::aperture_shapes::outlines;
use super::flatten::each;
use super::object::{Gerber, ObjectShape};
use super::transform::Place;
use crate::geometry::{Bounds, Fuel, Path, Point, path_bounds};
use std::collections::BTreeMap;

/// Work limit for the shapes of all apertures; pads beyond it have no box.
const STEPS: u64 = 200_000;

impl Gerber {
    /// The bounding box of each pad.
    pub(in crate::artwork) fn pad_boxes(&self) -> Vec<Bounds> {
        let mut fuel = Fuel::new(STEPS);
        let mut known: BTreeMap<(u32, bool, u64, u64), Option<Bounds>> = BTreeMap::new();
        let mut boxes = Vec::new();
        each(self, &mut |seen| {
            let ObjectShape::Flash { at } = seen.object.shape else { return };
            let held = seen.transform(self);
            let key = (seen.object.aperture, held.mirrored, held.turn_deg.to_bits(), held.scale.to_bits());
            let own = known.entry(key).or_insert_with(|| {
                let shapes = outlines(self.aperture(seen.object)?, &mut fuel)?;
                let about = Place { transform: held, at: Point::default() };
                let around = |path: &Path| path_bounds(&about.path(path));
                shapes.iter().map(around).reduce(|all, next| all.with(next.min).with(next.max))
            });
            let at = seen.place.point(at);
            let moved = |corner: Point| Point::new(corner.x + at.x, corner.y + at.y);
            boxes.extend(own.map(|own| Bounds { min: moved(own.min), max: moved(own.max) }));
        });
        boxes
    }
}
