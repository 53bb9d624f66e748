//! Tests of the bridge with a USB step adapter: the real firmware in an emulated RP2040 on a
//! pseudo-terminal, and a machine at its pins. Only the pins are judged.
//!
//! Needs the firmware, which `cargo xtask test adapter` builds; not part of a plain `cargo test`.

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
