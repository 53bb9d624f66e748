//! Rulers along the picture, and what is written in it: pads, nets and the sizes of holes, once they are large enough to bear words.
//!
//! ```text
//!   ┌──0────10────20──┐  where the board lies: work coordinates, or those of the drawing
//!  10      R1.2       │
//!   0       GND       │
//! ```
//!
//! Comes in: from where the picture is looked at, the board in it. Goes out: text over the canvas. Knows no GPU; the rulers' steps are
//! those of the scale bar.

use super::shown::Shown;
use crate::format::plain;
use crate::i18n::number;
use crate::keys::Tab;
use crate::layers::LayerKind;
use crate::page::{frame, open_drawing, open_job, play};
use crate::picture;
use crate::screens::layers;
use crate::view::Camera;
use annulus_core::board::Face;
use leptos::html::{div, span};
use leptos::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Numbers of a ruler are at most so far apart, in CSS pixels.
const APART_PX: f64 = 110.0;
/// A number takes so much of a ruler at most, in CSS pixels.
const NUMBER_PX: f64 = 48.0;
/// A thing as wide as this can bear words, in CSS pixels.
const BEARS_PX: f64 = 30.0;
/// What has no size of its own is taken to be as wide as this, in mm.
const UNSIZED_MM: f64 = 1.0;
/// With more words in sight none is read.
const MOST_WORDS: usize = 160;

/// What the zero of the picture is called, on the screens that are measured.
fn zero(shown: Memo<Option<Arc<Shown>>>) -> Option<[f64; 2]> {
    match frame().tab.get() {
        Tab::Draw => Some([0.0; 2]),
        Tab::Simulate if play().in_space.get() => None,
        Tab::Board | Tab::Cam | Tab::Simulate => {
            shown.with(|shown| shown.as_ref().map(|shown| shown.work_of_picture([0.0; 2])))
        }
        Tab::Machine | Tab::Lab | Tab::Settings => None,
    }
}

/// Both rulers, where the picture has them.
pub(super) fn rulers(shown: Memo<Option<Arc<Shown>>>) -> impl IntoView {
    let along = move |axis: usize, class: &'static str, side: &'static str| {
        move || {
            let (camera, zero, unit) = (frame().camera.get()?, zero(shown)?, frame().unit.get());
            let (step_px, step) = unit.scale(camera.px_per_mm, APART_PX)?;
            let rows = camera.ruler(axis, zero[axis], step / unit.of_mm(1.0));
            let from_px = rows.first().map_or(0.0, |row| row.0);
            let room_px = camera.viewport_px[axis] - NUMBER_PX;
            let marks = rows.into_iter().filter(|(px, _)| *px < room_px).map(|(px, mm)| {
                span().style((side, format!("{px:.1}px"))).child(number(plain(unit.of_mm(mm))))
            });
            let pointer =
                pointer(&camera, axis).map(|px| div().class("pointer").style((side, format!("{px:.1}px"))));
            Some(
                div()
                    .class(class)
                    .attr("aria-hidden", "true")
                    .style(("--step", format!("{:.4}px", step_px / 5.0)))
                    .style(("--from", format!("{from_px:.2}px")))
                    .child((marks.collect::<Vec<_>>(), pointer)),
            )
        }
    };
    (along(0, "ruler across", "left"), along(1, "ruler up", "top"))
}

/// Where along an axis the cross-hair of the drawing is.
fn pointer(camera: &Camera, axis: usize) -> Option<f64> {
    if frame().tab.get() != Tab::Draw {
        return None;
    }
    let at = open_drawing().aim.get();
    Some(camera.to_px([at.x.mm(), at.y.mm()])[axis])
}

/// Words that may be read in the picture.
#[derive(Clone, Debug, PartialEq)]
struct PictureWords {
    at_mm: [f64; 2],
    across_mm: f64,
    first: String,
    second: Option<String>,
    hole: bool,
}

/// All that can be said of the board's pads and holes, of the layers that are seen.
fn words(shown: &Shown) -> Vec<PictureWords> {
    let corner = picture::origin(shown.body);
    let place = |at| picture::place(corner, at).map(f64::from);
    let seen = |face| {
        layers::kind_seen(if face == Face::Top { LayerKind::CopperTop } else { LayerKind::CopperBottom })
    };
    // Where the board is seen as it lies, that is the side that is up.
    let up = (frame().tab.get() != Tab::Board)
        .then(|| open_job().work.with(|work| work.as_ref().map(|work| work.setup.face)).unwrap_or_default());
    let mut all: Vec<PictureWords> = Vec::new();
    // A pad with a hole is on both sides.
    let mut told = BTreeSet::new();
    let shown_side = |face: Face| seen(face) && up.is_none_or(|up| up == face);
    for copper in shown.board.copper.iter().filter(|copper| shown_side(copper.face)) {
        let named = copper.named.iter().filter(|pad| told.insert((pad.at, &pad.name)));
        all.extend(named.map(|pad| PictureWords {
            at_mm: place(pad.at),
            across_mm: Some(pad.across.mm()).filter(|mm| *mm > 0.0).unwrap_or(UNSIZED_MM),
            first: pad.name.clone(),
            second: pad.net.clone(),
            hole: false,
        }));
    }
    if all.is_empty() && layers::kind_seen(LayerKind::Holes) {
        let unit = frame().unit.get();
        let sized = shown.board.holes.iter().filter_map(|hole| Some((hole.at, hole.diameter?)));
        all.extend(sized.map(|(at, size)| PictureWords {
            at_mm: place(at),
            across_mm: size.mm(),
            first: number(unit.size(size.mm())),
            second: None,
            hole: true,
        }));
    }
    all
}

/// The words over what is large enough to bear them, while they are few.
pub(super) fn labels(shown: Memo<Option<Arc<Shown>>>) -> impl IntoView {
    let all = Memo::new(move |_| {
        let on = matches!(frame().tab.get(), Tab::Board | Tab::Cam | Tab::Machine);
        shown.get().filter(|_| on).map(|shown| Arc::new(words(&shown)))
    });
    move || {
        let (all, camera) = (all.get()?, frame().camera.get()?);
        let [width, height] = camera.viewport_px;
        let in_sight = |at: &[f64; 2]| (0.0..=width).contains(&at[0]) && (0.0..=height).contains(&at[1]);
        let large = all.iter().filter(|one| one.across_mm * camera.px_per_mm >= BEARS_PX);
        let placed = large.map(|one| (camera.to_px(one.at_mm), one)).filter(|(at, _)| in_sight(at));
        let placed: Vec<_> = placed.take(MOST_WORDS + 1).collect();
        if placed.len() > MOST_WORDS {
            return None;
        }
        let lines = placed.into_iter().map(|([x, y], one)| {
            span()
                .class(if one.hole { "of-hole" } else { "" })
                .style(("left", format!("{x:.1}px")))
                .style(("top", format!("{y:.1}px")))
                .child((one.first.clone(), one.second.clone().map(|net| span().child(net))))
        });
        Some(div().class("labels").attr("aria-hidden", "true").child(lines.collect::<Vec<_>>()))
    }
}
