//! Parses comments and setup statements of a drill program for number format, tools and plating.

use crate::artwork::number::decimal;
use crate::artwork::text::{holds, starts};
use crate::artwork::{Digits, Units, Zeros};
use crate::units::Length;

#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::artwork) enum Hint {
    Units(Units),
    Digits(Digits),
    /// Omitted zeros, or decimal points.
    Zeros(Zeros),
    /// Size and plating of a tool: `T01 Holesize 1. = 8.0 … PLATED MILS`.
    Tool {
        code: u32,
        diameter: Option<Length>,
        plated: Option<bool>,
        units: Units,
    },
    /// Plating of the tools defined from here on.
    SectionPlated(bool),
    /// Plating of the next defined tool.
    NextPlated(bool),
    /// Plating of tools from this number on.
    PlatedFrom(u32, bool),
    /// Plating of all holes in the file.
    FilePlated(bool),
    Generator(String),
}

/// The text before the number of the first tool with a plating.
const WORD_START: &[u8] = b"START AT T";

/// The hints of a comment, without its `;`.
pub(in crate::artwork) fn comment(text: &[u8]) -> Vec<Hint> {
    let text = text.trim_ascii();
    if let Some(rest) = after(text, "TYPE=") {
        return plating(rest).map(Hint::SectionPlated).into_iter().collect();
    }
    if let Some(rest) = after(text, "#@!") {
        return attribute(rest.trim_ascii());
    }
    if let Some(tool) = tool_size(text) {
        return vec![tool];
    }
    if let Some(from) = plated_from(text) {
        return vec![from];
    }
    if let Some(rest) = after(text, "Contents") {
        return plating(rest).map(Hint::FilePlated).into_iter().collect();
    }
    let mut hints = generator(text);
    if holds(text, "format") || starts(text, "units") {
        hints.extend(format_words(text));
    }
    hints
}

/// Units, digits and zeros from free text, such as `{2:4/ absolute / inch / keep zeros}` or `units: INCH
/// format: 2.4`.
pub(in crate::artwork) fn format_words(text: &[u8]) -> Vec<Hint> {
    let mut hints = Vec::new();
    if holds(text, "inch") || holds(text, "english") {
        hints.push(Hint::Units(Units::Inch));
    } else if holds(text, "metric") || holds(text, "millimet") || word(text, "mm") {
        hints.push(Hint::Units(Units::Mm));
    }
    hints.extend(digits_in(text).map(Hint::Digits));
    let says = |words: [&str; 2]| words.iter().any(|words| holds(text, words));
    if says(["keep zeros", "no zero suppression"]) {
        hints.push(Hint::Zeros(Zeros::None));
    } else if holds(text, "decimal}") || holds(text, "/ decimal") {
        hints.push(Hint::Zeros(Zeros::Decimal));
    } else if says(["suppress leading", "/ Leading"]) || holds(text, "leading zero suppression") {
        hints.push(Hint::Zeros(Zeros::Leading));
    } else if says(["suppress trailing", "/ Trailing"]) || holds(text, "trailing zero suppression") {
        hints.push(Hint::Zeros(Zeros::Trailing));
    }
    hints
}

/// The arguments of `METRIC`, `INCH`, `M71` and `M72`: `LZ`, `TZ`, a digit template such as `000.000`.
pub(super) fn arguments(args: &[u8]) -> Vec<Hint> {
    let mut hints = Vec::new();
    for arg in args.split(|&byte| byte == b',') {
        let arg = arg.trim_ascii();
        if arg.eq_ignore_ascii_case(b"LZ") {
            hints.push(Hint::Zeros(Zeros::Trailing));
        } else if arg.eq_ignore_ascii_case(b"TZ") {
            hints.push(Hint::Zeros(Zeros::Leading));
        } else if let Some(digits) = template(arg, b'0') {
            hints.push(Hint::Digits(digits));
        }
    }
    hints
}

/// `000.000`, or with other letters `NN.DDDDD`.
fn template(text: &[u8], digit: u8) -> Option<Digits> {
    let point = text.iter().position(|&byte| byte == b'.')?;
    let (before, behind) = (text.get(..point)?, text.get(point + 1..)?);
    let same = |part: &[u8], with: u8| (1..=9).contains(&part.len()) && part.iter().all(|&byte| byte == with);
    let behind_digit = if digit == b'N' { b'D' } else { digit };
    (same(before, digit) && same(behind, behind_digit))
        .then_some(Digits { integer: before.len() as u8, decimal: behind.len() as u8 })
}

/// `2:4`, `3.3` or `NN.DDDDD` as a separate word of a text.
pub(in crate::artwork) fn digits_in(text: &[u8]) -> Option<Digits> {
    text.split(|&byte| b" \t,={}/()".contains(&byte)).find_map(|part| match *part {
        [before @ b'0'..=b'9', b':' | b'.', behind @ b'0'..=b'9'] => {
            Some(Digits { integer: before - b'0', decimal: behind - b'0' })
        }
        _ => template(part, b'N'),
    })
}

fn after<'a>(text: &'a [u8], word: &str) -> Option<&'a [u8]> {
    starts(text, word).then(|| text.get(word.len()..)).flatten()
}

fn word(text: &[u8], word: &str) -> bool {
    text.split(|byte| !byte.is_ascii_alphabetic()).any(|part| part.eq_ignore_ascii_case(word.as_bytes()))
}

/// Plating in a text. Tests `NON_PLATED` first, because it contains `PLATED`.
pub(in crate::artwork) fn plating(text: &[u8]) -> Option<bool> {
    let not = ["non_plated", "nonplated", "non-plated", "unplated", "npth"];
    if not.iter().any(|word| holds(text, word)) {
        Some(false)
    } else {
        (holds(text, "plated") || holds(text, "pth")).then_some(true)
    }
}

/// `NON-PLATED HOLES START AT T1`, `THROUGH (PLATED) HOLES START AT T100`.
fn plated_from(text: &[u8]) -> Option<Hint> {
    let at = text.windows(WORD_START.len()).position(|part| part.eq_ignore_ascii_case(WORD_START))?;
    let (code, _) = decimal(text.get(at + WORD_START.len()..)?)?;
    let code = u32::try_from(code.mantissa).ok().filter(|_| !code.point)?;
    Some(Hint::PlatedFrom(code, plating(text)?))
}

/// X2 attributes in comments: `TA.AperFunction,NonPlated,NPTH,ComponentDrill`.
fn attribute(text: &[u8]) -> Vec<Hint> {
    if let Some(rest) = after(text, "TA.AperFunction,") {
        plating(rest).map(Hint::NextPlated).into_iter().collect()
    } else if let Some(rest) = after(text, "TF.FileFunction,") {
        if starts(rest, "Mixed") { None } else { plating(rest) }.map(Hint::FilePlated).into_iter().collect()
    } else if let Some(rest) = after(text, "TF.GenerationSoftware,") {
        vec![Hint::Generator(visible(rest))]
    } else {
        Vec::new()
    }
}

/// `T01 Holesize 1. = 8.000000 Tolerance = … PLATED MILS Quantity = 1873`. Without `T01`, the number after
/// `Holesize` is the tool number.
fn tool_size(text: &[u8]) -> Option<Hint> {
    let (code, rest) = match text {
        [b'T' | b't', rest @ ..] => {
            let (code, used) = decimal(rest)?;
            let rest = rest.get(used..).filter(|rest| !code.point && holds(rest, "holesize"))?;
            (code, rest)
        }
        _ if starts(text, "holesize") => {
            let rest = text.get("holesize".len()..)?.trim_ascii_start();
            (decimal(rest)?.0, rest)
        }
        _ => return None,
    };
    let equals = rest.iter().position(|&byte| byte == b'=')?;
    let (size, _) = decimal(rest.get(equals + 1..)?.trim_ascii_start())?;
    let (units, size) = if word(rest, "mils") || word(rest, "mil") {
        (Units::Inch, crate::artwork::number::Decimal { decimals: size.decimals + 3, ..size })
    } else if holds(rest, "inch") {
        (Units::Inch, size)
    } else {
        (Units::Mm, size)
    };
    let code = u32::try_from(code.mantissa).ok()?;
    let diameter = size.length(units).filter(|&length| length > Length::ZERO);
    Some(Hint::Tool { code, diameter, plated: plating(rest), units })
}

fn generator(text: &[u8]) -> Vec<Hint> {
    const NAMES: [(&str, &str); 12] = [
        ("DRILL file {KiCad", "KiCad"),
        ("DRILL file {Pcbnew", "KiCad"),
        ("Generated by LibrePCB", "LibrePCB"),
        ("GenerationSoftware,", ""),
        ("EasyEDA", "EasyEDA"),
        ("Layer_Color=", "Altium"),
        ("Job     :", "Mentor"),
        ("PARTNO ", "Mentor VeriBest"),
        ("CODE  : ASCII", "Allegro"),
        ("Fritzing", "Fritzing"),
        ("Horizon", "Horizon"),
        ("DipTrace", "DipTrace"),
    ];
    let found = NAMES.iter().find(|(words, _)| holds(text, words));
    found
        .map(|&(words, name)| {
            let detail = after(text, words).filter(|_| name.is_empty()).map(visible);
            let braces = text.split(|&byte| byte == b'{' || byte == b'}').nth(1).filter(|_| name == "KiCad");
            Hint::Generator(detail.or(braces.map(visible)).unwrap_or_else(|| name.to_owned()))
        })
        .into_iter()
        .collect()
}

fn visible(text: &[u8]) -> String {
    let kept = text.iter().take(60).filter(|byte| (b' '..=b'~').contains(byte) && !b"*%{}".contains(byte));
    kept.map(|&byte| if byte == b',' { ' ' } else { char::from(byte) }).collect::<String>().trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_give_format_and_tool_hints() {
        let digits = |integer, decimal| Hint::Digits(Digits { integer, decimal });
        let tool = |nm, plated| Hint::Tool {
            code: 1,
            diameter: Some(Length::from_nm(nm)),
            plated: Some(plated),
            units: Units::Inch,
        };
        for (text, want) in [
            ("FILE_FORMAT=2:4", vec![digits(2, 4)]),
            (
                "FORMAT={2:4/ absolute / inch / keep zeros}",
                vec![Hint::Units(Units::Inch), digits(2, 4), Hint::Zeros(Zeros::None)],
            ),
            (
                "FORMAT={-:-/ absolute / metric / decimal}",
                vec![Hint::Units(Units::Mm), Hint::Zeros(Zeros::Decimal)],
            ),
            (
                " Format  : 3.3 / Absolute / MM / Leading",
                vec![Hint::Units(Units::Mm), digits(3, 3), Hint::Zeros(Zeros::Leading)],
            ),
            (" units: INCH  format: 2.4", vec![Hint::Units(Units::Inch), digits(2, 4)]),
            ("T01 Holesize 1. = 8.000000 Tolerance = +3.0/-3.0 NON_PLATED MILS", vec![tool(203_200, false)]),
            ("Holesize 1. = 3.175 Tolerance = +0.0/-0.0 PLATED MILS Quantity = 12", vec![tool(80_645, true)]),
            ("T01 Holesize 1. = 0.125 PLATED INCHES", vec![tool(3_175_000, true)]),
            (" NON-PLATED HOLES START AT T1", vec![Hint::PlatedFrom(1, false)]),
            (" THROUGH (PLATED) HOLES START AT T100", vec![Hint::PlatedFrom(100, true)]),
            ("TYPE=NON_PLATED", vec![Hint::SectionPlated(false)]),
            (" #@! TA.AperFunction,NonPlated,NPTH,ComponentDrill", vec![Hint::NextPlated(false)]),
            (" #@! TF.FileFunction,MixedPlating,1,2", vec![]),
            (" Contents: Thru / Drill / Non-Plated", vec![Hint::FilePlated(false)]),
            ("Layer_Color=9474304", vec![Hint::Generator("Altium".into())]),
            ("board ) M3 S99999 (", vec![]),
        ] {
            assert_eq!(comment(text.as_bytes()), want, "{text}");
        }
    }

    #[test]
    fn templates_give_the_digits() {
        assert_eq!(
            arguments(b"LZ,0000.00"),
            [Hint::Zeros(Zeros::Trailing), Hint::Digits(Digits { integer: 4, decimal: 2 })]
        );
        assert_eq!(digits_in(b"Coord format   : NN.DDDDD"), Some(Digits { integer: 2, decimal: 5 }));
    }
}
