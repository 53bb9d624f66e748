//! The only canvas of the page: the board of the current screen, its progress and the tool.
//!
//! ```text
//! Board     document and plan         no progress
//! Simulate  document and plan         progress of the playback
//! Machine   the machine's job         its status
//! ```

use super::canvas::{Picture, look, palette, system_dark, wanted, with_view};
use super::layers;
use super::rulers;
use super::shown::{Shown, machine_has_own_job, missing_holes, moment, shown};
use crate::i18n::{self, key, say, t};
use crate::keys::{KeyAction, Tab};
use crate::layers::{LayerKind, dimmed};
use crate::model::{FrameEvent, Model, PlayEvent};
use crate::page::{peek, read, send, shared};
use crate::picture;
use crate::toolpaths::Toolpaths;
use crate::view::{Backend, Colour, FilledLayer, HoleState, Line, Mesh, Palette, Scene, View, Width};
use crate::widgets::{Icon, picture_button, push, toasts};
use annulus_core::board::{Face, Hole};
use annulus_core::cam::work::OperationKind;
use annulus_core::control::Trust;
use annulus_core::proof;
use leptos::html::{self, div, li, span, ul};
use leptos::prelude::*;
use std::sync::Arc;

/// The canvas, its buttons, and the short texts above it.
pub(crate) fn stage() -> impl IntoView {
    let host = NodeRef::<html::Div>::new();
    let ready = RwSignal::new(false);
    let picture: Picture = StoredValue::new_local(None);
    let shown = shown();
    let system_dark = system_dark();
    let palette = Memo::new(move |_| palette(system_dark.get()));
    host.on_load(move |host| {
        leptos::task::spawn_local(async move {
            if let Ok(view) = View::new(&host, wanted(), palette.get_untracked()).await {
                painted_by(view.backend());
                listen(&view, shown);
                picture.set_value(Some(view));
                ready.set(true);
            }
        });
    });
    show(picture, ready, shown, palette);
    super::simulate::in_space(picture, ready, shown);
    super::drawing::in_picture(picture, ready, palette);
    let buttons = [
        (Icon::Fit, KeyAction::Fit, key!("page.view.fit")),
        (Icon::Plus, KeyAction::ZoomIn, key!("page.view.closer")),
        (Icon::Minus, KeyAction::ZoomOut, key!("page.view.further")),
    ];
    let buttons = buttons.map(|(icon, action, name)| {
        picture_button(icon, move || i18n::text(name, &[]), move |_| send(FrameEvent::Look { action }))
    });
    div().class("stage").attr("role", "region").attr("aria-label", t!("page.view.title")).child((
        div().class("canvas").node_ref(host),
        div()
            .class("tools")
            .attr("role", "toolbar")
            .attr("aria-label", t!("page.view.tools"))
            .child(Vec::from(buttons)),
        rulers::labels(shown),
        rulers::rulers(shown),
        side(from_below(picture)),
        scale(),
        legend(shown),
        chosen(shown),
        toasts(),
    ))
}

/// Shows which renderer draws. A lost device can be replaced by another renderer.
fn painted_by(backend: Backend) {
    let word = match backend {
        Backend::WebGpu => key!("page.status.webgpu"),
        Backend::WebGl2 => key!("page.status.webgl2"),
        Backend::Flat => key!("page.status.flat"),
    };
    send(FrameEvent::Backend { word });
    send(PlayEvent::Space { there: backend != Backend::Flat });
}

/// CSS pixels per millimetre; 0 before there is a view.
fn zoom(model: &Model) -> f64 {
    model.frame.camera.map_or(0.0, |camera| camera.px_per_mm)
}

/// Maximum length of a scale bar, CSS pixels.
const SCALE_PX: f64 = 120.0;

fn scale() -> impl IntoView {
    // In the 3D view, lengths depend on the distance.
    let flat = move || read(|m| m.frame.tab != Tab::Simulate || !m.play.in_space());
    let bar = move || read(|m| m.frame.unit).scale(read(zoom), SCALE_PX).filter(|_| flat());
    move || {
        bar().map(|(px, length)| {
            let text = format!("{} {}", i18n::number(crate::format::plain(length)), i18n::unit_word());
            div()
                .class("scale")
                .attr("aria-hidden", "true")
                .style(("width", format!("{px:.1}px")))
                .child(text)
        })
    }
}

/// The kinds of operation in the picture, in their colours.
fn legend(shown: Memo<Option<Arc<Shown>>>) -> impl IntoView {
    let kinds = Memo::new(move |_| {
        let tab = read(|m| m.frame.tab);
        shown.with(|shown| match shown {
            Some(shown) if tab == Tab::Cam || (tab == Tab::Board && !shown.before) => shown.kinds_shown(),
            _ => Vec::new(),
        })
    });
    let row = |kind: usize| {
        let word = OperationKind::WORDS.get(kind).copied().unwrap_or_default();
        let name = move || i18n::text(&format!("page.cam.word.{word}"), &[]);
        let colour = Palette::DARK.operation(kind).css();
        li().child((span().class("swatch").style(("--swatch", colour)), span().child(name))).into_any()
    };
    let rows = move || kinds.get().into_iter().map(row).collect::<Vec<_>>();
    move || {
        (!kinds.with(Vec::is_empty))
            .then(|| ul().class("legend").attr("aria-label", t!("page.view.legend")).child(rows))
    }
}

/// Selects the hole next to the selected one, or next to the middle of the picture, and brings it into view.
fn walk(view: &View, shown: Memo<Option<Arc<Shown>>>, [x, y]: [i8; 2]) {
    let Some(shown) = shown.get_untracked() else { return };
    let corner = picture::origin(shown.body);
    let place = |hole: &Hole| picture::place(corner, hole.at).map(f64::from);
    if layers::kind_locked(LayerKind::Holes) {
        return;
    }
    let holes = &shown.board.holes;
    let chosen = peek(|m| m.frame.selected).and_then(|hole| holes.get(hole as usize)).map(place);
    let camera = view.camera();
    let way = [if camera.mirrored { -x } else { x }, y];
    let found = picture::beside(holes.iter().map(place), chosen.unwrap_or(camera.centre_mm), way);
    // First press and no hole in that direction: take the first hole.
    let found = found.or_else(|| (chosen.is_none() && !holes.is_empty()).then_some(0));
    if let Some(hole) = found.and_then(|index| holes.get(index)) {
        view.bring(place(hole));
        send(FrameEvent::Select { hole: found.map(|index| index as u32) });
    }
}

fn chosen(shown: Memo<Option<Arc<Shown>>>) -> impl IntoView {
    let words = move || {
        let shown = shown.get()?;
        let number = read(|m| m.frame.selected)?;
        let hole = shown.board.holes.get(number as usize)?;
        let [x, y] =
            shown.work_of_picture(picture::place(picture::origin(shown.body), hole.at).map(f64::from));
        let (unit, word, number) = (read(|m| m.frame.unit), i18n::unit_word(), number + 1);
        let (x, y) = (i18n::number(unit.coordinate(x)), i18n::number(unit.coordinate(y)));
        Some(match hole.diameter.map(|size| i18n::number(unit.size(size.mm()))) {
            Some(size) => say!("page.view.chosen", number = number, size = size, unit = word, x = x, y = y),
            None => say!("page.view.chosen_unsized", number = number, unit = word, x = x, y = y),
        })
    };
    div().class("unseen").attr("role", "status").child(words)
}

/// True while the 3D view is seen from below. Asks the picture after it has handled the last command.
fn from_below(picture: Picture) -> Memo<bool> {
    let below = RwSignal::new(false);
    Effect::new(move |_| {
        let _ = (read(|m| m.frame.asked), shared(|m| &m.play.carved).get());
        request_animation_frame(move || with_view(picture, |view| below.set(view.is_from_below())));
    });
    Memo::new(move |_| below.get() && read(|m| m.play.in_space() && m.frame.tab == Tab::Simulate))
}

/// The side badge. In the 3D view: the side that is up, unless the camera is below.
fn side(from_below: Memo<bool>) -> impl IntoView {
    let known = move || match read(|m| m.frame.tab) {
        Tab::Board => read(|m| m.board.document.is_some()),
        tab => tab == Tab::Draw,
    };
    let planned = Memo::new(move |_| {
        let of_job = match read(|m| m.frame.tab) {
            Tab::Cam | Tab::Simulate => true,
            tab => tab == Tab::Machine && machine_has_own_job(),
        };
        read(|m| Some(m.job.work.as_ref()?.setup.face)).filter(|_| of_job)
    });
    let lying = move || {
        planned.get().map(|face| {
            let word = match face {
                _ if from_below.get() => say!("page.view.from_below"),
                Face::Bottom => say!("page.view.bottom"),
                Face::Top => say!("page.view.top"),
            };
            span().class("side-badge still").child(word)
        })
    };
    let looked_at = move || {
        known().then(|| {
            let below = move || read(|m| m.frame.flipped);
            let word = move || if below() { say!("page.view.bottom") } else { say!("page.view.top") };
            push("side-badge", word, |_| act_flip()).attr("title", t!("page.view.flip"))
        })
    };
    (looked_at, lying)
}

fn act_flip() {
    send(FrameEvent::Flip { below: None });
}

const FINDING_MM: f64 = 6.0;

fn listen(view: &View, shown: Memo<Option<Arc<Shown>>>) {
    view.on_press(move |pressed| {
        let disc = pressed.disc.filter(|_| !layers::kind_locked(LayerKind::Holes));
        let hole = disc.and_then(|disc| shown.with_untracked(|shown| shown.as_ref()?.hole_of_disc(disc)));
        send(FrameEvent::Select { hole });
        if peek(|m| m.frame.tab == Tab::Simulate) {
            let place = shown.with_untracked(|shown| Some(shown.as_ref()?.work_of_picture(pressed.at_mm)));
            place.into_iter().for_each(|place_mm| send(PlayEvent::At { place_mm }));
        }
    });
    view.on_hover(move |place| {
        let at = shown.with_untracked(|shown| Some(shown.as_ref()?.work_of_picture(place?.0)));
        send(FrameEvent::Cursor { at_mm: at });
    });
    view.on_stroke(super::drawing::stroke);
    view.on_backend(painted_by);
    view.on_camera(|camera| send(FrameEvent::Moved { camera }));
    send(FrameEvent::Moved { camera: view.camera() });
}

/// Passes changes to the picture, each in its own effect, so that a change updates only what depends on it.
fn show(picture: Picture, ready: RwSignal<bool>, shown: Memo<Option<Arc<Shown>>>, palette: Memo<Palette>) {
    // Counts scenes: a new scene has no marks, so the effects below must set them again.
    let drawn = RwSignal::new(0_u32);
    let drawing = Memo::new(move |_| read(|m| m.frame.tab == Tab::Draw));
    let zero = zero_in_machine();
    Effect::new(move |before: Option<Option<usize>>| {
        if !ready.get() || drawing.get() {
            return None;
        }
        let (shown, palette, zero) = (shown.get(), palette.get(), zero.get());
        let board = shown.as_ref().map(|shown| Arc::as_ptr(&shown.board) as usize);
        with_view(picture, |view| {
            view.set_palette(palette);
            view.set_scene(shown.as_ref().map_or_else(Scene::default, |shown| scene(shown, zero, &palette)));
            view.describe(&shown.as_ref().map_or_else(|| say!("page.view.empty"), |shown| describe(shown)));
            if before.flatten() != board {
                view.fit();
            }
        });
        drawn.update(|count| *count += 1);
        board
    });
    Effect::new(move |_| {
        let marked = read(|m| m.job.marked);
        let place = shared(|m| &m.board.proved).with_untracked(|proved| {
            let at = proved.as_ref()?.findings.get(marked?)?.at;
            shown.with_untracked(|shown| Some(picture::place(picture::origin(shown.as_ref()?.body), at)))
        });
        if let Some(place) = place.filter(|_| ready.get()) {
            with_view(picture, |view| view.look_at(place.map(f64::from), FINDING_MM));
        }
    });
    Effect::new(move |before: Option<u32>| {
        let (count, action) = read(|m| m.frame.asked);
        if before.is_some_and(|before| before != count) {
            with_view(picture, |view| match action {
                Some(KeyAction::Walk { x, y }) => walk(view, shown, [x, y]),
                action => action.into_iter().for_each(|action| look(view, action)),
            });
        }
        count
    });
    show_ground(picture, ready);
    Effect::new(move |_| {
        let (ready, shown, _) = (ready.get(), shown.get(), drawn.get());
        let disc = |hole: u32| shown.as_ref()?.disc_of_hole(hole);
        let chosen: Vec<usize> = read(|m| m.frame.selected).and_then(disc).into_iter().collect();
        if ready && !drawing.get() {
            with_view(picture, |view| view.set_selected(&chosen));
        }
    });
    show_missing(picture, ready, shown, drawn);
    Effect::new(move |_| {
        let (moment, _) = (moment(), drawn.get());
        let head = shown.with(|shown| {
            let at = moment.head_mm?;
            Some(shown.as_ref()?.picture_of_work(at))
        });
        // On the Draw screen, the drawing sets the cross-hair itself.
        if ready.get() && !drawing.get() {
            with_view(picture, |view| {
                view.set_progress(moment.progress);
                view.set_head(head);
            });
        }
    });
}

fn show_ground(picture: Picture, ready: RwSignal<bool>) {
    Effect::new(move |_| {
        let grid = read(|m| m.frame.grid);
        if ready.get() {
            with_view(picture, |view| view.set_grid(grid));
        }
    });
    Effect::new(move |_| {
        let flipped = read(|m| m.frame.flipped) && matches!(read(|m| m.frame.tab), Tab::Board | Tab::Draw);
        if ready.get() {
            with_view(picture, |view| view.set_mirrored(flipped));
        }
    });
}

/// Marks the holes that a run left out, on the Machine screen.
fn show_missing(
    picture: Picture,
    ready: RwSignal<bool>,
    shown: Memo<Option<Arc<Shown>>>,
    drawn: RwSignal<u32>,
) {
    let missing = missing_holes();
    // Reset the previous marks first: they no longer apply on another screen or in a new run.
    Effect::new(move |before: Option<Vec<usize>>| {
        let (ready, shown, _) = (ready.get(), shown.get(), drawn.get());
        let holes = if read(|m| m.frame.tab == Tab::Machine) { missing.get() } else { Vec::new() };
        let disc = |hole: &u32| shown.as_ref()?.disc_of_hole(*hole);
        let failed: Vec<usize> = holes.iter().filter_map(disc).collect();
        let planned = before.unwrap_or_default().into_iter().map(|disc| (disc, HoleState::Planned));
        let states: Vec<_> = planned.chain(failed.iter().map(|disc| (*disc, HoleState::Failed))).collect();
        if ready && !states.is_empty() {
            with_view(picture, |view| view.set_states(&states));
        }
        failed
    });
}

fn scene(shown: &Shown, zero_mm: Option<[f64; 2]>, palette: &Palette) -> Scene {
    let mut scene = picture::scene(&shown.board, shown.body, palette);
    scene.layers.clone_from(&shown.layers);
    let changes = if read(|m| m.frame.tab == Tab::Board) { changed(shown, palette) } else { Vec::new() };
    scene.layers.extend(changed_copper(palette));
    let mut scene = with_order(scene, shown, palette);
    scene.lines.extend(changes);
    scene.lines.extend(reach(shown, zero_mm, palette));
    scene
}

/// The work zero in machine coordinates, mm, on the Machine screen and if it is reliable. None for a
/// controller that plans its own motion: the page doesn't know its travel limits.
fn zero_in_machine() -> Memo<Option<[f64; 2]>> {
    Memo::new(move |_| {
        read(|m| {
            let status = m.link.status.as_ref()?;
            let is_known = status.trust == Trust::Trusted && !m.link.controller.plans();
            status.zero_mm.filter(|_| is_known && m.frame.tab == Tab::Machine)
        })
    })
}

fn reach(shown: &Shown, zero_mm: Option<[f64; 2]>, palette: &Palette) -> Vec<Line> {
    let place = |at_mm: [f64; 2]| shown.picture_of_work(at_mm);
    zero_mm.map_or_else(Vec::new, |zero_mm| {
        shared(|m| &m.machine).with(|machine| picture::travel_box(machine, zero_mm, place, palette))
    })
}

fn with_order(mut scene: Scene, shown: &Shown, palette: &Palette) -> Scene {
    if read(|m| m.frame.tab == Tab::Board) {
        let (holes, outline) = (layers::kind_seen(LayerKind::Holes), layers::kind_seen(LayerKind::Outline));
        scene.discs.retain(|_| holes);
        scene.slots.retain(|_| holes);
        scene.outline.retain(|_| outline);
        if layers::kind_dimmed(LayerKind::Holes) {
            let ground = palette.plate;
            scene.discs.iter_mut().for_each(|disc| disc.colour = dimmed(disc.colour, ground));
            scene.slots.iter_mut().for_each(|slot| slot.colour = dimmed(slot.colour, ground));
        }
        if !holes {
            return scene;
        }
    }
    let file_order: Vec<u32>;
    let order = if shown.before && read(|m| m.frame.tab == Tab::Board) {
        file_order = (0..shown.board.holes.len() as u32).collect();
        &file_order
    } else {
        &shown.order
    };
    let corner = picture::origin(shown.body);
    scene.lines = picture::travel(&shown.board, corner, shown.start, order, palette);
    match &shown.toolpaths {
        Some(toolpaths) if !(shown.before && read(|m| m.frame.tab == Tab::Board)) => {
            let lit = read(|m| Some(m.job.chosen).filter(|_| m.job.lit && m.frame.tab == Tab::Cam));
            scene.lines = toolpath_lines(shown, toolpaths, lit, palette);
            if lit.is_some_and(|lit| !shown.makes_holes(lit)) {
                scene.discs.iter_mut().for_each(|disc| disc.colour = dimmed(disc.colour, palette.plate));
                scene.slots.iter_mut().for_each(|slot| slot.colour = dimmed(slot.colour, palette.plate));
            }
            if read(|m| m.frame.tab == Tab::Cam) {
                scene.lines.extend(found(shown, palette));
            }
            for (disc, stop) in &shown.discs {
                if let Some(disc) = scene.discs.get_mut(*disc as usize) {
                    disc.order = *stop;
                }
            }
            return scene;
        }
        _ => {}
    }
    if shown.before {
        let quiet = |line: Line| Line { width: Width::Px(1.0), ..line };
        scene.lines = scene.lines.into_iter().map(quiet).collect();
    }
    for (number, hole) in shown.order.iter().enumerate() {
        if let Some(disc) = scene.discs.get_mut(*hole as usize) {
            disc.order = number as u32;
        }
    }
    scene
}

/// The toolpaths in the colours of their kinds of operation. If one operation is lit, the others are dimmed and
/// under it.
fn toolpath_lines(shown: &Shown, toolpaths: &Toolpaths, lit: Option<usize>, palette: &Palette) -> Vec<Line> {
    let with_travel = read(|m| m.frame.show_travel);
    let is_lit = |stop: u32| lit.is_none() || shown.operation_of(stop) == lit;
    let colour = |stop: u32| {
        let colour = palette.operation(shown.colour_of(stop));
        if is_lit(stop) { colour } else { dimmed(colour, palette.plate) }
    };
    let mut lines = picture::toolpaths(toolpaths, palette, colour, with_travel);
    if lit.is_some() {
        lines.sort_by_cached_key(|line| is_lit(line.order));
    }
    lines
}

const CHANGED_ALPHA: u8 = 210;

fn changed_copper(palette: &Palette) -> Vec<FilledLayer> {
    let anew = shared(|m| &m.anew.shown).get().filter(|_| read(|m| m.frame.tab == Tab::Board));
    let compared = anew.and_then(|anew| anew.compared.clone());
    let layer = |mesh: &Mesh, colour: Colour| FilledLayer {
        mesh: Arc::new(mesh.clone()),
        colour: colour.alpha(CHANGED_ALPHA),
        openings: false,
    };
    let marks = compared.iter().flat_map(|compared| &compared.marks);
    marks.flat_map(|side| [layer(&side.gone, palette.failed), layer(&side.added, palette.done)]).collect()
}

fn changed(shown: &Shown, palette: &Palette) -> Vec<Line> {
    let compared = shared(|m| &m.anew.shown).get().and_then(|anew| anew.compared.clone());
    let corner = picture::origin(shown.body);
    compared.map(|compared| picture::changed(&compared.changes, corner, palette)).unwrap_or_default()
}

/// The problems: a dot each, and a ring around the selected one.
fn found(shown: &Shown, palette: &Palette) -> Vec<Line> {
    let corner = picture::origin(shown.body);
    let marked = read(|m| m.job.marked);
    shared(|m| &m.board.proved).with(|proved| {
        let findings = proved.iter().flat_map(|proved| &proved.findings).enumerate();
        let marks = findings.flat_map(|(at, finding)| {
            let joined = matches!(finding.kind, proof::FindingKind::Gap | proof::FindingKind::Short);
            let colour = if joined { palette.joined } else { palette.finding };
            picture::finding(picture::place(corner, finding.at), marked == Some(at), colour, palette)
        });
        marks.collect()
    })
}

fn describe(shown: &Shown) -> String {
    let sizes = picture::sizes(&shown.board).len();
    say!("page.view.summary", name = shown.board.name, holes = shown.board.holes.len(), sizes = sizes)
}
