//! Small programs and their holes, one quirk per row.

use annulus_core::artwork::{DrillFile, read_drill};
use annulus_core::diagnostic::Severity;

/// Hits as `x,y`, slots as `x,y-x,y`, routes as `x,y>x,y>x,y` in mm, in this order.
fn shown(drill: &DrillFile) -> String {
    let point = |p: annulus_core::geometry::Point| format!("{},{}", p.x.mm(), p.y.mm());
    let hits = drill.hits.iter().map(|hit| point(hit.at));
    let slots = drill.slots.iter().map(|slot| format!("{}-{}", point(slot.from), point(slot.to)));
    let routes = drill.routes.iter().map(|route| {
        let ends = route.segments.iter().map(|segment| format!(">{}", point(segment.to())));
        point(route.from) + &ends.collect::<String>()
    });
    hits.chain(slots).chain(routes).collect::<Vec<_>>().join(" ")
}

const HEADER: &str = "M48\nMETRIC\nT1C0.8\n%\nT1\n";

#[test]
fn every_quirk_gives_its_holes() {
    // Body, holes, code of the most severe diagnostic.
    for (body, holes, code) in [
        ("X1.0Y2.0\nX3.0\nY4.0\n", "1,2 3,2 3,4", ""),
        ("X1.0Y2.0\nR2X1.0\nR1Y-1.0\n", "1,2 2,2 3,2 3,1", ""),
        ("G91\nX1.0Y1.0\nX1.0\nG90\nX1.0\n", "1,1 2,1 1,1", ""),
        ("ICI,ON\nX1.0Y1.0\nX1.0\n", "1,1 2,1", ""),
        ("G93X10.0Y0.0\nX1.0Y1.0\n", "11,1", "drill.zero_set"),
        ("X1.0Y1.0\nM72\nX1.0Y1.0\n", "1,1 25.4,25.4", "drill.units_change"),
        ("M25\nX1.0Y1.0\nM01\nM02X2.0Y0.0\nM02X2.0Y0.0\nM08\n", "1,1 3,1 5,1", ""),
        ("X1.0Y1.0G85X2.0Y1.0\nG85X2.0Y3.0\nG05\nX9.0Y9.0\n", "9,9 1,1-2,1 2,1-2,3", ""),
        ("G00X1.0Y1.0\nM15\nG01X2.0\nY2.0\nM16\nG05\nX5.0Y5.0\n", "5,5 1,1>2,1>2,2", ""),
        ("G00X1.0Y1.0\nM15\nG03X2.0Y2.0A1.0\nM17\n", "1,1>2,2", ""),
        ("G00X1.0Y1.0\nM15\nM16\n", "", "drill.plunge_without_path"),
        ("X1.0Y1.0 (first)\nN20 x2.0y1.0 ; second\n", "1,1 2,1", ""),
        ("/X1.0Y1.0\nX2.0Y1.0\n", "2,1", "drill.optional_line"),
        ("X1.0.0Y1.0\nX2.0Y1.0\n", "2,1", "drill.bad_number"),
        ("X1.0Y1.0\nG84X3.0\n", "1,1", "drill.unsupported_cycle"),
        ("M97,TEXT\nX1.0Y1.0\n", "1,1", "drill.text_not_drilled"),
        ("T7\nX1.0Y1.0\n", "1,1", "drill.tool_without_diameter"),
        ("X99999.0Y1.0\nX1.0Y1.0\n", "1,1", "drill.out_of_range"),
        ("ICI,ON\nX9000.0Y1.0\nX2000.0\nX-1000.0\n", "9000,1 8000,1", "drill.board_large"),
        ("X1.0Y1.0M30\n", "1,1", ""),
    ] {
        let end = if body.contains("M30") { "" } else { "M30\n" };
        for (name, ends) in [("LF", "\n"), ("CR LF", "\r\n"), ("CR", "\r")] {
            let text = format!("{HEADER}{body}{end}").replace('\n', ends);
            let file = read_drill("row.drl", text.as_bytes());
            assert_eq!(shown(file.drill.as_ref().unwrap()), holes, "{name}: {body}");
            let gravest = file.diagnostics.iter().max_by_key(|diagnostic| diagnostic.severity);
            assert_eq!(
                gravest.map_or("", |diagnostic| diagnostic.code.as_str()),
                code,
                "{name}: {body} {:?}",
                file.diagnostics
            );
        }
    }
}

#[test]
fn equal_faults_are_one_problem_and_reading_continues() {
    let text = format!("{HEADER}{}X1.0Y1.0\nM30\n", "X--1\n".repeat(500));
    let file = read_drill("row.drl", text.as_bytes());
    assert_eq!(file.drill.as_ref().map(|drill| drill.hits.len()), Some(1));
    let faults: Vec<_> = file.diagnostics.iter().filter(|one| one.severity == Severity::Error).collect();
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert_eq!(faults[0].place.as_ref().map(|place| (place.line, place.column)), Some((6, 2)));
    assert_eq!(faults[0].argument(&["more"]), Some("499"));
}
