//! Exports a drawing: Gerber X2 for copper and edge, Excellon for holes.
//!
//! ```text
//!  name-top.gbr · name-bottom.gbr · name-edge.gbr      millimetres with six decimals: every nanometre
//!  name-plated.drl · name-unplated.drl
//! ```
//!
//! Imported objects are not exported.

use super::body::corners;
use super::{Drawing, Id, Layer, PadShape, Thing};
use crate::geometry::Point;
use crate::units::{Length, NM_PER_MM};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

const FIRST_CODE: usize = 10;

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Pen {
    Track(Length),
    Pad { shape: PadShape, size: Length, turn_mdeg: i32, drilled: bool },
}

enum Stroke {
    Line(Point, Point),
    Flash { at: Point, pin: Option<(String, usize)> },
}

pub fn files(drawing: &Drawing) -> Vec<(String, String)> {
    let stem = stem(drawing.name());
    let layers =
        [(Layer::Top, "Copper,L1,Top"), (Layer::Bottom, "Copper,L2,Bot"), (Layer::Edge, "Profile,NP")];
    let mut files = Vec::new();
    for (layer, function) in layers {
        if let Some(text) = gerber(drawing, layer, function) {
            files.push((format!("{stem}-{}.gbr", layer.word()), text));
        }
    }
    for (plated, word, function) in
        [(true, "plated", "Plated,1,2,PTH"), (false, "unplated", "NonPlated,1,2,NPTH")]
    {
        if let Some(text) = excellon(drawing, plated, function) {
            files.push((format!("{stem}-{word}.drl"), text));
        }
    }
    files
}

/// The name of a drawing, made safe for file names.
pub fn stem(name: &str) -> String {
    let plain = |letter: char| if letter.is_alphanumeric() || letter == '-' { letter } else { '_' };
    let stem: String = name.trim().chars().take(60).map(plain).collect();
    if stem.is_empty() { "board".to_owned() } else { stem }
}

/// Millimetres, exact, without trailing zeros.
pub(super) fn decimal(length: Length) -> String {
    let nm = length.nm();
    let (whole, rest) =
        (nm.unsigned_abs() / NM_PER_MM.unsigned_abs(), nm.unsigned_abs() % NM_PER_MM.unsigned_abs());
    let sign = if nm < 0 { "-" } else { "" };
    if rest == 0 {
        return format!("{sign}{whole}.0");
    }
    let digits = format!("{rest:06}");
    format!("{sign}{whole}.{}", digits.trim_end_matches('0'))
}

fn gerber(drawing: &Drawing, layer: Layer, function: &str) -> Option<String> {
    let mut drawn: BTreeMap<Pen, Vec<Stroke>> = BTreeMap::new();
    let pins = pins(drawing);
    for (id, entry) in drawing.things() {
        if !entry.thing.layer().is_some_and(|own| own.meets(layer)) {
            continue;
        }
        match &entry.thing {
            Thing::Track { from, to, width, .. } => {
                if let (Some(from), Some(to)) = (drawing.at(*from), drawing.at(*to)) {
                    drawn.entry(Pen::Track(*width)).or_default().push(Stroke::Line(from, to));
                }
            }
            Thing::Pad { node, shape, size, turn_mdeg, .. } => {
                let drilled =
                    drawing.hanging(*node).any(|id| matches!(drawing.thing(id), Some(Thing::Hole { .. })));
                let pen = Pen::Pad { shape: *shape, size: *size, turn_mdeg: *turn_mdeg, drilled };
                if let Some(at) = drawing.at(*node) {
                    drawn.entry(pen).or_default().push(Stroke::Flash { at, pin: pins.get(&id).cloned() });
                }
            }
            _ => {}
        }
    }
    (!drawn.is_empty()).then(|| gerber_text(&drawn, layer, function))
}

fn gerber_text(drawn: &BTreeMap<Pen, Vec<Stroke>>, layer: Layer, function: &str) -> String {
    let mut out = format!(
        "%TF.GenerationSoftware,Annulus,Annulus,{}*%\n%TF.FileFunction,{function}*%\n%TF.FilePolarity,Positive*%\n\
         %FSLAX46Y46*%\n%MOMM*%\n",
        env!("CARGO_PKG_VERSION")
    );
    let macros: BTreeSet<(PadShape, Length, i32)> = drawn.keys().filter_map(Pen::outlined).collect();
    for (number, (shape, size, turn_mdeg)) in macros.iter().enumerate() {
        out += &outline_macro(number, &corners(*shape, *size, *turn_mdeg).unwrap_or_default());
    }
    for (code, pen) in (FIRST_CODE..).zip(drawn.keys()) {
        let function = match pen {
            Pen::Track(_) if layer == Layer::Edge => "Profile",
            Pen::Track(_) => "Conductor",
            Pen::Pad { drilled: true, .. } => "ComponentPad",
            Pen::Pad { .. } => "SMDPad,CuDef",
        };
        let form = match pen {
            Pen::Track(width) => format!("C,{}", decimal(*width)),
            Pen::Pad { shape: PadShape::Circle, size, .. } => format!("C,{}", decimal(*size)),
            Pen::Pad { shape: PadShape::Square, size, turn_mdeg: 0, .. } => {
                format!("R,{0}X{0}", decimal(*size))
            }
            Pen::Pad { shape, size, turn_mdeg, .. } => {
                let number = macros.iter().position(|own| *own == (*shape, *size, *turn_mdeg)).unwrap_or(0);
                format!("PAD{number}")
            }
        };
        let _ = writeln!(out, "%TA.AperFunction,{function}*%\n%ADD{code}{form}*%\n%TD*%");
    }
    out += "G01*\n";
    for (code, strokes) in (FIRST_CODE..).zip(drawn.values()) {
        let _ = writeln!(out, "D{code}*");
        strokes.iter().for_each(|stroke| out += &stroke.text());
    }
    out + "M02*\n"
}

/// A macro aperture with straight edges through exactly these corners.
fn outline_macro(number: usize, corners: &[Point]) -> String {
    let mut out = format!("%AMPAD{number}*\n4,1,{}", corners.len());
    for corner in corners.iter().chain(corners.first()) {
        let _ = write!(out, ",{},{}", decimal(corner.x), decimal(corner.y));
    }
    out + ",0*%\n"
}

impl Pen {
    /// The pads that need a macro aperture.
    fn outlined(&self) -> Option<(PadShape, Length, i32)> {
        match *self {
            Self::Pad { shape: PadShape::Octagon, size, turn_mdeg, .. } => {
                Some((PadShape::Octagon, size, turn_mdeg))
            }
            Self::Pad { shape: PadShape::Square, size, turn_mdeg, .. } if turn_mdeg != 0 => {
                Some((PadShape::Square, size, turn_mdeg))
            }
            _ => None,
        }
    }
}

impl Stroke {
    fn text(&self) -> String {
        let at = |point: &Point| format!("X{}Y{}", point.x.nm(), point.y.nm());
        match self {
            Self::Line(from, to) => format!("{}D02*\n{}D01*\n", at(from), at(to)),
            Self::Flash { at: place, pin: None } => format!("{}D03*\n", at(place)),
            Self::Flash { at: place, pin: Some((group, pin)) } => {
                format!("%TO.P,{group},{pin}*%\n{}D03*\n%TD*%\n", at(place))
            }
        }
    }
}

/// Pin names of pads: the name of their group, and their number in it.
fn pins(drawing: &Drawing) -> BTreeMap<Id, (String, usize)> {
    let mut counts: BTreeMap<Id, usize> = BTreeMap::new();
    let mut pins = BTreeMap::new();
    for (id, entry) in drawing.things() {
        let (Thing::Pad { .. }, Some(group)) = (&entry.thing, entry.group) else { continue };
        let Some(Thing::Group { name }) = drawing.thing(group) else { continue };
        // These characters end a field or a command of the format.
        let plain = |letter: char| if ",*%\\".contains(letter) || letter.is_control() { '_' } else { letter };
        let count = counts.entry(group).or_default();
        *count += 1;
        if !name.is_empty() {
            pins.insert(id, (name.chars().map(plain).collect(), *count));
        }
    }
    pins
}

fn excellon(drawing: &Drawing, plated: bool, function: &str) -> Option<String> {
    let mut sizes: BTreeMap<Length, Vec<Point>> = BTreeMap::new();
    for (_, entry) in drawing.things() {
        let Thing::Hole { node, diameter, plated: own } = entry.thing else { continue };
        if let Some(at) = drawing.at(node).filter(|_| own == plated) {
            sizes.entry(diameter).or_default().push(at);
        }
    }
    if sizes.is_empty() {
        return None;
    }
    let mut out = format!("M48\n; #@! TF.FileFunction,{function}\nFMAT,2\nMETRIC\n");
    for (code, size) in (1..).zip(sizes.keys()) {
        let _ = writeln!(out, "T{code}C{}", decimal(*size));
    }
    out += "%\nG90\nG05\n";
    for (code, places) in (1..).zip(sizes.values()) {
        let _ = writeln!(out, "T{code}");
        for at in places {
            let _ = writeln!(out, "X{}Y{}", decimal(at.x), decimal(at.y));
        }
    }
    Some(out + "M30\n")
}
