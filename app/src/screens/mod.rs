//! The screens, one folder each, and the frame around them. Boards, plans and motion come from `annulus-core`
//! alone.

mod board;
mod cam;
mod canvas;
mod drawing;
mod help;
mod lab;
mod layers;
pub mod machine;
mod palette;
mod regions;
mod review;
mod rulers;
mod settings;
mod shell;
mod shown;
mod simulate;
mod splitters;
mod stage;
mod status_bar;
mod top_bar;
mod welcome;

use leptos::prelude::*;

/// The root view of the page.
pub fn app() -> impl IntoView {
    regions::listen();
    crate::widgets::follow_window();
    shell::shell()
}
