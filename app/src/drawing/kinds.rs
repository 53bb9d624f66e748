//! What files draw, by kinds: holes, pads, tracks, areas.
//!
//! Comes in: objects of files. Goes out: their kinds, and where those of one kind stand among them. Knows no words.

use super::{Editor, Tool};
use annulus_core::board::drawing::{Catch, Imported};

/// A kind of objects of files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ImportedKind {
    /// Holes.
    #[default]
    Hole,
    /// Pads.
    Pad,
    /// Tracks.
    Track,
    /// Filled areas.
    Area,
}

impl ImportedKind {
    /// All of them, in the order of the menu.
    pub const ALL: [Self; 4] = [Self::Hole, Self::Pad, Self::Track, Self::Area];

    /// What an object is.
    pub fn of(one: &Imported) -> Self {
        match one.layer {
            None => Self::Hole,
            Some(_) if one.is_area => Self::Area,
            Some(_) if one.is_pad => Self::Pad,
            Some(_) => Self::Track,
        }
    }

    /// Its word in a menu.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Hole => "hole",
            Self::Pad => "pad",
            Self::Track => "track",
            Self::Area => "area",
        }
    }
}

/// The places in `all` of those of one kind; `without` those that cannot be chosen.
pub fn of_kind(all: &[Imported], kind: ImportedKind, without: impl Fn(u32) -> bool) -> Vec<u32> {
    let wanted = |(at, one): (u32, &Imported)| (ImportedKind::of(one) == kind && !without(at)).then_some(at);
    (0..).zip(all).filter_map(wanted).collect()
}

impl Editor {
    /// Chooses an object of a file where it was not taken out; the cross-hair stands on it then.
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
    fn objects_are_listed_by_their_kind() {
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
            // An obround pad has two middles, and is no track.
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
