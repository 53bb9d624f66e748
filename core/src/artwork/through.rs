//! Drill files with blind and buried vias. Reports an error that the user must accept, because Annulus drills
//! through the whole board.

use super::companion::{base, folder};
use super::findings::excerpt;
use super::text::{front, holds, lines, starts};
use super::{FileRead, Role, Side};
use crate::code;
use crate::diagnostic::Diagnostic;
use std::collections::BTreeSet;

/// A file must declare its holes within the first bytes.
const LOOKED_AT: usize = 16 * 1024;
/// Most files of a report that are looked at.
const MOST_PAIRS: usize = 100;
const CODE: &str = code!("drill.holes_not_through");

/// The error for a drill file whose holes end inside the board; none if nothing indicates that.
pub(super) fn blind(name: &str, text: &[u8]) -> Option<Diagnostic> {
    let found = by_comment(text).or_else(|| by_name(base(name)).then(|| (base(name).to_owned(), 0)))?;
    let error = Diagnostic::error(CODE).at(name, found.1, u32::from(found.1 > 0));
    Some(error.with("found", found.0))
}

/// The layer range of a drill file's holes, and the line that declares it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Span {
    from: u32,
    to: u32,
    found: String,
    line: u32,
}

pub(super) fn span(text: &[u8]) -> Option<Span> {
    lines(front(text, LOOKED_AT)).find_map(|line| {
        let at = line.text.windows(12).position(|part| part == b"FileFunction")?;
        let function = std::str::from_utf8(line.text.get(at + 13..)?.trim_ascii()).ok()?;
        span_of(function, line.number)
    })
}

/// The range in a file function: `Plated,1,2,PTH`.
fn span_of(function: &str, line: u32) -> Option<Span> {
    let mut parts = function.split(',').map(str::trim);
    let is_drill = ["Plated", "NonPlated", "MixedPlating"].contains(&parts.next()?);
    let (one, two): (u32, u32) = (parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
    let found = excerpt(function.as_bytes());
    is_drill.then(|| Span { from: one.min(two), to: one.max(two), found, line })
}

/// A layer pair that is not that of the outer layers, with the drill file for which a report states it.
pub(super) struct Pair {
    folder: String,
    file: String,
    layers: String,
}

/// The layer pairs of a report (`.DRR`) that do not go through the board.
pub(super) fn pairs(name: &str, report: &[u8]) -> Vec<Pair> {
    let mut pair = None;
    let mut found = Vec::new();
    for line in lines(report) {
        let text = String::from_utf8_lossy(line.text.trim_ascii()).into_owned();
        let Some((key, value)) = text.split_once(':').map(|(key, value)| (key.trim(), value.trim())) else {
            continue;
        };
        if key.eq_ignore_ascii_case("layer pair") {
            pair = Some(value.to_owned()).filter(|_| names_inner_layer(value));
        } else if key.to_ascii_lowercase().ends_with(" file") && found.len() < MOST_PAIRS {
            let of = |layers| Pair { folder: folder(name).to_owned(), file: value.to_owned(), layers };
            found.extend(pair.clone().map(of));
        }
    }
    found
}

/// True for a pair with a clearly inner layer: `Top Layer to Mid-Layer 1`, `Top to Internal Plane 2`.
fn names_inner_layer(pair: &str) -> bool {
    let is_inner = |word: &str| {
        let numbered = |front: &str| {
            let rest = word.strip_prefix(front);
            rest.is_some_and(|rest| !rest.is_empty() && rest.bytes().all(|byte| byte.is_ascii_digit()))
        };
        let named = ["mid", "inner", "internal"].iter().any(|front| word.starts_with(front));
        named || numbered("in") || numbered("int")
    };
    pair.to_ascii_lowercase().split(|letter: char| !letter.is_ascii_alphanumeric()).any(is_inner)
}

/// Reports drill files whose holes connect fewer layers than their board has, unless already reported.
/// `spans` are those of the drill programs among `files`; a Gerber drill layer has its own. `pairs` are those
/// of the reports.
pub(super) fn settle(files: &mut [FileRead], spans: &[Option<Span>], pairs: &[Pair]) {
    let own = |file: &FileRead| span_of(file.gerber.as_ref()?.file_function.as_deref()?, 0);
    let deepest = |board: &str| {
        let spans = files.iter().zip(spans).filter(|(file, _)| file.board == board);
        spans.filter_map(|(_, span)| span.as_ref()).map(|span| span.to).max().unwrap_or(0)
    };
    let short = |(at, file): (usize, &FileRead)| {
        file.drill.as_ref().filter(|_| file.role == Role::Drill)?;
        if file.diagnostics.iter().any(|said| said.code == CODE) {
            return None;
        }
        let (of, name) = (folder(&file.name), base(&file.name));
        let pair = pairs.iter().find(|pair| pair.folder == of && pair.file.eq_ignore_ascii_case(name));
        if let Some(pair) = pair {
            return Some((at, Span { from: 0, to: 0, found: excerpt(pair.layers.as_bytes()), line: 0 }));
        }
        let span = spans.get(at).cloned().flatten().or_else(|| own(file))?;
        // Without inner layers in the set, the deepest drill file tells how many the board has.
        let is_short = span.from > 1 || span.to < last_layer(files, &file.board).max(deepest(&file.board));
        is_short.then_some((at, span))
    };
    let short: Vec<(usize, Span)> = files.iter().enumerate().filter_map(short).collect();
    for (at, span) in short {
        let Some(file) = files.get_mut(at) else { continue };
        let error = Diagnostic::error(CODE).at(&file.name, span.line, u32::from(span.line > 0));
        file.diagnostics.push(error.with("found", span.found));
    }
}

/// The number of a board's last copper layer: the highest in the X2 functions, else the number of copper
/// layers.
fn last_layer(files: &[FileRead], board: &str) -> u32 {
    let copper = || files.iter().filter(|file| file.role == Role::Copper && file.board == board);
    let number = |file: &FileRead| {
        let function = file.gerber.as_ref()?.file_function.as_deref()?;
        function.strip_prefix("Copper,L")?.split(',').next()?.parse().ok()
    };
    let outer = |side: Side| u32::from(copper().any(|file| file.side == Some(side)));
    // By content: a layer that is in the set twice counts once.
    let inner: BTreeSet<u64> =
        copper().filter(|file| file.side == Some(Side::Inner)).map(|file| file.fingerprint).collect();
    let count = outer(Side::Top) + outer(Side::Bottom) + u32::try_from(inner.len()).unwrap_or(0);
    copper().filter_map(number).max().unwrap_or(count)
}

/// `TF.FileFunction,Plated,1,2,Blind`, or a comment that mentions blind or buried holes.
fn by_comment(text: &[u8]) -> Option<(String, u32)> {
    let comments =
        lines(front(text, LOOKED_AT)).filter(|line| line.text.trim_ascii_start().starts_with(b";"));
    let is_blind = |line: &[u8]| word(line, "blind") || word(line, "buried");
    let mut found = comments.filter(|line| is_blind(line.text));
    found.find_map(|line| {
        let attribute = line.text.windows(12).position(|part| part == b"FileFunction");
        let shown = attribute.and_then(|at| line.text.get(at + 13..)).unwrap_or(line.text);
        // A legend of all kinds of holes isn't about this file's holes.
        let is_legend = attribute.is_none() && holds(line.text, "through");
        (!is_legend).then(|| (excerpt(shown), line.number))
    })
}

fn word(line: &[u8], word: &str) -> bool {
    line.split(|byte| !byte.is_ascii_alphabetic()).any(|part| part.eq_ignore_ascii_case(word.as_bytes()))
}

/// `amp-front-in1.drl`, `amp-in1-in2.drl`, `amp-blind.drl`.
fn by_name(base: &str) -> bool {
    let lower = base.to_ascii_lowercase();
    let words: Vec<&[u8]> = lower.as_bytes().split(|byte| !byte.is_ascii_alphanumeric()).collect();
    let inner =
        |word: &[u8]| starts(word, "in") && word.len() > 2 && word.iter().skip(2).all(u8::is_ascii_digit);
    let outer = |word: &[u8]| [&b"front"[..], b"back", b"top", b"bottom", b"f", b"b"].contains(&word);
    let spans = words
        .array_windows::<2>()
        .any(|[from, to]| inner(from) && (inner(to) || outer(to)) || outer(from) && inner(to));
    let is_kind = |word: &[u8]| {
        ["blind", "buried"].iter().any(|kind| {
            word.strip_prefix(kind.as_bytes()).is_some_and(|rest| rest.is_empty() || starts(rest, "via"))
        })
    };
    spans || words.iter().any(|word| is_kind(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blind_and_buried_holes_are_an_error() {
        for (name, text, want) in [
            ("amp.drl", "M48\n; #@! TF.FileFunction,Plated,1,2,Blind\nMETRIC\n", Some("Plated,1,2,Blind")),
            ("amp.drl", "M48\n; #@! TF.FileFunction,Plated,2,3,Buried\n", Some("Plated,2,3,Buried")),
            ("amp.drl", ";Layer: Blind_Via_1_2\nM48\n", Some(";Layer: Blind_Via_1_2")),
            ("amp.drl", "M48\n; #@! TF.FileFunction,Plated,1,4,PTH\n", None),
            ("amp-front-in1.drl", "M48\n", Some("amp-front-in1.drl")),
            ("amp-in1-in2.drl", "M48\n", Some("amp-in1-in2.drl")),
            ("amp-in1-back.drl", "M48\n", Some("amp-in1-back.drl")),
            ("b-BlindVias L1-L2.TXT", "M48\n", Some("b-BlindVias L1-L2.TXT")),
            ("blinds_motor.drl", "M48\n", None),
            ("made-in-2024.drl", "M48\n", None),
        ] {
            let found = blind(name, text.as_bytes());
            let found = found.map(|error| error.argument(&["found"]).unwrap().to_owned());
            assert_eq!(found.as_deref(), want, "{name} {text}");
        }
    }

    #[test]
    fn only_inner_layer_names_make_a_pair_blind() {
        for (pair, want) in [
            ("Top Layer to Bottom Layer", false),
            ("L1_TOP to L2_BOT", false),
            ("Component Side to Solder Side", false),
            ("Top Point to Print Bottom", false),
            ("Top Layer to Mid-Layer 1", true),
            ("Top to Mid_Bottom", true),
            ("Internal Plane 1 to Bottom Layer", true),
            ("F.Cu to In1.Cu", true),
        ] {
            assert_eq!(names_inner_layer(pair), want, "{pair}");
        }
    }
}
