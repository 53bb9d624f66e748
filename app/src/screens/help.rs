//! Help: the keyboard shortcuts, the first steps from a file to a board, and a glossary.

use crate::i18n::{self, key, t};
use crate::keys::{HAND_KEYS, SHORTCUTS, Tab};
use crate::model::{FrameEvent, Overlay};
use crate::page::{read, send, written};
use crate::screens::top_bar::name_of;
use crate::widgets::{Dialog, dialog, push};
use leptos::html::{dd, div, dl, dt, h3, kbd, li, ol, p, section, span};
use leptos::prelude::*;

const STEPS: [&str; 5] = [
    key!("page.help.step_open"),
    key!("page.help.step_cam"),
    key!("page.help.step_simulate"),
    key!("page.help.step_machine"),
    key!("page.help.step_start"),
];

const WORDS: [(&str, &str); 6] = [
    (key!("page.help.home"), key!("page.help.home_is")),
    (key!("page.help.zero"), key!("page.help.zero_is")),
    (key!("page.help.isolate"), key!("page.help.isolate_is")),
    (key!("page.help.bit"), key!("page.help.bit_is")),
    (key!("page.help.travel"), key!("page.help.travel_is")),
    (key!("page.help.proof"), key!("page.help.proof_is")),
];

fn word(key: &'static str) -> impl Fn() -> String + Send + Sync + 'static {
    move || i18n::text(key, &[])
}

fn keys_of(tab: Option<Tab>) -> impl IntoView {
    let rows = SHORTCUTS.iter().filter(move |shortcut| shortcut.tab == tab);
    let rows = rows.map(|shortcut| {
        li().child((kbd().child(move || written(shortcut)), span().child(word(shortcut.name)))).into_any()
    });
    let title = move || tab.map_or_else(|| i18n::text(key!("page.help.everywhere"), &[]), name_of);
    section().child((h3().child(title), ol().class("keys").child(rows.collect::<Vec<_>>())))
}

/// The jog keys, which work only while armed.
fn by_hand() -> impl IntoView {
    let rows = HAND_KEYS.map(|row| li().child((kbd().child(row.written), span().child(word(row.name)))));
    let hint = p().class("quiet").child(t!("page.jog.keys_hint"));
    section().child((h3().child(t!("page.help.by_hand")), ol().class("keys").child(Vec::from(rows)), hint))
}

fn close() {
    send(FrameEvent::Overlay { overlay: None });
}

pub(super) fn help() -> impl IntoView {
    // The shortcuts for every screen first, then those of each screen.
    let screens = Tab::ALL.into_iter().map(Some).filter(|tab| SHORTCUTS.iter().any(|one| one.tab == *tab));
    let groups = std::iter::once(None).chain(screens).map(|tab| keys_of(tab).into_any());
    let groups = groups.chain(std::iter::once_with(|| by_hand().into_any())).collect::<Vec<_>>();
    let steps = STEPS.map(|step| li().child(word(step)));
    let words = WORDS.map(|(name, meaning)| (dt().child(word(name)), dd().child(word(meaning))));
    let body = div().class("help").tabindex("0").child((
        section().child((h3().child(t!("page.help.steps")), ol().class("steps").child(Vec::from(steps)))),
        div().class("key-groups").child(groups),
        section().child((h3().child(t!("page.help.words")), dl().child(Vec::from(words)))),
    ));
    dialog(
        Signal::derive(move || read(|m| m.frame.overlay == Some(Overlay::Help))),
        close,
        Dialog {
            name: "help",
            role: "dialog",
            title: Box::new(t!("page.help.title")),
            body: body.into_any(),
            foot: push("button primary", t!("page.close"), |_| close()).into_any(),
        },
    )
}
