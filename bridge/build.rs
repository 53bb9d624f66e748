//! Creates the folder of the built page, so that the bridge compiles before the page is built. A release
//! build embeds the page and is rebuilt if the page changes; other builds read its folder.

use std::path::Path;

fn main() -> std::io::Result<()> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/www");
    std::fs::create_dir_all(&page)?;
    let carried = std::env::var("PROFILE").is_ok_and(|profile| profile == "release");
    let watched = if carried { page } else { "build.rs".into() };
    println!("cargo:rerun-if-changed={}", watched.display());
    Ok(())
}
