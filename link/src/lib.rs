//! The link between the bridge and the USB step adapter (N18), the same code at both ends. Without a standard library,
//! without memory of a heap, without dependencies: `core/src/wire` speaks to pages in JSON and needs both.
//!
//! ```text
//! bridge                                              adapter
//! message ─▶ Sender ─ frame: COBS(header, payload, CRC) ─▶ Receiver ─▶ Adapter ─▶ Player ─▶ words per axis ─▶ pins
//!               ▲                                              │
//!               └──────────── Status: next, held, limit ◀──────┘      every 10 ms, lossy, always the latest
//! ```
//!
//! Files, lowest first, and what each may name:
//!
//! | file | makes | may name |
//! |---|---|---|
//! | `bytes` | numbers as bytes |  |
//! | `crc` | checks |  |
//! | `cobs` | framing |  |
//! | `frame` | header and payload under one CRC | `bytes`, `cobs`, `crc` |
//! | `message` | every message, described once | `bytes` |
//! | `filter` | an input that counts only when it is touched for long enough |  |
//! | `run` | steps of one axis, the arithmetic of the step stream | `bytes` |
//! | `phases` | motors by their phases: patterns, forcing, their words | `bytes`, `crc`, `message` |
//! | `chunk` | a piece of path, and whether it may be played | `bytes`, `crc`, `frame`, `message`, `run` |
//! | `cutter` | the path of a segment into chunks | `chunk`, `frame`, `message`, `run` |
//! | `store` | chunks in waiting, by bytes | `frame` |
//! | `receiver` | frames as they come, without gaps over a bad line | `frame` |
//! | `sender` | numbered frames, sent again until they are there | `bytes`, `chunk`, `frame`, `message`, `receiver`, `run`, `store` |
//! | `player` | chunks into words of one timeline, at the rate that is wanted | `bytes`, `chunk`, `frame`, `message`, `phases`, `run`, `store` |
//! | `adapter` | one adapter: session, settings, motion, status | `bytes`, `chunk`, `cobs`, `crc`, `filter`, `frame`, `message`, `phases`, `player`, `receiver`, `store` |
//!
//! Time is counted in ticks of 0.1 µs, as in the step stream. Does not know USB, pins or threads.

#![no_std]

pub mod adapter;
pub mod bytes;
pub mod chunk;
pub mod cobs;
pub mod crc;
pub mod cutter;
pub mod filter;
pub mod frame;
pub mod message;
pub mod phases;
pub mod player;
pub mod receiver;
pub mod run;
pub mod sender;
pub mod store;

/// Axes that one adapter drives.
pub const AXES: usize = 4;

/// Inputs that one adapter has, the emergency stop apart.
pub const INPUTS: usize = 8;

/// Ticks of a second.
pub const TICK_HZ: u32 = 10_000_000;

/// Clock cycles of a tick: the adapter runs at 120 MHz so that every tick is a whole number of them.
pub const CYCLES_PER_TICK: u32 = 12;

/// Newest version of the link that this build speaks.
pub const NEWEST: u16 = 1;

/// Oldest version of the link that this build still speaks.
pub const OLDEST: u16 = 1;

/// Full rate of stream time: 65,536 parts. Half of it is half the feed.
pub const FULL_RATE: u32 = 1 << 16;
