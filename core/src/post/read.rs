//! Reads dialect files (TOML), and reports every fault with its position.

use super::dialect::{
    Arcs, Comments, Dialect, FileSplit, Helix, LineStyle, Modal, NameStyle, NumberStyle, Rapids, Templates,
};
use super::names::{BLOCKS, Block, CURVES, PARAMETERS, TemplateKind};
use super::number::{Format, TrailingZeros};
use super::template::{Fault, Known, Template};
use super::words::{Table, Words};
use crate::diagnostic::{Diagnostic, nearest};
use crate::error;
use crate::units::Length;
use std::collections::BTreeMap;
use toml::Spanned;

const LARGEST: usize = 1 << 20;
/// Parameters whose words may be omitted if their value repeats.
const MODAL: &[&str] = &["X", "Y", "Z", "F", "V", "S", "T"];
const LARGEST_SHIFT_MM: f64 = 1e4;

const TOP: &[&str] = &[
    "schema",
    "name",
    "extension",
    "shift_mm",
    "tool_radius_mm",
    "files",
    "program_name",
    "number",
    "lines",
    "comments",
    "modal",
    "arcs",
    "drill",
    "engrave",
];
const FORMAT: &[&str] = &["decimals", "trailing_zeros", "leading_zeros", "point", "plus"];

impl Dialect {
    /// Reads the dialect in `text`; `file` names it in diagnostics. The error is the first fault.
    pub fn parse(file: &str, text: &str) -> Result<Self, Diagnostic> {
        let (dialect, faults) = read(file, text);
        match faults.into_iter().next() {
            Some(fault) => Err(fault),
            None => Ok(dialect),
        }
    }
}

/// All faults of the dialect in `text`, in file order; empty if it can be used.
pub fn check(file: &str, text: &str) -> Vec<Diagnostic> {
    read(file, text).1
}

fn read(file: &str, text: &str) -> (Dialect, Vec<Diagnostic>) {
    let too_large = text.len() > LARGEST;
    let (mut words, mut top) = Words::new(file, if too_large { "" } else { text });
    if too_large {
        words.fault(error!("post.dialect_too_large", most = LARGEST), 0);
        return (blank(), words.faults);
    }
    if top
        .take("schema")
        .is_none_or(|value| value.get_ref().as_integer().is_none_or(|one| one.as_str() != "1"))
    {
        words.fault(error!("post.schema"), 0);
    }
    let mut dialect = blank();
    dialect.name = words.short(&mut top, "name", 100, |c| !c.is_control()).unwrap_or_default();
    let top_rows = shared(&mut words, &mut top);
    let choices = [("job", FileSplit::Job), ("operation", FileSplit::Operation), ("bit", FileSplit::Bit)];
    dialect.files = words.choice(&mut top, "files", &choices).unwrap_or_default();
    if let Some(table) = words.table(&mut top, "program_name") {
        dialect.program_name = Some(program_name(&mut words, table));
    }
    if let Some(table) = words.table(&mut top, "number") {
        dialect.numbers = numbers(&mut words, table);
    }
    if let Some(table) = words.table(&mut top, "lines") {
        dialect.lines = lines(&mut words, table);
    }
    if let Some(table) = words.table(&mut top, "comments") {
        dialect.comments = comments(&mut words, table);
    }
    if let Some(table) = words.table(&mut top, "modal") {
        dialect.modal = modal(&mut words, table);
    }
    if let Some(table) = words.table(&mut top, "arcs") {
        dialect.arcs = arcs(&mut words, table);
    }
    for part in TemplateKind::ALL {
        let Some(table) = words.table(&mut top, part.key()) else { continue };
        let read = templates(&mut words, table, part, &top_rows, dialect.drill.as_ref(), dialect.arcs);
        match part {
            TemplateKind::Drill => dialect.drill = Some(read),
            TemplateKind::Engrave => dialect.engrave = Some(read),
        }
    }
    if dialect.drill.is_none() && dialect.engrave.is_none() && words.faults.is_empty() {
        words.fault(error!("post.no_templates"), 0);
    }
    words.unknown(&top, TOP);
    let mut faults = words.faults;
    faults.sort_by_key(|fault| fault.place.as_ref().map(|place| (place.line, place.column)));
    (dialect, faults)
}

fn blank() -> Dialect {
    Dialect {
        name: String::new(),
        files: FileSplit::Job,
        program_name: None,
        numbers: NumberStyle {
            base: Format { decimals: 3, trailing: TrailingZeros::All, leading: 1, point: true, plus: false },
            own: BTreeMap::new(),
        },
        lines: LineStyle {
            numbered: false,
            first: 10,
            step: 10,
            before: "N".to_owned(),
            after: " ".to_owned(),
            unnumbered: Vec::new(),
            crlf: false,
            skippable: Vec::new(),
        },
        comments: Comments::default(),
        modal: Modal::default(),
        arcs: Arcs::default(),
        fall_to: None,
        change_at: None,
        rapids: Rapids::default(),
        drill: None,
        engrave: None,
    }
}

#[derive(Clone, Default)]
struct Shared {
    extension: Option<String>,
    shift: Option<[Length; 2]>,
    tool_radius: Option<Length>,
}

fn shared<'a>(words: &mut Words<'a>, table: &mut Table<'a>) -> Shared {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let extension = words.short(table, "extension", 16, plain).filter(|text| !text.is_empty());
    let shift = words.pair(table, "shift_mm", -LARGEST_SHIFT_MM..LARGEST_SHIFT_MM);
    let radius = words.number(table, "tool_radius_mm", 0.0..100.0);
    Shared {
        extension,
        shift: shift.map(|both| both.map(Length::from_mm)),
        tool_radius: radius.map(Length::from_mm),
    }
}

fn program_name<'a>(words: &mut Words<'a>, mut table: Table<'a>) -> NameStyle {
    let longest = words.count(&mut table, "longest", 1..64).unwrap_or(32) as usize;
    let capitals = words.flag(&mut table, "capitals").unwrap_or(false);
    words.unknown(&table, &["longest", "capitals"]);
    NameStyle { longest, capitals }
}

/// Reads a number format from `table` with the defaults `base`. The other keys stay in the table.
fn format<'a>(words: &mut Words<'a>, table: &mut Table<'a>, base: Format) -> Format {
    let choices = [
        ("all", TrailingZeros::All),
        ("one", TrailingZeros::One),
        ("point", TrailingZeros::Point),
        ("none", TrailingZeros::None),
    ];
    Format {
        decimals: words.count(table, "decimals", 0..6).unwrap_or(base.decimals),
        trailing: words.choice(table, "trailing_zeros", &choices).unwrap_or(base.trailing),
        leading: words.count(table, "leading_zeros", 0..12).unwrap_or(base.leading),
        point: words.flag(table, "point").unwrap_or(base.point),
        plus: words.flag(table, "plus").unwrap_or(base.plus),
    }
}

fn numbers<'a>(words: &mut Words<'a>, mut table: Table<'a>) -> NumberStyle {
    let base = format(words, &mut table, blank().numbers.base);
    let mut numbers = NumberStyle { base, own: BTreeMap::new() };
    for row in PARAMETERS.iter().filter(|row| !row.word) {
        if let Some(mut own) = words.table(&mut table, row.name) {
            let format = format(words, &mut own, numbers.of(row.name));
            words.unknown(&own, FORMAT);
            numbers.own.insert(row.name, format);
        }
    }
    let numbers_of = PARAMETERS.iter().filter(|row| !row.word).map(|row| row.name);
    let known: Vec<&str> = FORMAT.iter().copied().chain(numbers_of).collect();
    words.unknown(&table, &known);
    numbers
}

fn lines<'a>(words: &mut Words<'a>, mut table: Table<'a>) -> LineStyle {
    let base = blank().lines;
    let visible = |c: char| !c.is_control() && c != '@';
    let skippable = words.texts(&mut table, "skippable");
    let unnumbered = words.texts(&mut table, "unnumbered");
    let style = LineStyle {
        numbered: words.flag(&mut table, "numbered").unwrap_or(base.numbered),
        first: words.count(&mut table, "first", 0..1_000_000).map_or(base.first, u64::from),
        step: words.count(&mut table, "step", 1..1_000_000).map_or(base.step, u64::from),
        before: words.short(&mut table, "before", 8, visible).unwrap_or(base.before),
        after: words.short(&mut table, "after", 8, visible).unwrap_or(base.after),
        unnumbered: unnumbered.into_iter().map(Spanned::into_inner).collect(),
        crlf: words.choice(&mut table, "ending", &[("lf", false), ("crlf", true)]).unwrap_or(base.crlf),
        skippable: skippable.iter().filter_map(|name| block_named(words, name)).collect(),
    };
    words.unknown(
        &table,
        &["numbered", "first", "step", "before", "after", "unnumbered", "ending", "skippable"],
    );
    style
}

fn block_named(words: &mut Words<'_>, name: &Spanned<String>) -> Option<(TemplateKind, Block)> {
    let full = |row: &super::names::BlockRow| format!("{}.{}", row.part.key(), row.block.key());
    let names: Vec<String> = BLOCKS.iter().map(full).collect();
    let found = BLOCKS.iter().zip(&names).find(|(_, known)| *known == name.get_ref());
    if found.is_none() {
        let diagnostic = error!("post.unknown_block", name = name.get_ref(), ..);
        let diagnostic =
            diagnostic.with("nearest", nearest(name.get_ref(), names.iter().map(String::as_str)));
        words.fault(diagnostic.with("known", names.join(", ")), name.span().start);
    }
    found.map(|(row, _)| (row.part, row.block))
}

fn comments<'a>(words: &mut Words<'a>, mut table: Table<'a>) -> Comments {
    let visible = |c: char| !c.is_control() && c != '@';
    let comments = Comments {
        open: words.short(&mut table, "open", 8, visible).unwrap_or_default(),
        close: words.short(&mut table, "close", 8, visible).unwrap_or_default(),
        dropped: words.flag(&mut table, "dropped").unwrap_or(false),
        capitals: words.flag(&mut table, "capitals").unwrap_or(false),
        longest: words.count(&mut table, "longest", 16..255).map(|letters| letters as usize),
    };
    words.unknown(&table, &["open", "close", "dropped", "capitals", "longest"]);
    comments
}

fn modal<'a>(words: &mut Words<'a>, mut table: Table<'a>) -> Modal {
    let mut parameters = Vec::new();
    for name in words.texts(&mut table, "parameters") {
        if let Some(known) = MODAL.iter().find(|known| *known == name.get_ref()) {
            parameters.push(*known);
        } else {
            let diagnostic = error!("post.not_modal", name = name.get_ref(), ..);
            words.fault(diagnostic.with("known", MODAL.join(", ")), name.span().start);
        }
    }
    let group = |text: Spanned<String>| text.get_ref().split_whitespace().map(str::to_owned).collect();
    let groups = words.texts(&mut table, "groups").into_iter().map(group).collect();
    words.unknown(&table, &["parameters", "groups"]);
    Modal { parameters, groups }
}

fn arcs<'a>(words: &mut Words<'a>, mut table: Table<'a>) -> Arcs {
    let base = Arcs::default();
    let helix = [("arcs", Helix::Arcs), ("blocks", Helix::Blocks), ("lines", Helix::Lines)];
    let arcs = Arcs {
        lines_only: words.flag(&mut table, "lines_only").unwrap_or(base.lines_only),
        chord_error_mm: words.number(&mut table, "chord_error_mm", 1e-4..1.0).unwrap_or(base.chord_error_mm),
        full_circle_parts: words.count(&mut table, "full_circle_parts", 1..4).unwrap_or(1),
        longest_deg: words.number(&mut table, "longest_deg", 10.0..360.0).unwrap_or(base.longest_deg),
        shortest_deg: words.number(&mut table, "shortest_deg", 0.0..90.0).unwrap_or(base.shortest_deg),
        smallest_mm: words.number(&mut table, "smallest_mm", 0.0..10.0).unwrap_or(base.smallest_mm),
        helix: words.choice(&mut table, "helix", &helix).unwrap_or(base.helix),
    };
    let known = [
        "lines_only",
        "chord_error_mm",
        "full_circle_parts",
        "longest_deg",
        "shortest_deg",
        "smallest_mm",
        "helix",
    ];
    words.unknown(&table, &known);
    arcs
}

fn templates<'a>(
    words: &mut Words<'a>,
    mut table: Table<'a>,
    part: TemplateKind,
    top: &Shared,
    drill: Option<&Templates>,
    arcs: Arcs,
) -> Templates {
    let own = shared(words, &mut table);
    let mut blocks = BTreeMap::new();
    for row in BLOCKS.iter().filter(|row| row.part == part) {
        match words.text(&mut table, row.block.key()) {
            Some(text) => {
                blocks.insert(row.block, template(words, part, row.block, &text));
            }
            None if needed(row.block, row.required, arcs) => {
                let diagnostic = error!("post.missing_block", block = row.block.key(), ..);
                words.missing_block(&table, diagnostic.with("template", part.key()));
            }
            None => {}
        }
    }
    // The milling template inherits these blocks from the drilling template.
    for block in [Block::Change, Block::Load, Block::Spindle] {
        if let Some(same) = drill.and_then(|drill| drill.blocks.get(&block)) {
            blocks.entry(block).or_insert_with(|| same.clone());
        }
    }
    if own.extension.is_none() && top.extension.is_none() {
        words.missing(&table, "extension");
    }
    let keys = BLOCKS.iter().filter(|row| row.part == part).map(|row| row.block.key());
    let known: Vec<&str> = keys.chain(["extension", "shift_mm", "tool_radius_mm"]).collect();
    words.unknown(&table, &known);
    Templates {
        extension: own.extension.or_else(|| top.extension.clone()).unwrap_or_default(),
        shift: own.shift.or(top.shift).unwrap_or_default(),
        tool_radius: own.tool_radius.or(top.tool_radius).filter(|_| part == TemplateKind::Engrave),
        blocks,
    }
}

/// True if the template requires `block`, given the controller's arc support.
fn needed(block: Block, required: bool, arcs: Arcs) -> bool {
    match block {
        Block::ArcCw | Block::ArcCcw => !arcs.lines_only,
        Block::HelixCw | Block::HelixCcw => !arcs.lines_only && arcs.helix == Helix::Blocks,
        _ => required,
    }
}

fn template(words: &mut Words<'_>, part: TemplateKind, block: Block, text: &Spanned<String>) -> Template {
    let known = |name: &str| match PARAMETERS.iter().find(|row| row.name == name) {
        Some(row) if !row.blocks.contains(&block) => Known::No,
        Some(row) if row.word => Known::Word,
        Some(_) => Known::Number,
        None => Known::No,
    };
    let (template, faults) = Template::parse(text.get_ref(), known);
    for (fault, at) in faults {
        let (diagnostic, at) = explain(words, part, block, text, &fault, at);
        words.fault(diagnostic, at);
    }
    template
}

fn explain(
    words: &Words<'_>,
    part: TemplateKind,
    block: Block,
    value: &Spanned<String>,
    fault: &Fault,
    at: usize,
) -> (Diagnostic, usize) {
    let span = value.span();
    let raw = words.source(span.clone());
    // Quotes are one or three characters; after three, TOML ignores the first line ending.
    let quotes = if raw.starts_with("\"\"\"") || raw.starts_with("'''") { 3 } else { 1 };
    let body = raw.get(quotes..).unwrap_or_default();
    let skipped = if quotes == 3 {
        body.len() - body.strip_prefix("\r\n").or(body.strip_prefix('\n')).unwrap_or(body).len()
    } else {
        0
    };
    let before = value.get_ref().get(..at).unwrap_or_default();
    let verbatim = body.get(skipped..).is_some_and(|body| body.starts_with(before));
    let offset = if verbatim { span.start + quotes + skipped + at } else { span.start };
    let here = || PARAMETERS.iter().filter(move |row| row.blocks.contains(&block)).map(|row| row.name);
    let diagnostic = match fault {
        Fault::Unknown(name) if PARAMETERS.iter().any(|row| row.name == name) => {
            error!("post.parameter_elsewhere", name = name, ..)
        }
        Fault::Unknown(name) => {
            error!("post.unknown_parameter", name = name, nearest = nearest(name, here()), ..)
        }
        Fault::Unclosed => error!("post.unclosed_parameter", ..),
        Fault::Arithmetic(text) => error!("post.bad_arithmetic", text = text, ..),
    };
    let names: Vec<String> = here().map(|name| format!("@{name}@")).collect();
    let field = format!("{}.{}", part.key(), block.key());
    (diagnostic.with("field", field).with("known", names.join(" ")), offset)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Centre {
    /// Directly, or by a third point.
    Said,
    /// By the radius alone: the shorter of the two arcs.
    Radius,
    /// By the radius, negative above half a circle.
    SignedRadius,
}

impl Templates {
    pub(super) fn centre(&self) -> Centre {
        let uses = |name: &str| {
            let blocks = CURVES.iter().filter_map(|block| self.blocks.get(block));
            blocks.flat_map(Template::names).any(|used| used == name)
        };
        if ["I", "J", "CX", "CY", "AX", "AY"].into_iter().any(uses) {
            return Centre::Said;
        }
        match (uses("CR"), uses("R")) {
            (true, _) => Centre::SignedRadius,
            (false, true) => Centre::Radius,
            (false, false) => Centre::Said,
        }
    }
}

#[cfg(test)]
#[path = "read_tests.rs"]
mod tests;
