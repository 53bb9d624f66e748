//! Keys of one's own: a single letter or sign of the table is moved to another.
//!
//! ```text
//! press ─▶ sign of one's own? ──yes──▶ the sign of the table that it stands for ─▶ action
//!              │no
//!              ├─ sign whose place was moved ─▶ nothing
//!              └─ any other ──────────────────▶ as it is
//! ```
//!
//! Comes in: a press, choices of the person, their text in the store. Goes out: the press that the table knows. Keys with Ctrl or
//! Alt, capitals and keys that type nothing stay where they are: STOP among them. Knows no browser.

use super::{Press, SHORTCUTS, Shortcut, Tab, is_sign, latin};

/// Signs that belong to the help and to the zoom on every screen, and those that Shift makes of 1 and 2, which fit the picture.
const TAKEN: &str = "?+-_=!@";

/// What is kept in place of a screen for keys of all of them.
const EVERYWHERE: &str = "everywhere";

/// One moved sign: on this screen, or on all where there is none, `to` does what `from` does in the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Own {
    tab: Option<Tab>,
    from: char,
    to: char,
}

/// The moved signs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct OwnKeys(Vec<Own>);

/// The sign of a shortcut that is a single one.
fn sign_of(shortcut: &Shortcut) -> Option<char> {
    single(shortcut.keys)
}

fn single(text: &str) -> Option<char> {
    let mut signs = text.chars();
    signs.next().filter(|_| signs.next().is_none())
}

/// Whether a shortcut can be moved: its key is a single letter or sign.
pub fn is_of_ones_own(shortcut: &Shortcut) -> bool {
    sign_of(shortcut).is_some()
}

/// The sign of a press that may have been moved. A capital is another key.
fn movable(press: &Press) -> Option<char> {
    let sign = single(&press.key.to_lowercase()).filter(|_| !press.focus.is_text() && is_sign(press))?;
    (!press.shift || !sign.is_alphabetic()).then_some(sign)
}

/// Whether keys of two screens can be pressed on one; none is all of them.
fn meet(one: Option<Tab>, other: Option<Tab>) -> bool {
    one.is_none() || other.is_none() || one == other
}

/// Whether the page keeps a sign for itself.
fn is_kept_back(sign: char) -> bool {
    TAKEN.contains(sign) || sign.is_control() || sign.is_whitespace()
}

/// A moved sign from a line of what was kept, where the table has it.
fn of_line(line: &str) -> Option<Own> {
    let [screen, from, to] = line.split(' ').collect::<Vec<_>>().try_into().ok()?;
    let tab = match screen {
        EVERYWHERE => None,
        word => Some(Tab::ALL.into_iter().find(|tab| tab.word() == word)?),
    };
    let shortcut = SHORTCUTS.iter().find(|shortcut| shortcut.tab == tab && shortcut.keys == from)?;
    let (from, to) = (sign_of(shortcut)?, single(to)?);
    (to != from && !is_kept_back(to)).then_some(Own { tab, from, to })
}

impl OwnKeys {
    /// The sign that does what `shortcut` is for; none where its key is no single one.
    pub fn sign(&self, shortcut: &Shortcut) -> Option<char> {
        let from = sign_of(shortcut)?;
        let moved = self.0.iter().find(|own| own.tab == shortcut.tab && own.from == from);
        Some(moved.map_or(from, |own| own.to))
    }

    /// How a shortcut is written for people.
    pub fn written(&self, shortcut: &Shortcut) -> String {
        match self.sign(shortcut) {
            Some(sign) => sign.to_uppercase().collect(),
            None => shortcut.written(),
        }
    }

    /// `shortcut` is done by `sign` from now on.
    ///
    /// # Errors
    ///
    /// The shortcut that has this sign already; none where the page keeps it, or where `text` is no single sign that types something.
    pub fn set(&mut self, shortcut: &'static Shortcut, text: &str) -> Result<(), Option<&'static Shortcut>> {
        let to = single(text.trim()).and_then(|sign| single(&sign.to_lowercase().to_string())).ok_or(None)?;
        let from = sign_of(shortcut).ok_or(None)?;
        if to != from && is_kept_back(to) {
            return Err(None);
        }
        let is_other = |other: &&Shortcut| (other.tab, other.keys) != (shortcut.tab, shortcut.keys);
        let others = SHORTCUTS.iter().filter(is_other).filter(|other| meet(other.tab, shortcut.tab));
        if let Some(other) = others.into_iter().find(|other| self.sign(other) == Some(to)) {
            return Err(Some(other));
        }
        self.0.retain(|own| own.tab != shortcut.tab || own.from != from);
        if to != from {
            self.0.push(Own { tab: shortcut.tab, from, to });
        }
        Ok(())
    }

    /// All are where the table has them.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The press as the table knows it; none where its sign was moved away. A letter of another script is one of one's own, or that
    /// of its place.
    pub fn translated(&self, press: &Press, tab: Tab) -> Option<Press> {
        let mut here = self.0.iter().filter(|own| meet(own.tab, Some(tab)));
        let at_place = Press { key: latin(&press.key, &press.code), ..press.clone() };
        for press in [press, &at_place] {
            let sign = movable(press);
            if let Some(own) = here.clone().find(|own| sign == Some(own.to)) {
                return Some(Press {
                    key: own.from.to_string(),
                    code: String::new(),
                    shift: false,
                    ..press.clone()
                });
            }
        }
        let sign = movable(&at_place);
        here.all(|own| sign != Some(own.from)).then_some(at_place)
    }

    /// As it is kept: a line for each, screen, sign of the table, sign of one's own.
    pub fn kept(&self) -> String {
        let word = |tab: Option<Tab>| tab.map_or(EVERYWHERE, Tab::word);
        self.0.iter().map(|own| format!("{} {} {}\n", word(own.tab), own.from, own.to)).collect()
    }

    /// From what was kept; what no longer fits the table is left out.
    pub fn of_kept(text: &str) -> Self {
        let mut keys = Self(text.lines().take(SHORTCUTS.len()).filter_map(of_line).collect());
        // All of them count at once: two may have changed their places.
        while let Some(at) = keys.0.iter().position(|own| !keys.is_free_for(own)) {
            keys.0.remove(at);
        }
        keys
    }

    /// Whether nothing else has the sign of a moved one.
    fn is_free_for(&self, own: &Own) -> bool {
        let others = SHORTCUTS.iter().filter(|other| meet(other.tab, own.tab));
        others.filter(|other| self.sign(other) == Some(own.to)).count() == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keys::{KeyAction, KeyFocus, action};

    fn named(tab: Option<Tab>, keys: &str) -> &'static Shortcut {
        SHORTCUTS.iter().find(|one| one.tab == tab && one.keys == keys).expect(keys)
    }

    fn pressed(own: &OwnKeys, key: &str, tab: Tab) -> Option<KeyAction> {
        let press = Press { key: key.to_owned(), ..Press::default() };
        action(&own.translated(&press, tab)?, tab, true)
    }

    #[test]
    fn every_single_key_can_be_moved_and_does_the_same_elsewhere() {
        for shortcut in SHORTCUTS.iter().filter(|shortcut| is_of_ones_own(shortcut)) {
            let tab = shortcut.tab.unwrap_or(Tab::Board);
            let mut own = OwnKeys::default();
            assert_eq!(pressed(&own, shortcut.keys, tab), Some(shortcut.action), "{}", shortcut.keys);
            own.set(shortcut, "Ż").expect(shortcut.keys);
            assert_eq!(pressed(&own, "ż", tab), Some(shortcut.action), "{} by ż", shortcut.keys);
            assert_eq!(pressed(&own, shortcut.keys, tab), None, "{} is free", shortcut.keys);
            assert_eq!(own.written(shortcut), "Ż");
            assert_eq!(OwnKeys::of_kept(&own.kept()), own);
            own.set(shortcut, shortcut.keys).expect("back");
            assert!(own.is_empty());
        }
    }

    #[test]
    fn a_sign_that_is_in_use_on_the_same_screen_is_refused() {
        let mut own = OwnKeys::default();
        let flip = named(None, "f");
        let rows = [
            ("v", Some(named(Some(Tab::Draw), "v"))),
            ("3", Some(named(None, "3"))),
            ("+", None),
            ("ab", None),
            ("", None),
        ];
        for (sign, by) in rows {
            let refused = own.set(flip, sign).expect_err(sign);
            assert_eq!(refused.map(|one| (one.tab, one.keys)), by.map(|one| (one.tab, one.keys)), "{sign}");
        }
        assert!(own.is_empty());
        // Another screen has keys of its own, and a sign that was moved away is free.
        own.set(named(Some(Tab::Draw), "v"), "a").expect("a is of CAM");
        own.set(flip, "v").expect("free now");
        assert_eq!(pressed(&own, "v", Tab::Draw), Some(KeyAction::Flip));
    }

    #[test]
    fn text_capitals_and_keys_with_control_are_not_moved() {
        let mut own = OwnKeys::default();
        own.set(named(Some(Tab::Draw), "r"), "q").expect("free");
        let press = |key: &str, ctrl, shift, in_text| Press {
            key: key.to_owned(),
            ctrl,
            shift,
            focus: if in_text { KeyFocus::Text } else { KeyFocus::Elsewhere },
            ..Press::default()
        };
        for (key, ctrl, shift, in_text) in [
            ("r", false, false, true),
            ("R", false, true, false),
            ("r", true, false, false),
            ("Escape", false, false, false),
        ] {
            let as_it_is = press(key, ctrl, shift, in_text);
            let translated = own.translated(&as_it_is, Tab::Draw).map(|press| press.key);
            assert_eq!(translated.as_deref(), Some(key));
        }
        assert_eq!(own.translated(&press("r", false, false, false), Tab::Draw).map(|press| press.key), None);
    }

    #[test]
    fn kept_text_that_fits_no_table_is_left_out() {
        let own = OwnKeys::of_kept("draw r q\nnowhere f s\ndraw zz y\ndraw p v\ndraw n !\n\n \ndraw\n");
        assert_eq!(own.kept(), "draw r q\n");
    }

    #[test]
    fn signs_that_changed_their_places_are_kept_in_any_order() {
        let draw = |keys| named(Some(Tab::Draw), keys);
        let rows = [
            [(draw("r"), "q"), (draw("b"), "r"), (draw("r"), "b")],
            [(draw("v"), "a"), (named(None, "f"), "v"), (draw("v"), "q")],
        ];
        for moves in rows {
            let mut own = OwnKeys::default();
            for (shortcut, sign) in moves {
                own.set(shortcut, sign).expect("free");
            }
            assert_eq!(OwnKeys::of_kept(&own.kept()), own, "{}", own.kept());
        }
    }
}
