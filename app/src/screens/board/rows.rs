//! The rows of the hole table: tools, and under each its holes in order of drilling; last what no bit drills, by its size.
//!
//! Comes in: a board and its plan. Goes out: [`Tool`]s and [`Row`]s. Knows no layout.

use crate::engine::messages::PlanReady;
use crate::picture;
use crate::view::Palette;
use annulus_core::board::Board;
use annulus_core::units::Length;
use std::collections::{BTreeMap, BTreeSet};

/// A bit, or a size before there is a plan.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tool {
    /// Diameter of the bit; none before there is a plan.
    pub bit: Option<Length>,
    /// The sizes in the files that it stands in for.
    pub sizes: Vec<Length>,
    /// Its holes in order of drilling.
    pub holes: Vec<u32>,
    /// How many of them are plated, and how many are said not to be.
    pub plated: (usize, usize),
}

/// One line of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Row {
    /// Head of a tool: its index.
    Tool(usize),
    /// A hole with its number in the order of drilling, from 1.
    Hole(u32, usize),
}

fn tool(board: &Board, bit: Option<Length>, sizes: Vec<Length>, holes: Vec<u32>) -> Tool {
    let said = |wanted: bool| {
        let is = |hole: &&u32| board.holes.get(**hole as usize).and_then(|hole| hole.plated) == Some(wanted);
        holes.iter().filter(is).count()
    };
    Tool { plated: (said(true), said(false)), bit, sizes, holes }
}

/// The tools of `board`, by its plan if there is one. A plan may be of several copies, with holes for pins behind theirs: the holes
/// of the board itself are the first.
pub(crate) fn tools(board: &Board, plan: Option<&PlanReady>) -> Vec<Tool> {
    if let Some(plan) = plan {
        let own = |holes: &[u32]| -> Vec<u32> {
            holes.iter().copied().filter(|hole| (*hole as usize) < board.holes.len()).collect()
        };
        let bits = plan.bits.iter().map(|bit| (bit, own(&bit.holes))).filter(|(_, holes)| !holes.is_empty());
        let planned = bits.map(|(bit, holes)| tool(board, Some(bit.diameter), bit.sizes.clone(), holes));
        let drilled: BTreeSet<u32> = plan.bits.iter().flat_map(|bit| bit.holes.iter().copied()).collect();
        return planned.chain(by_size(board, |hole| !drilled.contains(&hole))).collect();
    }
    by_size(board, |_| true)
}

/// Those of the holes that are `wanted`, by size: no bit drills them, they are milled or left out.
fn by_size(board: &Board, wanted: impl Fn(u32) -> bool) -> Vec<Tool> {
    let mut found: BTreeMap<Option<Length>, Vec<u32>> = BTreeMap::new();
    for (index, hole) in (0..).zip(&board.holes).filter(|(index, _)| wanted(*index)) {
        found.entry(hole.diameter).or_default().push(index);
    }
    found.into_iter().map(|(size, holes)| tool(board, None, size.into_iter().collect(), holes)).collect()
}

/// Every line, tool by tool.
pub(crate) fn rows(tools: &[Tool]) -> Vec<Row> {
    let mut number = 0;
    let mut rows = Vec::new();
    for (index, tool) in tools.iter().enumerate() {
        rows.push(Row::Tool(index));
        for hole in &tool.holes {
            number += 1;
            rows.push(Row::Hole(*hole, number));
        }
    }
    rows
}

/// The colour of holes of `size` in the picture.
pub(super) fn swatch(board: &Board, size: Option<Length>) -> String {
    let sizes = picture::sizes(board);
    let index = size.map_or(0, |size| sizes.partition_point(|other| *other < size));
    Palette::DARK.tool(index).css()
}
