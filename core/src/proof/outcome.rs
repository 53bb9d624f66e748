//! Result of a proof in one sentence, for the page and the command line.
//!
//! ```text
//!   ██ A ██   gap   ██ B ██     a net is isolated if no piece of copper with it holds another net;
//!           ├──────┤            the smallest gap is the least distance between the copper left of two nets
//! ```

use super::edges::{Edge, around, between};
use super::isolated::isolates;
use super::scene::Scene;
use crate::board::{Board, Face};
use crate::units::Length;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Wider gaps, in mm, are not measured: no tool is as wide.
const REACH_MM: f64 = 5.0;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Proven {
    #[default]
    NoCopper,
    /// The board has copper, but not on this side.
    OtherSide,
    Copper,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProofResult {
    pub proven: Proven,
    /// Whether the programs must isolate nets, or do.
    pub isolates: bool,
    /// Nets on this side.
    pub nets: u32,
    /// Nets that share no piece of copper with another one.
    pub isolated: u32,
    /// The least distance between the copper left of two nets; `None` if it exceeds any tool width.
    pub smallest_gap: Option<Length>,
}

impl ProofResult {
    /// Result for a side of `board` without copper.
    pub(super) fn nothing(board: &Board, face: Face) -> Self {
        let of = |wanted: Face| {
            let mut copper = board.copper.iter().filter(|copper| copper.face == wanted);
            copper.any(|copper| !copper.region.is_empty())
        };
        let other = of(if face == Face::Top { Face::Bottom } else { Face::Top });
        let proven = if other { Proven::OtherSide } else { Proven::NoCopper };
        Self { proven, ..Self::default() }
    }

    pub(super) fn of(scene: &Scene<'_>) -> Self {
        let nets = scene.labels.len() as u32;
        if nets == 0 {
            return Self::nothing(scene.board, scene.options.face);
        }
        let shared: BTreeSet<u32> =
            scene.nets_in.iter().filter(|nets| nets.len() > 1).flatten().copied().collect();
        Self {
            proven: Proven::Copper,
            isolates: isolates(scene),
            nets,
            isolated: nets - (shared.len() as u32).min(nets),
            smallest_gap: smallest_gap_mm(scene).map(Length::from_mm),
        }
    }

    /// The sentence: a key of the locale tables and its arguments. `unread`: findings not yet accepted.
    pub fn sentence(&self, unread: usize) -> (&'static str, Vec<(&'static str, String)>) {
        let counts = || vec![("nets", self.nets.to_string()), ("isolated", self.isolated.to_string())];
        match (self.proven, self.isolates, unread, self.smallest_gap) {
            (Proven::NoCopper, ..) => ("proof.outcome.no_copper", Vec::new()),
            (Proven::OtherSide, ..) => ("proof.outcome.other_side", Vec::new()),
            (_, true, 0, Some(gap)) => {
                let gap = ("gap", format!("{:.2}", gap.mm()));
                ("proof.outcome.proved", counts().into_iter().chain([gap]).collect())
            }
            (_, true, 0, None) => ("proof.outcome.proved_far", counts()),
            (_, true, ..) => {
                let unread = ("unread", unread.to_string());
                ("proof.outcome.unread", counts().into_iter().chain([unread]).collect())
            }
            (_, false, 0, _) => ("proof.outcome.not_isolating", counts()),
            (_, false, ..) => ("proof.outcome.not_isolating_unread", vec![("unread", unread.to_string())]),
        }
    }
}

/// The least distance between two pieces of the copper left with different nets, in mm.
fn smallest_gap_mm(scene: &Scene<'_>) -> Option<f64> {
    let edges = &scene.left_edges;
    let holds = |edge: &Edge| scene.nets_in(edge.island).filter(|nets| !nets.is_empty());
    let mut best = REACH_MM;
    // A first bound from some edges limits the search around the others.
    for (_, edge) in edges.iter().step_by((edges.numbers() / 64).max(1) as usize) {
        let Some(ours) = holds(&edge) else { continue };
        let other = |edge: &Edge| holds(edge).is_some_and(|nets| nets.is_disjoint(ours));
        best = edges.nearest(edge.from, best, &other).map_or(best, |(distance, ..)| best.min(distance));
    }
    for (index, edge) in edges.iter() {
        let Some(ours) = holds(&edge) else { continue };
        let (low, high) = around(edge.from, edge.to, best);
        edges.in_box(low, high, &mut |other_index, other| {
            if other_index > index && other.island != edge.island {
                let (width, ..) = between(&edge, other);
                if width < best && holds(other).is_some_and(|nets| nets.is_disjoint(ours)) {
                    best = width;
                }
            }
        });
    }
    (best < REACH_MM).then_some(best)
}
