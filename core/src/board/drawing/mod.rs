//! A drawn board: nodes with elements (`Thing`) attached to them, in nested groups.
//!
//! ```text
//!  group "Motor driver"                 a track is attached to two nodes, a pad and a hole to one:
//!   ├─ group "U1"                       moving a node moves everything attached to it
//!   │   ├─ pad ▢ ── node 7
//!   │   └─ hole ○ ── node 7             ●═══════════● track
//!   └─ track ── nodes 7, 9              7           9
//! ```
//!
//! Lengths are whole nanometres.

mod body;
mod change;
mod edit;
mod figures;
mod files;
mod find;
mod history;
mod holes_written;
mod imported;
mod numbered;
mod over;
mod places;
mod selection;
mod sizes;
mod svg;
#[cfg(test)]
mod tests;
mod text;
mod written;

pub use body::Body;
pub use change::{
    TrackEnd, grouped, hole, moved, node, pad, placed, put, regrouped, removed, renamed, track, ungrouped,
};
pub use edit::{Edit, pasted, whole_turn};
pub use figures::{DrawingFigures, Smallest, WINDOW};
pub use files::{files, stem};
pub use find::{Catch, Finder, Snap, whole};
pub use history::History;
pub use imported::{Imported, imported};
pub use over::{files_of, files_over, lay_over, lay_over_all, read_under, read_under_telling};
pub use selection::{Align, Selection, Sides, put_back};
pub use svg::{board_svg, svg};
pub use text::{is_one, read, write};

use crate::geometry::{Placement, Point};
use crate::units::Length;
use body::shifted;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

pub const MOST_THINGS: usize = 100_000;
pub const LONGEST_NAME: usize = 200;
/// Largest coordinate: 1 m in each direction.
pub const FURTHEST: Length = Length::from_um(1_000_000);
/// Smallest track width, pad and hole.
pub const NARROWEST: Length = Length::from_um(10);
/// Largest track width, pad and hole.
pub const WIDEST: Length = Length::from_um(100_000);

const WHOLE_TURN_MDEG: i32 = 360_000;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Id(pub u32);

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Layer {
    #[default]
    Top,
    Bottom,
    /// Copper on both sides, for pads with a hole.
    Both,
    /// Board edge: tracks only; the area inside their centre lines is the board.
    Edge,
}

impl Layer {
    pub const ALL: [Self; 4] = [Self::Top, Self::Bottom, Self::Both, Self::Edge];

    pub const fn word(self) -> &'static str {
        match self {
            Self::Top => "top",
            Self::Bottom => "bottom",
            Self::Both => "both",
            Self::Edge => "edge",
        }
    }

    /// True if both have copper on a common side, or both are the edge.
    pub fn meets(self, other: Self) -> bool {
        self == other
            || self == Self::Both && other != Self::Edge
            || other == Self::Both && self != Self::Edge
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PadShape {
    /// Size: diameter.
    #[default]
    Circle,
    /// Size: edge length.
    Square,
    /// Size: distance of opposite edges.
    Octagon,
}

impl PadShape {
    pub const ALL: [Self; 3] = [Self::Circle, Self::Square, Self::Octagon];

    /// Name in message keys.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Circle => "circle",
            Self::Square => "square",
            Self::Octagon => "octagon",
        }
    }

    /// Smallest rotation that leaves it unchanged, in thousandths of a degree.
    const fn symmetry_mdeg(self) -> i32 {
        match self {
            Self::Circle => 1,
            Self::Square => 90_000,
            Self::Octagon => 45_000,
        }
    }
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Thing {
    Node {
        at: Point,
    },
    Track {
        from: Id,
        to: Id,
        width: Length,
        layer: Layer,
    },
    Pad {
        node: Id,
        shape: PadShape,
        size: Length,
        /// Counter-clockwise, in thousandths of a degree.
        #[serde(default)]
        turn_mdeg: i32,
        layer: Layer,
    },
    Hole {
        node: Id,
        diameter: Length,
        plated: bool,
    },
    Group {
        name: String,
    },
    /// A modified object of an imported file, or a copy of one. The file itself is never changed.
    ///
    /// The object keeps its file and aperture. An edit mirrors and rotates it about its original position,
    /// then moves it. Apertures use `%LM` and `%LR` of the format; strokes and contours get new points.
    /// Quarter turns and mirrors are exact; at any other angle every point is rounded to whole nanometres.
    /// The rotation always starts from the original, so repeated rotations add no error.
    Imported {
        /// Name of the file, as read.
        file: String,
        /// Object number, from 0: expanded repeats follow all others; in a drill file hits, then slots, then
        /// routes.
        object: u32,
        /// Original position in the file. If the object is elsewhere, the file has changed.
        at: Point,
        /// Displacement; `None` if the object is removed.
        by: Option<Point>,
        /// Counter-clockwise, in thousandths of a degree.
        #[serde(default)]
        turn_mdeg: i32,
        /// Mirror left to right before rotating.
        #[serde(default)]
        mirror: bool,
        /// The original stays as well.
        #[serde(default)]
        copy: bool,
    },
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    #[serde(flatten)]
    pub thing: Thing,
    /// Its group; `None` at the top level.
    #[serde(default, rename = "in", skip_serializing_if = "Option::is_none")]
    pub group: Option<Id>,
}

impl Thing {
    /// Name in message keys.
    pub const fn word(&self) -> &'static str {
        match self {
            Self::Node { .. } => "node",
            Self::Track { .. } => "track",
            Self::Pad { .. } => "pad",
            Self::Hole { .. } => "hole",
            Self::Group { .. } => "group",
            Self::Imported { .. } => "imported",
        }
    }

    /// The nodes it is attached to.
    pub fn nodes(&self) -> impl Iterator<Item = Id> + use<> {
        let (one, two) = match self {
            Self::Track { from, to, .. } => (Some(*from), Some(*to)),
            Self::Pad { node, .. } | Self::Hole { node, .. } => (Some(*node), None),
            Self::Node { .. } | Self::Group { .. } | Self::Imported { .. } => (None, None),
        };
        one.into_iter().chain(two)
    }

    /// Placement of a file object about its original position; `None` if it was removed, and for other
    /// elements.
    pub fn placement(&self) -> Option<Placement> {
        match self {
            Self::Imported { by: Some(shift), turn_mdeg, mirror, .. } => {
                Some(Placement { mirror: *mirror, rotation_mdeg: *turn_mdeg, shift: *shift })
            }
            _ => None,
        }
    }

    /// Position of a file object; `None` if it was removed, and for other elements.
    pub fn place(&self) -> Option<Point> {
        match self {
            Self::Imported { at, by: Some(by), .. } => Some(shifted(*at, *by)),
            _ => None,
        }
    }

    /// True for a file object that equals its original.
    pub fn is_as_in_its_file(&self) -> bool {
        matches!(self, Self::Imported { copy: false, .. }) && self.placement() == Some(Placement::default())
    }

    /// Transforms a file object: its position by `place`, its mirror and rotation by `placement`.
    fn placed(self, placement: Placement, place: impl Fn(Point) -> Point) -> Self {
        match (self.place(), self) {
            (Some(now), Self::Imported { file, object, at, turn_mdeg, mirror, copy, .. }) => {
                let next = place(now);
                let by = Some(Point::new(next.x - at.x, next.y - at.y));
                let turn = if placement.mirror { -turn_mdeg } else { turn_mdeg };
                let turn_mdeg = turn.saturating_add(placement.rotation_mdeg).rem_euclid(WHOLE_TURN_MDEG);
                Self::Imported { file, object, at, by, turn_mdeg, mirror: mirror != placement.mirror, copy }
            }
            (_, other) => other,
        }
    }

    /// The layer of copper or edge; `None` for other elements.
    pub const fn layer(&self) -> Option<Layer> {
        match self {
            Self::Track { layer, .. } | Self::Pad { layer, .. } => Some(*layer),
            _ => None,
        }
    }
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Drawing {
    name: String,
    things: BTreeMap<Id, Entry>,
    /// Elements attached to a node, and members of a group. Derived from `things`.
    hanging: BTreeMap<Id, BTreeSet<Id>>,
    /// Nodes by position. Derived from `things`.
    places: BTreeSet<(Point, Id)>,
}

impl Drawing {
    pub fn named(name: &str) -> Self {
        Self { name: name.chars().take(LONGEST_NAME).collect(), ..Self::default() }
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    /// All elements, in the order of their ids.
    pub fn things(&self) -> impl Iterator<Item = (Id, &Entry)> {
        self.things.iter().map(|(id, entry)| (*id, entry))
    }

    pub fn len(&self) -> usize {
        self.things.len()
    }

    pub fn is_empty(&self) -> bool {
        self.things.is_empty()
    }

    pub fn get(&self, id: Id) -> Option<&Entry> {
        self.things.get(&id)
    }

    /// The element without its group.
    pub fn thing(&self, id: Id) -> Option<&Thing> {
        self.things.get(&id).map(|entry| &entry.thing)
    }

    pub fn at(&self, id: Id) -> Option<Point> {
        match self.thing(id)? {
            Thing::Node { at } => Some(*at),
            _ => None,
        }
    }

    pub fn hanging(&self, id: Id) -> impl Iterator<Item = Id> + '_ {
        self.hanging.get(&id).into_iter().flatten().copied()
    }

    /// Elements in no group, in the order of their ids.
    pub fn top(&self) -> impl Iterator<Item = Id> + '_ {
        self.things.iter().filter(|(_, entry)| entry.group.is_none()).map(|(id, _)| *id)
    }

    /// The first node exactly there.
    pub fn node_at(&self, at: Point) -> Option<Id> {
        self.places.range((at, Id(0))..=(at, Id(u32::MAX))).next().map(|(_, id)| *id)
    }

    pub fn next_id(&self) -> Id {
        Id(self.things.last_key_value().map_or(1, |(id, _)| id.0.saturating_add(1)))
    }

    /// `ids` with groups replaced by their members, recursively. Each once, in order.
    pub fn leaves(&self, ids: &BTreeSet<Id>) -> BTreeSet<Id> {
        let mut leaves = BTreeSet::new();
        let mut open: Vec<Id> = ids.iter().copied().collect();
        while let Some(id) = open.pop() {
            match self.thing(id) {
                Some(Thing::Group { .. }) => open.extend(self.hanging(id)),
                Some(_) => leaves.extend([id]),
                None => {}
            }
        }
        leaves
    }

    /// Positions of nodes and file objects of `ids`, including members of groups.
    pub fn spots_of(&self, ids: &BTreeSet<Id>) -> Vec<Point> {
        let nodes = self.nodes_of(ids).into_iter().filter_map(|node| self.at(node));
        let objects = self.leaves(ids).into_iter().filter_map(|id| self.thing(id)?.place());
        nodes.chain(objects).collect()
    }

    /// Nodes of `ids`, including members of groups, and `ids` that are nodes.
    pub fn nodes_of(&self, ids: &BTreeSet<Id>) -> BTreeSet<Id> {
        let mut nodes = BTreeSet::new();
        for id in self.leaves(ids) {
            match self.thing(id) {
                Some(Thing::Node { .. }) => nodes.extend([id]),
                Some(thing) => nodes.extend(thing.nodes()),
                None => {}
            }
        }
        nodes
    }
}
