//! The search of the settings: by name, key, help, section and group, in the page's language.

use super::field;
use super::names::{group_name, section_name};
use crate::i18n::{self, key, say, t};
use crate::keys::is_escape;
use crate::model::address::PAGE_GROUP;
use crate::model::settings::is_found;
use crate::model::{FrameEvent, SettingsEvent};
use crate::page::{read, send, shared, watch};
use crate::widgets::push;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Group, SECTIONS, Section, Setting, ValueKind};
use leptos::ev;
use leptos::html::{div, h2, input, p};
use leptos::prelude::*;

/// Fields shown at once.
const MOST: usize = 30;

/// Settings without a row in the machine's table: the key of the name, the group, and whether only a
/// controller that plans its own motion has it.
const OTHERS: [(&str, Option<Group>, bool); 11] = [
    (key!("page.settings.mill"), Some(Group::Machine), true),
    (key!("page.opening.title"), Some(Group::Machine), true),
    (key!("page.changer.title"), Some(Group::Tools), true),
    (key!("page.section.rack"), Some(Group::Tools), false),
    (key!("page.lengths.title"), Some(Group::Probing), true),
    (key!("page.language_title"), None, false),
    (key!("page.unit.title"), None, false),
    (key!("page.theme.title"), None, false),
    (key!("page.settings.signs"), None, false),
    (key!("page.data.title"), None, false),
    (key!("page.about.title"), None, false),
];

/// What a search finds: settings by key, and others by their index.
#[derive(Clone, Debug, PartialEq)]
struct Found {
    settings: Vec<&'static str>,
    others: Vec<usize>,
}

pub(super) fn seek(text: String) {
    send(SettingsEvent::Seek { text });
}

pub(super) fn search() -> impl IntoView {
    let text = Memo::new(move |_| watch(|m| &m.settings).with(|draft| draft.sought.clone()));
    // Escape also pauses a machine that moves, so its event is not stopped.
    let cleared = |event: web_sys::KeyboardEvent| {
        if is_escape(&event.key()) && !event.is_composing() {
            seek(String::new());
        }
    };
    input()
        .attr("type", "search")
        .attr("autocomplete", "off")
        .attr("spellcheck", "false")
        .attr("aria-label", t!("page.settings.search"))
        .attr("placeholder", t!("page.settings.search"))
        .prop("value", move || text.get())
        .on(ev::input, |event| seek(event_target_value(&event)))
        .on(ev::keydown, cleared)
}

pub(super) fn found(sought: Memo<String>, refused: Memo<Vec<Diagnostic>>) -> impl IntoView {
    let found = Memo::new(move |_| sought.with(|sought| look(sought)));
    let count = move || {
        let count = found.with(|found| found.settings.len() + found.others.len());
        if count == 0 {
            say!("page.settings.none_found", text = sought.get())
        } else {
            say!("page.settings.found", count = count)
        }
    };
    let others = move || found.get().others.into_iter().map(other).collect::<Vec<_>>();
    let fields = move || {
        let shown = found.get().settings.into_iter().take(MOST);
        shown.filter_map(|key| result(key, refused)).collect::<Vec<_>>()
    };
    let more = move || {
        let more = found.with(|found| found.settings.len().saturating_sub(MOST));
        (more > 0).then(|| p().class("quiet").child(say!("page.settings.more", count = more)))
    };
    (
        h2().child(t!("page.settings.results")),
        p().class("quiet").attr("role", "status").child(count),
        div().class("row").child(others),
        div().class("setting-grid").child(fields),
        more,
    )
}

/// The settings whose name or key fits come first.
fn look(sought: &str) -> Found {
    let plans = read(|m| m.link.controller.plans());
    let machine = shared(|m| &m.machine).get();
    let (mut settings, mut by_help) = (Vec::new(), Vec::new());
    for (section, setting) in rows().filter(|(_, setting)| setting.is_used(&machine, plans)) {
        let mut texts = vec![i18n::text(&setting.name_key(), &[]), setting.key.to_owned()];
        if is_found(sought, &texts) {
            settings.push(setting.key);
            continue;
        }
        texts.push(i18n::text(&setting.help_key(), &[]));
        texts.push(section_name(section.name));
        texts.push(group_name(Some(setting.group(section.group))));
        if is_found(sought, &texts) {
            by_help.push(setting.key);
        }
    }
    settings.extend(by_help);
    let is_other = |(name, group, is_of_controller): &(&str, Option<Group>, bool)| {
        (plans || !is_of_controller) && is_found(sought, &[i18n::text(name, &[]), group_name(*group)])
    };
    let others = OTHERS.iter().enumerate().filter(|(_, other)| is_other(other)).map(|(index, _)| index);
    Found { settings, others: others.collect() }
}

fn rows() -> impl Iterator<Item = (&'static Section, &'static Setting)> {
    let all = SECTIONS.iter().flat_map(|section| section.rows.iter().map(move |row| (section, row)));
    all.filter(|(_, row)| row.kind != ValueKind::Tools)
}

/// A field with its group and section above it.
fn result(key: &'static str, refused: Memo<Vec<Diagnostic>>) -> Option<AnyView> {
    let (section, setting) = rows().find(|(_, row)| row.key == key)?;
    let group = Some(setting.group(section.group));
    let place =
        move || say!("page.settings.place", group = group_name(group), section = section_name(section.name));
    Some(
        div()
            .class("found-setting")
            .child((p().class("quiet").child(place), field::field(setting, refused)))
            .into_any(),
    )
}

/// A button to a setting that has no field here.
fn other(index: usize) -> AnyView {
    let (name, group, _) = OTHERS[index];
    let text =
        move || say!("page.settings.place", group = group_name(group), section = i18n::text(name, &[]));
    push("button", text, move |_| {
        send(FrameEvent::Section { section: group.map_or(PAGE_GROUP, Group::word) });
        seek(String::new());
    })
    .into_any()
}
