//! Detects the kind of a file by its content, and only as a last resort by its name.

use super::companion;
use super::drill_list;
use super::machine_program;
use super::number::decimal;
use super::text::{front, holds, lines, starts};
use crate::code;

const LOOKED_AT: usize = 64 * 1024;
const LINES_LOOKED_AT: usize = 400;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum What {
    Drill,
    List,
    Gerber,
    Report,
    Archive,
    /// An archive other than zip, with the name of its format. Not opened.
    Packed(&'static str),
    Placement,
    /// A machine program, such as G-code.
    Machine,
    /// Not readable; contains the code of the reason.
    Refused(&'static str),
    Unknown,
}

/// Looks at the raw bytes, then at the decoded text.
pub(super) fn detect(bytes: &[u8], text: &[u8]) -> What {
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return What::Refused(code!("refused.empty"));
    }
    // An empty zip starts with its end record.
    if bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06") {
        return What::Archive;
    }
    if let Some(format) = packed(bytes) {
        return What::Packed(format);
    }
    let head = front(text, LOOKED_AT);
    if is_eia_tape(head) {
        return What::Refused(code!("refused.eia_tape"));
    }
    if is_binary(head) {
        return What::Refused(code!("refused.binary"));
    }
    // A failed download often leaves a web page in place of the file.
    if head.trim_ascii_start().starts_with(b"<") {
        return What::Refused(code!("refused.web_page"));
    }
    if machine_program::is_one(head) {
        return What::Machine;
    }
    let count = Counts::of(head);
    if let Some(gerber) = gerber(head, &count) {
        gerber
    } else if drill_list::is_placement(head) {
        What::Placement
    } else if !count.program && companion::is_report(head) {
        What::Report
    } else if count.drill > 0 && (count.drill * 2 >= count.all || companion::is_report(head)) {
        What::Drill
    } else if drill_list::is_list(head) {
        What::List
    } else if companion::is_report(head) {
        What::Report
    } else {
        What::Unknown
    }
}

/// The format of an archive other than zip, by its first bytes.
fn packed(bytes: &[u8]) -> Option<&'static str> {
    const MARKS: [(&[u8], &str); 6] = [
        (b"\x28\xB5\x2F\xFD", "Zstandard (.zst)"),
        (b"\x1F\x8B\x08", "gzip (.gz, .tgz, .tar.gz)"),
        (b"7z\xBC\xAF\x27\x1C", "7-Zip (.7z)"),
        (b"Rar!\x1A\x07", "RAR (.rar)"),
        (b"BZh", "bzip2 (.bz2)"),
        (b"\xFD7zXZ\x00", "xz (.xz)"),
    ];
    let mark = MARKS.iter().find(|(mark, _)| bytes.starts_with(mark)).map(|(_, format)| *format);
    // LHA has its mark behind the length and the checksum of the header.
    let lzh = bytes.get(2..5) == Some(b"-lh") && bytes.get(6) == Some(&b'-');
    let mark = mark.or_else(|| lzh.then_some("LHA (.lzh)"));
    // A tar file starts with the name of its first member; the mark comes at byte 257.
    mark.or_else(|| (bytes.get(257..262) == Some(b"ustar")).then_some("tar (.tar)"))
}

/// Counts the lines that look like positions, in a text that isn't read as holes; also returns the first one.
/// Rows of bare numbers count only if `rows`, because reports have them too.
pub(super) fn coordinates(text: &[u8], rows: bool) -> Option<(usize, u32)> {
    let found = lines(text).filter(|line| {
        let text = block_number(line.text.trim_ascii());
        goes(text) || rows && is_row(text)
    });
    let mut first = None;
    let count = found.inspect(|line| first = first.or(Some(*line))).count();
    // A single row of numbers can be a date.
    let first = first.filter(|line| count > 1 || goes(line.text.trim_ascii()))?;
    Some((count, first.number))
}

/// True if a line has only words of a letter and a number, one of them a coordinate: `X012700Y-8890`, `T01X
/// 1.0 Y 2.0`, `G81X1.0F100 ; hole`.
fn goes(text: &[u8]) -> bool {
    let end = text.iter().position(|byte| b";(".contains(byte)).unwrap_or(text.len());
    let mut rest = text.get(..end).unwrap_or_default().trim_ascii();
    let mut places = false;
    while let Some((letter, behind)) = rest.split_first() {
        let word = b"XYZGMTRIJAFSNHxyzgmtrijafsnh".contains(letter);
        let Some((_, used)) = decimal(behind.trim_ascii_start()).filter(|_| word) else { return false };
        places |= b"XYxy".contains(letter);
        rest = behind.trim_ascii_start().get(used..).unwrap_or_default().trim_ascii_start();
    }
    places
}

/// True if a line has at least two numbers and nothing else: `1.0 2.0`, `-5,08;0,00;3,2`, `5.08mm,0mm`,
/// `1.5e1 0`.
fn is_row(text: &[u8]) -> bool {
    let number = |cell: &[u8]| {
        let end = cell.iter().rposition(|byte| byte.is_ascii_digit() || *byte == b'.').map_or(0, |at| at + 1);
        let (digits, unit) = cell.split_at(end);
        let numeral = |byte: &u8| byte.is_ascii_digit() || b"+-.eE".contains(byte);
        let unit = ["", "mm", "in", "inch", "mil", "mils"]
            .iter()
            .any(|name| unit.eq_ignore_ascii_case(name.as_bytes()));
        unit && digits.iter().all(numeral) && digits.iter().any(u8::is_ascii_digit)
    };
    let cells = || text.split(|byte| b" \t;,\"".contains(byte)).filter(|cell| !cell.is_empty());
    cells().count() >= 2 && cells().all(number)
}

/// EIA tape code has an odd number of holes in every row, and 0x80 ends a block.
fn is_eia_tape(head: &[u8]) -> bool {
    // EIA characters have odd parity; a few read errors are allowed. 0x80 ends a block.
    let odd = head.iter().filter(|byte| byte.count_ones() % 2 == 1).count();
    head.len() >= 16 && odd * 100 >= head.len() * 95 && head.contains(&0x80)
}

fn is_binary(head: &[u8]) -> bool {
    let odd = |&&byte: &&u8| byte < 9 || (14..26).contains(&byte) || (28..32).contains(&byte) || byte >= 127;
    head.iter().filter(odd).count() * 5 > head.len()
}

#[derive(Default)]
struct Counts {
    all: usize,
    drill: usize,
    starred: usize,
    /// At least one line starts a program or moves to a position.
    program: bool,
}

impl Counts {
    fn of(head: &[u8]) -> Self {
        let mut counts = Self::default();
        for line in lines(head) {
            let text = line.text.trim_ascii();
            let text = block_number(text);
            if text.is_empty() || text.starts_with(b";") {
                continue;
            }
            counts.program |= goes(text) || text.eq_ignore_ascii_case(b"M48");
            if counts.all < LINES_LOOKED_AT {
                counts.all += 1;
                counts.starred += usize::from(text.ends_with(b"*") || text.ends_with(b"*%"));
                counts.drill += usize::from(goes(text) || looks_like_drill(text));
            }
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

/// Gerber by its marks. Lines ending in `*` without these marks are RS-274-D, without apertures and number
/// format.
fn gerber(head: &[u8], count: &Counts) -> Option<What> {
    let marks = ["%FS", "%MO", "%ADD", "%AM", "%LP", "%TF."];
    let is_marked = marks.iter().any(|mark| holds(head, mark)) && head.contains(&b'*');
    if is_marked && ["%FS", "*FS", "FSLA", "FSTA"].iter().any(|format| holds(head, format)) {
        return Some(What::Gerber);
    }
    // Aperture lists and job files have stars too, but draw nothing.
    if !draws(head) {
        return (is_marked || count.starred * 2 >= count.all.max(1)).then_some(What::Unknown);
    }
    if is_marked || count.starred * 2 >= count.all.max(1) {
        return Some(What::Refused(code!("refused.gerber_without_format")));
    }
    None
}

/// True if blocks ending in `*` move to a position, `X100Y200D03*`, or draw, `D02*`.
fn draws(head: &[u8]) -> bool {
    head.split(|byte| b"*\r\n%".contains(byte)).any(|block| {
        let block = block.trim_ascii();
        let is_place = matches!(block, [b'X' | b'Y' | b'x' | b'y', next, ..] if next.is_ascii_digit() || b"+-.".contains(next));
        is_place || matches!(block, [b'G', b'0'..=b'9', ..]) && holds(block, "D0")
    })
}
