//! The rows of the hole table: tools with their holes in drill order; then, by size, the holes that no tool
//! drills.

use crate::engine::messages::PlanReady;
use crate::picture;
use crate::view::Palette;
use annulus_core::board::Board;
use annulus_core::units::Length;
use std::collections::{BTreeMap, BTreeSet};

/// A tool; before there is a plan, a hole size.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tool {
    /// None before there is a plan, and for holes that aren't drilled.
    pub bit: Option<Length>,
    pub sizes: Vec<Length>,
    pub holes: Vec<u32>,
    /// Number of holes that the files call plated, and not plated.
    pub plated: (usize, usize),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Row {
    Tool(usize),
    /// A hole, and its number in the drill order, from 1.
    Hole(u32, usize),
}

fn tool(board: &Board, bit: Option<Length>, sizes: Vec<Length>, holes: Vec<u32>) -> Tool {
    let said = |wanted: bool| {
        let is = |hole: &&u32| board.holes.get(**hole as usize).and_then(|hole| hole.plated) == Some(wanted);
        holes.iter().filter(is).count()
    };
    Tool { plated: (said(true), said(false)), bit, sizes, holes }
}

/// The tools of `board`, from its plan if there is one. A plan can have several copies and pin holes; the
/// board's own holes have the lowest indices.
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

/// The `wanted` holes by size, without a tool: they are milled or left out.
fn by_size(board: &Board, wanted: impl Fn(u32) -> bool) -> Vec<Tool> {
    let mut found: BTreeMap<Option<Length>, Vec<u32>> = BTreeMap::new();
    for (index, hole) in (0..).zip(&board.holes).filter(|(index, _)| wanted(*index)) {
        found.entry(hole.diameter).or_default().push(index);
    }
    found.into_iter().map(|(size, holes)| tool(board, None, size.into_iter().collect(), holes)).collect()
}

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

pub(super) fn swatch(board: &Board, size: Option<Length>) -> String {
    let sizes = picture::sizes(board);
    let index = size.map_or(0, |size| sizes.partition_point(|other| *other < size));
    Palette::DARK.tool(index).css()
}
