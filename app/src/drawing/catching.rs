//! What a press means: the thing under it, and what is one with that.
//!
//! Comes in: a place, how far beside a thing it is still meant. Goes out: what is chosen. Does not know pointers.

use super::Editor;
use annulus_core::board::drawing::{Catch, Thing};
use annulus_core::geometry::Point;
use annulus_core::units::Length;
use std::collections::BTreeSet;

impl Editor {
    /// The first thing at a place, with its outermost group unless one thing alone is meant.
    pub fn hit(&self, at: Point, reach: Length, single: bool) -> Option<Catch> {
        let mut near = self.finder.at(self.drawing(), at, reach).into_iter();
        let hit = near.find(|catch| !self.is_locked(*catch))?;
        Some(if single { hit } else { self.outermost(hit) })
    }

    /// Chooses what was hit with what is one with it, or adds these to what is chosen, or takes them away again. A pad and its hole
    /// are one, unless one thing alone is meant.
    pub fn choose_hit(&mut self, hit: Catch, adding: bool, single: bool) {
        let mut whole = BTreeSet::from([hit]);
        if !single {
            whole.extend(self.one_with(hit));
        }
        if !adding {
            self.chosen = whole;
        } else if whole.is_subset(&self.chosen) {
            self.chosen.retain(|catch| !whole.contains(catch));
        } else {
            self.chosen.extend(whole);
        }
    }

    /// The holes in a pad, or the pads about a hole, in the same group and not locked.
    fn one_with(&self, hit: Catch) -> Vec<Catch> {
        let drawing = self.drawing();
        let thing = if let Catch::Drawn(id) = hit { drawing.thing(id) } else { None };
        let Some(thing @ (Thing::Pad { .. } | Thing::Hole { .. })) = thing else { return Vec::new() };
        let kind = if matches!(thing, Thing::Pad { .. }) { "hole" } else { "pad" };
        let beside = thing.nodes().flat_map(|node| drawing.hanging(node));
        let other = beside.filter(|id| drawing.thing(*id).is_some_and(|thing| thing.word() == kind));
        let other = other.map(Catch::Drawn);
        other.filter(|one| self.group_of(*one) == self.group_of(hit) && !self.is_locked(*one)).collect()
    }

    /// Whether something that is chosen lies within reach of a place.
    pub(super) fn is_chosen_at(&self, at: Point, reach: Length, single: bool) -> bool {
        let near = self.finder.at(self.drawing(), at, reach).into_iter();
        near.map(|catch| if single { catch } else { self.outermost(catch) })
            .any(|catch| self.chosen.contains(&catch) && !self.is_locked(catch))
    }
}
