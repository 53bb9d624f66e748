//! Tests of the queue of work commands: text, refusals with their positions, the dry check, and whole runs
//! on the virtual drill.

mod change;
mod runs;
mod words;
