//! The page's own settings: preferences for all screens, data saved in this browser, and version information.

use super::names::group_name;
use crate::i18n::{self, key, say, t};
use crate::model::KeepEvent;
use crate::model::address::OWN_SECTIONS;
use crate::page::{read, send, watch};
use crate::screens::top_bar::{languages, themes, units};
use crate::screens::welcome;
use crate::widgets::push_if;
use leptos::ev;
use leptos::html::{dd, div, dl, dt, form, h2, h3, input, label, li, p, section, span, ul};
use leptos::prelude::*;

fn name(section: &str) -> &'static str {
    match section {
        "general" => key!("page.settings.general"),
        "data" => key!("page.data.title"),
        _ => key!("page.about.title"),
    }
}

/// The group of the page's own settings.
pub(super) fn page() -> impl IntoView {
    let sections = OWN_SECTIONS.map(|section| {
        let title = h3().child(move || i18n::text(name(section), &[]));
        div().class("setting-part").child((title, body(section))).into_any()
    });
    (
        h2().child(|| group_name(None)),
        p().class("quiet").child(t!("page.settings.page_about")),
        Vec::from(sections),
    )
}

fn body(section: &str) -> AnyView {
    match section {
        "general" => general().into_any(),
        "data" => data().into_any(),
        _ => about().into_any(),
    }
}

fn general() -> impl IntoView {
    let field =
        |name: fn() -> String, menu: AnyView| label().class("field").child((span().child(name), menu));
    div().class("own-settings").child((
        div().class("row").child((
            field(|| say!("page.language_title"), languages().into_any()),
            field(|| say!("page.unit.title"), units().into_any()),
            field(|| say!("page.theme.title"), themes().into_any()),
        )),
        super::signs(),
    ))
}

/// Data saved in this browser: projects to restore or delete, their size, and deleting everything.
fn data() -> impl IntoView {
    send(KeepEvent::Listed);
    let size = move || {
        let bytes = read(|m| m.keeping.bytes)?;
        let mb = i18n::number(format!("{:.1}", bytes as f64 / 1e6));
        Some(p().child(say!("page.data.size", mb = mb)))
    };
    let boards = move || {
        let offers = watch(|m| &m.keeping.offers).get();
        let rows = offers.into_iter().map(|offer| li().child(welcome::kept(offer, None)).into_any());
        let rows: Vec<_> = rows.collect();
        if rows.is_empty() {
            p().class("quiet").child(say!("page.data.none")).into_any()
        } else {
            ul().attr("aria-label", t!("page.data.boards")).child(rows).into_any()
        }
    };
    let drawings = move || {
        let count = read(|m| m.draw.earlier().len());
        (count > 0).then(|| p().child(say!("page.data.drawings", count = count)))
    };
    div().class("own-settings").child((p().child(t!("page.data.is")), size, boards, drawings, forget()))
}

/// Deletes all saved data; the user must type a word first.
fn forget() -> impl IntoView {
    let typed = RwSignal::new(String::new());
    let is_meant = move || typed.get().trim().to_uppercase() == say!("page.data.word");
    let field = input()
        .attr("type", "text")
        .attr("autocomplete", "off")
        .attr("autocapitalize", "off")
        .prop("value", typed)
        .on(ev::input, move |event| typed.set(event_target_value(&event)));
    let press = move |_| {
        typed.set(String::new());
        send(KeepEvent::DropAll);
    };
    section().class("forget").attr("aria-label", t!("page.data.delete")).child(
        form().on(ev::submit, |event| event.prevent_default()).class("row").child((
            label()
                .class("field grow")
                .child((span().child(move || say!("page.data.type", word = say!("page.data.word"))), field)),
            push_if("button danger", is_meant, t!("page.data.delete"), press),
        )),
    )
}

fn about() -> impl IntoView {
    let row = |name: fn() -> String, value: AnyView| (dt().child(name), dd().child(value));
    let network = move || {
        let words = read(|m| m.frame.network.words(m.frame.alone));
        words.map_or_else(|| say!("page.network.works_is"), |[_, meaning]| i18n::text(meaning, &[]))
    };
    let draws =
        move || read(|m| m.frame.backend).map_or_else(|| "–".to_owned(), |word| i18n::text(word, &[]));
    dl().class("facts").child((
        row(|| say!("page.about.version"), env!("CARGO_PKG_VERSION").into_any()),
        row(|| say!("page.about.licence"), (move || say!("page.about.licence_is")).into_any()),
        row(|| say!("page.about.network"), network.into_any()),
        row(|| say!("page.about.draws"), draws.into_any()),
        row(|| say!("page.about.kept"), (move || say!("page.data.is")).into_any()),
    ))
}
