//! Parses the words of a name or comment for a layer's role, side and number, in the languages of the CADs.
//!
//! ```text
//!   Kupfer_unten ─▶ copper, bottom     TOP SOLDER LAYER ─▶ mask, top     laptop ─▶ nothing
//!   art002 ─▶ copper, number 2
//! ```

use super::text::composed;
use super::word_list::{BOTH, LETTERS, Means, WORDS};
use super::{Role, Side};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Said {
    pub(super) role: Option<Role>,
    pub(super) side: Option<Side>,
    pub(super) number: Option<u32>,
    /// A word names the role itself. If not, a side or a number implies copper.
    pub(super) explicit: bool,
    /// The side is only the end of a longer word: `myboardtop`, but also `laptop`.
    pub(super) unsure: bool,
}

pub(super) fn said(text: &str) -> Said {
    let (mut whole, mut ends): (Vec<Means>, Vec<Means>) = (Vec::new(), Vec::new());
    let mut number = None;
    let mut before = String::new();
    for piece in pieces(&composed(text)) {
        if let Ok(value) = piece.parse::<u32>() {
            let is_layer = NUMBERED.contains(&before.as_str()) || before.ends_with("layer");
            number = number.or((is_layer && value <= MOST_LAYERS).then_some(value));
        } else if let Some((_, role, side)) = BOTH.iter().find(|(word, ..)| *word == piece) {
            whole.extend([Means::Role(*role), Means::Side(*side)]);
        } else if let Some(words) = split(&piece) {
            whole.extend(words);
        } else {
            let words = ending(&piece).unwrap_or_default();
            ends.extend(words.into_iter().filter(|means| matches!(means, Means::Role(_) | Means::Side(_))));
        }
        before = piece;
    }
    judged(&phrases(&whole), &ends, number)
}

const NUMBERED: [&str; 13] =
    ["l", "layer", "lyr", "lay", "art", "cu", "copper", "sig", "signal", "kupfer", "cuivre", "cobre", "etch"];
/// Higher numbers are not layer numbers.
const MOST_LAYERS: u32 = 64;
/// Minimum length of a word's front if its end is a separate word.
const LEAST_FRONT: usize = 3;

/// Roles by priority: a "copper mask" is a mask, a "copper layer drawing" is copper.
const WEIGHTS: [Role; 7] =
    [Role::Paste, Role::Mask, Role::Silk, Role::Outline, Role::Copper, Role::Other, Role::Drill];

/// Joins two words with one meaning: `solder side`, `solder mask`.
fn phrases(words: &[Means]) -> Vec<Means> {
    let mut out: Vec<Means> = Vec::new();
    for &word in words {
        let one = match (out.last(), word) {
            (Some(Means::Solder), Means::SideWord) => Some(Means::Side(Side::Bottom)),
            (Some(Means::Component), Means::SideWord) => Some(Means::Side(Side::Top)),
            (Some(Means::Solder), Means::Role(Role::Mask | Role::Paste)) => Some(word),
            _ => None,
        };
        match (one, out.last_mut()) {
            (Some(one), Some(last)) => *last = one,
            _ => out.push(word),
        }
    }
    out
}

fn role_among(words: &[Means]) -> Option<Role> {
    WEIGHTS.into_iter().find(|&role| words.contains(&Means::Role(role)))
}

fn sides_among(words: &[Means]) -> impl DoubleEndedIterator<Item = Side> {
    words.iter().filter_map(|means| if let Means::Side(side) = means { Some(*side) } else { None })
}

fn judged(words: &[Means], ends: &[Means], number: Option<u32>) -> Said {
    let has = |means: Means| words.contains(&means);
    let own = sides_among(words).next_back();
    let differ = sides_among(words).any(|side| Some(side) != own);
    let by_end = own.is_none().then(|| sides_among(ends).next_back()).flatten();
    let mut side = own.or(by_end);
    let role = role_among(words).or_else(|| role_among(ends));
    // `Top solder` is a mask, `top components` a drawing; without a side, these words are old names of the
    // sides.
    let role = match role {
        None if has(Means::Solder) && side.is_some() => Some(Role::Mask),
        None if has(Means::Component) && side.is_some() => Some(Role::Other),
        Some(Role::Copper) if has(Means::Solder) && side.is_some() => Some(Role::Mask),
        role => role,
    };
    if side.is_none() && role.is_none_or(|role| role == Role::Copper) {
        let old = has(Means::Solder).then_some(Side::Bottom);
        let plane = has(Means::Plane).then_some(Side::Inner);
        side = old.or(has(Means::Component).then_some(Side::Top)).or(plane);
    }
    let weak = (side.is_some() || number.is_some()).then_some(Role::Copper);
    let unsure = side.is_some() && (differ || own.is_none() && by_end.is_some());
    let side = side.filter(|_| !matches!(role, Some(Role::Outline | Role::Drill)));
    Said { role: role.or(weak), side, number, explicit: role.is_some(), unsure }
}

/// Splits a text at non-alphanumeric characters, between letters and digits, and before a capital after a
/// small letter.
fn pieces(text: &str) -> Vec<String> {
    let mut pieces: Vec<String> = Vec::new();
    let mut before: Option<char> = None;
    for letter in text.chars() {
        if !letter.is_alphanumeric() {
            before = None;
            continue;
        }
        let cut = before.is_none_or(|before| {
            before.is_ascii_digit() != letter.is_ascii_digit()
                || before.is_lowercase() && letter.is_uppercase()
        });
        match pieces.last_mut().filter(|_| !cut) {
            Some(piece) => piece.extend(letter.to_lowercase()),
            None => pieces.push(letter.to_lowercase().collect()),
        }
        before = Some(letter);
    }
    sided(&mut pieces);
    pieces
}

/// `F Cu` and `Cu F`: replaces the letter of a side next to a layer word by the side's word.
fn sided(pieces: &mut [String]) {
    let is_layer = |piece: Option<&String>| {
        piece
            .and_then(|piece| split(piece))
            .is_some_and(|words| words.iter().any(|means| matches!(means, Means::Role(_))))
    };
    for at in 0..pieces.len() {
        let Some(word) = pieces.get(at).and_then(|piece| LETTERS.iter().find(|(letter, _)| piece == letter))
        else {
            continue;
        };
        let beside = is_layer(pieces.get(at + 1)) || at > 0 && is_layer(pieces.get(at - 1));
        if let Some(piece) = pieces.get_mut(at).filter(|_| beside) {
            word.1.clone_into(piece);
        }
    }
}

/// True if a lower-case word consists only of words for layers and sides.
pub(super) fn is_known(word: &str) -> bool {
    split(word)
        .is_some_and(|words| words.iter().any(|means| matches!(means, Means::Role(_) | Means::Side(_))))
}

/// The known words that `piece` consists of, if it has no other parts.
fn split(piece: &str) -> Option<Vec<Means>> {
    if piece.is_empty() {
        return Some(Vec::new());
    }
    let fits = WORDS.iter().filter_map(|(word, means)| Some((piece.strip_prefix(word)?, word, *means)));
    let mut fits: Vec<_> = fits.collect();
    fits.sort_by_key(|(_, word, _)| std::cmp::Reverse(word.len()));
    fits.into_iter().find_map(|(rest, word, means)| {
        // Two-letter words count only on their own.
        if word.len() < 3 && !rest.is_empty() {
            return None;
        }
        let mut words = vec![means];
        words.extend(split(rest).filter(|_| rest.len() != 1 && rest.len() != 2)?);
        Some(words)
    })
}

/// The longest sequence of known words at the end of `piece`, if the front is long enough to be a word.
fn ending(piece: &str) -> Option<Vec<Means>> {
    let cuts = piece.char_indices().map(|(at, _)| at).filter(|&at| at >= LEAST_FRONT);
    let words = |at: usize| piece.get(at..).and_then(split).filter(|words| !words.is_empty());
    cuts.filter(|&at| piece.len() - at >= 3).find_map(words)
}

#[cfg(test)]
mod tests {
    use super::*;
    use Role::{Copper, Drill, Mask, Other, Outline, Paste, Silk};
    use Side::{Bottom, Inner, Top};

    const NAMES: [(&str, Option<Role>, Option<Side>); 93] = [
        ("kupfer_oben", Some(Copper), Some(Top)),
        ("board-Kupfer_unten", Some(Copper), Some(Bottom)),
        ("Platine Kupferseite", Some(Copper), None),
        ("Cu_F", Some(Copper), Some(Top)),
        ("amp_B_Cu", Some(Copper), Some(Bottom)),
        ("Cu-Back", Some(Copper), Some(Bottom)),
        ("gora", Some(Copper), Some(Top)),
        ("plytka_dol", Some(Copper), Some(Bottom)),
        ("miedź góra", Some(Copper), Some(Top)),
        ("顶层", Some(Copper), Some(Top)),
        ("底层", Some(Copper), Some(Bottom)),
        ("顶层阻焊", Some(Mask), Some(Top)),
        ("底层丝印", Some(Silk), Some(Bottom)),
        ("顶层锡膏", Some(Paste), Some(Top)),
        ("板框", Some(Outline), None),
        ("cuivre_dessous", Some(Copper), Some(Bottom)),
        ("cobre superior", Some(Copper), Some(Top)),
        ("face_composants", Some(Copper), Some(Top)),
        ("face_soudures", Some(Copper), Some(Bottom)),
        ("lato_saldature", Some(Copper), Some(Bottom)),
        ("cara_componentes", Some(Copper), Some(Top)),
        ("amp_BCu", Some(Copper), Some(Bottom)),
        ("pistas_inferior", Some(Copper), Some(Bottom)),
        ("rame_sopra", Some(Copper), Some(Top)),
        ("koper_onder", Some(Copper), Some(Bottom)),
        ("měď horní", Some(Copper), Some(Top)),
        ("медь_низ", Some(Copper), Some(Bottom)),
        ("front", Some(Copper), Some(Top)),
        ("back", Some(Copper), Some(Bottom)),
        ("amp_copperTop", Some(Copper), Some(Top)),
        ("ampcopperbottom", Some(Copper), Some(Bottom)),
        ("COPPER TOP", Some(Copper), Some(Top)),
        ("Bottom Layer", Some(Copper), Some(Bottom)),
        ("TOP SOLDER LAYER", Some(Mask), Some(Top)),
        ("Top Solder", Some(Mask), Some(Top)),
        ("Solder Side", Some(Copper), Some(Bottom)),
        ("Component Side", Some(Copper), Some(Top)),
        ("component side silk", Some(Silk), Some(Top)),
        ("solder side mask", Some(Mask), Some(Bottom)),
        ("Loetseite", Some(Copper), Some(Bottom)),
        ("Bestückungsseite", Some(Copper), Some(Top)),
        ("Lötstopp_oben", Some(Mask), Some(Top)),
        ("Loetstoppmaske unten", Some(Mask), Some(Bottom)),
        ("Bestückungsdruck oben", Some(Silk), Some(Top)),
        ("Lotpaste_oben", Some(Paste), Some(Top)),
        ("Umriss", Some(Outline), None),
        ("Bohrungen", Some(Drill), None),
        ("SM_TOP", Some(Mask), Some(Top)),
        ("PM_BOT", Some(Paste), Some(Bottom)),
        ("SILK_TOP", Some(Silk), Some(Top)),
        ("SST", Some(Silk), Some(Top)),
        ("TOP_DOC_ASSY", Some(Other), Some(Top)),
        ("ADT", None, None),
        ("Assembly Top", Some(Other), Some(Top)),
        ("top_fab", Some(Other), Some(Top)),
        ("Top Solder Paste", Some(Paste), Some(Top)),
        ("topsoldermask", Some(Mask), Some(Top)),
        ("bottompastemask", Some(Paste), Some(Bottom)),
        ("Top Copper (Resist)", Some(Mask), Some(Top)),
        ("tstop", Some(Mask), Some(Top)),
        ("bplace", Some(Silk), Some(Bottom)),
        ("touchscreen", None, None),
        ("gasmask_copper_top", Some(Copper), Some(Top)),
        ("L1", Some(Copper), None),
        ("layer_2", Some(Copper), None),
        ("art002", Some(Copper), None),
        ("inner1", Some(Copper), Some(Inner)),
        ("GND plane", Some(Copper), Some(Inner)),
        ("drill_map", Some(Other), None),
        ("edge", Some(Outline), None),
        ("board outline", Some(Outline), None),
        ("holes", Some(Drill), None),
        ("laptop", Some(Copper), Some(Top)),
        ("robot", None, None),
        ("backlight", None, None),
        ("clock", None, None),
        ("desktop lamp", Some(Copper), Some(Top)),
        ("COPPER1", Some(Copper), None),
        ("Layer_Physical_Order=1", None, None),
        ("Layer_Color=255", None, None),
        ("ground", Some(Copper), Some(Inner)),
        ("serigrafia superior", Some(Silk), Some(Top)),
        ("soldermaske", Some(Mask), None),
        ("vernis dessus", Some(Mask), Some(Top)),
        ("contorno", Some(Outline), None),
        ("obrys", Some(Outline), None),
        ("opis gora", Some(Silk), Some(Top)),
        ("maska_dol", Some(Mask), Some(Bottom)),
        ("pasta_gora", Some(Paste), Some(Top)),
        ("SolderMask_Bot", Some(Mask), Some(Bottom)),
        ("board-Component", Some(Copper), Some(Top)),
        ("primary_side", Some(Copper), Some(Top)),
        ("f.mask", Some(Mask), Some(Top)),
    ];

    #[test]
    fn layer_names_of_many_languages_give_role_and_side() {
        for (text, role, side) in NAMES {
            let found = said(text);
            assert_eq!((found.role, found.side), (role, side), "{text}: {found:?}");
        }
    }

    #[test]
    fn side_at_the_end_of_a_longer_word_is_unsure() {
        for (text, unsure) in [("laptop", true), ("myboardtop", true), ("my_top", false), ("toplayer", false)]
        {
            assert_eq!(said(text).unsure, unsure, "{text}");
        }
    }

    #[test]
    fn numbers_count_only_next_to_a_layer_word() {
        for (text, number) in [
            ("L1", Some(1)),
            ("board_L02", Some(2)),
            ("art001", Some(1)),
            ("layer 4", Some(4)),
            ("第2层", None),
            ("v2", None),
            ("board2", None),
            ("COPPER0", Some(0)),
        ] {
            assert_eq!(said(text).number, number, "{text}");
        }
    }
}
