//! The jog pad: a short press is one step, a long press jogs until release. Works by mouse, finger and armed
//! keys. There is no jog key for Home.

use crate::i18n::{key, say, t};
use crate::keys::{self, HandKey, KeyAction};
use crate::model::HandEvent;
use crate::model::link::hand::{JOG, JogDirection, STEPS_UM, may_jog};
use crate::page::{key_of, link, peek, read, send};
use crate::widgets::{choice, push_guarded, segmented};
use annulus_core::control::State;
use leptos::ev;
use leptos::html::{button, div, h2, header, p, section, span};
use leptos::prelude::*;
use wasm_bindgen::JsCast;
use web_sys::{HtmlElement, KeyboardEvent, Node, PointerEvent};

const PAD: &str = "jog-pad";

/// The button of one direction. Needs the pad's [`listen`] for the release.
pub(super) fn jog_button(way: JogDirection, word: &'static str, name: &'static str) -> impl IntoView {
    let (axis, up) = way;
    let place =
        format!("button jog-{}{}", ["x", "y", "z"][usize::from(axis)], if up { "-plus" } else { "-minus" });
    // While it jogs, the button stays enabled so that its release is noticed.
    let usable = move || {
        let jogs = read(|m| may_jog(&m.link));
        let locked = axis < 2 && lift_first().is_some() && !read(|m| m.link.hand.anyway);
        link::may_act() && !locked && (jogs || link::state() == Some(State::Jogging))
    };
    button()
        .attr("type", "button")
        .class(place)
        .attr("aria-label", move || crate::i18n::text(name, &[]))
        .attr("data-moves", JOG)
        .attr("aria-disabled", "true")
        .prop("disabled", move || !usable())
        .on(ev::pointerdown, move |event: PointerEvent| {
            if event.button() != 0 {
                return send(HandEvent::Gone);
            }
            // Without capture, the button gets `pointerleave` when the finger slides off it.
            if let Some(target) = event.target().and_then(|target| target.dyn_into::<HtmlElement>().ok()) {
                let _ = target.release_pointer_capture(event.pointer_id());
            }
            send(HandEvent::Down { way, pointer: event.pointer_id() });
        })
        .on(ev::pointerup, |event: PointerEvent| {
            send(HandEvent::Up { pointer: event.pointer_id(), clicked: true });
        })
        .on(ev::pointerleave, |event: PointerEvent| {
            send(HandEvent::Up { pointer: event.pointer_id(), clicked: false });
        })
        .on(ev::pointercancel, |event: PointerEvent| {
            send(HandEvent::Up { pointer: event.pointer_id(), clicked: false });
        })
        // A long touch would open the context menu.
        .on(ev::contextmenu, |event| event.prevent_default())
        .on(ev::keydown, |event| {
            // A held key must press only once.
            if event.repeat() && matches!(event.key().as_str(), "Enter" | " ") {
                event.prevent_default();
            }
        })
        .on(ev::click, move |event| {
            // No pointer: the click is from a keyboard or a screen reader.
            if event.detail() == 0 {
                send(HandEvent::Clicked { way });
            }
        })
        .child(word)
}

/// Distance that Z must rise before X and Y can jog, mm.
fn lift_first() -> Option<f64> {
    read(|m| m.link.status.as_ref()?.lift_first_mm)
}

/// X and Y are locked because the tip may be in the board: *Lift first*, and a button to hold for moving them
/// anyway.
fn locked() -> impl IntoView {
    // During an alarm, the list "Recovery" shows this step. During a job, nothing can be jogged.
    let is_low = Memo::new(move |_| {
        read(|m| {
            let jogs = may_jog(&m.link) || m.link.state() == Some(State::Jogging);
            let status = m.link.status.as_ref();
            jogs && status.is_some_and(|now| now.alarm.is_none() && now.lift_first_mm.is_some())
        })
    });
    let anyway = Memo::new(move |_| read(|m| m.link.hand.anyway));
    let ready =
        move || link::ready() || read(|m| m.link.may_act() && m.link.controller.touches_off(m.link.state()));
    let words = move || if anyway.get() { say!("page.jog.unlocked") } else { say!("page.jog.locked") };
    let is_enter = |event: &KeyboardEvent| matches!(event.key().as_str(), "Enter" | " ");
    let insist = move || {
        button()
            .attr("type", "button")
            .class("button small insist")
            .prop("disabled", move || !ready())
            .on(ev::pointerdown, |event: PointerEvent| {
                if event.button() == 0 {
                    send(HandEvent::InsistDown);
                }
            })
            .on(ev::pointerup, |_| send(HandEvent::InsistUp))
            .on(ev::pointerleave, |_| send(HandEvent::InsistUp))
            .on(ev::pointercancel, |_| send(HandEvent::InsistUp))
            .on(ev::contextmenu, |event| event.prevent_default())
            .on(ev::keydown, move |event| {
                if is_enter(&event) && !event.repeat() {
                    send(HandEvent::InsistDown);
                }
            })
            .on(ev::keyup, move |event| {
                if is_enter(&event) {
                    send(HandEvent::InsistUp);
                }
            })
            .child(t!("page.jog.insist"))
    };
    move || {
        is_low.get().then(|| {
            div().class("notice tone-pause lift-first").attr("role", "status").child((
                p().child(words),
                push_guarded(
                    "button",
                    || "lift",
                    ready,
                    t!("page.jog.lift_first"),
                    |_| send(HandEvent::LiftFirst),
                ),
                move || (!anyway.get()).then(insist),
            ))
        })
    }
}

pub(crate) fn jog() -> impl IntoView {
    send(HandEvent::Shown);
    let step_um = move || read(|m| m.link.hand.step_um);
    let armed = Memo::new(move |_| read(|m| m.link.hand.armed));
    let steps = STEPS_UM.map(|um| {
        let mm = crate::format::plain(f64::from(um) / 1000.0);
        choice(
            move || step_um() == um,
            move || crate::i18n::number(&mm),
            move |_| send(HandEvent::StepUm { step_um: um }),
        )
    });
    listen();
    let buttons = div()
        .class("jog")
        .attr("id", PAD)
        .attr("tabindex", "-1")
        .attr("role", "group")
        .attr("aria-label", t!("page.jog.title"))
        .on(ev::keydown, |event| key_down(&event))
        .on(ev::keyup, |event| key_up(&event))
        .on(ev::focusout, move |event| {
            let stays = event.related_target().and_then(|to| to.dyn_into::<Node>().ok()).is_some_and(|to| {
                document().get_element_by_id(PAD).is_some_and(|pad| pad.contains(Some(&to)))
            });
            if !stays {
                send(HandEvent::FocusLeft);
            }
        })
        .child((
            jog_button((1, true), "Y+", key!("page.jog.y_plus")),
            jog_button((0, false), "X−", key!("page.jog.x_minus")),
            jog_button((0, true), "X+", key!("page.jog.x_plus")),
            jog_button((1, false), "Y−", key!("page.jog.y_minus")),
            jog_button((2, true), "Z+", key!("page.jog.z_plus")),
            jog_button((2, false), "Z−", key!("page.jog.z_minus")),
        ));
    let keys = move || if armed.get() { say!("page.jog.keys_on") } else { say!("page.jog.keys_off") };
    let hint = move || if armed.get() { say!("page.jog.keys_hint") } else { say!("page.jog.hint") };
    section()
        .class(move || if armed.get() { "block jog-block armed" } else { "block jog-block" })
        .attr("aria-label", t!("page.jog.title"))
        .child((
            header()
                .child((h2().child(t!("page.jog.title")), span().class("quiet").child(t!("page.jog.step")))),
            segmented(t!("page.jog.step"), Vec::from(steps)),
            // Texts that can grow are above the buttons: the block ends at the foot of the panel, so the
            // buttons don't move.
            p().class("quiet").child(hint),
            locked(),
            buttons,
            button()
                .attr("type", "button")
                .class("button")
                .attr("aria-pressed", move || if armed.get() { "true" } else { "false" })
                .attr("aria-keyshortcuts", move || key_of(KeyAction::ArmKeys))
                .on(ev::click, |_| arm())
                .child(keys),
        ))
}

/// Anything that takes the page out of sight ends the press.
fn listen() {
    let gone = |_| send(HandEvent::Gone);
    let blur = window_event_listener(ev::blur, move |_| send(HandEvent::Gone));
    let hidden = window_event_listener(ev::Custom::<web_sys::Event>::new("visibilitychange"), gone);
    let up = window_event_listener(ev::pointerup, |event| {
        send(HandEvent::Up { pointer: event.pointer_id(), clicked: false });
    });
    let cancelled = window_event_listener(ev::pointercancel, |event| {
        send(HandEvent::Up { pointer: event.pointer_id(), clicked: false });
    });
    let second = window_event_listener(ev::pointerdown, |event| {
        send(HandEvent::OtherDown { pointer: event.pointer_id() });
    });
    on_cleanup(move || {
        send(HandEvent::Gone);
        blur.remove();
        hidden.remove();
        up.remove();
        cancelled.remove();
        second.remove();
    });
}

/// Arms or disarms the jog keys if the pad is shown. Moves nothing.
pub(crate) fn arm_keys() {
    if document().get_element_by_id(PAD).is_some() {
        arm();
    }
}

fn arm() {
    send(HandEvent::Arm { on: None });
    let region = document().get_element_by_id(PAD).and_then(|pad| pad.dyn_into::<HtmlElement>().ok());
    if let Some(region) = region.filter(|_| peek(|m| m.link.hand.armed)) {
        let _ = region.focus();
    }
}

fn way(event: &KeyboardEvent) -> Option<JogDirection> {
    match keys::by_hand(&event.key()) {
        Some(HandKey::Move { axis, up }) => Some((axis, up)),
        _ => None,
    }
}

fn key_down(event: &KeyboardEvent) {
    if !peek(|m| m.link.hand.armed) || event.is_composing() {
        return;
    }
    if let Some(HandKey::Step { finer }) = keys::by_hand(&event.key()) {
        event.prevent_default();
        event.stop_propagation();
        return send(HandEvent::Finer { finer });
    }
    let plain = !event.ctrl_key() && !event.alt_key() && !event.meta_key();
    let way = way(event).filter(|_| plain);
    // Armed keys must not also act as shortcuts of the page.
    if way.is_some() {
        event.prevent_default();
        event.stop_propagation();
    }
    send(HandEvent::KeyDown { way, ten: event.shift_key(), repeat: event.repeat() });
}

fn key_up(event: &KeyboardEvent) {
    let way = way(event);
    if way.is_some() && way == peek(|m| m.link.hand.key_held()) {
        event.prevent_default();
    }
    send(HandEvent::KeyUp { way, shift: keys::is_shift(&event.key()) });
}
