//! Screen, units, colours, what is chosen and how it is looked at, as signals.
//!
//! Goes out: signals to be read. Does not know how they are shown.

use super::signals as all;
use super::slots::Slots;
use crate::format::Unit;
use crate::keys::{KeyAction, OwnKeys, SHORTCUTS, Shortcut, Tab};
use crate::layers::LayerLook;
use crate::model::{Network, Overlay, Panels, Theme, Toast, address};
use crate::view::Camera;
use leptos::prelude::*;

/// What frames the work.
#[derive(Clone, Copy)]
pub struct Frame {
    /// The screen.
    pub tab: ReadSignal<Tab>,
    /// Unit of lengths on show.
    pub unit: ReadSignal<Unit>,
    /// Colours.
    pub theme: ReadSignal<Theme>,
    /// The language, by its word.
    pub language: ReadSignal<String>,
    /// The hole chosen in picture or table.
    pub selected: ReadSignal<Option<u32>>,
    /// Show the paths as in the file instead of the planned ones.
    pub show_before: ReadSignal<bool>,
    /// Show the rapids from cut to cut.
    pub show_travel: ReadSignal<bool>,
    /// Keys that type something do what they are for on the page.
    pub signs: ReadSignal<bool>,
    /// Those that a person moved to others.
    pub own_keys: ReadSignal<OwnKeys>,
    /// The sign that could not be had, and whose it is.
    pub own_key_refused: ReadSignal<Option<(String, Option<&'static Shortcut>)>>,
    /// The picture has a grid.
    pub grid: ReadSignal<bool>,
    /// The browser keeps the screen lit; none where nobody asked it to.
    pub awake: ReadSignal<Option<bool>>,
    /// The address of what is on show.
    pub address: ReadSignal<String>,
    /// The section of the settings on show.
    pub section: ReadSignal<&'static str>,
    /// The machine alone, large.
    pub operator: ReadSignal<bool>,
    /// How wide the panels are.
    pub panels: ReadSignal<Panels>,
    /// How each layer is seen.
    pub layers: ReadSignal<Vec<LayerLook>>,
    /// What lies over the screen.
    pub overlay: ReadSignal<Option<Overlay>>,
    /// The board is looked at from below.
    pub flipped: ReadSignal<bool>,
    /// Where the pointer is, work coordinates in mm.
    pub cursor_mm: ReadSignal<Option<[f64; 2]>>,
    /// From where the picture is looked at, once there is one.
    pub camera: ReadSignal<Option<Camera>>,
    /// CSS pixels in a millimetre; 0 before there is a picture.
    pub zoom: ReadSignal<f64>,
    /// Key of the word for what draws.
    pub backend: ReadSignal<Option<&'static str>>,
    /// What was asked of the picture last, and how often anything was.
    pub asked: ReadSignal<(u32, Option<KeyAction>)>,
    /// Short words on show.
    pub toasts: ReadSignal<Vec<Toast>>,
    /// The page came from a site without a bridge.
    pub alone: ReadSignal<bool>,
    /// What is known of the network.
    pub network: ReadSignal<Network>,
}

/// What frames the work.
pub fn frame() -> Frame {
    all().frame
}

/// How the key of a shortcut is written for people, where this person has it.
pub fn written(shortcut: &Shortcut) -> String {
    frame().own_keys.with(|own| own.written(shortcut))
}

/// The same for the first key of the table that does `action`; empty where none does.
pub fn key_of(action: KeyAction) -> String {
    SHORTCUTS.iter().find(|shortcut| shortcut.action == action).map_or_else(String::new, written)
}

pub(super) fn signals(slots: &mut Slots) -> Frame {
    Frame {
        tab: slots.part(|model| &model.frame.tab),
        unit: slots.part(|model| &model.frame.unit),
        theme: slots.part(|model| &model.frame.theme),
        language: slots.part(|model| &model.frame.language),
        selected: slots.part(|model| &model.frame.selected),
        show_before: slots.part(|model| &model.frame.show_before),
        show_travel: slots.part(|model| &model.frame.show_travel),
        signs: slots.part(|model| &model.frame.signs),
        own_keys: slots.part(|model| &model.frame.own_keys),
        own_key_refused: slots.part(|model| &model.frame.own_key_refused),
        grid: slots.part(|model| &model.frame.grid),
        awake: slots.part(|model| &model.frame.awake),
        address: slots.made(address::of),
        section: slots.part(|model| &model.frame.section),
        operator: slots.part(|model| &model.frame.operator),
        panels: slots.part(|model| &model.frame.panels),
        layers: slots.part(|model| &model.frame.layers),
        overlay: slots.part(|model| &model.frame.overlay),
        flipped: slots.part(|model| &model.frame.flipped),
        cursor_mm: slots.part(|model| &model.frame.cursor_mm),
        camera: slots.part(|model| &model.frame.camera),
        zoom: slots.made(|model| model.frame.camera.map_or(0.0, |camera| camera.px_per_mm)),
        backend: slots.part(|model| &model.frame.backend),
        asked: slots.part(|model| &model.frame.asked),
        toasts: slots.part(|model| &model.frame.toasts),
        alone: slots.part(|model| &model.frame.alone),
        network: slots.part(|model| &model.frame.network),
    }
}
