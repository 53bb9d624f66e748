//! The lines of the table in time, under its columns: high where the bit is on.
//!
//! Comes in: columns. Goes out: a drawing. The grid above says the same to those who do not see it.

use super::Table;
use crate::lab::phases::{LINES, PhaseLine, stretches};
use leptos::html::{div, span};
use leptos::prelude::*;
use leptos::svg::{path, svg};

/// The waveforms.
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

/// Low at 9, high at 1, one column a unit wide.
fn drawn(columns: &[u8], line: PhaseLine) -> String {
    let high = stretches(columns, line);
    let mut drawn = "M0 9".to_owned();
    for (from, to) in high {
        drawn.push_str(&format!("H{from}V1H{to}V9"));
    }
    drawn.push_str(&format!("H{}", columns.len()));
    drawn
}
