//! The drawing in the picture, and the pointer over it.
//!
//! Comes in: sheet and marks. Goes out: a scene; what the pointer does, in mm. Knows no GPU.

use crate::drawing::scene;
use crate::i18n::say;
use crate::keys::Tab;
use crate::model::DrawEvent;
use crate::page::{frame, open_drawing, send};
use crate::screens::canvas::{Picture, with_view};
use crate::view::{Palette, PointerStroke, Touch};
use annulus_core::board::drawing::Layer;
use leptos::ev;
use leptos::prelude::*;
use web_sys::KeyboardEvent;

/// So much of the board is across where one place is looked at, in mm.
const LOOK_MM: f64 = 12.0;

/// What a pointer does that draws.
pub(crate) fn stroke(stroke: PointerStroke) {
    let PointerStroke { touch, at_mm, shift, ctrl } = stroke;
    if touch == Touch::Down {
        super::focus_picture();
    }
    send(DrawEvent::Point { touch, at_mm, shift, ctrl });
}

/// The side that lies in front: that which is drawn on, else that which is looked at.
fn front() -> Layer {
    match open_drawing().pen.get().layer {
        Layer::Bottom => Layer::Bottom,
        Layer::Top => Layer::Top,
        _ if frame().flipped.get() => Layer::Bottom,
        _ => Layer::Top,
    }
}

/// While Space is held the pointer moves the picture.
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

/// Whatever is drawn goes to the picture while the screen is on show.
pub(crate) fn in_picture(picture: Picture, ready: RwSignal<bool>, palette: Memo<Palette>) {
    let drawing = open_drawing();
    let on = Memo::new(move |_| ready.get() && frame().tab.get() == Tab::Draw);
    let front = Memo::new(move |_| (front(), drawing.dim.get().then(|| drawing.pen.get().layer)));
    Effect::new(move |_| {
        let on = on.get();
        with_view(picture, |view| view.set_strokes(on));
    });
    space_moves(picture);
    // What is looked at anew is in the picture by then.
    Effect::new(move |before: Option<Option<u32>>| {
        let (look, at) = drawing.look.get();
        if !on.get() {
            return None;
        }
        let (sheet, lit, front, palette) =
            (drawing.sheet.get(), drawing.lit.get(), front.get(), palette.get());
        let under = drawing.under.get();
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
        let (marks, palette) = (drawing.marks.get(), palette.get());
        with_view(picture, |view| {
            view.set_over(if on { scene::over(&marks, &palette) } else { Vec::new() });
            if on {
                view.set_head(marks.cross);
            }
        });
    });
    Effect::new(move |_| {
        let (name, count) = drawing.title.get();
        if on.get() {
            let text = say!("page.draw.summary", name = name, count = count);
            with_view(picture, |view| view.describe(&text));
        }
    });
}
