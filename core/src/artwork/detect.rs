//! What a file is, from its content; its name is the last resort.
//!
//! Comes in: bytes. Goes out: a [`What`]. Does not read the content through.

use super::companion;
use super::drill_list;
use super::text::{front, holds, lines, starts};

/// Bytes looked at.
const LOOKED_AT: usize = 64 * 1024;
/// Lines looked at.
const LINES_LOOKED_AT: usize = 400;

/// What the bytes of a file are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum What {
    Drill,
    List,
    Gerber,
    Report,
    Archive,
    /// Another archive, by the name of its format: it is not opened.
    Packed(&'static str),
    /// Where components are placed.
    Placement,
    /// Recognised as unreadable; the code of the diagnostic that says why.
    Refused(&'static str),
    Unknown,
}

/// Looks at the raw bytes, then at the text they decode to.
pub(super) fn detect(bytes: &[u8], text: &[u8]) -> What {
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return What::Refused("refused.empty");
    }
    if bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06") {
        return What::Archive;
    }
    if let Some(format) = packed(bytes) {
        return What::Packed(format);
    }
    let head = front(text, LOOKED_AT);
    if is_eia_tape(head) {
        return What::Refused("refused.eia_tape");
    }
    if is_binary(head) {
        return What::Refused("refused.binary");
    }
    if head.trim_ascii_start().starts_with(b"<") {
        return What::Refused("refused.web_page");
    }
    let count = Counts::of(head);
    if let Some(gerber) = gerber(head, &count) {
        gerber
    } else if drill_list::is_placement(head) {
        What::Placement
    } else if count.hits == 0 && companion::is_report(head) {
        What::Report
    } else if count.drill > 0 && count.drill * 2 >= count.all {
        What::Drill
    } else if drill_list::is_list(head) {
        What::List
    } else if companion::is_report(head) {
        What::Report
    } else {
        What::Unknown
    }
}

/// The format of an archive that is no zip, by its first bytes.
fn packed(bytes: &[u8]) -> Option<&'static str> {
    const MARKS: [(&[u8], &str); 5] = [
        (b"\x1F\x8B\x08", "gzip (.gz, .tgz, .tar.gz)"),
        (b"7z\xBC\xAF\x27\x1C", "7-Zip (.7z)"),
        (b"Rar!\x1A\x07", "RAR (.rar)"),
        (b"BZh", "bzip2 (.bz2)"),
        (b"\xFD7zXZ\x00", "xz (.xz)"),
    ];
    let mark = MARKS.iter().find(|(mark, _)| bytes.starts_with(mark)).map(|(_, format)| *format);
    mark.or_else(|| (bytes.get(257..262) == Some(b"ustar")).then_some("tar (.tar)"))
}

/// How many lines of a text that is not read as holes look like coordinates, and the first of them.
pub(super) fn coordinates(text: &[u8]) -> Option<(usize, u32)> {
    let found = lines(front(text, LOOKED_AT)).filter(|line| is_hit(line.text.trim_ascii()));
    let mut first = 0;
    let count = found.inspect(|line| first = if first == 0 { line.number } else { first }).count();
    (count > 0).then_some((count, first))
}

/// Whether a line is a place and nothing else: `X012700Y-8890`, `X 1.0 Y 2.0`.
fn is_hit(text: &[u8]) -> bool {
    let first = text.first().is_some_and(|letter| b"XYxy".contains(letter));
    let rest = text.get(1..).unwrap_or_default().trim_ascii_start();
    let number = rest.first().is_some_and(|byte| byte.is_ascii_digit() || b"+-.".contains(byte));
    let allowed = |byte: &u8| byte.is_ascii_digit() || b"XYxy+-. \t".contains(byte);
    first && number && text.iter().all(allowed) && text.iter().any(u8::is_ascii_digit)
}

/// EIA tape code punches an odd number of holes in every row and ends its blocks with 0x80.
fn is_eia_tape(head: &[u8]) -> bool {
    let odd = head.iter().filter(|byte| byte.count_ones() % 2 == 1).count();
    head.len() >= 16 && odd * 100 >= head.len() * 95 && head.contains(&0x80)
}

fn is_binary(head: &[u8]) -> bool {
    let odd = |&&byte: &&u8| byte < 9 || (14..26).contains(&byte) || (28..32).contains(&byte) || byte >= 127;
    head.iter().filter(odd).count() * 5 > head.len()
}

/// Lines by what they look like.
#[derive(Default)]
struct Counts {
    all: usize,
    drill: usize,
    starred: usize,
    /// Those that are places and nothing else.
    hits: usize,
}

impl Counts {
    fn of(head: &[u8]) -> Self {
        let mut counts = Self::default();
        for line in lines(head) {
            if counts.all >= LINES_LOOKED_AT {
                break;
            }
            let text = line.text.trim_ascii();
            let text = block_number(text);
            if text.is_empty() || text.starts_with(b";") {
                continue;
            }
            counts.all += 1;
            counts.starred += usize::from(text.ends_with(b"*") || text.ends_with(b"*%"));
            let hit = is_hit(text);
            counts.hits += usize::from(hit);
            counts.drill += usize::from(hit || looks_like_drill(text));
        }
        counts
    }
}

fn block_number(text: &[u8]) -> &[u8] {
    match text {
        [b'N' | b'n', b'0'..=b'9', ..] => {
            let end = text.iter().position(|&byte| byte == b' ').unwrap_or(text.len());
            text.get(end..).unwrap_or_default().trim_ascii_start()
        }
        _ => text,
    }
}

fn looks_like_drill(text: &[u8]) -> bool {
    let keyword = ["METRIC", "INCH", "FMAT", "ICI", "VER,", "DETECT", "ATC,", "R,H"];
    match text {
        [b'%'] => true,
        [letter, next, ..] if b"XYxyTtGgMmRr".contains(letter) => {
            let number = next.is_ascii_digit() || b"+-.".contains(next);
            (number && !text.contains(&b' ') && !text.contains(&b'*') || text.contains(&b'('))
                || keyword.iter().any(|word| starts(text, word))
                || number && text.contains(&b';')
                || number && starts(text, "M")
        }
        _ => keyword.iter().any(|word| starts(text, word)),
    }
}

/// Gerber has its own marks. Starred lines without them are RS-274-D: apertures and format live elsewhere.
fn gerber(head: &[u8], count: &Counts) -> Option<What> {
    let marks = ["%FS", "%MO", "%ADD", "%AM", "%LP", "%TF."];
    if marks.iter().any(|mark| holds(head, mark)) && head.contains(&b'*') {
        return Some(
            if holds(head, "%FS") || holds(head, "*FS") || holds(head, "FSLA") || holds(head, "FSTA") {
                What::Gerber
            } else {
                What::Refused("refused.gerber_without_format")
            },
        );
    }
    if count.starred * 2 >= count.all.max(1) {
        return Some(What::Refused("refused.gerber_without_format"));
    }
    None
}
