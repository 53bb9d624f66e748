//! Uploaded programs, kept by their SHA-256.
//!
//! Comes in: keys and bytes. Goes out: bytes. A file is there whole or not at all. Does not know what is running.

use crate::machine_file::write_own;
use crate::own;
use annulus_core::remark::{Remark, Weight};
use annulus_core::wire::program;
use std::fs::{self, OpenOptions};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Programs kept; the oldest go first.
const MOST: usize = 64;

fn path_of(folder: &Path, key: &str) -> Option<PathBuf> {
    let is_key = key.len() == 64 && key.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
    is_key.then(|| folder.join("jobs").join(format!("{key}.annulus-program")))
}

/// Keeps `bytes` if they are a program and `key` is their digest.
pub(super) fn keep(folder: &Path, key: &str, bytes: &[u8]) -> Result<(), Remark> {
    let Some(path) = path_of(folder, key).filter(|_| program::key(bytes) == key) else {
        return Err(Remark::new(Weight::Loss, "control.wrong_key"));
    };
    program::decode(bytes)?;
    own::folder(&folder.join("jobs"))
        .and_then(|()| write_own(&path, bytes))
        .map_err(|error| Remark::new(Weight::Loss, "control.job_not_kept").with("reason", error))?;
    prune(&folder.join("jobs"));
    Ok(())
}

/// The bytes kept under `key`, if they still are what was kept.
pub(super) fn load(folder: &Path, key: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    own::open(&path_of(folder, key)?, OpenOptions::new().read(true)).ok()?.read_to_end(&mut bytes).ok()?;
    (program::key(&bytes) == key).then_some(bytes)
}

fn prune(folder: &Path) {
    let files = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut aged: Vec<(SystemTime, PathBuf)> =
        files.filter_map(|file| Some((file.metadata().ok()?.modified().ok()?, file.path()))).collect();
    aged.sort();
    let surplus = aged.len().saturating_sub(MOST);
    for (_, path) in aged.into_iter().take(surplus) {
        let _ = fs::remove_file(path);
    }
}
