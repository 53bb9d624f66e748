//! A layer's objects as an area.
//!
//! Comes in: a [`Gerber`]. Goes out: the [`Region`] that is dark, as drawn: a negative image is not inverted, because the
//! inverse needs the board's outline. Takes its time: call it where an area is needed.
//!
//! ```text
//!  object ─▶ outlines ─▶ exposures, dark and clear in the order of the file ─▶ region
//!  flash     the aperture as one piece: an opening in it clears nothing below
//!  stroke    round aperture: the exact round sweep. Others: the hull of the aperture at both ends, which is the exact
//!            sweep for convex ones along a line; arcs are then cut into chords of 1 µm
//!  contour   even-odd
//! ```

use super::aperture_shapes::{hull, outlines};
use super::exposures::{Piece, exposures};
use super::flatten::{Seen, each};
use super::object::{Form, Gerber, Object, ObjectShape};
use super::transform::{Place, Transform};
use crate::diagnostic::Diagnostic;
use crate::geometry::{
    Bounds, Enclosing, Fuel, Path, PathSegment, Point, Region, chords, enclosed, paint_within, stroke,
};
use crate::units::Length;
use std::collections::BTreeMap;

/// How far a chord may be from its arc where an aperture that is not round is dragged, in mm.
const CHORD_ERROR_MM: f64 = 0.001;
/// What painting may cost for a text of [`SMALL`] bytes or fewer, in edges laid down (see [`Fuel`]).
const STEPS: u64 = 2_500_000;
/// Bytes of text that have no more fuel than fewer.
const SMALL: u64 = 1_000_000;
/// What it may cost more for every byte beyond, and at most.
const STEPS_PER_BYTE: u64 = 6;
const MOST_STEPS: u64 = 24_000_000;
/// What the outline of a stroke costs beside its edges.
const STROKE: u64 = 4;

/// A layer asks for more work than is done for it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TooMuch {
    /// Line of an object at which the work ran out.
    pub line: u32,
    /// Its column.
    pub column: u32,
}

impl TooMuch {
    /// The same in words, for a file.
    pub fn diagnostic(&self, file: &str) -> Diagnostic {
        Diagnostic::error("gerber.too_much_work").at(file, self.line, self.column)
    }
}

/// The dark area of a layer, as drawn. An error where its objects are so many, or cross so often, that it is no board: counted,
/// not timed.
pub fn painted(layer: &Gerber) -> Result<Region, TooMuch> {
    let centre = middle(layer);
    let home = Place { transform: Transform::PLAIN, at: Point::new(-centre.x, -centre.y) };
    let beyond = (layer.size as u64).saturating_sub(SMALL);
    let steps = MOST_STEPS.min(STEPS + STEPS_PER_BYTE * beyond);
    let mut brush =
        Brush { layer, home, forms: BTreeMap::new(), stamps: BTreeMap::new(), fuel: Fuel::new(steps) };
    let (mut pieces, mut places, mut stopped) = (Vec::new(), Vec::new(), None);
    each(layer, &mut |seen| {
        if stopped.is_some() {
            return;
        }
        let place = TooMuch { line: seen.object.line, column: seen.object.column };
        match brush.outlines(&seen) {
            Some(outlines) => {
                pieces.push(Piece { clear: seen.clear, outlines });
                places.push(place);
            }
            None => stopped = Some(place),
        }
    });
    if let Some(place) = stopped {
        return Err(place);
    }
    let (exposures, owners) = exposures(pieces);
    let place = |outline: usize| places.get(*owners.get(outline)?).copied();
    let region = paint_within(&exposures, &mut brush.fuel);
    Ok(moved(region.map_err(|outline| place(outline).unwrap_or_default())?, centre))
}

/// What has to be taken off every place so that the layer can be painted: nothing, unless it lies far out.
fn middle(layer: &Gerber) -> Point {
    let Some(bounds) = layer.centre_bounds().filter(|bounds| !bounds.is_in_reach()) else {
        return Point::default();
    };
    let half = |low: Length, high: Length| Length::from_nm(low.nm() + (high.nm() - low.nm()) / 2);
    Point::new(half(bounds.min.x, bounds.max.x), half(bounds.min.y, bounds.max.y))
}

/// Whether a layer within these bounds is too wide to be painted.
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

/// An aperture as it is held, by aperture, mirror, turn and scale.
type StampKey = (u32, bool, u64, u64);

struct Brush<'a> {
    layer: &'a Gerber,
    home: Place,
    /// The outlines of apertures as they are defined.
    forms: BTreeMap<u32, Vec<Path>>,
    stamps: BTreeMap<StampKey, Vec<Path>>,
    fuel: Fuel,
}

/// How many segments paths have.
fn segments(paths: &[Path]) -> u64 {
    paths.iter().map(|path| path.segments.len() as u64).sum()
}

impl Brush<'_> {
    /// The outlines of an object, inside on the left; none where that costs more than there is fuel.
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

    /// The aperture of an object put down at a place.
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

    /// An aperture that is not round, dragged along a segment.
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

/// A path that a mirror may have turned round, inside on the left again.
fn left(path: Path, transform: Transform) -> Path {
    if transform.mirrored { path.reversed() } else { path }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::artwork::Overrides;
    use crate::geometry::area_mm2;
    use std::f64::consts::PI;

    /// Area, islands and holes of what a text draws.
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
    fn objects_have_the_area_that_the_format_gives_them() {
        for (body, area, islands, holes) in [
            ("D10*X0Y0D03*X5000D03*", PI / 2.0, 2, 0),
            // A round stroke has round ends, also where it has no length.
            ("D10*X0Y0D02*X3000D01*", 3.0 + PI / 4.0, 1, 0),
            ("D10*X0Y0D02*X0D01*", PI / 4.0, 1, 0),
            ("D10*X5000Y0D02*G03*X5000Y0I-5000J0D01*", 10.0 * PI, 1, 1),
            // A rectangle dragged aslant: its own area and what its diagonal sweeps.
            ("D11*X0Y0D02*X3000Y1000D01*", 2.0 + 3.0 * 2.0 + 1.0 * 1.0, 1, 0),
            // An opening does not clear what lies below; a clear flash does.
            ("D12*X0Y0D03*", 0.75 * PI, 1, 1),
            ("D13*X0Y0D03*D12*X0Y0D03*", 100.0, 1, 0),
            ("D13*X0Y0D03*%LPC*%D10*X0Y0D03*", 100.0 - PI / 4.0, 1, 1),
            ("D13*X0Y0D03*%LPC*%D10*X0Y0D03*%LPD*%X0Y0D03*", 100.0, 1, 0),
            // A contour that crosses itself is even-odd.
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
    fn a_layer_far_out_is_painted_where_it_is() {
        let text = "%FSLAX46Y46*%%MOMM*%%ADD10C,1*%D10*X5000000000Y0D03*M02*";
        let (gerber, _) = super::super::read("t", text.as_bytes(), &Overrides::default());
        let bounds = painted(&gerber).unwrap().bounds().unwrap();
        assert!(bounds.min.distance_mm(Point::from_mm(4_999.5, -0.5)) < 2e-3, "{bounds:?}");
    }
}
