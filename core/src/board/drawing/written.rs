//! Writes a modified copper layer as Gerber X2.
//!
//! ```text
//!  Gerber ─┬─ apertures in order; blocks with their contents
//!          └─ objects in order: polarity, mirror, rotation, scale and attributes whenever they change
//! ```
//!
//! Reading the text draws the same layer. Macros are written as the shapes that they draw: discs and
//! polygons. If a macro has an arc that is no full circle, all of it becomes chords with a tolerance of 0.1
//! µm.

use super::files::decimal;
use crate::artwork::{Aperture, Form, Gerber, Object, ObjectShape, Opening, Tag, Transform, painted};
use crate::geometry::{Path, PathSegment, Point, path_area_mm2};
use crate::units::Length;
use std::fmt::Write;

const FIRST_CODE: u32 = 10;
const CHORD_ERROR_MM: f64 = 0.0001;

#[derive(Clone, Debug, PartialEq)]
struct InForce {
    aperture: Option<u32>,
    clear: bool,
    transform: Transform,
    tag: Tag,
}

impl InForce {
    fn first() -> Self {
        Self { aperture: None, clear: false, transform: Transform::PLAIN, tag: Tag::default() }
    }
}

pub(super) fn gerber_text(layer: &Gerber) -> String {
    let mut out = String::new();
    // The checksum would be wrong for the new text.
    for (name, value) in layer.attributes.iter().filter(|(name, _)| name != "MD5") {
        let comma = if value.is_empty() { "" } else { "," };
        let _ = writeln!(out, "%TF.{name}{comma}{}*%", escaped(value, ""));
    }
    out += "%FSLAX46Y46*%\n%MOMM*%\n";
    if layer.negative_image {
        out += "%IPNEG*%\n";
    }
    out += "G75*\nG01*\n";
    let mut writer = Writer { layer, out, now: InForce::first() };
    for (code, aperture) in (FIRST_CODE..).zip(&layer.apertures) {
        writer.define(code, aperture);
    }
    writer.objects(&layer.objects);
    writer.out + "M02*\n"
}

struct Writer<'a> {
    layer: &'a Gerber,
    out: String,
    now: InForce,
}

impl Writer<'_> {
    fn line(&mut self, text: &str) {
        self.out += text;
        self.out.push('\n');
    }

    fn define(&mut self, code: u32, aperture: &Aperture) {
        if let Form::Block { objects } = &aperture.form {
            self.begin_anew();
            self.line(&format!("%ABD{code}*%"));
            self.objects(objects);
            self.begin_anew();
            return self.line("%AB*%");
        }
        if let Some(function) = &aperture.function {
            self.line(&format!("%TA.AperFunction,{}*%", escaped(function, "")));
        }
        let form = match &aperture.form {
            Form::Circle { diameter } => format!("C,{}", decimal(*diameter)),
            Form::Rectangle { width, height } => format!("R,{}X{}", decimal(*width), decimal(*height)),
            Form::Obround { width, height } => format!("O,{}X{}", decimal(*width), decimal(*height)),
            Form::Polygon { diameter, corners, turn_deg } => {
                format!("P,{}X{corners}X{}", decimal(*diameter), number(*turn_deg))
            }
            Form::Macro { primitives, .. } => {
                let name = format!("FORM{code}");
                let text = macro_text(aperture, primitives);
                self.line(&format!("%AM{name}*\n{text}%"));
                name
            }
            Form::Block { .. } => String::new(),
        };
        let opening = match aperture.opening {
            None => String::new(),
            Some(Opening::Round(diameter)) => format!("X{}", decimal(diameter)),
            Some(Opening::Rectangle(width, height)) => format!("X{}X{}", decimal(width), decimal(height)),
        };
        self.line(&format!("%ADD{code}{form}{opening}*%"));
        if aperture.function.is_some() {
            self.line("%TD*%");
        }
    }

    fn begin_anew(&mut self) {
        if self.now != InForce::first() {
            self.line("%TD*%\n%LPD*%\n%LMN*%\n%LR0*%\n%LS1*%");
            self.now = InForce::first();
        }
    }

    fn objects(&mut self, objects: &[Object]) {
        for object in objects {
            self.object(object);
        }
    }

    fn object(&mut self, object: &Object) {
        self.put_in_force(object);
        match &object.shape {
            ObjectShape::Flash { at } => self.line(&format!("{}D03*", place(*at))),
            ObjectShape::Stroke { from, segment } => {
                self.line(&format!("{}D02*", place(*from)));
                self.segment(*from, *segment);
            }
            ObjectShape::Contour(path) => {
                self.line(&format!("G36*\n{}D02*", place(path.start)));
                path.pieces().for_each(|(from, segment)| self.segment(from, segment));
                self.line("G37*");
            }
            ObjectShape::Repeat { objects, columns, rows, step } => {
                let (x, y) = (decimal(step.x), decimal(step.y));
                self.begin_anew();
                self.line(&format!("%SRX{columns}Y{rows}I{x}J{y}*%"));
                self.objects(objects);
                self.begin_anew();
                self.line("%SR*%");
            }
        }
    }

    fn segment(&mut self, from: Point, segment: PathSegment) {
        match segment {
            PathSegment::Line { to } => self.line(&format!("{}D01*", place(to))),
            PathSegment::Arc { to, centre, clockwise } => {
                let turn = if clockwise { "G02" } else { "G03" };
                let (i, j) = ((centre.x - from.x).nm(), (centre.y - from.y).nm());
                self.line(&format!("{turn}*\n{}I{i}J{j}D01*\nG01*", place(to)));
            }
        }
    }

    fn put_in_force(&mut self, object: &Object) {
        if matches!(object.shape, ObjectShape::Repeat { .. }) {
            return;
        }
        let transform = self.layer.transforms.get(object.transform as usize).copied();
        let tag = self.layer.tags.get(object.tag as usize).cloned().unwrap_or_default();
        let drawn = matches!(object.shape, ObjectShape::Flash { .. } | ObjectShape::Stroke { .. });
        let next = InForce {
            aperture: if drawn { Some(object.aperture) } else { self.now.aperture },
            clear: object.clear,
            transform: transform.unwrap_or(Transform::PLAIN),
            tag,
        };
        let was = std::mem::replace(&mut self.now, next.clone());
        if was.tag != next.tag {
            self.tag(&next.tag);
        }
        if was.clear != next.clear {
            self.line(if next.clear { "%LPC*%" } else { "%LPD*%" });
        }
        let Transform { mirrored, turn_deg, scale } = next.transform;
        if was.transform.mirrored != mirrored {
            self.line(if mirrored { "%LMX*%" } else { "%LMN*%" });
        }
        if was.transform.turn_deg.total_cmp(&turn_deg).is_ne() {
            self.line(&format!("%LR{}*%", number(turn_deg)));
        }
        if was.transform.scale.total_cmp(&scale).is_ne() {
            self.line(&format!("%LS{}*%", number(scale)));
        }
        if let Some(aperture) = next.aperture.filter(|_| was.aperture != next.aperture) {
            self.line(&format!("D{}*", FIRST_CODE + aperture));
        }
    }

    fn tag(&mut self, tag: &Tag) {
        self.line("%TD*%");
        if let Some(net) = &tag.net {
            self.line(&format!("%TO.N,{}*%", escaped(net, ",")));
        }
        match (&tag.component, &tag.pin) {
            (Some(component), Some(pin)) => {
                self.line(&format!("%TO.P,{},{}*%", escaped(component, ","), escaped(pin, ",")));
            }
            (Some(component), None) => self.line(&format!("%TO.C,{}*%", escaped(component, ","))),
            (None, _) => {}
        }
        if let Some(function) = &tag.function {
            self.line(&format!("%TA.AperFunction,{}*%", escaped(function, "")));
        }
    }
}

fn place(at: Point) -> String {
    format!("X{}Y{}", at.x.nm(), at.y.nm())
}

/// At most nine decimals, without trailing zeros.
fn number(value: f64) -> String {
    let text = format!("{value:.9}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".to_owned() } else { short.to_owned() }
}

fn escaped(text: &str, also: &str) -> String {
    let one = |letter: char| {
        if "*%\\".contains(letter) || also.contains(letter) || !letter.is_ascii() || letter.is_control() {
            let mut units = [0; 2];
            letter.encode_utf16(&mut units).iter().map(|unit| format!("\\u{unit:04X}")).collect()
        } else {
            letter.to_string()
        }
    };
    text.chars().map(one).collect::<String>()
}

fn macro_text(aperture: &Aperture, primitives: &[(bool, Vec<Path>)]) -> String {
    let plain: Option<Vec<String>> = primitives
        .iter()
        .map(|(dark, paths)| match paths.as_slice() {
            [path] => primitive(path, *dark),
            _ => None,
        })
        .collect();
    plain.map_or_else(|| outlined(aperture), |lines| lines.concat())
}

/// A disc or a polygon; `None` for others.
fn primitive(path: &Path, dark: bool) -> Option<String> {
    let dark = i32::from(dark);
    if let [PathSegment::Arc { to, centre, .. }] = path.segments.as_slice()
        && *to == path.start
    {
        let diameter = Length::from_mm(2.0 * path.start.distance_mm(*centre));
        let (x, y) = (decimal(centre.x), decimal(centre.y));
        return Some(format!("1,{dark},{},{x},{y}*\n", decimal(diameter)));
    }
    let is_line = |segment: &PathSegment| matches!(segment, PathSegment::Line { .. });
    path.segments.iter().all(is_line).then(|| outline(&path.corners().collect::<Vec<_>>(), dark))
}

fn outline(corners: &[Point], dark: i32) -> String {
    let corners = match corners {
        [first, rest @ .., last] if !rest.is_empty() && first == last => {
            corners.get(..corners.len() - 1).unwrap_or(corners)
        }
        _ => corners,
    };
    let mut out = format!("4,{dark},{}", corners.len());
    for corner in corners.iter().chain(corners.first()) {
        let _ = write!(out, ",{},{}", decimal(corner.x), decimal(corner.y));
    }
    out + ",0*\n"
}

/// The aperture as polygons, arcs as chords: outer outlines before inner ones.
fn outlined(aperture: &Aperture) -> String {
    let flash = Object {
        shape: ObjectShape::Flash { at: Point::default() },
        clear: false,
        aperture: 0,
        transform: 0,
        tag: 0,
        line: 0,
        column: 0,
    };
    let alone = Gerber { objects: vec![flash], apertures: vec![aperture.clone()], ..Gerber::default() };
    let mut islands = painted(&alone).unwrap_or_default().islands;
    islands.sort_by(|a, b| path_area_mm2(&b.outer).total_cmp(&path_area_mm2(&a.outer)));
    let rings = islands.iter().flat_map(|island| {
        std::iter::once((&island.outer, 1)).chain(island.holes.iter().map(|hole| (hole, 0)))
    });
    rings.map(|(path, dark)| outline(&path.flattened(CHORD_ERROR_MM), dark)).collect()
}
