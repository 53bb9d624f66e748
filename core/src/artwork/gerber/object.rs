//! What a Gerber layer draws, as plain data.
//!
//! ```text
//!  Gerber ─ objects: Flash ●   Stroke ══   Contour ▰   Repeat ⠿ (objects again)
//!         ─ apertures: Circle, Rectangle, Obround, Polygon, Macro (paths), Block (objects again)
//!         ─ transforms: how an aperture is mirrored, turned, scaled       ─ tags: net, component, pin
//! ```
//!
//! Comes in: nothing. Goes out: types. Coordinates are whole nanometres of the layer. Knows no text and does not paint.

use super::transform::Transform;
use crate::artwork::{Digits, Units, Zeros};
use crate::geometry::{Path, PathSegment, Point};
use crate::units::Length;

/// How many objects of each kind a layer draws, as written: copies by blocks and repeats are not counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GerberObjects {
    /// Flashes.
    pub flashes: u32,
    /// Straight strokes.
    pub lines: u32,
    /// Arcs.
    pub arcs: u32,
    /// Filled contours.
    pub regions: u32,
}

impl GerberObjects {
    /// All together.
    pub const fn total(&self) -> u32 {
        self.flashes + self.lines + self.arcs + self.regions
    }
}

/// A stroke between two points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Track {
    /// One end.
    pub from: Point,
    /// The other.
    pub to: Point,
    /// Half of its width.
    pub half_width: Length,
}

/// What an object is.
#[derive(Clone, Debug, PartialEq)]
pub enum ObjectShape {
    /// The aperture, put down once.
    Flash {
        /// Where its origin lies.
        at: Point,
    },
    /// The aperture, dragged.
    Stroke {
        /// Where it starts.
        from: Point,
        /// Where and how it goes.
        segment: PathSegment,
    },
    /// A filled contour (G36 … G37), closed. Needs no aperture.
    Contour(Path),
    /// Step and repeat: objects in columns and rows. Needs no aperture.
    Repeat {
        /// What is repeated.
        objects: Vec<Object>,
        /// Copies in X, at least 1.
        columns: u32,
        /// Copies in Y, at least 1.
        rows: u32,
        /// From one copy to the next, in X and in Y.
        step: Point,
    },
}

/// One object of a layer, in the order of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// What it is.
    pub shape: ObjectShape,
    /// Whether it takes away what lies below it (`%LPC`) instead of adding to it.
    pub clear: bool,
    /// Which of the layer's apertures draws it, for flashes and strokes.
    pub aperture: u32,
    /// Which of the layer's transforms the aperture is held in.
    pub transform: u32,
    /// Which of the layer's tags it carries.
    pub tag: u32,
    /// Line in the file, from 1.
    pub line: u32,
    /// Column in it, from 1.
    pub column: u32,
}

/// What the attributes in force say about an object (X2 `%TO`, and `%TA` for contours).
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Tag {
    /// Net (`.N`); an empty name is copper without net.
    pub net: Option<String>,
    /// Component (`.C`, or the component of `.P`).
    pub component: Option<String>,
    /// Pin (`.P`).
    pub pin: Option<String>,
    /// What a contour is for (`.AperFunction`).
    pub function: Option<String>,
}

/// The opening in a standard aperture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Opening {
    /// Round.
    Round(Length),
    /// Width and height; no longer part of the format, but drawn.
    Rectangle(Length, Length),
}

/// The form of an aperture, centred on its origin.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// `C`.
    Circle {
        /// Diameter; 0 draws nothing, but has a centre line.
        diameter: Length,
    },
    /// `R`.
    Rectangle {
        /// In X.
        width: Length,
        /// In Y.
        height: Length,
    },
    /// `O`: a rectangle whose shorter sides are half circles.
    Obround {
        /// In X.
        width: Length,
        /// In Y.
        height: Length,
    },
    /// `P`: a regular polygon.
    Polygon {
        /// Of the circle through its corners.
        diameter: Length,
        /// 3 to 1,000.
        corners: u32,
        /// Degrees by which the first corner is turned from the X axis, counter-clockwise.
        turn_deg: f64,
    },
    /// A macro, worked out: primitives drawn one after the other. Each is the non-zero union of closed paths; those with
    /// `false` are taken away from what the macro itself drew before.
    Macro {
        /// Its name.
        name: String,
        /// What it draws.
        primitives: Vec<(bool, Vec<Path>)>,
    },
    /// A block (`%AB`): objects of their own, which clear what lies below where they are clear.
    Block {
        /// What is in it.
        objects: Vec<Object>,
    },
}

/// One aperture of the layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Aperture {
    /// D-code, from 10.
    pub code: u32,
    /// Its form.
    pub form: Form,
    /// The opening in it, for standard apertures.
    pub opening: Option<Opening>,
    /// What it is for (`.AperFunction`), as written.
    pub function: Option<String>,
    /// How many objects one flash of it makes.
    pub(super) repeated: u64,
    /// Blocks within blocks in it; 0 where it is no block.
    pub(super) depth: u32,
}

/// A Gerber layer as written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gerber {
    /// Bytes of text that it was read from.
    pub size: usize,
    /// Units of the first coordinate.
    pub units: Option<Units>,
    /// Digits of coordinates.
    pub digits: Option<Digits>,
    /// Zeros left out.
    pub zeros: Option<Zeros>,
    /// `%IP`: whether the image is negative. The objects are kept as drawn: the inverse needs the board's outline.
    pub negative_image: bool,
    /// X2 file function, as written.
    pub file_function: Option<String>,
    /// X2 file polarity, as written. A solder mask is `Negative` and still drawn dark.
    pub file_polarity: Option<String>,
    /// The program that wrote it.
    pub generator: Option<String>,
    /// Layer or image name.
    pub layer_name: Option<String>,
    /// All file attributes, names without the dot, as written.
    pub attributes: Vec<(String, String)>,
    /// Counts, as written.
    pub counts: GerberObjects,
    /// What is drawn, in the order of the file.
    pub objects: Vec<Object>,
    /// What it is drawn with.
    pub apertures: Vec<Aperture>,
    /// How apertures are held; the first is as they are.
    pub transforms: Vec<Transform>,
    /// What objects carry; the first is nothing.
    pub tags: Vec<Tag>,
}
