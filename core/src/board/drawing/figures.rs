//! The smallest gap, track, ring and hole of a drawing, followed edit by edit.
//!
//! ```text
//!  touched ─▶ their pairs within 2 mm measured anew ─┬─ those that touch are one net ─▶ nets of what changed, walked anew
//!                                                    └─ those of two nets ─▶ gaps, the smallest first
//!          └▶ tracks, holes, rings ─▶ sizes, the smallest first
//! ```
//!
//! Comes in: a [`Drawing`], its [`Finder`], what an edit touched. Goes out: lengths with whose they are. What is imported counts
//! with its shape, and as copper as far as its layer draws dark alone. An edit costs what it touched and the nets of that, not
//! the whole drawing. Does not know how narrow is too narrow.

use super::sizes::Sizes;
use super::{Catch, Drawing, Finder, Id, Layer, Thing};
use crate::units::Length;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Gaps wider than this are not looked for.
pub const WINDOW: Length = Length::from_um(2_000);
/// What is nearer than this touches.
const TOUCH_NM: i64 = 1;
/// Nets of so many are walked before larger ones.
const SMALL: usize = 64;

/// The smallest of each kind; none where there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Smallest {
    /// Between copper of two nets, up to [`WINDOW`].
    pub gap: Option<(Length, Catch, Catch)>,
    /// Width of a track that is copper.
    pub track: Option<(Length, Id)>,
    /// Copper around a hole in its pad.
    pub ring: Option<(Length, Id)>,
    /// Diameter of a hole.
    pub hole: Option<(Length, Id)>,
}

/// What is near to what, which net it is of, and what is small.
#[derive(Clone, Debug, Default)]
pub struct DrawingFigures {
    /// What is near to what, by nanometres.
    pairs: BTreeMap<Catch, BTreeMap<Catch, i64>>,
    /// The number of the net of what is copper.
    nets: BTreeMap<Catch, u32>,
    /// The next net has this number.
    next: u32,
    /// What is near to copper of another net, the nearest first.
    gaps: BTreeSet<(i64, Catch, Catch)>,
    sizes: Sizes,
}

impl DrawingFigures {
    /// The figures of all of `drawing`.
    pub fn new(drawing: &Drawing, finder: &Finder) -> Self {
        let mut figures = Self::default();
        let imported = (0..).take(finder.imported().len()).map(Catch::Imported);
        let drawn = drawing.things().map(|(id, _)| Catch::Drawn(id));
        figures.update(drawing, finder, &imported.chain(drawn).collect());
        figures
    }

    /// The smallest of each kind now.
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

    /// Measures anew what has another body; `finder` has followed already.
    pub fn update(&mut self, drawing: &Drawing, finder: &Finder, moved: &BTreeSet<Catch>) {
        // Whose net may be another one: what moved, what touched it or touches it now, what shares a node with it.
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

    /// What was near to `one` is no longer. Gives those that touched it.
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

    /// What is near to `one` now.
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

    /// What touches `one`.
    fn touching(&self, one: Catch) -> impl Iterator<Item = Catch> + '_ {
        let near = self.pairs.get(&one).into_iter().flatten();
        near.filter(|(_, gap)| **gap <= TOUCH_NM).map(|(other, _)| *other)
    }

    /// Gives the nets of `seeds` their numbers anew. Gives what is of another net than before.
    fn walk(&mut self, drawing: &Drawing, finder: &Finder, seeds: BTreeSet<Catch>) -> BTreeSet<Catch> {
        let (mut open, mut changed, mut taken) = (seeds, BTreeSet::new(), BTreeSet::new());
        // The large nets come last: where all that is left is found in one of them, the rest of it is as it was.
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

    /// What is joined with `seed`, and the numbers that it had: all of it; or as far as all of `open` is found in it and it has
    /// one number that is not taken. None where it is more than `most`.
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

    /// The pairs of `one` go among the gaps, or out of them.
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

/// The layer of what is copper.
fn copper(drawing: &Drawing, finder: &Finder, catch: Catch) -> Option<Layer> {
    finder.layer(drawing, catch).filter(|layer| *layer != Layer::Edge)
}

/// The copper that is joined with it, from side to side, by plated holes on its nodes.
fn through_holes(drawing: &Drawing, finder: &Finder, catch: Catch) -> Vec<Catch> {
    let Catch::Drawn(id) = catch else { return Vec::new() };
    let plated = |id: Id| matches!(drawing.thing(id), Some(Thing::Hole { plated: true, .. }));
    let nodes = drawing.thing(id).into_iter().flat_map(Thing::nodes);
    let joined = nodes.filter(|node| drawing.hanging(*node).any(plated));
    let on = joined.flat_map(|node| drawing.hanging(node)).map(Catch::Drawn);
    on.filter(|other| copper(drawing, finder, *other).is_some()).collect()
}
