//! The format of one controller (its postprocessor): templates, numbers, arc support. Shipped dialects are in
//! `dialects/`; users can add others.

use super::names::{Block, TemplateKind, parameter};
use super::number::Format;
use super::template::Template;
use crate::units::Length;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

#[derive(Clone, Debug, PartialEq)]
pub struct Dialect {
    pub name: String,
    /// When a new file starts.
    pub files: FileSplit,
    /// Restriction of program and file names, if any.
    pub program_name: Option<NameStyle>,
    pub numbers: NumberStyle,
    pub lines: LineStyle,
    pub comments: Comments,
    pub modal: Modal,
    pub arcs: Arcs,
    /// Height over the board down to which a tool descends as a rapid, then at its feed: the machine's
    /// setting. `None`: at its feed all the way.
    pub fall_to: Option<Length>,
    /// Rapid speeds, for controllers that need them stated.
    pub rapids: Rapids,
    /// Height over the board for tool changes; `None`: the safe height.
    pub change_at: Option<Length>,
    pub drill: Option<Templates>,
    pub engrave: Option<Templates>,
}

/// When a new file starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum FileSplit {
    /// Never: the whole job in one file.
    #[default]
    Job,
    /// At a change between drilling and milling.
    Operation,
    Bit,
}

/// Rapid speeds, for controllers that need them stated.
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

/// How a tool of a file gets into the spindle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Changes {
    /// Before the file starts: every tool has its own file.
    #[default]
    Before,
    /// The machine fetches it by number, with its length from the tool table.
    Changer,
    /// The file stops, and the user inserts the tool.
    Stop,
}

/// Allowed program names: letters, digits and `_`, starting with a letter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NameStyle {
    pub longest: usize,
    pub capitals: bool,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NumberStyle {
    /// Default for lengths and derived values.
    pub base: Format,
    /// Parameters with their own format.
    pub own: BTreeMap<&'static str, Format>,
}

impl NumberStyle {
    /// The format of `name`.
    pub fn of(&self, name: &str) -> Format {
        let decimals = parameter(name).and_then(|row| row.decimals).unwrap_or(self.base.decimals);
        self.own.get(name).copied().unwrap_or(Format { decimals, ..self.base })
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LineStyle {
    pub numbered: bool,
    /// The first number, also for `@N@`.
    pub first: u64,
    pub step: u64,
    pub before: String,
    pub after: String,
    /// Lines with these prefixes have no number.
    pub unnumbered: Vec<String>,
    /// Lines end with carriage return and line feed.
    pub crlf: bool,
    /// Blocks whose lines start with `/`, so that the user can skip them.
    pub skippable: Vec<(TemplateKind, Block)>,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Comments {
    /// Start of a comment; empty if there are no comments.
    pub open: String,
    /// End of a comment; empty if the line ends it.
    pub close: String,
    /// Comments are not written.
    pub dropped: bool,
    /// Comments are written in capitals.
    pub capitals: bool,
    /// Longest line of a file's header, in characters, if the controller limits it.
    pub longest: Option<usize>,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Modal {
    pub parameters: Vec<&'static str>,
    /// Groups of modal words, like `G0 G1 G2 G3`.
    pub groups: Vec<Vec<String>>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arcs {
    /// No arcs: every arc becomes lines.
    pub lines_only: bool,
    /// Tolerance of lines that replace an arc, in mm.
    pub chord_error_mm: f64,
    /// Parts of a full circle: 1 to 4.
    pub full_circle_parts: u32,
    /// Longer arcs are split into equal parts; in degrees, up to 360.
    pub longest_deg: f64,
    /// Shorter arcs become lines; in degrees.
    pub shortest_deg: f64,
    /// Arcs become lines if half their length is shorter than this; in mm.
    pub smallest_mm: f64,
    pub helix: Helix,
}

/// How arcs with changing height are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Helix {
    /// With the arc blocks, and a different end height.
    #[default]
    Arcs,
    /// With their own blocks.
    Blocks,
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

/// The template of drilling or milling.
#[derive(Clone, Debug, PartialEq)]
pub struct Templates {
    /// Without the dot.
    pub extension: String,
    /// Added to X and Y.
    pub shift: [Length; 2],
    /// Required tool radius, if the template is for one tool only.
    pub tool_radius: Option<Length>,
    pub(super) blocks: BTreeMap<Block, Template>,
}

impl Dialect {
    /// Replaces arcs by lines with the tolerance `chord_error_mm`, if given.
    #[must_use]
    pub fn with_lines(mut self, chord_error_mm: Option<f64>) -> Self {
        if let Some(error) = chord_error_mm {
            (self.arcs.lines_only, self.arcs.chord_error_mm) = (true, error);
        }
        self
    }

    /// Sets the height down to which tools descend as a rapid.
    #[must_use]
    pub fn falling_to(mut self, height: Option<Length>) -> Self {
        self.fall_to = height;
        self
    }

    #[must_use]
    pub fn changing_at(mut self, height: Option<Length>) -> Self {
        self.change_at = height;
        self
    }

    /// Sets rapid speeds, if given.
    #[must_use]
    pub fn rapid_at(mut self, rapids: Option<Rapids>) -> Self {
        self.rapids = rapids.unwrap_or(self.rapids);
        self
    }

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

    /// Sets when a new file starts, if given.
    #[must_use]
    pub fn in_files(mut self, files: Option<FileSplit>) -> Self {
        self.files = files.unwrap_or(self.files);
        self
    }

    pub fn templates(&self, part: TemplateKind) -> Option<&Templates> {
        match part {
            TemplateKind::Drill => self.drill.as_ref(),
            TemplateKind::Engrave => self.engrave.as_ref(),
        }
    }
}

/// The shipped dialects: name on the command line, and file text.
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
