//! What the machine is doing, readable from two metres; the alarm under it, and what else has to be told.
//!
//! Comes in: status and connection. Goes out: the banner and the bars. Asks for control, acknowledging.

use super::{ended, offer, words};
use crate::health::observer;
use crate::i18n::{advice, key, message, t};
use crate::keys::Tab;
use crate::model::LinkEvent;
use crate::page::link::{self, Freshness, Link, LinkPhase, Notice, Ousted};
use crate::page::{frame, send};
use crate::widgets::{Icon, icon, push, push_if};
use annulus_core::control::Alarm;
use annulus_core::diagnostic::Severity;
use annulus_core::wire::{Ask, DrilledReport};
use leptos::html::{div, p, span, strong};
use leptos::prelude::*;

/// State, its meaning, and who has control.
pub(crate) fn banner() -> impl IntoView {
    let line = link::link();
    // Memos, so that a button is not another one while it is being pressed: statuses come every 40 ms.
    let look = Memo::new(move |_| words::of(line));
    let known =
        Memo::new(move |_| line.phase.get() == LinkPhase::Open && line.freshness.get() != Freshness::Lost);
    let buttons = move || known.get().then(|| control(line));
    // The alarm says all of it, and who has control too.
    let alarmed = alarm_of(line);
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

/// Who has control, and the button that takes it or gives it back.
pub(super) fn control(line: Link) -> impl IntoView {
    move || {
        let control = line.control.get();
        let viewers = (control.viewers > 1)
            .then(|| span().class("quiet").child(t!("page.control.viewers", count = control.viewers)));
        let button = if control.yours {
            push("button small", t!("page.control.release"), |_| link::ask(Ask::ReleaseControl)).into_any()
        } else {
            let taken = control.taken;
            let take = move |_| link::ask(Ask::TakeControl { force: taken });
            let said = observer(line.ousted.get(), taken)
                .map(|word| span().child(move || crate::i18n::text(word, &[])));
            (said, push("button small", t!("page.control.take"), take)).into_any()
        };
        div().class("row").child((viewers, button))
    }
}

fn alarm_of(line: Link) -> Memo<Option<Alarm>> {
    Memo::new(move |_| line.status.with(|status| status.as_ref().and_then(|status| status.alarm.clone())))
}

/// The alarm, on every screen until it was acknowledged.
pub fn alarm() -> impl IntoView {
    let line = link::link();
    let alarm = alarm_of(line);
    let at_machine = Memo::new(move |_| frame().tab.get() == Tab::Machine);
    move || {
        alarm.get().map(|alarm| {
            let (code, what, cure) = (alarm.code.clone(), alarm.clone(), alarm);
            div().class("alarm-bar").attr("role", "alert").child((
                icon(Icon::Alarm),
                div()
                    .class("grow")
                    .child((strong().child(move || message(&what)), p().child(move || advice(&cure)))),
                span().class("quiet tabular").child(code),
                move || at_machine.get().then(|| control(line)),
                push_if(
                    "button",
                    move || line.control.get().yours,
                    t!("page.alarm.acknowledge"),
                    |_| {
                        link::ask(Ask::AcknowledgeAlarm);
                    },
                ),
            ))
        })
    }
}

/// That the machine is not heard any more, on every screen; Machine has its banner.
pub fn lost() -> impl IntoView {
    let line = link::link();
    let is = Memo::new(move |_| words::is_lost(line) && frame().tab.get() != Tab::Machine);
    move || {
        is.get().then(|| {
            let look = words::of(line);
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

/// What is told under the banner, the gravest first. One at a time: whoever closes it sees the next, and the log has them all.
#[derive(Clone, Copy, PartialEq)]
enum Told {
    Refused,
    Ousted,
    Ended,
    Warned,
    Interrupted,
    OtherFirmware,
}

/// Which of them is on show; while an alarm says more than they do, only why a press came to nothing: that of its own button too.
fn foremost(line: Link, closed: RwSignal<Option<DrilledReport>>) -> Memo<Option<Told>> {
    let alarm = alarm_of(line);
    let offer = offer::open(line);
    let is_error =
        move || line.refused.with(|why| why.as_ref().is_some_and(|why| why.severity == Severity::Error));
    Memo::new(move |_| {
        let rows = [
            (Told::Refused, is_error()),
            (Told::Ousted, line.ousted.with(Option::is_some)),
            (Told::Ended, ended::is_to_be_told(line, closed.get())),
            (Told::Warned, line.refused.with(Option::is_some)),
            (Told::Interrupted, offer.with(Option::is_some)),
            (Told::OtherFirmware, line.other_firmware.with(Option::is_some)),
        ];
        let told = rows.into_iter().find(|(_, is)| *is).map(|(told, _)| told);
        told.filter(|told| *told == Told::Refused || alarm.with(Option::is_none))
    })
}

/// Why control was lost, why the last wish was refused, how the last job ended, what disturbs, what can be taken up, that the adapter's firmware is
/// another one: they stay until somebody closes them.
pub(crate) fn answers() -> impl IntoView {
    let line = link::link();
    let closed = RwSignal::new(None);
    let foremost = foremost(line, closed);
    move || {
        Some(match foremost.get()? {
            Told::Refused => refused(line, "notice tone-alarm").into_any(),
            Told::Ousted => ousted(line).into_any(),
            Told::Ended => ended::ended(closed).into_any(),
            Told::Warned => refused(line, "notice tone-pause").into_any(),
            Told::Interrupted => offer::notice(line).into_any(),
            Told::OtherFirmware => other_firmware(line).into_any(),
        })
    }
}

fn refused(line: Link, class: &'static str) -> impl IntoView {
    move || {
        line.refused.get().map(|why| {
            let cure = why.clone();
            div().class(class).attr("role", "alert").child((
                icon(Icon::Warning),
                div()
                    .class("grow")
                    .child((strong().child(move || message(&why)), p().child(move || advice(&cure)))),
                push("button small quiet", t!("page.close"), |_| {
                    send(LinkEvent::Close { notice: Notice::Refused });
                }),
            ))
        })
    }
}

fn ousted(line: Link) -> impl IntoView {
    move || {
        line.ousted.get().map(|why| {
            let (what, cure) = match why {
                Ousted::Taken => (key!("page.ousted.taken"), key!("page.ousted.taken_do")),
                Ousted::Silent => (key!("page.ousted.silent"), key!("page.ousted.silent_do")),
            };
            let text = |key: &'static str| move || crate::i18n::text(key, &[]);
            div().class("notice tone-pause").attr("role", "alert").child((
                icon(Icon::Warning),
                div().class("grow").child((strong().child(text(what)), p().child(text(cure)))),
                push("button small quiet", t!("page.close"), |_| {
                    send(LinkEvent::Close { notice: Notice::Ousted });
                }),
            ))
        })
    }
}

/// The firmware of the adapter is not the one of this program, and how that one comes into it.
fn other_firmware(line: Link) -> impl IntoView {
    move || {
        line.other_firmware.get().map(|other| {
            let (what, cure) = (other.warning(), other.warning());
            div().class("notice tone-pause").attr("role", "status").child((
                icon(Icon::Warning),
                div()
                    .class("grow")
                    .child((strong().child(move || message(&what)), p().child(move || advice(&cure)))),
                push("button small quiet", t!("page.close"), |_| {
                    send(LinkEvent::Close { notice: Notice::OtherFirmware });
                }),
            ))
        })
    }
}
