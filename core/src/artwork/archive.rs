//! Reads and writes zips in memory, within hard limits. Writes no files, follows no paths, and opens archives
//! only two levels deep.
//!
//! ```text
//! local header ─ data ─ … ─ central directory ─ end record (found from the back; points to the directory)
//! ```

use crate::diagnostic::Diagnostic;
use crate::{code, error};
use miniz_oxide::deflate::compress_to_vec;
use miniz_oxide::inflate::decompress_to_vec_with_limit;
use std::collections::BTreeMap;

/// Maximum number of members of an archive, including those of nested archives.
const MOST_MEMBERS: usize = 1_000;
const MOST_BYTES: usize = 64 << 20;
const MOST_BYTES_TOGETHER: usize = 128 << 20;
/// Maximum compression ratio of a member; drill files reach 30.
const HIGHEST_RATIO: usize = 200;
/// Up to this size, a member may have any ratio.
const SMALL: usize = 1 << 20;

/// Compression level, 0 to 10.
const LEVEL: u8 = 6;

#[derive(Clone, Debug)]
pub(super) enum Taken {
    Bytes(Vec<u8>),
    /// Why it is left out.
    Refused(Diagnostic),
}

#[derive(Clone, Debug)]
pub(super) struct Member {
    /// Path inside the archive, made printable.
    pub(super) name: String,
    pub(super) taken: Taken,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    members: usize,
    bytes: usize,
}

impl Budget {
    pub(super) const fn new() -> Self {
        Self { members: MOST_MEMBERS, bytes: MOST_BYTES_TOGETHER }
    }
}

struct Row<'a> {
    name: &'a [u8],
    method: u16,
    encrypted: bool,
    crc: u32,
    packed: usize,
    size: usize,
    local: usize,
}

/// Unpacks a zip. Fails with the reason why nothing can be read.
pub(super) fn unpack(zip: &[u8], budget: &mut Budget) -> Result<Vec<Member>, Diagnostic> {
    let refused = |code| Diagnostic::error(code);
    let end = end_record(zip).ok_or(refused(code!("archive.damaged")))?;
    let count = usize::from(number::<2>(zip, end + 10).ok_or(refused(code!("archive.damaged")))? as u16);
    let mut at = number::<4>(zip, end + 16).ok_or(refused(code!("archive.damaged")))? as usize;
    if count > budget.members {
        return Err(refused(code!("archive.too_many_members"))
            .with("count", count)
            .with("most", MOST_MEMBERS));
    }
    let mut members: Vec<Member> = Vec::new();
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    for _ in 0..count {
        let Some((row, next)) = directory_row(zip, at) else {
            return Err(refused(code!("archive.damaged")));
        };
        at = next;
        // Some Windows programs write backslashes; a Windows path with a drive letter stays unchanged.
        let given = shown(row.name);
        let name = if given.as_bytes().get(1) == Some(&b':') { given } else { given.replace('\\', "/") };
        if ignored(&name) {
            continue;
        }
        budget.members = budget.members.saturating_sub(1);
        // Windows and macOS ignore case: one such file would replace the other.
        let clash = seen.insert(name.to_lowercase(), members.len()).is_some();
        let taken = match take(zip, &row, &name, budget) {
            Ok(_) if clash => Taken::Refused(refused(code!("archive.name_clash"))),
            Ok(bytes) => Taken::Bytes(bytes),
            Err(code) => Taken::Refused(refused(code)),
        };
        members.push(Member { name, taken });
    }
    Ok(members)
}

/// The members of a zip by name. Fails if a single one can't be read.
pub fn members(zip: &[u8]) -> Result<Vec<(String, Vec<u8>)>, Diagnostic> {
    let taken = unpack(zip, &mut Budget::new())?.into_iter().map(|member| match member.taken {
        Taken::Bytes(bytes) => Ok((member.name, bytes)),
        Taken::Refused(why) => Err(why.at(&member.name, 0, 0)),
    });
    taken.collect()
}

/// True if `bytes` are a zip with a member called `name`. Unpacks nothing.
pub fn lists(bytes: &[u8], name: &str) -> bool {
    let Some(end) = end_record(bytes).filter(|_| bytes.starts_with(b"PK")) else { return false };
    let mut at = number::<4>(bytes, end + 16).unwrap_or_default() as usize;
    let rows = std::iter::from_fn(|| {
        let (row, next) = directory_row(bytes, at)?;
        at = next;
        Some(row)
    });
    rows.take(MOST_MEMBERS).any(|row| row.name == name.as_bytes())
}

/// Packs `members` in this order. Fails if `unpack` would reject the result.
pub fn packed(members: &[(String, Vec<u8>)]) -> Result<Vec<u8>, Diagnostic> {
    let together: usize = members.iter().map(|(_, bytes)| bytes.len()).sum();
    if together > MOST_BYTES_TOGETHER {
        return Err(error!("archive.too_large"));
    }
    if members.len() > MOST_MEMBERS {
        let why = error!("archive.too_many_members", ..);
        return Err(why.with("count", members.len()).with("most", MOST_MEMBERS));
    }
    if let Some((name, _)) = members.iter().find(|(name, _)| name.contains('\\')) {
        return Err(error!("archive.path_leads_out").at(name, 0, 0));
    }
    let (mut zip, mut directory) = (Vec::new(), Vec::new());
    for (name, bytes) in members {
        let squeezed = compress_to_vec(bytes, LEVEL);
        // `unpack` would reject a member that compresses too well, so store it uncompressed.
        let trap = bytes.len() > SMALL && bytes.len() / squeezed.len().max(1) > HIGHEST_RATIO / 2;
        let plain = trap || squeezed.len() >= bytes.len();
        let (method, data) = if plain { (0, bytes) } else { (8, &squeezed) };
        let at = zip.len();
        let mut head = Vec::new();
        // Version 2.0, UTF-8 names, and the earliest date that zip can store.
        for two in [20, 0x0800, method, 0, 0x0021_u16] {
            head.extend(two.to_le_bytes());
        }
        for four in [crc32(bytes), data.len() as u32, bytes.len() as u32] {
            head.extend(four.to_le_bytes());
        }
        head.extend((name.len() as u16).to_le_bytes());
        head.extend([0; 2]);
        zip.extend(b"PK\x03\x04");
        zip.extend(&head);
        zip.extend(name.as_bytes());
        zip.extend(data);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&head);
        directory.extend([0; 10]);
        directory.extend((at as u32).to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let (at, count) = (zip.len() as u32, members.len() as u16);
    zip.extend(&directory);
    zip.extend(b"PK\x05\x06\0\0\0\0");
    zip.extend([count.to_le_bytes(), count.to_le_bytes()].concat());
    zip.extend([(directory.len() as u32).to_le_bytes(), at.to_le_bytes()].concat());
    zip.extend([0; 2]);
    // Read back, so that no file is written that cannot be opened.
    self::members(&zip).map(|_| zip)
}

/// Folders, and files that macOS adds.
fn ignored(name: &str) -> bool {
    name.ends_with('/') || name.starts_with("__MACOSX/") || name.ends_with(".DS_Store")
}

/// A printable name: control characters become `?`.
fn shown(name: &[u8]) -> String {
    String::from_utf8_lossy(name)
        .chars()
        .take(300)
        .map(|letter| if letter.is_control() { '?' } else { letter })
        .collect()
}

fn take(zip: &[u8], row: &Row<'_>, name: &str, budget: &mut Budget) -> Result<Vec<u8>, &'static str> {
    let drive = name.as_bytes().get(1) == Some(&b':');
    if name.starts_with('/') || drive || name.split('/').any(|part| part == "..") {
        return Err(code!("archive.path_leads_out"));
    }
    if row.encrypted {
        return Err(code!("archive.encrypted"));
    }
    if row.size > MOST_BYTES || row.size > budget.bytes {
        return Err(code!("archive.too_large"));
    }
    if row.size > SMALL && row.size / row.packed.max(1) > HIGHEST_RATIO {
        return Err(code!("archive.bomb"));
    }
    let data = local_data(zip, row).ok_or(code!("archive.damaged_member"))?;
    let bytes = match row.method {
        0 => data.to_vec(),
        8 => decompress_to_vec_with_limit(data, row.size).map_err(|_| "archive.damaged_member")?,
        _ => return Err(code!("archive.unknown_method")),
    };
    if bytes.len() != row.size || crc32(&bytes) != row.crc {
        return Err(code!("archive.damaged_member"));
    }
    budget.bytes -= bytes.len();
    Ok(bytes)
}

/// The end record is in the last 64 KiB, before an optional comment.
fn end_record(zip: &[u8]) -> Option<usize> {
    let last = zip.len().checked_sub(22)?;
    (last.saturating_sub(0xFFFF)..=last).rev().find(|&at| zip.get(at..at + 4) == Some(b"PK\x05\x06"))
}

fn directory_row(zip: &[u8], at: usize) -> Option<(Row<'_>, usize)> {
    (zip.get(at..at.checked_add(4)?)? == b"PK\x01\x02").then_some(())?;
    let two = |offset: usize| number::<2>(zip, at + offset).map(|value| value as usize);
    let four = |offset: usize| number::<4>(zip, at + offset);
    let (name, extra, comment) = (two(28)?, two(30)?, two(32)?);
    let row = Row {
        name: zip.get(at + 46..at + 46 + name)?,
        encrypted: two(8)? & 1 == 1,
        method: two(10)? as u16,
        crc: four(16)?,
        packed: four(20)? as usize,
        size: four(24)? as usize,
        local: four(42)? as usize,
    };
    Some((row, at + 46 + name + extra + comment))
}

fn local_data<'a>(zip: &'a [u8], row: &Row<'_>) -> Option<&'a [u8]> {
    let at = row.local;
    (zip.get(at..at.checked_add(4)?)? == b"PK\x03\x04").then_some(())?;
    let start = at + 30 + number::<2>(zip, at + 26)? as usize + number::<2>(zip, at + 28)? as usize;
    zip.get(start..start.checked_add(row.packed)?)
}

fn number<const BYTES: usize>(zip: &[u8], at: usize) -> Option<u32> {
    let bytes = zip.get(at..at.checked_add(BYTES)?)?;
    Some(bytes.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte)))
}

/// CRC-32 of zip (polynomial 0xEDB88320), four bits at a time.
fn crc32(bytes: &[u8]) -> u32 {
    const TABLE: [u32; 16] = {
        let mut table = [0; 16];
        let mut index = 0;
        while index < 16 {
            let mut value = index as u32;
            let mut bit = 0;
            while bit < 4 {
                value = if value & 1 == 1 { value >> 1 ^ 0xEDB8_8320 } else { value >> 1 };
                bit += 1;
            }
            table[index] = value;
            index += 1;
        }
        table
    };
    let nibble = |crc: u32, bits: u32| crc >> 4 ^ TABLE[((crc ^ bits) & 15) as usize];
    !bytes.iter().fold(!0, |crc, &byte| nibble(nibble(crc, u32::from(byte)), u32::from(byte) >> 4))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crc32_matches_its_check_value() {
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn packed_files_unpack_unchanged() {
        let noise: Vec<u8> = (0..9_000_u32).map(|at| (at.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
        let rows = [("a.txt", b"hello hello hello hello".to_vec()), ("b/c.gbr", noise), ("empty", vec![])];
        let rows = rows.map(|(name, bytes)| (name.to_owned(), bytes)).to_vec();
        let more = ("zeros".to_owned(), vec![0; 3 << 20]);
        let rows = [rows, vec![more]].concat();
        let zip = packed(&rows).unwrap();
        assert_eq!(members(&zip).unwrap(), rows);
        assert_eq!(packed(&rows).unwrap(), zip);
        assert!(lists(&zip, "b/c.gbr") && !lists(&zip, "c.gbr") && !lists(b"PK\x05\x06", "a.txt"));
        for name in ["/etc/x", "../x", "a\\b"] {
            let why = packed(&[(name.to_owned(), vec![1])]).unwrap_err();
            assert_eq!(why.code, "archive.path_leads_out", "{name}");
        }
        assert!(packed(&[rows.clone(), rows].concat()).is_err_and(|why| why.code == "archive.name_clash"));
    }

    #[test]
    fn broken_zips_are_damaged() {
        for bytes in [&b"PK\x03\x04"[..], b"", &[b'P'; 100]] {
            assert_eq!(unpack(bytes, &mut Budget::new()).unwrap_err().code, "archive.damaged");
        }
    }
}
