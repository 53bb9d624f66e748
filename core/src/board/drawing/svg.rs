//! A drawing as a picture that any browser shows, true to size.
//!
//! Comes in: a [`Drawing`]. Goes out: SVG in millimetres, a group for each layer; equal drawings give equal texts. Does not know
//! the colours of the page.

use super::files::decimal;
use super::{Body, Drawing, Layer, Thing};
use crate::geometry::{Bounds, Point};
use crate::units::Length;
use std::fmt::Write;

/// Free space around everything.
const MARGIN: Length = Length::from_um(1_000);

/// Layers from below, with their colours; holes come last.
const LAYERS: [(Layer, &str); 3] =
    [(Layer::Bottom, "#3b6ea5"), (Layer::Top, "#b5532a"), (Layer::Edge, "#8a7a1f")];

/// The picture.
pub fn svg(drawing: &Drawing) -> String {
    let drawn = |(_, entry)| Body::of(drawing, entry);
    let boxes = drawing.things().filter_map(drawn).map(|body| body.bounds());
    let all = boxes.reduce(|a, b| a.with(b.min).with(b.max)).unwrap_or(Bounds::of(Point::default()));
    let all = all.grown(MARGIN);
    let (width, height) = (decimal(all.max.x - all.min.x), decimal(all.max.y - all.min.y));
    let corner = format!("{} {}", decimal(all.min.x), decimal(-all.max.y));
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" \
         viewBox=\"{corner} {width} {height}\">\n<title>{}</title>\n",
        escaped(drawing.name())
    );
    for (layer, colour) in LAYERS {
        let _ = writeln!(
            out,
            "<g id=\"{}\" fill=\"{colour}\" stroke=\"{colour}\" stroke-width=\"0\" stroke-linecap=\"round\">",
            layer.word()
        );
        for (_, entry) in drawing.things() {
            if entry.thing.layer().is_some_and(|own| own.meets(layer))
                && let Some(body) = Body::of(drawing, entry)
            {
                out += &shape(&body);
            }
        }
        out += "</g>\n";
    }
    out += "<g id=\"holes\" fill=\"#ffffff\" stroke=\"#202020\" stroke-width=\"0.05\">\n";
    for (_, entry) in drawing.things() {
        if matches!(entry.thing, Thing::Hole { .. })
            && let Some(body) = Body::of(drawing, entry)
        {
            out += &shape(&body);
        }
    }
    out + "</g>\n</svg>\n"
}

/// Y goes down in a picture.
fn shape(body: &Body) -> String {
    let at = |point: &Point| (decimal(point.x), decimal(-point.y));
    match (body.closed, body.points.as_slice()) {
        (false, [centre]) => {
            let (x, y) = at(centre);
            format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{}\"/>\n", decimal(body.radius))
        }
        (false, [from, to]) => {
            let ((x1, y1), (x2, y2)) = (at(from), at(to));
            let width = decimal(body.radius * 2);
            format!("<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\" stroke-width=\"{width}\"/>\n")
        }
        (_, points) => {
            let corners: Vec<String> = points.iter().map(at).map(|(x, y)| format!("{x},{y}")).collect();
            format!("<polygon points=\"{}\"/>\n", corners.join(" "))
        }
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
