//! The empty page: drop files, open files or a link, try the sample, or reopen a saved project. Asks once which
//! machine the user has.

use crate::i18n::{Words, language, say, t};
use crate::keys::Tab;
use crate::model::{FilesEvent, FrameEvent, KeepEvent, Offer};
use crate::page::{read, send, shared, watch};
use crate::screens::machines;
use crate::widgets::{Icon, icon, push};
use js_sys::Date;
use leptos::ev::{self, MouseEvent};
use leptos::html::{
    button, details, div, form, h2, input, label, li, p, progress, section, span, strong, summary, ul,
};
use leptos::prelude::*;
use wasm_bindgen::JsValue;
use web_sys::SubmitEvent;

pub(crate) fn welcome() -> impl IntoView {
    let sample = tile(Icon::Annulus, t!("page.welcome.sample"), t!("page.welcome.sample_is"), |_| {
        send(FilesEvent::Sample);
    });
    let draw = tile(Icon::Pencil, t!("page.welcome.draw"), t!("page.welcome.draw_is"), |_| {
        send(FrameEvent::Show { tab: Tab::Draw });
    });
    let machine = tile(Icon::Plug, t!("page.welcome.machine"), t!("page.welcome.machine_is"), |_| {
        send(FrameEvent::Show { tab: Tab::Machine });
    });
    div().class("whole welcome").child(div().class("sheet").child((
        last(),
        drop_area(),
        div().class("tiles").child((sample, draw, machine)),
        machines::question(),
        link_to,
        earlier,
        p().class("promise").child((icon(Icon::Lock), t!("page.welcome.promise"))),
    )))
}

/// The drop area; while files are read, their number and the progress.
fn drop_area() -> impl IntoView {
    let files = Memo::new(|_| read(|m| m.loading().map(|loading| loading.files)));
    let content = move || match files.get() {
        Some(count) => reading(count).into_any(),
        None => (
            h2().child(t!("page.welcome.title")),
            p().class("quiet").child(t!("page.welcome.kinds")),
            push("button large primary", t!("page.welcome.open"), |_| send(FilesEvent::Choose)),
        )
            .into_any(),
    };
    div()
        .class("drop")
        .attr("aria-busy", move || files.get().map(|_| "true"))
        .child((icon(Icon::Annulus), content))
}

fn reading(count: usize) -> impl IntoView {
    let words = move || say!("page.welcome.reading", count = count);
    (
        div().attr("role", "status").child(h2().child(words)),
        progress()
            .attr("max", "1")
            .attr("aria-label", words)
            .prop("value", || read(|m| m.loading().map_or(0.0, |loading| loading.share))),
    )
}

fn tile(picture: Icon, name: Words, meaning: Words, act: fn(MouseEvent)) -> impl IntoView {
    let words = span().child((strong().child(name), span().class("quiet").child(meaning)));
    button().attr("type", "button").class("tile").on(ev::click, act).child((icon(picture), words))
}

/// A field for a link to a board. Only without a bridge: a page from a bridge may not contact other servers.
fn link_to() -> impl IntoView {
    read(|m| m.frame.alone).then(|| {
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

pub(super) fn last() -> impl IntoView {
    move || {
        watch(|m| &m.keeping.offers)
            .with(|offers| offers.first().cloned())
            .map(|offer| kept(offer, Some("status")))
    }
}

fn earlier() -> impl IntoView {
    let rows = rows(1);
    let count = rows.len();
    (count > 0).then(|| {
        details()
            .class("earlier")
            .child((summary().child(t!("page.kept.earlier", count = count)), ul().child(rows)))
    })
}

/// Saved projects other than the open one, in a collapsible list.
pub(super) fn others() -> impl IntoView {
    // Opening a board saves the one before, so list again.
    Effect::new(move |_| {
        shared(|m| &m.board.document).track();
        send(KeepEvent::Listed);
    });
    let count = || read(|m| m.keeping.offers.len());
    let open = RwSignal::new(false);
    let toggled = move |_| open.update(|open| *open = !*open);
    let list = move || {
        let words = move || say!("page.kept.earlier", count = count());
        let rows = move || open.get().then(|| ul().child(rows(0)));
        let list = details().class("earlier").on(ev::toggle, toggled).child((summary().child(words), rows));
        section().class("block others").child(list)
    };
    move || read(|m| !m.keeping.offers.is_empty()).then(list)
}

fn rows(skipped: usize) -> Vec<AnyView> {
    let offers = watch(|m| &m.keeping.offers).get();
    offers.into_iter().skip(skipped).map(|offer| li().child(kept(offer, None)).into_any()).collect()
}

/// The offer to restore a saved project. Its text describes the buttons to screen readers; `role` is `status`
/// if the text must be announced.
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
                // After a discard, the next project moves under the pointer: ignore the second press of a
                // double click.
                if event.detail() < 2 {
                    send(KeepEvent::Discard { offer: offer.clone() });
                }
            })
            .attr("aria-describedby", described)
        }),
    ))
}
