//! Locked layers: nothing on them can be selected or edited.

use super::Editor;
use annulus_core::board::drawing::{Catch, Drawing, Edit, Finder, Layer, Thing};

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
