//! What the bench would change in the machine, why it cannot be, and the two buttons.
//!
//! Comes in: the bench and the machine. Goes out: `Configure`. Refused while the machine moves, and then it says so.

use crate::i18n::{advice, message, say, t};
use crate::lab::LabEdits;
use crate::model::LinkEvent;
use crate::page::open_board;
use crate::page::open_lab;
use crate::page::{link, send};
use crate::screens::settings::change_rows;
use crate::widgets::{push, push_if};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{self, Value};
use annulus_core::wire::Ask;
use leptos::html::{div, dl, p};
use leptos::prelude::*;

/// A table as people write it: bytes in hexadecimal, anything else as it is.
fn written(key: &str, value: &Value) -> String {
    match value {
        Value::Numbers(bytes) if key.ends_with(".phases") => {
            let words: Vec<_> = bytes.iter().map(|byte| format!("{:02X}", *byte as u8)).collect();
            words.join(" ")
        }
        other => other.to_string(),
    }
}

/// What the settings say to the changes.
pub(super) fn refusals(changes: &[(String, Value)]) -> Vec<Diagnostic> {
    open_board().machine.with(|machine| machine::apply(machine, changes)).err().unwrap_or_default()
}

/// The bar; shown while there is something to apply. `sound` says that the sheet itself finds nothing wrong.
pub(super) fn apply(sound: impl Fn() -> bool + Copy + Send + Sync + 'static) -> impl IntoView {
    let (lab, line) = (open_lab(), link::link());
    let staged = Memo::new(move |_| {
        open_board().machine.with(|machine| lab.bench.with(|bench| bench.changes(machine)))
    });
    let refused = Memo::new(move |_| staged.with(|changes| refusals(changes)));
    let list = change_rows(staged, written);
    let why = move || {
        let refusal = refused.with(|diagnostics| diagnostics.first().cloned()).or_else(|| line.refused.get());
        match refusal {
            Some(why) => Some(format!("{} {}", message(&why), advice(&why))),
            None if !sound() => Some(say!("page.lab.unsound")),
            None if !line.may_act() => Some(say!("page.settings.needs_control")),
            None if line.busy() => Some(say!("page.settings.moving")),
            None => None,
        }
    };
    let may = move || sound() && refused.with(Vec::is_empty) && line.may_act() && !line.busy();
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
                        lab.change(None, LabEdits::without_changes);
                    }),
                    push_if("button primary", may, t!("page.settings.apply"), move |_| {
                        send(LinkEvent::Close { notice: link::Notice::Refused });
                        link::ask(Ask::Configure { changes: staged.get_untracked() });
                    }),
                ))
        })
    }
}
