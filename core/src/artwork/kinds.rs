//! Enums for the kind and role of a file and for its number format.

use crate::geometry::Point;
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FileKind {
    Drill,
    Gerber,
    Report,
    /// A zip; its members follow it.
    Archive,
    /// Recognised but not usable; nothing of it is kept.
    Refused,
    Unknown,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    Drill,
    Copper,
    Mask,
    Silk,
    Paste,
    Outline,
    Other,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    Top,
    Bottom,
    Inner,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Units {
    Mm,
    Inch,
}

/// Digits before and after the implied decimal point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Digits {
    pub integer: u8,
    pub decimal: u8,
}

/// Zeros omitted in coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Zeros {
    /// Leading ones (keyword `TZ`: trailing zeros are written).
    Leading,
    /// Trailing ones (keyword `LZ`: leading zeros are written).
    Trailing,
    /// Every number has all digits.
    None,
    /// Not applicable: numbers have decimal points.
    Decimal,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    Person,
    Header,
    Comment,
    Companion,
    Copper,
    /// Inferred from the look of the numbers.
    Shape,
    Default,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// The weakest source that was needed.
    pub source: Source,
    /// Share of holes on copper with this reading, 0 to 1.
    pub score: Option<f64>,
    /// Share for the best reading that gives a different board.
    pub runner_up: Option<f64>,
    /// That reading, for display: `inch 2.4 leading`.
    pub runner_up_reading: Option<String>,
    /// Its holes, at most 2,000 of them.
    pub runner_up_holes: Vec<Point>,
    /// Shift from holes to copper at which `score` holds, mm.
    pub shift_mm: Option<(f64, f64)>,
}

impl Evidence {
    /// Evidence with only a source.
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

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Overrides {
    pub units: Option<Units>,
    pub digits: Option<Digits>,
    pub zeros: Option<Zeros>,
}

macro_rules! names {
    ($type:ident: $($variant:ident $name:literal),+) => {
        impl $type {
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name),+ }
            }

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
