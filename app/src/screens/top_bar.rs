//! The top bar: board, screens, units, language, connection, and STOP with free space around it.

use crate::format::Unit;
use crate::i18n::{self, key, say, t};
use crate::keys::Tab;
use crate::model::Theme;
use crate::model::{FrameEvent, Overlay};
use crate::page::{board, computed, read, send, shared, watch};
use crate::screens::machine::words;
use crate::screens::machines;
use crate::widgets::{Icon, icon, menu_word, stop_zone};
use annulus_core::{locale, machine};
use leptos::ev;
use leptos::html::{button, div, header, nav, select, span, strong};
use leptos::prelude::*;

pub(crate) fn name_of(tab: Tab) -> String {
    i18n::text(tab.name(), &[])
}

pub(crate) fn top_bar() -> impl IntoView {
    window_title();
    header().class("top-bar").attr("id", "top").attr("tabindex", "-1").child((
        div().class("brand").child((icon(Icon::Annulus), strong().child(project))),
        machines::chip(),
        tabs(),
        div().class("top-tools").child((help(), units(), span().class("wide").child(themes()), languages())),
        connection(),
        stop_zone(),
    ))
}

fn help() -> impl IntoView {
    button()
        .attr("type", "button")
        .class("button icon quiet")
        .attr("aria-label", t!("page.help.title"))
        .attr("title", t!("page.help.title"))
        .attr("aria-keyshortcuts", "F1")
        .on(ev::click, |_| send(FrameEvent::Overlay { overlay: Some(Overlay::Help) }))
        .child("?")
}

fn project() -> String {
    computed(|m| m.title().map(str::to_owned)).get().unwrap_or_else(|| say!("page.name"))
}

fn window_title() {
    Effect::new(|_| {
        let own = say!("page.name");
        let title = computed(|m| m.title().map(str::to_owned)).get();
        document().set_title(&title.map_or_else(|| own.clone(), |title| format!("{title} – {own}")));
    });
}

fn tabs() -> impl IntoView {
    let buttons = Tab::ALL.into_iter().enumerate().map(|(index, this)| {
        let chosen = move || read(|m| m.frame.tab) == this;
        let to_fix = Memo::new(move |_| Some(board::to_fix(this)).filter(|count| *count > 0));
        // The style sheet draws the number next to the word.
        let spoken =
            move || to_fix.get().map(|count| say!("page.tab.to_fix", name = name_of(this), count = count));
        button()
            .attr("type", "button")
            .class("tab")
            .attr("data-count", move || to_fix.get().map(of_two_digits))
            .attr("aria-label", spoken)
            .attr("title", spoken)
            .attr("aria-current", move || chosen().then_some("page"))
            .on(ev::click, move |_| send(FrameEvent::Show { tab: this }))
            .child((
                leptos::html::kbd().attr("aria-hidden", "true").child(index),
                span().child(move || name_of(this)),
            ))
    });
    nav().class("tabs").attr("aria-label", t!("page.tab.title")).child(buttons.collect::<Vec<_>>())
}

/// The number for the badge of a tab, at most two digits.
fn of_two_digits(count: usize) -> String {
    if count > 99 { "99+".to_owned() } else { count.to_string() }
}

pub(crate) fn units() -> impl IntoView {
    let choose = move |event| {
        let unit = if event_target_value(&event) == "inch" { Unit::Inch } else { Unit::Millimetre };
        send(FrameEvent::Units { unit: Some(unit) });
    };
    select().class("plain").attr("aria-label", t!("page.unit.title")).on(ev::change, choose).child((
        menu_word("mm", || read(|m| m.frame.unit == Unit::Millimetre), t!("page.unit.mm")),
        menu_word("inch", || read(|m| m.frame.unit == Unit::Inch), t!("page.unit.inch")),
    ))
}

fn theme_name(theme: Theme) -> &'static str {
    match theme {
        Theme::Auto => key!("page.theme.auto"),
        Theme::Light => key!("page.theme.light"),
        Theme::Dark => key!("page.theme.dark"),
        Theme::Contrast => key!("page.theme.contrast"),
    }
}

/// The colour theme. Small screens have it only in the settings.
pub(crate) fn themes() -> impl IntoView {
    let options = Theme::ALL.map(|this| {
        menu_word(
            this.word(),
            move || read(|m| m.frame.theme) == this,
            move || i18n::text(theme_name(this), &[]),
        )
    });
    select()
        .class("plain")
        .attr("aria-label", t!("page.theme.title"))
        .on(ev::change, |event| {
            send(FrameEvent::Colours { theme: Theme::called(&event_target_value(&event)) });
        })
        .child(Vec::from(options))
}

/// The languages by their own names. Small screens have it only in the settings.
pub(crate) fn languages() -> impl IntoView {
    let options = locale::languages().map(|(language, name)| {
        menu_word(language, move || i18n::language() == language, move || name.to_owned())
    });
    select()
        .class("plain")
        .attr("aria-label", t!("page.language_title"))
        .on(ev::change, |event| send(FrameEvent::Language { language: event_target_value(&event) }))
        .child(options.collect::<Vec<_>>())
}

fn connection() -> impl IntoView {
    let look = words::of;
    // If space is short, the name is cut and the state remains.
    let name =
        move || read(|m| m.link.ever).then(|| span().class("cut").child(format!("{}: ", machine_name())));
    let state = move || i18n::text(look().word, &[]);
    button()
        .attr("type", "button")
        .class(move || format!("chip {}", look().tone))
        .on(ev::click, |_| send(FrameEvent::Show { tab: Tab::Machine }))
        .child((
            span().class("dot").attr("aria-hidden", "true"),
            span().class("words").child((name, span().class("state").child(state))),
        ))
}

/// The machine's name; without one, a description of what is connected. A chosen machine that the page's
/// virtual drill plays is called simulated.
pub(super) fn machine_name() -> String {
    let name = shared(|m| &m.machine).with(|machine| machine.name.clone());
    if name != machine::VIRTUAL_NAME {
        let plays = read(|m| m.frame.alone && !m.link.controller.chosen && m.machines.chosen.is_some());
        return if plays { say!("page.machines.simulated", name = name) } else { name };
    }
    watch(|m| &m.link.controller).with(|controller| match &controller.who {
        _ if !controller.chosen => say!("page.virtual_drill"),
        _ if controller.is_adapter => say!("page.controller.adapter_word"),
        Some(who) => say!("page.controller.name", flavour = who.flavour, version = who.version),
        None => say!("page.controller.controller_word"),
    })
}
