//! Names of written files, and their header comments for the operator.
//!
//! ```text
//!   NN-side-operation-tool     01-bottom-isolate-V30-0.1     02-bottom-drill-0.8     05-top-cut-out-mill-1.5
//! ```

use super::dialect::{Changes, Dialect, FileSplit, NameStyle};
use super::names::TemplateKind;
use super::values::number_of;
use crate::job::{Briefing, Command, Leg, Mark, Program, ToolBriefing};
use crate::locale;
use crate::units::Length;

const LONGEST_NAME: usize = 60;

/// With less room, a side is abbreviated.
const LITTLE_ROOM: usize = 12;

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct FileOf {
    /// Without extension.
    pub(super) name: String,
    /// The tools that it requests or starts with: indices into the program's tools.
    pub(super) bits: Vec<u32>,
    /// Its number in the order of execution, from 1, over all sides.
    pub(super) number: usize,
    pub(super) head: Vec<String>,
    part: Option<TemplateKind>,
}

pub(super) fn files(dialect: &Dialect, program: &Program, briefing: &Briefing, side: usize) -> Vec<FileOf> {
    let mut files = cut_up(dialect, program);
    let count = files.len();
    // Number of files of the sides before.
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

/// Assigns tools to files.
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
        // Avoid names like `drill-drill-0.8`.
        Some((form, size)) if operations.ends_with(form) => format!("{operations}-{size}"),
        _ => format!("{operations}-{tool}"),
    }
}

/// A duration for people: `45 s`, `12 min`, `1 h 05 min`.
pub(super) fn time_text(seconds: f64) -> String {
    let whole = libm::ceil(seconds) as u64;
    let minutes = whole.div_ceil(60);
    match whole {
        0..90 => format!("{whole} s"),
        90..5400 => format!("{minutes} min"),
        _ => format!("{} h {:02} min", minutes / 60, minutes % 60),
    }
}

/// A length for people: rounded to 0.1 mm.
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

/// The job's name with `suffix`, as the dialect allows it.
pub(super) fn name(style: Option<NameStyle>, program: &Program, suffix: &str) -> String {
    let base = program.name.rsplit(['/', '\\']).next().unwrap_or_default();
    let base = base.rsplit_once('.').map_or(base, |(stem, _)| if stem.is_empty() { base } else { stem });
    let NameStyle { longest, capitals } =
        style.unwrap_or(NameStyle { longest: LONGEST_NAME, capitals: false });
    let free = style.is_none();
    let plain = |c: char| match c {
        _ if c.is_ascii_alphanumeric() || c == '_' => c,
        '-' | '.' if free => c,
        _ => '_',
    };
    let mut text: String = base.chars().map(plain).collect();
    if !text.starts_with(|c: char| c.is_ascii_alphabetic() || (free && c.is_ascii_digit())) {
        text.insert(0, 'P');
    }
    // Names of one job differ at the end (sides of a board), so shorten the middle.
    let room = longest.saturating_sub(suffix.len()).max(1);
    if text.len() > room {
        let word = text.rfind(['_', '-']).map_or(4, |at| text.len() - at);
        let word = word.min(text.len());
        // With little room, a side is its first letter.
        let side = text.get(text.len() - word + 1..).is_some_and(|word| ["bottom", "top"].contains(&word));
        let short = side && (2..LITTLE_ROOM).contains(&room);
        let mut end = text.split_off(text.len() - if short { word } else { word.min(room / 2) });
        end.truncate(if short { 2 } else { room });
        text.truncate(room - end.len());
        text.push_str(&end);
    }
    text.push_str(suffix);
    if capitals { text.to_ascii_uppercase() } else { text }
}

/// The template of each leg: for its work, or for the next work.
pub(super) fn parts(program: &Program, dialect: &Dialect) -> Vec<TemplateKind> {
    let own = |leg: &Leg| match leg.mark {
        _ if mills(leg) => Some(TemplateKind::Engrave),
        Mark::Hole(_) => Some(TemplateKind::Drill),
        _ => None,
    };
    let only = if dialect.drill.is_some() { TemplateKind::Drill } else { TemplateKind::Engrave };
    let mut next = program.legs.iter().rev().find_map(own).unwrap_or(only);
    let mut parts: Vec<TemplateKind> = program
        .legs
        .iter()
        .rev()
        .map(|leg| {
            next = own(leg).unwrap_or(next);
            next
        })
        .collect();
    parts.reverse();
    parts
}

/// True if a leg mills: then it uses the milling template, regardless of its mark.
pub(super) fn mills(leg: &Leg) -> bool {
    let cuts = |command: &Command| matches!(command, Command::Mill { .. } | Command::MillArc { .. });
    matches!(leg.mark, Mark::Toolpath(_)) || leg.commands.iter().any(cuts)
}
