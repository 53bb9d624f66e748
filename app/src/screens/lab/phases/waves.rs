//! The bits of the table as waveforms under its columns: high means on. Hidden from screen readers: the grid
//! above has the same data.

use super::Table;
use crate::lab::phases::{LINES, PhaseLine, stretches};
use leptos::html::{div, span};
use leptos::prelude::*;
use leptos::svg::{path, svg};

pub(super) fn waves(table: Table) -> impl IntoView {
    let lines = LINES.map(|line| {
        div().class(if line.volts > 5 { "wave boost" } else { "wave" }).child((
            span().class("phase-name").child(line.name),
            svg()
                .attr("viewBox", move || format!("0 0 {} 10", table.columns.with(Vec::len)))
                .attr("preserveAspectRatio", "none")
                .class("wave-line")
                .style(("--columns", move || table.columns.with(Vec::len).to_string()))
                .child(path().attr("d", move || table.columns.with(|columns| drawn(columns, line)))),
        ))
    });
    div().class("waves").attr("aria-hidden", "true").child(Vec::from(lines))
}

/// An SVG path: low at 9, high at 1, one unit per column.
fn drawn(columns: &[u8], line: PhaseLine) -> String {
    let high = stretches(columns, line);
    let mut drawn = "M0 9".to_owned();
    for (from, to) in high {
        drawn.push_str(&format!("H{from}V1H{to}V9"));
    }
    drawn.push_str(&format!("H{}", columns.len()));
    drawn
}
