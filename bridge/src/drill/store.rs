//! Uploaded programs, saved by their SHA-256, and the height map of the board on the drill. Each file is
//! written atomically.

use crate::machine_file::write_own;
use crate::own;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::wire::program;
use annulus_host::KeptSurface;
use std::fs::{self, OpenOptions};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Most programs to save; the oldest are deleted first.
const MOST: usize = 64;

fn path_of(folder: &Path, key: &str) -> Option<PathBuf> {
    let is_key = key.len() == 64 && key.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
    is_key.then(|| folder.join("jobs").join(format!("{key}.annulus-program")))
}

/// Saves `bytes` if they are a program and `key` is their digest.
pub(super) fn keep(folder: &Path, key: &str, bytes: &[u8]) -> Result<(), Diagnostic> {
    let Some(path) = path_of(folder, key).filter(|_| program::key(bytes) == key) else {
        return Err(error!("control.wrong_key"));
    };
    program::decode(bytes)?;
    own::folder(&folder.join("jobs"))
        .and_then(|()| write_own(&path, bytes))
        .map_err(|error| error!("control.job_not_kept", reason = error))?;
    prune(&path);
    Ok(())
}

/// The program saved under `key`, if it is undamaged.
pub(super) fn load(folder: &Path, key: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    own::open(&path_of(folder, key)?, OpenOptions::new().read(true)).ok()?.read_to_end(&mut bytes).ok()?;
    (program::key(&bytes) == key).then_some(bytes)
}

/// Largest height map to read, bytes.
const LARGEST_MAP: u64 = 256 * 1024;

fn surface_file(folder: &Path) -> PathBuf {
    folder.join("drill-height-map.json")
}

/// Saves the height map of the board; `None` deletes it.
pub(super) fn keep_surface(folder: &Path, surface: Option<&KeptSurface>) -> Result<(), Diagnostic> {
    let path = surface_file(folder);
    let kept = match surface {
        Some(surface) => write_own(&path, &serde_json::to_vec(surface).unwrap_or_default()),
        None if path.exists() => fs::remove_file(&path),
        None => Ok(()),
    };
    let unkept = |error| error!("level.not_kept", file = path.display(), reason = error);
    kept.map_err(unkept)
}

/// Loads the height map; `None` if it is damaged.
pub(super) fn load_surface(folder: &Path) -> Option<KeptSurface> {
    let path = surface_file(folder);
    let small = fs::metadata(&path).is_ok_and(|file| file.len() <= LARGEST_MAP);
    let bytes = fs::read(&path).ok().filter(|_| small)?;
    serde_json::from_slice(&bytes).ok().filter(KeptSurface::is_whole)
}

pub(super) fn has_any(folder: &Path) -> bool {
    fs::read_dir(folder.join("jobs")).is_ok_and(|mut files| files.next().is_some())
}

/// Deletes the oldest programs, but never the newest: the clock may have been set back.
fn prune(newest: &Path) {
    let files = newest.parent().and_then(|folder| fs::read_dir(folder).ok()).into_iter().flatten().flatten();
    let mut aged: Vec<(SystemTime, PathBuf)> = files
        .filter(|file| file.path() != newest)
        .filter_map(|file| Some((file.metadata().ok()?.modified().ok()?, file.path())))
        .collect();
    aged.sort();
    let surplus = (aged.len() + 1).saturating_sub(MOST);
    for (_, path) in aged.into_iter().take(surplus) {
        let _ = fs::remove_file(path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::geometry::Point;
    use annulus_core::job::Program;
    use annulus_core::units::Length;
    use std::time::Duration;

    #[test]
    fn newest_program_is_stored_even_if_the_clock_was_set_back() {
        let folder = tempfile::tempdir().unwrap();
        let jobs = folder.path().join("jobs");
        let mut newest = String::new();
        for number in 0..=MOST + 3 {
            let program = Program {
                name: number.to_string(),
                machine: String::new(),
                origin: Point::default(),
                bits: Vec::new(),
                spindles: 1,
                safe_height: Length::ZERO,
                legs: Vec::new(),
                accepted: Vec::new(),
            };
            let bytes = program::encode(&program);
            newest = program::key(&bytes);
            keep(folder.path(), &newest, &bytes).unwrap();
            assert_eq!(load(folder.path(), &newest), Some(bytes), "{number}");
            // All earlier files are dated in the future.
            let file =
                fs::File::options().write(true).open(path_of(folder.path(), &newest).unwrap()).unwrap();
            file.set_modified(SystemTime::now() + Duration::from_secs(86_400)).unwrap();
        }
        assert_eq!(fs::read_dir(jobs).unwrap().count(), MOST);
        assert!(load(folder.path(), &newest).is_some());
    }
}
