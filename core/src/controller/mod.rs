//! Controllers that plan their own motion, by serial line: GRBL 1.1, grblHAL, FluidNC (N19). One engine for the bridge and for the page.
//!
//! ```text
//!  text ─ gcode ─▶ Routine ─ lines ─▶ words on the wire ─┐
//!                      └──── timing, fits                ├─ engine · run · hand ─▶ bytes, tells
//!                     bytes ─ heard ─────────────────────┘
//! ```
//!
//! Comes in: programs as text, bytes of the line, time. Goes out: bytes for the line, diagnostics. Does not know ports, pages or clocks.

mod alarm;
mod align;
mod asks;
pub mod buffer;
mod changer;
mod check;
mod ends;
mod engine;
pub mod fits;
mod gcode;
mod hand;
pub mod heard;
mod height;
mod home;
mod jog;
mod level;
mod lines;
mod look;
mod meet;
mod overrides;
mod park;
mod place;
mod routine;
mod run;
mod setter;
pub mod settings;
mod stands;
mod survey;
pub mod timing;

pub use align::aligned_routine;
pub use asks::{
    BITS_PER_S, EngineAction, EngineAsk, EngineEvent, EnginePhase, EngineStart, Info, SurveyNews,
    SurveyStart, signs,
};
pub use changer::{CHANGER_KEY, Changer, TOOL_MARK, ToolMacro};
pub use check::CheckNews;
pub use engine::{Controller, step};
pub use gcode::read;
pub use height::BoardHeight;
pub use level::{cut_bounds, level_key, level_routine};
pub use lines::{LinePath, WireLine, WordsInForce};
pub use meet::{RESET_KEY, ResetOnOpen};
pub use overrides::OverrideOf;
pub use routine::{
    Bow, Course, Routine, RoutineAction, RoutineMove, Section, SectionKind, Spindle, TipPlace,
};
pub use run::{estimate_s, estimates_s};
pub use setter::{LENGTH_KEY, SETTER_KEY, SetterStep, ToolLengths, ToolSetter};
