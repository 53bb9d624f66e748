//! A long list that creates only its visible rows.
//!
//! ```text
//! filler  ├──────────────────── rows × 28 px ────────────────────┤
//! visible           ├─ scroll … scroll + height ─┤
//! created         ├──── four more on either side ────┤
//! ```
//!
//! Browsers limit an element to about 17 million pixels. A longer list scrolls in larger steps, and its rows
//! are shifted into view.

use leptos::ev;
use leptos::html::{self, div};
use leptos::prelude::*;
use web_sys::KeyboardEvent;

const ROW_PX: f64 = 28.0;
const MORE: usize = 4;
const TALLEST_PX: f64 = 8e6;

pub fn row_top(index: usize) -> String {
    format!("calc({}px - var(--lifted, 0px))", index as f64 * ROW_PX)
}

/// Pixels of rows per pixel of scrolling, for `count` rows in a view of `height_px`.
fn stretch(count: usize, height_px: f64) -> f64 {
    let rows_px = count as f64 * ROW_PX;
    if rows_px <= TALLEST_PX { 1.0 } else { (rows_px - height_px) / (TALLEST_PX - height_px) }
}

/// `row` creates row `i`. A change of `in_sight` scrolls to that row. `walk` gets the arrow keys.
pub fn virtual_list(
    name: impl Fn() -> String + Send + Sync + 'static,
    count: Signal<usize>,
    in_sight: Signal<Option<usize>>,
    row: impl Fn(usize) -> AnyView + Clone + Send + Sync + 'static,
    walk: impl Fn(i64) + 'static,
) -> impl IntoView {
    let element = NodeRef::<html::Div>::new();
    let scroll = RwSignal::new(0.0_f64);
    let height = RwSignal::new(600.0_f64);
    let stretch = Memo::new(move |_| stretch(count.get(), height.get()));
    let first = Memo::new(move |_| (scroll.get() * stretch.get() / ROW_PX) as usize);
    let seen = Memo::new(move |_| (height.get() / ROW_PX) as usize + 1);
    Effect::new(move |_| {
        let (Some(element), Some(index)) = (element.get(), in_sight.get()) else { return };
        let top = index as f64 * ROW_PX;
        let view = f64::from(element.client_height());
        let stretch = stretch.get_untracked();
        let from = f64::from(element.scroll_top()) * stretch;
        if top < from || top + ROW_PX > from + view {
            element.set_scroll_top(((top - view / 2.0).max(0.0) / stretch) as i32);
            // A browser that draws no frames (a hidden tab) sends no scroll event.
            scroll.set(f64::from(element.scroll_top()));
        }
    });
    let made = Memo::new(move |_| {
        let from = first.get().saturating_sub(MORE);
        (from, (first.get() + seen.get() + MORE).min(count.get()))
    });
    let rows = move || {
        let (from, to) = made.get();
        (from..to).map(&row).collect::<Vec<_>>()
    };
    div()
        .node_ref(element)
        .class("virtual")
        .attr("role", "listbox")
        .attr("tabindex", "0")
        .attr("aria-label", name)
        .on(ev::scroll, move |_| {
            if let Some(element) = element.get_untracked() {
                scroll.set(f64::from(element.scroll_top()));
                height.set(f64::from(element.client_height()));
            }
        })
        .on(ev::keydown, move |event: KeyboardEvent| {
            let by = match event.key().as_str() {
                "ArrowDown" => 1,
                "ArrowUp" => -1,
                "PageDown" => 10,
                "PageUp" => -10,
                _ => return,
            };
            event.prevent_default();
            event.stop_propagation();
            walk(by);
        })
        .child(
            div()
                .class("filler")
                .style(("height", move || format!("{}px", (count.get() as f64 * ROW_PX).min(TALLEST_PX))))
                .style(("--lifted", move || format!("{}px", scroll.get() * (stretch.get() - 1.0))))
                .child(rows),
        )
}

#[cfg(test)]
mod tests {
    use super::*;
    use wasm_bindgen_test::wasm_bindgen_test;

    #[wasm_bindgen_test]
    fn last_row_of_any_list_is_at_the_scroll_end() {
        for count in [3, 285_000, 300_000, 1_000_000, 4_000_000] {
            let (height_px, rows_px) = (560.0, count as f64 * ROW_PX);
            let bottom_px = (rows_px.min(TALLEST_PX) - height_px).max(0.0);
            let shown_px = bottom_px * stretch(count, height_px) + height_px;
            assert!((shown_px - rows_px.max(height_px)).abs() < 1e-3, "{count}: {shown_px}");
        }
    }
}
