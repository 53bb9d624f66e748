//! Packages of npm, by the lock file of a folder: `tests/browser` for the browser tests and for making the page small,
//! `bridge/firmware/emulator` for those of the adapter.
//!
//! Goes out: the folder with the packages. Does not know the tests.

use crate::sh::{Done, command, output, root, run, which};
use sha2::{Digest, Sha256};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The folder that has `package.json`.
pub(crate) fn folder() -> PathBuf {
    root().join("tests/browser")
}

/// Installs what the lock file of the browser tests says, unless that was done already.
pub(crate) fn ensure() -> Done<PathBuf> {
    ensure_in(&folder())?;
    Ok(folder())
}

/// One installs at a time: the files of WebAssembly are made small side by side, and all want the same folder.
static TURN: Mutex<()> = Mutex::new(());

/// Installs what the lock file of a folder says, unless that was done already.
pub(crate) fn ensure_in(folder: &Path) -> Done {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let lock =
        fs::read(folder.join("package-lock.json")).map_err(|error| format!("No lock file: {error}."))?;
    let stamp = folder.join("node_modules/.annulus-stamp");
    let wanted = format!("{:x}", Sha256::digest(&lock));
    if fs::read_to_string(&stamp).is_ok_and(|found| found == wanted) {
        return Ok(());
    }
    let version = output(&mut command("node", &["--version"])).unwrap_or_default();
    let major: u32 =
        version.trim_start_matches('v').split('.').next().and_then(|n| n.parse().ok()).unwrap_or(0);
    if major < 20 || which("npm").is_none() {
        return Err(
            "Node 20 or newer with npm is needed. Install it from your system or from nodejs.org.".to_owned()
        );
    }
    let mut install = command("npm", &["ci", "--ignore-scripts", "--no-audit", "--no-fund"]);
    run(install.current_dir(folder))?;
    fs::write(&stamp, wanted).map_err(|error| format!("{}: {error}.", stamp.display()))
}

/// The browser tests, in order of name.
pub(crate) fn tests() -> Vec<PathBuf> {
    let entries = fs::read_dir(folder()).into_iter().flatten().flatten();
    let mut files: Vec<_> = entries.map(|entry| entry.path()).collect();
    files.retain(|file| file.to_string_lossy().ends_with(".test.mjs"));
    files.sort();
    files
}
