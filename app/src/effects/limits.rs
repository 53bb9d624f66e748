//! Limits for reading files, however they arrive: dropped, picked, watched, launched, shared or linked.

use crate::said::{Text, key};
use web_sys::File;

/// More files at once are probably a home folder and not a board.
pub(super) const MOST_FILES: usize = 2_000;

pub(super) const MOST_BYTES: usize = 256 * 1024 * 1024;

/// Why this many files or bytes are refused; `None` if they are accepted.
pub(super) fn too_much(files: usize, bytes: u64) -> Option<Text> {
    let most = |key, most: usize| Some(Text::Key { key, args: vec![("most", most.to_string())] });
    if files > MOST_FILES {
        most(key!("page.open.too_many"), MOST_FILES)
    } else if bytes > MOST_BYTES as u64 {
        most(key!("page.open.too_large"), MOST_BYTES / 1024 / 1024)
    } else {
        None
    }
}

pub(super) fn too_much_of<'a>(files: impl ExactSizeIterator<Item = &'a File>) -> Option<Text> {
    let count = files.len();
    let bytes: f64 = files.map(|file| file.size()).sum();
    too_much(count, bytes as u64)
}

pub(super) fn unreadable(name: String) -> Text {
    Text::Key { key: key!("page.open.unreadable"), args: vec![("name", name)] }
}
