//! The jog keys, which move the machine while they are armed.

use crate::said::key;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandKey {
    Move {
        /// X, Y, Z from 0.
        axis: u8,
        /// Positive direction: right, back or up.
        up: bool,
    },
    /// Changes the step size.
    Step { finer: bool },
}

/// A jog key as shown in the help.
#[derive(Clone, Copy, Debug)]
pub struct HandKeyRow {
    /// How the key is written.
    pub written: &'static str,
    /// Key of its description in the locale tables.
    pub name: &'static str,
    pub key: &'static str,
    pub does: HandKey,
}

const fn row(written: &'static str, key: &'static str, name: &'static str, does: HandKey) -> HandKeyRow {
    HandKeyRow { written, name, key, does }
}

/// With Shift, a direction key moves ten steps.
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

/// The action of an armed key, if it has one.
pub fn by_hand(key: &str) -> Option<HandKey> {
    // With Shift, the `=` key types a plus.
    let key = if key == "+" { "=" } else { key };
    HAND_KEYS.iter().find(|row| row.key == key).map(|row| row.does)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_jog_direction_and_step_size_has_one_armed_key() {
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
