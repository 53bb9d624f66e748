//! The tool list: the tools, their wear, and the button for a new tool. `core` defines the fields of a line.

use crate::i18n::{self, key, say, t};
use crate::model::SettingsEvent;
use crate::model::rack::{self, DIAMETER, FORM, NUMBER, RACK_KEY};
use crate::model::settings::is_about;
use crate::page::{link, send, shared, watch};
use crate::screens::machine::words::wear_words;
use crate::widgets::{menu_word, push, push_if, refusal, typed_input};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{RackTool, TOOL_FIELDS, TOOL_FORMS, ToolWear};
use annulus_core::wire::Ask;
use leptos::ev;
use leptos::html::{self, caption, div, p, select, span, table, tbody, td, th, thead, tr};
use leptos::prelude::*;

fn column_name(column: &str) -> &'static str {
    match column {
        NUMBER => key!("page.tools.number"),
        FORM => key!("page.tools.form"),
        DIAMETER => key!("page.tools.diameter"),
        "tip" => key!("page.tools.tip"),
        "angle" => key!("page.tools.angle"),
        "down" => key!("page.tools.down"),
        "up" => key!("page.tools.up"),
        "run-out" => key!("page.tools.run_out"),
        "rpm" => key!("page.tools.rpm"),
        "life" => key!("page.tools.life"),
        _ => key!("page.tools.place"),
    }
}

fn form_name(form: &str) -> &'static str {
    match form {
        "mill" => key!("page.tools.mill"),
        "vee" => key!("page.tools.vee"),
        _ => key!("page.tools.drill"),
    }
}

fn named(name: &'static str) -> impl Fn() -> String + Copy {
    move || i18n::text(name, &[])
}

/// The columns before the wear; all others follow it.
const FIRST: [&str; 4] = [NUMBER, FORM, DIAMETER, "life"];
/// The slot of a magazine.
const PLACE: &str = "place";

/// The columns after the wear; only a machine with a magazine has slots.
fn others(has_magazine: bool) -> impl Iterator<Item = &'static str> {
    let words = TOOL_FIELDS.iter().map(|field| field.key).filter(|word| !FIRST.contains(word));
    words.filter(move |word| has_magazine || *word != PLACE)
}

/// True if the machine changes tools from a magazine, or will after Apply.
fn has_magazine() -> bool {
    let typed = watch(|m| &m.settings).with(|draft| draft.typed.get("rack.change").cloned());
    match typed {
        Some(word) => word == "magazine",
        None => shared(|m| &m.machine).with(|machine| machine.has_magazine()),
    }
}

pub(super) fn tools(refused: Memo<Vec<Diagnostic>>) -> impl IntoView {
    let lines = Memo::new(move |_| {
        let machine = shared(|m| &m.machine).get();
        watch(|m| &m.settings).with(|draft| draft.rack(&machine))
    });
    let count = Memo::new(move |_| lines.with(Vec::len));
    let why =
        Memo::new(move |_| refused.with(|found| found.iter().find(|why| is_about(why, RACK_KEY)).cloned()));
    let has_magazine = Memo::new(move |_| has_magazine());
    let rows = move || {
        let has_magazine = has_magazine.get();
        (0..count.get()).map(|row| line(lines, row, why, has_magazine).into_any()).collect::<Vec<_>>()
    };
    div().class("rack").child((
        div()
            .class("rack-scroll")
            .attr("tabindex", "0")
            .attr("role", "region")
            .attr("aria-label", t!("page.section.rack"))
            .child(table().class("rack-table").child((
                caption().class("unseen").child(t!("page.section.rack")),
                thead().child(move || head(has_magazine.get())),
                tbody().child(rows),
            ))),
        move || why.get().map(refusal),
        p().class("quiet").child(t!("page.tools.about")),
        push("button", t!("page.tools.add"), |_| send(SettingsEvent::AddTool)),
    ))
}

fn head(has_magazine: bool) -> AnyView {
    let of = |column: &'static str| th().attr("scope", "col").child(named(column_name(column))).into_any();
    tr().child((
        FIRST.map(of).into_iter().collect::<Vec<_>>(),
        th().attr("scope", "col").child(t!("page.tools.done")),
        others(has_magazine).map(of).collect::<Vec<_>>(),
        th().attr("scope", "col").child(span().class("unseen").child(t!("page.tools.acts"))),
    ))
    .into_any()
}

fn line(
    lines: Memo<Vec<String>>,
    row: usize,
    why: Memo<Option<Diagnostic>>,
    has_magazine: bool,
) -> impl IntoView {
    let now = Memo::new(move |_| lines.with(|lines| lines.get(row).cloned().unwrap_or_default()));
    let number = move || now.with(|line| rack::cell(line, NUMBER));
    let cell = |column: &'static str| td().child(entry(now, row, column, why)).into_any();
    let (first, others) = (FIRST.map(cell), others(has_magazine).map(cell).collect::<Vec<_>>());
    tr().child((
        first.into_iter().collect::<Vec<_>>(),
        td().child(div().class("rack-done").child((wear(now), new_tool(now)))),
        others,
        td().child(push(
            "button quiet small",
            move || say!("page.tools.remove", number = number()),
            move |_| send(SettingsEvent::RemoveTool { row }),
        )),
    ))
}

/// True if `why` is about this column of this line.
fn is_of_cell(why: &Diagnostic, line: &str, column: &str) -> bool {
    let is = |wanted: &str, own: &str| why.args.iter().any(|(name, value)| name == wanted && value == own);
    is("line", line) && is("word", column)
}

/// An editable cell.
fn entry(now: Memo<String>, row: usize, column: &'static str, why: Memo<Option<Diagnostic>>) -> AnyView {
    let value = move || now.with(|line| rack::cell(line, column));
    let write = move |text: String| send(SettingsEvent::TypeTool { row, column, text });
    let name = move || {
        let number = now.with(|line| rack::cell(line, NUMBER));
        say!("page.tools.cell", number = number, column = i18n::text(column_name(column), &[]))
    };
    if column == FORM {
        let words = TOOL_FORMS.map(|form| menu_word(form, move || value() == form, named(form_name(form))));
        let menu =
            select().attr("aria-label", name).on(ev::change, move |event| write(event_target_value(&event)));
        return menu.child(words.into_iter().collect::<Vec<_>>()).into_any();
    }
    let shape = ["tip", "angle"].contains(&column);
    let has = move || !shape || now.with(|line| rack::cell(line, FORM)) == TOOL_FORMS[2];
    let is_wrong = move || {
        why.with(|why| why.as_ref().is_some_and(|why| now.with(|line| is_of_cell(why, line, column))))
    };
    typed_input("decimal", move || i18n::number(value()), is_wrong)
        .attr("aria-label", name)
        .prop("disabled", move || !has())
        .on(ev::change, move |event| write(event_target_value(&event)))
        .into_any()
}

fn worn(line: &str) -> Option<(RackTool, ToolWear)> {
    let tool = RackTool::read(line).ok()?;
    let machine = shared(|m| &m.machine).with(|machine| machine.name.clone());
    let wear = watch(|m| &m.link.tools).with(|report| ToolWear::of(&report.wear, &machine, &tool));
    Some((tool, wear))
}

fn wear(now: Memo<String>) -> impl IntoView {
    let said = Memo::new(move |_| now.with(|line| worn(line)));
    let share = move || said.with(|said| said.as_ref().and_then(|(tool, wear)| wear.share(tool.life)));
    let words = move || {
        said.with(|said| said.as_ref().map(|(tool, wear)| wear_words(tool, wear)).unwrap_or_default())
    };
    let bar = move || {
        share().map(|share| {
            html::progress()
                .class(if share >= 1.0 { "wear over" } else { "wear" })
                .attr("aria-label", t!("page.tools.done"))
                .attr("max", "1")
                .prop("value", share.min(1.0))
        })
    };
    div().class("rack-wear").child((bar, span().child(words)))
}

/// The button that resets the wear: a new tool is in.
fn new_tool(now: Memo<String>) -> impl IntoView {
    let used = Memo::new(move |_| {
        now.with(|line| worn(line))
            .filter(|(_, wear)| wear.hits + wear.milled_um > 0)
            .map(|(tool, _)| tool.number)
    });
    let may = move || link::may_act() && used.get().is_some();
    push_if("button small", may, t!("page.tools.new"), move |_| {
        if let Some(number) = used.get_untracked() {
            link::ask(Ask::NewTool { number });
        }
    })
}
