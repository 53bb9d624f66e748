//! The second side: locates holes of the board with the tip or a camera's crosshair, and computes the board's
//! position. Moves nothing.
//!
//! ```text
//!  camera  ┌───┼───┐   hole 1  X 3.00 Y 4.00   found
//!          ├───┼───┤   hole 2  X 83.0 Y 4.00   next ◀     [Tip is over it] [Crosshair is on it]
//!          └───┼───┘   rotated by 0.31°, shifted …        [x] align the job
//! ```

use crate::browser::CAMERA_PICTURE;
use crate::i18n::{advice, message, number, say, t};
use crate::model::{Eye, SecondSideEvent, SoughtHole, second_side};
use crate::page::{read, send, watch};
use crate::widgets::{choice, push, push_if};
use annulus_core::align::BoardFit;
use annulus_core::control::Trust;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::warning;
use leptos::ev;
use leptos::html::{button, details, div, input, label, li, ol, p, span, summary, video};
use leptos::prelude::*;
use leptos::svg::{circle, path, svg};
use wasm_bindgen::JsCast;

pub(super) fn second_side() -> impl IntoView {
    let opened = |event: web_sys::Event| {
        let shown = event.target().and_then(|target| target.dyn_into::<web_sys::Element>().ok());
        send(SecondSideEvent::Show { on: shown.is_some_and(|shown| shown.has_attribute("open")) });
    };
    let trusted = || read(|m| m.link.status.as_ref().is_some_and(|status| status.trust == Trust::Trusted));
    let placed = move || trusted() && read(|m| m.link.status.as_ref()?.zero_mm).is_some();
    let missing = move || match (trusted(), placed()) {
        (false, _) => Some(say!("page.second.no_place")),
        (true, false) => Some(say!("page.second.no_zero")),
        (true, true) => None,
    };
    let forgotten = move || {
        let why = warning!("align.forgotten");
        let said = move || {
            p().class("refused").attr("role", "alert").child(format!("{} {}", message(&why), advice(&why)))
        };
        read(|m| m.second_side.forgotten).then(said)
    };
    let by_tip = |_| send(SecondSideEvent::Take { by_camera: false });
    let found = move || {
        read(|m| m.second_side.holes.get(m.second_side.aimed).is_some_and(|hole| hole.found_mm.is_some()))
    };
    let any = move || read(|m| !m.second_side.holes.is_empty());
    details().class("second-side").on(ev::toggle, opened).child((
        summary().child(t!("page.second.title")),
        p().child(t!("page.second.is")),
        camera(),
        forgotten,
        move || {
            let rows = watch(|m| &m.second_side.holes).get().into_iter().enumerate();
            let rows = rows.map(|(index, hole)| row(index, hole)).collect_view();
            if any() { ol().child(rows).into_any() } else { p().child(t!("page.second.no_job")).into_any() }
        },
        div().class("row").child((
            push_if("button", move || any() && placed(), t!("page.second.tip"), by_tip),
            push_if("button small quiet", found, t!("page.second.forget"), |_| send(SecondSideEvent::Forget)),
            push_if("button small quiet", any, t!("page.second.other"), |_| send(SecondSideEvent::Other)),
        )),
        move || missing().map(|why| p().class("quiet").child(why)),
        move || lies(&watch(|m| &m.second_side.holes).get(), watch(|m| &m.second_side.fit).get(), zero_mm()),
        along(),
    ))
}

fn zero_mm() -> [f64; 2] {
    read(|m| m.link.status.as_ref()?.zero_mm).unwrap_or_default()
}

/// A hole, located or not; pressing it selects it.
fn row(index: usize, hole: SoughtHole) -> impl IntoView {
    let mm = |mm: f64| number(format!("{mm:.2}"));
    let (x, y) = (mm(hole.planned.x.mm()), mm(hole.planned.y.mm()));
    let is_found = hole.found_mm.is_some();
    let words = move || {
        let place = say!("page.second.hole", n = index + 1, x = x.clone(), y = y.clone());
        let state = if is_found { say!("page.second.found") } else { say!("page.second.sought") };
        format!("{place}: {state}")
    };
    li().child(choice(
        move || read(|m| m.second_side.aimed) == index,
        words,
        move |_| send(SecondSideEvent::Aim { hole: index }),
    ))
}

/// The camera picture with the crosshair, or why there is none; and the one-time calibration of the camera's
/// offset.
fn camera() -> impl IntoView {
    let is_open = move || read(|m| m.second_side.eye == Eye::Open);
    let wanted = move || read(|m| matches!(m.second_side.eye, Eye::Open | Eye::Opening));
    let word = move || if wanted() { say!("page.second.shut") } else { say!("page.second.look") };
    let ready = move || is_open() && read(|m| m.second_side.offset_mm.is_some());
    let take = move |_| {
        if ready() {
            send(SecondSideEvent::Take { by_camera: true });
        }
    };
    let cross = svg()
        .attr("viewBox", "-50 -50 100 100")
        .attr("aria-hidden", "true")
        .child((path().attr("d", "M-50 0H-4M4 0H50M0 -50V-4M0 4V50"), circle().attr("r", 12)));
    let blind = move || match watch(|m| &m.second_side.eye).get() {
        Eye::Blind(why) => Some(p().class("refused").attr("role", "alert").child(format!(
            "{} {}",
            message(&why),
            advice(&why)
        ))),
        Eye::Shut | Eye::Opening | Eye::Open => None,
    };
    // The element always exists: `effects` attaches the stream to it.
    let picture = button()
        .attr("type", "button")
        .class(move || if is_open() { "camera" } else { "camera shut" })
        .attr("aria-label", t!("page.second.crosshair"))
        .prop("disabled", move || !ready())
        .on(ev::click, take)
        .child((
            video()
                .attr("id", CAMERA_PICTURE)
                .attr("autoplay", "")
                .attr("playsinline", "")
                .prop("muted", true),
            cross,
        ));
    div().child((
        push("button", word, move |_| send(SecondSideEvent::Look { on: !wanted() })),
        blind,
        picture,
        move || is_open().then(learnt),
    ))
}

fn learnt() -> impl IntoView {
    let mm = |mm: f64| number(format!("{mm:.2}"));
    let says = move || match (read(|m| m.second_side.offset_mm), read(|m| m.second_side.dot_mm)) {
        (Some([x, y]), _) => say!("page.second.offset", x = mm(x), y = mm(y)),
        (None, None) => say!("page.second.make_dot"),
        (None, Some(_)) => say!("page.second.find_dot"),
    };
    let has_dot = move || read(|m| m.second_side.dot_mm.is_some());
    let known = move || read(|m| m.second_side.offset_mm.is_some());
    (
        p().attr("role", "status").child(says),
        div().class("row").child((
            push_if("button", known, t!("page.second.crosshair"), |_| {
                send(SecondSideEvent::Take { by_camera: true });
            }),
            push("button small quiet", t!("page.second.dot"), |_| send(SecondSideEvent::Dot)),
            push_if("button small quiet", has_dot, t!("page.second.on_dot"), |_| {
                send(SecondSideEvent::OnDot);
            }),
        )),
    )
}

/// The board's position, or why it can't be computed, with a picture: planned holes as rings, located ones as
/// crosses.
fn lies(
    holes: &[SoughtHole],
    fit: Option<Result<BoardFit, Diagnostic>>,
    zero_mm: [f64; 2],
) -> Option<AnyView> {
    let told = match &fit {
        None => return None,
        Some(Ok(fit)) => p().attr("role", "status").child(message(&second_side::told(fit))).into_any(),
        Some(Err(why)) => {
            let words = format!("{} {}", message(why), advice(why));
            p().class("refused").attr("role", "alert").child(words).into_any()
        }
    };
    let planned = |hole: &SoughtHole| [hole.planned.x.mm(), hole.planned.y.mm()];
    let found = |hole: &SoughtHole| hole.found_mm.map(|[x, y]| [x - zero_mm[0], y - zero_mm[1]]);
    let places: Vec<[f64; 2]> =
        holes.iter().flat_map(|hole| [Some(planned(hole)), found(hole)]).flatten().collect();
    let span = |axis: usize| {
        let along = || places.iter().map(|place| place[axis]);
        (along().fold(f64::MAX, f64::min), along().fold(f64::MIN, f64::max))
    };
    let ((left, right), (front, back)) = (span(0), span(1));
    let dot = ((right - left) + (back - front)).max(1.0) * 0.025;
    let rings = holes.iter().map(|hole| {
        let [x, y] = planned(hole);
        circle().attr("cx", x).attr("cy", -y).attr("r", dot)
    });
    let crosses = holes.iter().filter_map(found).map(|[x, y]| {
        let arms = format!("M{} {}h{}m{} {}v{}", x - dot, -y, 2.0 * dot, -dot, -dot, 2.0 * dot);
        path().attr("d", arms)
    });
    let frame = format!(
        "{} {} {} {}",
        left - 3.0 * dot,
        -back - 3.0 * dot,
        right - left + 6.0 * dot,
        back - front + 6.0 * dot
    );
    let picture = svg()
        .attr("class", "lies")
        .attr("viewBox", frame)
        .attr("aria-hidden", "true")
        .child((rings.collect_view(), crosses.collect_view()));
    Some((told, picture).into_any())
}

/// Whether the job is aligned to the located board.
fn along() -> impl IntoView {
    let good = move || read(|m| matches!(m.second_side.fit, Some(Ok(_))));
    label().class("tick").child((
        input()
            .attr("type", "checkbox")
            .prop("disabled", move || !good())
            .prop("checked", move || read(|m| m.second_side.applied) && good())
            .on(ev::change, move |event| send(SecondSideEvent::Apply { on: event_target_checked(&event) })),
        span().child(t!("page.second.along")),
    ))
}
