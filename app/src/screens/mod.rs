//! The screens, one folder each, and the frame around them. Boards, plans and motion come from `annulus-core`
//! alone.

mod board;
mod cam;
mod canvas;
mod drawing;
mod help;
mod job_line;
mod lab;
mod layers;
pub mod machine;
mod machines;
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

use crate::keys::Tab;
use crate::page::read;
use leptos::prelude::*;

/// The view of a screen. Screens of the open board need one.
fn screen(tab: Tab) -> AnyView {
    match tab {
        _ if tab.shows_board() && read(|m| m.board.document.is_none()) => welcome::welcome().into_any(),
        _ if tab.shows_board() && read(|m| m.board.reviewing) => review::review().into_any(),
        Tab::Draw => drawing::drawing().into_any(),
        Tab::Board => board::board().into_any(),
        Tab::Cam => cam::cam().into_any(),
        Tab::Simulate => simulate::simulate().into_any(),
        Tab::Machine => machine::machine().into_any(),
        Tab::Lab => lab::lab().into_any(),
        Tab::Settings => settings::settings().into_any(),
    }
}

/// The root view of the page.
pub fn app() -> impl IntoView {
    regions::listen();
    crate::widgets::follow_window();
    shell::shell()
}
