//! The Lab's changes to the machine, and why they are rejected.

use crate::i18n::{advice, message, say};
use crate::lab::LabEdits;
use crate::model::LinkEvent;
use crate::model::link::Notice;
use crate::page::{lab, link, send, shared, watch};
use crate::widgets::change_bar;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{self, Value};
use annulus_core::wire::Ask;
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
    let refusal = move || {
        let refusal = refused
            .with(|diagnostics| diagnostics.first().cloned())
            .or_else(|| watch(|m| &m.link.refused).get());
        match refusal {
            Some(why) => Some(format!("{} {}", message(&why), advice(&why))),
            None => (!sound()).then(|| say!("page.lab.unsound")),
        }
    };
    change_bar(
        staged,
        written,
        move || sound() && refused.with(Vec::is_empty),
        refusal,
        || lab::change(None, LabEdits::without_changes),
        move || {
            send(LinkEvent::Close { notice: Notice::Refused });
            link::ask(Ask::Configure { changes: staged.get_untracked() });
        },
    )
}
