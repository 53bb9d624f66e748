//! The words for what a file is and how its numbers are written.
//!
//! Comes in, goes out: plain enumerations with their names for scripts. Knows nothing else.

use crate::geometry::Point;

/// What a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// A drill or rout program, or a plain list of holes.
    Drill,
    /// A Gerber layer.
    Gerber,
    /// A report or table that goes with other files.
    Report,
    /// A zip; its members follow it.
    Archive,
    /// Recognised, and not fit to be read. Nothing of it was kept.
    Refused,
    /// Not recognised.
    Unknown,
}

/// What a file is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Holes.
    Drill,
    /// Copper.
    Copper,
    /// Solder mask.
    Mask,
    /// Legend.
    Silk,
    /// Solder paste.
    Paste,
    /// Outline of the board.
    Outline,
    /// Anything else.
    Other,
}

/// Side of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Component side.
    Top,
    /// Solder side.
    Bottom,
    /// Between them.
    Inner,
}

/// Units of coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Units {
    /// Millimetres.
    Mm,
    /// Inches.
    Inch,
}

/// Digits before and after the point that is not written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Digits {
    /// Before the point.
    pub integer: u8,
    /// Behind the point.
    pub decimal: u8,
}

/// Zeros left out of coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Zeros {
    /// Those in front (`TZ`: trailing zeros are kept).
    Leading,
    /// Those behind (`LZ`: leading zeros are kept).
    Trailing,
    /// None: every number has all digits.
    None,
    /// Not applicable: points are written.
    Decimal,
}

/// What a reading of the numbers rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    /// The person said so.
    Person,
    /// Statements of the file.
    Header,
    /// Comments of the file.
    Comment,
    /// A report or table beside it.
    Companion,
    /// The holes lie on the pads of a copper layer.
    Copper,
    /// The shape of the numbers.
    Shape,
    /// Nothing but custom.
    Default,
}

/// Why the numbers are read as they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Evidence {
    /// The weakest ground that had to be used.
    pub source: Source,
    /// Share of holes that lie on copper pads or tracks under this reading.
    pub score: Option<f64>,
    /// The same for the best reading that gives another board.
    pub runner_up: Option<f64>,
    /// That other reading, for people: `inch 2.4 leading`.
    pub runner_up_reading: Option<String>,
    /// Where its holes would lie, some of them where there are many.
    pub runner_up_holes: Vec<Point>,
    /// Shift in mm between holes and copper under which the score holds.
    pub shift_mm: Option<(f64, f64)>,
}

impl Evidence {
    /// Nothing but a ground.
    pub fn plain(source: Source) -> Self {
        Self {
            source,
            score: None,
            runner_up: None,
            runner_up_reading: None,
            runner_up_holes: Vec::new(),
            shift_mm: None,
        }
    }
}

/// What a person says about the numbers of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Overrides {
    /// Units.
    pub units: Option<Units>,
    /// Digits.
    pub digits: Option<Digits>,
    /// Zeros left out.
    pub zeros: Option<Zeros>,
}

macro_rules! names {
    ($type:ident: $($variant:ident $name:literal),+) => {
        impl $type {
            /// Its name for scripts.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name),+ }
            }

            /// The one of this name.
            pub fn named(name: &str) -> Option<Self> {
                match name { $($name => Some(Self::$variant),)+ _ => None }
            }
        }
    };
}
names!(FileKind: Drill "drill", Gerber "gerber", Report "report", Archive "archive", Refused "refused", Unknown "unknown");
names!(Role: Drill "drill", Copper "copper", Mask "mask", Silk "silk", Paste "paste", Outline "outline", Other "other");
names!(Side: Top "top", Bottom "bottom", Inner "inner");
names!(Units: Mm "mm", Inch "inch");
names!(Zeros: Leading "leading", Trailing "trailing", None "none", Decimal "decimal");
names!(Source: Person "person", Header "header", Comment "comment", Companion "companion", Copper "copper",
    Shape "shape", Default "default");
