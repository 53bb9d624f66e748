//! The model by rows: what happens, told in short words, and how things stand after it.
//!
//! ```text
//! "open certain plan prove time"   ─▶   "nothing | job | "
//! ```

mod line;
mod story;

mod board_rows;
mod controller_rows;
mod draw_rows;
mod files_rows;
mod job_rows;
mod keeping_rows;
mod lab_rows;
mod link_rows;
mod planning_rows;
mod play_rows;
mod settings_rows;
