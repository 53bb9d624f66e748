//! Controllers that plan their own motion, on a serial line: GRBL 1.1, grblHAL, FluidNC. One engine for the
//! bridge and the page.
//!
//! ```text
//!  text ─ gcode ─▶ Routine ─ lines ─▶ lines to send ─┐
//!                      └──── timing, fits            ├─ engine · activity · known ─▶ bytes, actions
//!                     bytes ─ heard ─────────────────┘
//! ```

mod activity;
mod align;
mod asks;
pub mod buffer;
mod changer;
mod changing;
mod checking;
mod commands;
mod context;
mod depth;
mod ends;
mod engine;
mod estimate;
pub mod fits;
mod gcode;
mod gcode_words;
pub mod heard;
mod homing;
mod identify;
mod job;
mod jogging;
mod known;
mod level;
mod line;
mod lines;
mod locked;
mod measuring;
mod overrides;
mod park;
mod pieces;
mod preflight;
mod probing;
mod room;
mod routine;
mod running;
mod setter;
pub mod settings;
mod stopping;
mod surveying;
pub mod timing;
mod tool_change;
mod written;
mod zero;

pub use crate::control::BoardHeight;
pub use align::aligned_routine;
pub use asks::{
    BITS_PER_S, CheckNews, EngineAction, EngineAsk, EngineEvent, EnginePhase, EngineStart, Info, OverrideOf,
    SurveyNews, SurveyStart, realtime,
};
pub use changer::{CHANGER_KEY, Changer, TOOL_MARK, ToolMacro};
pub use engine::{Controller, step};
pub use estimate::{estimate_s, estimates_s};
pub use gcode::{read, read_written};
pub use identify::{RESET_KEY, ResetOnOpen};
pub use level::{cut_bounds, level_key, level_routine};
pub use lines::{LinePath, WireLine, WordsInForce};
pub use routine::{
    Bow, Course, Pause, Routine, RoutineAction, RoutineMove, Section, SectionKind, Spindle, TipPlace,
};
pub use setter::{LENGTH_KEY, SETTER_KEY, SetterStep, ToolLengths, ToolSetter};
pub use written::WrittenLine;
