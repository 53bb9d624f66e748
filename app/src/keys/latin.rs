//! Translates letters of other scripts (Cyrillic, Greek, Hebrew and others) by the key's position, because
//! the shortcut table has only Latin letters.

/// The end of the contiguous Latin blocks, up to Latin Extended-B.
const LAST_LATIN: char = '\u{24f}';
/// Latin Extended Additional, for example Vietnamese letters.
const MORE_LATIN: std::ops::RangeInclusive<char> = '\u{1e00}'..='\u{1eff}';

/// The character at the position `code` of a Latin keyboard if `key` is a letter or digit of another script;
/// else `key`.
pub fn latin(key: &str, code: &str) -> String {
    let mut signs = key.chars();
    let one = signs.next().filter(|_| signs.next().is_none());
    let foreign =
        one.is_some_and(|one| one.is_alphanumeric() && one > LAST_LATIN && !MORE_LATIN.contains(&one));
    match at(code).filter(|_| foreign) {
        Some(sign) => sign,
        None => key.to_owned(),
    }
}

fn at(code: &str) -> Option<String> {
    if let Some(sign) = code.strip_prefix("Key").or_else(|| code.strip_prefix("Digit")) {
        return Some(sign.to_lowercase());
    }
    let sign = match code {
        "Comma" => ",",
        "Period" => ".",
        "Quote" => "'",
        _ => return None,
    };
    Some(sign.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::{Act, DrawKey, Tool};
    use crate::keys::{CamKey, KeyAction, OwnKeys, Press, Tab, action};

    #[test]
    fn non_latin_letters_map_to_the_key_position() {
        let rows = [
            ("я", "KeyZ", "z"),
            ("Я", "KeyZ", "z"),
            ("ζ", "KeyZ", "z"),
            ("ש", "KeyA", "a"),
            ("۲", "Digit2", "2"),
            ("б", "Comma", ","),
            ("ю", "Period", "."),
            ("э", "Quote", "'"),
            ("х", "BracketLeft", "х"),
            // French, Polish and German keyboards type Latin letters, so nothing is translated.
            ("a", "KeyQ", "a"),
            ("z", "KeyY", "z"),
            ("ą", "KeyA", "ą"),
            ("ß", "Minus", "ß"),
            ("ế", "Digit8", "ế"),
            ("@", "KeyQ", "@"),
            ("Enter", "NumpadEnter", "Enter"),
            ("Dead", "Quote", "Dead"),
        ];
        for (key, code, expected) in rows {
            assert_eq!(latin(key, code), expected, "{key} at {code}");
        }
    }

    #[test]
    fn shortcuts_work_on_non_latin_keyboards() {
        let undo = KeyAction::Draw(DrawKey::Act(Act::Undo { back: true }));
        let rows = [
            ("", "я", "KeyZ", true, Tab::Draw, undo),
            ("", "ы", "KeyS", true, Tab::Board, KeyAction::Save),
            ("", "щ", "KeyO", true, Tab::Machine, KeyAction::Open),
            ("", "φ", "KeyF", false, Tab::Board, KeyAction::Flip),
            ("", "ч", "KeyX", false, Tab::Draw, KeyAction::Draw(DrawKey::Tool(Tool::Track))),
            ("", "о", "KeyJ", false, Tab::Machine, KeyAction::ArmKeys),
            ("", "ф", "KeyA", false, Tab::Cam, KeyAction::Cam(CamKey::Add)),
            ("", "ю", "Period", false, Tab::Simulate, KeyAction::Faster { more: true }),
            // A custom key is matched both by its position and as a letter of another script.
            ("everywhere f w\n", "ц", "KeyW", false, Tab::Board, KeyAction::Flip),
            ("everywhere f я\n", "я", "KeyZ", false, Tab::Board, KeyAction::Flip),
        ];
        for (own, key, code, ctrl, tab, expected) in rows {
            let press = Press { key: key.to_owned(), code: code.to_owned(), ctrl, ..Press::default() };
            let found = OwnKeys::of_kept(own).translated(&press, tab);
            let found = found.and_then(|press| action(&press, tab, true));
            assert_eq!(found, Some(expected), "{key} at {code} on {tab:?}");
        }
    }
}
