//! Writes programs for other controllers, and reads them back.
//!
//! ```text
//!  dialects/grbl.toml ─ words ─ read ─▶ Dialect (templates) ─┐
//!  names: blocks, parameters ──┘                             │
//!          Program, Briefing ─ head ─────────────────────────┴─ writer ─ arcs ─ values ─ sheet ─▶ files
//!                      Program ─ excellon ────────────────────────────────────────────────────▶ file
//!              files ─ readback ─ again ──────────────────────────────────────────────────────▶ differences
//!                    Briefing ─ run_sheet ────────────────────────────────────────────────────▶ printed page
//! ```

mod again;
mod arcs;
mod dialect;
mod excellon;
mod head;
mod lined;
mod names;
mod number;
mod preview;
mod read;
mod readback;
mod run_sheet;
mod sheet;
mod template;
mod values;
mod words;
mod writer;

use crate::note;
pub use again::{Differences, proved};
pub use dialect::{
    Arcs, Changes, Comments, Dialect, FileSplit, Helix, LineStyle, Modal, NameStyle, NumberStyle, Rapids,
    Templates, shipped,
};
pub use excellon::excellon;
pub use names::{BLOCKS, Block, BlockRow, PARAMETERS, TemplateKind, TemplateParameter};
pub use number::{Format, TrailingZeros};
pub use preview::preview;
pub use read::check;
pub use readback::{ReadBack, read_back, read_back_for, titled};
pub use run_sheet::{RunSheet, SheetRow, run_sheet};
pub use writer::{OutputFile, Sample, write_side, write_with};

use crate::diagnostic::Diagnostic;
use crate::job::{Briefing, Program};
use crate::machine::Machine;
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// Output formats: `excellon`, and the shipped dialects.
pub fn targets() -> Vec<&'static str> {
    std::iter::once("excellon").chain(shipped().map(|(name, _)| name)).collect()
}

pub fn dialect(name: &str) -> Option<Result<Dialect, Diagnostic>> {
    let (name, text) = shipped().find(|(known, _)| *known == name)?;
    Some(Dialect::parse(&format!("{name}.toml"), text))
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Manner {
    pub lines_only_mm: Option<f64>,
    /// Height over the board down to which tools descend as a rapid; `None` if unknown.
    pub fall_to: Option<Length>,
    /// Height over the board for tool changes; `None`: the safe height.
    pub change_at: Option<Length>,
    /// Rapid speeds, for controllers that need them stated; `None` if unknown.
    pub rapids: Option<Rapids>,
    /// When a new file starts, if not as in the dialect.
    pub files: Option<FileSplit>,
}

impl Manner {
    /// Options for `machine`: its feed height and change height, and rapids no faster than its axes.
    pub fn on(machine: &Machine) -> Self {
        let process = &machine.process;
        Self {
            fall_to: Some(process.feed_height),
            rapids: Some(rapids(machine)),
            change_at: Some(machine.change_height()),
            ..Self::default()
        }
    }
}

/// The default rapids, limited to the axes of `machine`.
fn rapids(machine: &Machine) -> Rapids {
    let usual = Rapids::default();
    let bounded = |usual: u32, speed_mm_per_s: f64| usual.min((speed_mm_per_s * 60.0).max(1.0) as u32);
    let over = machine.x.max_speed_mm_per_s.min(machine.y.max_speed_mm_per_s);
    Rapids {
        over_mm_per_min: bounded(usual.over_mm_per_min, over),
        up_mm_per_min: bounded(usual.up_mm_per_min, machine.z.max_speed_mm_per_s),
    }
}

impl Dialect {
    #[must_use]
    pub fn in_manner(self, manner: &Manner) -> Self {
        let dialect = self.with_lines(manner.lines_only_mm).falling_to(manner.fall_to);
        dialect.changing_at(manner.change_at).rapid_at(manner.rapids).in_files(manner.files)
    }
}

/// The program in the format `target`; `None` for an unknown target.
pub fn write(
    target: &str,
    program: &Program,
    manner: &Manner,
) -> Option<Result<Vec<OutputFile>, Diagnostic>> {
    write_for(target, program, manner, &Briefing::of(program), 0)
}

/// As [`write()`], for side `side` of a job.
pub fn write_for(
    target: &str,
    program: &Program,
    manner: &Manner,
    briefing: &Briefing,
    side: usize,
) -> Option<Result<Vec<OutputFile>, Diagnostic>> {
    if target == "excellon" {
        let bits: Vec<u32> = (0..).zip(&program.bits).map(|(index, _)| index).collect();
        let numbers = bits.iter().map(|bit| bit + 1).collect();
        let name = writer::file_name(program, "drl");
        let file = |(text, commands)| {
            vec![OutputFile { name, text, commands, bits, numbers, ..OutputFile::default() }]
        };
        return Some(excellon::lined(program, manner.lines_only_mm).map(file));
    }
    let written = |dialect: Dialect| write_side(&dialect.in_manner(manner), program, briefing, side);
    Some(dialect(target)?.and_then(written))
}

/// Notes about blocks that cross the board's surface without a height: afterwards the tip may be at an
/// unexpected height. Templates may do this on purpose, so they are only notes.
pub fn warnings(dialect: &Dialect) -> Vec<Diagnostic> {
    let mut warnings = Vec::new();
    for part in TemplateKind::ALL {
        let blocks = dialect.templates(part).into_iter().flat_map(|templates| &templates.blocks);
        for (block, template) in blocks {
            let names = |some: &[&str]| template.names().any(|name| some.contains(&name));
            let goes = match block {
                Block::Hole | Block::Peck | Block::Approach | Block::Leave => true,
                Block::Start | Block::Change | Block::End => names(&["X", "Y"]),
                _ => false,
            };
            // The reference point of Z is a height too.
            let referred = ["G28", "G30", "G53", "SUPA", "M91"].iter().any(|word| template.says(word));
            if goes && !referred && !names(&["Z", "H", "HC", "U", "B", "DZ", "AZ"]) {
                let name = format!("{}.{}", part.key(), block.key());
                warnings.push(note!("post.no_height", name = name));
            }
        }
    }
    warnings
}

/// The target with the most similar name.
pub fn nearest_target(name: &str) -> &'static str {
    crate::diagnostic::nearest(name, targets())
}
