//! Writes a board instead of a program: its layers as Gerber and Excellon, or a picture as SVG.

use super::export::ExportArgs;
use super::files::ReadFiles;
use super::{Answer, Refusal, as_objects, diagnostic_lines, sentence};
use crate::cli::job;
use annulus_core::board::drawing;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::wire::program;
use serde::Serialize;
use std::fs;
use std::path::{Path, PathBuf};

const SVG: &str = "svg";

#[derive(Serialize)]
struct BoardReport<'a> {
    to: &'a str,
    file: Option<&'a String>,
    files: &'a [String],
    bytes: usize,
    sha256: String,
    holes: usize,
    #[serde(serialize_with = "as_objects")]
    diagnostics: Vec<Diagnostic>,
}

/// Writes the board in one of the formats of a board.
pub(super) fn run(args: &ExportArgs) -> Result<Answer, Refusal> {
    let (path, to) = (&args.job.job, args.target.to.as_str());
    if args.target.lines_only_mm.is_some() {
        return Err(Refusal::usage(error!("export.flag_of_program", flag = "--arcs-to-lines", to = to)));
    }
    let (read, board, diagnostics) = match job::program_file(path)? {
        // A program has only holes.
        Some(program) => {
            let (board, diagnostics) = job::board_of(&program, &args.job.accept)?;
            (ReadFiles::default(), board, diagnostics)
        }
        None => {
            let paths = std::slice::from_ref(path);
            let wanted = &args.job;
            let (read, board, diagnostics, _) =
                job::accepted_board(paths, &wanted.reading, &wanted.accept, true)?;
            (read, board, diagnostics)
        }
    };
    let stem = if board.name.is_empty() { job::stem(path).display().to_string() } else { board.name.clone() };
    let texts = if to == SVG {
        vec![(format!("{}.svg", drawing::stem(&stem)), drawing::board_svg(&board, &stem))]
    } else {
        drawing::files_of(&read.artwork, &read.listed)
    };
    if texts.is_empty() {
        return Err(Refusal::content(error!("export.no_layers", path = path.display())));
    }
    let written = write(&args.target.output, to, &texts, &read)?;
    let bytes = texts.iter().map(|(_, text)| text.as_str()).collect::<String>().into_bytes();
    let report = BoardReport {
        to,
        file: written.first(),
        files: &written,
        bytes: bytes.len(),
        sha256: program::key(&bytes),
        holes: board.holes.len(),
        diagnostics,
    };
    let line = |file: &String| sentence("cam.report.file", &[("file", file)]) + "\n";
    let text = written.iter().map(line).collect::<String>() + &diagnostic_lines(&report.diagnostics);
    Ok(Answer::new(&report, text))
}

/// Writes the files to the folder `output`, or a picture to the file `output`. Refuses to replace a file that
/// the board was read from.
fn write(
    output: &Path,
    to: &str,
    texts: &[(String, String)],
    read: &ReadFiles,
) -> Result<Vec<String>, Refusal> {
    let is_picture = to == SVG && output.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(SVG));
    if !is_picture {
        fs::create_dir_all(output).map_err(|error| {
            let why = error!("job.not_written", file = output.display(), reason = error);
            Refusal::surroundings(why)
        })?;
    }
    let paths: Vec<PathBuf> = texts
        .iter()
        .map(|(name, _)| if is_picture { output.to_owned() } else { output.join(name) })
        .collect();
    let inputs: Vec<PathBuf> =
        read.given.iter().filter_map(|(name, _)| fs::canonicalize(name).ok()).collect();
    let is_input = |path: &&PathBuf| fs::canonicalize(path).is_ok_and(|path| inputs.contains(&path));
    if let Some(path) = paths.iter().find(is_input) {
        return Err(Refusal::usage(error!("export.over_input", file = path.display())));
    }
    for (path, (_, text)) in paths.iter().zip(texts) {
        job::write_output(path, text.as_bytes())?;
    }
    Ok(paths.iter().map(|path| path.display().to_string()).collect())
}
