//! `cargo xtask run`: build everything in release and start the bridge.
//!
//! Goes out: a running bridge that prints its address. Does not know what it serves.

use crate::page;
use crate::sh::{Done, command, run as call, target};
use std::path::PathBuf;

/// Builds page and bridge and serves; `arguments` go to `annulus serve`.
pub(crate) fn run(arguments: &[String]) -> Done {
    page::build(page::Effort::Whole)?;
    let bridge = build_bridge()?;
    call(command(bridge, &["serve"]).args(arguments))
}

/// Builds the bridge in release, with the page in it.
pub(crate) fn build_bridge() -> Done<PathBuf> {
    call(&mut command("cargo", &["build", "--release", "--package", "annulus-bridge"]))?;
    Ok(target().join("release/annulus"))
}
