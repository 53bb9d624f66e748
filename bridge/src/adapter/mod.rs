//! A USB step adapter at a serial port: the thread that owns it (N18).
//!
//! ```text
//! owner ── orders ──▶ thread: task ─ segments ─▶ chunks ─▶ Sender ── frames ──▶ port ═══ adapter ══▶ pins
//!   ▲                   │  ▲                                                              │
//!   └── reports ────────┘  └──────────────── Status: state, index, inputs ◀───────────────┘
//! ```
//!
//! The adapter keeps the time and comes to rest on the path by itself when nothing newer comes. So this is no process of its own:
//! when the bridge dies, nothing is left that has to be made safe.
//!
//! | file | makes |
//! |---|---|
//! | `line` | frames of bytes at a port, and what the adapter said last |
//! | `connect` | the adapter found, greeted, set; or a sentence why not |
//! | `path` | a segment as runs of the adapter's axes, and what must stay off meanwhile |
//! | `feed` | pieces of the path that is left |
//! | `play` | segments played to their end, or to where something ended them |
//! | `hand` | tasks and orders, one after the other |
//! | `seat` | the thread, as its owner sees it |
//!
//! Comes in: a machine, messages. Goes out: pulses elsewhere, reports. Does not know jobs.

mod connect;
mod feed;
mod hand;
mod line;
mod path;
mod play;
mod seat;

pub(crate) use connect::is_adapter;
pub(crate) use seat::start;
