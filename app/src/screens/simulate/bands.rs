//! The timeline of a job by operation: one band per operation and tool, and marks for problems.
//!
//! ```text
//! [ Isolate · V-bit 30° ][ Drill · 0.8 ][ Drill · 1.0 ][ Cut out · 2.0 ]
//!        ▼ too deep
//! ```

use crate::format::clock;
use crate::i18n::{self, language, say, t};
use crate::model::PlayEvent;
use crate::model::play::mark_at;
use crate::page::{read, send, shared};
use crate::picture;
use crate::view::Palette;
use annulus_core::cam::work::Operation;
use annulus_core::job::Mark;
use annulus_core::sim::{Fault, Warning};
use leptos::ev;
use leptos::html::{button, div, label, option, select, span};
use leptos::prelude::*;

#[derive(Clone, Debug, PartialEq)]
struct Band {
    /// Index into the operations of the job.
    operation: Option<usize>,
    bit: Option<u32>,
    from_s: f64,
    length_s: f64,
}

/// The operation of a leg. Holes belong to the drilling operation of the side that is up.
fn operation_of(mark: Mark) -> Option<usize> {
    let known = |toolpath: u32| {
        let of = |index: u16| usize::from(index);
        shared(|m| &m.board.plan)
            .with(|plan| plan.as_ref()?.toolpath_operations.get(toolpath as usize).copied().map(of))
    };
    match mark {
        Mark::Toolpath(toolpath) => known(toolpath),
        Mark::Hole(_) => shared(|m| &m.job.work).with(|work| {
            let work = work.as_ref()?;
            let drills = |one: &Operation| one.on && one.face == work.setup.face && !one.uses_bit();
            work.operations.iter().position(drills)
        }),
        Mark::Prepare | Mark::ToolChange(_) | Mark::Finish => None,
    }
}

pub(super) fn operation(mark: Mark) -> Option<String> {
    name(operation_of(mark)?)
}

fn name(operation: usize) -> Option<String> {
    shared(|m| &m.job.work).with(|work| {
        let operation = work.as_ref()?.operations.get(operation)?;
        let own = Some(&operation.name).filter(|name| !name.is_empty()).cloned();
        Some(own.unwrap_or_else(|| i18n::text(&operation.action.title_key(), &[])))
    })
}

fn colour(operation: usize) -> Option<String> {
    shared(|m| &m.job.work).with(|work| {
        let kind = picture::kind(work.as_ref()?.operations.get(operation)?);
        Some(Palette::DARK.operation(kind).css())
    })
}

fn bands() -> Vec<Band> {
    shared(|m| &m.play.playback).with(|playback| {
        let Some(playback) = playback else { return Vec::new() };
        let mut bands: Vec<Band> = Vec::new();
        let ends = playback.legs().iter().skip(1).map(|leg| leg.start_s).chain([playback.total_s()]);
        for (leg, end_s) in playback.legs().iter().zip(ends) {
            let length_s = end_s - leg.start_s;
            let operation = operation_of(leg.mark);
            match bands.last_mut() {
                // Legs without an operation (tool changes, preparation, end) join a neighbour with the same
                // tool.
                Some(last) if last.bit == leg.bit && (operation.is_none() || last.operation == operation) => {
                    last.length_s += length_s;
                }
                Some(last) if last.bit == leg.bit && last.operation.is_none() => {
                    last.operation = operation;
                    last.length_s += length_s;
                }
                _ => bands.push(Band { operation, bit: leg.bit, from_s: leg.start_s, length_s }),
            }
        }
        bands
    })
}

/// The displayed name of a band: operation and tool.
fn word(band: &Band) -> String {
    let tool = shared(|m| &m.board.job)
        .with(|job| Some(job.as_ref()?.program.bits.get(band.bit? as usize)?.title(&language())));
    match (band.operation.and_then(name), tool) {
        (Some(operation), Some(tool)) => say!("page.simulate.band", operation = operation, tool = tool),
        (operation, tool) => operation.or(tool).unwrap_or_default(),
    }
}

/// The bands as a menu with times, for screen readers. Shows the current band; choosing another jumps there.
pub(super) fn menu() -> impl IntoView {
    let is_called = |band: &Band| band.operation.is_some() || band.bit.is_some();
    let all = Memo::new(move |_| bands().into_iter().filter(is_called).collect::<Vec<_>>());
    let now = Memo::new(move |_| {
        let at_s = read(|m| m.play.at_s);
        all.with(|all| all.iter().rposition(|band| band.from_s <= at_s).unwrap_or(0))
    });
    let one = move |index: usize, band: &Band| {
        let (from_s, end_s) = (band.from_s, band.from_s + band.length_s);
        let words =
            say!("page.simulate.band_times", band = word(band), from = clock(from_s), end = clock(end_s));
        option()
            .attr("value", index.to_string())
            .prop("selected", move || now.get() == index)
            .child(words)
            .into_any()
    };
    let options = move || {
        all.with(|all| all.iter().enumerate().map(|(index, band)| one(index, band)).collect::<Vec<_>>())
    };
    let go = move |event| {
        let index = event_target_value(&event).parse::<usize>().ok();
        let from_s = index.and_then(|index| all.with_untracked(|all| all.get(index).map(|band| band.from_s)));
        from_s.into_iter().for_each(|at_s| send(PlayEvent::Hold { at_s }));
    };
    label().class("row operation-menu").child((
        span().class("quiet").child(t!("page.simulate.operation")),
        select().on(ev::change, go).child(options),
    ))
}

/// The bands, as wide as their times.
pub(super) fn shown() -> impl IntoView {
    let all = Memo::new(move |_| bands());
    let one = move |band: Band| {
        let word = word(&band);
        let colour = band.operation.and_then(colour);
        let (from_s, end_s) = (band.from_s, band.from_s + band.length_s);
        let now = move || (from_s..end_s).contains(&read(|m| m.play.at_s));
        span()
            .style(("--span", format!("{:.3}", band.length_s)))
            .style(("--swatch", colour.unwrap_or_else(|| "transparent".to_owned())))
            .attr("data-now", move || now().to_string())
            .attr("title", word.clone())
            .child(word)
    };
    div()
        .class("bands")
        .attr("aria-hidden", "true")
        .child(move || all.get().into_iter().map(|band| one(band).into_any()).collect::<Vec<_>>())
}

fn sentence(warning: &Warning) -> String {
    let (at, depth) = (clock(warning.at_s), format!("{:.2}", warning.depth_mm));
    match warning.fault {
        Fault::Outside => say!("page.simulate.wrong_outside", at = at),
        Fault::TooDeep => say!("page.simulate.wrong_deep", at = at, depth = depth),
        Fault::RapidInMaterial => say!("page.simulate.wrong_rapid", at = at, depth = depth),
        Fault::Low => say!("page.simulate.wrong_low", at = at, height = format!("{:.2}", -warning.depth_mm)),
        Fault::Clamp if warning.depth_mm < 0.0 => {
            say!("page.simulate.wrong_over", at = at, height = format!("{:.2}", -warning.depth_mm))
        }
        Fault::Clamp => say!("page.simulate.wrong_clamp", at = at, depth = depth),
        Fault::WrongTool => say!("page.simulate.wrong_tool", at = at),
    }
}

pub(super) fn said() -> Option<String> {
    let at_s = read(|m| m.play.at_s);
    shared(|m| &m.play.warnings).with(|warnings| mark_at(warnings, at_s).map(sentence))
}

/// The marks of problems; pressing one jumps there.
pub(super) fn wrong() -> impl IntoView {
    let marks = move || {
        let total_s = read(|m| m.play.total_s()).max(1e-9);
        let mark = move |warning: &Warning| {
            let at_s = warning.at_s;
            let word = sentence(warning);
            button()
                .attr("type", "button")
                .attr("title", word.clone())
                .attr("aria-label", word)
                .style(("--at", format!("{:.5}", at_s / total_s)))
                .on(ev::click, move |_| send(PlayEvent::Hold { at_s }))
                .into_any()
        };
        shared(|m| &m.play.warnings).with(|warnings| warnings.iter().map(mark).collect::<Vec<_>>())
    };
    div().class("wrongs").child(marks)
}
