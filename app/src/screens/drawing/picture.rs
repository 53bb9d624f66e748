//! Shows the drawing in the picture, and passes the pointer to the editor.

use crate::drawing::scene;
use crate::i18n::say;
use crate::keys::Tab;
use crate::model::DrawEvent;
use crate::page::{computed, read, send, shared};
use crate::screens::canvas::{Picture, with_view};
use crate::view::{Palette, PointerStroke, Touch};
use annulus_core::board::drawing::Layer;
use leptos::ev;
use leptos::prelude::*;
use web_sys::KeyboardEvent;

/// Width of board in view when one position is shown, mm.
const LOOK_MM: f64 = 12.0;

pub(crate) fn stroke(stroke: PointerStroke) {
    let PointerStroke { touch, at_mm, shift, ctrl } = stroke;
    if touch == Touch::Down {
        super::focus_picture();
    }
    send(DrawEvent::Point { touch, at_mm, shift, ctrl });
}

/// The side in front: the active layer's, else the one that the camera looks at.
fn front() -> Layer {
    match read(|m| m.draw.editor.pen.layer) {
        Layer::Bottom => Layer::Bottom,
        Layer::Top => Layer::Top,
        _ if read(|m| m.frame.flipped) => Layer::Bottom,
        _ => Layer::Top,
    }
}

/// Holding Space pans the picture.
fn space_moves(picture: Picture) {
    let space = move |on: bool| {
        move |event: KeyboardEvent| {
            if event.key() == " " {
                with_view(picture, |view| view.set_space(on));
            }
        }
    };
    let down = window_event_listener(ev::keydown, space(true));
    let up = window_event_listener(ev::keyup, space(false));
    let away = window_event_listener(ev::blur, move |_| {
        with_view(picture, |view| view.set_space(false));
    });
    on_cleanup(move || {
        down.remove();
        up.remove();
        away.remove();
    });
}

pub(crate) fn in_picture(picture: Picture, ready: RwSignal<bool>, palette: Memo<Palette>) {
    let on = Memo::new(move |_| ready.get() && read(|m| m.frame.tab == Tab::Draw));
    let front = Memo::new(move |_| (front(), read(|m| m.draw.editor.dim.then_some(m.draw.editor.pen.layer))));
    Effect::new(move |_| {
        let on = on.get();
        with_view(picture, |view| view.set_strokes(on));
    });
    space_moves(picture);
    // Scene and camera in one effect: the scene must have a new position before the camera moves there.
    Effect::new(move |before: Option<Option<u32>>| {
        let (look, at) = read(|m| m.draw.look);
        if !on.get() {
            return None;
        }
        let (sheet, lit) = (shared(|m| &m.draw.shown.sheet).get(), shared(|m| &m.draw.shown.chosen).get());
        let (front, palette) = (front.get(), palette.get());
        let under = shared(|m| &m.draw.shown.under).get();
        with_view(picture, |view| {
            view.set_palette(palette);
            view.set_scene(scene::scene((&sheet, &under), &lit, front, &palette));
            view.set_selected(&lit.holes);
            match (before.flatten(), at) {
                (Some(before), _) if before == look => {}
                (Some(_), Some(at)) => view.look_at(at, LOOK_MM),
                _ => view.fit(),
            }
        });
        Some(look)
    });
    Effect::new(move |_| {
        let on = on.get();
        let (marks, palette) = (shared(|m| &m.draw.shown.marks).get(), palette.get());
        with_view(picture, |view| {
            view.set_over(if on { scene::over(&marks, &palette) } else { Vec::new() });
            if on {
                view.set_head(marks.cross);
            }
        });
    });
    Effect::new(move |_| {
        let name = computed(|m| m.draw.editor.drawing().name().to_owned()).get();
        let count = read(|m| m.draw.editor.drawing().len());
        if on.get() {
            let text = say!("page.draw.summary", name = name, count = count);
            with_view(picture, |view| view.describe(&text));
        }
    });
}
