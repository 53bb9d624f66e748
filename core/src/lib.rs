//! The core of Annulus: pure, without files, sockets, clocks or threads. The page (wasm) and the bridge
//! (native) run identical code, so the simulation matches the machine.
//!
//! Data flows in one direction; a module knows only those before it:
//!
//! ```text
//! bytes ─ artwork ─▶ DrillFile ─ board ─▶ Board ─ cam ─▶ Plan ─▶ Program (job)
//!       Program ─ motion ─▶ Timeline ─ steps ─▶ StepStream ─ pins ─▶ pulses
//!                                                  └─ check: is it safe?
//! ```
//!
//! | module | contents |
//! |---|---|
//! | `units` | lengths in whole nanometres |
//! | `diagnostic` | problems, as code and arguments |
//! | `locale` | texts, one table per language |
//! | `geometry` | points, boxes, regions of lines and arcs |
//! | `machine` | description of a machine, its settings, presets |
//! | `artwork` | Gerber, Excellon and other input files, as written |
//! | `board` | the board: holes and slots, copper, outline |
//! | `job` | programs: legs of commands with gates and marks |
//! | `gcode` | the words that a G-code controller accepts |
//! | `align` | shift and rotation of a board from measured holes |
//! | `level` | height maps, and programs that follow them |
//! | `cam` | planning: tools, order of holes, toolpaths, lowering to a program |
//! | `post` | G-code and other output files |
//! | `project` | job files and saved projects |
//! | `proof` | check of the copper left by a program against the nets |
//! | `motion` | time and position of each axis |
//! | `steps` | step times as runs, their digest and replay |
//! | `magazine` | automatic tool change |
//! | `check` | independent verdict on a step stream |
//! | `pins` | hardware traits, and the executor's step |
//! | `virtual_drill` | simulated machine |
//! | `queue` | work commands: text, dry check, execution |
//! | `sim` | playback of a program |
//! | `control` | session, control, alarms, trust in the position: (state, event) → (state, actions) |
//! | `grbl` | GRBL-family controllers on a serial line |
//! | `servo` | closed-loop axis: staged fuzzy PID and its servo |
//! | `plot` | charts, as shapes and as SVG |
//! | `wire` | messages between page and bridge |

pub mod align;
pub mod artwork;
pub mod board;
pub mod cam;
pub mod chance;
pub mod check;
pub mod control;
pub mod diagnostic;
pub mod gcode;
pub mod geometry;
pub mod grbl;
pub mod job;
pub mod level;
pub mod locale;
pub mod machine;
pub mod magazine;
pub mod motion;
pub mod pins;
pub mod plot;
pub mod post;
pub mod project;
pub mod proof;
pub mod queue;
pub mod servo;
pub mod sim;
pub mod steps;
pub mod units;
pub mod virtual_drill;
pub mod wire;
