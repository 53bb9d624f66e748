//! All tests of `core` through its public interface, in one program so that linking happens once. The page's
//! tests in a browser include `same_everywhere` too.

mod automaton;
mod carve;
mod carving;
mod feed_override;
mod foot;
mod grbl;
mod magazine;
mod motion;
mod operator;
mod parameters;
mod phases;
mod planning;
mod post;
mod programs;
mod queue;
mod reference;
mod same_everywhere;
mod servo;
mod settings;
mod sweep;
mod virtual_drill;
