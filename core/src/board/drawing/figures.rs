//! The smallest gap, track, ring and hole of a drawing, followed edit by edit.
//!
//! ```text
//!  touched ─▶ their pairs within 2 mm measured anew ─▶ pairs ─ those that touch are one net ─▶ the smallest of the others
//! ```
//!
//! Comes in: a [`Drawing`], its [`Finder`], what an edit touched. Goes out: lengths with whose they are. What is imported counts
//! with its shape, and as copper as far as its layer draws dark alone. Does not know how narrow is too narrow.

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

/// What is near to what, by nanometres.
#[derive(Clone, Debug, Default)]
pub struct Figures {
    pairs: BTreeMap<Catch, BTreeMap<Catch, i64>>,
}

impl Figures {
    /// The pairs of all of `drawing`.
    pub fn new(drawing: &Drawing, finder: &Finder) -> Self {
        let mut figures = Self::default();
        let imported = (0..).take(finder.imported().len()).map(Catch::Imported);
        let drawn = drawing.things().map(|(id, _)| Catch::Drawn(id));
        figures.update(drawing, finder, &imported.chain(drawn).collect());
        figures
    }

    /// Measures anew what has another body; `finder` has followed already.
    pub fn update(&mut self, drawing: &Drawing, finder: &Finder, moved: &BTreeSet<Catch>) {
        for one in moved {
            for (other, _) in self.pairs.remove(one).unwrap_or_default() {
                if let Some(near) = self.pairs.get_mut(&other) {
                    near.remove(one);
                    if near.is_empty() {
                        self.pairs.remove(&other);
                    }
                }
            }
            let (Some(layer), Some(body)) = (copper(drawing, finder, *one), finder.body(*one)) else {
                continue;
            };
            for other in finder.meeting(body.bounds().grown(WINDOW)) {
                let met = copper(drawing, finder, other).is_some_and(|other| layer.meets(other));
                let Some(beside) = finder.body(other).filter(|_| met && other != *one) else { continue };
                let gap = Length::from_mm(body.gap_mm(beside)).nm();
                if gap <= WINDOW.nm() {
                    self.pairs.entry(*one).or_default().insert(other, gap);
                    self.pairs.entry(other).or_default().insert(*one, gap);
                }
            }
        }
    }

    /// The smallest of each kind now.
    pub fn smallest(&self, drawing: &Drawing) -> Smallest {
        let mut smallest = Smallest { gap: self.gap(drawing), ..Smallest::default() };
        let less = |now: &mut Option<(Length, Id)>, size: Length, id: Id| {
            if now.is_none_or(|(least, _)| size < least) {
                *now = Some((size, id));
            }
        };
        for (id, entry) in drawing.things() {
            match &entry.thing {
                Thing::Track { width, layer, .. } if *layer != Layer::Edge => {
                    less(&mut smallest.track, *width, id);
                }
                Thing::Hole { node, diameter, .. } => {
                    less(&mut smallest.hole, *diameter, id);
                    if let Some(ring) = ring(drawing, *node, *diameter) {
                        less(&mut smallest.ring, ring, id);
                    }
                }
                _ => {}
            }
        }
        smallest
    }

    fn gap(&self, drawing: &Drawing) -> Option<(Length, Catch, Catch)> {
        let mut nets = Nets::of(self.pairs.keys().copied().collect());
        for (one, near) in &self.pairs {
            near.iter().filter(|(_, gap)| **gap <= TOUCH_NM).for_each(|(other, _)| nets.join(*one, *other));
        }
        // What hangs on one plated hole is joined from side to side.
        for (_, entry) in drawing.things() {
            let Thing::Hole { node, plated: true, .. } = entry.thing else { continue };
            let mut pads = drawing.hanging(node).map(Catch::Drawn);
            if let Some(first) = pads.next() {
                pads.for_each(|other| nets.join(first, other));
            }
        }
        let mut least: Option<(i64, Catch, Catch)> = None;
        for (one, near) in &self.pairs {
            for (other, gap) in near.iter().filter(|(other, gap)| **other > *one && **gap > TOUCH_NM) {
                if least.is_none_or(|(least, ..)| *gap < least) && !nets.joined(*one, *other) {
                    least = Some((*gap, *one, *other));
                }
            }
        }
        least.map(|(gap, one, other)| (Length::from_nm(gap), one, other))
    }
}

/// The layer of what is copper.
fn copper(drawing: &Drawing, finder: &Finder, catch: Catch) -> Option<Layer> {
    finder.layer(drawing, catch).filter(|layer| *layer != Layer::Edge)
}

/// The copper left around a hole in the pads on its node: of the narrowest of them.
fn ring(drawing: &Drawing, node: Id, diameter: Length) -> Option<Length> {
    let at = drawing.at(node)?;
    let pads = drawing.hanging(node).filter_map(|id| {
        let entry = drawing.get(id)?;
        let is_pad = matches!(entry.thing, Thing::Pad { .. });
        let body = super::Body::of(drawing, entry).filter(|_| is_pad)?;
        Some(body.depth_mm(at) - diameter.mm() / 2.0)
    });
    let least = pads.fold(f64::INFINITY, f64::min);
    least.is_finite().then(|| Length::from_mm(least))
}

/// What is joined to what: each leads to another of its net, or to itself.
struct Nets {
    keys: Vec<Catch>,
    lead: Vec<usize>,
}

impl Nets {
    fn of(keys: Vec<Catch>) -> Self {
        let lead = (0..keys.len()).collect();
        Self { keys, lead }
    }

    fn first(&mut self, catch: Catch) -> Option<usize> {
        let mut at = self.keys.binary_search(&catch).ok()?;
        while let Some(next) = self.lead.get(at).copied().filter(|next| *next != at) {
            let beyond = self.lead.get(next).copied().unwrap_or(next);
            if let Some(lead) = self.lead.get_mut(at) {
                *lead = beyond;
            }
            at = next;
        }
        Some(at)
    }

    fn join(&mut self, one: Catch, other: Catch) {
        if let (Some(a), Some(b)) = (self.first(one), self.first(other))
            && let Some(lead) = self.lead.get_mut(a.max(b))
        {
            *lead = a.min(b);
        }
    }

    fn joined(&mut self, one: Catch, other: Catch) -> bool {
        self.first(one).is_some_and(|a| self.first(other) == Some(a))
    }
}
