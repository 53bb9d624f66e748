//! Prepares the controller tests: the GRBL firmware with its simulator, at `ANNULUS_GRBL` or next to the
//! repository, and the packages to build the simulator. The tests build it themselves, into the target
//! folder.

use crate::sh::{Done, install_packages, root, which};
use std::path::{Path, PathBuf};

/// Headers that the simulator includes.
const HEADERS: [&str; 2] = ["/usr/include/simavr/sim_avr.h", "/usr/include/libelf.h"];
const PACKAGES: [&str; 4] = ["gcc", "libc6-dev", "libsimavr-dev", "libelf-dev"];

pub(crate) fn buildable() -> bool {
    which("cc").is_some() && HEADERS.iter().all(|header| Path::new(header).is_file())
}

/// Installs the packages that the simulator needs, if its source is present. Without it, the tests report
/// it missing.
pub(crate) fn ensure() -> Done {
    let beside = || root().join("../shared/instruments/grbl");
    let folder = std::env::var_os("ANNULUS_GRBL").map_or_else(beside, PathBuf::from);
    if buildable() || !folder.join("grbl-pty.c").is_file() {
        return Ok(());
    }
    install_packages("simavr (for the tests with the GRBL firmware)", &PACKAGES)
}
