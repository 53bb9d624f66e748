//! Which layers are asked about a drill file: copper and outline of its board.
//!
//! Comes in: layers with their boards. Goes out: the copper, ready to be asked, and the box of the outline, for each drill file.
//! Asks nothing.
//!
//! ```text
//!   left.drl ◀── left-F_Cu.gbr, left-Edge_Cuts.gbr       its board, its folder first
//!            ╳   right-F_Cu.gbr                          another board is no evidence
//! ```

use super::companion::folder;
use super::read::Neighbours;
use super::registration::Copper;
use super::{FileRead, Role};
use crate::geometry::Bounds;
use std::collections::{BTreeMap, BTreeSet};

/// Copper and outline.
#[derive(Default)]
struct Witness {
    copper: Option<Copper>,
    outline: Option<Bounds>,
}

/// The witnesses of a set: by board and folder, and by board alone.
pub(super) struct Witnesses {
    near: BTreeMap<(String, String), Witness>,
    anywhere: BTreeMap<String, Witness>,
}

/// Collects copper and outlines of the boards that are `asking`: those with drill programs.
pub(super) fn witnesses(
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
    // Asked only by drill files of a board that lies in several folders.
    let spread = |board: &str| near.keys().filter(|(of, _)| of == board).count();
    anywhere.retain(|board, _| !board.is_empty() && spread(board) > 0);
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
    /// What is asked about the drill file `name` of a board, reports apart.
    pub(super) fn of(&self, name: &str, board: Option<&String>) -> Neighbours<'_> {
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
