//! A USB step adapter at a serial port of this computer: its port, and the thread that owns it (N18). What is said to it is in
//! [`annulus_drill::adapter`].
//!
//! | file | makes |
//! |---|---|
//! | `port` | the port found and opened: a cable |
//! | `image` | a firmware as a file, and the disk of a board that takes it |
//! | `flash` | a firmware brought into an adapter |
//! | `seat` | the thread, as its owner sees it |
//!
//! Comes in: a machine, messages. Goes out: pulses elsewhere, reports. Does not know jobs.

pub(crate) mod flash;
pub(crate) mod image;
mod port;
mod seat;

pub(crate) use port::{adapters, is_adapter};
pub(crate) use seat::start;
