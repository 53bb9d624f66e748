//! All objects of a layer at their positions, with blocks and repeats expanded. The reader has limited the
//! number of copies and the depth of blocks.

use super::object::{Aperture, Form, Gerber, Object, ObjectShape, Track};
use super::transform::{Place, Transform};
use crate::geometry::{Bounds, Path, PathSegment, Point, chords, path_bounds, segment_bounds};
use crate::units::Length;

const CHORD_ERROR_MM: f64 = 0.005;

/// Maximum number of such chords per layer; further arcs are cut at every quarter turn.
const MOST_CHORDS: usize = 500_000;

const COARSE_MM: f64 = 1e6;

pub(super) struct Seen<'a> {
    /// A flash (not of a block), a stroke or a contour.
    pub(super) object: &'a Object,
    pub(super) place: Place,
    pub(super) clear: bool,
    pub(super) tag: u32,
}

impl Seen<'_> {
    /// The total transform of its aperture.
    pub(super) fn transform(&self, layer: &Gerber) -> Transform {
        self.place.transform.over(layer.transform(self.object))
    }

    /// The smallest size of its aperture; zero for macros.
    pub(super) fn across(&self, layer: &Gerber) -> Length {
        let half = layer.form(self.object).map_or(Length::ZERO, half_width);
        Length::from_mm(2.0 * half.mm() * self.transform(layer).scale)
    }
}

pub(super) fn each<'a>(layer: &'a Gerber, visit: &mut dyn FnMut(Seen<'a>)) {
    below(layer, &layer.objects, Place::HOME, (false, 0), visit);
}

fn below<'a>(
    layer: &'a Gerber,
    objects: &'a [Object],
    place: Place,
    (flipped, outer_tag): (bool, u32),
    visit: &mut dyn FnMut(Seen<'a>),
) {
    for object in objects {
        let clear = object.clear != flipped;
        let tag = if outer_tag == 0 { object.tag } else { outer_tag };
        match &object.shape {
            ObjectShape::Repeat { objects, columns, rows, step } => {
                let copies = (0..*columns).flat_map(|column| (0..*rows).map(move |row| (column, row)));
                for (column, row) in copies {
                    let at = Point::new(step.x * i64::from(column), step.y * i64::from(row));
                    below(layer, objects, place.inner(Transform::PLAIN, at), (flipped, tag), visit);
                }
            }
            ObjectShape::Flash { at } => match layer.form(object) {
                Some(Form::Block { objects }) => {
                    below(layer, objects, place.inner(layer.transform(object), *at), (clear, tag), visit);
                }
                _ => visit(Seen { object, place, clear, tag }),
            },
            _ => visit(Seen { object, place, clear, tag }),
        }
    }
}

impl Gerber {
    pub fn aperture(&self, object: &Object) -> Option<&Aperture> {
        self.apertures.get(object.aperture as usize)
    }

    fn form(&self, object: &Object) -> Option<&Form> {
        self.aperture(object).map(|aperture| &aperture.form)
    }

    pub(super) fn transform(&self, object: &Object) -> Transform {
        self.transforms.get(object.transform as usize).copied().unwrap_or(Transform::PLAIN)
    }

    /// Centers of all flashes.
    pub fn pads(&self) -> Vec<Point> {
        let mut pads = Vec::new();
        each(self, &mut |seen| {
            if let ObjectShape::Flash { at } = seen.object.shape {
                pads.push(seen.place.point(at));
            }
        });
        pads
    }

    /// All flashes with their smaller width, mm.
    pub(in crate::artwork) fn flashes(&self) -> Vec<(Point, f64)> {
        let mut flashes = Vec::new();
        each(self, &mut |seen| {
            if let ObjectShape::Flash { at } = seen.object.shape {
                let width_mm = self.form(seen.object).map_or(0.0, width_mm);
                flashes.push((seen.place.point(at), width_mm * seen.transform(self).scale));
            }
        });
        flashes
    }

    /// Center lines of all strokes, including arcs: start and segment.
    pub fn strokes(&self) -> Vec<(Point, PathSegment)> {
        let mut strokes = Vec::new();
        each(self, &mut |seen| {
            if let ObjectShape::Stroke { from, segment } = seen.object.shape {
                strokes.push((seen.place.point(from), seen.place.segment(segment)));
            }
        });
        strokes
    }

    /// The widths of [`strokes`](Self::strokes), in the same order.
    pub fn stroke_widths(&self) -> Vec<Length> {
        let mut widths = Vec::new();
        each(self, &mut |seen| {
            if matches!(seen.object.shape, ObjectShape::Stroke { .. }) {
                widths.push(seen.across(self));
            }
        });
        widths
    }

    pub fn contours(&self) -> Vec<Path> {
        let mut contours = Vec::new();
        each(self, &mut |seen| {
            if let ObjectShape::Contour(path) = &seen.object.shape {
                contours.push(seen.place.path(path).into_owned());
            }
        });
        contours
    }

    /// All strokes with their half widths, arcs cut into chords.
    pub fn tracks(&self) -> Vec<Track> {
        let mut tracks = Vec::new();
        let mut chords_made = 0;
        each(self, &mut |seen| {
            let ObjectShape::Stroke { from, segment } = seen.object.shape else { return };
            let scale = seen.transform(self).scale;
            let half = self.form(seen.object).map_or(Length::ZERO, half_width);
            let half_width = Length::from_mm(half.mm() * scale);
            let (mut from, segment) = (seen.place.point(from), seen.place.segment(segment));
            let stops = match segment {
                PathSegment::Line { to } => vec![to],
                PathSegment::Arc { to, centre, clockwise } => {
                    let error = if chords_made < MOST_CHORDS { CHORD_ERROR_MM } else { COARSE_MM };
                    chords::arc(from, to, centre, clockwise, error)
                }
            };
            chords_made += stops.len();
            for to in stops {
                tracks.push(Track { from, to, half_width });
                from = to;
            }
        });
        tracks
    }

    /// Bounding box of all flash points and center lines, including arcs; none without objects.
    pub fn centre_bounds(&self) -> Option<Bounds> {
        let mut bounds: Option<Bounds> = None;
        each(self, &mut |seen| {
            let around = match &seen.object.shape {
                ObjectShape::Flash { at } => Bounds::of(seen.place.point(*at)),
                ObjectShape::Stroke { from, segment } => {
                    segment_bounds(seen.place.point(*from), seen.place.segment(*segment))
                }
                ObjectShape::Contour(path) => path_bounds(&seen.place.path(path)),
                ObjectShape::Repeat { .. } => return,
            };
            bounds = Some(bounds.map_or(around, |bounds| bounds.with(around.min).with(around.max)));
        });
        bounds
    }

    /// True if there are strokes, and all have width 0.
    pub fn has_only_hairlines(&self) -> bool {
        let (mut strokes, mut wide) = (false, false);
        each(self, &mut |seen| match seen.object.shape {
            ObjectShape::Stroke { .. } => {
                strokes = true;
                wide |= self.form(seen.object).is_some_and(|form| half_width(form) > Length::ZERO);
            }
            _ => wide = true,
        });
        strokes && !wide
    }
}

fn width_mm(form: &Form) -> f64 {
    let Form::Macro { primitives, .. } = form else { return 2.0 * half_width(form).mm() };
    let paths = primitives.iter().filter(|(adds, _)| *adds).flat_map(|(_, paths)| paths);
    let bounds = paths.map(path_bounds).reduce(|a, b| a.with(b.min).with(b.max));
    bounds.map_or(0.0, |bounds| (bounds.max.x - bounds.min.x).mm().min((bounds.max.y - bounds.min.y).mm()))
}

/// Half of the smallest size; zero for macros and blocks.
fn half_width(form: &Form) -> Length {
    let size = match *form {
        Form::Circle { diameter } | Form::Polygon { diameter, .. } => diameter,
        Form::Rectangle { width, height } | Form::Obround { width, height } => width.min(height),
        Form::Macro { .. } | Form::Block { .. } => Length::ZERO,
    };
    Length::from_nm(size.nm() / 2)
}
