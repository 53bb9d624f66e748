//! Finds and opens the user's browser.

use std::env;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// The program that opens addresses, if there is a screen.
pub(crate) fn opener() -> Option<PathBuf> {
    let (names, screen): (&[&str], bool) = if cfg!(target_os = "macos") {
        (&["open"], true)
    } else {
        let screen = ["DISPLAY", "WAYLAND_DISPLAY"]
            .iter()
            .any(|name| env::var_os(name).is_some_and(|v| !v.is_empty()));
        (&["xdg-open", "sensible-browser"], screen)
    };
    let folders = env::var_os("PATH")?;
    let mut found =
        names.iter().flat_map(|name| env::split_paths(&folders).map(move |folder| folder.join(name)));
    found.find(|path| path.is_file()).filter(|_| screen)
}

/// Opens `url`. Returns `false` if there is no browser.
pub(crate) fn open(url: &str) -> bool {
    let Some(opener) = opener() else { return false };
    let mut command = Command::new(opener);
    command.arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    match command.spawn() {
        Ok(mut child) => {
            std::thread::spawn(move || child.wait());
            true
        }
        Err(_) => false,
    }
}
