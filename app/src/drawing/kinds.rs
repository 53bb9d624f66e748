//! Objects of files by kind: holes, pads, tracks, areas.

use super::{Editor, Tool};
use annulus_core::board::drawing::{Catch, Imported};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ImportedKind {
    #[default]
    Hole,
    Pad,
    Track,
    Area,
}

impl ImportedKind {
    pub const ALL: [Self; 4] = [Self::Hole, Self::Pad, Self::Track, Self::Area];

    pub fn of(one: &Imported) -> Self {
        match one.layer {
            None => Self::Hole,
            Some(_) if one.is_area => Self::Area,
            Some(_) if one.is_pad => Self::Pad,
            Some(_) => Self::Track,
        }
    }

    pub const fn word(self) -> &'static str {
        match self {
            Self::Hole => "hole",
            Self::Pad => "pad",
            Self::Track => "track",
            Self::Area => "area",
        }
    }
}

/// Indices of the objects of one kind; skips those for which `without` is true.
pub fn of_kind(all: &[Imported], kind: ImportedKind, without: impl Fn(u32) -> bool) -> Vec<u32> {
    let wanted = |(at, one): (u32, &Imported)| (ImportedKind::of(one) == kind && !without(at)).then_some(at);
    (0..).zip(all).filter_map(wanted).collect()
}

impl Editor {
    /// Selects an object of a file, unless it was deleted, and moves the cross-hair to it.
    pub fn choose_imported(&mut self, of: u32) {
        let catch = Catch::Imported(of);
        let Some(at) = self.place_of(catch) else { return };
        self.take(Tool::Select);
        self.choose(catch, false);
        self.aim_at(at);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::board::drawing::{Body, Layer};
    use annulus_core::geometry::Point;
    use annulus_core::units::Length;

    #[test]
    fn imported_objects_are_listed_by_kind() {
        let at = Point::from_mm(1.0, 2.0);
        let object = |points: Vec<Point>, layer: Option<Layer>, (is_area, is_pad): (bool, bool)| {
            let closed = points.len() > 2;
            let body = Body { points, closed, radius: Length::from_um(500) };
            Imported { file: "a".to_owned(), object: 0, at, body, layer, is_area, is_pad }
        };
        let (pad, track, area) = ((false, true), (false, false), (true, false));
        let end = Point::from_mm(3.0, 2.0);
        let all = [
            object(vec![at], None, pad),
            object(vec![at], Some(Layer::Top), pad),
            object(vec![at, end, at], Some(Layer::Bottom), pad),
            object(vec![at, end], Some(Layer::Top), track),
            object(vec![at, end, at], Some(Layer::Top), area),
            // An obround pad has two centers but is no track.
            object(vec![at, end], Some(Layer::Top), pad),
        ];
        let found = |kind| of_kind(&all, kind, |_| false);
        assert_eq!(found(ImportedKind::Hole), [0]);
        assert_eq!(found(ImportedKind::Pad), [1, 2, 5]);
        assert_eq!(found(ImportedKind::Track), [3]);
        assert_eq!(found(ImportedKind::Area), [4]);
        assert_eq!(of_kind(&all, ImportedKind::Pad, |at| at == 1), [2, 5]);
    }
}
