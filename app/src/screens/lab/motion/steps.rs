//! A move with the dynamics table: its speed over time, the limit above which steps are lost, and its steps.

use super::{Shown, axes};
use crate::i18n::{say, t};
use crate::lab::motion::{self, Numbered};
use crate::page::{read, shared};
use crate::readout::short;
use crate::screens::lab::fields;
use crate::widgets::{Icon, icon, plotted};
use annulus_core::plot::{Plot, PlotAxis, PlotMark, PlotPanel, Series, SeriesLook};
use leptos::html::{code, div, h3, p, section, span};
use leptos::prelude::*;
use std::sync::Arc;

/// Maximum number of listed steps; the plot has all.
const LISTED: usize = 400;

pub(super) fn steps(shown: Shown) -> impl IntoView {
    let moved = Memo::new(move |_| {
        let distance = shown.steps.number()? as i64;
        let table = shown.table.get()?;
        Some(motion::steps(&table, distance))
    });
    let plot = Memo::new(move |_| {
        let (moved, interrupt_hz) =
            (moved.get().unwrap_or_default(), shown.interrupts.number().unwrap_or(1.0));
        Arc::new(drawn(&moved, interrupt_hz))
    });
    section().class("block lab-plots").attr("aria-label", t!("page.lab.motion.speed")).child((
        h3().child(t!("page.lab.motion.speed")),
        move || warning(shown),
        plotted(t!("page.lab.motion.speed"), plot, 460.0),
        h3().child(t!("page.lab.motion.takts")),
        move || match moved.get() {
            Some(moved) => list(&moved, shown.interrupts.number()).into_any(),
            None => fields::mend().into_any(),
        },
    ))
}

/// The warning that the table's shortest period is too fast for the motor.
fn warning(shown: Shown) -> Option<impl IntoView> {
    let most_hz = read(|m| f64::from(m.machine.max_step_hz));
    let fastest = shown.table.with(|table| table.as_ref()?.period.iter().min().copied())?;
    let rate_hz = shown.interrupts.number()? / f64::from(fastest.max(1));
    (rate_hz > most_hz).then(|| {
        p().class("notice tone-alarm").attr("role", "status").child((
            icon(Icon::Warning),
            span().child(t!("page.lab.motion.steps_lost", rate = short(rate_hz), most = short(most_hz))),
        ))
    })
}

fn drawn(moved: &[Numbered], interrupt_hz: f64) -> Plot {
    let machine = shared(|m| &m.machine).get();
    let rates = motion::rates(moved, interrupt_hz);
    let time = PlotAxis::new(&say!("page.lab.motion.time"), "s");
    let speeds = axes().into_iter().enumerate().map(|(axis, name)| {
        let per_mm = machine.axis(axis).scale.steps_per_mm();
        let points = rates.iter().map(|[at, rate]| [*at, rate / per_mm]).collect();
        Series::line(&name, points).looking(SeriesLook::Stairs)
    });
    let most_hz = f64::from(machine.max_step_hz);
    let lost = PlotMark::Level(most_hz, say!("page.lab.motion.lost_line", most = short(most_hz)));
    let top = rates.iter().map(|point| point[1]).fold(most_hz, f64::max) * 1.08;
    let near = most_hz < 4.0 * rates.iter().map(|point| point[1]).fold(1.0, f64::max);
    Plot {
        title: String::new(),
        panels: vec![
            PlotPanel {
                x: time.clone(),
                y: PlotAxis {
                    range: near.then_some([0.0, top]),
                    ..PlotAxis::new(&say!("page.lab.motion.takt_rate"), &say!("page.lab.motion.takts_per_s"))
                },
                series: vec![Series::line("", rates.clone()).looking(SeriesLook::Stairs)],
                marks: if near { vec![lost] } else { Vec::new() },
            },
            PlotPanel {
                x: time.clone(),
                y: PlotAxis::new(&say!("page.lab.motion.axis_speed"), "mm/s"),
                series: speeds.collect(),
                marks: Vec::new(),
            },
            PlotPanel {
                x: time,
                y: PlotAxis::new(&say!("page.lab.motion.state"), ""),
                series: vec![
                    Series::line("", motion::states(moved, interrupt_hz)).looking(SeriesLook::Stairs),
                ],
                marks: Vec::new(),
            },
        ],
    }
}

fn list(moved: &[Numbered], interrupt_hz: Option<f64>) -> impl IntoView {
    let total = moved.last().map_or(0, |(at, _)| *at);
    let seconds = short(total as f64 / interrupt_hz.unwrap_or(1.0));
    let words: Vec<_> = moved.iter().take(LISTED).map(|(at, _)| at.to_string()).collect();
    let cut = (moved.len() > LISTED)
        .then(|| p().class("quiet").child(t!("page.lab.motion.more_takts", listed = LISTED)));
    let count = moved.len();
    let end = moved.last().map_or(0, |(_, step)| step.position);
    div().class("takts").child((
        p().child(t!(
            "page.lab.motion.took",
            takts = count,
            interrupts = total,
            seconds = seconds,
            end = end
        )),
        code().class("tabular").attr("tabindex", "0").child(words.join(" ")),
        cut,
    ))
}
