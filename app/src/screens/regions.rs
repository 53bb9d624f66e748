//! Keys, the URL, and moving between the regions of the page with F6.

use crate::i18n::{key, unit_word};
use crate::keys::{self, KeyAction, KeyFocus, Press, Tab};
use crate::model::LabEvent;
use crate::model::LinkEvent;
use crate::model::address;
use crate::model::{DrawEvent, ExportEvent, FilesEvent, FrameEvent, Overlay, PlayEvent};
use crate::page::{computed, link, peek, send, watch};
use crate::said::Text;
use crate::screens::{cam, drawing, lab, machine, simulate};
use crate::widgets::{dialog_is_open, toast};
use leptos::ev;
use leptos::prelude::*;
use std::time::Duration;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{HtmlElement, KeyboardEvent};

pub(crate) fn listen() {
    let keys = window_event_listener(ev::keydown, |event| {
        let tab = peek(|m| m.frame.tab);
        let meant = watch(|m| &m.frame.own_keys).with_untracked(|own| own.translated(&press(&event), tab));
        if let Some(action) = meant.and_then(|press| keys::action(&press, tab, peek(|m| m.frame.signs))) {
            if action != KeyAction::Escape {
                event.prevent_default();
            }
            act(action);
        }
    });
    let address = window_event_listener(ev::hashchange, |_| {
        let address = address_now();
        let is_ours = Tab::of_address(&address).is_some();
        send(FrameEvent::Go { address });
        if is_ours {
            // The URL may name something that doesn't exist: replace it with what is shown.
            put_address(&peek(address::of), false);
        }
    });
    on_cleanup(move || {
        keys.remove();
        address.remove();
    });
    send(FrameEvent::Go { address: address_now() });
    write_address();
}

fn address_now() -> String {
    window().location().hash().unwrap_or_default()
}

/// Delay between URL updates. Browsers allow about 100 in 30 s; dragging a slider would make as many in a
/// second.
const ADDRESS_RESTS: Duration = Duration::from_millis(400);

/// Keeps the URL in sync with what is shown. Another screen gets a new history entry, a change within a
/// screen doesn't.
fn write_address() {
    let waits = StoredValue::new(false);
    Effect::new(move |before: Option<String>| {
        let next = computed(address::of).get();
        let now = address_now();
        let (from, to) = (Tab::of_address(&now), Tab::of_address(&next));
        if from.is_some() && from != to {
            // The entry that is left must have its last state, which may not be written yet.
            if let Some(last) = before.filter(|last| Tab::of_address(last) == from) {
                put_address(&last, false);
            }
            put_address(&next, true);
        } else if to != Some(Tab::Simulate) || from.is_none() {
            put_address(&next, false);
        } else if !waits.get_value() {
            waits.set_value(true);
            let rested = move || {
                waits.set_value(false);
                let next = peek(address::of);
                if Tab::of_address(&next) == Tab::of_address(&address_now()) {
                    put_address(&next, false);
                }
            };
            set_timeout(rested, ADDRESS_RESTS);
        }
        next
    });
}

fn put_address(address: &str, is_new: bool) {
    if address == address_now() {
        return;
    }
    if let Ok(history) = window().history() {
        let (state, address) = (&JsValue::NULL, Some(address));
        let _too_many_is_no_harm = if is_new {
            history.push_state_with_url(state, "", address)
        } else {
            history.replace_state_with_url(state, "", address)
        };
    }
}

fn press(event: &KeyboardEvent) -> Press {
    let target = event.target().and_then(|target| target.dyn_into::<HtmlElement>().ok());
    let tag = target.as_ref().map(|target| target.tag_name()).unwrap_or_default();
    let kind = target.as_ref().and_then(|target| target.get_attribute("type")).unwrap_or_default();
    let role = target.as_ref().and_then(|target| target.get_attribute("role")).unwrap_or_default();
    Press {
        key: event.key(),
        code: event.code(),
        ctrl: event.ctrl_key() || event.meta_key(),
        shift: event.shift_key(),
        alt: event.alt_key(),
        repeat: event.repeat(),
        composing: event.is_composing(),
        focus: match (tag.as_str(), kind.as_str(), role.as_str()) {
            ("TEXTAREA", ..) => KeyFocus::Lines,
            ("SELECT", ..) => KeyFocus::Menu,
            ("INPUT", "range", _) | (_, _, "slider") => KeyFocus::Slider,
            ("INPUT", "radio" | "color", _) | (_, _, "listbox" | "tab") => KeyFocus::Control,
            ("INPUT", "checkbox", _) | ("BUTTON" | "SUMMARY", ..) => KeyFocus::Button,
            ("INPUT", ..) => KeyFocus::Text,
            ("CANVAS", ..) => KeyFocus::Picture,
            _ => KeyFocus::Elsewhere,
        },
        in_dialog: dialog_is_open(),
    }
}

pub(crate) fn act(action: KeyAction) {
    match action {
        KeyAction::Stop => link::stop(),
        KeyAction::Escape => {
            send(LinkEvent::Escape);
            if peek(|m| m.frame.tab == Tab::Draw) {
                drawing::escape();
            }
        }
        KeyAction::Pause => send(LinkEvent::Pause),
        KeyAction::ArmKeys => machine::arm_keys(),
        KeyAction::Show(tab) => send(FrameEvent::Show { tab }),
        KeyAction::Open => send(FilesEvent::Choose),
        KeyAction::Units => send(FrameEvent::Units { unit: None }),
        KeyAction::Region { onwards } => next_region(onwards),
        KeyAction::Flip if peek(|m| m.frame.tab == Tab::Simulate) => send(FrameEvent::Look { action }),
        KeyAction::Flip => send(FrameEvent::Flip { below: None }),
        KeyAction::Space if peek(|m| m.frame.tab == Tab::Simulate) => {
            send(PlayEvent::Flat { flat: None });
        }
        KeyAction::Space => {
            send(PlayEvent::Flat { flat: Some(false) });
            send(FrameEvent::Show { tab: Tab::Simulate });
        }
        KeyAction::Grid => send(FrameEvent::Grid),
        KeyAction::Fit
        | KeyAction::Walk { .. }
        | KeyAction::FitChosen
        | KeyAction::ActualSize
        | KeyAction::ZoomIn
        | KeyAction::ZoomOut
        | KeyAction::FromAbove
        | KeyAction::HomeView => {
            send(FrameEvent::Look { action });
        }
        KeyAction::Play
        | KeyAction::Step(_)
        | KeyAction::Beginning
        | KeyAction::End
        | KeyAction::Faster { .. } => {
            simulate::act(action);
        }
        KeyAction::Speak => speak(),
        KeyAction::Undo { back } => send(LabEvent::Undo { back }),
        KeyAction::Queue(key) => lab::queue_key(key),
        KeyAction::Cam(key) => cam::act(key),
        KeyAction::Draw(key) => drawing::key(key),
        // Commands without a key run where they were chosen.
        KeyAction::Nothing | KeyAction::Keyless(_) => {}
        KeyAction::Help => send(FrameEvent::Overlay { overlay: Some(Overlay::Help) }),
        KeyAction::Palette => send(FrameEvent::Overlay { overlay: Some(Overlay::Palette) }),
        KeyAction::Save if peek(|m| m.frame.tab == Tab::Draw) => send(DrawEvent::Save),
        KeyAction::Save if peek(|m| m.board.document.is_some()) => {
            send(ExportEvent::SaveProject);
        }
        KeyAction::Save => toast(Text::of(key!("page.key.save_nothing"))),
    }
}

fn speak() {
    let unit = peek(|m| m.frame.unit);
    if peek(|m| m.frame.tab == Tab::Draw) {
        let at = peek(|m| m.draw.editor.aim.at());
        let args = vec![
            ("x", unit.coordinate(at.x.mm())),
            ("y", unit.coordinate(at.y.mm())),
            ("unit", untrack(unit_word)),
        ];
        return toast(Text::Key { key: key!("page.status.cursor"), args });
    }
    let place = peek(|m| m.link.status.as_ref().map(|status| status.work_mm));
    if let Some(place) = place {
        let [x, y, z] = place.map(|mm| unit.coordinate(mm));
        toast(Text::Key { key: key!("page.machine.spoken"), args: vec![("x", x), ("y", y), ("z", z)] });
    }
}

fn next_region(onwards: bool) {
    let Ok(found) = document().query_selector_all(
        "header.top-bar, main > :is(.top, .left, .stage, .under, .right, .bottom, .whole), footer.status-bar",
    ) else {
        return;
    };
    let regions: Vec<HtmlElement> =
        (0..found.length()).filter_map(|i| found.get(i)?.dyn_into().ok()).collect();
    let has_focus = |region: &HtmlElement| region.contains(document().active_element().as_deref());
    let count = regions.len();
    let here = regions.iter().position(has_focus).unwrap_or(if onwards { count.wrapping_sub(1) } else { 0 });
    // A hidden region can't take the focus: try the next one.
    for step in 1..=count {
        let region = &regions[(here + if onwards { step } else { count - step }) % count];
        let _ = region.set_attribute("tabindex", "-1");
        let _ = region.focus();
        if has_focus(region) {
            break;
        }
    }
}
