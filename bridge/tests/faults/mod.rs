//! Faults that hard use found, each with a test that failed before it was mended; the list is in `tests/faults`.

mod flood;
mod jog;
#[cfg(unix)]
mod journal;
mod pause;
mod waiting;
#[cfg(target_os = "linux")]
mod watchdog;
