//! Gerber layers: RS-274X with X2 and X3 attributes, and RS-274-D with an aperture list beside it.
//!
//! Comes in: text. Goes out: a [`Gerber`]: objects as plain data, and remarks for whatever was not understood. Areas are
//! painted on demand. Does not know drill programs or boards.
//!
//! ```text
//! text ─ words ─▶ machine ─▶ objects ─┬─ walk ─▶ pads, tracks, contours (places holes, finds outlines)
//!                  │ extended         ├─ holes ─▶ DrillFile (of layers that say they are drill layers)
//!                  │                  └─ paint ─▶ Region ─ nets
//!                  │ aperture · macros · expression · primitives
//!                  │ attributes · copies · draw · image
//! ```

mod aperture;
mod attributes;
mod coats;
mod copies;
mod crossing;
mod draw;
mod expression;
mod extended;
mod forms;
mod holes;
mod image;
mod machine;
mod macros;
mod measure;
mod mount;
mod nets;
mod object;
mod paint;
mod primitives;
mod walk;
mod words;

pub(super) use holes::{holes, says_holes};
pub(super) use machine::read;
pub use measure::{PaintedMeasures, painted_measures};
pub use mount::Mount;
pub use nets::{Nets, nets};
pub use object::{Aperture, Form, Gerber, GerberObjects, Object, Opening, Shape, Tag, Track};
pub use paint::{TooMuch, painted};
