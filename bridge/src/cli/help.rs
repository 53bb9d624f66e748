//! The help of every command: groups of options, two examples, and the page of the manual.

use super::Arguments;
use clap::{Arg, Command, CommandFactory};

/// What the program does: the start of its help.
pub(super) const ABOUT: &str = "Annulus reads the fabrication files of a printed circuit board, plans how to mill and drill it, and \
     proves the programs against its copper. It writes them for your controller, or runs them on your machine.";

/// Folder of the manual, in the sources and in every package.
const MANUAL: &str = "docs/manual/";

/// Groups of options, by their long names. Options of one command alone stay below "Options".
const GROUPS: &[(&str, &[&str])] = &[
    (
        "Input",
        &[
            "against",
            "align-layers",
            "board",
            "format",
            "ignore-siblings",
            "role",
            "suppress-zeros",
            "tools",
            "units",
        ],
    ),
    (
        "Planning",
        &[
            "accept",
            "board-mm",
            "clearance",
            "copper-um",
            "fix-gaps",
            "flip",
            "for",
            "group",
            "iterations",
            "job",
            "loaded",
            "machine",
            "no-mill",
            "order",
            "seed",
            "set",
            "side",
            "spindles",
        ],
    ),
    (
        "Running",
        &[
            "align-hole",
            "assume-magazine-loaded",
            "baud",
            "dry-run",
            "equal-tool-lengths",
            "fault",
            "forget-options",
            "height-map",
            "home",
            "margin",
            "max-drop",
            "over-breakpoints",
            "plate-thickness",
            "port",
            "probe-depth",
            "rehearse",
            "reset-on-open",
            "restart",
            "setter-depth",
            "setter-feeds",
            "spacing",
            "spin-up",
            "step",
            "time-scale",
            "tool-setter",
            "toolchange-macro",
            "travel-height",
            "unattended-tool-change",
            "yes",
            "zero-at",
            "zero-here",
        ],
    ),
    (
        "Output",
        &[
            "arcs-to-lines",
            "color",
            "csv",
            "digest-trace",
            "height",
            "json",
            "output",
            "quiet",
            "save-job",
            "save-project",
            "single-file",
            "svg",
            "to",
            "verbose",
            "width",
        ],
    ),
];

/// A command, its page of the manual, and two examples with their effects.
type Page = (&'static str, &'static str, [[&'static str; 2]; 2]);

const PAGES: &[Page] = &[
    (
        "",
        "command-line.md",
        [
            ["annulus", "open the page in a browser"],
            ["annulus cam board.zip --to grbl -o out", "plan, prove and write a whole board"],
        ],
    ),
    (
        "inspect",
        "drill-files.md",
        [
            ["annulus inspect board.zip", "list the files of a board and every problem"],
            ["annulus inspect new.zip --against old.zip", "show what changed since an earlier version"],
        ],
    ),
    (
        "plan",
        "planning.md",
        [
            ["annulus plan board.drl", "choose the drills and show the travel"],
            ["annulus plan board.drl --order fastest -o board.program", "save the plan as a program"],
        ],
    ),
    (
        "prove",
        "proof.md",
        [
            ["annulus prove board.zip out/*.nc", "prove the files that cam wrote to out"],
            ["annulus prove board.zip top.nc --for grbl", "also refuse every line that GRBL refuses"],
        ],
    ),
    (
        "cam",
        "cam.md",
        [
            ["annulus cam board.zip -m 3018 --to grbl -o out", "write one file per tool, and the run sheet"],
            [
                "annulus cam board.zip --to grbl -o out --fix-gaps",
                "fix the gaps that are too narrow for the tool",
            ],
        ],
    ),
    (
        "export",
        "postprocessor.md",
        [
            ["annulus export board.drl --to linuxcnc -o board.ngc", "write the drilling as one program"],
            ["annulus export board.zip --to svg -o pictures", "draw the board, true to size"],
        ],
    ),
    (
        "templates",
        "postprocessor.md",
        [
            ["annulus templates grbl", "print a built-in postprocessor, to start your own"],
            ["annulus templates mine.toml", "check your own postprocessor"],
        ],
    ),
    (
        "simulate",
        "simulation.md",
        [
            ["annulus simulate board.drl", "compute how long the virtual drill needs"],
            ["annulus simulate board.drl -m 3018", "compute how long a 3018 needs"],
        ],
    ),
    (
        "level",
        "height-map.md",
        [
            ["annulus level board.zip --dry-run", "show where the board would be probed"],
            ["annulus level board.zip --spacing 5", "probe at least every 5 mm, on the virtual drill"],
        ],
    ),
    (
        "run",
        "bridge.md",
        [
            ["annulus run board.drl --time-scale 20", "drill on the virtual drill, 20 times faster"],
            [
                "annulus run board.zip -m 3018 --port /dev/ttyUSB0 --dry-run",
                "show what would move, without opening the port",
            ],
        ],
    ),
    (
        "ports",
        "grbl.md",
        [
            ["annulus ports", "list the serial ports and what is plugged in"],
            ["annulus ports --json", "the same for a script"],
        ],
    ),
    (
        "grbl",
        "grbl.md",
        [
            ["annulus grbl info --port /dev/ttyUSB0", "identify the controller, and list its settings"],
            ["annulus grbl run out/*.nc --port /dev/ttyUSB0", "run programs one after the other"],
        ],
    ),
    (
        "grbl ports",
        "grbl.md",
        [
            ["annulus grbl ports", "list the serial ports and what is plugged in"],
            ["annulus grbl ports --json", "the same for a script"],
        ],
    ),
    (
        "grbl info",
        "grbl.md",
        [
            ["annulus grbl info --port /dev/ttyUSB0", "identify the controller, and list its settings"],
            [
                "annulus grbl info --port /dev/ttyUSB0 --reset-on-open never",
                "the same without a reset of the controller",
            ],
        ],
    ),
    (
        "grbl check",
        "grbl.md",
        [
            ["annulus grbl check top.nc --port /dev/ttyUSB0", "let the controller read every line, at rest"],
            ["annulus grbl check top.nc --port /dev/ttyUSB0 --home", "home first, then check the travel too"],
        ],
    ),
    (
        "grbl level",
        "height-map.md",
        [
            ["annulus grbl level board.zip --port /dev/ttyUSB0 --dry-run", "show what would be probed"],
            [
                "annulus grbl level board.zip --port /dev/ttyUSB0 --spacing 5",
                "probe the board at least every 5 mm",
            ],
        ],
    ),
    (
        "grbl run",
        "grbl.md",
        [
            ["annulus grbl run top.nc --port /dev/ttyUSB0 --dry-run", "show what would move"],
            [
                "annulus grbl run top.nc --port /dev/ttyUSB0 --zero-here",
                "run with the work zero at the current position",
            ],
        ],
    ),
    (
        "grbl resume",
        "how-to/resume.md",
        [
            ["annulus grbl resume --port /dev/ttyUSB0 --dry-run", "show what is left of the interrupted job"],
            ["annulus grbl resume --port /dev/ttyUSB0", "resume it at its hole or toolpath"],
        ],
    ),
    (
        "firmware",
        "adapter.md",
        [
            ["annulus firmware info", "show the firmware of the USB step adapter"],
            ["annulus firmware flash", "flash the firmware of this program"],
        ],
    ),
    (
        "firmware info",
        "adapter.md",
        [
            ["annulus firmware info", "show the firmware of the only adapter"],
            ["annulus firmware info --port /dev/ttyACM0", "show the firmware of the adapter at this port"],
        ],
    ),
    (
        "firmware flash",
        "adapter.md",
        [
            ["annulus firmware flash", "flash the only adapter, or a board in boot mode"],
            ["annulus firmware flash --disk /media/RPI-RP2", "flash the board with this disk"],
        ],
    ),
    (
        "queue",
        "bridge.md",
        [
            ["annulus queue check home.queue", "check the rows without motion"],
            ["annulus queue run home.queue --step", "run row by row"],
        ],
    ),
    (
        "queue check",
        "bridge.md",
        [
            ["annulus queue check home.queue", "check the rows on the virtual drill"],
            ["annulus queue check home.queue -m lab", "check them on the laboratory drill"],
        ],
    ),
    (
        "queue run",
        "bridge.md",
        [
            ["annulus queue run home.queue --dry-run", "show what would move"],
            ["annulus queue run home.queue --step", "wait for Enter after each row"],
        ],
    ),
    (
        "serve",
        "bridge.md",
        [
            ["annulus serve", "open the page with the virtual drill"],
            ["annulus serve --serial-port /dev/ttyUSB0", "open the page with a GRBL mill"],
        ],
    ),
    (
        "link",
        "bridge.md",
        [
            ["annulus link", "print an address for another tab"],
            ["annulus link --scope view", "print an address that can only watch and stop"],
        ],
    ),
    (
        "machines",
        "machine.md",
        [
            ["annulus machines", "list the machines and what drives them"],
            ["annulus machines --rehearsal port.sim", "create a simulated port"],
        ],
    ),
    (
        "machines use",
        "machine.md",
        [
            ["annulus machines use 3018", "plan for a 3018 router from now on"],
            ["annulus machines use virtual", "plan for the virtual drill again"],
        ],
    ),
    (
        "tools",
        "how-to/tools-feeds-depths.md",
        [
            ["annulus tools list", "list the tools and their wear"],
            ["annulus tools reset 3 4", "tools 3 and 4 are new"],
        ],
    ),
    (
        "tools list",
        "how-to/tools-feeds-depths.md",
        [
            ["annulus tools list", "list the tools of the virtual drill"],
            ["annulus tools list -m 3018", "list the tools of a 3018"],
        ],
    ),
    (
        "tools reset",
        "how-to/tools-feeds-depths.md",
        [
            ["annulus tools reset 3", "tool 3 is new"],
            ["annulus tools reset 3 4 -m 3018", "tools 3 and 4 of the 3018 are new"],
        ],
    ),
    (
        "lab",
        "lab.md",
        [
            ["annulus lab profile --length-mm 10", "compute one move of 10 mm"],
            ["annulus lab cycle -o cycle.svg", "draw table and spindles in time"],
        ],
    ),
    (
        "lab profile",
        "lab.md",
        [
            ["annulus lab profile --length-mm 10", "compute one move of 10 mm"],
            ["annulus lab profile --length-mm 10 -o move.svg", "draw it"],
        ],
    ),
    (
        "lab automaton",
        "lab.md",
        [
            ["annulus lab automaton --target 200", "compute a move of 200 steps"],
            ["annulus lab automaton --target 200 --csv", "print every step as CSV"],
        ],
    ),
    (
        "lab cycle",
        "lab.md",
        [
            ["annulus lab cycle --hop 10,0 --hop 2.54,0", "compute two holes"],
            ["annulus lab cycle -m lab -o cycle.svg", "draw the cycle of the laboratory drill"],
        ],
    ),
    (
        "lab servo",
        "lab.md",
        [
            ["annulus lab servo", "compute a step with both controllers"],
            ["annulus lab servo --stroke -o loop.svg", "draw a drill cycle"],
        ],
    ),
    (
        "lab check",
        "lab.md",
        [
            ["annulus lab check cases.json", "recompute every case of a file"],
            ["annulus lab check cases.json --json", "the same for a script"],
        ],
    ),
    (
        "doctor",
        "troubleshooting.md",
        [
            ["annulus doctor", "check folders, ports and timing"],
            ["annulus doctor -m lab --seconds 10", "check that this computer is fast enough for a machine"],
        ],
    ),
    (
        "completions",
        "command-line.md",
        [
            ["annulus completions bash", "print the completions, to save as your shell expects them"],
            ["annulus completions zsh", "the same for zsh"],
        ],
    ),
    (
        "man",
        "command-line.md",
        [
            ["annulus man man1", "write the manual pages to the folder man1"],
            ["annulus man man1 --json", "list their files for a script"],
        ],
    ),
];

/// The whole command line, with its help.
pub(super) fn command() -> Command {
    with_help(Arguments::command(), "")
}

/// The command at `path`, for example `grbl run`, and its subcommands.
fn with_help(command: Command, path: &str) -> Command {
    let command = command.mut_args(grouped).mut_subcommands(|inner| {
        let path = format!("{path} {}", inner.get_name());
        with_help(inner, path.trim_start())
    });
    match PAGES.iter().find(|(name, ..)| *name == path) {
        Some((_, page, examples)) => command.after_help(below(page, examples)),
        None => command,
    }
}

fn grouped(arg: Arg) -> Arg {
    let group = arg.get_long().and_then(|long| GROUPS.iter().find(|(_, longs)| longs.contains(&long)));
    match group {
        Some((heading, _)) => arg.help_heading(*heading),
        None => arg,
    }
}

/// The end of a command's help.
fn below(page: &str, examples: &[[&str; 2]; 2]) -> String {
    let rows = examples.iter().map(|[line, effect]| format!("  {line}\n      {effect}\n"));
    format!("Examples:\n{}\nManual: {MANUAL}{page}", rows.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// Every visible command with its path.
    fn all(command: &Command, path: &str, found: &mut Vec<(String, Command)>) {
        found.push((path.to_owned(), command.clone()));
        for inner in command.get_subcommands().filter(|inner| !inner.is_hide_set()) {
            all(inner, format!("{path} {}", inner.get_name()).trim_start(), found);
        }
    }

    fn commands() -> Vec<(String, Command)> {
        let mut found = Vec::new();
        all(&command(), "", &mut found);
        found
    }

    #[test]
    fn every_command_has_two_examples_and_a_manual_page() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let commands = commands();
        for (path, command) in &commands {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert_eq!(help.matches("\n  annulus").count(), 2, "{path}: {help}");
        }
        for (path, page, examples) in PAGES {
            assert!(commands.iter().any(|(name, _)| name == path), "{path} is no command");
            assert!(root.join(MANUAL).join(page).is_file(), "{path}: {page}");
            for [line, _] in examples {
                assert!(line[7..].trim_start().starts_with(*path), "{path}: {line}");
            }
        }
    }

    #[test]
    fn examples_are_valid_command_lines() {
        for (_, _, examples) in PAGES {
            for [line, _] in examples {
                let parsed = command().try_get_matches_from(line.split(' '));
                assert!(parsed.is_ok(), "{line}: {}", parsed.unwrap_err());
            }
        }
    }

    #[test]
    fn options_of_board_commands_are_grouped() {
        for (path, command) in commands() {
            let is_board = command.get_arguments().any(|arg| arg.get_long() == Some("units"));
            let groups: Vec<_> = command.get_arguments().map(|arg| arg.get_help_heading()).collect();
            if is_board {
                for heading in ["Input", "Planning"] {
                    assert!(groups.contains(&Some(heading)) || path == "inspect", "{path}: {heading}");
                }
                for arg in command.get_arguments().filter(|arg| arg.get_long().is_some()) {
                    assert!(arg.get_help_heading().is_some(), "{path}: {arg}");
                }
            }
        }
    }
}
