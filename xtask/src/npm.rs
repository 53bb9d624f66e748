//! Installs npm packages by a folder's lock file: `tests/browser` for the browser tests and for shrinking
//! the page, `bridge/firmware/emulator` for the adapter tests.

use crate::sh::{Done, command, output, root, run, which};
use sha2::{Digest, Sha256};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

pub(crate) fn folder() -> PathBuf {
    root().join("tests/browser")
}

/// Installs the packages of the browser tests, unless they are up to date.
pub(crate) fn ensure() -> Done<PathBuf> {
    ensure_in(&folder())?;
    Ok(folder())
}

/// One installation at a time: WebAssembly files are shrunk in parallel, and all need the same folder.
static TURN: Mutex<()> = Mutex::new(());

/// Installs the packages of a folder, unless they are up to date.
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

pub(crate) fn tests() -> Vec<PathBuf> {
    let entries = fs::read_dir(folder()).into_iter().flatten().flatten();
    let mut files: Vec<_> = entries.map(|entry| entry.path()).collect();
    files.retain(|file| file.to_string_lossy().ends_with(".test.mjs"));
    files.sort();
    files
}
