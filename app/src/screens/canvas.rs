//! The picture, shared by the screens that draw in it: its handle, its colours, its camera commands.

use crate::keys::KeyAction;
use crate::model::Theme;
use crate::page::read;
use crate::view::{PainterChoice, Palette, View};
use leptos::prelude::*;
use wasm_bindgen::prelude::*;
use web_sys::MediaQueryListEvent;

/// None until the canvas is ready.
pub(super) type Picture = StoredValue<Option<View>, LocalStorage>;

/// Does nothing while there is no picture.
pub(super) fn with_view(picture: Picture, act: impl FnOnce(&View)) {
    if let Some(view) = picture.try_get_value().flatten() {
        act(&view);
    }
}

pub(super) fn look(view: &View, action: KeyAction) {
    match action {
        KeyAction::Fit => view.fit(),
        KeyAction::FitChosen => view.fit_chosen(),
        KeyAction::ActualSize => view.actual_size(),
        KeyAction::ZoomIn => view.zoom_by(1.25),
        KeyAction::ZoomOut => view.zoom_by(0.8),
        KeyAction::FromAbove => view.look_home(true),
        KeyAction::HomeView => view.look_home(false),
        KeyAction::Flip => view.look_flipped(),
        _ => {}
    }
}

/// True while the system prefers a dark colour scheme; follows changes.
pub(super) fn system_dark() -> RwSignal<bool> {
    let dark = RwSignal::new(false);
    let asked = window().match_media("(prefers-color-scheme: dark)").ok().flatten();
    if let Some(asked) = asked {
        dark.set(asked.matches());
        let changed = Closure::<dyn FnMut(MediaQueryListEvent)>::new(move |event: MediaQueryListEvent| {
            dark.set(event.matches());
        });
        asked.set_onchange(Some(changed.as_ref().unchecked_ref()));
        on_cleanup(move || asked.set_onchange(None));
        changed.forget();
    }
    dark
}

pub(super) fn palette(system_dark: bool) -> Palette {
    let dark = match read(|m| m.frame.theme) {
        Theme::Dark | Theme::Contrast => true,
        Theme::Light => false,
        Theme::Auto => system_dark,
    };
    if dark { Palette::DARK } else { Palette::LIGHT }
}

/// The renderer named in the URL, for tests: `?draw=webgl2`.
pub(super) fn wanted() -> PainterChoice {
    let search = window().location().search().unwrap_or_default();
    let word = search
        .trim_start_matches('?')
        .split('&')
        .find_map(|part| part.strip_prefix("draw=").map(str::to_owned));
    word.map_or(PainterChoice::Auto, |word| PainterChoice::from_word(&word))
}
