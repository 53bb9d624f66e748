//! The pad that moves by hand: a short press is one step, a long one goes on until it is let go. By mouse, finger and armed keys.
//!
//! Comes in: what the machine allows now, presses. Goes out: presses as events. Home is not among its keys.

use crate::i18n::{key, say, t};
use crate::keys::{self, HandKey, KeyAction};
use crate::model::HandEvent;
use crate::model::link::hand::{JogDirection, STEPS_UM};
use crate::page::link::{self, Link};
use crate::page::{key_of, send};
use crate::widgets::choice;
use annulus_core::control::State;
use leptos::ev;
use leptos::html::{button, div, h2, header, p, section, span};
use leptos::prelude::*;
use wasm_bindgen::JsCast;
use web_sys::{HtmlElement, KeyboardEvent, Node, PointerEvent};

/// The pad, for whoever puts the focus there.
const PAD: &str = "jog-pad";

/// The button of one direction, which `listen` of the pad belongs to.
pub(super) fn jog_button(
    line: Link,
    way: JogDirection,
    word: &'static str,
    name: &'static str,
) -> impl IntoView {
    let (axis, up) = way;
    let place =
        format!("button jog-{}{}", ["x", "y", "z"][usize::from(axis)], if up { "-plus" } else { "-minus" });
    // While it moves it stays a button that can be let go.
    let usable = move || {
        let touches_off = line.controller.with(|controller| controller.touches_off(line.state()));
        line.may_act() && (touches_off || matches!(line.state(), Some(State::Ready | State::Jogging)))
    };
    button()
        .attr("type", "button")
        .class(place)
        .attr("aria-label", move || crate::i18n::text(name, &[]))
        .prop("disabled", move || !usable())
        .on(ev::pointerdown, move |event: PointerEvent| {
            if event.button() != 0 {
                return send(HandEvent::Gone);
            }
            // A finger that slides off the button is to be noticed.
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
        .on(ev::contextmenu, |event| event.prevent_default())
        .on(ev::keydown, |event| {
            // A key that is held presses once.
            if event.repeat() && matches!(event.key().as_str(), "Enter" | " ") {
                event.prevent_default();
            }
        })
        .on(ev::click, move |event| {
            // From a keyboard or a screen reader: there was no pointer.
            if event.detail() == 0 {
                send(HandEvent::Clicked { way });
            }
        })
        .child(word)
}

/// The jog pad.
pub(crate) fn jog() -> impl IntoView {
    let line = link::link();
    send(HandEvent::Shown);
    let step_um = Memo::new(move |_| line.hand.with(|hand| hand.step_um));
    let armed = Memo::new(move |_| line.hand.with(|hand| hand.armed));
    let steps = STEPS_UM.map(|um| {
        let mm = crate::format::plain(f64::from(um) / 1000.0);
        choice(
            move || step_um.get() == um,
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
        .on(ev::keydown, move |event| key_down(line, &event))
        .on(ev::keyup, move |event| key_up(line, &event))
        .on(ev::focusout, move |event| {
            let stays = event.related_target().and_then(|to| to.dyn_into::<Node>().ok()).is_some_and(|to| {
                document().get_element_by_id(PAD).is_some_and(|pad| pad.contains(Some(&to)))
            });
            if !stays {
                send(HandEvent::FocusLeft);
            }
        })
        .child((
            jog_button(line, (1, true), "Y+", key!("page.jog.y_plus")),
            jog_button(line, (0, false), "X−", key!("page.jog.x_minus")),
            jog_button(line, (0, true), "X+", key!("page.jog.x_plus")),
            jog_button(line, (1, false), "Y−", key!("page.jog.y_minus")),
            jog_button(line, (2, true), "Z+", key!("page.jog.z_plus")),
            jog_button(line, (2, false), "Z−", key!("page.jog.z_minus")),
        ));
    let keys = move || if armed.get() { say!("page.jog.keys_on") } else { say!("page.jog.keys_off") };
    let hint = move || if armed.get() { say!("page.jog.keys_hint") } else { say!("page.jog.hint") };
    section()
        .class(move || if armed.get() { "block armed" } else { "block" })
        .attr("aria-label", t!("page.jog.title"))
        .child((
            header()
                .child((h2().child(t!("page.jog.title")), span().class("quiet").child(t!("page.jog.step")))),
            div()
                .class("segmented")
                .attr("role", "group")
                .attr("aria-label", t!("page.jog.step"))
                .child(Vec::from(steps)),
            buttons,
            p().class("quiet").child(hint),
            button()
                .attr("type", "button")
                .class("button")
                .attr("aria-pressed", move || if armed.get() { "true" } else { "false" })
                .attr("aria-keyshortcuts", move || key_of(KeyAction::ArmKeys))
                .on(ev::click, move |_| arm(line))
                .child(keys),
        ))
}

/// Whatever takes the page away ends the press.
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

/// Arms the keys, or disarms them, where the pad is on show. Nothing moves by that.
pub(crate) fn arm_keys() {
    if document().get_element_by_id(PAD).is_some() {
        arm(link::link());
    }
}

fn arm(line: Link) {
    send(HandEvent::Arm { on: None });
    let region = document().get_element_by_id(PAD).and_then(|pad| pad.dyn_into::<HtmlElement>().ok());
    if let Some(region) = region.filter(|_| line.hand.with_untracked(|hand| hand.armed)) {
        let _ = region.focus();
    }
}

/// Which way a key moves.
fn way(event: &KeyboardEvent) -> Option<JogDirection> {
    match keys::by_hand(&event.key()) {
        Some(HandKey::Move { axis, up }) => Some((axis, up)),
        _ => None,
    }
}

fn key_down(line: Link, event: &KeyboardEvent) {
    if !line.hand.with_untracked(|hand| hand.armed) || event.is_composing() {
        return;
    }
    if let Some(HandKey::Step { finer }) = keys::by_hand(&event.key()) {
        event.prevent_default();
        event.stop_propagation();
        return send(HandEvent::Finer { finer });
    }
    let plain = !event.ctrl_key() && !event.alt_key() && !event.meta_key();
    let way = way(event).filter(|_| plain);
    if way.is_some() {
        event.prevent_default();
        event.stop_propagation();
    }
    send(HandEvent::KeyDown { way, ten: event.shift_key(), repeat: event.repeat() });
}

fn key_up(line: Link, event: &KeyboardEvent) {
    let way = way(event);
    if way.is_some() && way == line.hand.with_untracked(|hand| hand.key_held()) {
        event.prevent_default();
    }
    send(HandEvent::KeyUp { way, shift: keys::is_shift(&event.key()) });
}
