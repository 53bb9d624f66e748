//! Removes slivers: thin strips of loose copper between the grooves around neighbouring islands.
//!
//! ```text
//!   ▓▓▓ copper ▓▓▓         the strip ░ is left between two grooves. If it is too thin to hold on the board,
//!   ── ── groove ── ──     another path runs along its centre, as far from the copper as one more pass
//!   ░░░░░░·····░░░░░░
//!   ── ── groove ── ──
//!   ▓▓▓ copper ▓▓▓
//! ```
//!
//! For a short sliver the path of the pass makes a detour and returns: that takes less time than a retract
//! and a plunge.
//!
//! Blunt corners hold on the board and stay; dust leaves with the chips.

use super::cut;
use crate::board::THINNEST;
use crate::geometry::{Edge, Near, Path, PathSegment, Point, Region, Strip, strips};
use crate::units::Length;

/// Strips wider than a sliver by this are removed too: the proof measures along chords.
const SLACK: Length = Length::from_um(4);
/// A strip ends where it is thinner than this.
const POINTED: Length = Length::from_um(10);
/// A strip that narrows to a point within this many mm is a blunt corner.
const BLUNT_MM: f64 = 0.14;
const LONGEST_DETOUR_MM: f64 = 3.0;
/// Length of a toolpath for a single point, in mm.
const DOT_MM: f64 = 0.02;
const STRAIGHT_MM: f64 = 0.002;
/// Limit of points absorbed by one line.
const LONGEST_LOOK: usize = 256;

/// A path along a sliver that starts next to an edge of the pass.
struct Detour {
    edge: Edge,
    place: Point,
    path: Path,
}

/// The toolpaths of a pass with the slivers that it leaves. The tool centre follows the edges of `pass`, and
/// the cut is `through` wide at the underside of the copper. `next` is the distance of the following pass,
/// which is made only where it has room. The inside is on the left of closed toolpaths.
pub(super) fn with_slivers(pass: &Region, through: Length, next: Option<Length>) -> Vec<Path> {
    let thin = thin(through);
    let found = strips(pass, through, room(through, next));
    let (mut detours, mut paths) = (Vec::new(), Vec::new());
    for strip in found.iter().filter(|strip| is_sliver(strip, through, thin)) {
        let Some(path) = along(strip) else { continue };
        match strip.beside {
            Some(Near { edge, place, .. }) if path.length_mm() <= LONGEST_DETOUR_MM => {
                detours.push(Detour { edge, place, path });
            }
            _ if path.segments.is_empty() => paths.extend(dot(path.start)),
            _ => paths.push(path),
        }
    }
    detours.sort_by_key(|detour| detour.edge);
    let mut rest = detours.as_slice();
    for (island, shape) in (0..).zip(&pass.islands) {
        for (number, path) in (0..).zip(shape.paths()) {
            let own =
                rest.partition_point(|detour| (detour.edge.island, detour.edge.path) <= (island, number));
            let (these, others) = rest.split_at(own);
            rest = others;
            paths.push(with_detours(path, these));
        }
    }
    paths
}

/// Wider copper is no sliver.
fn thin(through: Length) -> Length {
    (THINNEST + SLACK).min(Length::from_nm(through.nm() / 2))
}

/// Largest distance of two edges of a pass with a sliver between them.
pub(super) fn room(through: Length, next: Option<Length>) -> Length {
    let widest = through + thin(through);
    next.map_or(widest, |step| (step + step).min(widest))
}

/// A closed path with its detours, in the order of their edges.
fn with_detours(path: &Path, detours: &[Detour]) -> Path {
    if detours.is_empty() {
        return path.clone();
    }
    let mut out = Path { start: path.start, segments: Vec::new() };
    for (number, (from, segment)) in (0..).zip(path.pieces()) {
        let first = detours.partition_point(|detour| detour.edge.segment < number);
        let here = detours.iter().skip(first).take_while(|detour| detour.edge.segment == number);
        let mut stops: Vec<(f64, &Detour)> =
            here.map(|detour| (cut::nearest_share(from, segment, detour.place), detour)).collect();
        stops.sort_by(|a, b| a.0.total_cmp(&b.0));
        let shares: Vec<f64> = stops.iter().map(|(share, _)| *share).collect();
        let parts = cut::parted(from, segment, &shares);
        let mut stops = stops.into_iter().peekable();
        for (_, part, begin, end) in parts {
            // Stops too near to the end of a part to split it are made at that end.
            while let Some((_, detour)) = stops.next_if(|(share, _)| *share <= (begin + end) / 2.0) {
                there_and_back(&mut out, &detour.path);
            }
            out.segments.push(part);
        }
        stops.for_each(|(_, detour)| there_and_back(&mut out, &detour.path));
    }
    out
}

/// Moves from the end of `out` to `detour`, along it, and back.
fn there_and_back(out: &mut Path, detour: &Path) {
    let from = out.end();
    let line = |to: Point| PathSegment::Line { to };
    out.segments.extend([line(detour.start)].into_iter().filter(|_| detour.start != from));
    out.segments.extend(detour.segments.iter().chain(&detour.reversed().segments).copied());
    out.segments.extend([line(from)].into_iter().filter(|_| detour.start != from));
}

/// True if a strip is more than the tip of a blunt corner, or dust.
fn is_sliver(strip: &Strip, through: Length, thin: Length) -> bool {
    let width = |place: Option<&(Point, Length)>| place.map_or(Length::ZERO, |(_, clear)| *clear - through);
    let (first, last) = (width(strip.middle.first()), width(strip.middle.last()));
    let (mut length, mut area) = (0.0, 0.0);
    for (one, two) in strip.middle.iter().zip(strip.middle.iter().skip(1)) {
        let step = one.0.distance_mm(two.0);
        length += step;
        area += step * (width(Some(one)) + width(Some(two))).mm() / 2.0;
    }
    let (narrow, wide) = (first.min(last), first.max(last));
    let tip = narrow < POINTED && wide > thin - POINTED && length < BLUNT_MM;
    let dust = wide < POINTED && area < THINNEST.mm() * THINNEST.mm() / 2.0;
    !(strip.own && tip || dust)
}

fn dot(at: Point) -> Option<Path> {
    let end = |by: f64| Point::from_mm(at.x.mm() + by, at.y.mm());
    Path::through(&[end(-DOT_MM / 2.0), end(DOT_MM / 2.0)])
}

/// The path along the centre of a strip, with few lines; without segments for a single point.
fn along(strip: &Strip) -> Option<Path> {
    let places: Vec<Point> = strip.middle.iter().map(|(at, _)| *at).collect();
    if let [only] = places.as_slice() {
        return Some(Path { start: *only, segments: Vec::new() });
    }
    let mut kept: Vec<Point> = places.first().copied().into_iter().collect();
    let mut from = 0;
    while from + 1 < places.len() {
        let last = (from + LONGEST_LOOK).min(places.len() - 1);
        let to = (from + 2..=last).take_while(|&to| is_straight(places.get(from..=to))).last();
        from = to.unwrap_or(from + 1);
        kept.extend(places.get(from).copied());
    }
    kept.dedup();
    Path::through(&kept).filter(|path| !path.segments.is_empty())
}

/// True if all points are on the line from the first to the last.
fn is_straight(places: Option<&[Point]>) -> bool {
    let Some([first, between @ .., last]) = places else { return false };
    let (ux, uy) = ((last.x - first.x).mm(), (last.y - first.y).mm());
    let length = libm::sqrt(ux * ux + uy * uy);
    between.iter().all(|at| {
        let (vx, vy) = ((at.x - first.x).mm(), (at.y - first.y).mm());
        libm::fabs(ux * vy - uy * vx) <= STRAIGHT_MM * length
    })
}
