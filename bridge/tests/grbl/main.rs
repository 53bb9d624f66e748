//! Tests of `annulus grbl` with the unmodified GRBL 1.1h firmware on a simulated ATmega328P, on a
//! pseudo-terminal. Only the step pins are judged, by a judge independent of the product.
//!
//! Without the instrument each test reports that and is skipped; with `ANNULUS_NOTHING_SKIPPED` it fails.
//! Not part of a plain `cargo test`: `cargo xtask test grbl`, or `cargo test --workspace --exclude xtask
//! --test grbl`.

mod bench;
mod cable;
mod cam;
mod chance;
mod changer;
mod check;
#[allow(dead_code)]
#[path = "../server/client.rs"]
mod client;
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
#[path = "../server/mill.rs"]
mod mill;
mod other;
mod park;
#[path = "../progress.rs"]
mod progress;
mod sender;
mod served;
mod setter;
mod stops;
mod tools;
mod whole;
