//! The queue of work commands: text, refusals with their places, the dry check, and whole runs on the virtual drill (A8).

#[path = "../programs/mod.rs"]
#[allow(dead_code)]
mod programs;

mod runs;
mod words;
