//! Tests of the local server with strangers, known pages and broken clients: the real binary, real sockets,
//! its own home.

pub(crate) mod card;
pub(crate) mod client;
mod commands;
#[cfg(target_os = "linux")]
mod controller;
mod door;
pub(crate) mod drill;
mod lab;
mod limits;
pub(crate) mod machine_time;
#[cfg(target_os = "linux")]
mod mill;
mod pages;
mod spindle;
mod uploads;
pub(crate) mod work;
