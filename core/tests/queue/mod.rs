//! The queue of work commands: text, refusals with their places, the dry check, and whole runs on the virtual drill (A8).

mod runs;
mod words;
