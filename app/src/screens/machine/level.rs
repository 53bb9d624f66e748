//! The height map of the board: where it is probed, the result, and its commands. Only *Touch the board*
//! moves the machine.
//!
//! ```text
//!  ●──●──●──○    probed: coloured by height; next: a ring; not yet probed: grey
//!  │██│▓▓│  │    surface between four probed points
//!  ●──●──○──○
//! ```

use crate::i18n::{advice, message, say, t};
use crate::model::level::{LevelEvent, PlannedMap, SPACINGS_MM};
use crate::page::{link, read, send, shared, watch};
use crate::widgets::{Dialog, choice, dialog, push, push_guarded, push_if, segmented};
use annulus_core::control::State;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::geometry::Point;
use annulus_core::level::{ProbeGrid, same_job};
use annulus_core::units::Length;
use annulus_core::wire::{Ask, HeightMapReport};
use leptos::html::{div, p};
use leptos::prelude::*;
use leptos::svg::{circle, rect, svg};

const HUES_DEG: [f64; 2] = [220.0, 25.0];

pub(super) fn level() -> impl IntoView {
    let show = push("button", t!("page.level.open"), |_| send(LevelEvent::Show { on: true }));
    (show, box_of())
}

fn spacings() -> impl IntoView {
    let choices = SPACINGS_MM.map(|mm| {
        choice(
            move || read(|m| m.level.spacing_mm) == mm,
            move || say!("page.level.mm", mm = mm),
            move |_| send(LevelEvent::Space { mm }),
        )
    });
    segmented(t!("page.level.spacing"), Vec::from(choices))
}

fn box_of() -> impl IntoView {
    let report = move || shared(|m| &m.link.height_map).get();
    let plan = watch(|m| &m.level.planned);
    let body = div().class("level").child((
        p().child(t!("page.level.is")),
        div().class("row").child((p().class("quiet grow").child(t!("page.level.spacing")), spacings())),
        move || {
            let report = report();
            let known = report.grid.map(|grid| (grid, report.heights.clone()));
            let planned =
                plan.get().and_then(Result::ok).map(|plan| (plan.grid, vec![None; plan.grid.count()]));
            known.or(planned).map(|(grid, heights)| mesh(&grid, &heights, report.next))
        },
        p().class("tabular").attr("role", "status").child(move || says(&report(), plan.get())),
        move || troubles(&report(), plan.get()),
    ));
    let ready = || link::ready() && read(|m| matches!(m.level.planned, Some(Ok(_))));
    let has = move || read(|m| m.link.height_map.grid.is_some() && !m.link.height_map.goes);
    let paused = || link::state() == Some(State::Paused);
    let again = move || if has() { say!("page.level.again") } else { say!("page.level.touch") };
    let pause_word = move || if paused() { say!("page.level.go_on") } else { say!("page.level.pause") };
    let pause = move |_| link::ask(if paused() { Ask::Resume } else { Ask::Pause });
    let foot = (
        push("button", t!("page.close"), |_| send(LevelEvent::Show { on: false })),
        push_if(
            "button",
            move || has() && link::may_act(),
            t!("page.level.forget"),
            |_| link::ask(Ask::ForgetHeightMap),
        ),
        // Pause must never be delayed, so it isn't guarded. As Resume, the button is guarded.
        push_guarded(
            "button",
            move || if paused() { "resume" } else { "" },
            || read(|m| m.link.height_map.goes && m.link.may_act()),
            pause_word,
            pause,
        ),
        push_guarded("button primary", || "touch-board", ready, again, |_| send(LevelEvent::Touch)),
    );
    dialog(
        watch(|m| &m.level.open).into(),
        || send(LevelEvent::Show { on: false }),
        Dialog {
            name: "level",
            role: "dialog",
            title: Box::new(t!("page.level.title")),
            body: body.into_any(),
            foot: foot.into_any(),
        },
    )
}

fn says(report: &HeightMapReport, plan: Option<Result<PlannedMap, Diagnostic>>) -> String {
    let mm = |length: Length| crate::i18n::number(format!("{:.3}", length.mm()));
    if report.goes {
        return say!("page.level.progress", done = report.done, of = report.of);
    }
    let known = || report.heights.iter().flatten().copied();
    if let (Some(_), Some(low), Some(high)) = (report.grid, known().min(), known().max()) {
        let most = low.abs().max(high.abs());
        return say!("page.level.found", low = mm(low), high = mm(high), most = mm(most));
    }
    match plan {
        Some(Ok(plan)) => say!("page.level.places", places = plan.grid.count()),
        _ => say!("page.level.no_job"),
    }
}

fn troubles(report: &HeightMapReport, plan: Option<Result<PlannedMap, Diagnostic>>) -> Vec<AnyView> {
    let other = match &plan {
        Some(Ok(plan)) if report.grid.is_some() && !same_job(&plan.job, &report.job) => {
            Some(error!("level.other_job"))
        }
        Some(Err(why)) => Some(why.clone()),
        _ => None,
    };
    let said = [other, report.refused.clone(), watch(|m| &m.link.refused).get()];
    let view = |why: Diagnostic| {
        let (what, cure) = (message(&why), advice(&why));
        p().class("refused").attr("role", "alert").child(format!("{what} {cure}")).into_any()
    };
    said.into_iter().flatten().map(view).collect()
}

/// The grid as a picture, Y up.
fn mesh(grid: &ProbeGrid, heights: &[Option<Length>], next: Option<u32>) -> impl IntoView + use<> {
    let (low, high) = (grid.low, grid.high);
    let (width, height) = ((high.x - low.x).mm(), (high.y - low.y).mm());
    let dot = (width / f64::from(grid.columns)).min(height / f64::from(grid.rows)) * 0.16;
    let place = |at: Point| [(at.x - low.x).mm(), (high.y - at.y).mm()];
    let known: Vec<f64> = heights.iter().flatten().map(|height| height.mm()).collect();
    let (least, most) =
        known.iter().fold((f64::MAX, f64::MIN), |(least, most), mm| (least.min(*mm), most.max(*mm)));
    let colour = move |mm: f64| {
        let share = if most > least { (mm - least) / (most - least) } else { 0.5 };
        format!(
            "hsl({:.0} 70% {:.0}%)",
            HUES_DEG[0] + (HUES_DEG[1] - HUES_DEG[0]) * share,
            42.0 + 16.0 * share
        )
    };
    let columns = usize::from(grid.columns);
    let cells =
        (0..usize::from(grid.rows) - 1).flat_map(|row| (0..columns - 1).map(move |column| (column, row)));
    let cells = cells.filter_map(|(column, row)| {
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)];
        let corner =
            |(x, y): (usize, usize)| heights.get((row + y) * columns + column + x).copied().flatten();
        let sum: f64 = corners.into_iter().map(|at| corner(at).map(Length::mm)).sum::<Option<f64>>()?;
        let ([x, bottom], [right, y]) =
            (place(grid.place(column, row)), place(grid.place(column + 1, row + 1)));
        let (wide, tall) = (right - x, bottom - y);
        let shape = rect().attr("x", x).attr("y", y).attr("width", wide).attr("height", tall);
        Some(shape.attr("fill", colour(sum / 4.0)))
    });
    let cells: Vec<_> = cells.collect();
    let dots = heights.iter().enumerate().map(|(index, height)| {
        let [x, y] = place(grid.nth(index));
        let class = match height {
            Some(_) => "touched",
            None if next == u32::try_from(index).ok() => "next",
            None => "planned",
        };
        circle().attr("class", class).attr("cx", x).attr("cy", y).attr("r", dot)
    });
    let dots: Vec<_> = dots.collect();
    let frame = format!("{} {} {} {}", -2.0 * dot, -2.0 * dot, width + 4.0 * dot, height + 4.0 * dot);
    svg()
        .attr("class", "mesh")
        .attr("viewBox", frame)
        .attr("role", "img")
        .attr("aria-label", t!("page.level.title"))
        .child((cells, dots))
}
