//! What isolation made before and may need again: copper grown, and the ways round it.
//!
//! ```text
//!   copper ─ families: islands that a pass joins ─┬─ known by what they look like and how far they grow: as it was
//!                                                 └─ else made now, each by itself, as if there were no other
//! ```
//!
//! What is kept is found by all that went into it, to the nanometre; so it does not matter when it was made, on which board, nor whether it
//! is still there: the same comes out. A pad that moves is made anew with what it touches, the rest of the board is not.
//!
//! Comes in: regions and distances. Goes out: regions and paths. What was not asked for the longest goes when there is too much. Does
//! not know operations.

use super::{shared, slivers};
use crate::geometry::{Island, Path, Region, families, grow};
use crate::units::Length;
use std::collections::BTreeMap;
use std::rc::Rc;

/// Islands farther apart than they grow together, by this, stay apart for certain.
const BETWEEN: Length = Length::from_um(20);
/// Larger regions, by their segments, are one family: to part them would take half as long as what it may save.
const MOST_PARTED: usize = 20_000;
/// So many segments are kept.
const MOST_SEGMENTS: usize = 600_000;

/// A family and how far it grows.
type Growing = (Length, Vec<Island>);
/// A family whose edges are followed, how wide the cut is below, and how far the next pass is from it.
type Followed = (Length, Option<Length>, Vec<Island>);

/// What was made before.
#[derive(Debug, Default)]
pub struct Kept {
    grown: Shelf<Growing, Vec<Island>>,
    ways: Shelf<Followed, Vec<Path>>,
    made: u32,
}

/// Things by what they were made of.
#[derive(Debug)]
struct Shelf<K, V> {
    things: BTreeMap<K, Thing<V>>,
    /// Counts what was asked for.
    asked: u64,
    segments: usize,
}

#[derive(Debug)]
struct Thing<V> {
    made: Rc<V>,
    /// When it was asked for last.
    asked: u64,
    segments: usize,
}

impl<K, V> Default for Shelf<K, V> {
    fn default() -> Self {
        Self { things: BTreeMap::new(), asked: 0, segments: 0 }
    }
}

impl<K: Ord + Clone, V> Shelf<K, V> {
    /// What is made of `of`, and whether it had to be made.
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

    /// Puts away what was not asked for the longest, until no more than `most` segments are left.
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

/// The islands by families whose members are farther apart than `reach`.
fn parted(region: &Region, reach: Length) -> Vec<Vec<Island>> {
    match of_islands(&region.islands) {
        0 => Vec::new(),
        1..MOST_PARTED => families(region, reach),
        _ => vec![region.islands.clone()],
    }
}

impl Kept {
    /// How many families were grown or gone round since there is this, because they were not known.
    pub fn made(&self) -> u32 {
        self.made
    }

    /// All that is at most `by` away from `region`.
    pub(super) fn grown(&mut self, region: &Region, by: Length) -> Region {
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

    /// The toolpaths along the edges of `pass`, each stretch once, with those along the slivers that it leaves, see
    /// [`slivers::with_slivers`].
    pub(super) fn with_slivers(&mut self, pass: &Region, through: Length, next: Option<Length>) -> Vec<Path> {
        let mut paths = Vec::new();
        for family in parted(pass, slivers::room(through, next) + BETWEEN) {
            let make = |(through, next, family): &Followed| {
                let region = Region { islands: family.clone() };
                let ways = shared::once(slivers::with_slivers(&region, *through, *next));
                let segments = of_islands(family) + segments(ways.iter());
                (ways, segments)
            };
            let (ways, is_new) = self.ways.take((through, next, family), make);
            self.made += u32::from(is_new);
            paths.extend(ways.iter().cloned());
        }
        paths
    }

    /// Makes room for what comes next.
    pub(super) fn tidy(&mut self) {
        self.grown.tidy(MOST_SEGMENTS / 2);
        self.ways.tidy(MOST_SEGMENTS / 2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_asked_for_the_longest_goes_first() {
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
