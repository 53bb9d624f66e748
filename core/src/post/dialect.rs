//! The words of one controller: templates, number format, what it can do with arcs (S6 S7). The dialects that ship lie in
//! `dialects/`; a person can add others.
//!
//! Comes in: the text of a dialect file, by way of `read`. Goes out: a [`Dialect`]. Does not know programs.

use super::names::{Block, TemplateKind, parameter};
use super::number::Format;
use super::template::Template;
use crate::units::Length;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The words of one controller.
#[derive(Clone, Debug, PartialEq)]
pub struct Dialect {
    /// Name for people.
    pub name: String,
    /// When a new file begins.
    pub files: FileSplit,
    /// What programs and their files may be called, where not everything goes.
    pub program_name: Option<NameStyle>,
    /// How numbers are written, and which parameters differ.
    pub numbers: NumberStyle,
    /// Lines: numbers, ends, block delete.
    pub lines: LineStyle,
    /// Comments: their signs, and whether they stay.
    pub comments: Comments,
    /// What is left out where it has not changed.
    pub modal: Modal,
    /// What it can do with arcs.
    pub arcs: Arcs,
    /// How near to the board a bit falls fast before it goes on at its feed: the machine's height for that. None where nobody
    /// said: then it goes down at its feed all the way.
    pub fall_to: Option<Length>,
    /// How fast rapid moves are where the controller must be told.
    pub rapids: Rapids,
    /// How high over the board a bit is changed; none where nobody said: then at the safe height.
    pub change_at: Option<Length>,
    /// The template for drilling, if it has one.
    pub drill: Option<Templates>,
    /// The template for milling, if it has one.
    pub engrave: Option<Templates>,
}

/// When a new file begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum FileSplit {
    /// Never: the whole job in one.
    #[default]
    Job,
    /// Where drilling turns to milling, or back.
    Operation,
    /// With every bit.
    Bit,
}

/// How fast rapid moves go, for controllers that must be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rapids {
    /// Of X and Y, mm/min.
    pub over_mm_per_min: u32,
    /// Of Z, mm/min.
    pub up_mm_per_min: u32,
}

impl Default for Rapids {
    fn default() -> Self {
        Self { over_mm_per_min: 3_000, up_mm_per_min: 300 }
    }
}

/// How a tool of a file comes into the spindle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Changes {
    /// It is in before the file begins: every tool has a file of its own.
    #[default]
    Before,
    /// The machine takes it by its number, and its length from its table.
    Changer,
    /// The file stops, and a person puts it in.
    Stop,
}

/// What a program may be called: letters, digits and `_`, beginning with a letter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NameStyle {
    /// Most letters.
    pub longest: usize,
    /// Capitals only.
    pub capitals: bool,
}

/// How numbers are written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NumberStyle {
    /// Every length, and what follows it.
    pub base: Format,
    /// Parameters with a format of their own.
    pub own: BTreeMap<&'static str, Format>,
}

impl NumberStyle {
    /// The format of `name`.
    pub fn of(&self, name: &str) -> Format {
        let decimals = parameter(name).and_then(|row| row.decimals).unwrap_or(self.base.decimals);
        self.own.get(name).copied().unwrap_or(Format { decimals, ..self.base })
    }
}

/// Lines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LineStyle {
    /// Whether every line has a number.
    pub numbered: bool,
    /// The first number, in `@N@` too.
    pub first: u64,
    /// From one number to the next.
    pub step: u64,
    /// Before the number.
    pub before: String,
    /// Behind the number.
    pub after: String,
    /// Lines that begin so have none.
    pub unnumbered: Vec<String>,
    /// Lines end with carriage return and line feed.
    pub crlf: bool,
    /// Blocks whose lines begin with `/`, so that a person can have them skipped.
    pub skippable: Vec<(TemplateKind, Block)>,
}

/// Comments.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Comments {
    /// What begins one; empty where there are none.
    pub open: String,
    /// What ends one; empty where the line does.
    pub close: String,
    /// Comments are left out.
    pub dropped: bool,
    /// Words of people are written in capitals.
    pub capitals: bool,
    /// Longest line of a file's head, in letters, where one is too long for the controller.
    pub longest: Option<usize>,
}

/// What is left out where it has not changed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Modal {
    /// Parameters whose words are left out when they say again what they said last.
    pub parameters: Vec<&'static str>,
    /// Words of which the last one holds, like `G0 G1 G2 G3`.
    pub groups: Vec<Vec<String>>,
}

/// What a controller can do with arcs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arcs {
    /// Nothing: every arc becomes lines.
    pub lines_only: bool,
    /// How far lines that stand for an arc may be from it, in mm.
    pub chord_error_mm: f64,
    /// Into how many parts a full circle is cut: 1 to 4.
    pub full_circle_parts: u32,
    /// Longer arcs are cut into equal parts; in degrees, to 360.
    pub longest_deg: f64,
    /// Shorter arcs become lines; in degrees.
    pub shortest_deg: f64,
    /// Arcs whose halves are shorter than this become lines; in mm.
    pub smallest_mm: f64,
    /// What becomes of arcs whose height changes.
    pub helix: Helix,
}

/// What becomes of arcs whose height changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Helix {
    /// The blocks of arcs are written, with another height at the end.
    #[default]
    Arcs,
    /// They have blocks of their own.
    Blocks,
    /// They become lines.
    Lines,
}

impl Default for Arcs {
    fn default() -> Self {
        Self {
            lines_only: false,
            chord_error_mm: 0.005,
            full_circle_parts: 1,
            longest_deg: 360.0,
            shortest_deg: 0.0,
            smallest_mm: 0.0,
            helix: Helix::Arcs,
        }
    }
}

/// One of the two templates.
#[derive(Clone, Debug, PartialEq)]
pub struct Templates {
    /// Extension of its files, without the dot.
    pub extension: String,
    /// Added to X and Y.
    pub shift: [Length; 2],
    /// The radius that the bit must have, if the template is for one bit only.
    pub tool_radius: Option<Length>,
    pub(super) blocks: BTreeMap<Block, Template>,
}

impl Dialect {
    /// The same; with `chord_error_mm` every arc becomes lines that are at most so far off.
    #[must_use]
    pub fn with_lines(mut self, chord_error_mm: Option<f64>) -> Self {
        if let Some(error) = chord_error_mm {
            (self.arcs.lines_only, self.arcs.chord_error_mm) = (true, error);
        }
        self
    }

    /// The same; bits fall fast to `height` over the board.
    #[must_use]
    pub fn falling_to(mut self, height: Option<Length>) -> Self {
        self.fall_to = height;
        self
    }

    /// The same; bits are changed at `height` over the board.
    #[must_use]
    pub fn changing_at(mut self, height: Option<Length>) -> Self {
        self.change_at = height;
        self
    }

    /// The same; rapid moves are so fast where the controller must be told.
    #[must_use]
    pub fn rapid_at(mut self, rapids: Option<Rapids>) -> Self {
        self.rapids = rapids.unwrap_or(self.rapids);
        self
    }

    /// How a tool comes into the spindle.
    pub fn changes(&self) -> Changes {
        let blocks =
            || TemplateKind::ALL.into_iter().filter_map(|part| self.templates(part)).map(|own| &own.blocks);
        let changer = |block: &Template| ["M6", "M06", "TOOL CALL"].iter().any(|word| block.says(word));
        if self.files == FileSplit::Bit && blocks().any(|own| own.contains_key(&Block::Load)) {
            Changes::Before
        } else if blocks().filter_map(|own| own.get(&Block::Change)).any(changer) {
            Changes::Changer
        } else {
            Changes::Stop
        }
    }

    /// The same; a new file begins when `files` says so, if it says anything.
    #[must_use]
    pub fn in_files(mut self, files: Option<FileSplit>) -> Self {
        self.files = files.unwrap_or(self.files);
        self
    }

    /// The template for `part`, if there is one.
    pub fn templates(&self, part: TemplateKind) -> Option<&Templates> {
        match part {
            TemplateKind::Drill => self.drill.as_ref(),
            TemplateKind::Engrave => self.engrave.as_ref(),
        }
    }
}

/// The dialects that ship: the name on the command line, and the file.
pub fn shipped() -> impl Iterator<Item = (&'static str, &'static str)> {
    [
        ("grbl", include_str!("dialects/grbl.toml")),
        ("linuxcnc", include_str!("dialects/linuxcnc.toml")),
        ("mach3", include_str!("dialects/mach3.toml")),
        ("marlin", include_str!("dialects/marlin.toml")),
        ("sinumerik", include_str!("dialects/sinumerik.toml")),
        ("fanuc", include_str!("dialects/fanuc.toml")),
        ("heidenhain", include_str!("dialects/heidenhain.toml")),
        ("kuka", include_str!("dialects/kuka.toml")),
        ("abb", include_str!("dialects/abb.toml")),
        ("fanuc_tp", include_str!("dialects/fanuc_tp.toml")),
    ]
    .into_iter()
}
