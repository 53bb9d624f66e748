//! Completions for shells, and manual pages. Both are made from the command line itself.

use super::{Answer, Refusal, help, sentence};
use annulus_core::error;
use clap_complete::Shell;
use serde_json::json;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Name of the program.
const PROGRAM: &str = "annulus";

/// Arguments of `annulus completions`.
#[derive(Debug, clap::Args)]
pub(crate) struct CompletionsArgs {
    /// Print the completions for this shell.
    #[arg(value_name = "SHELL", value_enum)]
    shell: Shell,
}

/// Arguments of `annulus man`.
#[derive(Debug, clap::Args)]
pub(crate) struct ManArgs {
    /// Write one manual page per command to this folder.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

pub(crate) fn run(args: &CompletionsArgs) -> Answer {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut help::command(), PROGRAM, &mut script);
    let text = String::from_utf8_lossy(&script).into_owned();
    Answer::new(&json!({ "shell": args.shell.to_string(), "text": &text }), text)
}

/// Writes the manual pages.
pub(crate) fn write_manual(args: &ManArgs) -> Result<Answer, Refusal> {
    let folder = args.folder.display().to_string();
    let files = written(&args.folder).map_err(|error| {
        let why = error!("job.not_written", file = &folder, reason = error);
        Refusal::surroundings(why)
    })?;
    let text = sentence("cli.manual_written", &[("count", &files.len()), ("folder", &folder)]);
    Ok(Answer::new(&json!({ "folder": folder, "files": files }), text + "\n"))
}

/// The names of the written files, sorted.
fn written(folder: &Path) -> io::Result<Vec<String>> {
    fs::create_dir_all(folder)?;
    clap_mangen::generate_to(help::command(), folder)?;
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if name.starts_with(PROGRAM) && name.ends_with(".1") {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}
