//! Cut-outs with smaller tools: inner contours and inlets too narrow for the first tool.

use super::*;

#[test]
fn smaller_tools_cut_narrow_parts_before_the_board_is_free() {
    // On 30 × 20 mm: a contour 1 mm wide, one 0.4 mm wide, one 5 mm wide, an inlet 1 mm wide from below, and
    // a drawn hole.
    let inlet = Path::through(&[
        at(0.0, 0.0),
        at(4.0, 0.0),
        at(4.0, 5.0),
        at(5.0, 5.0),
        at(5.0, 0.0),
        at(30.0, 0.0),
        at(30.0, 20.0),
        at(0.0, 20.0),
        at(0.0, 0.0),
    ])
    .unwrap();
    let narrow = [boxed(8.0, 4.0, 9.0, 10.0), boxed(12.0, 4.0, 12.4, 10.0), boxed(15.0, 4.0, 20.0, 10.0)];
    let mut outlines = vec![inlet, circle(at(25.0, 10.0), mm(1.0))];
    outlines.extend(narrow);
    let outline = crate::geometry::even_odd(&outlines);
    let board = Board { outline, holes: vec![hole(25.0, 10.0, 1.0)], ..Board::default() };
    // Smaller tools, widths that are missing, and the number of toolpaths of each tool.
    let rows: [(&[&str], &[&str], &[usize]); 4] = [
        (&[], &["0.4", "1"], &[2]),
        (&["end mill 0.8"], &["0.4"], &[2, 2]),
        (&["end mill 0.8", "m"], &[], &[2, 1, 2]),
        (&["m"], &[], &[3, 2]),
    ];
    for (further, missing, counts) in rows {
        let mut work = only(&board, "cut_out", |operation| {
            if let OperationKind::CutOut(cut_out) = &mut operation.action {
                cut_out.further = further.iter().map(|name| (*name).to_owned()).collect();
            }
        });
        work.bits.push(mill("m", 0.3));
        let (planned, diagnostics) = planned(&board, &work);
        let told = diagnostics.iter().filter(|diagnostic| diagnostic.code == "cam.cut_outs_missing");
        let told: Vec<_> = told.map(|diagnostic| diagnostic.args[1].1.as_str()).collect();
        assert_eq!(told, missing, "{further:?}");
        let tasks = &planned.parts[0].tasks;
        let found: Vec<usize> = tasks.iter().map(|task| task.toolpaths.len()).collect();
        assert_eq!(found, counts, "{further:?}");
        assert_eq!(tasks.last().unwrap().bit.name, "end mill 1.5", "the board comes loose last");
        // No tool cuts into the board, and only the outer contour has tabs.
        for task in tasks {
            let edge =
                Area::of(&grow(&board.outline, Length::from_nm(task.bit.diameter.nm() / 2) - mm(0.003)));
            for way in &task.toolpaths {
                assert!(way.path.corners().all(|corner| !edge.contains(corner)), "{:?}", way.path);
                assert!(way.tabs.is_empty() || task.bit.name == "end mill 1.5");
                assert!(way.depths.len() > 1, "in passes");
            }
        }
        // A tool that fits into the narrow contour cuts all of it.
        let bounds = crate::geometry::path_bounds(&boxed(8.0, 4.0, 9.0, 10.0));
        let inside = planned.toolpaths().any(|way| {
            let own = crate::geometry::path_bounds(&way.path);
            way.path.is_closed()
                && bounds.contains(own.min)
                && bounds.contains(own.max)
                && way.path.length_mm() > 10.0
        });
        assert_eq!(inside, !further.is_empty(), "{further:?}");
    }
}
