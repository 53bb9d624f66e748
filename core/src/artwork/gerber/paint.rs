//! Converts a layer's objects to an area. Slow, so call it only if the area is needed.
//!
//! ```text
//!  object ─▶ outlines ─▶ exposures, dark and clear in file order ─▶ region
//!  flash     the aperture as one piece: an opening in it clears nothing below
//!  stroke    round aperture: the exact round sweep. Others: the convex hull of the aperture at both ends,
//!            the exact sweep of convex shapes along a line; arcs are first cut into chords of 1 µm
//!  contour   even-odd
//! ```

use super::aperture_shapes::{hull, outlines};
use super::exposures::{Piece, exposures};
use super::flatten::{Seen, each};
use super::object::{Form, Gerber, Object, ObjectShape};
use super::transform::{Place, Transform};
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::geometry::{
    Bounds, Enclosing, Fuel, Path, PathSegment, Point, Region, chords, enclosed, paint_within, ribbon, stroke,
};
use crate::units::Length;
use std::collections::BTreeMap;

/// Maximum distance of a chord from its arc for sweeps of non-round apertures, mm.
const CHORD_ERROR_MM: f64 = 0.001;
/// Work limit for layers of up to [`SMALL`] bytes, in edges (see [`Fuel`]).
const STEPS: u64 = 2_500_000;
/// Text size from which on the work limit increases, bytes.
const SMALL: u64 = 1_000_000;
/// Additional work per byte beyond [`SMALL`], and the total limit.
const STEPS_PER_BYTE: u64 = 6;
const MOST_STEPS: u64 = 24_000_000;
/// Cost of a stroke's outline in addition to its edges.
const STROKE: u64 = 4;

const MOST_CORNERS: usize = 64;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TooMuch {
    /// Line of an object at which the work ran out.
    pub line: u32,
    pub column: u32,
}

impl TooMuch {
    pub fn diagnostic(&self, file: &str) -> Diagnostic {
        error!("gerber.too_much_work").at(file, self.line, self.column)
    }
}

/// The dark area of a layer. Fails if the objects exceed the work limit, which counts operations, not time.
pub fn painted(layer: &Gerber) -> Result<Region, TooMuch> {
    within_limits(layer, false)
}

/// The dark area for a picture: several times as fast as [`painted`], but arcs are up to 5 µm off where
/// outlines cross.
pub fn painted_for_picture(layer: &Gerber) -> Result<Region, TooMuch> {
    within_limits(layer, true)
}

fn within_limits(layer: &Gerber, is_picture: bool) -> Result<Region, TooMuch> {
    let centre = middle(layer);
    let home = Place { transform: Transform::PLAIN, at: Point::new(-centre.x, -centre.y) };
    let beyond = (layer.size as u64).saturating_sub(SMALL);
    let steps = MOST_STEPS.min(STEPS + STEPS_PER_BYTE * beyond);
    let mut brush = Brush {
        layer,
        home,
        forms: BTreeMap::new(),
        stamps: BTreeMap::new(),
        fuel: Fuel::new(steps),
        most_corners: MOST_CORNERS,
    };
    each(layer, &mut |seen| {
        // In a layer with clear objects, small outlines share exposures better than long polylines.
        if seen.clear {
            brush.most_corners = 2;
        }
    });
    let (mut pieces, mut places, mut stopped) = (Vec::new(), Vec::new(), None);
    let mut polyline: Option<Polyline> = None;
    let mut put = |clear: bool, outlines: Vec<Path>, place: TooMuch| {
        pieces.push(Piece { clear, outlines });
        places.push(place);
    };
    each(layer, &mut |seen| {
        if stopped.is_some() {
            return;
        }
        let place = TooMuch { line: seen.object.line, column: seen.object.column };
        let line = brush.line(&seen);
        if let Some(line) = line
            && polyline.as_mut().is_some_and(|own| own.append(line, seen.clear, brush.most_corners))
        {
            stopped = (!brush.fuel.spend(STROKE)).then_some(place);
            return;
        }
        if let Some(done) = polyline.take() {
            put(done.clear, done.outlines(), done.place);
        }
        if let Some(Line { from, to, width }) = line {
            polyline = Some(Polyline { corners: vec![from, to], width, clear: seen.clear, place });
            stopped = (!brush.fuel.spend(STROKE)).then_some(place);
        } else {
            match brush.outlines(&seen) {
                Some(outlines) => put(seen.clear, outlines, place),
                None => stopped = Some(place),
            }
        }
    });
    if let Some(done) = polyline {
        put(done.clear, done.outlines(), done.place);
    }
    if let Some(place) = stopped {
        return Err(place);
    }
    let (exposures, owners) = exposures(pieces);
    let place = |outline: usize| places.get(*owners.get(outline)?).copied();
    let region = paint_within(&exposures, is_picture, &mut brush.fuel);
    Ok(moved(region.map_err(|outline| place(outline).unwrap_or_default())?, centre))
}

/// The offset to subtract from all points so that the layer can be painted: zero, unless the layer is far
/// from the origin.
fn middle(layer: &Gerber) -> Point {
    let Some(bounds) = layer.centre_bounds().filter(|bounds| !bounds.is_in_reach()) else {
        return Point::default();
    };
    let half = |low: Length, high: Length| Length::from_nm(low.nm() + (high.nm() - low.nm()) / 2);
    Point::new(half(bounds.min.x, bounds.max.x), half(bounds.min.y, bounds.max.y))
}

pub(super) fn is_too_wide(bounds: Bounds) -> bool {
    let half = |low: Length, high: Length| Length::from_nm((high.nm() - low.nm()) / 2);
    let corner = Point::new(half(bounds.min.x, bounds.max.x), half(bounds.min.y, bounds.max.y));
    !Bounds::of(corner).is_in_reach()
}

fn moved(mut region: Region, by: Point) -> Region {
    if by == Point::default() {
        return region;
    }
    let back = Place { transform: Transform::PLAIN, at: by };
    for island in &mut region.islands {
        island.outer = back.path(&island.outer).into_owned();
        island.holes = island.holes.iter().map(|hole| back.path(hole).into_owned()).collect();
    }
    region
}

/// A transformed aperture: index, mirroring, rotation, scale.
type StampKey = (u32, bool, u64, u64);

/// A straight stroke of a round aperture.
#[derive(Clone, Copy)]
struct Line {
    from: Point,
    to: Point,
    width: Length,
}

struct Polyline {
    corners: Vec<Point>,
    width: Length,
    clear: bool,
    /// Position of the first line in the file.
    place: TooMuch,
}

impl Polyline {
    /// Adds a line that starts at the end of the last one. False if it doesn't fit.
    fn append(&mut self, line: Line, clear: bool, most: usize) -> bool {
        let fits = self.corners.last() == Some(&line.from)
            && (self.width, self.clear) == (line.width, clear)
            && self.corners.len() < most;
        if fits {
            self.corners.push(line.to);
        }
        fits
    }

    fn outlines(&self) -> Vec<Path> {
        ribbon(&self.corners, self.width).into_iter().collect()
    }
}

struct Brush<'a> {
    layer: &'a Gerber,
    home: Place,
    forms: BTreeMap<u32, Vec<Path>>,
    stamps: BTreeMap<StampKey, Vec<Path>>,
    fuel: Fuel,
    most_corners: usize,
}

fn segments(paths: &[Path]) -> u64 {
    paths.iter().map(|path| path.segments.len() as u64).sum()
}

impl Brush<'_> {
    /// The line of a straight stroke with a round aperture; none for other objects and for length 0.
    fn line(&self, seen: &Seen<'_>) -> Option<Line> {
        let ObjectShape::Stroke { from, segment: segment @ PathSegment::Line { .. } } = seen.object.shape
        else {
            return None;
        };
        let Form::Circle { diameter } = self.layer.aperture(seen.object)?.form else { return None };
        let place = self.home.inner(seen.place.transform, seen.place.at);
        let PathSegment::Line { to } = place.segment(segment) else { return None };
        let from = place.point(from);
        let width = Length::from_mm(diameter.mm() * seen.transform(self.layer).scale);
        (from != to && width.nm() > 0).then_some(Line { from, to, width })
    }

    /// The outlines of an object, inside on the left; none if there is not enough fuel.
    fn outlines(&mut self, seen: &Seen<'_>) -> Option<Vec<Path>> {
        let place = self.home.inner(seen.place.transform, seen.place.at);
        let object = seen.object;
        match &object.shape {
            ObjectShape::Flash { at } => self.stamp(object, seen.transform(self.layer), place.point(*at)),
            ObjectShape::Contour(path) => {
                self.fuel.spend(path.segments.len() as u64).then_some(())?;
                enclosed(&place.path(path), Enclosing::Odd, &mut self.fuel)
            }
            ObjectShape::Stroke { from, segment } => {
                let (from, segment) = (place.point(*from), place.segment(*segment));
                let transform = seen.transform(self.layer);
                match self.layer.aperture(object).map(|aperture| &aperture.form) {
                    Some(Form::Circle { diameter }) => {
                        self.fuel.spend(STROKE).then_some(())?;
                        let width = Length::from_mm(diameter.mm() * transform.scale);
                        Some(stroke(&Path { start: from, segments: vec![segment] }, width))
                    }
                    Some(_) => self.dragged(object, transform, from, segment),
                    None => Some(Vec::new()),
                }
            }
            ObjectShape::Repeat { .. } => Some(Vec::new()),
        }
    }

    fn stamp(&mut self, object: &Object, transform: Transform, at: Point) -> Option<Vec<Path>> {
        let key =
            (object.aperture, transform.mirrored, transform.turn_deg.to_bits(), transform.scale.to_bits());
        if !self.forms.contains_key(&object.aperture) {
            let aperture = self.layer.aperture(object);
            let made = aperture.map_or(Some(Vec::new()), |aperture| outlines(aperture, &mut self.fuel))?;
            self.forms.insert(object.aperture, made);
        }
        let form = self.forms.get(&object.aperture)?;
        self.fuel.spend(1 + segments(form)).then_some(())?;
        let stamp = self.stamps.entry(key).or_insert_with(|| {
            let about = Place { transform, at: Point::default() };
            form.iter().map(|path| left(about.path(path).into_owned(), transform)).collect()
        });
        let there = Place { transform: Transform::PLAIN, at };
        Some(stamp.iter().map(|path| there.path(path).into_owned()).collect())
    }

    /// A sweep of a non-round aperture along a segment.
    fn dragged(
        &mut self,
        object: &Object,
        transform: Transform,
        from: Point,
        segment: PathSegment,
    ) -> Option<Vec<Path>> {
        let form: Vec<Point> = self
            .stamp(object, transform, Point::default())?
            .iter()
            .flat_map(|path| path.flattened(CHORD_ERROR_MM))
            .collect();
        let stops = match segment {
            PathSegment::Line { to } => vec![to],
            PathSegment::Arc { to, centre, clockwise } => {
                chords::arc(from, to, centre, clockwise, CHORD_ERROR_MM)
            }
        };
        self.fuel.spend((form.len() * stops.len()) as u64).then_some(())?;
        let mut last = from;
        let mut paths = Vec::new();
        for stop in stops {
            let at = |p: &Point, q: Point| Point::new(p.x + q.x, p.y + q.y);
            let both: Vec<Point> = form.iter().flat_map(|point| [at(point, last), at(point, stop)]).collect();
            paths.extend(hull(&both));
            last = stop;
        }
        Some(paths)
    }
}

/// Restores the direction of a path after mirroring, so that the inside is on the left again.
fn left(path: Path, transform: Transform) -> Path {
    if transform.mirrored { path.reversed() } else { path }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::artwork::Overrides;
    use crate::geometry::area_mm2;
    use std::f64::consts::PI;

    fn drawn(body: &str) -> (f64, usize, usize) {
        let text =
            format!("%FSLAX33Y33*%%MOMM*%G75*%ADD10C,1*%%ADD11R,1X2*%%ADD12C,2X1*%%ADD13R,10X10*%{body}M02*");
        let (gerber, diagnostics) = super::super::read("t", text.as_bytes(), &Overrides::default());
        let others = diagnostics.iter().find(|diagnostic| diagnostic.code != "gerber.contour_crosses");
        assert_eq!(others, None, "{body}");
        let region = painted(&gerber).unwrap();
        let holes = region.islands.iter().map(|island| island.holes.len()).sum();
        (area_mm2(&region), region.islands.len(), holes)
    }

    #[test]
    fn objects_have_the_area_defined_by_the_format() {
        for (body, area, islands, holes) in [
            ("D10*X0Y0D03*X5000D03*", PI / 2.0, 2, 0),
            // A round stroke has round ends, even with length 0.
            ("D10*X0Y0D02*X3000D01*", 3.0 + PI / 4.0, 1, 0),
            ("D10*X0Y0D02*X0D01*", PI / 4.0, 1, 0),
            ("D10*X5000Y0D02*G03*X5000Y0I-5000J0D01*", 10.0 * PI, 1, 1),
            // A rectangle dragged obliquely: its own area plus the sweep of its diagonal.
            ("D11*X0Y0D02*X3000Y1000D01*", 2.0 + 3.0 * 2.0 + 1.0 * 1.0, 1, 0),
            // An opening doesn't clear what is below; a clear flash does.
            ("D12*X0Y0D03*", 0.75 * PI, 1, 1),
            ("D13*X0Y0D03*D12*X0Y0D03*", 100.0, 1, 0),
            ("D13*X0Y0D03*%LPC*%D10*X0Y0D03*", 100.0 - PI / 4.0, 1, 1),
            ("D13*X0Y0D03*%LPC*%D10*X0Y0D03*%LPD*%X0Y0D03*", 100.0, 1, 0),
            // A self-crossing contour is filled even-odd.
            ("G36*X0Y0D02*X2000D01*Y2000D01*X0D01*Y0D01*G37*", 4.0, 1, 0),
            ("G36*X0Y0D02*X2000Y2000D01*X2000Y0D01*X0Y2000D01*X0Y0D01*G37*", 2.0, 2, 0),
            ("G36*X0Y0D02*G03*X0Y0I1000J0D01*G37*", PI, 1, 0),
            ("%LR90*%%LS2*%D11*X0Y0D03*", 8.0, 1, 0),
            ("%SRX2Y2I5J5*%D10*X0Y0D03*%SR*%", PI, 4, 0),
            ("%ABD20*%D13*X0Y0D03*%LPC*%D10*X0Y0D03*%LPD*%%AB*%D20*X0Y0D03*", 100.0 - PI / 4.0, 1, 1),
        ] {
            let found = drawn(body);
            assert!((found.0 - area).abs() < 2e-3, "{body}: {} not {area}", found.0);
            assert_eq!((found.1, found.2), (islands, holes), "{body}");
        }
    }

    #[test]
    fn picture_has_the_area_of_the_layer() {
        let mut text = "%FSLAX46Y46*%%MOMM*%%ADD10C,0.15*%D10*".to_owned();
        let mut chance = crate::chance::Chance::new(4);
        for _ in 0..300 {
            let mut at = || (1_000 * chance.below(20_000), 1_000 * chance.below(20_000));
            let [(a, b), (c, d), (e, f)] = [at(), at(), at()];
            text += &format!("X{a}Y{b}D02*X{c}Y{d}D01*X{e}Y{f}D01*");
        }
        let (gerber, _) = super::super::read("t", (text + "M02*").as_bytes(), &Overrides::default());
        let exact = area_mm2(&painted(&gerber).unwrap());
        let shown = area_mm2(&painted_for_picture(&gerber).unwrap());
        assert!((shown - exact).abs() < 0.002 * exact, "{shown} mm² instead of {exact}");
    }

    #[test]
    fn far_layers_are_painted_in_position() {
        let text = "%FSLAX46Y46*%%MOMM*%%ADD10C,1*%D10*X5000000000Y0D03*M02*";
        let (gerber, _) = super::super::read("t", text.as_bytes(), &Overrides::default());
        let bounds = painted(&gerber).unwrap().bounds().unwrap();
        assert!(bounds.min.distance_mm(Point::from_mm(4_999.5, -0.5)) < 2e-3, "{bounds:?}");
    }
}
