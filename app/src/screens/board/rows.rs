//! The rows of the hole table: tools, and under each its holes in order of drilling.
//!
//! Comes in: a board and its plan. Goes out: [`Tool`]s and [`Row`]s. Knows no layout.

use crate::engine::messages::Planned;
use crate::picture;
use crate::view::Palette;
use annulus_core::board::Board;
use annulus_core::units::Length;

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

/// The tools of `board`, by its plan if there is one.
pub(crate) fn tools(board: &Board, plan: Option<&Planned>) -> Vec<Tool> {
    if let Some(plan) = plan {
        let planned =
            plan.bits.iter().map(|bit| tool(board, Some(bit.diameter), bit.sizes.clone(), bit.holes.clone()));
        return planned.collect();
    }
    let mut sizes: Vec<Option<Length>> = board.holes.iter().map(|hole| hole.diameter).collect();
    sizes.sort_unstable();
    sizes.dedup();
    let of_size = |size: Option<Length>| {
        let holes = (0..).zip(&board.holes).filter(|(_, hole)| hole.diameter == size).map(|(index, _)| index);
        tool(board, None, size.into_iter().collect(), holes.collect())
    };
    sizes.into_iter().map(of_size).collect()
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
