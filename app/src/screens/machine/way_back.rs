//! The way back after an alarm, as a list of steps: which are done, which one is next, and the button for it (A12).
//!
//! Comes in: how things stand. Goes out: asks that acknowledge, lift and home. Nothing moves without a press, and Z goes up only while it is
//! pressed. That somebody looked at the bit is remembered for this way back alone, as long as this screen is on show.

use super::jog;
use crate::i18n::{key, t};
use crate::model::link::way_back::{BackMark, BackStep, way_back};
use crate::page::link::{self, Link};
use crate::widgets::{push, push_if};
use annulus_core::control::{Ending, State};
use annulus_core::wire::Ask;
use leptos::html::{li, ol, section, span, strong};
use leptos::prelude::*;

fn word(step: BackStep) -> &'static str {
    match step {
        BackStep::Read => key!("page.back.read"),
        BackStep::Lift => key!("page.back.lift"),
        BackStep::Home => key!("page.back.home"),
        BackStep::Zero => key!("page.back.zero"),
        BackStep::Tool => key!("page.back.tool"),
        BackStep::Resume => key!("page.back.resume"),
    }
}

/// The button of a step, where a press does it; one sets `has_looked`.
fn button(step: BackStep, line: Link, has_looked: RwSignal<bool>) -> AnyView {
    match step {
        BackStep::Read => {
            let mine = move || line.control.get().yours;
            push_if("button small", mine, t!("page.back.was_read"), |_| link::ask(Ask::AcknowledgeAlarm))
                .into_any()
        }
        BackStep::Home => push_if(
            "button small",
            move || line.may_act(),
            t!("page.back.home_now"),
            |_| link::ask(Ask::Home),
        )
        .into_any(),
        // The one of the pad, as it is there: a short press is one step, a long one goes on until it is let go.
        BackStep::Lift => jog::jog_button(line, (2, true), "Z+", key!("page.jog.z_plus")).into_any(),
        BackStep::Tool => {
            push("button small", t!("page.back.looked"), move |_| has_looked.set(true)).into_any()
        }
        // Going on is offered by the bar over the list, zero where the head is moved by hand.
        BackStep::Resume | BackStep::Zero => ().into_any(),
    }
}

/// The list; nothing where no alarm is on show, nor a job that ended with one.
pub(super) fn steps() -> impl IntoView {
    let line = link::link();
    let has_looked = RwSignal::new(false);
    let steps = Memo::new(move |before: Option<&Option<Vec<_>>>| {
        let status = line.status.get()?;
        // The button that is held stays where it is until it is let go.
        if status.state == State::Jogging {
            return before.cloned().flatten();
        }
        let moves = !matches!(status.state, State::Alarm | State::Ready | State::NotHomed);
        let ended = line.ended.with(|ended| ended.as_ref().is_some_and(|end| end.ending == Ending::Alarm));
        let is_broken_off = line.interrupted.with(Option::is_some);
        let wanted = status.alarm.is_some() || ended && is_broken_off;
        (wanted && !moves).then(|| way_back(&status, line.homes(), is_broken_off, has_looked.get()))
    });
    // The bit of another alarm was not looked at.
    Effect::new(move |_| {
        if line.status.with(|status| status.as_ref().is_some_and(|status| status.alarm.is_some())) {
            has_looked.set(false);
        }
    });
    move || {
        let steps = steps.get()?;
        // Two may be done now; one is the next.
        let next = steps.iter().find(|(_, mark)| *mark == BackMark::Now).map(|(step, _)| *step);
        let rows = steps.into_iter().map(|(step, mark)| {
            let class = match mark {
                BackMark::Done => "done",
                BackMark::Now => "now",
                BackMark::Later => "later",
            };
            let current = (next == Some(step)).then_some("step");
            let button = (mark == BackMark::Now).then(|| button(step, line, has_looked));
            li().class(class)
                .attr("aria-current", current)
                .child((span().child(move || crate::i18n::text(word(step), &[])), button))
        });
        let rows: Vec<_> = rows.collect();
        let title = strong().child(t!("page.back.title"));
        Some(
            section()
                .class("way-back")
                .attr("aria-label", t!("page.back.title"))
                .child((title, ol().child(rows))),
        )
    }
}
