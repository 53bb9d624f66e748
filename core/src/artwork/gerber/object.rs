//! The content of a Gerber layer as plain data. Coordinates are whole nanometres.
//!
//! ```text
//!  Gerber ─ objects: Flash ●   Stroke ══   Contour ▰   Repeat ⠿ (nested objects)
//!         ─ apertures: Circle, Rectangle, Obround, Polygon, Macro (paths), Block (nested objects)
//!         ─ transforms: mirroring, rotation, scale of an aperture       ─ tags: net, component, pin
//! ```

use super::transform::Transform;
use crate::artwork::{Digits, Units, Zeros};
use crate::geometry::{Path, PathSegment, Point};
use crate::units::Length;

/// Number of objects by kind, as written; copies by blocks and repeats don't count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GerberObjects {
    pub flashes: u32,
    pub lines: u32,
    pub arcs: u32,
    pub regions: u32,
}

impl GerberObjects {
    pub const fn total(&self) -> u32 {
        self.flashes + self.lines + self.arcs + self.regions
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Track {
    pub from: Point,
    pub to: Point,
    pub half_width: Length,
}

#[derive(Clone, Debug, PartialEq)]
pub enum ObjectShape {
    Flash {
        at: Point,
    },
    Stroke {
        from: Point,
        segment: PathSegment,
    },
    /// A filled contour (G36 … G37), closed. Has no aperture.
    Contour(Path),
    /// Step and repeat: objects in columns and rows. Has no aperture.
    Repeat {
        objects: Vec<Object>,
        /// Copies in X, at least 1.
        columns: u32,
        /// Copies in Y, at least 1.
        rows: u32,
        step: Point,
    },
}

/// An object of a layer, in file order.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    pub shape: ObjectShape,
    /// Clears what is below (`%LPC`) instead of adding.
    pub clear: bool,
    pub aperture: u32,
    /// Index of the aperture's transform.
    pub transform: u32,
    pub tag: u32,
    /// Line in the file, from 1.
    pub line: u32,
    /// Column, from 1.
    pub column: u32,
}

/// Attributes of an object (X2 `%TO`, and `%TA` for contours).
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Tag {
    /// Net (`.N`); an empty name is copper without a net.
    pub net: Option<String>,
    /// Component (`.C`, or the component of `.P`).
    pub component: Option<String>,
    pub pin: Option<String>,
    /// Function of a contour (`.AperFunction`).
    pub function: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Opening {
    Round(Length),
    /// Width and height; obsolete, but supported.
    Rectangle(Length, Length),
}

/// The shape of an aperture, centered on its origin.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    Circle {
        /// Diameter; 0 draws nothing, but has a center line.
        diameter: Length,
    },
    Rectangle {
        width: Length,
        height: Length,
    },
    /// `O`: a rectangle whose shorter sides are half circles.
    Obround {
        width: Length,
        height: Length,
    },
    /// `P`: a regular polygon.
    Polygon {
        /// Of the circle through its corners.
        diameter: Length,
        /// 3 to 1,000.
        corners: u32,
        /// Rotation of the first corner from the X axis, degrees counter-clockwise.
        turn_deg: f64,
    },
    /// An evaluated macro: primitives in drawing order, each the non-zero union of closed paths. `false`
    /// removes the primitive from what the macro has drawn before.
    Macro {
        name: String,
        primitives: Vec<(bool, Vec<Path>)>,
    },
    /// A block (`%AB`): nested objects. A clear object in it also clears what is below the block.
    Block {
        objects: Vec<Object>,
    },
}

#[derive(Clone, Debug, PartialEq)]
pub struct Aperture {
    /// D-code, from 10.
    pub code: u32,
    pub form: Form,
    /// Only for standard apertures.
    pub opening: Option<Opening>,
    /// Its function (`.AperFunction`), as written.
    pub function: Option<String>,
    pub(super) repeated: u64,
    /// Depth of nested blocks; 0 if it isn't a block.
    pub(super) depth: u32,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gerber {
    pub size: usize,
    /// Units of the first coordinate.
    pub units: Option<Units>,
    pub digits: Option<Digits>,
    pub zeros: Option<Zeros>,
    /// `%IP`: the image is negative. Objects are as drawn, because the inverse needs the board's outline.
    pub negative_image: bool,
    /// X2 file function, as written.
    pub file_function: Option<String>,
    /// X2 file polarity, as written. A solder mask is `Negative`, but its objects are openings drawn dark.
    pub file_polarity: Option<String>,
    pub generator: Option<String>,
    pub layer_name: Option<String>,
    /// All file attributes as written, names without the dot.
    pub attributes: Vec<(String, String)>,
    pub counts: GerberObjects,
    /// In file order.
    pub objects: Vec<Object>,
    pub apertures: Vec<Aperture>,
    /// Transforms of apertures; the first is the identity.
    pub transforms: Vec<Transform>,
    /// Tags of objects; the first is empty.
    pub tags: Vec<Tag>,
}
