//! The spindles of a machine with several, at the current hole. The job's facts show what releases X and Y.

use crate::i18n::{number, say, t, unit_word};
use crate::page::{read, shared};
use crate::spindles::{SpindleInHole, hole_in_work, in_hole};
use leptos::html::{div, table, tbody, td, th, thead, tr};
use leptos::prelude::*;

fn row(spindle: SpindleInHole) -> impl IntoView {
    let depth = move || {
        let unit = read(|m| m.frame.unit);
        format!("{} {}", number(unit.coordinate(spindle.depth_mm)), unit_word())
    };
    let time = move || {
        let ms = spindle.contact_ms.map(|ms| say!("page.job.ms", ms = number(format!("{ms:.1}"))));
        ms.unwrap_or_else(|| "–".to_owned())
    };
    let cells = if spindle.drills {
        (td().child(depth), td().child(time)).into_any()
    } else {
        td().attr("colspan", "2").child(t!("page.spindles.up")).into_any()
    };
    tr().child((th().attr("scope", "row").child(spindle.name), cells))
}

fn rows() -> Memo<Vec<SpindleInHole>> {
    let leg = Memo::new(move |_| read(|m| m.link.status.as_ref()?.leg));
    let work = Memo::new(move |_| {
        let leg = leg.get().unwrap_or(0) as usize;
        shared(|m| &m.start.shown).with(|job| {
            let program = &job.as_ref()?.program;
            Some((hole_in_work(program, leg), program.spindles))
        })
    });
    Memo::new(move |_| {
        let (hole, drilling) = work.get().unwrap_or((None, u8::MAX));
        shared(|m| &m.machine)
            .with(|machine| if machine.spindles < 2 { Vec::new() } else { in_hole(machine, hole, drilling) })
    })
}

/// The table; nothing for a machine with one spindle.
pub(super) fn spindles() -> impl IntoView {
    let rows = rows();
    let head = || {
        let cell = |words: fn() -> String| th().attr("scope", "col").child(words);
        thead().child(tr().child((
            cell(|| say!("page.spindles.spindle")),
            cell(|| say!("page.spindles.depth")),
            cell(|| say!("page.spindles.time")),
        )))
    };
    move || {
        let rows = rows.get();
        (!rows.is_empty()).then(|| {
            div().class("spindles").child(
                table()
                    .attr("aria-label", t!("page.spindles.title"))
                    .child((head(), tbody().child(rows.into_iter().map(row).collect::<Vec<_>>()))),
            )
        })
    }
}
