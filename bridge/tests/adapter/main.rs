//! The bridge with a USB step adapter (N18): the real firmware in an emulated RP2040 behind a pseudo-terminal, and a machine behind its
//! pins. Judged by the pins alone.
//!
//! The firmware has to be there: `cargo xtask test adapter` builds it. Not part of a plain `cargo test`.

mod bench;
#[path = "../server/client.rs"]
#[expect(dead_code, reason = "the other tests are ruder")]
mod client;
#[path = "../server/drill.rs"]
mod drill;
mod jobs;
mod refusals;
mod shop;
mod touches;
