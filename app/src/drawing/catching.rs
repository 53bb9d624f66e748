//! Selection by a press: the thing under the pointer and the things that go with it.

use super::Editor;
use annulus_core::board::drawing::{Catch, Thing};
use annulus_core::geometry::Point;
use annulus_core::units::Length;
use std::collections::BTreeSet;

impl Editor {
    /// The first unlocked thing within `reach` of a position. Returns its outermost group unless `single`.
    pub fn hit(&self, at: Point, reach: Length, single: bool) -> Option<Catch> {
        let mut near = self.finder.at(self.drawing(), at, reach).into_iter();
        let hit = near.find(|catch| !self.is_locked(*catch))?;
        Some(if single { hit } else { self.outermost(hit) })
    }

    /// Selects `hit`, or toggles it if `adding`. A pad and its hole go together unless `single`.
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

    /// The holes in a pad, or the pads around a hole, that are in the same group and unlocked.
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

    /// True if anything selected and unlocked is within `reach`.
    pub(super) fn is_chosen_at(&self, at: Point, reach: Length, single: bool) -> bool {
        let near = self.finder.at(self.drawing(), at, reach).into_iter();
        near.map(|catch| if single { catch } else { self.outermost(catch) })
            .any(|catch| self.chosen.contains(&catch) && !self.is_locked(catch))
    }
}
