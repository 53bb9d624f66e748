//! The spindles of a machine that has several, in the hole in work (P4).
//!
//! Comes in: the machine's settings, the job on show and its leg in work. Goes out: a table, a row a spindle. What lets X and Y go on
//! stands among the facts of the job.

use crate::i18n::{number, say, t, unit_word};
use crate::page::link::{self, Link};
use crate::page::{frame, open_board};
use crate::spindles::{SpindleInHole, hole_in_work, in_hole};
use leptos::html::{div, table, tbody, td, th, thead, tr};
use leptos::prelude::*;

fn row(spindle: SpindleInHole) -> impl IntoView {
    let depth = move || {
        let unit = frame().unit.get();
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

fn rows(line: Link) -> Memo<Vec<SpindleInHole>> {
    let leg = Memo::new(move |_| line.status.with(|status| status.as_ref().and_then(|status| status.leg)));
    let work = Memo::new(move |_| {
        let leg = leg.get().unwrap_or(0) as usize;
        line.shown_job.with(|job| {
            let program = &job.as_ref()?.program;
            Some((hole_in_work(program, leg), program.spindles))
        })
    });
    Memo::new(move |_| {
        let (hole, drilling) = work.get().unwrap_or((None, u8::MAX));
        open_board()
            .machine
            .with(|machine| if machine.spindles < 2 { Vec::new() } else { in_hole(machine, hole, drilling) })
    })
}

/// The table; nothing for a machine with one spindle.
pub(super) fn spindles() -> impl IntoView {
    let rows = rows(link::link());
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
