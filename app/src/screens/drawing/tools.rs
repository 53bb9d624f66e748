//! The tools, and the properties of the next thing to draw.

use super::focus_picture;
use super::inputs::{self, COPPER, Choices, LAYERS, SHAPES};
use crate::drawing::fields::Field;
use crate::drawing::{Act, DrawKey, GRIDS, Pen, Tool};
use crate::i18n::{self, key, t};
use crate::keys::KeyAction;
use crate::model::DrawEvent;
use crate::page::{computed, key_of, peek, read, send, watch};
use crate::widgets::{Icon, picture_button_if, tick};
use annulus_core::board::drawing::Layer;
use annulus_core::units::Length;
use leptos::ev;
use leptos::html::{self, button, div, h2, header, section, select, span};
use leptos::prelude::*;

fn word(tool: Tool) -> &'static str {
    match tool {
        Tool::Select => key!("page.draw.tool.select"),
        Tool::Track => key!("page.draw.tool.track"),
        Tool::Pad => key!("page.draw.tool.pad"),
        Tool::Hole => key!("page.draw.tool.hole"),
        Tool::Node => key!("page.draw.tool.node"),
        Tool::Measure => key!("page.draw.tool.measure"),
    }
}

pub(super) fn tools() -> impl IntoView {
    let buttons = Tool::ALL.map(|tool| {
        let name = word(tool);
        let letter = move || key_of(KeyAction::Draw(DrawKey::Tool(tool)));
        button()
            .attr("type", "button")
            .class("button")
            .attr("aria-pressed", move || if read(|m| m.draw.editor.tool) == tool { "true" } else { "false" })
            .attr("aria-keyshortcuts", letter)
            .on(ev::click, move |_| {
                send(DrawEvent::Take { tool });
                focus_picture();
            })
            .child((
                span().child(move || i18n::text(name, &[])),
                html::kbd().attr("aria-hidden", "true").child(letter),
            ))
    });
    section().class("block draw-tools").attr("aria-label", t!("page.draw.tools")).child((
        header().child((h2().child(t!("page.draw.tools")), undo())),
        div()
            .class("tool-grid")
            .attr("role", "group")
            .attr("aria-label", t!("page.draw.tools"))
            .child(Vec::from(buttons)),
        pen,
        grid(),
    ))
}

fn undo() -> impl IntoView {
    let can = computed(|m| m.draw.editor.can_undo());
    div().class("row").child((
        picture_button_if(
            Icon::Undo,
            move || can.get().0,
            t!("page.draw.undo"),
            |_| send(DrawEvent::Act { act: Act::Undo { back: true } }),
        ),
        picture_button_if(
            Icon::Redo,
            move || can.get().1,
            t!("page.draw.redo"),
            |_| send(DrawEvent::Act { act: Act::Undo { back: false } }),
        ),
    ))
}

fn change(edit: impl FnOnce(&mut Pen)) {
    let mut pen = peek(|m| m.draw.editor.pen);
    edit(&mut pen);
    send(DrawEvent::Pen { pen });
}

pub(crate) fn draw_edge() {
    change(|pen| pen.layer = Layer::Edge);
    send(DrawEvent::Key { key: DrawKey::Tool(Tool::Track) });
    focus_picture();
}

fn pen() -> impl IntoView {
    move || match read(|m| m.draw.editor.tool) {
        Tool::Track => div().class("draw-pen").child((layers(&LAYERS), size(Field::Width))).into_any(),
        Tool::Pad => div()
            .class("draw-pen")
            .child((layers(&COPPER), shapes(), size(Field::Size), drilled(), size(Field::Diameter)))
            .into_any(),
        Tool::Hole => div().class("draw-pen").child((size(Field::Diameter), plated())).into_any(),
        Tool::Select | Tool::Node | Tool::Measure => ().into_any(),
    }
}

fn layers(choices: &'static Choices<Layer>) -> impl IntoView {
    let now = move || {
        read(|m| {
            let editor = &m.draw.editor;
            if editor.tool == Tool::Pad { editor.pen.copper } else { editor.pen.layer }
        })
    };
    choices.buttons(t!("page.draw.field.layer"), now, |layer| change(|pen| pen.draw_on(layer)))
}

fn shapes() -> impl IntoView {
    let take = |shape| change(|pen| pen.shape = shape);
    SHAPES.buttons(t!("page.draw.field.shape"), || read(|m| m.draw.editor.pen.shape), take)
}

fn size(field: Field) -> impl IntoView {
    let pen = watch(|m| &m.draw.editor.pen);
    let value = Memo::new(move |_| {
        let pen = pen.get();
        Some(match field {
            Field::Width => pen.width,
            Field::Size => pen.size,
            _ => pen.diameter,
        })
    });
    let id = format!("pen-{}", field.word());
    inputs::length(id, field, value.into(), move |text| send(DrawEvent::PenSize { field, text }))
}

fn drilled() -> impl IntoView {
    tick(|| read(|m| m.draw.editor.pen.drilled), t!("page.draw.drilled"), |on| change(|pen| pen.drilled = on))
}

fn plated() -> impl IntoView {
    tick(
        || read(|m| m.draw.editor.pen.plated),
        t!("page.draw.field.plated"),
        |on| change(|pen| pen.plated = on),
    )
}

fn grid() -> impl IntoView {
    let grid = watch(|m| &m.draw.editor.grid);
    let step = Memo::new(move |_| grid.get().step);
    let options = move || {
        let (unit, now) = (read(|m| m.frame.unit), step.get());
        let known = GRIDS.into_iter().chain((!GRIDS.contains(&now)).then_some(now));
        let word = |one: Length| {
            let text = format!("{} {}", i18n::number(unit.short(one.mm())), i18n::unit_word());
            html::option()
                .attr("value", format!("{}mm", one.mm()))
                .prop("selected", move || step.get() == one)
                .child(text)
        };
        known.map(word).collect::<Vec<_>>()
    };
    div().class("row").child((
        tick(move || grid.get().on, t!("page.draw.snap"), |_| send(DrawEvent::Act { act: Act::Snap })),
        select()
            .attr("aria-label", t!("page.draw.grid"))
            .on(ev::change, |event| send(DrawEvent::Grid { text: event_target_value(&event) }))
            .child(options),
        tick(
            move || read(|m| m.draw.editor.dim),
            t!("page.draw.dim"),
            |_| send(DrawEvent::Act { act: Act::Dim }),
        ),
    ))
}
