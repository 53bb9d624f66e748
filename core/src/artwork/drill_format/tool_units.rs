//! Drill programs whose tools and coordinates are in different units.
//!
//! ```text
//!   METRIC      T1C0.015   0.015 mm: no drill is as thin
//!   M72         X001600    0.16 inch
//!               read in inch, all tools are drills: 0.015 inch is 0.381 mm
//! ```

use crate::artwork::Units;
use crate::artwork::drill::DrillFile;
use crate::artwork::number::Decimal;
use crate::code;
use crate::diagnostic::Diagnostic;
use crate::units::Length;

const THINNEST_MM: f64 = 0.1;
const THICKEST_MM: f64 = 7.0;

/// Warns about tools in other units than the coordinates' `units` that are impossible as drills. If all of
/// them are drills in `units`, converts them.
pub(super) fn settle(drill: &mut DrillFile, units: Units, sizes: &[Decimal]) -> Option<Diagnostic> {
    let other = if units == Units::Mm { Units::Inch } else { Units::Mm };
    // The tool's size as written, read in the units of the coordinates.
    let meant = |diameter: Length| {
        let size = sizes.iter().find(|size| size.length(other) == Some(diameter))?;
        size.length(units)
    };
    let is_drill = |length: Length| (THINNEST_MM..=THICKEST_MM).contains(&length.mm());
    let read: Vec<Length> = drill.tools.iter().filter_map(|tool| tool.diameter).collect();
    let in_units: Vec<Length> = read.iter().filter_map(|diameter| meant(*diameter)).collect();
    let as_written = |diameter: &Length| sizes.iter().any(|size| size.length(units) == Some(*diameter));
    let all_other = !read.is_empty() && in_units.len() == read.len() && !read.iter().all(as_written);
    if !all_other || read.iter().all(|length| is_drill(*length)) {
        return None;
    }
    let span = |all: &[Length]| {
        let low = all.iter().min().copied().unwrap_or_default();
        let high = all.iter().max().copied().unwrap_or_default();
        format!("{:.3}–{:.3}", low.mm(), high.mm())
    };
    let mended = in_units.iter().all(|length| is_drill(*length));
    if mended {
        for tool in &mut drill.tools {
            tool.diameter = tool.diameter.and_then(meant).or(tool.diameter);
        }
    }
    let code =
        if mended { code!("drill.tools_in_units_of_places") } else { code!("drill.tools_in_other_units") };
    let warning = Diagnostic::warning(code).with("tools", other.name()).with("places", units.name());
    Some(warning.with("read", span(&read)).with("meant", span(&in_units)))
}

#[cfg(test)]
mod tests {
    use crate::artwork::read_drill;
    use crate::diagnostic::Severity;

    #[test]
    fn tool_units_other_than_those_of_positions_are_reported() {
        // Head, sizes of two tools, the diagnostic, and the first size in mm.
        let rows = [
            ("METRIC", ["0.015", "0.142"], Some("drill.tools_in_units_of_places"), 0.381),
            ("METRIC", ["0.4", "0.9"], None, 0.4),
            ("INCH", ["0.015", "0.142"], None, 0.381),
            ("METRIC", ["0.02", "0.9"], Some("drill.tools_in_other_units"), 0.02),
        ];
        for (head, [first, second], said, mm) in rows {
            let text = format!(
                "M48\n;FORMAT={{2:4/ absolute / inch / keep zeros}}\nFMAT,2\n{head},TZ\nT1C{first}\nT2C{second}\n%\nG90\nM72\n\
                 T1\nX001600Y021800\nX002000Y018500\nT2\nX002550Y022000\nM30\n"
            );
            let file = read_drill("board.drl", text.as_bytes());
            let drill = file.drill.as_ref().unwrap();
            assert_eq!(drill.hits[0].at.x.mm(), 4.064, "{head} {first}");
            let size = drill.tools[0].diameter.unwrap().mm();
            assert!((size - mm).abs() < 1e-9, "{head} {first}: {size}");
            let told =
                file.diagnostics.iter().filter(|diagnostic| diagnostic.code.starts_with("drill.tools_in"));
            let told: Vec<_> = told.collect();
            assert_eq!(
                told.iter().map(|diagnostic| diagnostic.code.as_str()).collect::<Vec<_>>(),
                Vec::from_iter(said)
            );
            for diagnostic in told {
                assert_eq!(diagnostic.severity, Severity::Warning);
                let sentence = diagnostic.message("en") + &diagnostic.advice("en");
                assert!(sentence.contains("inch") && !sentence.contains('{'), "{sentence}");
                assert!(!sentence.contains(&diagnostic.code), "{sentence}");
            }
        }
    }
}
