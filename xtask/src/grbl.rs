//! What the tests of controllers need: the GRBL firmware with the simulator that it runs on, which lie beside the repository or where
//! `ANNULUS_GRBL` says, and what that simulator is built with. The tests build it themselves, into the target folder.
//!
//! Goes out: nothing, or a sentence. Does not know the tests.

use crate::sh::{Done, install_packages, root, which};
use std::path::{Path, PathBuf};

/// What the simulator includes.
const HEADERS: [&str; 2] = ["/usr/include/simavr/sim_avr.h", "/usr/include/libelf.h"];
/// Where those come from.
const PACKAGES: [&str; 4] = ["gcc", "libc6-dev", "libsimavr-dev", "libelf-dev"];

/// Whether the simulator can be built.
pub(crate) fn buildable() -> bool {
    which("cc").is_some() && HEADERS.iter().all(|header| Path::new(header).is_file())
}

/// Makes sure that the simulator can be built, where it is at all; where it is not, the tests say so.
pub(crate) fn ensure() -> Done {
    let beside = || root().join("../shared/instruments/grbl");
    let folder = std::env::var_os("ANNULUS_GRBL").map_or_else(beside, PathBuf::from);
    if buildable() || !folder.join("grbl-pty.c").is_file() {
        return Ok(());
    }
    install_packages("simavr (for the tests with the GRBL firmware)", &PACKAGES)
}
