//! The layers of a set while their roles are determined.

use super::layer_shape::Shape;
use super::role::Ground;
use super::{FileRead, Side};
use crate::units::Length;

/// The layers of a set, in the order of its files; `None` for other files.
pub(super) type Layers = [Option<FileRead>];

/// Tolerance for copper outside its board's outline.
pub(super) const OVERHANG: Length = Length::from_um(1_000);

/// How a layer's drawing contradicts a name that means copper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Contradiction {
    /// It has no tracks. Its role stays copper.
    PadsAlone,
    /// Its strokes and contours miss all holes. Its role stays copper.
    MissesHoles,
    /// It is a mask or paste. The name gives this side.
    Opening(Option<Side>),
    /// No hole is on it, and only its layer number means copper. The role becomes other.
    Nothing,
}

/// A layer and what is known about it.
pub(super) struct Row {
    pub(super) index: usize,
    pub(super) ground: Ground,
    /// The side is only a guess.
    pub(super) unsure: bool,
    /// Two certain sources give different sides.
    pub(super) is_disputed: bool,
    /// A certain reason names another side than its number, counted from 1.
    pub(super) is_numbered_otherwise: bool,
    pub(super) number: Option<u32>,
    /// Words of its board's name.
    pub(super) stem: Vec<String>,
    /// By their names, the drill files of its folder belong to one board.
    pub(super) one_board: bool,
    /// Measured only if needed.
    pub(super) shape: Option<Shape>,
    /// How its drawing contradicts a name that means copper.
    pub(super) contradiction: Option<Contradiction>,
    /// Lost the role of copper because of its drawing.
    pub(super) is_drawn_otherwise: bool,
}

impl Row {
    /// True if both can belong to one board: by their names, or because only words give their roles and the
    /// folder has the drill files of one board.
    pub(super) fn is_kin(&self, other: &Self) -> bool {
        let weak = self.ground.min(other.ground) <= Ground::Words;
        self.stem.iter().zip(&other.stem).all(|(a, b)| a == b) || self.one_board && weak
    }
}
