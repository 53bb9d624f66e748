//! Lists the contents of files. Fails only if a file can't be opened, never because of its content.

use super::against::{self, corners};
use super::{Answer, Exit, Refusal, counted, mm, rounded, verbosity};
use crate::cli::files;
use crate::refusal;
use annulus_core::artwork::{
    Counts, DrillFile, Evidence, FileKind, FileRead, Gerber, Role, TooMuch, nets, painted,
    painted_for_picture, painted_measures,
};
use annulus_core::diagnostic::Diagnostic;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fmt::Write;

/// Maximum number of diagnostics per file in the text output without `--verbose`.
const SHOWN_REMARKS: usize = 12;

/// Above this number of objects, a silkscreen is measured with the page's coarser arcs, because it is never
/// milled.
const EXACT_OBJECTS: u32 = 20_000;

/// Arguments of `annulus inspect`.
#[derive(Debug, clap::Args)]
pub(crate) struct InspectArgs {
    /// Read these files, folders or zips.
    #[arg(required = true, value_name = "PATH")]
    pub(crate) paths: Vec<std::path::PathBuf>,
    /// Show the changes since an earlier version of the board: its files, folder, zip or project.
    #[arg(long, value_name = "PATH", num_args = 1..)]
    pub(crate) against: Vec<std::path::PathBuf>,
    #[command(flatten)]
    pub(crate) reading: super::ReadingArgs,
}

pub(crate) fn run(args: &InspectArgs, json: bool) -> Result<Answer, Refusal> {
    let read = files::read(&args.paths, &args.reading)?;
    let listed: Vec<&FileRead> = read.listed.iter().map(|&index| &read.artwork.files[index]).collect();
    let boards = read.artwork.boards(&read.listed);
    let of_board = |(name, files): &(String, Vec<usize>)| {
        let files = files.iter().map(|&index| read.artwork.files[index].name.as_str()).collect::<Vec<_>>();
        json!({ "name": name, "files": files })
    };
    // Areas need painting, which is slow, so only the JSON output has them.
    let rows: Vec<Value> = listed.iter().filter(|_| json).map(|file| file_object(file)).collect();
    let mut object = json!({ "files": rows, "boards": boards.iter().map(of_board).collect::<Vec<_>>() });
    let mut text = listed.iter().fold(String::new(), |text, file| text + &file_text(file));
    if !args.against.is_empty() {
        let (changes, lines) = against::compare(&args.paths, &args.against, &args.reading)?;
        object["changes"] = changes;
        text += &lines;
    }
    for (name, files) in boards.iter().filter(|_| boards.len() > 1) {
        let _ = writeln!(text, "board {name}: {}", counted(files.len() as u64, "file"));
    }
    // A requested file that can't be opened is an error, with the rest of the answer.
    let asked = |file: &&&FileRead| args.paths.iter().any(|path| path.display().to_string() == file.name);
    let refused = listed.iter().filter(|file| file.kind == FileKind::Refused).find(asked);
    let Some(refused) = refused else { return Ok(Answer { object, text, exit: Exit::Done }) };
    // The text has the reason already.
    object["error"] = Refusal::content(refused.reason.clone()).object()["error"].take();
    Ok(Answer { object, text, exit: Exit::Content })
}

fn file_object(file: &FileRead) -> Value {
    let evidence = |Evidence { source, score, runner_up, runner_up_reading, shift_mm, .. }: &Evidence| {
        json!({ "source": source, "score": score.map(rounded), "runner_up": runner_up.map(rounded),
            "runner_up_reading": runner_up_reading, "shift_mm": shift_mm.map(|(x, y)| [x, y].map(rounded)) })
    };
    let mut object = json!({
        "file": file.name,
        "kind": file.kind,
        "role": file.role,
        "side": file.side,
        "plated": file.plated,
        "generator": file.generator,
        "reason": file.reason.message("en"),
        "units": file.units,
        "number_format": file.number_format,
        "zeros_suppressed": file.zeros,
        "format_evidence": file.evidence.as_ref().map(evidence),
    });
    let (gerber, much) = file.gerber.as_ref().map(|gerber| gerber_object(gerber, file.role)).unzip();
    for rows in file.drill.as_ref().map(drill_object).into_iter().chain(gerber) {
        if let (Value::Object(object), Value::Object(rows)) = (&mut object, rows) {
            object.extend(rows);
        }
    }
    let much = much.flatten().map(|much| much.diagnostic(&file.name));
    object["diagnostics"] = file.diagnostics.iter().chain(&much).map(diagnostic_object).collect();
    object
}

/// The rows of a layer, and the reason if the layer is too large to be painted.
fn gerber_object(gerber: &Gerber, role: Role) -> (Value, Option<TooMuch>) {
    let objects = gerber.counts;
    // A layer that is too large to be painted still has its other rows.
    let is_picture = role == Role::Silk && objects.total() > EXACT_OBJECTS;
    let painted = if is_picture { painted_for_picture(gerber) } else { painted(gerber) };
    let measures = painted.as_ref().ok().map(painted_measures);
    let nets = painted.as_ref().ok().map(|region| nets(gerber, region).names);
    let nets = nets.map(|names| names.into_iter().flatten().collect::<BTreeSet<_>>().len());
    let hairlines = gerber.centre_bounds().filter(|_| gerber.has_only_hairlines());
    let rows = json!({
        "image_polarity": if gerber.negative_image { "negative" } else { "positive" },
        "file_function": gerber.file_function,
        "file_polarity_attribute": gerber.file_polarity,
        "objects": { "flashes": objects.flashes, "lines": objects.lines, "arcs": objects.arcs,
            "regions": objects.regions, "total": objects.total() },
        "painted_bbox_mm": measures.and_then(|measures| measures.bounds).map(corners),
        "centre_line_bbox_mm": hairlines.map(corners),
        "dark_area_mm2": measures.map(|measures| rounded(measures.area_mm2)),
        "islands": measures.map(|measures| measures.islands),
        "holes_in_islands": measures.map(|measures| measures.holes),
        "nets": nets,
    });
    (rows, painted.err())
}

fn drill_object(drill: &DrillFile) -> Value {
    let tools = drill.tools.iter().zip(drill.counts()).map(|(tool, counts)| {
        json!({ "n": tool.code, "diameter_mm": tool.diameter.map(mm), "plated": tool.plated,
            "hits": counts.hits, "slots_g85": counts.slots, "routed_paths": counts.routed_paths,
            "routed_segments": counts.routed_segments })
    });
    let totals = drill.totals();
    json!({
        "tools": tools.collect::<Vec<_>>(),
        "totals": { "hits": totals.hits, "slots_g85": totals.slots, "routed_paths": totals.routed_paths,
            "routed_segments": totals.routed_segments },
        "bbox_centres_mm": drill.centre_bounds().map(corners),
        "bbox_outer_mm": drill.outer_bounds().map(corners),
        "rapid_length_file_order_mm": rounded(drill.rapid_length_mm()),
    })
}

/// A diagnostic whose file is named elsewhere.
fn diagnostic_object(diagnostic: &Diagnostic) -> Value {
    let mut object = refusal::diagnostic(diagnostic);
    if let Value::Object(rows) = &mut object {
        rows.remove("file");
    }
    object
}

fn file_text(file: &FileRead) -> String {
    let mut text = format!("{}\n  {} — {}", file.name, file.kind.name(), file.reason.message("en"));
    // The reason why a file is refused is also its first diagnostic: print it once.
    let said = usize::from(file.kind == FileKind::Refused && file.diagnostics.first() == Some(&file.reason));
    let _ = if said > 0 { writeln!(text, " {}", file.reason.advice("en")) } else { writeln!(text) };
    if let Some(drill) = &file.drill {
        drill_text(&mut text, file, drill);
    }
    if file.kind == FileKind::Gerber {
        let side = file.side.map_or("", |side| side.name());
        let _ = writeln!(text, "{}", format!("  {} {side}", file.role.name()).trim_end());
    }
    if let Some(gerber) = &file.gerber {
        let counts = gerber.counts;
        let flashes = format!("{} flash{}", counts.flashes, if counts.flashes == 1 { "" } else { "es" });
        let (lines, arcs) = (counted(counts.lines, "line"), counted(counts.arcs, "arc"));
        let _ = writeln!(text, "  {flashes}, {lines}, {arcs}, {}", counted(counts.regions, "contour"));
    }
    let most = if verbosity::is_verbose() { file.diagnostics.len() } else { SHOWN_REMARKS };
    for diagnostic in file.diagnostics.iter().skip(said).take(most) {
        let line = diagnostic.place.as_ref().map_or(0, |place| place.line);
        let place = if line > 0 { format!("line {line}: ") } else { String::new() };
        let (message, advice) = (diagnostic.message("en"), diagnostic.advice("en"));
        let _ = writeln!(text, "  {}: {place}{message} {advice}", diagnostic.severity.word());
    }
    if let Some(more) = file.diagnostics.len().checked_sub(said + most + 1) {
        let _ = writeln!(text, "  … {} more", more + 1);
    }
    text.push('\n');
    text
}

fn drill_text(text: &mut String, file: &FileRead, drill: &DrillFile) {
    let units = file.units.map_or("?", |units| units.name());
    let format =
        file.number_format.map_or(String::new(), |digits| format!(" {}.{}", digits.integer, digits.decimal));
    let zeros = file.zeros.map_or("?", |zeros| zeros.name());
    let ground = file.evidence.as_ref().map_or(String::new(), |evidence| {
        let score =
            evidence.score.map_or(String::new(), |score| format!(", {:.0} % on copper", score * 100.0));
        format!(" ({}{score})", evidence.source.name())
    });
    let _ = writeln!(text, "  {units}{format}, suppressed zeros: {zeros}{ground}");
    text.push_str("    tool   diameter    holes  slots  routes  plated\n");
    for (tool, counts) in drill.tools.iter().zip(drill.counts()) {
        let diameter = tool.diameter.map_or("?".to_owned(), |length| format!("{:.3} mm", length.mm()));
        let plated = tool.plated.map_or("", |plated| if plated { "yes" } else { "no" });
        let code = format!("T{}", tool.code);
        let Counts { hits, slots, routed_paths, .. } = counts;
        let _ =
            writeln!(text, "  {code:>6}  {diameter:>9}  {hits:>7}  {slots:>5}  {routed_paths:>6}  {plated}");
    }
    if let Some(bounds) = drill.centre_bounds() {
        let (width, height) = ((bounds.max.x - bounds.min.x).mm(), (bounds.max.y - bounds.min.y).mm());
        let holes = counted(drill.hits.len() as u64, "hole");
        let _ = writeln!(text, "  {holes} within {width:.3} × {height:.3} mm");
    }
}
