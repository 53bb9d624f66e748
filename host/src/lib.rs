//! The drill: one owner of machine, job, journal and pins. Everything that can move is ordered here.
//!
//! ```text
//! asks, plans, STOP ─ Message ─▶ owner ── tasks ──▶ executor (Place) ── steps ──▶ pins
//!      pages ◀─ Outside::tell ───┤  ▲   control: (session, event) → (session, actions)      │
//!                                │  └── report: done, gated, stopped, alarm ◀──────────────┘
//!                                └── legs started and done ──▶ Outside::record ── durable ──▶ allows the next hole
//! ```

pub mod adapter;
mod alone;
pub mod executor;
mod files;
pub mod grbl;
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
pub use programs::Upload;
pub use recording::{Keeper, Recording};
pub use surface::{KeptSurface, KnownHeight};
pub use ticket::{Ticket, Tickets};
