//! Regression tests for faults found by heavy use.

mod flood;
mod jog;
#[cfg(unix)]
mod journal;
mod pause;
mod waiting;
#[cfg(target_os = "linux")]
mod watchdog;
