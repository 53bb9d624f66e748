//! What several tests share: where the repository and the corpus of real boards are.

pub mod targets;

use std::path::{Path, PathBuf};

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
