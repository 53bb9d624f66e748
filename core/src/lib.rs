//! The pure heart of Annulus. No file, no socket, no clock, no thread; the same bytes in the page (wasm) and
//! in the bridge (native), so that what is simulated is what runs.
//!
//! Data walks one way. Each floor makes one noun, and does not know the floors above it:
//!
//! ```text
//! bytes ─ artwork ─▶ DrillFile ─ board ─▶ Board ─ cam ─▶ Plan ─▶ Program (job)
//!       Program ─ motion ─▶ Timeline ─ steps ─▶ StepStream ─ pins ─▶ pulses
//!                                                  └─ check: is it safe?
//! ```
//!
//! | floor | makes | does not know |
//! |---|---|---|
//! | `units` | lengths in whole nanometres | anything else |
//! | `diagnostic` | what a reader or check has to say, as code and arguments | the sentences |
//! | `locale` | the sentences, one table a language | who asks |
//! | `geometry` | points, boxes, regions of lines and arcs | boards |
//! | `machine` | a machine described, its settings table, presets | jobs |
//! | `artwork` | files as written | what they are for |
//! | `board` | the board as meant: holes and slots | files' words |
//! | `job` | the program: legs of commands with gates and marks | how fast |
//! | `align` | where a board lies, from holes that were found: shift, turn, what is left over | who found them |
//! | `level` | the board's surface as it was touched, and programs whose depth follows it | who touches it |
//! | `cam` | plans: rack, order of holes, lowering to a program | motion |
//! | `post` | programs in other controllers' words | motion |
//! | `project` | the job file: a work as text | how toolpaths are made |
//! | `proof` | what copper is left after a program, against the nets | planners |
//! | `motion` | when each axis is where | steps |
//! | `steps` | step times as runs, their digest and replay | planners' reasons |
//! | `magazine` | which tool lies where, the steps of an automatic change, the way on from where one stopped | jobs |
//! | `check` | an independent verdict on a stream | planners |
//! | `pins` | the traits under the executor, and its step | who computed the stream |
//! | `virtual_drill` | the virtual drill | programs |
//! | `queue` | work commands: text, dry check, the next piece of work | sockets |
//! | `sim` | the moment shown in a playback | pins |
//! | `control` | session, queue, guard, trust: (state, event) → (state, actions) | sockets |
//! | `controller` | controllers that plan their own motion, by serial line: lines, looks, trust | ports |
//! | `servo` | a closed-loop axis: staged fuzzy PID and the servo it drives | how moves are planned |
//! | `plot` | pictures of numbers: panels, axes, lines, as shapes and as SVG | what is plotted |
//! | `wire` | what page and bridge say to each other | how it travels |

pub mod align;
pub mod artwork;
pub mod board;
pub mod cam;
pub mod chance;
pub mod check;
pub mod control;
pub mod controller;
pub mod diagnostic;
pub mod geometry;
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
