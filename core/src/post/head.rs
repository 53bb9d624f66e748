//! What a written file is called, and what its head says to the person who runs it.
//!
//! ```text
//!   NN-side-operation-tool     01-bottom-isolate-V30-0.1     02-bottom-drill-0.8     05-top-cut-out-mill-1.5
//! ```
//!
//! Comes in: a program, its dialect, the briefing of its job. Goes out: for each file its name and the sentences of its head.
//! Does not know templates.

use super::dialect::{Changes, Dialect, FileSplit};
use super::names::TemplateKind;
use super::values::number_of;
use super::writer::{name, parts};
use crate::job::{Briefing, Mark, Program, ToolBriefing};
use crate::locale;
use crate::units::Length;

/// A file that there will be.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct FileOf {
    /// Its name, without extension.
    pub(super) name: String,
    /// The bits that it asks for or begins with, as indices into the program's bits.
    pub(super) bits: Vec<u32>,
    /// Its number in the order of running, from 1, over all sides.
    pub(super) number: usize,
    /// What its head says.
    pub(super) head: Vec<String>,
    part: Option<TemplateKind>,
}

/// The files that there will be of side `side` of a job.
pub(super) fn files(dialect: &Dialect, program: &Program, briefing: &Briefing, side: usize) -> Vec<FileOf> {
    let mut files = cut_up(dialect, program);
    let count = files.len();
    // What the sides before it leave numbered.
    let apart = dialect.files == FileSplit::Bit;
    let before: usize =
        briefing.sides.iter().take(side).map(|side| if apart { side.tools.len() } else { 1 }).sum();
    for (index, file) in files.iter_mut().enumerate() {
        let number = before + index + 1;
        file.number = number;
        file.name = match (dialect.program_name, count) {
            (None, _) if apart => reading(briefing, side, number, &file.bits),
            (style, 1) => name(style, program, ""),
            (Some(_), _) => name(dialect.program_name, program, &format!("_{}", index + 1)),
            (None, _) => {
                let part = file.part.map_or("", TemplateKind::key);
                name(None, program, &format!("-{}-{part}", index + 1))
            }
        };
        let stops = dialect.changes() == Changes::Stop;
        file.head = sentences(program, briefing, side, (file.bits.as_slice(), stops), (index + 1, count));
    }
    files
}

/// Which bits come into which file.
fn cut_up(dialect: &Dialect, program: &Program) -> Vec<FileOf> {
    let ending = |part: TemplateKind| dialect.templates(part).map(|templates| templates.extension.as_str());
    let mut files: Vec<FileOf> = Vec::new();
    let mut loaded = None;
    let parts = parts(program, dialect);
    let works = program.legs.iter().zip(&parts);
    for (leg, &part) in works.filter(|(leg, _)| !matches!(leg.mark, Mark::Prepare | Mark::Finish)) {
        let asked = if let Mark::ToolChange(bit) = leg.mark { Some(bit) } else { None };
        loaded = asked.or(loaded);
        let last = files.last().and_then(|file| file.part);
        let turned = last.is_none_or(|last| {
            last != part && (dialect.files == FileSplit::Operation || ending(last) != ending(part))
        });
        if turned || dialect.files == FileSplit::Bit && asked.is_some() {
            files.push(FileOf { part: Some(part), ..FileOf::default() });
        }
        if let Some(file) = files.last_mut() {
            file.part = Some(part);
            file.bits.extend(loaded.filter(|bit| !file.bits.contains(bit)));
        }
    }
    if files.is_empty() {
        files.push(FileOf::default());
    }
    files
}

/// `02-bottom-drill-0.8`.
fn reading(briefing: &Briefing, side: usize, number: usize, bits: &[u32]) -> String {
    let tools = briefing.sides.get(side).map_or(&[][..], |side| &side.tools);
    let tool = bits.first().and_then(|bit| tools.get(*bit as usize));
    let side = briefing.sides.get(side).map_or("", |side| &side.side);
    let words = [format!("{number:02}"), side.to_owned(), tool.map(operation_and_tool).unwrap_or_default()];
    let words: Vec<String> = words.into_iter().filter(|word| !word.is_empty()).collect();
    words.join("-")
}

fn operation_and_tool(of: &ToolBriefing) -> String {
    let operations = of.operations.join("-").replace('_', "-");
    let tool = of.tool.file_word();
    match tool.split_once('-') {
        _ if operations.is_empty() => tool,
        // A drill that drills need not be called so twice.
        Some((form, size)) if operations.ends_with(form) => format!("{operations}-{size}"),
        _ => format!("{operations}-{tool}"),
    }
}

/// A time as people say it: `45 s`, `12 min`, `1 h 05 min`.
pub(super) fn time_text(seconds: f64) -> String {
    let whole = libm::ceil(seconds) as u64;
    let minutes = whole.div_ceil(60);
    match whole {
        0..90 => format!("{whole} s"),
        90..5400 => format!("{minutes} min"),
        _ => format!("{} h {:02} min", minutes / 60, minutes % 60),
    }
}

/// A length as people say it: a tenth of a millimetre.
pub(super) fn tenths(length: Length) -> String {
    format!("{:.1}", libm::round(length.mm() * 10.0) / 10.0 + 0.0)
}

fn sentences(
    program: &Program,
    briefing: &Briefing,
    side: usize,
    (bits, stops): (&[u32], bool),
    (number, count): (usize, usize),
) -> Vec<String> {
    let say = |key: &str, args: &[(&str, String)]| {
        let args: Vec<_> = args.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
        locale::text(locale::FALLBACK, &format!("post.head.{key}"), &args)
    };
    let own = briefing.sides.get(side);
    let mut lines = vec![say("job", &[("job", briefing.job.clone())])];
    lines
        .extend(own.filter(|own| !own.side.is_empty()).map(|own| say("side", &[("side", own.side.clone())])));
    if count > 1 {
        lines.push(say("order", &[("number", number.to_string()), ("count", count.to_string())]));
    }
    let numbers = briefing.numbers(side);
    let mut said = Vec::new();
    for &bit in bits {
        let number = number_of(&numbers, bit);
        let Some(tool) = program.bits.get(bit as usize).filter(|_| !said.contains(&number)) else { continue };
        said.push(number);
        let title = tool.title(locale::FALLBACK);
        lines.push(say("tool", &[("number", number.to_string()), ("tool", title)]));
    }
    lines.extend((stops && said.len() > 1).then(|| say("stops", &[])));
    lines.extend(briefing.zero.as_ref().map(|zero| say(&format!("zero_{zero}"), &[])));
    if let Some(blank) = own.and_then(|own| own.blank) {
        let sizes =
            [("width", tenths(blank.max.x - blank.min.x)), ("height", tenths(blank.max.y - blank.min.y))];
        lines.push(say("blank", &sizes));
        let places = [
            ("left", tenths(blank.min.x)),
            ("right", tenths(blank.max.x)),
            ("near", tenths(blank.min.y)),
            ("far", tenths(blank.max.y)),
        ];
        lines.push(say("from_zero", &places));
    }
    lines.extend(briefing.thickness.map(|thickness| say("thickness", &[("thickness", tenths(thickness))])));
    let tools = own.map_or(&[][..], |own| &own.tools);
    let times: Option<f64> =
        bits.iter().map(|bit| tools.get(*bit as usize).and_then(|tool| tool.time_s)).sum();
    lines.extend(times.map(|seconds| say("time", &[("time", time_text(seconds))])));
    lines
}
