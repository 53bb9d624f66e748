//! Links between toolpaths across copper of no net, and the order of toolpaths.

use super::super::route::{Rules, arranged};
use super::*;

#[test]
fn strip_of_1_mm_is_crossed_without_retract() {
    // Centres of pads of 2 mm, and how many toolpaths isolate them with a cut of 0.2 mm.
    let rows: [(&[(f64, f64)], usize); 4] = [
        (&[(2.0, 2.0), (4.9, 2.0)], 1),
        (&[(2.0, 2.0), (5.1, 2.0), (8.2, 2.0), (5.1, 5.1)], 1),
        (&[(2.0, 2.0), (5.3, 2.0)], 2),
        (&[(2.0, 2.0), (5.1, 2.0), (8.5, 2.0)], 2),
    ];
    for (row, (centres, count)) in rows.into_iter().enumerate() {
        let pads: Vec<Path> = centres.iter().map(|&(x, y)| circle(at(x, y), mm(2.0))).collect();
        let board = with_copper(&pads);
        for passes in [1, 2] {
            let work = isolation(&board, 0.2, |isolate| isolate.passes = passes);
            let (planned, _) = planned(&board, &work);
            if passes == 1 {
                assert_eq!(planned.toolpaths().count(), count, "row {row}");
            }
            assert!(planned.toolpaths().count() <= count, "row {row}");
            assert!(least_clearance(&planned, &work) > -0.0025, "row {row}");
        }
    }
}

#[test]
fn link_crosses_no_copper_between_two_toolpaths() {
    // A pad in a closed ring of copper: nothing joins the inside and the outside of the ring.
    let ring = |diameter: f64| circle(at(5.0, 5.0), mm(diameter));
    let region = crate::geometry::even_odd(&[ring(5.3), ring(4.7), ring(4.0)]);
    let mut board = with_copper(&[ring(4.0)]);
    board.copper[0] = Copper { face: Face::Top, nets: vec![None; 2], region, ..Copper::default() };
    let work = isolation(&board, 0.2, |isolate| isolate.passes = 1);
    let (planned, _) = planned(&board, &work);
    assert_eq!(planned.toolpaths().count(), 2);
    assert!(least_clearance(&planned, &work) > -0.0025);
}

#[test]
fn toolpath_starts_between_its_neighbours() {
    let paths = vec![boxed(5.0, 0.0, 15.0, 10.0), boxed(16.0, 20.0, 17.0, 21.0)];
    let rules =
        Rules { start: Point::default(), overlap: Length::ZERO, both_ways: true, link: None, seed: 1 };
    let order = arranged(paths, &rules);
    let (_, travel) = order
        .iter()
        .fold((Point::default(), 0.0), |(here, sum), path| (path.end(), sum + here.distance_mm(path.start)));
    // By way of the corner at 5, 10; by the nearest corner at 5, 0 it is 27.8 mm.
    assert!(travel < 26.1, "{travel} mm");
}
