//! All tests of the program `annulus` from outside, in one binary, so that it is linked once.

#[cfg(target_os = "linux")]
mod baud;
mod cam;
mod cast;
mod cli;
mod faults;
mod firmware;
mod kill;
mod lab;
mod magazine;
mod one_planner;
mod programs;
#[cfg(target_os = "linux")]
mod progress;
mod provoked;
#[cfg(target_os = "linux")]
mod pty;
mod queue;
#[cfg(target_os = "linux")]
mod refused;
mod run;
mod server;
#[cfg(target_os = "linux")]
mod stood;
#[cfg(target_os = "linux")]
mod stopped;
#[cfg(target_os = "linux")]
mod swallowed;
mod tools;
mod twin;
