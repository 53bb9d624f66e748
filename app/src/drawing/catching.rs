//! Selection by a press: the thing under the pointer, and its group. Things on locked layers can't be
//! selected or edited.

use super::Editor;
use annulus_core::board::drawing::{Catch, Drawing, Edit, Finder, Layer, Thing};
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

    pub(super) fn is_chosen_at(&self, at: Point, reach: Length, single: bool) -> bool {
        let near = self.finder.at(self.drawing(), at, reach).into_iter();
        near.map(|catch| if single { catch } else { self.outermost(catch) })
            .any(|catch| self.chosen.contains(&catch) && !self.is_locked(catch))
    }
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Locked {
    pub layers: Vec<Layer>,
    pub holes: bool,
}

impl Locked {
    fn is_empty(&self) -> bool {
        self.layers.is_empty() && !self.holes
    }

    fn has_layer(&self, layer: Layer) -> bool {
        self.layers.iter().any(|locked| locked.meets(layer))
    }

    /// True if a thing is on a locked layer, or refers to an object of a file that is.
    fn has(&self, finder: &Finder, thing: &Thing) -> bool {
        match thing {
            Thing::Hole { .. } => self.holes,
            Thing::Imported { .. } => {
                finder.imported_of(thing).is_some_and(|of| self.has_imported(finder, of))
            }
            thing => thing.layer().is_some_and(|layer| self.has_layer(layer)),
        }
    }

    fn has_imported(&self, finder: &Finder, of: u32) -> bool {
        let one = finder.imported().get(of as usize);
        one.is_some_and(|one| one.layer.map_or(self.holes, |layer| self.has_layer(layer)))
    }

    /// True if an edit changes something on a locked layer or adds something to one.
    pub(super) fn refuses(&self, drawing: &Drawing, finder: &Finder, edit: &Edit) -> bool {
        if self.is_empty() {
            return false;
        }
        let has = |thing: &Thing| self.has(finder, thing);
        let touched = drawing.touched(edit);
        let mut comes = edit.changes.iter().filter_map(|(_, entry)| entry.as_ref());
        touched.iter().filter_map(|id| drawing.thing(*id)).any(has) || comes.any(|entry| has(&entry.thing))
    }
}

impl Editor {
    /// True if `catch` is on a locked layer. For a node: if anything attached to it is.
    pub fn is_locked(&self, catch: Catch) -> bool {
        let (locked, drawing, finder) = (&self.locked, self.drawing(), self.finder());
        let has = |id| drawing.thing(id).is_some_and(|thing| locked.has(finder, thing));
        match catch {
            _ if locked.is_empty() => false,
            Catch::Imported(of) => locked.has_imported(finder, of),
            Catch::Drawn(id) if drawing.at(id).is_some() => drawing.hanging(id).any(has),
            Catch::Drawn(id) => has(id),
        }
    }
}
