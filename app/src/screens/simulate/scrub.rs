//! Two sliders for the time: a coarse one for the whole job with bands, and a fine one of ± 1 %.
//!
//! ```text
//! coarse  [==T1===|##T2######|==T3==]
//! fine          [ . . | . . ]      ± 1 % around the current time
//! ```

use super::bands;
use crate::format::clock;
use crate::i18n::{say, t};
use crate::model::PlayEvent;
use crate::page::{board, read, send};
use leptos::ev;
use leptos::html::{self, div, input, label, span};
use leptos::prelude::*;

fn in_words() -> String {
    let hole = board::moment().map_or(0, |now| now.holes_done);
    say!(
        "page.simulate.spoken",
        now = clock(read(|m| m.play.at_s)),
        total = clock(read(|m| m.play.total_s())),
        hole = hole
    )
}

pub(super) fn coarse() -> impl IntoView {
    div().class("scrub").child((
        bands::shown(),
        bands::wrong(),
        slider(t!("page.simulate.coarse"), move || (0.0, read(|m| m.play.total_s())), |_| ()),
    ))
}

/// ± 1 % around the current time. While it is held, around the time where the drag started.
pub(super) fn fine() -> impl IntoView {
    let (middle_s, held) = (RwSignal::new(0.0), RwSignal::new(false));
    Effect::new(move |_| {
        let at_s = read(|m| m.play.at_s);
        if !held.get() {
            middle_s.set(at_s);
        }
    });
    let range = move || {
        let reach_s = read(|m| m.play.total_s()) * 0.01;
        ((middle_s.get() - reach_s).max(0.0), (middle_s.get() + reach_s).min(read(|m| m.play.total_s())))
    };
    label().class("row grow").child((
        span().class("quiet").child(t!("page.simulate.fine_label")),
        div().class("grow").child(slider(t!("page.simulate.fine"), range, move |on| held.set(on))),
    ))
}

/// Sets the limits before the value, because the browser clamps the value to them. `hold` is called at start
/// and end of a drag.
fn slider(
    name: impl Fn() -> String + Send + Sync + 'static,
    range: impl Fn() -> (f64, f64) + Copy + Send + Sync + 'static,
    hold: impl Fn(bool) + Copy + 'static,
) -> impl IntoView {
    let element = NodeRef::<html::Input>::new();
    Effect::new(move |_| {
        let ((min_s, max_s), at_s) = (range(), read(|m| m.play.at_s));
        let Some(element) = element.get() else { return };
        element.set_min(&min_s.to_string());
        element.set_max(&max_s.to_string());
        element.set_value(&at_s.to_string());
    });
    input()
        .node_ref(element)
        .attr("type", "range")
        .attr("aria-label", name)
        .attr("aria-valuetext", in_words)
        .attr("step", "any")
        .on(ev::change, move |_| hold(false))
        .on(ev::input, move |event| {
            hold(true);
            if let Ok(at_s) = event_target_value(&event).parse() {
                send(PlayEvent::Hold { at_s });
            }
        })
}
