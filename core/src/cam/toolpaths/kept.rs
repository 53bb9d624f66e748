//! Cache of isolation: grown copper and the paths around it.
//!
//! ```text
//!   copper ─ families: islands that a pass joins ─┬─ cached by shape and distance: reused
//!                                                 └─ else computed now, each as if there were no other
//! ```
//!
//! The key of an entry is its whole input, to the nanometre, so the cache never changes a result. If a pad moves, only its family is
//! computed again. Regions of more than [`MOST_KEPT`] segments are not cached. The least recently used entries are dropped first.

use super::linked::along_and_back;
use super::refit::refitted;
use super::{shared, slivers};
use crate::geometry::{Island, Path, Region, families, grow};
use crate::units::Length;
use std::collections::BTreeMap;
use std::rc::Rc;

/// Margin of the reach: islands farther apart are certainly independent.
const BETWEEN: Length = Length::from_um(20);
/// Larger regions, by segments, are one family: splitting would take half the time that it may save.
const MOST_PARTED: usize = 20_000;
/// Regions with more segments are not saved: one of them would fill most of the cache.
const MOST_KEPT: usize = 100_000;
const MOST_SEGMENTS: usize = 600_000;

/// Tolerance of refitted toolpaths. With the errors of the offset and the 1 µm that toolpaths are nearer, the
/// total is 2 µm.
pub(super) const REFIT: Length = Length::from_nm(800);

/// Toolpaths along slivers up to this length, in mm, run forwards and back. For longer ones a retract takes less time.
const SLIVER_BACK_MM: f64 = 10.0;

/// A family and how far it grows.
type Growing = (Length, Vec<Island>);
/// A family to follow, the width of the cut at the bottom, and the distance of the next pass.
type Followed = (Length, Option<Length>, Vec<Island>);

#[derive(Debug, Default)]
pub struct Kept {
    grown: Shelf<Growing, Vec<Island>>,
    ways: Shelf<Followed, Vec<Path>>,
    made: u32,
}

#[derive(Debug)]
struct Shelf<K, V> {
    things: BTreeMap<K, Thing<V>>,
    asked: u64,
    segments: usize,
}

#[derive(Debug)]
struct Thing<V> {
    made: Rc<V>,
    asked: u64,
    segments: usize,
}

impl<K, V> Default for Shelf<K, V> {
    fn default() -> Self {
        Self { things: BTreeMap::new(), asked: 0, segments: 0 }
    }
}

impl<K: Ord + Clone, V> Shelf<K, V> {
    fn take(&mut self, of: K, make: impl FnOnce(&K) -> (V, usize)) -> (Rc<V>, bool) {
        self.asked += 1;
        if let Some(known) = self.things.get_mut(&of) {
            known.asked = self.asked;
            return (Rc::clone(&known.made), false);
        }
        let (made, segments) = make(&of);
        let made = Rc::new(made);
        self.segments += segments;
        self.things.insert(of, Thing { made: Rc::clone(&made), asked: self.asked, segments });
        (made, true)
    }

    /// Drops the least recently used entries until at most `most` segments remain.
    fn tidy(&mut self, most: usize) {
        if self.segments <= most {
            return;
        }
        let mut by_age: Vec<(u64, usize)> =
            self.things.values().map(|thing| (thing.asked, thing.segments)).collect();
        by_age.sort_unstable_by(|a, b| b.cmp(a));
        let mut left = 0;
        let stay = by_age.iter().take_while(|(_, segments)| {
            left += segments;
            left <= most
        });
        let oldest = stay.last().map_or(u64::MAX, |(asked, _)| *asked);
        self.things.retain(|_, thing| thing.asked >= oldest);
        self.segments = self.things.values().map(|thing| thing.segments).sum();
    }
}

fn segments<'a>(paths: impl Iterator<Item = &'a Path>) -> usize {
    paths.map(|path| path.segments.len()).sum()
}

fn of_islands(islands: &[Island]) -> usize {
    segments(islands.iter().flat_map(Island::paths))
}

/// The islands in families farther apart than `reach`.
fn parted(region: &Region, reach: Length) -> Vec<Vec<Island>> {
    match of_islands(&region.islands) {
        0 => Vec::new(),
        1..MOST_PARTED => families(region, reach),
        _ => vec![region.islands.clone()],
    }
}

fn ways(pass: &Region, through: Length, next: Option<Length>) -> Vec<Path> {
    let (rings, slivers): (Vec<Path>, Vec<Path>) =
        slivers::with_slivers(pass, through, next).into_iter().partition(Path::is_closed);
    let fitted = |way: Path| refitted(&way, REFIT);
    let mut ways: Vec<Path> = shared::once(rings).into_iter().map(fitted).collect();
    ways.extend(slivers.into_iter().map(|way| along_and_back(fitted(way), SLIVER_BACK_MM)));
    ways
}

impl Kept {
    /// Number of families computed since creation, because they were not cached.
    pub fn made(&self) -> u32 {
        self.made
    }

    pub(super) fn grown(&mut self, region: &Region, by: Length) -> Region {
        if of_islands(&region.islands) > MOST_KEPT {
            self.made += 1;
            return grow(region, by);
        }
        let mut islands = Vec::new();
        for family in parted(region, by + by + BETWEEN) {
            let make = |(by, family): &Growing| {
                let grown = grow(&Region { islands: family.clone() }, *by).islands;
                let segments = of_islands(family) + of_islands(&grown);
                (grown, segments)
            };
            let (grown, is_new) = self.grown.take((by, family), make);
            self.made += u32::from(is_new);
            islands.extend(grown.iter().cloned());
        }
        islands.sort();
        Region { islands }
    }

    /// The toolpaths along the edges of `pass`, each stretch once, with those along the slivers that it
    /// leaves, see [`slivers::with_slivers`].
    pub(super) fn with_slivers(&mut self, pass: &Region, through: Length, next: Option<Length>) -> Vec<Path> {
        if of_islands(&pass.islands) > MOST_KEPT {
            self.made += 1;
            return ways(pass, through, next);
        }
        let mut paths = Vec::new();
        for family in parted(pass, slivers::room(through, next) + BETWEEN) {
            let make = |(through, next, family): &Followed| {
                let ways = ways(&Region { islands: family.clone() }, *through, *next);
                let segments = of_islands(family) + segments(ways.iter());
                (ways, segments)
            };
            let (ways, is_new) = self.ways.take((through, next, family), make);
            self.made += u32::from(is_new);
            paths.extend(ways.iter().cloned());
        }
        paths
    }

    /// Makes room for new entries.
    pub(super) fn tidy(&mut self) {
        self.grown.tidy(MOST_SEGMENTS / 2);
        self.ways.tidy(MOST_SEGMENTS / 2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn least_recently_used_entry_is_dropped_first() {
        let mut shelf: Shelf<u32, u32> = Shelf::default();
        let mut take = |of: u32| *shelf.take(of, |of| (of * 10, 4)).0;
        assert_eq!([1, 2, 3, 1].map(&mut take), [10, 20, 30, 10]);
        shelf.tidy(12);
        assert_eq!(shelf.things.keys().copied().collect::<Vec<_>>(), [1, 2, 3]);
        shelf.tidy(11);
        assert_eq!(shelf.things.keys().copied().collect::<Vec<_>>(), [1, 3]);
        assert_eq!(shelf.segments, 8);
        assert!(!shelf.take(3, |_| (0, 0)).1 && shelf.take(2, |_| (0, 0)).1);
        shelf.tidy(3);
        assert_eq!(shelf.things.keys().copied().collect::<Vec<_>>(), [2]);
    }
}
