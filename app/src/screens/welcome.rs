//! The empty page: drop files, open files or a link, try the sample, or go on with one of the projects that were open before.
//!
//! Comes in: nothing. Goes out: files chosen.

use crate::i18n::{language, say, t};
use crate::keys::Tab;
use crate::model::{FilesEvent, FrameEvent, KeepEvent, Offer};
use crate::page::{frame, open_board, send};
use crate::widgets::{Icon, icon, push};
use js_sys::Date;
use leptos::ev;
use leptos::html::{button, details, div, form, h2, input, label, li, p, section, span, strong, summary, ul};
use leptos::prelude::*;
use wasm_bindgen::JsValue;
use web_sys::SubmitEvent;

/// The sheet.
pub(crate) fn welcome() -> impl IntoView {
    let sample =
        button().attr("type", "button").class("tile").on(ev::click, |_| send(FilesEvent::Sample)).child((
            icon(Icon::Annulus),
            span().child((
                strong().child(t!("page.welcome.sample")),
                span().class("quiet").child(t!("page.welcome.sample_is")),
            )),
        ));
    let draw = button()
        .attr("type", "button")
        .class("tile")
        .on(ev::click, |_| send(FrameEvent::Show { tab: Tab::Draw }))
        .child((
            icon(Icon::Pencil),
            span().child((
                strong().child(t!("page.welcome.draw")),
                span().class("quiet").child(t!("page.welcome.draw_is")),
            )),
        ));
    let machine = button()
        .attr("type", "button")
        .class("tile")
        .on(ev::click, |_| send(FrameEvent::Show { tab: Tab::Machine }))
        .child((
            icon(Icon::Plug),
            span().child((
                strong().child(t!("page.welcome.machine")),
                span().class("quiet").child(t!("page.welcome.machine_is")),
            )),
        ));
    div().class("whole welcome").child(div().class("sheet").child((
        last(),
        div().class("drop").child((
            icon(Icon::Annulus),
            h2().child(t!("page.welcome.title")),
            p().class("quiet").child(t!("page.welcome.kinds")),
            push("button large primary", t!("page.welcome.open"), |_| send(FilesEvent::Choose)),
        )),
        div().class("tiles").child((sample, draw, machine)),
        link_to,
        earlier,
        p().class("promise").child((icon(Icon::Lock), t!("page.welcome.promise"))),
    )))
}

/// A link to a board, put in by hand; where a bridge serves the page, it may ask no other server.
fn link_to() -> impl IntoView {
    frame().alone.get().then(|| {
        let link = RwSignal::new(String::new());
        let field = input()
            .attr("type", "url")
            .attr("inputmode", "url")
            .attr("placeholder", "https://")
            .attr("autocomplete", "off")
            .prop("value", link)
            .on(ev::input, move |event| link.set(event_target_value(&event)));
        let open = move |event: SubmitEvent| {
            event.prevent_default();
            send(FilesEvent::Link { address: link.get_untracked() });
        };
        form().class("link-to").attr("novalidate", "").on(ev::submit, open).child((
            label().class("field grow").child((span().child(t!("page.welcome.link")), field)),
            button().attr("type", "submit").class("button").child(t!("page.welcome.open_link")),
        ))
    })
}

/// The projects that were open before: the last one above all, the others in a list that opens.
pub(super) fn last() -> impl IntoView {
    move || {
        open_board().offers.with(|offers| offers.first().cloned()).map(|offer| kept(offer, Some("status")))
    }
}

/// Those before the last one.
fn earlier() -> impl IntoView {
    let rows = rows(1);
    let count = rows.len();
    (count > 0).then(|| {
        details()
            .class("earlier")
            .child((summary().child(t!("page.kept.earlier", count = count)), ul().child(rows)))
    })
}

/// Those that are kept beside the open one, to go on with one of them, in a list that opens.
pub(super) fn others() -> impl IntoView {
    // What was open before another one is kept from then on.
    Effect::new(move |_| {
        open_board().document.track();
        send(KeepEvent::Listed);
    });
    let count = Memo::new(move |_| open_board().offers.with(Vec::len));
    let open = RwSignal::new(false);
    let toggled = move |_| open.update(|open| *open = !*open);
    let list = move || {
        let words = move || say!("page.kept.earlier", count = count.get());
        let rows = move || open.get().then(|| ul().child(rows(0)));
        let list = details().class("earlier").on(ev::toggle, toggled).child((summary().child(words), rows));
        section().class("block others").child(list)
    };
    let any = Memo::new(move |_| count.get() > 0);
    move || any.get().then(list)
}

/// Those that are kept but the first `skipped`, a row each.
fn rows(skipped: usize) -> Vec<AnyView> {
    let offers = open_board().offers.get();
    offers.into_iter().skip(skipped).map(|offer| li().child(kept(offer, None)).into_any()).collect()
}

/// The offer of what was open before; its buttons are described by its sentence. The `role` of that is a status where it is told by
/// itself.
pub(super) fn kept(offer: Offer, role: Option<&'static str>) -> impl IntoView {
    let sentence_id = format!("kept-{}", offer.place);
    let described = sentence_id.clone();
    let at = Date::new(&offer.at_ms.into()).to_locale_string(&language(), &JsValue::UNDEFINED);
    let (name, at) = (offer.name.clone(), String::from(at));
    let label = t!("page.kept.title");
    let (again, elsewhere) = (offer.clone(), offer.elsewhere);
    let sentence = if elsewhere {
        t!("page.kept.elsewhere", name = name)
    } else {
        t!("page.kept.offer", name = name, at = at)
    };
    let restore = if elsewhere { t!("page.kept.open_copy") } else { t!("page.kept.restore") };
    section().class("kept").attr("aria-label", label).child((
        p().class("grow").id(sentence_id).attr("role", role).child(sentence),
        push("button", restore, move |_| send(KeepEvent::Restore { offer: again.clone() }))
            .attr("aria-describedby", described.clone()),
        (!elsewhere).then(|| {
            push("button", t!("page.kept.discard"), move |event| {
                // At the second press of a double click the next board lies under the pointer.
                if event.detail() < 2 {
                    send(KeepEvent::Discard { offer: offer.clone() });
                }
            })
            .attr("aria-describedby", described)
        }),
    ))
}
