//! A plot on the page: sharp at any size, in theme colours, usable by pointer, keyboard and screen reader.
//!
//! ```text
//! Plot ─ core: draw(width, height) ─▶ shapes ─▶ SVG elements with a class for their ink
//! pointer or arrow keys ─▶ cursor ─▶ the values there, as text and as the slider's `aria-valuetext`
//! ```

use super::unseen;
use crate::i18n::{Words, say, t};
use crate::readout;
use annulus_core::plot::{self, Anchor, Ink, Plot, PlotShape};
use leptos::ev::{self, KeyboardEvent, PointerEvent};
use leptos::html::{self, details, div, figcaption, figure, span, summary, table, tbody, td, th, thead, tr};
use leptos::prelude::*;
use leptos::svg;
use std::sync::Arc;
use wasm_bindgen::closure::Closure;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{HtmlElement, ResizeObserver};

const STEPS: f64 = 200.0;

pub fn plotted(name: Words, shown: Memo<Arc<Plot>>, height_px: f64) -> impl IntoView {
    let name = Memo::new(move |_| name());
    let frame = NodeRef::<html::Div>::new();
    let width = RwSignal::new(640.0);
    let cursor = RwSignal::new(None::<f64>);
    follow_width(frame, width);
    let words = move || shown.with(|plot| readout::summary(plot));
    figure().class("plot").child((
        figcaption().class("unseen").child((span().child(move || name.get()), ". ", span().child(words))),
        div()
            .node_ref(frame)
            .class("plot-frame")
            .style(("--height", format!("{height_px}px")))
            .attr("role", "slider")
            .attr("tabindex", "0")
            .attr("aria-label", move || say!("page.plot.cursor", name = name.get()))
            .attr("aria-valuemin", "0")
            .attr("aria-valuemax", "100")
            .attr("aria-valuenow", move || percent(shown, cursor))
            .attr("aria-valuetext", move || in_words(shown, cursor.get()))
            .on(ev::pointermove, move |event| point(&event, shown, (width, height_px), cursor))
            .on(ev::pointerleave, move |_| cursor.set(None))
            .on(ev::keydown, move |event| step(&event, shown, cursor))
            .child((svg::svg()
                .attr("class", "plot-picture")
                .attr("aria-hidden", "true")
                .attr("viewBox", move || format!("0 0 {} {height_px}", width.get()))
                .child((
                    move || shown.with(|plot| picture(plot, width.get(), height_px)),
                    move || shown.with(|plot| hair(plot, width.get(), height_px, cursor.get())),
                )),)),
        div()
            .class("plot-readout tabular")
            .attr("aria-hidden", "true")
            .child(move || read_out(shown, cursor.get())),
        details().class("plot-table").child((
            summary().child((t!("page.plot.table"), unseen(move || format!(" {}", name.get())))),
            move || shown.with(|plot| as_tables(plot)),
        )),
    ))
}

fn follow_width(frame: NodeRef<html::Div>, width: RwSignal<f64>) {
    let observer = StoredValue::new_local(None::<(ResizeObserver, Closure<dyn FnMut(JsValue)>)>);
    Effect::new(move |_| {
        let Some(element) = frame.get() else { return };
        let element: HtmlElement = element.unchecked_into();
        let seen = element.clone();
        let resized = Closure::new(move |_: JsValue| {
            let now = f64::from(seen.client_width());
            if now > 0.0 && width.try_get_untracked().is_some_and(|before| before != now) {
                width.set(now);
            }
        });
        if let Ok(made) = ResizeObserver::new(resized.as_ref().unchecked_ref()) {
            made.observe(&element);
            observer.set_value(Some((made, resized)));
        }
    });
    on_cleanup(move || {
        observer.try_update_value(|kept| {
            if let Some((made, _)) = kept.take() {
                made.disconnect();
            }
        });
    });
}

fn ink_class(ink: Ink) -> String {
    match ink {
        Ink::Text => "ink-text".to_owned(),
        Ink::Axis => "ink-axis".to_owned(),
        Ink::Grid => "ink-grid".to_owned(),
        Ink::Mark => "ink-mark".to_owned(),
        Ink::Series(index) => format!("ink-series s{}", index % 7),
    }
}

/// Moves vertical and horizontal lines to pixel centers, so that they are sharp.
fn sharp(points: &[[f64; 2]]) -> String {
    let straight = points.windows(2).all(|two| two[0][0] == two[1][0] || two[0][1] == two[1][1]);
    let place = |value: f64| if straight { value.floor() + 0.5 } else { value };
    let words: Vec<_> = points.iter().map(|[x, y]| format!("{:.2},{:.2}", place(*x), place(*y))).collect();
    words.join(" ")
}

fn picture(plot: &Plot, width: f64, height: f64) -> Vec<AnyView> {
    plot::draw(plot, width, height).into_iter().map(drawn).collect()
}

fn drawn(shape: PlotShape) -> AnyView {
    match shape {
        PlotShape::Line { ink, points } => {
            let fine = !matches!(ink, Ink::Series(_));
            let points = if fine {
                sharp(&points)
            } else {
                points.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect::<Vec<_>>().join(" ")
            };
            svg::polyline().attr("class", ink_class(ink)).attr("points", points).into_any()
        }
        PlotShape::Area { ink, at: [x, y, width, height] } => {
            let place =
                svg::rect().attr("class", format!("{} area", ink_class(ink))).attr("x", x).attr("y", y);
            place.attr("width", width).attr("height", height).into_any()
        }
        PlotShape::Dot { ink, at: [x, y] } => {
            let class = format!("{} dot", ink_class(ink));
            svg::circle().attr("class", class).attr("cx", x).attr("cy", y).attr("r", "2.5").into_any()
        }
        PlotShape::Words { ink, at: [x, y], size, anchor, turned, text } => {
            let anchor = match anchor {
                Anchor::Start => "start",
                Anchor::Middle => "middle",
                Anchor::End => "end",
            };
            let turn = turned.then(|| format!("rotate(-90 {x} {y})"));
            let place = svg::text().attr("class", ink_class(ink)).attr("x", x).attr("y", y);
            place
                .attr("font-size", size)
                .attr("text-anchor", anchor)
                .attr("transform", turn)
                .child(text)
                .into_any()
        }
    }
}

/// The vertical cursor line through all panels, with a dot on each curve.
fn hair(plot: &Plot, width: f64, height: f64, cursor: Option<f64>) -> Vec<AnyView> {
    let Some(x) = cursor else { return Vec::new() };
    let mut shapes = Vec::new();
    for (panel, frame) in plot.panels.iter().zip(plot::layout(plot, width, height)) {
        let px = frame.px(x);
        let (top, bottom) = (frame.top_px, frame.top_px + frame.height_px);
        shapes.push(
            svg::polyline()
                .attr("class", "ink-cursor")
                .attr("points", sharp(&[[px, top], [px, bottom]]))
                .into_any(),
        );
        for (index, series) in panel.series.iter().enumerate() {
            if let Some(value) = readout::value_at(series, x) {
                let at = [px, frame.py(value).clamp(top, bottom)];
                shapes.push(drawn(PlotShape::Dot { ink: Ink::Series(index), at }));
            }
        }
    }
    shapes
}

fn point(
    event: &PointerEvent,
    shown: Memo<Arc<Plot>>,
    size: (RwSignal<f64>, f64),
    cursor: RwSignal<Option<f64>>,
) {
    let Some(target) = event.current_target().and_then(|target| target.dyn_into::<HtmlElement>().ok()) else {
        return;
    };
    let px = f64::from(event.client_x()) - target.get_bounding_client_rect().left();
    let x = shown.with_untracked(|plot| {
        let frame = plot::layout(plot, size.0.get_untracked(), size.1).into_iter().next()?;
        let inside = px >= frame.left_px - 2.0 && px <= frame.left_px + frame.width_px + 2.0;
        inside.then(|| frame.x_at(px).clamp(frame.x[0], frame.x[1]))
    });
    cursor.set(x);
}

fn step(event: &KeyboardEvent, shown: Memo<Arc<Plot>>, cursor: RwSignal<Option<f64>>) {
    let Some([low, high]) = shown.with_untracked(|plot| readout::reach(plot)) else { return };
    let now = cursor.get_untracked();
    let by = (high - low) / STEPS * if event.shift_key() { 10.0 } else { 1.0 };
    let next = match event.key().as_str() {
        "ArrowRight" | "ArrowUp" => now.map_or(low, |x| x + by),
        "ArrowLeft" | "ArrowDown" => now.map_or(high, |x| x - by),
        "PageUp" => now.map_or(low, |x| x + 10.0 * by),
        "PageDown" => now.map_or(high, |x| x - 10.0 * by),
        "Home" => low,
        "End" => high,
        _ => return,
    };
    event.prevent_default();
    cursor.set(Some(next.clamp(low, high)));
}

fn percent(shown: Memo<Arc<Plot>>, cursor: RwSignal<Option<f64>>) -> String {
    let share = cursor.get().zip(shown.with(|plot| readout::reach(plot)));
    let share = share.map_or(0.0, |(x, [low, high])| if high > low { (x - low) / (high - low) } else { 0.0 });
    format!("{:.0}", 100.0 * share.clamp(0.0, 1.0))
}

fn in_words(shown: Memo<Arc<Plot>>, cursor: Option<f64>) -> String {
    shown.with(|plot| {
        let Some(x) = cursor else { return readout::summary(plot) };
        let Some(first) = plot.panels.first() else { return String::new() };
        let mut words = vec![format!("{} {}", first.x.label, readout::with_unit(x, &first.x.unit))];
        for panel in &plot.panels {
            words.extend(
                readout::at_cursor(panel, x).into_iter().map(|(name, value)| format!("{name} {value}")),
            );
        }
        words.join(", ")
    })
}

fn read_out(shown: Memo<Arc<Plot>>, cursor: Option<f64>) -> Vec<AnyView> {
    let Some(x) = cursor else { return vec![span().class("quiet").child(t!("page.plot.hint")).into_any()] };
    shown.with(|plot| {
        let first = plot.panels.first();
        let mut parts: Vec<AnyView> = Vec::new();
        parts.extend(first.map(|panel| {
            span().child(format!("{} {}", panel.x.label, readout::with_unit(x, &panel.x.unit))).into_any()
        }));
        for panel in &plot.panels {
            for (index, series) in panel.series.iter().enumerate() {
                let Some(value) = readout::value_at(series, x) else { continue };
                let value = readout::with_unit(value, &panel.y.unit);
                let swatch = span().class(format!("key {}", ink_class(Ink::Series(index))));
                parts.push(
                    span().class("value").child((swatch, format!("{} {value}", panel.y.label))).into_any(),
                );
            }
        }
        parts
    })
}

fn as_tables(plot: &Plot) -> Vec<AnyView> {
    let Some(reach) = readout::reach(plot) else { return Vec::new() };
    let tables = plot.panels.iter().map(|panel| {
        let heads = panel.series.iter().map(|series| {
            let name = if series.name.is_empty() { panel.y.label.clone() } else { series.name.clone() };
            th().class("number").attr("scope", "col").child(name)
        });
        let lines = readout::rows(panel, reach).into_iter().map(|(x, values)| {
            let cells = values
                .into_iter()
                .map(|value| td().class("number").child(readout::short(value.unwrap_or(f64::NAN))));
            tr().child((
                th().class("number").attr("scope", "row").child(readout::short(x)),
                cells.collect::<Vec<_>>(),
            ))
        });
        table()
            .child((
                html::caption().child(panel.y.words()),
                thead().child(tr().child((
                    th().class("number").attr("scope", "col").child(panel.x.words()),
                    heads.collect::<Vec<_>>(),
                ))),
                tbody().child(lines.collect::<Vec<_>>()),
            ))
            .into_any()
    });
    tables.collect()
}
