//! The one picture, as the screens that draw in it hold it: once there is one, in which colours, from where it is looked at.
//!
//! Comes in: the theme, keys, what the system and the address ask for. Goes out: the view to draw with. Does not know what is drawn.

use crate::keys::KeyAction;
use crate::model::Theme;
use crate::page::frame;
use crate::view::{PainterChoice, Palette, View};
use leptos::prelude::*;
use wasm_bindgen::prelude::*;
use web_sys::MediaQueryListEvent;

/// The picture, once there is one.
pub(super) type Picture = StoredValue<Option<View>, LocalStorage>;

/// Does something with the picture, where there is one.
pub(super) fn with_view(picture: Picture, act: impl FnOnce(&View)) {
    if let Some(view) = picture.try_get_value().flatten() {
        act(&view);
    }
}

/// Fit and zoom, for keys and buttons.
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

/// Whether the system asks for dark surroundings, now and whenever it changes its mind.
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

/// The colours of the picture.
pub(super) fn palette(system_dark: bool) -> Palette {
    let dark = match frame().theme.get() {
        Theme::Dark | Theme::Contrast => true,
        Theme::Light => false,
        Theme::Auto => system_dark,
    };
    if dark { Palette::DARK } else { Palette::LIGHT }
}

/// What draws can be asked for in the address, for tests: `?draw=webgl2`.
pub(super) fn wanted() -> PainterChoice {
    let search = window().location().search().unwrap_or_default();
    let word = search
        .trim_start_matches('?')
        .split('&')
        .find_map(|part| part.strip_prefix("draw=").map(str::to_owned));
    word.map_or(PainterChoice::Auto, |word| PainterChoice::from_word(&word))
}
