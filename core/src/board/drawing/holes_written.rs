//! Writes a modified drill file as Excellon.
//!
//! Holes and slots keep the order of the file; routes follow.

use super::files::decimal;
use crate::artwork::DrillFile;
use crate::geometry::{PathSegment, Point};
use std::fmt::Write;

/// The text of a drill file; `plated` is the default for tools without that attribute.
pub(super) fn excellon_text(drill: &DrillFile, plated: Option<bool>) -> String {
    let mut out = "M48\n".to_owned();
    let mixed =
        drill.tools.iter().any(|tool| tool.plated != drill.tools.first().and_then(|tool| tool.plated));
    let whole = drill.tools.first().and_then(|tool| tool.plated).or(plated).filter(|_| !mixed);
    if let Some(plated) = whole {
        let function = if plated { "Plated,1,2,PTH" } else { "NonPlated,1,2,NPTH" };
        let _ = writeln!(out, "; #@! TF.FileFunction,{function}");
    }
    out += "FMAT,2\nMETRIC\n";
    for (code, tool) in (1..).zip(&drill.tools) {
        if let Some(plated) = tool.plated.filter(|_| mixed) {
            out += if plated { ";TYPE=PLATED\n" } else { ";TYPE=NON_PLATED\n" };
        }
        let size = tool.diameter.map_or_else(String::new, |diameter| format!("C{}", decimal(diameter)));
        let _ = writeln!(out, "T{code}{size}");
    }
    out += "%\nG90\nG05\n";
    let mut tool = None;
    let mut slots = drill.slots.iter().peekable();
    for index in 0..=drill.hits.len() {
        while let Some(slot) = slots.next_if(|slot| slot.after_hits as usize <= index) {
            take(&mut out, &mut tool, slot.tool);
            let _ = writeln!(out, "{}G85{}", place(slot.from), place(slot.to));
        }
        if let Some(hit) = drill.hits.get(index) {
            take(&mut out, &mut tool, hit.tool);
            let _ = writeln!(out, "{}", place(hit.at));
        }
    }
    for route in &drill.routes {
        take(&mut out, &mut tool, route.tool);
        let _ = writeln!(out, "G00{}\nM15", place(route.from));
        let mut from = route.from;
        for segment in &route.segments {
            let _ = match *segment {
                PathSegment::Line { to } => writeln!(out, "G01{}", place(to)),
                PathSegment::Arc { to, centre, clockwise } => {
                    let turn = if clockwise { "G02" } else { "G03" };
                    let (i, j) = (decimal(centre.x - from.x), decimal(centre.y - from.y));
                    writeln!(out, "{turn}{}I{i}J{j}", place(to))
                }
            };
            from = segment.to();
        }
        out += "M16\nG05\n";
    }
    out + "M30\n"
}

fn take(out: &mut String, now: &mut Option<u16>, tool: u16) {
    if now.replace(tool) != Some(tool) {
        let _ = writeln!(out, "T{}", u32::from(tool) + 1);
    }
}

fn place(at: Point) -> String {
    format!("X{}Y{}", decimal(at.x), decimal(at.y))
}
