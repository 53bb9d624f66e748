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
use std::collections::{BTreeMap, BTreeSet};

/// Gaps wider than this are not looked for.
pub const WINDOW: Length = Length::from_um(2_000);
/// What is nearer than this touches.
const TOUCH_NM: i64 = 1;

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
pub struct Figures {
    /// What is near to what, by nanometres.
    pairs: BTreeMap<Catch, BTreeMap<Catch, i64>>,
    /// The net of what is copper, by the first of those in it.
    nets: BTreeMap<Catch, Catch>,
    /// What is near to copper of another net, the nearest first.
    gaps: BTreeSet<(i64, Catch, Catch)>,
    sizes: Sizes,
}

impl Figures {
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
        // Whose net may be another one: what moved, what touched it, what shares a plated hole with it.
        let mut seeds = moved.clone();
        let drawn =
            moved.iter().filter_map(|catch| if let Catch::Drawn(id) = catch { Some(*id) } else { None });
        let nodes = self.sizes.update(drawing, &drawn.collect());
        seeds.extend(nodes.into_iter().flat_map(|node| drawing.hanging(node)).map(Catch::Drawn));
        for one in moved {
            seeds.extend(self.leave(*one));
        }
        for one in moved {
            self.measure(drawing, finder, *one);
        }
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

    /// Walks the nets of `seeds` anew. Gives what is of another net than before.
    fn walk(&mut self, drawing: &Drawing, finder: &Finder, seeds: BTreeSet<Catch>) -> BTreeSet<Catch> {
        let (mut walked, mut changed) = (BTreeSet::new(), BTreeSet::new());
        for seed in seeds {
            if walked.contains(&seed) {
                continue;
            }
            if copper(drawing, finder, seed).is_none() || finder.body(seed).is_none() {
                self.nets.remove(&seed);
                continue;
            }
            let (mut net, mut open) = (BTreeSet::from([seed]), vec![seed]);
            while let Some(one) = open.pop() {
                let touching =
                    self.pairs.get(&one).into_iter().flatten().filter(|(_, gap)| **gap <= TOUCH_NM);
                let through = through_holes(drawing, finder, one);
                let found = touching.map(|(other, _)| *other).chain(through);
                open.extend(found.filter(|other| net.insert(*other)));
            }
            let first = net.first().copied().unwrap_or(seed);
            for one in &net {
                if self.nets.insert(*one, first) != Some(first) {
                    changed.insert(*one);
                }
            }
            walked.append(&mut net);
        }
        changed
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
