//! Spatial index of bounds.
//!
//! ```text
//!  boxes by size:  cells of 1/8 mm … 2 m, each twice as wide as the one before; a box is in cells
//!                  no smaller than it is, so in four of them at most
//! ```

use crate::geometry::Bounds;
use std::collections::{BTreeMap, BTreeSet};

/// The smallest cell is 2 to the power of this, in nm.
const SMALLEST_BITS: u32 = 17;
const SIZES: u32 = 15;

type Cell = (u32, i64, i64);

#[derive(Clone, Debug)]
pub(super) struct Places<K> {
    cells: BTreeMap<Cell, Vec<K>>,
    boxes: BTreeMap<K, Bounds>,
    counts: [usize; SIZES as usize],
}

impl<K> Default for Places<K> {
    fn default() -> Self {
        Self { cells: BTreeMap::new(), boxes: BTreeMap::new(), counts: [0; SIZES as usize] }
    }
}

impl<K: Copy + Ord> Places<K> {
    pub(super) fn set(&mut self, key: K, bounds: Option<Bounds>) {
        if let Some(was) = self.boxes.remove(&key) {
            let size = size_of(was);
            if let Some(count) = self.counts.get_mut(size as usize) {
                *count -= 1;
            }
            for cell in cells(was, size) {
                if let Some(keys) = self.cells.get_mut(&cell) {
                    keys.retain(|other| *other != key);
                    if keys.is_empty() {
                        self.cells.remove(&cell);
                    }
                }
            }
        }
        if let Some(bounds) = bounds {
            let size = size_of(bounds);
            if let Some(count) = self.counts.get_mut(size as usize) {
                *count += 1;
            }
            cells(bounds, size).for_each(|cell| self.cells.entry(cell).or_default().push(key));
            self.boxes.insert(key, bounds);
        }
    }

    /// The keys whose boxes meet `bounds`, each once, in order.
    pub(super) fn meeting(&self, bounds: Bounds) -> BTreeSet<K> {
        let mut found = BTreeSet::new();
        let sizes = (0..SIZES).filter(|size| self.counts.get(*size as usize).is_some_and(|count| *count > 0));
        for size in sizes {
            let (low, high) = span(bounds, size);
            for column in low.0..=high.0 {
                // Rows of a column are adjacent in the map.
                let rows = self.cells.range((size, column, low.1)..=(size, column, high.1));
                let met = |key: &&K| self.boxes.get(*key).is_some_and(|own| own.meets(bounds));
                found.extend(rows.flat_map(|(_, keys)| keys).filter(met));
            }
        }
        found
    }
}

/// The smallest cell size that is no smaller than the box.
fn size_of(bounds: Bounds) -> u32 {
    let width = (bounds.max.x - bounds.min.x).nm().max((bounds.max.y - bounds.min.y).nm()).unsigned_abs();
    (u64::BITS - width.leading_zeros()).saturating_sub(SMALLEST_BITS).min(SIZES - 1)
}

/// First and last cell of a box, by column and row.
fn span(bounds: Bounds, size: u32) -> ((i64, i64), (i64, i64)) {
    let bits = SMALLEST_BITS + size;
    let (low, high) = (bounds.min, bounds.max);
    ((low.x.nm() >> bits, low.y.nm() >> bits), (high.x.nm() >> bits, high.y.nm() >> bits))
}

fn cells(bounds: Bounds, size: u32) -> impl Iterator<Item = Cell> {
    let (low, high) = span(bounds, size);
    (low.0..=high.0).flat_map(move |column| (low.1..=high.1).map(move |row| (size, column, row)))
}
