//! Programs in other controllers' words.
//!
//! ```text
//!  dialects/grbl.toml ─ words ─ read ─▶ Dialect (templates) ─┐
//!  names: blocks, parameters ──┘                             │
//!                      Program ──────────────────────────────┴─ writer ─ arcs ─ values ─ sheet ─▶ files
//!                      Program ─ excellon ──────────────────────────────────────────────────────▶ file
//! ```
//!
//! Comes in: a [`Program`]. Goes out: text. Does not know boards, plans or motion.

mod arcs;
mod dialect;
mod excellon;
mod names;
mod number;
mod preview;
mod read;
mod readback;
mod sheet;
mod template;
mod values;
mod words;
mod writer;

pub use dialect::{
    Arcs, Comments, Dialect, Files, Helix, LineStyle, Modal, NameStyle, Numbers, Templates, shipped,
};
pub use excellon::excellon;
pub use names::{BLOCKS, Block, BlockRow, PARAMETERS, Parameter, Part};
pub use number::{Format, Zeros};
pub use preview::{Sample, preview};
pub use read::check;
pub use readback::{Written, read_back, titled};
pub use writer::{OutputFile, write_with};

use crate::job::Program;
use crate::remark::{Remark, Weight};
use crate::units::Length;

/// What a program can be written for: `excellon`, and the dialects that ship.
pub fn targets() -> Vec<&'static str> {
    std::iter::once("excellon").chain(shipped().map(|(name, _)| name)).collect()
}

/// The dialect that ships under `name`.
pub fn dialect(name: &str) -> Option<Result<Dialect, Remark>> {
    let (name, text) = shipped().find(|(known, _)| *known == name)?;
    Some(Dialect::parse(&format!("{name}.toml"), text))
}

/// The program in the words of `target`; with `chord_error_mm` arcs become lines that are at most so far off, with `fall_to`
/// bits fall fast to that height over the board before they go on at their feed. None for an unknown target.
pub fn write(
    target: &str,
    program: &Program,
    chord_error_mm: Option<f64>,
    fall_to: Option<Length>,
) -> Option<Result<Vec<OutputFile>, Remark>> {
    if target == "excellon" {
        let file = |text| vec![OutputFile { name: writer::file_name(program, "drl"), text }];
        return Some(excellon(program, chord_error_mm).map(file));
    }
    let written =
        |dialect: Dialect| write_with(&dialect.with_lines(chord_error_mm).falling_to(fall_to), program);
    Some(dialect(target)?.and_then(written))
}

/// Blocks that go over the board, into it or out of it and say no height: after them the tip may be where nobody thinks. A
/// template may have its reasons, so they are notes.
pub fn doubts(dialect: &Dialect) -> Vec<Remark> {
    let mut doubts = Vec::new();
    for part in Part::ALL {
        let blocks = dialect.templates(part).into_iter().flat_map(|templates| &templates.blocks);
        for (block, template) in blocks {
            let names = |some: &[&str]| template.names().any(|name| some.contains(&name));
            let goes = match block {
                Block::Hole | Block::Peck | Block::Approach | Block::Leave => true,
                Block::Start | Block::Change | Block::End => names(&["X", "Y"]),
                _ => false,
            };
            if goes && !names(&["Z", "H", "U", "B", "DZ", "AZ"]) {
                let name = format!("{}.{}", part.key(), block.key());
                doubts.push(Remark::new(Weight::Note, "post.no_height").with("name", name));
            }
        }
    }
    doubts
}

/// The name among the targets that is nearest to `name`.
pub fn nearest_target(name: &str) -> &'static str {
    crate::remark::nearest(name, targets())
}
