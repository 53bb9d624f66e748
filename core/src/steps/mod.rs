//! Step times: planned moves become runs of steps, which the pins replay.
//!
//! ```text
//! Timeline ─ stream ─▶ StepStream ─┬─ replay ─▶ pulse, pulse, pulse …   (pins, sim)
//!      fit: times → runs           ├─ digest ─▶ SHA-256                 (page = bridge?)
//!                                  ├─ compact ─▶ bytes                   (to send; packed: to store)
//!                                  └─ check
//! ```

pub mod bench;
mod bits;
pub mod compact;
pub mod digest;
mod fit;
mod make;
mod packed;
pub mod replay;
pub mod stream;

pub use crate::job::{Stage, Switching};
pub use crate::machine::{AXES, Steps};
pub use crate::motion::automaton;
pub use compact::{compact, expand};
pub use digest::{digest, digest_of, encoded_len, trace};
pub use make::{segment, stream, stream_of, stream_telling};
pub use packed::Packed;
pub use replay::{Pulse, Replay, replay, replay_stream};
pub use stream::{PARTS, Run, Segment, StepStream, TICK_HZ};
