//! The smallest gap, track, ring and hole of a drawing, updated edit by edit.
//!
//! ```text
//!  touched ─▶ measure their pairs within 2 mm ─┬─ touching pairs are one net ─▶ recompute the changed nets
//!                                              └─ pairs of two nets ─▶ gaps, the smallest first
//!          └▶ tracks, holes, rings ─▶ sizes, the smallest first
//! ```
//!
//! Imported objects count with their shape. They count as copper only if their layer draws nothing but dark.
//! An edit takes time for the touched elements and their nets, not for the whole drawing.

use super::sizes::Sizes;
use super::{Catch, Drawing, Finder, Id, Layer, Thing};
use crate::units::Length;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Larger gaps are not searched.
pub const WINDOW: Length = Length::from_um(2_000);
/// A smaller distance counts as touching.
const TOUCH_NM: i64 = 1;
/// Nets up to this size are walked before larger ones.
const SMALL: usize = 64;

/// The smallest of each kind; `None` if there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Smallest {
    /// Between copper of two nets, up to [`WINDOW`].
    pub gap: Option<(Length, Catch, Catch)>,
    pub track: Option<(Length, Id)>,
    pub ring: Option<(Length, Id)>,
    pub hole: Option<(Length, Id)>,
}

/// Near pairs, nets and small sizes.
#[derive(Clone, Debug, Default)]
pub struct DrawingFigures {
    /// Distances of near pairs, in nanometres.
    pairs: BTreeMap<Catch, BTreeMap<Catch, i64>>,
    nets: BTreeMap<Catch, u32>,
    /// Next net number.
    next: u32,
    /// Pairs of different nets, the nearest first.
    gaps: BTreeSet<(i64, Catch, Catch)>,
    sizes: Sizes,
}

impl DrawingFigures {
    pub fn new(drawing: &Drawing, finder: &Finder) -> Self {
        let mut figures = Self::default();
        let imported = (0..).take(finder.imported().len()).map(Catch::Imported);
        let drawn = drawing.things().map(|(id, _)| Catch::Drawn(id));
        figures.update(drawing, finder, &imported.chain(drawn).collect());
        figures
    }

    pub fn smallest(&self) -> Smallest {
        let gap = self.gaps.first().map(|(gap, one, other)| (Length::from_nm(*gap), *one, *other));
        let Sizes { tracks, rings, holes, .. } = &self.sizes;
        Smallest {
            gap,
            track: tracks.first().copied(),
            ring: rings.first().copied(),
            hole: holes.first().copied(),
        }
    }

    /// Measures the elements whose bodies changed; `finder` must be up to date.
    pub fn update(&mut self, drawing: &Drawing, finder: &Finder, moved: &BTreeSet<Catch>) {
        // Nets may change for: moved elements, elements that touched or touch them, elements on their nodes.
        let mut seeds = moved.clone();
        let drawn =
            moved.iter().filter_map(|catch| if let Catch::Drawn(id) = catch { Some(*id) } else { None });
        let nodes = self.sizes.update(drawing, &drawn.collect());
        seeds.extend(nodes.into_iter().flat_map(|node| drawing.hanging(node)).map(Catch::Drawn));
        for one in moved {
            seeds.extend(self.leave(*one));
            self.nets.remove(one);
        }
        for one in moved {
            self.measure(drawing, finder, *one);
        }
        seeds.extend(moved.iter().flat_map(|one| self.touching(*one)));
        seeds.retain(|one| copper(drawing, finder, *one).is_some() && finder.body(*one).is_some());
        let mut changed = self.walk(drawing, finder, seeds);
        changed.extend(moved);
        for one in changed {
            self.sort(one);
        }
    }

    /// Forgets the neighbours of `one`. Returns those that touched it.
    fn leave(&mut self, one: Catch) -> Vec<Catch> {
        let mut touched = Vec::new();
        for (other, gap) in self.pairs.remove(&one).unwrap_or_default() {
            self.gaps.remove(&(gap, one.min(other), one.max(other)));
            if gap <= TOUCH_NM {
                touched.push(other);
            }
            if let Some(near) = self.pairs.get_mut(&other) {
                near.remove(&one);
                if near.is_empty() {
                    self.pairs.remove(&other);
                }
            }
        }
        touched
    }

    fn measure(&mut self, drawing: &Drawing, finder: &Finder, one: Catch) {
        let (Some(layer), Some(body)) = (copper(drawing, finder, one), finder.body(one)) else { return };
        for other in finder.meeting(body.bounds().grown(WINDOW)) {
            let met = copper(drawing, finder, other).is_some_and(|other| layer.meets(other));
            let Some(beside) = finder.body(other).filter(|_| met && other != one) else { continue };
            let gap = Length::from_mm(body.gap_mm(beside)).nm();
            if gap <= WINDOW.nm() {
                self.pairs.entry(one).or_default().insert(other, gap);
                self.pairs.entry(other).or_default().insert(one, gap);
            }
        }
    }

    fn touching(&self, one: Catch) -> impl Iterator<Item = Catch> + '_ {
        let near = self.pairs.get(&one).into_iter().flatten();
        near.filter(|(_, gap)| **gap <= TOUCH_NM).map(|(other, _)| *other)
    }

    /// Renumbers the nets of `seeds`. Returns the elements whose net changed.
    fn walk(&mut self, drawing: &Drawing, finder: &Finder, seeds: BTreeSet<Catch>) -> BTreeSet<Catch> {
        let (mut open, mut changed, mut taken) = (seeds, BTreeSet::new(), BTreeSet::new());
        // Large nets last: if all remaining seeds are found in one of them, the rest of that net is
        // unchanged.
        for most in [SMALL, usize::MAX] {
            for seed in open.clone() {
                if !open.contains(&seed) {
                    continue;
                }
                let Some((net, mut numbers)) = self.around(drawing, finder, seed, (&open, &taken), most)
                else {
                    continue;
                };
                open.retain(|one| !net.contains(one));
                for other in open.iter().filter_map(|one| self.nets.get(one)).chain(&taken) {
                    numbers.remove(other);
                }
                let number = numbers.first().copied().unwrap_or_else(|| {
                    self.next += 1;
                    self.next
                });
                taken.insert(number);
                changed.extend(net.into_iter().filter(|one| self.nets.insert(*one, number) != Some(number)));
            }
        }
        changed
    }

    /// The elements connected to `seed`, and the net numbers they had. Stops early if all of `open` is found
    /// and only one number, not taken, was seen. `None` above `most` elements.
    fn around(
        &self,
        drawing: &Drawing,
        finder: &Finder,
        seed: Catch,
        (open, taken): (&BTreeSet<Catch>, &BTreeSet<u32>),
        most: usize,
    ) -> Option<(BTreeSet<Catch>, BTreeSet<u32>)> {
        let number = |one: &Catch| self.nets.get(one).copied();
        let (mut net, mut numbers) = (BTreeSet::from([seed]), BTreeSet::from_iter(number(&seed)));
        let (mut next, mut unmet) = (VecDeque::from([seed]), open.len().saturating_sub(1));
        while let Some(one) = next.pop_front() {
            if unmet == 0 && numbers.len() == 1 && numbers.is_disjoint(taken) {
                break;
            }
            for other in self.touching(one).chain(through_holes(drawing, finder, one)) {
                if net.insert(other) {
                    numbers.extend(number(&other));
                    unmet -= usize::from(open.contains(&other));
                    next.push_back(other);
                }
            }
            if net.len() > most {
                return None;
            }
        }
        Some((net, numbers))
    }

    /// Adds the pairs of `one` to the gaps or removes them.
    fn sort(&mut self, one: Catch) {
        let own = self.nets.get(&one);
        for (other, gap) in self.pairs.get(&one).into_iter().flatten() {
            let pair = (*gap, one.min(*other), one.max(*other));
            if *gap > TOUCH_NM && own != self.nets.get(other) {
                self.gaps.insert(pair);
            } else {
                self.gaps.remove(&pair);
            }
        }
    }
}

fn copper(drawing: &Drawing, finder: &Finder, catch: Catch) -> Option<Layer> {
    finder.layer(drawing, catch).filter(|layer| *layer != Layer::Edge)
}

/// Copper connected to it by plated holes on its nodes, from side to side.
fn through_holes(drawing: &Drawing, finder: &Finder, catch: Catch) -> Vec<Catch> {
    let Catch::Drawn(id) = catch else { return Vec::new() };
    let plated = |id: Id| matches!(drawing.thing(id), Some(Thing::Hole { plated: true, .. }));
    let nodes = drawing.thing(id).into_iter().flat_map(Thing::nodes);
    let joined = nodes.filter(|node| drawing.hanging(*node).any(plated));
    let on = joined.flat_map(|node| drawing.hanging(node)).map(Catch::Drawn);
    on.filter(|other| copper(drawing, finder, *other).is_some()).collect()
}
