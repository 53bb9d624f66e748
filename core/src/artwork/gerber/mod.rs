//! Gerber layers: RS-274X with X2 and X3 attributes, and RS-274-D with a separate aperture list. Areas are
//! painted on demand.
//!
//! ```text
//! text ─ words ─▶ reader ─▶ objects ─┬─ flatten ─▶ pads, tracks, contours (places holes, finds outlines)
//!                  │ commands        ├─ holes ─▶ DrillFile (of Gerber drill layers)
//!                  │                 └─ paint ─▶ Region ─ nets
//!                  │ format · graphics · image · transform · draw
//!                  │ aperture · macros · expression · primitives
//!                  │ attributes · step_repeat
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
pub use paint::{TooMuch, painted, painted_for_picture};
pub(super) use reader::read;
pub use transform::Transform;

use super::findings::Findings;
use aperture::Apertures;
use attributes::Attributes;
use format::Format;
use graphics::Graphics;
use step_repeat::StepRepeat;

struct Reader {
    findings: Findings,
    out: Gerber,
    format: Format,
    apertures: Apertures,
    graphics: Graphics,
    attributes: Attributes,
    step_repeat: StepRepeat,
    pairs_left: u32,
    /// A level name (`%LN`) has set the layer's name.
    level_named: bool,
    ended: bool,
    /// The object limit was reached, so the rest isn't read.
    cut: bool,
}
