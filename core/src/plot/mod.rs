//! Plots as data: panels with two axes, series, marks. Rendered as shapes or as SVG.
//!
//! ```text
//!   title
//!        ── name ── name                 legend, once if the panels below repeat it
//!   y ^  ¦mark                           a mark: a dashed line with text
//!     |  ¦  ___
//!     |__¦_/   \___                      series: line, stairs, dots or bars
//!     +------------> x, unit
//! ```

mod draw;
mod layout;
mod svg;
mod ticks;

pub use draw::{Anchor, Ink, PlotShape, draw};
pub use layout::{PlotFrame, layout};
pub use svg::svg;
pub use ticks::{Ticks, ticks};

/// One picture: panels above each other under one title.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plot {
    /// May be empty.
    pub title: String,
    /// From top to bottom.
    pub panels: Vec<PlotPanel>,
}

/// One pair of axes and everything drawn in them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlotPanel {
    pub x: PlotAxis,
    pub y: PlotAxis,
    /// In the order of the colours.
    pub series: Vec<Series>,
    /// Lines with a text: times, limits.
    pub marks: Vec<PlotMark>,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlotAxis {
    /// Quantity, for example `speed`.
    pub label: String,
    /// Unit, for example `mm/s`; may be empty.
    pub unit: String,
    /// Range of the axis; none: the range of data and marks.
    pub range: Option<[f64; 2]>,
    /// Names instead of numbers: name `i` is at the value `i`. If empty: numbers.
    pub names: Vec<String>,
}

/// A series of points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Name in the legend; if empty, not in the legend.
    pub name: String,
    pub look: SeriesLook,
    /// x and y. A point that isn't finite interrupts the line.
    pub points: Vec<[f64; 2]>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SeriesLook {
    /// Straight from point to point.
    #[default]
    Line,
    /// A value lasts until the next point.
    Stairs,
    Dots,
    /// Two points form one bar: from the first x to the second x, at the first y, 0.6 high.
    Bars,
}

#[derive(Clone, Debug, PartialEq)]
pub enum PlotMark {
    At(f64, String),
    Level(f64, String),
}

impl PlotAxis {
    pub fn new(label: &str, unit: &str) -> Self {
        Self { label: label.to_owned(), unit: unit.to_owned(), ..Self::default() }
    }

    pub fn words(&self) -> String {
        if self.unit.is_empty() { self.label.clone() } else { format!("{} / {}", self.label, self.unit) }
    }
}

impl Series {
    pub fn line(name: &str, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.to_owned(), look: SeriesLook::Line, points }
    }

    #[must_use]
    pub fn looking(mut self, look: SeriesLook) -> Self {
        self.look = look;
        self
    }
}
