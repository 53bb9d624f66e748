//! Two sliders over the whole: a coarse one with a band for each tool, and a fine one of a hundredth either way.
//!
//! ```text
//! coarse  [==T1===|##T2######|==T3==]
//! fine          [ . . | . . ]      ± 1 % around where it was taken
//! ```
//!
//! Comes in: the playback. Goes out: the second on show.

use crate::format::clock;
use crate::i18n::{language, say, t};
use crate::model::PlayEvent;
use crate::page::{Play, open_board, play, send};
use crate::screens::board::swatch;
use annulus_core::job::Cutter;
use annulus_core::units::Length;
use leptos::ev;
use leptos::html::{div, input, label, span};
use leptos::prelude::*;

fn in_words(play: Play) -> String {
    let hole = play.now().map_or(0, |now| now.holes_done);
    say!("page.simulate.spoken", now = clock(play.at_s.get()), total = clock(play.total_s()), hole = hole)
}

/// Stretches of the time with the same bit: bit and length in seconds.
fn bands(play: Play) -> Vec<(Option<u32>, f64)> {
    play.playback.with(|playback| {
        let Some(playback) = playback else { return Vec::new() };
        let mut bands: Vec<(Option<u32>, f64)> = Vec::new();
        let ends = playback.legs().iter().skip(1).map(|leg| leg.start_s).chain([playback.total_s()]);
        for (leg, end_s) in playback.legs().iter().zip(ends) {
            let length_s = end_s - leg.start_s;
            match bands.last_mut() {
                Some((bit, total_s)) if *bit == leg.bit => *total_s += length_s,
                _ => bands.push((leg.bit, length_s)),
            }
        }
        bands
    })
}

fn band(bit: Option<u32>, length_s: f64) -> impl IntoView {
    let tool = open_board().job.with(|job| job.as_ref()?.program.bits.get(bit? as usize).cloned());
    // Drills have the colour of the holes that they make.
    let drill = tool.as_ref().filter(|tool| tool.cutter == Cutter::Drill).map(|tool| tool.diameter);
    let size: Option<Length> = open_board().plan.with(|plan| {
        let bit = plan.as_ref()?.bits.iter().find(|bit| Some(bit.diameter) == drill)?;
        bit.sizes.first().copied()
    });
    let colour = open_board()
        .document
        .with(|document| document.as_ref().map(|document| swatch(&document.reading.board, size)));
    let name = move || tool.as_ref().map(|tool| tool.title(&language()));
    span()
        .style(("--span", format!("{length_s:.3}")))
        .style(("--swatch", colour.filter(|_| size.is_some()).unwrap_or_else(|| "transparent".to_owned())))
        .child(name)
}

/// The whole.
pub(super) fn coarse() -> impl IntoView {
    let play = play();
    div().class("scrub").child((
        div().class("bands").attr("aria-hidden", "true").child(move || {
            bands(play).into_iter().map(|(bit, length_s)| band(bit, length_s).into_any()).collect::<Vec<_>>()
        }),
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
    label().class("row").child((
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
