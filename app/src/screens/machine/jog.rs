//! Moving by hand: a short press is one step, a long one goes on until it is let go. By mouse, finger and armed keys.
//!
//! ```text
//! down ─┬─ up within 0.3 s ─▶ one step
//!       └─ 0.3 s ─▶ moves ─▶ up, off the button, a second finger, lost focus, hidden page: comes to rest
//! ```
//!
//! Comes in: what the machine allows now, presses. Goes out: steps and holds. No diagonals, and Initialise is not among its keys.

use crate::i18n::{key, say, t};
use crate::link::{self, Link};
use crate::widgets::choice;
use annulus_core::control::State;
use leptos::ev;
use leptos::html::{button, div, h2, header, p, section, span};
use leptos::leptos_dom::helpers::TimeoutHandle;
use leptos::prelude::*;
use std::cell::{Cell, RefCell};
use std::time::Duration;
use wasm_bindgen::JsCast;
use web_sys::{HtmlElement, KeyboardEvent, Node, PointerEvent};

/// Steps of the jog pad, in µm; they stay millimetres whatever unit is shown.
const STEPS_UM: [i32; 4] = [10, 100, 1_000, 10_000];
/// A press so long is no click.
const LONG: Duration = Duration::from_millis(300);
/// Armed keys that nobody uses are disarmed after this.
const IDLE: Duration = Duration::from_secs(30);
/// The pad, for whoever puts the focus there.
const PAD: &str = "jog-pad";

/// What a press asks for: the axis, and which way.
type Way = (u8, bool);

/// A press that was not let go yet.
struct Press {
    way: Way,
    distance_um: i32,
    /// Which pointer; none for a key.
    pointer: Option<i32>,
    /// It was so long that the machine moves.
    moves: bool,
    long: Option<TimeoutHandle>,
}

thread_local! {
    static PRESS: RefCell<Option<Press>> = const { RefCell::new(None) };
    static PAD_STATE: Cell<Option<Pad>> = const { Cell::new(None) };
    static USED: Cell<Option<TimeoutHandle>> = const { Cell::new(None) };
}

/// What the person chose.
#[derive(Clone, Copy)]
struct Pad {
    step_um: RwSignal<i32>,
    /// Keys move the machine while the focus is in the pad.
    armed: RwSignal<bool>,
}

fn ready(line: Link) -> bool {
    line.may_act() && line.state() == Some(State::Ready)
}

fn begin(way: Way, distance_um: i32, pointer: Option<i32>) {
    end(false);
    if !untrack(|| ready(link::link())) {
        return;
    }
    let long = set_timeout_with_handle(go, LONG).ok();
    PRESS.replace(Some(Press { way, distance_um, pointer, moves: false, long }));
}

/// The press was long: it moves until it ends.
fn go() {
    PRESS.with_borrow_mut(|press| {
        if let Some(press) = press {
            press.moves = true;
            link::hold(press.way.0, press.way.1);
        }
    });
}

/// The press is over. A short one is a step where it was let go as a click is.
fn end(clicked: bool) {
    let Some(press) = PRESS.take() else { return };
    if let Some(long) = press.long {
        long.clear();
    }
    if press.moves {
        link::let_go();
    } else if clicked {
        step(press.way, press.distance_um);
    }
}

fn step((axis, up): Way, distance_um: i32) {
    if untrack(|| ready(link::link())) {
        link::jog(axis, if up { distance_um } else { -distance_um });
    }
}

fn jog_button(line: Link, pad: Pad, way: Way, word: &'static str, name: &'static str) -> impl IntoView {
    let (axis, up) = way;
    let place =
        format!("button jog-{}{}", ["x", "y", "z"][usize::from(axis)], if up { "-plus" } else { "-minus" });
    // While it moves it stays a button that can be let go.
    let usable = move || line.may_act() && matches!(line.state(), Some(State::Ready | State::Jogging));
    button()
        .attr("type", "button")
        .class(place)
        .attr("aria-label", move || crate::i18n::text(name, &[]))
        .prop("disabled", move || !usable())
        .on(ev::pointerdown, move |event: PointerEvent| {
            if event.button() != 0 || PRESS.with_borrow(Option::is_some) {
                return end(false);
            }
            // A finger that slides off the button is to be noticed.
            if let Some(target) = event.target().and_then(|target| target.dyn_into::<HtmlElement>().ok()) {
                let _ = target.release_pointer_capture(event.pointer_id());
            }
            begin(way, pad.step_um.get_untracked(), Some(event.pointer_id()));
        })
        .on(ev::pointerup, |event: PointerEvent| let_go_of(&event, true))
        .on(ev::pointerleave, |event: PointerEvent| let_go_of(&event, false))
        .on(ev::pointercancel, |event: PointerEvent| let_go_of(&event, false))
        .on(ev::contextmenu, |event| event.prevent_default())
        .on(ev::click, move |event| {
            // From a keyboard or a screen reader: there was no pointer.
            if event.detail() == 0 {
                step(way, pad.step_um.get_untracked());
            }
        })
        .child(word)
}

/// The pointer of the press is gone from the button.
fn let_go_of(event: &PointerEvent, clicked: bool) {
    let own = PRESS
        .with_borrow(|press| press.as_ref().is_some_and(|press| press.pointer == Some(event.pointer_id())));
    if own {
        end(clicked);
    }
}

/// The jog pad.
pub(crate) fn jog() -> impl IntoView {
    let line = link::link();
    let pad = Pad { step_um: RwSignal::new(1_000), armed: RwSignal::new(false) };
    PAD_STATE.set(Some(pad));
    let steps = STEPS_UM.map(|um| {
        let mm = crate::format::plain(f64::from(um) / 1000.0);
        choice(move || pad.step_um.get() == um, move || mm.clone(), move |_| pad.step_um.set(um))
    });
    listen(pad);
    let buttons = div()
        .class("jog")
        .attr("id", PAD)
        .attr("tabindex", "-1")
        .attr("role", "group")
        .attr("aria-label", t!("page.jog.title"))
        .on(ev::keydown, move |event| key_down(pad, &event))
        .on(ev::keyup, move |event| key_up(&event))
        .on(ev::focusout, move |event| {
            let stays = event.related_target().and_then(|to| to.dyn_into::<Node>().ok()).is_some_and(|to| {
                document().get_element_by_id(PAD).is_some_and(|pad| pad.contains(Some(&to)))
            });
            if !stays {
                disarm(pad);
            }
        })
        .child((
            jog_button(line, pad, (1, true), "Y+", key!("page.jog.y_plus")),
            jog_button(line, pad, (0, false), "X−", key!("page.jog.x_minus")),
            jog_button(line, pad, (0, true), "X+", key!("page.jog.x_plus")),
            jog_button(line, pad, (1, false), "Y−", key!("page.jog.y_minus")),
            jog_button(line, pad, (2, true), "Z+", key!("page.jog.z_plus")),
            jog_button(line, pad, (2, false), "Z−", key!("page.jog.z_minus")),
        ));
    let keys = move || if pad.armed.get() { say!("page.jog.keys_on") } else { say!("page.jog.keys_off") };
    let hint = move || if pad.armed.get() { say!("page.jog.keys_hint") } else { say!("page.jog.hint") };
    section()
        .class(move || if pad.armed.get() { "block armed" } else { "block" })
        .attr("aria-label", t!("page.jog.title"))
        .child((
            header()
                .child((h2().child(t!("page.jog.title")), span().class("quiet").child(t!("page.jog.step")))),
            div().class("segmented").child(Vec::from(steps)),
            buttons,
            p().class("quiet").child(hint),
            button()
                .attr("type", "button")
                .class("button")
                .attr("aria-pressed", move || if pad.armed.get() { "true" } else { "false" })
                .attr("aria-keyshortcuts", "J")
                .on(ev::click, move |_| arm(pad, !pad.armed.get_untracked()))
                .child(keys),
        ))
}

/// Whatever takes the page away ends the press.
fn listen(pad: Pad) {
    let gone = move || {
        end(false);
        disarm(pad);
    };
    let blur = window_event_listener(ev::blur, move |_| gone());
    let hidden =
        window_event_listener(ev::Custom::<web_sys::Event>::new("visibilitychange"), move |_| gone());
    let up = window_event_listener(ev::pointerup, |event| let_go_of(&event, false));
    let second = window_event_listener(ev::pointerdown, |event| {
        let other = |press: &Press| press.pointer.is_some_and(|own| own != event.pointer_id());
        if PRESS.with_borrow(|press| press.as_ref().is_some_and(other)) {
            end(false);
        }
    });
    on_cleanup(move || {
        end(false);
        PAD_STATE.set(None);
        blur.remove();
        hidden.remove();
        up.remove();
        second.remove();
    });
}

/// Arms the keys, or disarms them. Nothing moves by that.
pub(crate) fn arm_keys() {
    if let Some(pad) = PAD_STATE.get() {
        arm(pad, !pad.armed.get_untracked());
    }
}

fn arm(pad: Pad, on: bool) {
    if !on {
        return disarm(pad);
    }
    pad.armed.set(true);
    used(pad);
    let region = document().get_element_by_id(PAD).and_then(|pad| pad.dyn_into::<HtmlElement>().ok());
    if let Some(region) = region {
        let _ = region.focus();
    }
}

fn disarm(pad: Pad) {
    if PRESS.with_borrow(|press| press.as_ref().is_some_and(|press| press.pointer.is_none())) {
        end(false);
    }
    if pad.armed.try_get_untracked() == Some(true) {
        pad.armed.set(false);
    }
}

/// The keys are in use: the time until they are disarmed begins anew.
fn used(pad: Pad) {
    if let Some(before) = USED.take() {
        before.clear();
    }
    USED.set(set_timeout_with_handle(move || disarm(pad), IDLE).ok());
}

/// Which way a key moves.
fn way(event: &KeyboardEvent) -> Option<Way> {
    match event.key().as_str() {
        "ArrowLeft" => Some((0, false)),
        "ArrowRight" => Some((0, true)),
        "ArrowUp" => Some((1, true)),
        "ArrowDown" => Some((1, false)),
        "PageUp" => Some((2, true)),
        "PageDown" => Some((2, false)),
        _ => None,
    }
}

fn key_down(pad: Pad, event: &KeyboardEvent) {
    if !pad.armed.get_untracked() || event.is_composing() {
        return;
    }
    if let Some(finer) = match event.key().as_str() {
        "-" => Some(true),
        "=" | "+" => Some(false),
        _ => None,
    } {
        event.prevent_default();
        event.stop_propagation();
        let here = STEPS_UM.iter().position(|um| *um == pad.step_um.get_untracked()).unwrap_or(0);
        let next = if finer { here.saturating_sub(1) } else { (here + 1).min(STEPS_UM.len() - 1) };
        return pad.step_um.set(STEPS_UM[next]);
    }
    let plain = !event.ctrl_key() && !event.alt_key() && !event.meta_key();
    let Some(way) = way(event).filter(|_| plain) else {
        // Another key, or Shift while one is held: what moves comes to rest.
        return end(false);
    };
    event.prevent_default();
    event.stop_propagation();
    used(pad);
    if !event.repeat() {
        let ten = if event.shift_key() { 10 } else { 1 };
        begin(way, pad.step_um.get_untracked() * ten, None);
    }
}

fn key_up(event: &KeyboardEvent) {
    let released = way(event);
    let own = PRESS.with_borrow(|press| {
        press.as_ref().is_some_and(|press| press.pointer.is_none() && Some(press.way) == released)
    });
    match event.key().as_str() {
        _ if own => {
            event.prevent_default();
            end(true);
        }
        "Shift" => end(false),
        _ => {}
    }
}
