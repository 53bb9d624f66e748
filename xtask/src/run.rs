//! `cargo xtask run`: builds everything in release and starts the bridge.

use crate::page;
use crate::sh::{Done, command, run as call, target};
use std::path::PathBuf;

/// Builds page and bridge and starts `annulus serve` with `arguments`.
pub(crate) fn run(arguments: &[String]) -> Done {
    page::build(page::Effort::Whole)?;
    let bridge = build_bridge()?;
    call(command(bridge, &["serve"]).args(arguments))
}

pub(crate) fn build_bridge() -> Done<PathBuf> {
    call(&mut command("cargo", &["build", "--release", "--package", "annulus-bridge"]))?;
    Ok(target().join("release/annulus"))
}
