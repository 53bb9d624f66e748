//! SVG picture of a drawing, true to size.

use super::files::decimal;
use super::{Body, Drawing, Layer, Thing};
use crate::board::{Board, Face};
use crate::geometry::{Bounds, Path, PathSegment, Point, Region};
use crate::units::Length;
use std::f64::consts::PI;
use std::fmt::Write;

const MARGIN: Length = Length::from_um(1_000);

/// Layers from bottom to top, with their colours; holes follow.
const LAYERS: [(Layer, &str); 3] =
    [(Layer::Bottom, "#3b6ea5"), (Layer::Top, "#b5532a"), (Layer::Edge, "#8a7a1f")];

const HOLES: &str = "<g id=\"holes\" fill=\"#ffffff\" stroke=\"#202020\" stroke-width=\"0.05\">\n";

pub fn svg(drawing: &Drawing) -> String {
    let drawn = |(_, entry)| Body::of(drawing, entry);
    let mut out = head(drawing.things().filter_map(drawn).map(|body| body.bounds()), drawing.name());
    for (layer, colour) in LAYERS {
        out += &group(layer, colour);
        for (_, entry) in drawing.things() {
            if entry.thing.layer().is_some_and(|own| own.meets(layer))
                && let Some(body) = Body::of(drawing, entry)
            {
                out += &shape(&body);
            }
        }
        out += "</g>\n";
    }
    out += HOLES;
    for (_, entry) in drawing.things() {
        if matches!(entry.thing, Thing::Hole { .. })
            && let Some(body) = Body::of(drawing, entry)
        {
            out += &shape(&body);
        }
    }
    out + "</g>\n</svg>\n"
}

/// SVG picture of a board: copper and edge with arcs, holes and slots.
pub fn board_svg(board: &Board, name: &str) -> String {
    let copper = |layer: Layer| {
        let face = if layer == Layer::Top { Face::Top } else { Face::Bottom };
        board.copper.iter().find(|copper| copper.face == face).map(|copper| &copper.region)
    };
    let regions = board.copper.iter().map(|copper| &copper.region).chain([&board.outline]);
    let holes = board.holes.iter().map(|hole| Body::disc(hole.at, hole.diameter.unwrap_or_default()));
    let slots = board.slots.iter().map(|slot| Body {
        points: slot.path.clone(),
        closed: false,
        radius: Length::from_nm(slot.width.unwrap_or_default().nm() / 2),
    });
    let holes: Vec<Body> = holes.chain(slots).collect();
    let boxes = regions.filter_map(Region::bounds).chain(holes.iter().map(Body::bounds));
    let mut out = head(boxes, name);
    for (layer, colour) in LAYERS {
        out += &group(layer, colour);
        if layer == Layer::Edge {
            for path in board.outline.paths() {
                let _ = writeln!(out, "<path d=\"{}\" fill=\"none\" stroke-width=\"0.1\"/>", way(path));
            }
        } else {
            for island in copper(layer).into_iter().flat_map(|region| &region.islands) {
                let rings: Vec<String> =
                    std::iter::once(&island.outer).chain(&island.holes).map(way).collect();
                let _ = writeln!(out, "<path fill-rule=\"evenodd\" d=\"{}\"/>", rings.join(" "));
            }
        }
        out += "</g>\n";
    }
    out += HOLES;
    holes.iter().for_each(|body| out += &shape(body));
    out + "</g>\n</svg>\n"
}

/// A closed path as SVG path data. A full circle needs two arcs there.
fn way(path: &Path) -> String {
    let at = |point: Point| format!("{},{}", decimal(point.x), decimal(-point.y));
    let mut out = format!("M{}", at(path.start));
    for (from, segment) in path.pieces() {
        match segment {
            PathSegment::Line { to } => out += &format!("L{}", at(to)),
            PathSegment::Arc { to, centre, clockwise } => {
                let radius = decimal(Length::from_mm(from.distance_mm(centre)));
                // Y is negated, which mirrors; the sweep flag has the mirrored sense too, so clockwise stays
                // clockwise.
                let sweep = i32::from(clockwise);
                if to == from {
                    let across = Point::new(centre.x * 2 - from.x, centre.y * 2 - from.y);
                    out += &format!("A{radius},{radius} 0 0 {sweep} {}", at(across));
                }
                let large = i32::from(to != from && turn(from, to, centre, clockwise) > PI);
                out += &format!("A{radius},{radius} 0 {large} {sweep} {}", at(to));
            }
        }
    }
    out + "Z"
}

/// Angle of an arc in radians.
fn turn(from: Point, to: Point, centre: Point, clockwise: bool) -> f64 {
    let angle = |at: Point| libm::atan2((at.y - centre.y).mm(), (at.x - centre.x).mm());
    let by = if clockwise { angle(from) - angle(to) } else { angle(to) - angle(from) };
    if by < 0.0 { by + 2.0 * PI } else { by }
}

fn head(boxes: impl Iterator<Item = Bounds>, name: &str) -> String {
    let all = boxes.reduce(|a, b| a.with(b.min).with(b.max)).unwrap_or(Bounds::of(Point::default()));
    let all = all.grown(MARGIN);
    let (width, height) = (decimal(all.max.x - all.min.x), decimal(all.max.y - all.min.y));
    let corner = format!("{} {}", decimal(all.min.x), decimal(-all.max.y));
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" \
         viewBox=\"{corner} {width} {height}\">\n<title>{}</title>\n",
        escaped(name)
    )
}

fn group(layer: Layer, colour: &str) -> String {
    let id = layer.word();
    format!(
        "<g id=\"{id}\" fill=\"{colour}\" stroke=\"{colour}\" stroke-width=\"0\" stroke-linecap=\"round\">\n"
    )
}

/// SVG's Y axis points down.
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
