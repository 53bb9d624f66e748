//! The commands on the selection.

use crate::drawing::keys::QUARTER_MDEG;
use crate::drawing::{Act, AtHand, When};
use crate::i18n::{self, key, t};
use crate::model::DrawEvent;
use crate::page::{read, send, watch};
use crate::widgets::push_if;
use annulus_core::board::drawing::{Align, Sides};
use leptos::html::{div, h2, h3, header, section};
use leptos::prelude::*;

pub(in crate::screens) fn may(when: When) -> bool {
    let (copied, files) = read(|m| (m.draw.editor.clip.is_some(), m.draw.over().0));
    watch(|m| &m.draw.editor.chosen).with(|chosen| when.holds(AtHand { chosen, copied, files }))
}

fn button(name: &'static str, act: Act) -> AnyView {
    let press = move |_| send(DrawEvent::Act { act });
    push_if("button small", move || may(act.when()), move || i18n::text(name, &[]), press).into_any()
}

fn align(x: bool, sides: Sides, name: &'static str) -> AnyView {
    button(name, Act::Align(Align { x, sides }))
}

fn row(name: &'static str, buttons: Vec<AnyView>) -> impl IntoView {
    let words = move || i18n::text(name, &[]);
    div()
        .class("draw-acts")
        .attr("role", "group")
        .attr("aria-label", words)
        .child((h3().child(words), div().class("row").child(buttons)))
}

pub(super) fn actions() -> impl IntoView {
    let clip = vec![
        button(key!("page.draw.act.copy"), Act::Copy),
        button(key!("page.draw.act.cut"), Act::Cut),
        button(key!("page.draw.act.paste"), Act::Paste),
        button(key!("page.draw.act.duplicate"), Act::Duplicate),
        button(key!("page.draw.act.delete"), Act::Delete),
        button(key!("page.draw.act.put_back"), Act::PutBack),
    ];
    let turn = vec![
        button(key!("page.draw.act.left"), Act::Turn { mdeg: QUARTER_MDEG }),
        button(key!("page.draw.act.right"), Act::Turn { mdeg: -QUARTER_MDEG }),
        button(key!("page.draw.act.mirror_x"), Act::Mirror { x: true }),
        button(key!("page.draw.act.mirror_y"), Act::Mirror { x: false }),
    ];
    let lines = vec![
        align(true, Sides::Low, key!("page.draw.act.align_left")),
        align(true, Sides::Middle, key!("page.draw.act.align_middle_x")),
        align(true, Sides::High, key!("page.draw.act.align_right")),
        align(false, Sides::Low, key!("page.draw.act.align_low")),
        align(false, Sides::Middle, key!("page.draw.act.align_middle_y")),
        align(false, Sides::High, key!("page.draw.act.align_high")),
    ];
    let group =
        push_if("button small", || may(When::GROUP), t!("page.draw.act.group"), |_| send(DrawEvent::Group));
    let array =
        push_if("button small", || may(When::ARRAY), t!("page.draw.act.array"), |_| super::array::open());
    let groups = vec![
        group.into_any(),
        button(key!("page.draw.act.ungroup"), Act::Ungroup),
        array.into_any(),
        button(key!("page.draw.act.all"), Act::All),
    ];
    section().class("block draw-actions").attr("aria-label", t!("page.draw.acts")).child((
        header().child(h2().child(t!("page.draw.acts"))),
        row(key!("page.draw.act.copies"), clip),
        row(key!("page.draw.act.turns"), turn),
        row(key!("page.draw.act.aligns"), lines),
        row(key!("page.draw.act.groups"), groups),
    ))
}
