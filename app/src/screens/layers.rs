//! The layers panel: visibility, colour and opacity of each layer, presets, and the side to look from.

use crate::engine::messages::LayerRow;
use crate::i18n::{key, say, t};
use crate::layers::{self, LayerKind, LayerLook, LayerSide, Preset};
use crate::model::FrameEvent;
use crate::page::{read, send, shared, watch};
use crate::view::{Colour, FilledLayer, Mesh, Palette};
use crate::widgets::{Icon, choice, picture_button, push, segmented};
use annulus_core::board::Face;
use leptos::ev;
use leptos::html::{div, h2, header, input, li, section, span, ul};
use leptos::prelude::*;
use std::sync::Arc;

/// The filled layers as the board is placed on the machine, lowest first. Of the copper, only the side that
/// is up is visible, unless the user hid it.
pub(crate) fn seen_laid() -> Vec<FilledLayer> {
    let Some(laid) = shared(|m| &m.board.laid).get() else { return Vec::new() };
    let face = read(|m| Some(m.job.work.as_ref()?.setup.face)).unwrap_or_default();
    watch(|m| &m.frame.layers).with(|looks| {
        let rows = laid.laid.layers.iter().zip(&laid.meshes);
        let up = if face == Face::Top { LayerKind::CopperTop } else { LayerKind::CopperBottom };
        let layer = |(row, mesh): (&LayerRow, &Arc<Mesh>)| {
            let kind = LayerKind::of(row.role, row.side);
            let look = looks.iter().find(|look| look.kind == kind).filter(|look| look.eye && kind == up)?;
            Some(FilledLayer { mesh: mesh.clone(), colour: look.tint(&Palette::DARK), openings: false })
        };
        rows.filter_map(layer).collect()
    })
}

/// The visible filled layers, lowest first.
pub(crate) fn seen() -> Vec<FilledLayer> {
    let from_below = read(|m| m.frame.flipped);
    shared(|m| &m.board.document).with(|document| {
        let Some(document) = document else { return Vec::new() };
        watch(|m| &m.frame.layers).with(|looks| {
            let layer = |look: &LayerLook| {
                let mesh = document.meshes.get(look.mesh?)?.clone();
                let colour = layers::tint_among(look, looks, &Palette::DARK);
                Some(FilledLayer { mesh, colour, openings: look.is_film() })
            };
            layers::drawn(looks, from_below).into_iter().filter_map(layer).collect()
        })
    })
}

/// True if layers of this kind are visible. Used for holes and outline.
pub(crate) fn kind_seen(kind: LayerKind) -> bool {
    watch(|m| &m.frame.layers)
        .with(|looks| looks.iter().filter(|look| look.kind == kind).all(|look| look.eye))
}

/// True if this kind is dimmed because another layer is highlighted. Used for holes and outline.
pub(crate) fn kind_dimmed(kind: LayerKind) -> bool {
    watch(|m| &m.frame.layers).with(|looks| {
        let own = looks.iter().find(|look| look.kind == kind);
        own.is_some_and(|look| layers::is_dimmed(look, looks))
    })
}

const PRESETS: [(Preset, &str); 7] = [
    (Preset::All, key!("page.layers.all")),
    (Preset::Top, key!("page.side.top")),
    (Preset::Bottom, key!("page.side.bottom")),
    (Preset::Copper, key!("page.kind.copper")),
    (Preset::Holes, key!("page.layers.holes")),
    (Preset::Drawn, key!("page.layers.drawn")),
    (Preset::Made, key!("page.layers.made")),
];

pub(crate) fn panel() -> impl IntoView {
    let presets = PRESETS.map(|(preset, name)| {
        push(
            "button small",
            move || crate::i18n::text(name, &[]),
            move |_| send(FrameEvent::LayerPreset { preset }),
        )
    });
    let flipped = || read(|m| m.frame.flipped);
    let count = || read(|m| m.frame.layers.len());
    let lines = move || (0..count()).map(|index| line(index).into_any()).collect::<Vec<_>>();
    section().class("block layers").attr("aria-label", t!("page.layers.title")).child((
        header().child((
            h2().child(t!("page.layers.title")),
            segmented(
                t!("page.layers.seen_from"),
                (
                    choice(
                        move || !flipped(),
                        t!("page.side.top"),
                        |_| send(FrameEvent::Flip { below: Some(false) }),
                    ),
                    choice(flipped, t!("page.side.bottom"), |_| send(FrameEvent::Flip { below: Some(true) })),
                ),
            ),
        )),
        ul().child(lines),
        div()
            .class("row")
            .attr("role", "group")
            .attr("aria-label", t!("page.layers.presets"))
            .child(Vec::from(presets)),
    ))
}

pub(crate) fn kind_locked(kind: LayerKind) -> bool {
    watch(|m| &m.frame.layers)
        .with_untracked(|looks| looks.iter().any(|look| look.kind == kind && look.locked))
}

fn name_of(look: &LayerLook) -> String {
    let side = match look.side {
        LayerSide::Top => say!("page.side.top"),
        LayerSide::Bottom => say!("page.side.bottom"),
        LayerSide::Both => String::new(),
    };
    let what = match look.kind {
        LayerKind::CopperTop | LayerKind::CopperBottom => say!("page.kind.copper"),
        LayerKind::CopperInner => say!("page.layers.inner"),
        LayerKind::Mask => say!("page.kind.mask"),
        LayerKind::Silk => say!("page.kind.silk"),
        LayerKind::Paste => say!("page.kind.paste"),
        LayerKind::Other => say!("page.kind.other"),
        LayerKind::Holes => say!("page.layers.holes"),
        LayerKind::Outline => say!("page.kind.outline"),
    };
    if side.is_empty() { what } else { say!("page.layers.name", what = what, side = side) }
}

fn line(index: usize) -> impl IntoView {
    let look = Memo::new(move |_| watch(|m| &m.frame.layers).with(|looks| looks.get(index).cloned()));
    let name = move || look.with(|look| look.as_ref().map(name_of).unwrap_or_default());
    let eye = Memo::new(move |_| look.with(|look| look.as_ref().is_some_and(|look| look.eye)));
    let opacity = Memo::new(move |_| look.with(|look| look.as_ref().map_or(0, |look| look.opacity)));
    let colour = Memo::new(move |_| {
        look.with(|look| look.as_ref().map_or_else(String::new, |look| look.tint(&Palette::DARK).css()))
    });
    let filled = Memo::new(move |_| look.with(|look| look.as_ref().is_some_and(|look| look.mesh.is_some())));
    let eye_name = move || {
        if eye.get() {
            say!("page.layers.hide", name = name())
        } else {
            say!("page.layers.show", name = name())
        }
    };
    let strength = move || {
        filled.get().then(|| {
            let set = move |event| {
                if let Ok(percent) = event_target_value(&event).parse() {
                    send(FrameEvent::LayerOpacity { index, percent });
                }
            };
            (
                input()
                    .attr("type", "color")
                    .attr("aria-label", move || say!("page.layers.colour", name = name()))
                    .prop("value", move || colour.get().get(..7).unwrap_or_default().to_owned())
                    .on(ev::input, move |event| {
                        let colour = Colour::of_css(&event_target_value(&event));
                        send(FrameEvent::LayerColour { index, colour });
                    }),
                input()
                    .attr("type", "range")
                    .attr("min", "0")
                    .attr("max", "100")
                    .attr("step", "5")
                    .attr("aria-label", move || say!("page.layers.opacity", name = name()))
                    .attr("aria-valuetext", move || format!("{} %", opacity.get()))
                    .prop("value", move || opacity.get().to_string())
                    .on(ev::input, set),
            )
        })
    };
    li().class(move || if eye.get() { "layer" } else { "layer off" }).child((
        picture_button(Icon::Eye, eye_name, move |_| send(FrameEvent::LayerEye { index })),
        front(index, look),
        strength,
        lock(index, look),
    ))
}

/// The name of a layer; pressing it highlights the layer and dims the others.
fn front(index: usize, look: Memo<Option<LayerLook>>) -> impl IntoView {
    let name = move || look.with(|look| look.as_ref().map(name_of).unwrap_or_default());
    let is_front = Memo::new(move |_| look.with(|look| look.as_ref().is_some_and(|look| look.front)));
    push("grow front", name, move |_| send(FrameEvent::LayerFront { index }))
        .attr("aria-pressed", move || if is_front.get() { "true" } else { "false" })
        .attr("title", t!("page.layers.front"))
}

/// The lock of a layer, if things on it can be selected.
fn lock(index: usize, look: Memo<Option<LayerLook>>) -> impl IntoView {
    let locked = Memo::new(move |_| look.with(|look| look.as_ref().is_some_and(|look| look.locked)));
    let name = move || {
        let name = look.with(|look| look.as_ref().map(name_of).unwrap_or_default());
        if locked.get() {
            say!("page.layers.unlock", name = name)
        } else {
            say!("page.layers.lock", name = name)
        }
    };
    let can_be =
        Memo::new(move |_| look.with(|look| look.as_ref().is_some_and(|look| look.kind.can_be_locked())));
    let class = move || if locked.get() { "lock" } else { "lock off" };
    move || {
        let press = move |_| send(FrameEvent::LayerLock { index });
        can_be.get().then(|| span().class(class).child(picture_button(Icon::Lock, name, press)))
    }
}
