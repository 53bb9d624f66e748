//! A USB step adapter at a serial port of this computer: its port, and the thread that owns it. The
//! protocol is in [`annulus_host::adapter`].
//!
//! | file | makes |
//! |---|---|
//! | `port` | a cable: finds and opens the port |
//! | `image` | a checked firmware file, and the disk of a board in boot mode |
//! | `flash` | an adapter with new firmware |
//! | `seat` | the thread, as its owner sees it |

pub(crate) mod flash;
pub(crate) mod image;
mod port;
mod seat;

pub(crate) use port::{adapters, is_adapter};
pub(crate) use seat::start;
