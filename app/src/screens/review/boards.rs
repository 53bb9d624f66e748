//! A menu of boards if the files belong to several. The files of the boards that aren't chosen are left out.

use super::preview;
use crate::i18n::{say, t};
use crate::layers::LayerKind;
use crate::model::Document;
use crate::model::FilesEvent;
use crate::page::send;
use crate::view::Palette;
use leptos::ev;
use leptos::html::{button, div, h3, p, section, small, strong};
use leptos::prelude::*;
use std::sync::Arc;

/// Maximum number of file names shown per board.
const MOST_NAMES: usize = 4;

/// The menu, if there are several boards.
pub(super) fn boards(document: &Arc<Document>) -> Option<AnyView> {
    let boards = &document.reading.boards;
    if boards.len() < 2 {
        return None;
    }
    let chosen = document.said.board.clone();
    let choices = boards.iter().zip(&document.boards).map(|(board, mesh)| {
        let is_chosen = chosen.as_ref() == Some(&board.name);
        let (name, count) = (board.name.clone(), board.files.len());
        let rows = board.files.iter().take(MOST_NAMES);
        let names: Vec<&str> = rows
            .filter_map(|row| document.reading.files.get(*row as usize))
            .map(|file| file.read.name.rsplit(['/', '\\']).next().unwrap_or(&file.read.name))
            .collect();
        let more = if count > names.len() { " …" } else { "" };
        let names = format!("{}{more}", names.join(", "));
        let picture = preview::picture(mesh.clone(), LayerKind::CopperTop.colour(&Palette::DARK));
        button()
            .attr("type", "button")
            .class("board-choice")
            .attr("aria-pressed", if is_chosen { "true" } else { "false" })
            .on(ev::click, move |_| send(FilesEvent::Board { name: name.clone() }))
            .child((
                picture,
                div().child((
                    strong().child(board.name.clone()),
                    small().child(move || say!("page.review.board_files", count = count)),
                    small().class("quiet").child(names),
                )),
            ))
            .into_any()
    });
    let choices: Vec<AnyView> = choices.collect();
    let count = choices.len();
    Some(
        section()
            .attr("aria-label", t!("page.review.boards"))
            .child((
                h3().child(t!("page.review.several", count = count)),
                p().class("quiet").child(t!("page.review.choose_board")),
                div().class("boards").child(choices),
            ))
            .into_any(),
    )
}
