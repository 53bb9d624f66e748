//! A drawing of the working area from the present values: axes, home, work zero and the board's surface.
//!
//! ```text
//!   ┌───────────┐        │ ■ home
//! Y ↑     ●     │      Z ↑
//!   ■───────────┘        ├ ─ surface
//!   X →
//! ```

use crate::format::plain;
use crate::i18n::{say, t};
use crate::page::{read, shared, watch};
use crate::widgets::shape;
use annulus_core::machine::{self, WorkArea};
use leptos::html::{dd, dl, dt, figure};
use leptos::prelude::*;
use leptos::svg::{circle, path, rect, svg, text};

/// Greatest width and height of the table in the drawing.
const TABLE: [f64; 2] = [200.0, 130.0];
/// The lower left corner of the table in the drawing.
const CORNER: [f64; 2] = [26.0, 146.0];
/// X of the Z axis in the drawing.
const Z_AT: f64 = 276.0;

pub(super) fn area() -> impl IntoView {
    let area = Memo::new(move |_| {
        let machine = shared(|m| &m.machine).get();
        let changes = watch(|m| &m.settings).with(|draft| draft.changes(&machine));
        machine::apply(&machine, &changes).map_or_else(|_| machine.work_area(), |changed| changed.work_area())
    });
    let zero = || read(|m| m.link.status.as_ref().and_then(|status| status.zero_mm));
    let range = move |axis: usize| {
        let WorkArea { low_mm, high_mm, .. } = area.get();
        say!("page.area.range", low = plain(low_mm[axis]), high = plain(high_mm[axis]))
    };
    let home = move || {
        let [x, y, z] = area.get().home_mm.map(plain);
        say!("page.area.home_at", x = x, y = y, z = z)
    };
    let zero_at = move || match zero() {
        Some([x, y]) => say!("page.area.zero_at", x = plain(x), y = plain(y)),
        None => say!("page.area.no_zero"),
    };
    let surface = move || say!("page.area.surface_at", z = plain(area.get().surface_mm));
    figure().class("work-area").attr("aria-label", t!("page.area.title")).child((
        move || drawing(area.get(), zero()),
        dl().class("facts").child((
            (dt().child("X"), dd().child(move || range(0))),
            (dt().child("Y"), dd().child(move || range(1))),
            (dt().child("Z"), dd().child(move || range(2))),
            (dt().child((shape("mark home"), t!("page.area.home"))), dd().child(home)),
            (dt().child((shape("mark zero"), t!("page.area.zero"))), dd().child(zero_at)),
            (dt().child((shape("mark surface"), t!("page.area.surface"))), dd().child(surface)),
        )),
    ))
}

/// The table from above and the Z axis from the front. The facts beside it say the same.
fn drawing(area: WorkArea, zero: Option<[f64; 2]>) -> AnyView {
    let size = [0, 1].map(|axis| (area.high_mm[axis] - area.low_mm[axis]).max(1.0));
    let scale = (TABLE[0] / size[0]).min(TABLE[1] / size[1]);
    let [width, height] = size.map(|mm| mm * scale);
    let at = move |[x, y]: [f64; 2]| {
        [CORNER[0] + (x - area.low_mm[0]) * scale, CORNER[1] - (y - area.low_mm[1]) * scale]
    };
    let z_size = (area.high_mm[2] - area.low_mm[2]).max(1.0);
    let z_at = |mm: f64| CORNER[1] - ((mm - area.low_mm[2]) / z_size).clamp(0.0, 1.0) * TABLE[1];
    let home = at([area.home_mm[0], area.home_mm[1]]);
    let [left, bottom] = CORNER;
    let top = bottom - TABLE[1];
    let axes = format!(
        "M{left} {}h40m-5 -3l5 3l-5 3M{} {bottom}v-40m-3 5l3 -5l3 5M{Z_AT} {bottom}V{top}m-3 5l3 -5l3 5",
        bottom + 10.0,
        left - 10.0,
    );
    let surface = format!("M{} {}h36", Z_AT - 18.0, z_at(area.surface_mm));
    let mark = |[x, y]: [f64; 2]| {
        rect().attr("class", "home").attr("x", x - 4.0).attr("y", y - 4.0).attr("width", 8).attr("height", 8)
    };
    let zero =
        zero.map(at).map(|[x, y]| circle().attr("class", "zero").attr("cx", x).attr("cy", y).attr("r", 5));
    let name = |x: f64, y: f64, name: &'static str| text().attr("x", x).attr("y", y).child(name);
    let table = rect().attr("x", left).attr("y", bottom - height).attr("width", width).attr("height", height);
    svg()
        .attr("viewBox", "0 0 310 176")
        .attr("aria-hidden", "true")
        .child((
            table,
            path().attr("d", axes),
            path().attr("class", "surface").attr("d", surface),
            mark(home),
            mark([Z_AT, z_at(area.home_mm[2])]),
            zero,
            name(left + 46.0, bottom + 14.0, "X"),
            name(left - 14.0, bottom - 46.0, "Y"),
            name(Z_AT + 8.0, top + 8.0, "Z"),
        ))
        .into_any()
}
