//! A long list of which only what is seen exists.
//!
//! ```text
//! filler  ├──────────────────── rows × 28 px ────────────────────┤
//! seen              ├─ scroll … scroll + height ─┤
//! made            ├──── four more on either side ────┤
//! ```
//!
//! Comes in: how many rows, how to make one, which to keep in sight. Goes out: a list box. Knows no rows' content.

use leptos::ev;
use leptos::html::{self, div};
use leptos::prelude::*;
use web_sys::KeyboardEvent;

/// Height of a row.
pub const ROW_PX: f64 = 28.0;
const MORE: usize = 4;

/// The list. `row` makes row `i`; `in_sight` is scrolled to when it changes; `walk` hears the arrow keys.
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
    let first = Memo::new(move |_| (scroll.get() / ROW_PX) as usize);
    let seen = Memo::new(move |_| (height.get() / ROW_PX) as usize + 1);
    Effect::new(move |_| {
        let (Some(element), Some(index)) = (element.get(), in_sight.get()) else { return };
        let top = index as f64 * ROW_PX;
        let view = f64::from(element.client_height());
        let from = f64::from(element.scroll_top());
        if top < from || top + ROW_PX > from + view {
            element.set_scroll_top((top - view / 2.0).max(0.0) as i32);
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
                .style(("height", move || format!("{}px", count.get() as f64 * ROW_PX)))
                .child(rows),
        )
}
