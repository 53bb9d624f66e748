//! Keeps the old names of renamed flags working for one release. Each is a hidden alias at its flag.

use super::Arguments;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::note;
use clap::{Arg, CommandFactory};
use std::ffi::OsString;

/// Joins `--level measure` to `--level=measure` and `--lines-only 0.01` to `--lines-only=0.01`, and completes
/// a bare `--level`. The new flags don't take their value in these ways.
pub(super) fn joined(all: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut out: Vec<OsString> = Vec::new();
    let mut all = all.peekable();
    let mut is_flag = true;
    while let Some(mut argument) = all.next() {
        is_flag &= argument != "--";
        if is_flag && argument == "--level" {
            let which = all.next_if(|next| ["measure", "kept", "saved"].iter().any(|which| next == which));
            argument.push("=");
            argument.push(which.unwrap_or_else(|| "saved".into()));
        } else if is_flag && argument == "--lines-only" {
            let is_number = |next: &OsString| next.to_str().is_some_and(|next| next.parse::<f64>().is_ok());
            if let Some(error_mm) = all.next_if(is_number) {
                argument.push("=");
                argument.push(error_mm);
            }
        }
        out.push(argument);
    }
    out
}

/// A note for each old name in `words`, a command line that clap accepted.
pub(super) fn notes(words: &[OsString]) -> Vec<Diagnostic> {
    let note =
        |[old, new]: [String; 2]| note!("cli.old_flag", old = format!("--{old}"), new = format!("--{new}"));
    renamed(words).into_iter().map(note).collect()
}

/// Old and new name of each renamed flag in `words`, each once. A name counts only in its command: the
/// `--speed` of `lab profile` is not an old one.
fn renamed(words: &[OsString]) -> Vec<[String; 2]> {
    let root = Arguments::command();
    let mut command = &root;
    let mut found: Vec<[String; 2]> = Vec::new();
    for word in words.iter().skip(1).take_while(|word| **word != "--") {
        command = command.find_subcommand(word).unwrap_or(command);
        let Some(flag) = word.to_str().and_then(|word| word.strip_prefix("--")) else { continue };
        let old = flag.split_once('=').map_or(flag, |(name, _)| name);
        let mut arguments = command.get_arguments();
        let argument =
            arguments.find(|argument| argument.get_aliases().is_some_and(|names| names.contains(&old)));
        let Some(new) = argument.and_then(Arg::get_long) else { continue };
        let pair = [old.to_owned(), new.to_owned()];
        if !found.contains(&pair) {
            found.push(pair);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use std::ffi::OsStr;

    /// Every renamed flag: a command line with its old name, and the new name.
    const RENAMED: [(&str, &str); 27] = [
        ("inspect a --alone", "ignore-siblings"),
        ("inspect a --digits 2.4", "format"),
        ("inspect a --zeros leading", "suppress-zeros"),
        ("inspect a --align", "align-layers"),
        ("prove a b --turn not", "flip"),
        ("cam a --to grbl -o b --cure", "fix-gaps"),
        ("cam a --to grbl -o b --one-file", "single-file"),
        ("cam a --to grbl -o b --lines-only 0.01", "arcs-to-lines"),
        ("export a --to grbl -o b --lines-only", "arcs-to-lines"),
        ("level a --grid 5", "spacing"),
        ("run a --speed 20", "time-scale"),
        ("run a --from-start", "restart"),
        ("run a --load-magazine", "assume-magazine-loaded"),
        ("run --level a", "height-map"),
        ("serve --speed 20", "time-scale"),
        ("queue run a --speed 20", "time-scale"),
        ("grbl check a --speed 20", "time-scale"),
        ("grbl run a --same-length", "equal-tool-lengths"),
        ("grbl run a --setter -150,-10,-5,40,150,25", "tool-setter"),
        ("grbl run a --found 5,5=5.1,4.9", "align-hole"),
        ("grbl run a --level measure", "height-map"),
        ("grbl run a --confirm-tools 1", "unattended-tool-change"),
        ("grbl run a --probe 12", "probe-depth"),
        ("grbl run a --plate 1.5", "plate-thickness"),
        ("grbl level a --clear 2", "travel-height"),
        ("grbl level a --depth 1", "max-drop"),
        ("grbl resume --anew", "forget-options"),
    ];

    fn words(line: &str) -> Vec<OsString> {
        joined(format!("annulus {line}").split(' ').map(OsString::from))
    }

    #[test]
    fn old_flags_work_and_name_the_new_one() {
        for (line, new) in RENAMED {
            let words = words(line);
            Arguments::try_parse_from(&words).unwrap_or_else(|error| panic!("{line}: {error}"));
            let old = line.split(' ').find_map(|word| word.strip_prefix("--").filter(|word| *word != "to"));
            assert_eq!(renamed(&words), [[old.unwrap(), new]], "{line}");
        }
    }

    #[test]
    fn new_flags_and_other_commands_get_no_note() {
        for line in [
            "run a --time-scale 20 --height-map measure --json",
            "run -m virtual --format 2.4 -- --speed",
            "cam a --arcs-to-lines --to grbl -o b",
            "lab profile --speed 7",
        ] {
            let words = words(line);
            Arguments::try_parse_from(&words).unwrap_or_else(|error| panic!("{line}: {error}"));
            assert_eq!(notes(&words).len(), 0, "{line}");
        }
    }

    #[test]
    fn repeated_old_flag_gets_one_note() {
        let words = words("grbl run a --found 5,5=5,5 --found=9,5=9,5 --same-length");
        assert_eq!(renamed(&words), [["found", "align-hole"], ["same-length", "equal-tool-lengths"]]);
    }

    #[test]
    fn old_values_join_their_flag() {
        let joins = |line: &str| joined(line.split(' ').map(OsString::from)).join(OsStr::new(" "));
        assert_eq!(joins("run --level a"), "run --level=saved a");
        assert_eq!(joins("run --level kept a"), "run --level=kept a");
        assert_eq!(joins("run --level=measure a"), "run --level=measure a");
        assert_eq!(joins("export --lines-only 0.01 a"), "export --lines-only=0.01 a");
        assert_eq!(joins("export --lines-only a"), "export --lines-only a");
        assert_eq!(joins("run -- --level"), "run -- --level");
    }
}
