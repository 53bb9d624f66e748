//! A plot as data: panels with two axes, lines and bars, marks; drawn into plain shapes, and as SVG text.
//!
//! Comes in: numbers with names and units, the size of the picture in pixels. Goes out: [`PlotShape`]s, the same for the
//! page and for a file, or the text of an SVG file. Does not know what is plotted, nor any language: every word comes
//! from who fills the plot.
//!
//! ```text
//!   title
//!        ── name ── name                 legend, once where the panels below repeat it
//!   y ^  ¦mark                           a mark: a dashed line and its words
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

/// One picture: panels over each other under one title.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plot {
    /// What the picture shows; may be empty.
    pub title: String,
    /// The panels from top to bottom.
    pub panels: Vec<PlotPanel>,
}

/// One pair of axes with everything drawn over them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlotPanel {
    /// To the right.
    pub x: PlotAxis,
    /// Up.
    pub y: PlotAxis,
    /// What is drawn, in the order of the colours.
    pub series: Vec<Series>,
    /// Lines with a word: moments, limits.
    pub marks: Vec<PlotMark>,
}

/// An axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlotAxis {
    /// What is measured, for example `speed`.
    pub label: String,
    /// In which unit, for example `mm/s`; empty where there is none.
    pub unit: String,
    /// Ends of the axis; none: as far as the data and the marks across it reach.
    pub range: Option<[f64; 2]>,
    /// Names instead of numbers: name `i` stands at the value `i`. Empty: numbers.
    pub names: Vec<String>,
}

/// Numbers that belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Name in the legend; empty: not in the legend.
    pub name: String,
    /// How it is drawn.
    pub look: SeriesLook,
    /// x and y. A point that is not a finite number interrupts the line.
    pub points: Vec<[f64; 2]>,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SeriesLook {
    /// Straight from point to point.
    #[default]
    Line,
    /// A value holds until the next point.
    Stairs,
    /// Points alone.
    Dots,
    /// Two points are one bar: from the first x to the second x, at the first y, 0.6 high.
    Bars,
}

/// A line through the panel, with a word.
#[derive(Clone, Debug, PartialEq)]
pub enum PlotMark {
    /// Upright, at an x.
    At(f64, String),
    /// Level, at a y.
    Level(f64, String),
}

impl PlotAxis {
    /// An axis of numbers that reaches as far as the data.
    pub fn new(label: &str, unit: &str) -> Self {
        Self { label: label.to_owned(), unit: unit.to_owned(), ..Self::default() }
    }

    /// Label and unit as they stand beside the axis.
    pub fn words(&self) -> String {
        if self.unit.is_empty() { self.label.clone() } else { format!("{} / {}", self.label, self.unit) }
    }
}

impl Series {
    /// A line.
    pub fn line(name: &str, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.to_owned(), look: SeriesLook::Line, points }
    }

    /// The same in another look.
    #[must_use]
    pub fn looking(mut self, look: SeriesLook) -> Self {
        self.look = look;
        self
    }
}
