//! The local server as strangers, friends and broken programs meet it: the real binary, real sockets, its own home.

mod card;
mod client;
mod commands;
mod door;
mod lab;
mod limits;
mod pages;
mod uploads;
mod work;
