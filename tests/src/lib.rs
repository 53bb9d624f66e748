//! What several tests share: where the repository and the corpus of real boards are, and folders read as one set.

pub mod targets;

use annulus_core::artwork::{Artwork, Overrides, read_set};
use std::fs;
use std::path::{Path, PathBuf};

/// How many rounds a test of chance goes: few on every push, many when asked for with `cargo xtask test --long`.
pub fn rounds(short: u64, long: u64) -> u64 {
    if std::env::var_os("ANNULUS_LONG").is_some() { long } else { short }
}

/// The root of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the tests live in a folder of the repository")
        .to_owned()
}

/// A folder shared beside the repository, for example `corpus`: from the variable if it is set, else
/// `../shared/NAME`. Without it the test is skipped with a line that says so; in continuous integration
/// (`CI=true`) that is a failure.
pub fn shared(name: &str, variable: &str) -> Option<PathBuf> {
    let beside = || root().join("../shared").join(name);
    let folder = std::env::var_os(variable).map_or_else(beside, PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    assert!(std::env::var("CI").as_deref() != Ok("true"), "no {name} at {}", folder.display());
    println!("skipped: no {name}");
    None
}

/// The corpus of real and synthetic boards.
pub fn corpus() -> Option<PathBuf> {
    shared("corpus", "ANNULUS_CORPUS")
}

/// All files below a folder, in order.
pub fn files_below(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder that can be listed");
    let mut entries: Vec<_> = entries.map(|entry| entry.expect("a readable entry").path()).collect();
    entries.sort();
    let below = |path: PathBuf| if path.is_dir() { files_below(&path) } else { vec![path] };
    entries.into_iter().flat_map(below).collect()
}

/// Everything in a folder, read as one set.
pub fn read_folder(folder: &Path) -> Artwork {
    let bytes = |path: &PathBuf| fs::read(path).expect("a file that can be read");
    let named: Vec<_> =
        files_below(folder).iter().map(|path| (path.display().to_string(), bytes(path))).collect();
    read_set(&named, &Overrides::default())
}
