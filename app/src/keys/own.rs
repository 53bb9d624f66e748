//! Custom keys: moves a single letter or sign of the table to another.
//!
//! ```text
//! press ─▶ custom sign? ──yes──▶ the table's sign that it replaces ─▶ action
//!              │no
//!              ├─ sign that was moved away ─▶ nothing
//!              └─ any other ────────────────▶ unchanged
//! ```
//!
//! Keys with Ctrl or Alt, capitals and keys without a character can't be moved. STOP is one of these.

use super::{Press, SHORTCUTS, Shortcut, Tab, is_sign, latin};

/// Signs for help and zoom on every screen, and `!` and `@` (Shift+1 and Shift+2), which fit the picture.
const TAKEN: &str = "?+-_=!@";

/// Stored in place of a screen for shortcuts of all screens.
const EVERYWHERE: &str = "everywhere";

/// A moved sign: on screen `tab` (none for all), `to` replaces the table's `from`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Own {
    tab: Option<Tab>,
    from: char,
    to: char,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct OwnKeys(Vec<Own>);

fn sign_of(shortcut: &Shortcut) -> Option<char> {
    single(shortcut.keys)
}

fn single(text: &str) -> Option<char> {
    let mut signs = text.chars();
    signs.next().filter(|_| signs.next().is_none())
}

/// True if the shortcut can be moved: its key is a single letter or sign.
pub fn is_of_ones_own(shortcut: &Shortcut) -> bool {
    sign_of(shortcut).is_some()
}

/// The sign of a press that may have been moved. Capitals are other keys.
fn movable(press: &Press) -> Option<char> {
    let sign = single(&press.key.to_lowercase()).filter(|_| !press.focus.is_text() && is_sign(press))?;
    (!press.shift || !sign.is_alphabetic()).then_some(sign)
}

/// True if shortcuts of these two screens can collide; none means all screens.
fn meet(one: Option<Tab>, other: Option<Tab>) -> bool {
    one.is_none() || other.is_none() || one == other
}

fn is_kept_back(sign: char) -> bool {
    TAKEN.contains(sign) || sign.is_control() || sign.is_whitespace()
}

/// Parses a stored line; none if the table has no such shortcut.
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
    /// The sign that runs `shortcut`; none if its key isn't a single character.
    pub fn sign(&self, shortcut: &Shortcut) -> Option<char> {
        let from = sign_of(shortcut)?;
        let moved = self.0.iter().find(|own| own.tab == shortcut.tab && own.from == from);
        Some(moved.map_or(from, |own| own.to))
    }

    pub fn written(&self, shortcut: &Shortcut) -> String {
        match self.sign(shortcut) {
            Some(sign) => sign.to_uppercase().collect(),
            None => shortcut.written(),
        }
    }

    /// Moves `shortcut` to `text`.
    ///
    /// # Errors
    ///
    /// The shortcut that already has this sign; none if the sign is reserved or `text` isn't a single
    /// character.
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

    /// True if nothing is moved.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The press in terms of the table; none if its sign was moved away. A letter of another script can be a
    /// custom key itself, or mean the Latin letter at its position.
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

    /// For storage: one line per moved sign, with screen, table sign and custom sign.
    pub fn kept(&self) -> String {
        let word = |tab: Option<Tab>| tab.map_or(EVERYWHERE, Tab::word);
        self.0.iter().map(|own| format!("{} {} {}\n", word(own.tab), own.from, own.to)).collect()
    }

    /// From storage; drops lines that no longer fit the table.
    pub fn of_kept(text: &str) -> Self {
        let mut keys = Self(text.lines().take(SHORTCUTS.len()).filter_map(of_line).collect());
        // Check all lines together, because two shortcuts may have swapped their signs.
        while let Some(at) = keys.0.iter().position(|own| !keys.is_free_for(own)) {
            keys.0.remove(at);
        }
        keys
    }

    /// True if no other shortcut has this sign.
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
    fn every_single_key_can_be_reassigned() {
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
    fn character_in_use_on_the_same_screen_is_refused() {
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
        // Other screens have separate keys, and a sign that was moved away is free.
        own.set(named(Some(Tab::Draw), "v"), "a").expect("a is of CAM");
        own.set(flip, "v").expect("free now");
        assert_eq!(pressed(&own, "v", Tab::Draw), Some(KeyAction::Flip));
    }

    #[test]
    fn text_capitals_and_ctrl_keys_are_not_reassigned() {
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
    fn invalid_saved_key_rows_are_dropped() {
        let own = OwnKeys::of_kept("draw r q\nnowhere f s\ndraw zz y\ndraw p v\ndraw n !\n\n \ndraw\n");
        assert_eq!(own.kept(), "draw r q\n");
    }

    #[test]
    fn swapped_keys_are_saved_and_restored() {
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
