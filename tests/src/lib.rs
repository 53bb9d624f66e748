//! Shared by several tests: the locations of the repository and of the corpus of real boards, and reading
//! whole folders.

pub mod targets;

use annulus_core::artwork::{Artwork, Overrides, read_set};
use std::fs;
use std::path::{Path, PathBuf};

/// Rounds of a randomised test: few on every push, many with `cargo xtask test --long`.
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

/// The repository's test data: `synthetic` files and what is `expected` of them, laid out like the corpus.
pub fn data() -> PathBuf {
    root().join("tests/data")
}

/// The corpus of third-party boards, next to the repository or at `ANNULUS_CORPUS`. Without it, tests print a
/// line and are skipped; with `ANNULUS_NOTHING_SKIPPED` set, that is a failure.
pub fn corpus() -> Option<PathBuf> {
    let beside = || root().join("../shared/corpus");
    let folder = std::env::var_os("ANNULUS_CORPUS").map_or_else(beside, PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    assert!(std::env::var_os("ANNULUS_NOTHING_SKIPPED").is_none(), "no corpus at {}", folder.display());
    println!("skipped: no corpus");
    None
}

/// For every JSON below `expected`: the path of its file, and the JSON. From the test data and, if present,
/// the corpus.
pub fn expectations() -> Vec<(PathBuf, serde_json::Value)> {
    let mut found = Vec::new();
    for root in [Some(data()), corpus()].into_iter().flatten() {
        let own = root == data();
        for path in files_below(&root.join("expected")) {
            if path.extension().is_none_or(|ending| ending != "json") {
                continue;
            }
            let text = fs::read(&path).expect("a file that can be read");
            let value: serde_json::Value = serde_json::from_slice(&text).expect("an expectation is JSON");
            let name = value["file"].as_str().map(str::to_owned);
            // The corpus can contain the synthetic files too: use them once.
            if let Some(name) = name.filter(|name| own || !name.starts_with("synthetic/")) {
                found.push((root.join(name), value));
            }
        }
    }
    found
}

/// All files below a folder, in order.
pub fn files_below(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder that can be listed");
    let mut entries: Vec<_> = entries.map(|entry| entry.expect("a readable entry").path()).collect();
    entries.sort();
    let below = |path: PathBuf| if path.is_dir() { files_below(&path) } else { vec![path] };
    entries.into_iter().flat_map(below).collect()
}

/// Reads a folder as one set.
pub fn read_folder(folder: &Path) -> Artwork {
    let bytes = |path: &PathBuf| fs::read(path).expect("a file that can be read");
    let named: Vec<_> =
        files_below(folder).iter().map(|path| (path.display().to_string(), bytes(path))).collect();
    read_set(&named, &Overrides::default())
}
