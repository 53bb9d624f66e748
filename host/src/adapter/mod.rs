//! The executor for a USB step adapter: a coroutine that plays tasks. A thread of the bridge, or a page
//! with Web Serial, drives it.
//!
//! ```text
//! owner ── orders ──▶ hand: task ─ segments ─▶ chunks ─▶ Sender ── frames ──▶ Cable ═══ adapter ══▶ pins
//!   ▲                   │  ▲                                                              │
//!   └── reports ────────┘  └──────────────── Status: state, index, inputs ◀───────────────┘
//! ```
//!
//! The adapter keeps the time, and stops on the path by itself if no newer frame arrives. So the computer
//! may die at any moment without leaving anything to be made safe.
//!
//! | file | makes |
//! |---|---|
//! | `line` | frames from the bytes of a cable, and the adapter's last messages |
//! | `path` | a segment as runs of the adapter's axes, and the sensors that must stay off meanwhile |
//! | `feed` | pieces of the remaining path |
//! | `greet` | an adapter identified and configured, or the reason why not |
//! | `play` | segments played to their end, or to the point where something stopped them |
//! | `hand` | tasks and orders, one after the other |

mod feed;
mod greet;
mod hand;
mod line;
mod path;
mod play;

pub use greet::{other_firmware, own_firmware, touches, who};
pub use hand::{attend, greeted};
pub use line::{AdapterLine, Cable};

/// USB vendor and product ID of the adapter: pid.codes' ID for tests, which anyone may use.
pub const USB: (u16, u16) = (0x1209, 0x0001);
