//! The empty page: drop files, open files, or try the sample.
//!
//! Comes in: nothing. Goes out: files chosen.

use crate::i18n::t;
use crate::screens::opening;
use crate::widgets::{Icon, icon, push};
use leptos::ev;
use leptos::html::{button, div, h2, p, span, strong};
use leptos::prelude::*;

/// The sheet.
pub(crate) fn welcome() -> impl IntoView {
    let sample = button().attr("type", "button").class("tile").on(ev::click, |_| opening::sample()).child((
        icon(Icon::Annulus),
        span().child((
            strong().child(t!("page.welcome.sample")),
            span().class("quiet").child(t!("page.welcome.sample_is")),
        )),
    ));
    let machine =
        button().attr("type", "button").class("tile").on(ev::click, |_| opening::to_machine()).child((
            icon(Icon::Plug),
            span().child((
                strong().child(t!("page.welcome.machine")),
                span().class("quiet").child(t!("page.welcome.machine_is")),
            )),
        ));
    div().class("whole welcome").child(div().class("sheet").child((
        div().class("drop").child((
            icon(Icon::Annulus),
            h2().child(t!("page.welcome.title")),
            p().class("quiet").child(t!("page.welcome.kinds")),
            push("button large primary", t!("page.welcome.open"), |_| opening::choose()),
        )),
        div().class("tiles").child((sample, machine)),
        p().class("promise").child((icon(Icon::Lock), t!("page.welcome.promise"))),
    )))
}
