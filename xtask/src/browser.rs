//! Finds or installs Chromium and its driver, for the tests.

use crate::sh::{Done, install_packages, which};
use std::path::PathBuf;

#[derive(Debug)]
pub(crate) struct Browser {
    pub(crate) chromium: PathBuf,
    /// The driver that `wasm-pack` uses.
    pub(crate) driver: PathBuf,
}

pub(crate) fn find() -> Option<Browser> {
    let chromium =
        which("chromium").or_else(|| which("chromium-browser")).or_else(|| which("google-chrome"))?;
    Some(Browser { chromium, driver: which("chromedriver")? })
}

/// Installs them if they are missing.
pub(crate) fn ensure() -> Done<Browser> {
    if let Some(browser) = find() {
        return Ok(browser);
    }
    install_packages("Chromium with its driver (for the browser tests)", &["chromium", "chromium-driver"])?;
    find().ok_or_else(|| "Chromium was installed but is not on the search path.".to_owned())
}
