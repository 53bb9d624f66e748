//! The link between the bridge and the USB step adapter; both ends run the same code. No standard library,
//! no heap, no dependencies.
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
//! | `crc` | checksums |  |
//! | `cobs` | framing |  |
//! | `frame` | header and payload under one CRC | `bytes`, `cobs`, `crc` |
//! | `message` | every message, described once | `bytes` |
//! | `filter` | an input that counts only after a long enough touch |  |
//! | `run` | steps of one axis, the arithmetic of the step stream | `bytes` |
//! | `phases` | motors by their phases: patterns, forcing, their words | `bytes`, `crc`, `message` |
//! | `chunk` | a piece of path, and its check | `bytes`, `crc`, `frame`, `message`, `run` |
//! | `cutter` | chunks from the path of a segment | `chunk`, `frame`, `message`, `run` |
//! | `store` | waiting chunks, by bytes | `frame` |
//! | `receiver` | received frames in order, without gaps | `frame` |
//! | `sender` | numbered frames, repeated until confirmed | `bytes`, `chunk`, `frame`, `message`, `receiver`, `run`, `store` |
//! | `player` | words of one timeline from chunks, at the requested rate | `bytes`, `chunk`, `frame`, `message`, `phases`, `run`, `store` |
//! | `adapter` | one adapter: session, settings, motion, status | `bytes`, `chunk`, `cobs`, `crc`, `filter`, `frame`, `message`, `phases`, `player`, `receiver`, `store` |
//!
//! Times are in ticks of 0.1 µs, as in the step stream.

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

/// Axes of one adapter.
pub const AXES: usize = 4;

/// Inputs of one adapter, without the emergency stop.
pub const INPUTS: usize = 8;

pub const TICK_HZ: u32 = 10_000_000;

/// Clock cycles per tick: at 120 MHz, a whole number.
pub const CYCLES_PER_TICK: u32 = 12;

pub const NEWEST: u16 = 1;

/// Oldest version of the link that this build still speaks.
pub const OLDEST: u16 = 1;

/// Full rate of stream time, 65,536. Half of it is half the feed.
pub const FULL_RATE: u32 = 1 << 16;
