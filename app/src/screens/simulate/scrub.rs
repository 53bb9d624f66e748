//! Two sliders over the whole: a coarse one with a band for each operation and tool, and a fine one of a hundredth either way.
//!
//! ```text
//! coarse  [==T1===|##T2######|==T3==]
//! fine          [ . . | . . ]      ± 1 % around where it was taken
//! ```
//!
//! Comes in: the playback. Goes out: the second on show.

use super::bands;
use crate::format::clock;
use crate::i18n::{say, t};
use crate::model::PlayEvent;
use crate::page::{Play, play, send};
use leptos::ev;
use leptos::html::{div, input, label, span};
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
        slider(play, t!("page.simulate.coarse"), move || (0.0, play.total_s())),
    ))
}

/// A hundredth either way of where it was when the coarse one was let go.
pub(super) fn fine() -> impl IntoView {
    let play = play();
    let middle_s = RwSignal::new(0.0);
    Effect::new(move |_| {
        let at_s = play.at_s.get();
        if (at_s - middle_s.get_untracked()).abs() > play.total_s() * 0.01 {
            middle_s.set(at_s);
        }
    });
    let range = move || {
        let total_s = play.total_s();
        ((middle_s.get() - total_s * 0.01).max(0.0), (middle_s.get() + total_s * 0.01).min(total_s))
    };
    label().class("row grow").child((
        span().class("quiet").child(t!("page.simulate.fine_label")),
        div().class("grow").child(slider(play, t!("page.simulate.fine"), range)),
    ))
}

fn slider(
    play: Play,
    name: impl Fn() -> String + Send + Sync + 'static,
    range: impl Fn() -> (f64, f64) + Copy + Send + Sync + 'static,
) -> impl IntoView {
    input()
        .attr("type", "range")
        .attr("aria-label", name)
        .attr("aria-valuetext", move || in_words(play))
        .attr("min", move || range().0.to_string())
        .attr("max", move || range().1.to_string())
        .attr("step", "any")
        .prop("value", move || {
            range();
            play.at_s.get().to_string()
        })
        .on(ev::input, move |event| {
            if let Ok(at_s) = event_target_value(&event).parse() {
                send(PlayEvent::Hold { at_s });
            }
        })
}
