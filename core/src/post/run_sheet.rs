//! The run sheet: one page to print and take to the machine.
//!
//! ```text
//!   requirements  machine, zero, blank, board, pins, flip, time
//!   files         number · file · side · operation · tool · time, in order, with a box to tick
//! ```

use super::OutputFile;
use super::dialect::Changes;
use super::head::{tenths, time_text};
use crate::job::{AlignmentPins, Briefing, SideBriefing, ToolBriefing};
use crate::locale;
use serde::{Deserialize, Serialize};
use std::fmt::Write;

const STYLE: &str = "body{font:11pt/1.35 sans-serif;margin:12mm auto;max-width:186mm;padding:0 4mm;color:#111;background:#fff}\
h1{font-size:16pt;margin:0 0 4mm}dl{display:grid;grid-template-columns:max-content 1fr;gap:1mm 5mm;margin:0 0 5mm}\
dt{color:#555}dd{margin:0}table{border-collapse:collapse;width:100%}th,td{text-align:left;vertical-align:top;\
border-bottom:.2mm solid #999;padding:1mm 2mm 1mm 0}td.n,th.n{text-align:right;white-space:nowrap}\
td.box::before{content:'';display:inline-block;width:3.5mm;height:3.5mm;border:.3mm solid #111}\
tr.flip td{background:#eee;font-weight:bold;padding-left:2mm}p{margin:4mm 0 0}@page{size:A4;margin:10mm}\
@media print{body{margin:0;max-width:none}}";

/// Content of the sheet in one language. Nothing is escaped.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunSheet {
    /// Language, for screen readers.
    pub language: String,
    pub title: String,
    /// Requirements of the job: names and values.
    pub facts: Vec<(String, String)>,
    /// Column titles.
    pub heads: Vec<String>,
    /// Files to run, in order.
    pub rows: Vec<SheetRow>,
    /// Instructions for every file.
    pub foot: String,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SheetRow {
    /// Flip the board, as described.
    Turn(String),
    /// A file: the lines of each column but the last, which is to be ticked.
    File(Vec<Vec<String>>),
}

impl SheetRow {
    pub fn is_number(at: usize) -> bool {
        HEADS.get(at).is_some_and(|key| matches!(*key, "number" | "time"))
    }
}

/// Column titles: keys of `run_sheet`.
const HEADS: [&str; 7] = ["number", "file", "side", "does", "tool", "time", "done"];

struct Words<'a> {
    language: &'a str,
}

impl Words<'_> {
    fn say(&self, key: &str, args: &[(&str, String)]) -> String {
        let args: Vec<_> = args.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
        locale::text(self.language, &format!("run_sheet.{key}"), &args)
    }

    fn word(&self, key: &str) -> String {
        locale::text(self.language, &format!("page.cam.word.{key}"), &[])
    }
}

/// The run sheet of a job in `language`; `files` are those of each side, in order.
pub fn run_sheet(language: &str, briefing: &Briefing, files: &[Vec<OutputFile>]) -> RunSheet {
    let words = Words { language };
    RunSheet {
        language: language.to_owned(),
        title: words.say("title", &[("job", briefing.job.clone())]),
        facts: facts(&words, briefing),
        heads: HEADS.iter().map(|key| words.say(key, &[])).collect(),
        rows: rows(&words, briefing, files),
        foot: words.say(foot(files), &[]),
    }
}

fn foot(files: &[Vec<OutputFile>]) -> &'static str {
    let has = |changes: Changes| files.iter().flatten().any(|file| file.changes == changes);
    if has(Changes::Stop) {
        "every_stop"
    } else if has(Changes::Changer) {
        "changer"
    } else {
        "every_tool"
    }
}

impl RunSheet {
    /// The sheet as a complete HTML page.
    pub fn html(&self) -> String {
        let title = escaped(&self.title);
        let mut out = format!(
            "<!doctype html>\n<html lang=\"{}\">\n<head>\n<meta charset=\"utf-8\">\n<title>{title}</title>\n\
             <style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n<dl>\n",
            escaped(&self.language)
        );
        for (name, value) in &self.facts {
            let _ = writeln!(out, "<dt>{}</dt><dd>{}</dd>", escaped(name), escaped(value));
        }
        out.push_str("</dl>\n<table>\n<thead><tr>");
        for (at, head) in self.heads.iter().enumerate() {
            let class = if SheetRow::is_number(at) { " class=\"n\"" } else { "" };
            let _ = write!(out, "<th scope=\"col\"{class}>{}</th>", escaped(head));
        }
        out.push_str("</tr></thead>\n<tbody>\n");
        for row in &self.rows {
            match row {
                SheetRow::Turn(how) => {
                    let _ = writeln!(out, "<tr class=\"flip\"><td colspan=\"7\">{}</td></tr>", escaped(how));
                }
                SheetRow::File(cells) => file_row(cells, &mut out),
            }
        }
        let _ = write!(out, "</tbody>\n</table>\n<p>{}</p>\n</body>\n</html>\n", escaped(&self.foot));
        out
    }
}

fn file_row(cells: &[Vec<String>], out: &mut String) {
    out.push_str("<tr>");
    for (at, lines) in cells.iter().enumerate() {
        let class = if SheetRow::is_number(at) { " class=\"n\"" } else { "" };
        let lines: Vec<String> = lines.iter().map(|line| escaped(line)).collect();
        let _ = write!(out, "<td{class}>{}</td>", lines.join("<br>"));
    }
    out.push_str("<td class=\"box\"></td></tr>\n");
}

fn facts(words: &Words<'_>, briefing: &Briefing) -> Vec<(String, String)> {
    let mut facts = Vec::new();
    let mut fact = |key: &str, value: String| facts.push((words.say(key, &[]), value));
    if !briefing.machine.is_empty() {
        fact("machine", briefing.machine.clone());
    }
    if let Some(zero) = &briefing.zero {
        fact("zero", words.say(&format!("zero_{zero}"), &[]));
    }
    let first = briefing.sides.first().and_then(|side| side.blank);
    let same = briefing.sides.len() > 1 && briefing.sides.iter().all(|side| side.blank == first);
    for side in briefing.sides.iter().take(if same { 1 } else { usize::MAX }) {
        if let Some(blank) = blank(words, side, same) {
            fact("blank", blank);
        }
    }
    if let Some(thickness) = briefing.thickness {
        fact("board", words.say("thick", &[("thickness", tenths(thickness))]));
    }
    fact("pins", briefing.pins.as_ref().map_or_else(|| words.say("no_pins", &[]), |some| pins(words, some)));
    if let Some(tabs) = briefing.tabs {
        let key = if tabs == 0 { "no_tabs" } else { "tabs_of" };
        fact("tabs", words.say(key, &[("count", tabs.to_string())]));
    }
    let flip = briefing.flip.as_ref();
    fact(
        "flip",
        flip.map_or_else(|| words.say("no_flip", &[]), |flip| words.say(&format!("flip_{flip}"), &[])),
    );
    let tools = briefing.sides.iter().flat_map(|side| &side.tools);
    let total: Option<f64> = tools.map(|tool| tool.time_s).sum();
    if let Some(total) = total {
        fact("total", words.say("total_time", &[("time", time_text(total))]));
    }
    facts
}

/// Required size and position of the blank: on one side, or the `same` on all.
fn blank(words: &Words<'_>, side: &SideBriefing, same: bool) -> Option<String> {
    let blank = side.blank?;
    let args = [
        ("side", words.word(&side.side)),
        ("width", tenths(blank.max.x - blank.min.x)),
        ("height", tenths(blank.max.y - blank.min.y)),
        ("left", tenths(blank.min.x)),
        ("right", tenths(blank.max.x)),
        ("near", tenths(blank.min.y)),
        ("far", tenths(blank.max.y)),
    ];
    Some(words.say(if same { "blank_is" } else { "blank_of" }, &args))
}

fn pins(words: &Words<'_>, pins: &AlignmentPins) -> String {
    let places = pins.at.iter().map(|at| format!("X {:.2} Y {:.2}", at.x.mm(), at.y.mm()));
    let args = [
        ("count", pins.at.len().to_string()),
        ("diameter", pins.diameter.mm().to_string()),
        ("below", tenths(pins.below)),
        ("places", places.collect::<Vec<_>>().join("; ")),
    ];
    words.say("pins_of", &args)
}

fn rows(words: &Words<'_>, briefing: &Briefing, files: &[Vec<OutputFile>]) -> Vec<SheetRow> {
    let mut rows = Vec::new();
    let mut number = 0;
    for (index, (side, files)) in briefing.sides.iter().zip(files).enumerate() {
        if let Some(flip) = briefing.flip.as_ref().filter(|_| index > 0) {
            let how = words.say(&format!("flip_{flip}"), &[]);
            rows.push(SheetRow::Turn(words.say("turn_now", &[("how", how)])));
        }
        for file in files {
            number += 1;
            let used = || file.bits.iter().filter_map(|bit| side.tools.get(*bit as usize));
            let numbers = || file.numbers.iter().copied();
            let time: Option<f64> = used().map(|tool| tool.time_s).sum();
            let own_side = (!side.side.is_empty()).then(|| words.word(&side.side));
            rows.push(SheetRow::File(vec![
                vec![number.to_string()],
                vec![file.name.clone()],
                own_side.into_iter().collect(),
                listed(numbers().zip(used().map(|tool| operations(words, tool)))),
                listed(numbers().zip(used().map(|tool| tool.tool.title(words.language)))),
                time.map(time_text).into_iter().collect(),
            ]));
        }
    }
    rows
}

fn operations(words: &Words<'_>, tool: &ToolBriefing) -> String {
    let said: Vec<String> = tool.operations.iter().map(|word| words.word(word)).collect();
    said.join(", ")
}

/// One item per line, with tool numbers if there are several.
fn listed(items: impl Iterator<Item = (u32, String)>) -> Vec<String> {
    let items: Vec<(u32, String)> = items.collect();
    let one = items.len() < 2;
    items.into_iter().map(|(number, item)| if one { item } else { format!("T{number} {item}") }).collect()
}

fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            _ => out.push(letter),
        }
    }
    out
}
