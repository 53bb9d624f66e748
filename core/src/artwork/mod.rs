//! Board files as written: the kind of each file of a set, and its content. Never fails on content: problems
//! become diagnostics.
//!
//! ```text
//! bytes ─ text ─ detect ─▶ excellon ─ survey ─ sense ─ reader ─▶ DrillFile
//!   │                 ├──▶ drill_list ────────────────────────▶ DrillFile
//!   │                 ├──▶ companion   (tool tables, formats)      ▲
//!   │                 └──▶ gerber      (objects; areas on demand) ─ registration: fit to the copper
//!   └─ archive: members, each read like a file
//! ```

mod aperture_list;
mod archive;
mod boards;
mod columns;
mod companion;
mod content;
mod detect;
mod drill;
mod drill_format;
mod drill_list;
mod excellon;
mod file;
mod findings;
mod gather;
mod gerber;
mod kinds;
mod layer_shape;
mod layer_words;
mod machine_program;
mod names;
mod number;
mod orphans;
mod read;
mod registration;
mod role;
mod set;
mod text;
mod through;
mod word_list;
mod words;

pub use archive::{lists, members, packed};
pub use drill::{Counts, DrillFile, Hit, Route, SlotEntry, ToolEntry};
pub use excellon::MOST_HITS;
pub use file::{Artwork, FileRead};
pub use findings::MOST_KEPT;
pub use gather::PROJECT_HEAD;
pub use gerber::{
    Aperture, Form, Gerber, GerberObjects, NamedPad, Nets, Object, ObjectShape, Opening, PaintedMeasures,
    Tag, TooMuch, Track, Transform, named_pads, nets, painted, painted_for_picture, painted_measures,
};
pub use kinds::{Digits, Evidence, FileKind, Overrides, Role, Side, Source, Units, Zeros};
pub use machine_program::OURS;
pub use names::is_end_of_path;
pub use read::{read_drill, read_set, read_set_telling};
pub use words::board_name;
