//! The holes of a Gerber drill layer (X2 file functions `Plated` and `NonPlated`).
//!
//! ```text
//!   %TF.FileFunction,Plated,1,2,PTH,Drill*%        flash of C,0.8     ●  hit of 0.8 mm
//!   %TA.AperFunction,ComponentDrill*%              stroke of C,1.0   ══  slot, or with successors a route
//!   %ADD10C,0.8*%                                  anything else      ▰  no hole: a diagnostic
//! ```

use super::flatten::{Seen, each};
use super::object::{Form, Gerber, ObjectShape};
use crate::artwork::drill::{DrillFile, Hit, Route, SlotEntry, ToolEntry};
use crate::artwork::findings::Findings;
use crate::code;
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::{PathSegment, Point};
use crate::units::Length;
use std::collections::BTreeMap;

/// True if the layer declares its objects as holes, by its file function or, without one, by an aperture
/// function. The file name isn't enough, because drill drawings have the same names.
pub(in crate::artwork) fn says_holes(layer: &Gerber) -> bool {
    let first = |text: &str, words: &[&str]| {
        let word = text.split(',').next().unwrap_or_default().trim();
        words.contains(&word)
    };
    match layer.file_function.as_deref() {
        Some(function) => first(function, &["Plated", "NonPlated"]),
        None => layer
            .apertures
            .iter()
            .filter_map(|aperture| aperture.function.as_deref())
            .any(|function| first(function, &["ViaDrill", "ComponentDrill", "MechanicalDrill"])),
    }
}

pub(in crate::artwork) fn holes(
    name: &str,
    layer: &Gerber,
    plated: Option<bool>,
) -> (DrillFile, Vec<Diagnostic>) {
    let mut reader = Reader {
        layer,
        plated,
        tools: BTreeMap::new(),
        out: DrillFile::default(),
        route: None,
        findings: Findings::new(name),
    };
    let function = layer.file_function.as_deref().unwrap_or_default();
    if function.split(',').any(|field| ["Blind", "Buried"].contains(&field.trim())) {
        reader.findings.at(Severity::Error, code!("gerber.holes_not_through"), 0, 0, function.as_bytes());
    }
    each(layer, &mut |seen| reader.object(&seen));
    reader.end_route();
    (reader.out, reader.findings.finish())
}

struct Reader<'a> {
    layer: &'a Gerber,
    plated: Option<bool>,
    /// Tools by aperture and size in nm: a scaled aperture is another tool.
    tools: BTreeMap<(u32, i64), u16>,
    out: DrillFile,
    /// The current chain of strokes, each starting at the end of the previous one.
    route: Option<Route>,
    findings: Findings,
}

impl Reader<'_> {
    fn object(&mut self, seen: &Seen<'_>) {
        let line = seen.object.line;
        let Some(tool) = self.tool(seen) else {
            let code = self.layer.aperture(seen.object).map(|aperture| format!("D{}", aperture.code));
            let what = match &seen.object.shape {
                ObjectShape::Contour(_) => "G36".to_owned(),
                _ if seen.clear => "LPC".to_owned(),
                _ => code.unwrap_or_default(),
            };
            self.findings.once(Severity::Error, code!("gerber.no_hole"), line, 1, what.as_bytes());
            return self.end_route();
        };
        match seen.object.shape {
            ObjectShape::Flash { at } => {
                self.end_route();
                self.hit(Hit { at: seen.place.point(at), line, tool });
            }
            ObjectShape::Stroke { from, segment } => {
                self.stroke(seen.place.point(from), seen.place.segment(segment), tool, line);
            }
            ObjectShape::Contour(_) | ObjectShape::Repeat { .. } => {}
        }
    }

    fn tool(&mut self, seen: &Seen<'_>) -> Option<u16> {
        let aperture = self.layer.aperture(seen.object)?;
        let Form::Circle { diameter } = aperture.form else { return None };
        let drawn = matches!(seen.object.shape, ObjectShape::Flash { .. } | ObjectShape::Stroke { .. });
        let diameter = Length::from_mm(diameter.mm() * seen.transform(self.layer).scale);
        if !drawn || seen.clear || aperture.opening.is_some() || diameter <= Length::ZERO {
            return None;
        }
        let key = (seen.object.aperture, diameter.nm());
        if let Some(tool) = self.tools.get(&key) {
            return Some(*tool);
        }
        let tool = u16::try_from(self.out.tools.len()).ok()?;
        self.tools.insert(key, tool);
        let (code, plated, line) = (aperture.code, self.plated, seen.object.line);
        self.out.tools.push(ToolEntry { code, diameter: Some(diameter), plated, line });
        Some(tool)
    }

    /// True if copies place the hole beyond the coordinate limit; reports it.
    fn is_far(&mut self, at: Point, line: u32) -> bool {
        let far = at.x.abs().max(at.y.abs()) > Length::LIMIT;
        if far {
            self.findings.once(Severity::Error, code!("gerber.out_of_reach"), line, 1, b"");
        }
        far
    }

    fn hit(&mut self, hit: Hit) {
        if !self.is_far(hit.at, hit.line) {
            self.out.hits.push(hit);
        }
    }

    fn stroke(&mut self, from: Point, segment: PathSegment, tool: u16, line: u32) {
        if self.is_far(from, line) || self.is_far(segment.to(), line) {
            return self.end_route();
        }
        let end = |route: &Route| route.segments.last().map_or(route.from, |segment| segment.to());
        match &mut self.route {
            Some(route) if route.tool == tool && end(route) == from => route.segments.push(segment),
            _ => {
                self.end_route();
                self.route = Some(Route { from, segments: vec![segment], line, tool });
            }
        }
    }

    /// A single stroke is a slot, or a hole if its length is 0; several are a route.
    fn end_route(&mut self) {
        let Some(route) = self.route.take() else { return };
        let Route { from, line, tool, .. } = route;
        match route.segments[..] {
            [PathSegment::Line { to }] if to == from => self.hit(Hit { at: from, line, tool }),
            [PathSegment::Line { to }] => {
                let after_hits = self.out.hits.len() as u32;
                self.out.slots.push(SlotEntry { from, to, line, tool, after_hits });
            }
            _ => self.out.routes.push(route),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::artwork::Overrides;

    const HEAD: &str = "%FSLAX33Y33*%%MOMM*%%TF.FileFunction,NonPlated,1,2,NPTH,Mixed*%\n\
        %TA.AperFunction,MechanicalDrill*%\n%ADD10C,0.8*%\n%TD*%\n%ADD11C,1.5*%%ADD12R,1X2*%%ADD13C,1X0.5*%\n";

    fn read(body: &str) -> (DrillFile, Vec<(String, u32)>) {
        let text = format!("{HEAD}{body}M02*");
        let (layer, told) = super::super::read("t.gbr", text.as_bytes(), &Overrides::default());
        assert_eq!(told, [], "{body}");
        assert!(says_holes(&layer));
        let (drill, diagnostics) = holes("t.gbr", &layer, Some(false));
        let place = |diagnostic: &Diagnostic| diagnostic.place.as_ref().map_or(0, |place| place.line);
        let diagnostics =
            diagnostics.iter().map(|diagnostic| (diagnostic.code.clone(), place(diagnostic))).collect();
        (drill, diagnostics)
    }

    fn at(x: f64, y: f64) -> Point {
        Point::from_mm(x, y)
    }

    #[test]
    fn flashes_are_holes_and_strokes_are_slots_or_routes() {
        let (drill, diagnostics) = read(
            "D11*\nX1000Y2000D03*\nD10*\nX5000Y0D02*\nX7000D01*\nX0Y0D02*\nX0Y0D01*\n\
             X0Y9000D02*\nX4000D01*\nG75*G03X4000Y11000I0J1000D01*\n",
        );
        assert_eq!(diagnostics, []);
        let sizes: Vec<_> = drill.tools.iter().map(|tool| (tool.code, tool.diameter, tool.plated)).collect();
        let mm = |mm| Some(Length::from_mm(mm));
        assert_eq!(sizes, [(11, mm(1.5), Some(false)), (10, mm(0.8), Some(false))]);
        let hits: Vec<_> = drill.hits.iter().map(|hit| (hit.at, hit.tool, hit.line)).collect();
        assert_eq!(hits, [(at(1.0, 2.0), 0, 7), (at(0.0, 0.0), 1, 12)]);
        let slot = SlotEntry { from: at(5.0, 0.0), to: at(7.0, 0.0), line: 10, tool: 1, after_hits: 1 };
        assert_eq!(drill.slots, [slot]);
        let arc = PathSegment::Arc { to: at(4.0, 11.0), centre: at(4.0, 10.0), clockwise: false };
        let route = Route {
            from: at(0.0, 9.0),
            segments: vec![PathSegment::Line { to: at(4.0, 9.0) }, arc],
            line: 14,
            tool: 1,
        };
        assert_eq!(drill.routes, [route]);
    }

    #[test]
    fn other_shapes_than_round_holes_are_reported_once() {
        let one = |line| vec![("gerber.no_hole".to_owned(), line)];
        for (body, hits, diagnostics) in [
            ("D12*\nX0Y0D03*\nX1000D03*\nD10*\nX0D03*\n", 1, one(7)),
            ("D13*\nX0Y0D03*\n", 0, one(7)),
            ("%LPC*%\nD10*\nX0Y0D03*\n", 0, one(8)),
            ("G36*\nX0Y0D02*\nX1000D01*\nY1000D01*\nX0Y0D01*\nG37*\n", 0, one(11)),
        ] {
            let (drill, told) = read(body);
            assert_eq!((drill.hits.len(), told), (hits, diagnostics), "{body}");
        }
    }

    #[test]
    fn copies_and_scaled_apertures_are_separate_holes() {
        let (drill, diagnostics) =
            read("D10*\n%SRX3Y2I10J20*%\nX0Y0D03*\n%SR*%\n%LS2*%\nX50000Y0D03*\n%LS1*%\nX60000D03*\n");
        assert_eq!(diagnostics, []);
        let sizes: Vec<f64> = drill.tools.iter().filter_map(|tool| Some(tool.diameter?.mm())).collect();
        assert_eq!((drill.hits.len(), sizes), (8, vec![0.8, 1.6]));
        assert_eq!((drill.hits[5].at, drill.hits[6].tool, drill.hits[7].tool), (at(20.0, 20.0), 1, 0));
    }

    #[test]
    fn only_drill_attributes_make_a_hole_layer() {
        for (said, holes) in [
            ("%TF.FileFunction,Plated,1,4,PTH,Drill*%", true),
            ("%TF.FileFunction,Copper,L1,Top*%%TA.AperFunction,ViaDrill*%", false),
            ("%TF.FileFunction,Drillmap*%", false),
            ("%TA.AperFunction,ComponentDrill,PressFit*%", true),
            ("%TA.AperFunction,ComponentPad*%", false),
            ("", false),
        ] {
            let text = format!("%FSLAX33Y33*%%MOMM*%{said}%ADD10C,1*%D10*X0Y0D03*M02*");
            let (layer, _) = super::super::read("drill.gbr", text.as_bytes(), &Overrides::default());
            assert_eq!(says_holes(&layer), holes, "{said}");
        }
        let text = "%FSLAX33Y33*%%MOMM*%%TF.FileFunction,Plated,1,2,Blind,Drill*%M02*";
        let (layer, _) = super::super::read("t", text.as_bytes(), &Overrides::default());
        let (_, told) = holes("t", &layer, Some(true));
        assert_eq!(told[0].code, "gerber.holes_not_through");
    }
}
