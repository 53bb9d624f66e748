//! Timing quality of the bridge's clock on a real machine: text, and the histogram as a table.

use crate::i18n::{message, say, t};
use crate::page::shared;
use annulus_core::control::lateness::EDGES_US;
use leptos::html::{h3, p, table, tbody, td, th, thead, tr};
use leptos::prelude::*;

/// The histogram; nothing for a virtual drill or without a bridge.
pub(super) fn clock() -> impl IntoView {
    let timing = shared(|m| &m.link.timing);
    move || {
        timing.get().map(|timing| {
            let sentence = |found| p().child(move || message(&found));
            let sentences: Vec<_> = timing.diagnostics().into_iter().map(sentence).collect();
            let last = timing.lateness.bars.iter().rposition(|count| *count > 0).unwrap_or(0);
            let row = |(index, count): (usize, &u32)| {
                let edge = EDGES_US.get(index).copied();
                let late = move || match edge {
                    Some(us) => say!("page.settings.clock_edge", us = us),
                    None => say!("page.settings.clock_later"),
                };
                tr().child((th().attr("scope", "row").child(late), td().child(count.to_string())))
            };
            let rows: Vec<_> = timing.lateness.bars.iter().take(last + 1).enumerate().map(row).collect();
            let head = tr().child((
                th().attr("scope", "col").child(t!("page.settings.clock_late")),
                th().attr("scope", "col").child(t!("page.settings.clock_beats")),
            ));
            let bars = table().child((thead().child(head), tbody().child(rows)));
            (h3().child(t!("page.settings.clock")), sentences, bars)
        })
    }
}
