//! Track widths, hole diameters and annular rings of a drawing, each sorted.

use super::{Body, Drawing, Id, Layer, Thing};
use crate::units::Length;
use std::collections::{BTreeMap, BTreeSet};

/// Lengths with their elements, the smallest first.
type Order = BTreeSet<(Length, Id)>;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Known {
    nodes: [Option<Id>; 2],
    track: Option<Length>,
    hole: Option<Length>,
    ring: Option<Length>,
}

#[derive(Clone, Debug, Default)]
pub(super) struct Sizes {
    known: BTreeMap<Id, Known>,
    pub tracks: Order,
    pub rings: Order,
    pub holes: Order,
}

impl Sizes {
    /// Updates the touched elements. Returns their nodes, before and after.
    pub(super) fn update(&mut self, drawing: &Drawing, touched: &BTreeSet<Id>) -> BTreeSet<Id> {
        let was = touched.iter().filter_map(|id| self.known.get(id)).flat_map(|known| known.nodes);
        let is = touched.iter().filter_map(|id| drawing.thing(*id)).flat_map(Thing::nodes);
        let nodes: BTreeSet<Id> = was.flatten().chain(is).collect();
        // A changed pad changes the rings of the holes on its node.
        let beside = nodes.iter().flat_map(|node| drawing.hanging(*node));
        for id in touched.iter().copied().chain(beside).collect::<BTreeSet<Id>>() {
            self.set(id, known(drawing, id));
        }
        nodes
    }

    fn set(&mut self, id: Id, now: Option<Known>) {
        let was = match now {
            Some(now) => self.known.insert(id, now),
            None => self.known.remove(&id),
        };
        if was == now {
            return;
        }
        let swap = |order: &mut Order, get: fn(Known) -> Option<Length>| {
            if let Some(size) = was.and_then(get) {
                order.remove(&(size, id));
            }
            order.extend(now.and_then(get).map(|size| (size, id)));
        };
        swap(&mut self.tracks, |known| known.track);
        swap(&mut self.holes, |known| known.hole);
        swap(&mut self.rings, |known| known.ring);
    }
}

fn known(drawing: &Drawing, id: Id) -> Option<Known> {
    let none = Known::default();
    Some(match drawing.thing(id)? {
        Thing::Track { from, to, width, layer } if *layer != Layer::Edge => {
            Known { nodes: [Some(*from), Some(*to)], track: Some(*width), ..none }
        }
        Thing::Pad { node, .. } => Known { nodes: [Some(*node), None], ..none },
        Thing::Hole { node, diameter, .. } => {
            let ring = ring(drawing, *node, *diameter);
            Known { nodes: [Some(*node), None], hole: Some(*diameter), ring, ..none }
        }
        _ => return None,
    })
}

/// Copper around a hole: the smallest ring over the pads on its node.
fn ring(drawing: &Drawing, node: Id, diameter: Length) -> Option<Length> {
    let at = drawing.at(node)?;
    let pads = drawing.hanging(node).filter_map(|id| {
        let entry = drawing.get(id)?;
        let is_pad = matches!(entry.thing, Thing::Pad { .. });
        let body = Body::of(drawing, entry).filter(|_| is_pad)?;
        Some(body.depth_mm(at) - diameter.mm() / 2.0)
    });
    let least = pads.fold(f64::INFINITY, f64::min);
    least.is_finite().then(|| Length::from_mm(least))
}
