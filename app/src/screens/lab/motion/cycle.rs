//! Table and spindles over time: what overlaps, what waits, and the time per hole. Changes nothing.

use crate::i18n::{say, t};
use crate::lab::cycle::{self, CycleShown};
use crate::page::shared;
use crate::readout::short;
use crate::screens::lab::fields::{self, Field};
use crate::widgets::{plotted, refusal};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::plot::{Plot, PlotAxis, PlotMark, PlotPanel, Series};
use leptos::html::{dd, div, dl, dt, h3, p, section};
use leptos::prelude::*;
use std::sync::Arc;

pub(super) fn cycle() -> impl IntoView {
    let hop = Field { name: "cycle.hop", unit: "mm", range: (0.0, 1000.0), own: Memo::new(|_| 5.0) };
    let found = Memo::new(move |_| match hop.number() {
        Some(mm) => shared(|m| &m.machine).with(|machine| cycle::shown(machine, mm)).map_err(Some),
        None => Err(None::<Diagnostic>),
    });
    let plot =
        Memo::new(move |_| Arc::new(found.with(|found| found.as_ref().map(drawn).unwrap_or_default())));
    let answer = move || match found.get() {
        Ok(shown) => numbers(shown).into_any(),
        Err(Some(why)) => refusal(why),
        Err(None) => fields::mend().into_any(),
    };
    let name = || t!("page.lab.cycle.title");
    div().class("lab-part").child(
        div().class("lab-columns").child((
            div().class("lab-inputs").child((
                section().class("block").child((
                    hop.view(t!("page.lab.cycle.hop")),
                    p().class("quiet").child(t!("page.lab.cycle.is")),
                )),
                section().class("block").attr("aria-live", "polite").child(answer),
            )),
            section()
                .class("block lab-plots")
                .attr("aria-label", name())
                .child((h3().child(name()), plotted(name(), plot, 460.0))),
        )),
    )
}

fn drawn(shown: &CycleShown) -> Plot {
    let time = PlotAxis::new(&say!("page.lab.motion.time"), "ms");
    let clear = PlotMark::Level(shown.clear_mm, say!("page.lab.cycle.clear"));
    let surface = PlotMark::Level(0.0, say!("page.lab.servo.surface"));
    let released = shown
        .cycles
        .iter()
        .skip(1)
        .map(|cycle| PlotMark::At(1000.0 * cycle.release_s, say!("page.lab.cycle.released")));
    let starts = shown.cycles.iter().filter_map(|cycle| cycle.spindles.first()).map(|stroke| stroke.start_s);
    let stops =
        shown.last_stop_s.into_iter().flat_map(|last_s| starts.clone().map(move |start_s| start_s + last_s));
    let stops = stops.map(|stop_s| PlotMark::At(1000.0 * stop_s, say!("page.lab.cycle.last_stop")));
    Plot {
        title: String::new(),
        panels: vec![
            PlotPanel {
                x: time.clone(),
                y: PlotAxis::new(&say!("page.lab.cycle.plane"), "mm/s"),
                series: vec![Series::line("", shown.speed.clone())],
                marks: released.collect(),
            },
            PlotPanel {
                x: time,
                y: PlotAxis::new(&say!("page.lab.cycle.tip"), "mm"),
                series: vec![Series::line("", shown.height.clone())],
                marks: [clear, surface].into_iter().chain(stops).collect(),
            },
        ],
    }
}

/// Holes per minute of one spindle, and of all if there are several.
fn per_minute(seconds: f64, spindles: u32) -> String {
    let one = 60.0 / seconds;
    if spindles == 1 {
        return short(one);
    }
    say!("page.lab.cycle.rate_all", one = short(one), all = short(f64::from(spindles) * one))
}

fn numbers(shown: CycleShown) -> impl IntoView {
    let fact = |name: fn() -> String, value: String| (dt().child(name), dd().child(value));
    let ms = |seconds: f64| format!("{} ms", short(1000.0 * seconds));
    let CycleShown { together_s, apart_s, last_stop_s, spindles, .. } = shown;
    let together = together_s.map(|together_s| {
        (
            fact(|| say!("page.lab.cycle.together"), ms(together_s)),
            fact(|| say!("page.lab.cycle.rate_together"), per_minute(together_s, spindles)),
        )
    });
    let own = together_s.is_none().then(|| p().class("quiet").child(t!("page.lab.cycle.own")));
    let facts = dl().class("facts").child((
        together,
        fact(|| say!("page.lab.cycle.apart"), ms(apart_s)),
        fact(|| say!("page.lab.cycle.rate_apart"), per_minute(apart_s, spindles)),
        last_stop_s.map(|last_s| fact(|| say!("page.lab.cycle.last_stop_is"), ms(last_s))),
    ));
    (own, facts)
}
