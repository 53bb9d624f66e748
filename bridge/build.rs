//! Sees to it that the folder of the built page exists, so that the bridge also compiles before the page was built.

use std::path::Path;

fn main() -> std::io::Result<()> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/www");
    std::fs::create_dir_all(&page)?;
    println!("cargo:rerun-if-changed={}", page.display());
    Ok(())
}
