//! The local server as strangers, friends and broken programs meet it: the real binary, real sockets, its own home.

pub(crate) mod card;
pub(crate) mod client;
mod commands;
mod door;
pub(crate) mod drill;
mod lab;
mod limits;
mod pages;
mod spindle;
mod uploads;
pub(crate) mod work;
