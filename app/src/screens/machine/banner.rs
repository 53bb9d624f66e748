//! The machine's state, readable from two metres; below it the alarm and other notices.

use super::{ended, offer, words};
use crate::health::observer;
use crate::health::{Freshness, Ousted};
use crate::i18n::{Words, advice, message, t};
use crate::keys::Tab;
use crate::model::link::{LinkPhase, Notice};
use crate::model::{LinkEvent, Model};
use crate::page::{link, read, send, shared, watch};
use crate::widgets::{Icon, icon, push, push_if};
use annulus_core::control::Alarm;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::wire::{Ask, DrilledReport};
use leptos::html::{div, p, span, strong};
use leptos::prelude::*;

pub(crate) fn banner() -> impl IntoView {
    // A memo, because statuses arrive every 40 ms: the button must not be replaced while it is pressed.
    let look = Memo::new(|_| words::of());
    let known = |m: &Model| m.link.phase == LinkPhase::Open && m.link.freshness != Freshness::Lost;
    let buttons = move || read(known).then(control);
    // The alarm shows all of this itself.
    let alarmed = alarm_of();
    move || {
        if alarmed.get().is_some() {
            return None;
        }
        let look = look.get();
        let (word, meaning) = (look.word, look.meaning);
        Some(div().class(format!("banner {}", look.tone)).attr("role", "status").child((
            icon(look.icon),
            strong().child(move || crate::i18n::text(word, &[])),
            span().class("grow").child(move || crate::i18n::text(meaning, &[])),
            buttons,
        )))
    }
}

/// Shows who has control, and the button that takes or releases it.
pub(super) fn control() -> impl IntoView {
    move || {
        let control = read(|m| m.link.control);
        let viewers = (control.viewers > 1)
            .then(|| span().class("quiet").child(t!("page.control.viewers", count = control.viewers)));
        let button = if control.yours {
            push("button small", t!("page.control.release"), |_| link::ask(Ask::ReleaseControl)).into_any()
        } else {
            let taken = control.taken;
            let take = move |_| link::ask(Ask::TakeControl { force: taken });
            let said = observer(read(|m| m.link.ousted), taken)
                .map(|word| span().child(move || crate::i18n::text(word, &[])));
            (said, push("button small", t!("page.control.take"), take)).into_any()
        };
        div().class("row").child((viewers, button))
    }
}

fn alarm_of() -> Memo<Option<Alarm>> {
    Memo::new(move |_| {
        shared(|m| &m.link.status).with(|status| status.as_ref().and_then(|status| status.alarm.clone()))
    })
}

/// The alarm, on every screen until it is acknowledged.
pub fn alarm() -> impl IntoView {
    let alarm = alarm_of();
    move || {
        alarm.get().map(|alarm| {
            let code = alarm.code.clone();
            div().class("alarm-bar").attr("role", "alert").child((
                icon(Icon::Alarm),
                grown(said(alarm)),
                span().class("quiet tabular").child(code),
                || read(|m| m.frame.tab == Tab::Machine).then(control),
                push_if(
                    "button",
                    move || read(|m| m.link.control.yours),
                    t!("page.alarm.acknowledge"),
                    |_| link::ask(Ask::AcknowledgeAlarm),
                ),
            ))
        })
    }
}

/// The notice that the machine no longer responds, on every screen but Machine, which has the banner.
pub fn lost() -> impl IntoView {
    let is = Memo::new(move |_| words::is_lost() && read(|m| m.frame.tab != Tab::Machine));
    move || {
        is.get().then(|| {
            let look = words::of();
            div().class("alarm-bar").attr("role", "alert").child((
                icon(look.icon),
                div().class("grow").child((
                    strong().child(move || crate::i18n::text(look.word, &[])),
                    p().child(move || crate::i18n::text(look.meaning, &[])),
                )),
            ))
        })
    }
}

/// The notices under the banner, gravest first. One is shown at a time; closing it shows the next. The log
/// has them all.
#[derive(Clone, Copy, PartialEq)]
enum Told {
    Refused,
    Ousted,
    Ended,
    Warned,
    Interrupted,
    OtherFirmware,
}

/// The notice to show. During an alarm only a refusal is shown, so that the user sees why a button had no
/// effect.
fn foremost(closed: RwSignal<Option<DrilledReport>>) -> Memo<Option<Told>> {
    let alarm = alarm_of();
    let offer = offer::open();
    let is_error = |m: &Model| m.link.refused.as_ref().is_some_and(|why| why.severity == Severity::Error);
    Memo::new(move |_| {
        let rows = [
            (Told::Refused, read(is_error)),
            (Told::Ousted, read(|m| m.link.ousted.is_some())),
            (Told::Ended, ended::is_to_be_told(closed.get())),
            (Told::Warned, read(|m| m.link.refused.is_some())),
            (Told::Interrupted, offer.with(Option::is_some)),
            (Told::OtherFirmware, read(|m| m.link.other_firmware.is_some())),
        ];
        let told = rows.into_iter().find(|(_, is)| *is).map(|(told, _)| told);
        told.filter(|told| *told == Told::Refused || alarm.with(Option::is_none))
    })
}

/// The notices: lost control, a refused request, the end of the last job, a warning, an interrupted job,
/// other adapter firmware. Each remains until the user closes it.
pub(crate) fn answers() -> impl IntoView {
    let closed = RwSignal::new(None);
    let foremost = foremost(closed);
    move || {
        Some(match foremost.get()? {
            Told::Refused => refused("notice tone-alarm").into_any(),
            Told::Ousted => ousted().into_any(),
            Told::Ended => ended::ended(closed).into_any(),
            Told::Warned => refused("notice tone-pause").into_any(),
            Told::Interrupted => offer::notice().into_any(),
            Told::OtherFirmware => other_firmware().into_any(),
        })
    }
}

fn refused(class: &'static str) -> impl IntoView {
    move || {
        let why = watch(|m| &m.link.refused).get()?;
        Some(notice(class, "alert", said(why), Notice::Refused))
    }
}

fn ousted() -> impl IntoView {
    || {
        let words = match read(|m| m.link.ousted)? {
            Ousted::Taken => [t!("page.ousted.taken"), t!("page.ousted.taken_do")],
            Ousted::Silent => [t!("page.ousted.silent"), t!("page.ousted.silent_do")],
        };
        Some(notice("notice tone-pause", "alert", words, Notice::Ousted))
    }
}

/// The adapter's firmware differs from the one in this program, and how to update it.
fn other_firmware() -> impl IntoView {
    || {
        let other = read(|m| m.link.other_firmware)?;
        Some(notice("notice tone-pause", "status", said(other.warning()), Notice::OtherFirmware))
    }
}

fn said(why: Diagnostic) -> [Words; 2] {
    let cure = why.clone();
    [Box::new(move || message(&why)), Box::new(move || advice(&cure))]
}

fn grown([what, cure]: [Words; 2]) -> impl IntoView {
    div().class("grow").child((strong().child(what), p().child(cure)))
}

fn notice(class: &'static str, role: &'static str, words: [Words; 2], notice: Notice) -> impl IntoView {
    div().class(class).attr("role", role).child((
        icon(Icon::Warning),
        grown(words),
        push("button small quiet", t!("page.close"), move |_| send(LinkEvent::Close { notice })),
    ))
}
