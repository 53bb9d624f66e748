//! Sees to it that the folder of the built page exists, so that the bridge also compiles before the page was built. A released
//! bridge carries the page within it and is built anew with it; any other reads it from its folder.

use std::path::Path;

fn main() -> std::io::Result<()> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/www");
    std::fs::create_dir_all(&page)?;
    let carried = std::env::var("PROFILE").is_ok_and(|profile| profile == "release");
    let watched = if carried { page } else { "build.rs".into() };
    println!("cargo:rerun-if-changed={}", watched.display());
    Ok(())
}
