//! Two sliders over the whole: a coarse one with a band for each operation and tool, and a fine one of a hundredth either way.
//!
//! ```text
//! coarse  [==T1===|##T2######|==T3==]
//! fine          [ . . | . . ]      ± 1 % of the time on show
//! ```
//!
//! Comes in: the playback. Goes out: the second on show.

use super::bands;
use crate::format::clock;
use crate::i18n::{say, t};
use crate::model::PlayEvent;
use crate::page::{Play, play, send};
use leptos::ev;
use leptos::html::{self, div, input, label, span};
use leptos::prelude::*;

fn in_words(play: Play) -> String {
    let hole = play.now().map_or(0, |now| now.holes_done);
    say!("page.simulate.spoken", now = clock(play.at_s.get()), total = clock(play.total_s()), hole = hole)
}

/// The whole.
pub(super) fn coarse() -> impl IntoView {
    let play = play();
    div().class("scrub").child((
        bands::shown(play),
        bands::wrong(play),
        slider(play, t!("page.simulate.coarse"), move || (0.0, play.total_s()), |_| ()),
    ))
}

/// A hundredth either way of the time on show; while it is held, of where it was taken.
pub(super) fn fine() -> impl IntoView {
    let play = play();
    let (middle_s, held) = (RwSignal::new(0.0), RwSignal::new(false));
    Effect::new(move |_| {
        let at_s = play.at_s.get();
        if !held.get() {
            middle_s.set(at_s);
        }
    });
    let range = move || {
        let reach_s = play.total_s() * 0.01;
        ((middle_s.get() - reach_s).max(0.0), (middle_s.get() + reach_s).min(play.total_s()))
    };
    label().class("row grow").child((
        span().class("quiet").child(t!("page.simulate.fine_label")),
        div().class("grow").child(slider(play, t!("page.simulate.fine"), range, move |on| held.set(on))),
    ))
}

/// Its bounds are set before its value, which the browser keeps within them; `hold` is told when it is taken and let go.
fn slider(
    play: Play,
    name: impl Fn() -> String + Send + Sync + 'static,
    range: impl Fn() -> (f64, f64) + Copy + Send + Sync + 'static,
    hold: impl Fn(bool) + Copy + 'static,
) -> impl IntoView {
    let element = NodeRef::<html::Input>::new();
    Effect::new(move |_| {
        let ((min_s, max_s), at_s) = (range(), play.at_s.get());
        let Some(element) = element.get() else { return };
        element.set_min(&min_s.to_string());
        element.set_max(&max_s.to_string());
        element.set_value(&at_s.to_string());
    });
    input()
        .node_ref(element)
        .attr("type", "range")
        .attr("aria-label", name)
        .attr("aria-valuetext", move || in_words(play))
        .attr("step", "any")
        .on(ev::change, move |_| hold(false))
        .on(ev::input, move |event| {
            hold(true);
            if let Ok(at_s) = event_target_value(&event).parse() {
                send(PlayEvent::Hold { at_s });
            }
        })
}
