//! Selects the layers that serve as evidence for a drill file: copper and outline of its board.
//!
//! ```text
//!   left.drl ◀── left-F_Cu.gbr, left-Edge_Cuts.gbr       its board, from its own folder first
//!            ╳   right-F_Cu.gbr                          another board is no evidence
//! ```

use crate::artwork::companion::{Companion, folder};
use crate::artwork::registration::Copper;
use crate::artwork::{FileRead, Role};
use crate::geometry::Bounds;
use std::collections::{BTreeMap, BTreeSet};

#[derive(Default)]
struct Witness {
    copper: Option<Copper>,
    outline: Option<Bounds>,
}

#[derive(Default)]
pub(in crate::artwork) struct Neighbours<'a> {
    /// Reports: name, bytes, content.
    pub(in crate::artwork) companions: Vec<(&'a str, &'a [u8], &'a Companion)>,
    pub(in crate::artwork) copper: Option<&'a Copper>,
    /// Bounding box of the outline of the same board.
    pub(in crate::artwork) outline: Option<Bounds>,
    /// All drill files and layers of its folder belong to one board.
    pub(in crate::artwork) one_board: bool,
}

/// The evidence of a set: by board and folder, and by board.
pub(in crate::artwork) struct Witnesses {
    near: BTreeMap<(String, String), Witness>,
    anywhere: BTreeMap<String, Witness>,
}

/// Collects copper and outlines of the boards in `asking`, those with drill programs.
pub(in crate::artwork) fn witnesses(
    layers: &[Option<FileRead>],
    boards: &[String],
    asking: &BTreeSet<&str>,
) -> Witnesses {
    let mut near: BTreeMap<(String, String), Vec<&FileRead>> = BTreeMap::new();
    let mut anywhere: BTreeMap<String, Vec<&FileRead>> = BTreeMap::new();
    for (layer, board) in layers.iter().zip(boards) {
        if let Some(layer) = layer.as_ref().filter(|_| asking.contains(board.as_str())) {
            near.entry((board.clone(), folder(&layer.name).to_owned())).or_default().push(layer);
            anywhere.entry(board.clone()).or_default().push(layer);
        }
    }
    // The fallback for a drill file whose folder has no layers of its board.
    anywhere.remove("");
    Witnesses {
        near: near.into_iter().map(|(key, layers)| (key, witness(&layers))).collect(),
        anywhere: anywhere.into_iter().map(|(key, layers)| (key, witness(&layers))).collect(),
    }
}

fn witness(layers: &[&FileRead]) -> Witness {
    let of_role = |role| {
        let ours = layers.iter().filter(move |layer| layer.role == role);
        ours.filter_map(|layer| Some((layer.name.as_str(), layer.gerber.as_ref()?)))
    };
    let boxes = of_role(Role::Outline).filter_map(|(_, layer)| layer.centre_bounds());
    Witness {
        copper: Copper::new(of_role(Role::Copper)).or_else(|| Copper::new(of_role(Role::Mask))),
        outline: boxes.reduce(|a, b| a.with(b.min).with(b.max)),
    }
}

impl Witnesses {
    /// The evidence for the drill file `name` of a board, without reports.
    pub(in crate::artwork) fn of(&self, name: &str, board: Option<&String>) -> Neighbours<'_> {
        let Some(board) = board.filter(|board| !board.is_empty()) else { return Neighbours::default() };
        let near = self.near.get(&(board.clone(), folder(name).to_owned()));
        let (near, far) = (near, self.anywhere.get(board));
        Neighbours {
            one_board: false,
            companions: Vec::new(),
            copper: near.and_then(|near| near.copper.as_ref()).or_else(|| far?.copper.as_ref()),
            outline: near.and_then(|near| near.outline).or_else(|| far?.outline),
        }
    }
}
