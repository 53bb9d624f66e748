//! Rulers along the picture, and labels in it: pads, nets and hole sizes, once they are large enough to read.
//!
//! ```text
//!   ┌──0────10────20──┐  work coordinates, or those of the drawing
//!  10      R1.2       │
//!   0       GND       │
//! ```

use super::shown::Shown;
use crate::format::plain;
use crate::i18n::number;
use crate::keys::Tab;
use crate::layers::LayerKind;
use crate::page::read;
use crate::picture;
use crate::screens::layers;
use crate::view::Camera;
use annulus_core::board::Face;
use leptos::html::{div, span};
use leptos::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Maximum distance between numbers on a ruler, CSS pixels.
const APART_PX: f64 = 110.0;
/// Maximum width of a number on a ruler, CSS pixels.
const NUMBER_PX: f64 = 48.0;
/// Minimum width of a thing that gets a label, CSS pixels.
const BEARS_PX: f64 = 30.0;
/// Width assumed for a pad without a size, mm.
const UNSIZED_MM: f64 = 1.0;
/// With more labels in view, none is shown.
const MOST_WORDS: usize = 160;

/// The ruler coordinates of the picture's origin, on screens with rulers.
fn zero(shown: Memo<Option<Arc<Shown>>>) -> Option<[f64; 2]> {
    match read(|m| m.frame.tab) {
        Tab::Draw => Some([0.0; 2]),
        Tab::Simulate if read(|m| m.play.in_space()) => None,
        tab if tab.shows_board() => {
            shown.with(|shown| shown.as_ref().map(|shown| shown.work_of_picture([0.0; 2])))
        }
        _ => None,
    }
}

pub(super) fn rulers(shown: Memo<Option<Arc<Shown>>>) -> impl IntoView {
    let along = move |axis: usize, class: &'static str, side: &'static str| {
        move || {
            let (camera, zero, unit) = (read(|m| m.frame.camera)?, zero(shown)?, read(|m| m.frame.unit));
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

/// The cross-hair's position along an axis, in pixels.
fn pointer(camera: &Camera, axis: usize) -> Option<f64> {
    if read(|m| m.frame.tab != Tab::Draw) {
        return None;
    }
    let at = read(|m| m.draw.editor.aim.at());
    Some(camera.to_px([at.x.mm(), at.y.mm()])[axis])
}

#[derive(Clone, Debug, PartialEq)]
struct PictureWords {
    at_mm: [f64; 2],
    across_mm: f64,
    first: String,
    second: Option<String>,
    hole: bool,
}

/// The labels for pads of the visible layers; if there are none, for holes.
fn words(shown: &Shown) -> Vec<PictureWords> {
    let corner = picture::origin(shown.body);
    let place = |at| picture::place(corner, at).map(f64::from);
    let seen = |face| {
        layers::kind_seen(if face == Face::Top { LayerKind::CopperTop } else { LayerKind::CopperBottom })
    };
    // On other screens than Board, only the side that is up is visible.
    let up = (read(|m| m.frame.tab != Tab::Board))
        .then(|| read(|m| Some(m.job.work.as_ref()?.setup.face)).unwrap_or_default());
    let mut all: Vec<PictureWords> = Vec::new();
    // A plated-through pad is on both sides: label it once.
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
        let unit = read(|m| m.frame.unit);
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

/// The labels of things large enough on screen, unless there are too many in view.
pub(super) fn labels(shown: Memo<Option<Arc<Shown>>>) -> impl IntoView {
    let all = Memo::new(move |_| {
        let on = matches!(read(|m| m.frame.tab), Tab::Board | Tab::Cam | Tab::Machine);
        shown.get().filter(|_| on).map(|shown| Arc::new(words(&shown)))
    });
    move || {
        let (all, camera) = (all.get()?, read(|m| m.frame.camera)?);
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
