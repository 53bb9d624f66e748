//! The tools, and with what the next thing is drawn.
//!
//! Comes in: tool, pen, grid. Goes out: others.

use super::focus_picture;
use super::inputs::{self, COPPER, Choices, LAYERS, SHAPES, tick};
use crate::drawing::fields::Field;
use crate::drawing::{Act, DrawKey, GRIDS, Pen, Tool};
use crate::i18n::{self, key, t};
use crate::keys::KeyAction;
use crate::model::DrawEvent;
use crate::page::{frame, key_of, open_drawing, send};
use crate::widgets::{Icon, picture_button_if};
use annulus_core::board::drawing::Layer;
use annulus_core::units::Length;
use leptos::ev;
use leptos::html::{self, button, div, h2, header, section, select, span};
use leptos::prelude::*;

/// The name of a tool.
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

/// The blocks.
pub(super) fn tools() -> impl IntoView {
    let drawing = open_drawing();
    let buttons = Tool::ALL.map(|tool| {
        let name = word(tool);
        let letter = move || key_of(KeyAction::Draw(DrawKey::Tool(tool)));
        button()
            .attr("type", "button")
            .class("button")
            .attr("aria-pressed", move || if drawing.tool.get() == tool { "true" } else { "false" })
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
    let can = open_drawing().can_undo;
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
    let mut pen = open_drawing().pen.get_untracked();
    edit(&mut pen);
    send(DrawEvent::Pen { pen });
}

/// From now on tracks are drawn that are the edge of the board.
pub(crate) fn draw_edge() {
    change(|pen| pen.layer = Layer::Edge);
    send(DrawEvent::Key { key: DrawKey::Tool(Tool::Track) });
    focus_picture();
}

/// What the tool in hand asks for.
fn pen() -> impl IntoView {
    let drawing = open_drawing();
    let tool = Memo::new(move |_| drawing.tool.get());
    move || match tool.get() {
        Tool::Track => div().class("draw-pen").child((layers(&LAYERS), size(Field::Width))).into_any(),
        Tool::Pad => div()
            .class("draw-pen")
            .child((layers(&COPPER), shapes(), size(Field::Size), drilled(), size(Field::Diameter)))
            .into_any(),
        Tool::Hole => div().class("draw-pen").child((size(Field::Diameter), plated())).into_any(),
        Tool::Select | Tool::Node | Tool::Measure => ().into_any(),
    }
}

/// The layers that the tool in hand can draw on.
fn layers(choices: &'static Choices<Layer>) -> impl IntoView {
    let drawing = open_drawing();
    let now = move || {
        let pen = drawing.pen.get();
        if drawing.tool.get() == Tool::Pad { pen.copper } else { pen.layer }
    };
    choices.buttons(t!("page.draw.field.layer"), now, |layer| change(|pen| pen.draw_on(layer)))
}

fn shapes() -> impl IntoView {
    let pen = open_drawing().pen;
    let take = |shape| change(|pen| pen.shape = shape);
    SHAPES.buttons(t!("page.draw.field.shape"), move || pen.get().shape, take)
}

fn size(field: Field) -> impl IntoView {
    let pen = open_drawing().pen;
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
    let pen = open_drawing().pen;
    tick(move || pen.get().drilled, t!("page.draw.drilled"), |on| change(|pen| pen.drilled = on))
}

fn plated() -> impl IntoView {
    let pen = open_drawing().pen;
    tick(move || pen.get().plated, t!("page.draw.field.plated"), |on| change(|pen| pen.plated = on))
}

/// Whether the pointer snaps, and to which grid.
fn grid() -> impl IntoView {
    let grid = open_drawing().grid;
    let step = Memo::new(move |_| grid.get().step);
    let options = move || {
        let (unit, now) = (frame().unit.get(), step.get());
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
            move || open_drawing().dim.get(),
            t!("page.draw.dim"),
            |_| {
                send(DrawEvent::Act { act: Act::Dim });
            },
        ),
    ))
}
