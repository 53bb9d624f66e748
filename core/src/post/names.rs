//! Table of template elements. Blocks: one for each elementary action. Parameters: name, unit, example, and
//! the blocks that may use them.
//!
//! Their descriptions are `post.block.<part>.<key>` and `post.parameter.<name>` in the locale tables. The
//! page, the command line, the manual and the tests read this table.

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TemplateKind {
    /// Holes, by drill cycles of the spindle.
    Drill,
    /// Toolpaths, milled with the tip in the board.
    Engrave,
}

impl TemplateKind {
    pub const ALL: [Self; 2] = [Self::Drill, Self::Engrave];

    pub const fn key(self) -> &'static str {
        match self {
            Self::Drill => "drill",
            Self::Engrave => "engrave",
        }
    }
}

/// A piece of a template: the text of one elementary action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Block {
    Start,
    /// Once for every tool.
    Change,
    /// Once at the start of a file for a single tool, instead of `Change`.
    Load,
    /// If the spindle speed changes in between.
    Spindle,
    /// Once for every hole with one drill cycle.
    Hole,
    /// Once for every drill cycle of a pecked hole.
    Peck,
    /// Over a position and down into the board.
    Approach,
    Line,
    /// Along a clockwise arc.
    ArcCw,
    /// Along a counter-clockwise arc.
    ArcCcw,
    /// Along a clockwise helix.
    HelixCw,
    /// Along a counter-clockwise helix.
    HelixCcw,
    /// A pause in the board.
    Wait,
    Leave,
    End,
}

const EVERY: &[Block] = &[
    Block::Start,
    Block::Change,
    Block::Load,
    Block::Spindle,
    Block::Hole,
    Block::Peck,
    Block::Approach,
    Block::Line,
    Block::ArcCw,
    Block::ArcCcw,
    Block::HelixCw,
    Block::HelixCcw,
    Block::Wait,
    Block::Leave,
    Block::End,
];
/// Blocks with a position, ordered so that each parameter set covers a contiguous range.
///
/// ```text
///  start change load | hole peck approach line | arcs helices | leave | end
///                    |             |       └────── CURVES ───┘       |
///                    |             └────── MOVES (with line) ┘       |
///                    └──────────── FEEDS ────────────────────┘       |
///                    └──────────── HEIGHTS ──────────────────────────┘
/// ```
const PLACES: &[Block] = &[
    Block::Start,
    Block::Change,
    Block::Load,
    Block::Hole,
    Block::Peck,
    Block::Approach,
    Block::Line,
    Block::ArcCw,
    Block::ArcCcw,
    Block::HelixCw,
    Block::HelixCcw,
    Block::Leave,
    Block::End,
];
const HEIGHTS: &[Block] = places(3, 12);
const FEEDS: &[Block] = places(3, 11);
const MOVES: &[Block] = places(6, 11);
pub(super) const CURVES: &[Block] = places(7, 11);

const fn places(from: usize, to: usize) -> &'static [Block] {
    PLACES.split_at(to).0.split_at(from).1
}

const FALLS: &[Block] = places(3, 6);
const STROKES: &[Block] = &[Block::Hole, Block::Peck];
const PAUSES: &[Block] = &[Block::Change, Block::Load, Block::Spindle, Block::Hole, Block::Peck, Block::Wait];

impl Block {
    pub const fn key(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Change => "change",
            Self::Load => "load",
            Self::Spindle => "spindle",
            Self::Hole => "hole",
            Self::Peck => "peck",
            Self::Approach => "approach",
            Self::Line => "line",
            Self::ArcCw => "arc_cw",
            Self::ArcCcw => "arc_ccw",
            Self::HelixCw => "helix_cw",
            Self::HelixCcw => "helix_ccw",
            Self::Wait => "wait",
            Self::Leave => "leave",
            Self::End => "end",
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockRow {
    pub part: TemplateKind,
    pub block: Block,
    /// Required in every dialect.
    pub required: bool,
}

const fn block(part: TemplateKind, block: Block, required: bool) -> BlockRow {
    BlockRow { part, block, required }
}

/// Blocks of both templates in output order.
pub const BLOCKS: &[BlockRow] = &[
    block(TemplateKind::Drill, Block::Start, true),
    block(TemplateKind::Drill, Block::Change, true),
    block(TemplateKind::Drill, Block::Load, false),
    block(TemplateKind::Drill, Block::Spindle, false),
    block(TemplateKind::Drill, Block::Hole, true),
    block(TemplateKind::Drill, Block::Peck, false),
    block(TemplateKind::Drill, Block::End, true),
    block(TemplateKind::Engrave, Block::Start, true),
    block(TemplateKind::Engrave, Block::Change, false),
    block(TemplateKind::Engrave, Block::Load, false),
    block(TemplateKind::Engrave, Block::Spindle, false),
    block(TemplateKind::Engrave, Block::Approach, true),
    block(TemplateKind::Engrave, Block::Line, true),
    block(TemplateKind::Engrave, Block::ArcCw, false),
    block(TemplateKind::Engrave, Block::ArcCcw, false),
    block(TemplateKind::Engrave, Block::HelixCw, false),
    block(TemplateKind::Engrave, Block::HelixCcw, false),
    block(TemplateKind::Engrave, Block::Wait, false),
    block(TemplateKind::Engrave, Block::Leave, true),
    block(TemplateKind::Engrave, Block::End, true),
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TemplateParameter {
    /// The name between the `@`.
    pub name: &'static str,
    /// Unit of the number; empty for counts and words.
    pub unit: &'static str,
    pub example: &'static str,
    /// Default decimals; `None` for lengths, which follow the dialect.
    pub decimals: Option<u32>,
    /// Text, not a number: arithmetic is not possible.
    pub word: bool,
    /// Blocks that may use it.
    pub blocks: &'static [Block],
}

const fn length(name: &'static str, example: &'static str, blocks: &'static [Block]) -> TemplateParameter {
    TemplateParameter { name, unit: "mm", example, decimals: None, word: false, blocks }
}

const fn number(
    name: &'static str,
    unit: &'static str,
    example: &'static str,
    decimals: u32,
    blocks: &'static [Block],
) -> TemplateParameter {
    TemplateParameter { name, unit, example, decimals: Some(decimals), word: false, blocks }
}

const fn word(name: &'static str, example: &'static str) -> TemplateParameter {
    TemplateParameter { name, unit: "", example, decimals: None, word: true, blocks: EVERY }
}

/// The parameter whose line is repeated for every line of the header.
pub(super) const HEAD: &str = "HEAD";

pub const PARAMETERS: &[TemplateParameter] = &[
    length("X", "12.700", PLACES),
    length("Y", "8.890", PLACES),
    length("Z", "-0.100", HEIGHTS),
    length("H", "2.000", EVERY),
    length("HC", "20.000", EVERY),
    length("A", "0.300", FALLS),
    length("U", "2.000", STROKES),
    length("B", "0.500", STROKES),
    length("DX", "-1.270", MOVES),
    length("DY", "0.635", MOVES),
    length("DZ", "-0.050", MOVES),
    length("AX", "13.100", CURVES),
    length("AY", "9.200", CURVES),
    length("AZ", "-0.075", CURVES),
    length("I", "1.000", CURVES),
    length("J", "-0.500", CURVES),
    length("CX", "13.700", CURVES),
    length("CY", "8.390", CURVES),
    length("R", "1.118", CURVES),
    length("CR", "-1.118", CURVES),
    number("P", "°", "90.0000", 4, CURVES),
    number("F", "mm/min", "720.0", 1, FEEDS),
    number("V", "mm/s", "12.000", 3, FEEDS),
    number("S", "rpm", "30000", 0, EVERY),
    number("W", "s", "1.500", 3, PAUSES),
    number("T", "", "2", 0, EVERY),
    number("FILE", "", "2", 0, EVERY),
    number("RF", "mm/min", "3000", 0, EVERY),
    number("RZ", "mm/min", "300", 0, EVERY),
    length("D", "0.800", EVERY),
    length("TR", "0.400", EVERY),
    number("N", "", "10", 0, EVERY),
    number("K", "", "17", 0, EVERY),
    word("BIT", "drill 0.8"),
    word("JOB", "amplifier"),
    word("PROGRAM", "AMPLIFIER"),
    word(HEAD, "tool 2: drill 0.8"),
];

pub(super) fn parameter(name: &str) -> Option<&'static TemplateParameter> {
    PARAMETERS.iter().find(|row| row.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::nearest;
    use std::collections::BTreeSet;

    #[test]
    fn every_block_and_parameter_has_a_text() {
        for row in BLOCKS {
            let key = format!("post.block.{}.{}", row.part.key(), row.block.key());
            assert!(crate::locale::lookup("en", &key).is_some(), "no sentence {key}");
        }
        for parameter in PARAMETERS {
            let key = format!("post.parameter.{}", parameter.name);
            assert!(crate::locale::lookup("en", &key).is_some(), "no sentence {key}");
        }
        let names: BTreeSet<&str> = PARAMETERS.iter().map(|row| row.name).collect();
        assert_eq!(names.len(), PARAMETERS.len());
    }

    #[test]
    fn nearest_name_is_suggested() {
        let known = || PARAMETERS.iter().map(|row| row.name);
        let rows = [
            ("x", "X"),
            ("XA", "AX"),
            ("PROGRAMM", "PROGRAM"),
            ("JOBB", "JOB"),
            ("Cr", "CR"),
            ("BTI", "BIT"),
        ];
        for (typed, meant) in rows {
            assert_eq!(nearest(typed, known()), meant, "{typed}");
        }
        assert_eq!(nearest("aproach", BLOCKS.iter().map(|row| row.block.key())), "approach");
        assert_eq!(nearest("a", std::iter::empty()), "");
    }
}
