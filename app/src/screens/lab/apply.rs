//! The bar of changes to the machine: what would change, why it is rejected, and two buttons. Disabled while
//! the machine moves, with a text that explains it.

use crate::i18n::{advice, message, say, t};
use crate::lab::LabEdits;
use crate::model::LinkEvent;
use crate::model::link::Notice;
use crate::page::{lab, link, send, shared, watch};
use crate::screens::settings::change_rows;
use crate::widgets::{push, push_if};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{self, Value};
use annulus_core::wire::Ask;
use leptos::html::{div, dl, p};
use leptos::prelude::*;

/// The displayed value: phase tables as hexadecimal bytes.
fn written(key: &str, value: &Value) -> String {
    match value {
        Value::Numbers(bytes) if key.ends_with(".phases") => {
            let words: Vec<_> = bytes.iter().map(|byte| format!("{:02X}", *byte as u8)).collect();
            words.join(" ")
        }
        other => other.to_string(),
    }
}

/// Why the machine's settings reject the changes.
pub(super) fn refusals(changes: &[(String, Value)]) -> Vec<Diagnostic> {
    shared(|m| &m.machine).with(|machine| machine::apply(machine, changes)).err().unwrap_or_default()
}

/// The bar; hidden if there is nothing to apply. `sound` is true if the panel itself finds no error.
pub(super) fn apply(sound: impl Fn() -> bool + Copy + Send + Sync + 'static) -> impl IntoView {
    let staged = Memo::new(move |_| {
        shared(|m| &m.machine).with(|machine| shared(|m| &m.lab.bench).with(|bench| bench.changes(machine)))
    });
    let refused = Memo::new(move |_| staged.with(|changes| refusals(changes)));
    let list = change_rows(staged, written);
    let why = move || {
        let refusal = refused
            .with(|diagnostics| diagnostics.first().cloned())
            .or_else(|| watch(|m| &m.link.refused).get());
        match refusal {
            Some(why) => Some(format!("{} {}", message(&why), advice(&why))),
            None if !sound() => Some(say!("page.lab.unsound")),
            None if !link::may_act() => Some(say!("page.settings.needs_control")),
            None if link::busy() => Some(say!("page.settings.moving")),
            None => None,
        }
    };
    let may = move || sound() && refused.with(Vec::is_empty) && link::may_change();
    move || {
        (!staged.with(Vec::is_empty)).then(|| {
            div()
                .class("diff-bar")
                .attr("role", "group")
                .attr("aria-label", t!("page.settings.changes"))
                .child((
                    dl().class("facts grow lab-changes").attr("tabindex", "0").child(list),
                    p().class("quiet lab-why").attr("role", "status").child(why),
                    push("button", t!("page.settings.discard"), move |_| {
                        lab::change(None, LabEdits::without_changes);
                    }),
                    push_if("button primary", may, t!("page.settings.apply"), move |_| {
                        send(LinkEvent::Close { notice: Notice::Refused });
                        link::ask(Ask::Configure { changes: staged.get_untracked() });
                    }),
                ))
        })
    }
}
