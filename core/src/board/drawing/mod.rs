//! A board drawn by hand: nodes, and what hangs on them, in groups within groups (S1, S3).
//!
//! ```text
//!  group "Motor driver"                 a track hangs on two nodes, a pad and a hole on one:
//!   ├─ group "U1"                       who moves a node moves all that hangs on it
//!   │   ├─ pad ▢ ── node 7
//!   │   └─ hole ○ ── node 7             ●═══════════● track
//!   └─ track ── nodes 7, 9              7           9
//! ```
//!
//! Comes in: [`Edit`]s. Goes out: a [`Drawing`], which is plain data; and what was before, as an edit. Lengths are whole
//! nanometres. Does not know screens, and not how copper is milled.

mod body;
mod change;
mod clip;
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
pub use clip::pasted;
pub use edit::{Edit, whole_turn};
pub use figures::{DrawingFigures, Smallest, WINDOW};
pub use files::{files, stem};
pub use find::{Catch, Finder, Snap, whole};
pub use history::History;
pub use imported::{Imported, imported};
pub use over::{files_over, lay_over, lay_over_all, read_under, read_under_telling};
pub use selection::{Align, Selection, Sides, put_back};
pub use svg::{board_svg, svg};
pub use text::{is_one, read, write};

use crate::geometry::{Placement, Point};
use crate::units::Length;
use body::shifted;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// The most things in a drawing.
pub const MOST_THINGS: usize = 100_000;
/// The longest name, in letters.
pub const LONGEST_NAME: usize = 200;
/// How far from the zero point a drawing may reach: 1 m either way.
pub const FURTHEST: Length = Length::from_um(1_000_000);
/// The narrowest track, the smallest pad and hole.
pub const NARROWEST: Length = Length::from_um(10);
/// The widest of them.
pub const WIDEST: Length = Length::from_um(100_000);

/// A whole turn in thousandths of a degree.
const WHOLE_TURN_MDEG: i32 = 360_000;

/// Tells one thing of a drawing from the others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Id(pub u32);

/// Where copper, or an edge, is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Layer {
    /// Copper of the component side.
    #[default]
    Top,
    /// Copper of the solder side.
    Bottom,
    /// Copper of both sides, for pads with a hole.
    Both,
    /// The edge of the board: tracks alone; what their middle lines enclose is board.
    Edge,
}

impl Layer {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Top, Self::Bottom, Self::Both, Self::Edge];

    /// Its word in files and in the address of a sentence.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Top => "top",
            Self::Bottom => "bottom",
            Self::Both => "both",
            Self::Edge => "edge",
        }
    }

    /// Whether the two have copper of one side in common, or are both the edge.
    pub fn meets(self, other: Self) -> bool {
        self == other
            || self == Self::Both && other != Self::Edge
            || other == Self::Both && self != Self::Edge
    }
}

/// The form of a pad.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PadShape {
    /// Round; its size is the diameter.
    #[default]
    Circle,
    /// Its size is a side.
    Square,
    /// Its size is from one flat to the other.
    Octagon,
}

impl PadShape {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Circle, Self::Square, Self::Octagon];

    /// Its word in the address of a sentence.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Circle => "circle",
            Self::Square => "square",
            Self::Octagon => "octagon",
        }
    }

    /// By so much a turn leaves it as it was, in thousandths of a degree.
    const fn symmetry_mdeg(self) -> i32 {
        match self {
            Self::Circle => 1,
            Self::Square => 90_000,
            Self::Octagon => 45_000,
        }
    }
}

/// What a thing is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Thing {
    /// A place that others hang on.
    Node {
        /// Where it is.
        at: Point,
    },
    /// A straight track with round ends.
    Track {
        /// The node of one end.
        from: Id,
        /// That of the other.
        to: Id,
        /// How wide.
        width: Length,
        /// Where it lies.
        layer: Layer,
    },
    /// A pad.
    Pad {
        /// The node of its middle.
        node: Id,
        /// Its form.
        shape: PadShape,
        /// How large, see [`PadShape`].
        size: Length,
        /// Rotation counter-clockwise in thousandths of a degree.
        #[serde(default)]
        turn_mdeg: i32,
        /// Where it lies.
        layer: Layer,
    },
    /// A drilled hole.
    Hole {
        /// The node of its middle.
        node: Id,
        /// Finished diameter.
        diameter: Length,
        /// Whether it is plated.
        plated: bool,
    },
    /// Things that belong together.
    Group {
        /// What it is called.
        name: String,
    },
    /// Something of an imported file that is not as the file says, or a copy of it. The file itself is never changed.
    ///
    /// It stays an object of its file, with its aperture: mirrored and turned about the place where the file puts it, then moved.
    /// An aperture is held so, as `%LM` and `%LR` of the format hold it; strokes and contours get their points anew. Quarter turns
    /// and mirrors are exact; at any other angle every point is the nearest whole nanometre. However often it is turned, it is
    /// turned once, from how the file draws it: no error adds up.
    Imported {
        /// The file, by its name as read.
        file: String,
        /// Which of its objects, from 0: what repeats draw comes behind all others; in a drill file hits, then slots, then routes.
        object: u32,
        /// Where the file puts it: if that is somewhere else, the file is another one by now.
        at: Point,
        /// It is moved by so much; none where it is taken out.
        by: Option<Point>,
        /// Rotation counter-clockwise in thousandths of a degree.
        #[serde(default)]
        turn_mdeg: i32,
        /// Left becomes right before it is turned.
        #[serde(default)]
        mirror: bool,
        /// It is there beside the one in the file.
        #[serde(default)]
        copy: bool,
    },
}

/// A thing with its place in the tree.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// What it is.
    #[serde(flatten)]
    pub thing: Thing,
    /// The group it belongs to; none at the top.
    #[serde(default, rename = "in", skip_serializing_if = "Option::is_none")]
    pub group: Option<Id>,
}

impl Thing {
    /// Its word in the address of a sentence.
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

    /// The nodes it hangs on.
    pub fn nodes(&self) -> impl Iterator<Item = Id> + use<> {
        let (one, two) = match self {
            Self::Track { from, to, .. } => (Some(*from), Some(*to)),
            Self::Pad { node, .. } | Self::Hole { node, .. } => (Some(*node), None),
            Self::Node { .. } | Self::Group { .. } | Self::Imported { .. } => (None, None),
        };
        one.into_iter().chain(two)
    }

    /// How an object of a file lies, about the place where its file puts it; none where it is taken out, and for all others.
    pub fn placement(&self) -> Option<Placement> {
        match self {
            Self::Imported { by: Some(shift), turn_mdeg, mirror, .. } => {
                Some(Placement { mirror: *mirror, rotation_mdeg: *turn_mdeg, shift: *shift })
            }
            _ => None,
        }
    }

    /// Where an object of a file lies; none where it is taken out, and for all others.
    pub fn place(&self) -> Option<Point> {
        match self {
            Self::Imported { at, by: Some(by), .. } => Some(shifted(*at, *by)),
            _ => None,
        }
    }

    /// Whether it is an object of a file that is as its file says.
    pub fn is_as_in_its_file(&self) -> bool {
        matches!(self, Self::Imported { copy: false, .. }) && self.placement() == Some(Placement::default())
    }

    /// An object of a file placed anew: its place goes as `place` says, and it is mirrored and turned as `placement` does.
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

    /// Where its copper is, if it is copper or an edge.
    pub const fn layer(&self) -> Option<Layer> {
        match self {
            Self::Track { layer, .. } | Self::Pad { layer, .. } => Some(*layer),
            _ => None,
        }
    }
}

/// A drawn board, or what is drawn over files.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Drawing {
    name: String,
    things: BTreeMap<Id, Entry>,
    /// What hangs on a node, and what is in a group. Follows from `things`.
    hanging: BTreeMap<Id, BTreeSet<Id>>,
    /// Nodes by their places. Follows from `things`.
    places: BTreeSet<(Point, Id)>,
}

impl Drawing {
    /// An empty drawing with a name for people.
    pub fn named(name: &str) -> Self {
        Self { name: name.chars().take(LONGEST_NAME).collect(), ..Self::default() }
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Everything in it, in the order of the ids.
    pub fn things(&self) -> impl Iterator<Item = (Id, &Entry)> {
        self.things.iter().map(|(id, entry)| (*id, entry))
    }

    /// How many things there are.
    pub fn len(&self) -> usize {
        self.things.len()
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.things.is_empty()
    }

    /// What `id` is.
    pub fn get(&self, id: Id) -> Option<&Entry> {
        self.things.get(&id)
    }

    /// What `id` is, without its group.
    pub fn thing(&self, id: Id) -> Option<&Thing> {
        self.things.get(&id).map(|entry| &entry.thing)
    }

    /// Where node `id` is.
    pub fn at(&self, id: Id) -> Option<Point> {
        match self.thing(id)? {
            Thing::Node { at } => Some(*at),
            _ => None,
        }
    }

    /// What hangs on a node, or is in a group.
    pub fn hanging(&self, id: Id) -> impl Iterator<Item = Id> + '_ {
        self.hanging.get(&id).into_iter().flatten().copied()
    }

    /// What is in no group, in the order of the ids.
    pub fn top(&self) -> impl Iterator<Item = Id> + '_ {
        self.things.iter().filter(|(_, entry)| entry.group.is_none()).map(|(id, _)| *id)
    }

    /// The first node exactly there.
    pub fn node_at(&self, at: Point) -> Option<Id> {
        self.places.range((at, Id(0))..=(at, Id(u32::MAX))).next().map(|(_, id)| *id)
    }

    /// An id that is larger than all that are there.
    pub fn next_id(&self) -> Id {
        Id(self.things.last_key_value().map_or(1, |(id, _)| id.0.saturating_add(1)))
    }

    /// `ids` without groups: in place of a group all that is in it and in the groups in it. Each once, in order.
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

    /// The places of `ids` and of all in the groups among them: of their nodes, and of objects of files.
    pub fn spots_of(&self, ids: &BTreeSet<Id>) -> Vec<Point> {
        let nodes = self.nodes_of(ids).into_iter().filter_map(|node| self.at(node));
        let objects = self.leaves(ids).into_iter().filter_map(|id| self.thing(id)?.place());
        nodes.chain(objects).collect()
    }

    /// The nodes of `ids`, of all in the groups among them, and those among them that are nodes.
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
