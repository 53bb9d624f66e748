//! What people see: one folder a screen, and the frame around them.
//!
//! Comes in: state and link. Goes out: the page. Boards, plans and moves come from `annulus-core` alone.

mod board;
mod cam;
mod lab;
mod layers;
pub mod machine;
mod opening;
mod regions;
mod review;
mod settings;
mod shell;
mod shown;
mod simulate;
mod stage;
mod status_bar;
mod top_bar;
mod welcome;

use crate::{link, state};
use leptos::prelude::*;

/// The whole page.
#[component]
pub fn App() -> impl IntoView {
    link::begin();
    state::begin();
    crate::workbench::begin();
    crate::document::begin();
    crate::keeping::begin();
    cam::begin();
    layers::begin();
    simulate::begin();
    lab::begin();
    if let Some(word) = settings::kept_theme() {
        state::state().theme.set(top_bar::theme_of(&word));
    }
    settings::keep_theme();
    regions::listen();
    crate::widgets::follow_window();
    opening::listen();
    shell::shell()
}
