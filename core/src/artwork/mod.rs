//! Files as written: what each file of a set is, and what it says.
//!
//! Comes in: names and bytes of a set of files, because neighbours carry evidence. Goes out: an [`Artwork`]: every
//! file with its kind, the reason for it, its content as data, and diagnostics. Reading never fails on content. Does not
//! know what the holes are for.
//!
//! ```text
//! bytes ─ text ─ detect ─▶ excellon ─ survey ─ sense ─ reader ─▶ DrillFile
//!   │                 ├──▶ drill_list ────────────────────────▶ DrillFile
//!   │                 ├──▶ companion   (tool tables, formats)      ▲
//!   │                 └──▶ gerber      (objects; areas on demand) ─ registration: which reading fits the copper?
//!   └─ archive: members, each as if it were a file
//! ```

mod aperture_list;
mod archive;
mod boards;
mod columns;
mod companion;
mod decide;
mod detect;
mod drill;
mod drill_list;
mod excellon;
mod findings;
mod gerber;
mod kinds;
mod measure;
mod names;
mod neighbours;
mod number;
mod rank;
mod read;
mod registration;
mod role;
mod second_look;
mod set;
mod text;
mod tool_units;
mod witness;
mod words;

pub use archive::{lists, members, packed};
pub use drill::{Counts, DrillFile, Hit, Route, SlotEntry, ToolEntry};
pub use excellon::MOST_HITS;
pub use findings::MOST_KEPT;
pub use gerber::{
    Aperture, Form, Gerber, GerberObjects, NamedPad, Nets, Object, ObjectShape, Opening, PaintedMeasures,
    Tag, TooMuch, Track, Transform, named_pads, nets, painted, painted_measures,
};
pub use kinds::{Digits, Evidence, FileKind, Overrides, Role, Side, Source, Units, Zeros};
pub use read::{Artwork, FileRead, read_drill, read_set, read_set_telling};
pub use words::board_name;
