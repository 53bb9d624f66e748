//! The drill: one owner of machine, job, journal and pins, wherever it runs. Everything that can move goes through here.
//!
//! ```text
//! asks, plans, STOP ─ Message ─▶ owner ── tasks ──▶ executor (Place) ── steps ──▶ pins (virtual drill, or card)
//!        tells ◀─ Outside::tell ─┤  ▲   control: (session, event) → (session, actions)      │
//!                                │  └── report: done, gated, stopped, alarm ◀───────────────┘
//!                                └── legs begun and done ──▶ Outside::record ── durable ──▶ lets the next stroke start
//! ```
//!
//! Comes in: messages, the time, and an [`Outside`]. Goes out: tells, records, orders. Does not know sockets, sessions, leases, files,
//! nor whose thread it is.

pub mod adapter;
mod alone;
pub mod controller;
pub mod executor;
mod files;
mod grant;
pub mod journal;
mod line;
mod outside;
mod owner;
mod place;
pub mod prepare;
mod programs;
mod recording;
mod surface;
#[cfg(test)]
mod tests;
mod ticket;

pub use alone::{Alone, Port};
pub use executor::Time;
pub use files::{File, Files};
pub use outside::Outside;
pub use owner::board::line;
pub use owner::{Message, Owner, Parts};
pub use place::{Next, Orders, Place};
pub use recording::{Keeper, Recording};
pub use surface::KeptSurface;
pub use ticket::{Ticket, Tickets};
