//! The keys that move the machine by hand while they are armed.
//!
//! Comes in: a key. Goes out: which way, or another step. Does not know whether they are armed, nor whether the machine may move.

use crate::said::key;

/// What an armed key does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandKey {
    /// Moves an axis.
    Move {
        /// X, Y, Z from 0.
        axis: u8,
        /// To the right, away or up; else the other way.
        up: bool,
    },
    /// Makes the step another one.
    Step {
        /// A finer one.
        finer: bool,
    },
}

/// An armed key that people can look up.
#[derive(Clone, Copy, Debug)]
pub struct HandKeyRow {
    /// How it is written.
    pub written: &'static str,
    /// What it does, a key of the locale tables.
    pub name: &'static str,
    /// `KeyboardEvent.key`.
    pub key: &'static str,
    /// The same for the program.
    pub does: HandKey,
}

const fn row(written: &'static str, key: &'static str, name: &'static str, does: HandKey) -> HandKeyRow {
    HandKeyRow { written, name, key, does }
}

/// All of them. Shift with a way is ten steps.
pub const HAND_KEYS: [HandKeyRow; 8] = [
    row("→", "ArrowRight", key!("page.jog.x_plus"), HandKey::Move { axis: 0, up: true }),
    row("←", "ArrowLeft", key!("page.jog.x_minus"), HandKey::Move { axis: 0, up: false }),
    row("↑", "ArrowUp", key!("page.jog.y_plus"), HandKey::Move { axis: 1, up: true }),
    row("↓", "ArrowDown", key!("page.jog.y_minus"), HandKey::Move { axis: 1, up: false }),
    row("PageUp", "PageUp", key!("page.jog.z_plus"), HandKey::Move { axis: 2, up: true }),
    row("PageDown", "PageDown", key!("page.jog.z_minus"), HandKey::Move { axis: 2, up: false }),
    row("-", "-", key!("page.key.step_finer"), HandKey::Step { finer: true }),
    row("=", "=", key!("page.key.step_coarser"), HandKey::Step { finer: false }),
];

/// What an armed key does; none where it is no such key.
pub fn by_hand(key: &str) -> Option<HandKey> {
    // With Shift the same key types a plus.
    let key = if key == "+" { "=" } else { key };
    HAND_KEYS.iter().find(|row| row.key == key).map(|row| row.does)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_has_one_armed_key_and_both_ways_of_the_step_too() {
        let ways = (0..3).flat_map(|axis| [true, false].map(|up| HandKey::Move { axis, up }));
        let steps = [true, false].map(|finer| HandKey::Step { finer });
        for wanted in ways.chain(steps) {
            assert_eq!(HAND_KEYS.iter().filter(|row| row.does == wanted).count(), 1, "{wanted:?}");
        }
        assert_eq!(by_hand("PageUp"), Some(HandKey::Move { axis: 2, up: true }));
        assert_eq!(by_hand("+"), Some(HandKey::Step { finer: false }));
        assert_eq!(["Home", "a", ""].map(by_hand), [None; 3]);
    }
}
