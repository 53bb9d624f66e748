//! Thumbnails: of a layer, next to its row; of each board, in a menu if the files belong to several.

use crate::engine::messages::FileRow;
use crate::i18n::{say, t};
use crate::layers::LayerKind;
use crate::model::{Document, FilesEvent};
use crate::page::send;
use crate::view::{Colour, Mesh, Palette};
use annulus_core::artwork::Role;
use annulus_core::geometry::{Bounds, Point};
use annulus_core::units::Length;
use leptos::ev;
use leptos::html::{self, button, canvas, div, h3, p, section, small, strong};
use leptos::prelude::*;
use std::sync::Arc;
use wasm_bindgen::JsCast;
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement};

/// Diameter for holes whose file gives none.
const UNSIZED: Length = Length::from_um(800);
/// Minimum diameter of a hole, as a fraction of the picture's width: one part in this many.
const SEEN_SHARE: i64 = 60;
/// Pixels.
const WIDTH: u32 = 112;
const HEIGHT: u32 = 72;
/// Further triangles of a mesh are not drawn.
const MOST: usize = 60_000;

pub(super) fn preview(document: &Arc<Document>, index: u32, file: &FileRow) -> Option<AnyView> {
    let colour = LayerKind::of(file.read.role, file.read.side).colour(&Palette::DARK);
    let mut boards = document.reading.boards.iter().zip(&document.boards);
    if let Some((_, mesh)) = boards.find(|(board, _)| board.picture_of == Some(index)) {
        return Some(picture(mesh.clone(), colour));
    }
    if let Some(mesh) = drawn(document, file) {
        return Some(picture(Arc::new(mesh), colour));
    }
    let rows = &document.reading.layers;
    let own = rows.iter().position(|row| row.file == Some(index));
    let copper = || {
        rows.iter().position(|row| {
            let is_copper = file.read.role == Role::Copper && row.role == Role::Copper;
            row.file.is_none() && is_copper && row.side == file.read.side
        })
    };
    let at = own.or_else(copper)?;
    let mesh = document.meshes.get(at)?.clone();
    Some(picture(mesh, colour))
}

/// The mesh of files without a layer: the holes of a drill file, the shape of an outline.
fn drawn(document: &Document, file: &FileRow) -> Option<Mesh> {
    let board = &document.reading.board;
    let mesh = match file.read.role {
        Role::Drill => {
            let source = board.sources.iter().position(|name| *name == file.read.name)?;
            let own = board.holes.iter().filter(|hole| hole.source as usize == source);
            let mut mesh = discs(own.map(|hole| (hole.at, hole.diameter.unwrap_or(UNSIZED))));
            frame(&mut mesh, document.reading.body);
            mesh
        }
        Role::Outline => {
            let body = crate::picture::scene(board, document.reading.body, &Palette::DARK).body;
            Mesh {
                triangles: (0..body.len() as u32 / 3).map(|at| [3 * at, 3 * at + 1, 3 * at + 2]).collect(),
                corners_mm: body,
                rings: Vec::new(),
            }
        }
        _ => return None,
    };
    (!mesh.triangles.is_empty()).then_some(mesh)
}

pub(super) fn holes_of(places: &[Point], body: Option<Bounds>) -> Option<AnyView> {
    let around =
        Bounds::around(places.iter().copied().chain(body.iter().flat_map(|body| [body.min, body.max])))?;
    let across = (around.max.x - around.min.x).max(around.max.y - around.min.y);
    // Holes far apart must still be visible.
    let seen = Length::from_nm(across.nm() / SEEN_SHARE).max(UNSIZED);
    let mut mesh = discs(places.iter().map(|at| (*at, seen)));
    if mesh.triangles.is_empty() {
        return None;
    }
    frame(&mut mesh, body);
    Some(picture(Arc::new(mesh), Palette::DARK.finding))
}

/// Adds the board's bounding box, so that the sizes can be compared.
fn frame(mesh: &mut Mesh, body: Option<Bounds>) {
    let (Some(body), Some([low, high])) = (body, mesh.bounds_mm()) else { return };
    let [x, y] = [body.min.x.mm() as f32, body.min.y.mm() as f32];
    let [to_x, to_y] = [body.max.x.mm() as f32, body.max.y.mm() as f32];
    let across = (high[0].max(to_x) - low[0].min(x)).max(high[1].max(to_y) - low[1].min(y));
    let line = across / 100.0;
    let sides = [
        [[x, y], [to_x, y + line]],
        [[x, to_y - line], [to_x, to_y]],
        [[x, y], [x + line, to_y]],
        [[to_x - line, y], [to_x, to_y]],
    ];
    for [a, b] in sides {
        let first = mesh.corners_mm.len() as u32;
        mesh.corners_mm.extend([a, [b[0], a[1]], b, [a[0], b[1]]]);
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
}

/// Round holes as eight triangles each.
fn discs(holes: impl Iterator<Item = (Point, Length)>) -> Mesh {
    let mut mesh = Mesh::default();
    for (at, diameter) in holes {
        let (x, y, r) = (at.x.mm() as f32, at.y.mm() as f32, (diameter.mm() / 2.0).max(0.3) as f32);
        let first = mesh.corners_mm.len() as u32;
        mesh.corners_mm.push([x, y]);
        for step in 0..8_u8 {
            let angle = f64::from(step) * std::f64::consts::FRAC_PI_4;
            mesh.corners_mm.push([x + r * libm::cos(angle) as f32, y + r * libm::sin(angle) as f32]);
            mesh.triangles.push([first, first + 1 + u32::from(step), first + 1 + u32::from(step + 1) % 8]);
        }
    }
    mesh
}

fn picture(mesh: Arc<Mesh>, colour: Colour) -> AnyView {
    let element = NodeRef::<html::Canvas>::new();
    element.on_load(move |element| draw(&element, &mesh, colour));
    let made = canvas().node_ref(element).attr("width", WIDTH).attr("height", HEIGHT);
    made.class("preview").attr("aria-hidden", "true").into_any()
}

fn draw(element: &HtmlCanvasElement, mesh: &Mesh, colour: Colour) {
    let context = element.get_context("2d").ok().flatten();
    let Some(context) = context.and_then(|context| context.dyn_into::<CanvasRenderingContext2d>().ok())
    else {
        return;
    };
    let Some([low, high]) = mesh.bounds_mm() else { return };
    let (width, height) = (f64::from(WIDTH), f64::from(HEIGHT));
    let across = f64::from(high[0] - low[0]).max(0.1);
    let up = f64::from(high[1] - low[1]).max(0.1);
    let scale = ((width - 4.0) / across).min((height - 4.0) / up);
    let place = |at: [f32; 2]| {
        let x = width / 2.0 + (f64::from(at[0]) - f64::from(low[0] + high[0]) / 2.0) * scale;
        let y = height / 2.0 - (f64::from(at[1]) - f64::from(low[1] + high[1]) / 2.0) * scale;
        [x, y]
    };
    context.begin_path();
    for corners in mesh.triangles.iter().take(MOST) {
        for (index, corner) in corners.iter().enumerate() {
            let [x, y] = place(mesh.corners_mm.get(*corner as usize).copied().unwrap_or_default());
            if index == 0 { context.move_to(x, y) } else { context.line_to(x, y) }
        }
        context.close_path();
    }
    context.set_fill_style_str(&colour.css());
    context.fill();
}

const MOST_NAMES: usize = 4;

/// The menu, if there are several boards. The files of the boards that aren't chosen are left out.
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
        let picture = picture(mesh.clone(), LayerKind::CopperTop.colour(&Palette::DARK));
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
