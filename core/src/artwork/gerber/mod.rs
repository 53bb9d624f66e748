//! Gerber layers: RS-274X with X2 and X3 attributes, and RS-274-D with an aperture list beside it.
//!
//! Comes in: text. Goes out: a [`Gerber`]: objects as plain data, and diagnostics for whatever was not understood. Areas are
//! painted on demand. Does not know drill programs or boards.
//!
//! ```text
//! text ─ words ─▶ reader ─▶ objects ─┬─ walk ─▶ pads, tracks, contours (places holes, finds outlines)
//!                  │ commands        ├─ holes ─▶ DrillFile (of layers that say they are drill layers)
//!                  │                 └─ paint ─▶ Region ─ nets
//!                  │ format · graphics · image · transform · draw
//!                  │ aperture · macros · expression · primitives
//!                  │ attributes · copies
//! ```

mod aperture;
mod aperture_shapes;
mod attributes;
mod commands;
mod crossing;
mod draw;
mod exposures;
mod expression;
mod flatten;
mod format;
mod graphics;
mod holes;
mod image;
mod macros;
mod measure;
mod nets;
mod object;
mod paint;
mod primitives;
mod reader;
mod step_repeat;
mod transform;
mod words;

pub(super) use holes::{holes, says_holes};
pub use measure::{PaintedMeasures, painted_measures};
pub use nets::{NamedPad, Nets, named_pads, nets};
pub use object::{Aperture, Form, Gerber, GerberObjects, Object, ObjectShape, Opening, Tag, Track};
pub use paint::{TooMuch, painted};
pub(super) use reader::read;
pub use transform::Transform;
