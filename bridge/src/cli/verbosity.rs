//! How much the commands print, and whether in color: `--quiet`, `--verbose` and `--color`.

use super::Arguments;
use annulus_core::diagnostic::{Diagnostic, Severity};
use clap::ColorChoice;
use std::env;
use std::ffi::OsString;
use std::fmt::Display;
use std::io::{self, IsTerminal};
use std::sync::OnceLock;

/// What the user chose; written once, before the command starts.
static CHOSEN: OnceLock<Chosen> = OnceLock::new();

#[derive(Clone, Copy, Debug, Default)]
struct Chosen {
    quiet: bool,
    verbose: bool,
    color: ColorChoice,
}

/// Stores the choice for [`is_quiet`], [`is_verbose`] and [`has_color`].
pub(super) fn choose(arguments: &Arguments) {
    let Arguments { quiet, verbose, color, .. } = *arguments;
    let _ = CHOSEN.set(Chosen { quiet, verbose, color });
}

fn chosen() -> Chosen {
    CHOSEN.get().copied().unwrap_or_default()
}

/// Returns `true` if notes and progress bars are left out.
pub(super) fn is_quiet() -> bool {
    chosen().quiet
}

/// Returns `true` if long lists are printed in full.
pub(super) fn is_verbose() -> bool {
    chosen().verbose
}

/// Returns `true` if `message` is printed: all but notes with `--quiet`.
pub(super) fn is_shown(message: &Diagnostic) -> bool {
    !is_quiet() || message.severity != Severity::Note
}

/// Returns `true` if messages on standard error are colored. `NO_COLOR` is as at no-color.org.
pub(super) fn has_color() -> bool {
    match chosen().color {
        ColorChoice::Always => true,
        ColorChoice::Never => false,
        ColorChoice::Auto => {
            let is_set = |name: &str| env::var_os(name).is_some_and(|value| !value.is_empty());
            let is_dumb = env::var_os("TERM").is_some_and(|terminal| terminal == "dumb");
            !is_set("NO_COLOR") && !is_dumb && io::stderr().is_terminal()
        }
    }
}

/// The text of a refusal, in red if messages are colored.
pub(super) fn in_red(text: impl Display) -> String {
    if has_color() { format!("\u{1b}[31m{text}\u{1b}[0m") } else { text.to_string() }
}

/// The `--color` of a command line that is not parsed yet: clap needs it for help and errors.
pub(super) fn asked_color(words: &[OsString]) -> ColorChoice {
    let flags = || words.iter().skip(1).take_while(|word| **word != "--").filter_map(|word| word.to_str());
    let joined = flags().filter_map(|word| word.strip_prefix("--color="));
    let separate = flags().zip(flags().skip(1)).filter(|(flag, _)| *flag == "--color").map(|(_, when)| when);
    joined.chain(separate).find_map(|when| when.parse().ok()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn color_is_read_before_the_command_line_is_parsed() {
        for (line, color) in [
            ("annulus plan", ColorChoice::Auto),
            ("annulus plan --color always", ColorChoice::Always),
            ("annulus --color=never plan", ColorChoice::Never),
            ("annulus plan --color sometimes", ColorChoice::Auto),
            ("annulus plan -- --color never", ColorChoice::Auto),
        ] {
            let words: Vec<OsString> = line.split(' ').map(OsString::from).collect();
            assert_eq!(asked_color(&words), color, "{line}");
        }
    }
}
