//! `annulus grbl` against the unmodified GRBL 1.1h firmware on a simulated ATmega328P, behind a pseudo-terminal (N19, N16). Judged by the
//! step pins alone: what was drilled, and where, is read from every edge by a judge that knows nothing of the product.
//!
//! Where the instrument is not, each test says so and is skipped; with `ANNULUS_NOTHING_SKIPPED` it fails. Not part of a plain
//! `cargo test`: `cargo xtask test grbl`, or `cargo test --workspace --exclude xtask --test grbl`.

mod bench;
mod cable;
mod cam;
mod chance;
mod changer;
mod check;
mod clock;
mod damage;
mod edge;
mod faults;
mod firmware;
mod jobs;
mod jog;
mod judge;
mod keys;
mod level;
mod other;
mod park;
mod sender;
mod setter;
mod stops;
mod tools;
mod whole;
