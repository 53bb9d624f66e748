//! The legs of the job, or the lines of the exported program, as a list: the current one is marked, pressing
//! one jumps there.

use super::lines::lines;
use crate::i18n::{language, say, t};
use crate::model::{FrameEvent, ListingEvent, PlayEvent};
use crate::page::{read, send, shared};
use crate::widgets::{choice, row_top, segmented, virtual_list};
use annulus_core::job::{Command, Leg, Mark};
use annulus_core::sim::LegStart;
use leptos::ev;
use leptos::html::{div, h2, header, section, span};
use leptos::prelude::*;

pub(super) fn commands() -> impl IntoView {
    let shown = || read(|m| m.lines.shown);
    let choices = segmented(
        t!("page.simulate.listed"),
        (
            choice(move || !shown(), t!("page.simulate.steps"), |_| send(ListingEvent::Show { on: false })),
            choice(shown, t!("page.simulate.program"), |_| send(ListingEvent::Show { on: true })),
        ),
    );
    let list = move || if shown() { lines().into_any() } else { legs().into_any() };
    (section().class("block").child(choices), list)
}

fn legs() -> impl IntoView {
    let count = Signal::derive(move || read(|m| m.play.playback.as_ref().map_or(0, |p| p.legs().len())));
    let now = Memo::new(move |_| {
        let at_s = read(|m| m.play.at_s);
        shared(|m| &m.play.playback).with(|playback| {
            let begun = playback.as_ref()?.legs().partition_point(|leg| leg.start_s <= at_s);
            begun.checked_sub(1)
        })
    });
    let row = move |index: usize| {
        shared(|m| &m.play.playback).track();
        line(index, now).into_any()
    };
    let walk = move |by: i64| {
        let to = now.get_untracked().unwrap_or(0) as i64 + by;
        go(usize::try_from(to).unwrap_or(0));
    };
    (
        section().class("block").attr("aria-label", t!("page.simulate.commands")).child(header().child((
            h2().child(t!("page.simulate.commands")),
            span().class("quiet tabular").child(move || say!("page.simulate.legs", count = count.get())),
        ))),
        virtual_list(t!("page.simulate.commands"), count, now.into(), row, walk),
    )
}

fn start(index: usize) -> Option<LegStart> {
    shared(|m| &m.play.playback).with_untracked(|playback| playback.as_ref()?.legs().get(index).copied())
}

fn go(index: usize) {
    if let Some(leg) = start(index) {
        send(PlayEvent::Hold { at_s: leg.start_s });
        if let Mark::Hole(hole) = leg.mark {
            send(FrameEvent::Select { hole: Some(hole) });
        }
    }
}

fn place(leg: &Leg) -> Option<(f64, f64)> {
    leg.commands.iter().find_map(|command| match command {
        Command::Rapid { to } => Some((to.x.mm(), to.y.mm())),
        _ => None,
    })
}

/// Number of the hole of leg `leg` in drill order, from 1; the same on all screens.
fn holes_until(legs: &[Leg], leg: usize) -> usize {
    legs.iter().take(leg + 1).filter(|leg| matches!(leg.mark, Mark::Hole(_))).count()
}

fn text(leg: LegStart) -> String {
    let unit = read(|m| m.frame.unit);
    shared(|m| &m.board.job).with(|job| {
        let program = job.as_ref().map(|job| &job.program);
        match leg.mark {
            Mark::Prepare => say!("page.leg.prepare"),
            Mark::Finish => say!("page.leg.finish"),
            Mark::ToolChange(bit) => {
                let tool = program.and_then(|program| program.bits.get(bit as usize));
                say!("page.leg.change", tool = tool.map(|tool| tool.title(&language())).unwrap_or_default())
            }
            Mark::Hole(number) | Mark::Toolpath(number) => {
                let at = program.and_then(|program| place(program.legs.get(leg.leg as usize)?));
                let (x, y) = at.unwrap_or_default();
                let (x, y) = (unit.coordinate(x), unit.coordinate(y));
                match leg.mark {
                    Mark::Hole(_) => {
                        let hole = program.map_or(0, |program| holes_until(&program.legs, leg.leg as usize));
                        say!("page.leg.hole", hole = hole, x = x, y = y)
                    }
                    _ => say!("page.leg.way", way = number + 1, x = x, y = y),
                }
            }
        }
    })
}

fn line(index: usize, now: Memo<Option<usize>>) -> Option<impl IntoView> {
    let leg = start(index)?;
    let chosen = move || now.get() == Some(index);
    Some(
        div()
            .class("line command-line")
            .attr("role", "option")
            .attr("aria-selected", move || if chosen() { "true" } else { "false" })
            .style(("top", row_top(index)))
            .on(ev::click, move |_| go(index))
            .child((
                span().class("quiet tabular").child(crate::format::clock(leg.start_s)),
                span().child(move || text(leg)),
            )),
    )
}
