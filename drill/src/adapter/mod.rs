//! A USB step adapter as an executor (N18): a coroutine that plays tasks on it, whoever carries its bytes: a thread of the bridge, or a
//! page with Web Serial.
//!
//! ```text
//! owner ── orders ──▶ hand: task ─ segments ─▶ chunks ─▶ Sender ── frames ──▶ Cable ═══ adapter ══▶ pins
//!   ▲                   │  ▲                                                              │
//!   └── reports ────────┘  └──────────────── Status: state, index, inputs ◀───────────────┘
//! ```
//!
//! The adapter keeps the time and comes to rest on the path by itself when nothing newer comes. So nothing is left here that has to be
//! made safe when whoever plays this dies.
//!
//! | file | makes |
//! |---|---|
//! | `line` | frames of bytes on a cable, and what the adapter said last |
//! | `path` | a segment as runs of the adapter's axes, and what must stay off meanwhile |
//! | `feed` | pieces of the path that is left |
//! | `greet` | the adapter greeted and set; or a sentence why not |
//! | `play` | segments played to their end, or to where something ended them |
//! | `hand` | tasks and orders, one after the other |
//!
//! Comes in: a machine, orders, a cable, the time. Goes out: pulses elsewhere, reports. Does not know jobs, ports, threads or browsers.

mod feed;
mod greet;
mod hand;
mod line;
mod path;
mod play;

pub use greet::{other_firmware, own_firmware, touches, who};
pub use hand::{attend, greeted};
pub use line::{AdapterLine, Cable};

/// USB number of the adapter, vendor and product: one that everybody may use for trials.
pub const USB: (u16, u16) = (0x1209, 0x0001);
