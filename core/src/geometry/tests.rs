//! Geometry with known areas and counts.

use super::*;
use std::f64::consts::PI;

fn mm(value: f64) -> Length {
    Length::from_mm(value)
}

fn at(x: f64, y: f64) -> Point {
    Point::from_mm(x, y)
}

fn square(x: f64, y: f64, side: f64) -> Path {
    rectangle(Bounds { min: at(x, y), max: at(x + side, y + side) })
}

#[track_caller]
fn close(got: f64, wanted: f64, allowed: f64) {
    assert!((got - wanted).abs() <= allowed, "{got} instead of {wanted}");
}

#[test]
fn union_returns_a_circle_as_one_arc() {
    let region = union(&[circle(at(3.0, 4.0), mm(2.0))]);
    let [island] = region.islands.as_slice() else { panic!("{region:?}") };
    assert_eq!(island.outer, circle(at(3.0, 4.0), mm(2.0)));
    close(area_mm2(&region), PI, 1e-9);
}

#[test]
fn equal_circles_and_half_circles_merge() {
    let whole = circle(at(0.0, 0.0), mm(2.0));
    let centre = at(0.0, 0.0);
    let bow = |from: Point, to: Point| Path {
        start: from,
        segments: vec![PathSegment::Arc { to, centre, clockwise: false }, PathSegment::Line { to: from }],
    };
    let (left, right) = (at(-1.0, 0.0), at(1.0, 0.0));
    for paths in [
        vec![whole.clone(), whole.clone()],
        vec![whole.reversed(), whole.clone()],
        vec![bow(left, right), bow(right, left)],
        vec![bow(left, right), bow(right, left), bow(at(0.0, 1.0), at(0.0, -1.0))],
    ] {
        let region = union(&paths);
        assert_eq!(region.islands.len(), 1, "{region:?}");
        assert_eq!(region.islands[0].outer, whole, "{paths:?}");
    }
}

#[test]
fn lens_has_two_exact_corners() {
    let pair = [circle(at(0.0, 0.0), mm(2.0)), circle(at(1.0, 0.0), mm(2.0))];
    let first = union(&pair[..1]);
    let second = union(&pair[1..]);
    let lens = combine(&first, &second, CombineRule::Intersection);
    let outer = &lens.islands[0].outer;
    assert_eq!(outer.segments.len(), 2);
    let corners: Vec<Point> = outer.corners().collect();
    let height = libm::sqrt(0.75);
    assert!(corners[0].distance_mm(at(0.5, -height)) < 3e-6, "{corners:?}");
    // Corners are whole nanometres, so a radius is half a nanometre off along a few mm of edge.
    close(area_mm2(&lens), 2.0 * PI / 3.0 - height, 8e-6);
    let sum = area_mm2(&union(&pair)) + area_mm2(&lens);
    close(sum, 2.0 * PI, 8e-6);
    close(area_mm2(&combine(&first, &second, CombineRule::Difference)), PI - area_mm2(&lens), 8e-6);
    close(area_mm2(&combine(&first, &second, CombineRule::Xor)), 2.0 * (PI - area_mm2(&lens)), 1.6e-5);
}

#[test]
fn circle_touching_an_edge_from_inside_is_not_lost() {
    let plate = rectangle(Bounds { min: at(5.0, 5.5), max: at(6.25, 8.0) });
    let (plate, hole) = (union(&[plate]), union(&[circle(at(5.5, 7.0), mm(1.0))]));
    let disc = PI / 4.0;
    let rows = [
        (CombineRule::Difference, 3.125 - disc),
        (CombineRule::Xor, 3.125 - disc),
        (CombineRule::Union, 3.125),
        (CombineRule::Intersection, disc),
    ];
    for (rule, area) in rows {
        close(area_mm2(&combine(&plate, &hole, rule)), area, 1e-5);
    }
    let drawn = |clear, region: &Region| Exposure { clear, outlines: region.paths().cloned().collect() };
    close(area_mm2(&paint(&[drawn(false, &plate), drawn(true, &hole)])), 3.125 - disc, 1e-5);
}

#[test]
fn strokes_have_the_area_they_sweep() {
    let way = Path::through(&[at(0.0, 0.0), at(5.0, 0.0), at(5.0, 5.0)]).unwrap();
    let region = sweep(&[way], mm(0.5));
    let quarter = PI * 0.25 * 0.25;
    // Two bands share a quarter square; the outer side of the corner is a quarter circle, each end a half
    // circle.
    close(area_mm2(&region), 2.0 * 5.0 * 0.5 - 0.25 * 0.25 + quarter / 4.0 + quarter, 1e-6);
    assert_eq!(region.islands[0].outer.segments.len(), 7, "{:?}", region.islands[0].outer);

    let collinear = [at(0.0, 0.0), at(5.0, 1.0), at(10.0, 2.0), at(15.0, 3.0)];
    let region = sweep(&[Path::through(&collinear).unwrap()], mm(0.2));
    assert_eq!(region.islands[0].outer.segments.len(), 4, "{:?}", region.islands[0].outer);

    let round = Path {
        start: at(1.0, 0.0),
        segments: vec![PathSegment::Arc { to: at(1.0, 0.0), centre: at(0.0, 0.0), clockwise: true }],
    };
    let ring = sweep(std::slice::from_ref(&round), mm(0.5));
    close(area_mm2(&ring), PI * (1.25 * 1.25 - 0.75 * 0.75), 1e-6);
    assert_eq!(ring.islands[0].outer, circle(at(0.0, 0.0), mm(2.5)));
    assert_eq!(ring.islands[0].holes, vec![circle(at(0.0, 0.0), mm(1.5)).reversed()]);
    let disc = sweep(&[round], mm(2.5));
    assert_eq!(disc.islands[0].outer, circle(at(0.0, 0.0), mm(4.5)));
    assert!(disc.islands[0].holes.is_empty());

    let dot = Path::through(&[at(1.0, 1.0), at(1.0, 1.0)]).unwrap();
    assert_eq!(stroke(&dot, mm(0.3)), vec![circle(at(1.0, 1.0), mm(0.3))]);
    assert!(stroke(&dot, Length::ZERO).is_empty());
}

#[test]
fn self_crossing_paths_hide_nothing() {
    // A figure of eight: one lobe turns left, the other right. A square overlaps the right-turning lobe.
    let eight =
        Path::through(&[at(0.0, 0.0), at(2.0, 2.0), at(2.0, 0.0), at(0.0, 2.0), at(0.0, 0.0)]).unwrap();
    let region = union(&[eight.clone(), square(0.0, 0.5, 0.5)]);
    close(area_mm2(&region), 2.0, 1e-6);
    assert_eq!(area_mm2(&union(&[eight.reversed()])), area_mm2(&union(&[eight])));
    let nested = [square(0.0, 0.0, 4.0), square(1.0, 1.0, 2.0)];
    close(area_mm2(&union(&nested)), 16.0, 1e-9);
    let ring = even_odd(&nested);
    close(area_mm2(&ring), 12.0, 1e-9);
    assert!(contains(&ring, at(0.5, 0.5)) && !contains(&ring, at(2.0, 2.0)));
}

#[test]
fn exposures_are_painted_in_order() {
    let exposure = |clear: bool, outlines: Vec<Path>| Exposure { clear, outlines };
    let exposures = [
        exposure(true, vec![square(-9.0, -9.0, 2.0)]),
        exposure(false, vec![square(0.0, 0.0, 10.0)]),
        exposure(true, vec![square(1.0, 1.0, 8.0)]),
        exposure(false, vec![square(2.0, 2.0, 6.0)]),
        exposure(true, vec![square(3.0, 3.0, 4.0)]),
        exposure(false, vec![circle(at(5.0, 5.0), mm(2.0)), square(3.0, 3.0, 1.0)]),
        exposure(true, vec![square(0.0, 0.0, 0.5)]),
    ];
    let region = paint(&exposures);
    close(area_mm2(&region), 100.0 - 64.0 + 36.0 - 16.0 + PI + 1.0 - 0.25, 1e-6);
    assert_eq!(region.islands.len(), 3);
    // One by one gives the same result as in halves.
    let mut slow = Region::default();
    for exposure in &exposures {
        let rule = if exposure.clear { CombineRule::Difference } else { CombineRule::Union };
        slow = combine(&slow, &union(&exposure.outlines), rule);
    }
    assert_eq!(region, slow);
}

#[test]
fn bounds_include_bulging_arcs() {
    let path = Path {
        start: at(0.0, 0.0),
        segments: vec![
            PathSegment::Arc { to: at(2.0, 0.0), centre: at(1.0, 0.0), clockwise: true },
            PathSegment::Line { to: at(0.0, 0.0) },
        ],
    };
    assert_eq!(path_bounds(&path), Bounds { min: at(0.0, 0.0), max: at(2.0, 1.0) });
    assert_eq!(path_bounds(&path.reversed()), path_bounds(&path));
    let full = path_bounds(&circle(at(1.0, 1.0), mm(2.0)));
    assert_eq!(full, Bounds { min: at(0.0, 0.0), max: at(2.0, 2.0) });
    close(path_area_mm2(&path), -PI / 2.0, 1e-12);
}

#[test]
fn point_containment_respects_arcs() {
    let ring = Region {
        islands: vec![Island {
            outer: circle(at(0.0, 0.0), mm(4.0)),
            holes: vec![circle(at(0.5, 0.0), mm(2.0)).reversed()],
        }],
    };
    for step in 0..400 {
        let point = at(f64::from(step % 20) * 0.25 - 2.43, f64::from(step / 20) * 0.25 - 2.51);
        let inside = point.distance_mm(at(0.0, 0.0)) < 2.0 && point.distance_mm(at(0.5, 0.0)) > 1.0;
        assert_eq!(contains(&ring, point), inside, "{point:?}");
    }
}

#[test]
fn geometry_out_of_reach_is_dropped_or_clipped() {
    let far = square(5_000.0, -5_000.0, 1.0);
    assert!(!path_bounds(&far).is_in_reach());
    assert!(union(&[far]).is_empty());
    let wide = rectangle(Bounds { min: at(-9_000.0, -9_000.0), max: at(9_000.0, 9_000.0) });
    close(area_mm2(&union(&[wide])), 2.0 * REACH.mm() * 2.0 * REACH.mm(), 1e-3);
}

#[test]
fn grown_shapes_have_true_arcs() {
    let grown = grow(&union(&[square(0.0, 0.0, 2.0)]), mm(0.5));
    let outer = &grown.islands[0].outer;
    assert_eq!(outer.segments.len(), 8, "{outer:?}");
    close(area_mm2(&grown), 4.0 + 4.0 * 2.0 * 0.5 + PI * 0.25, 1e-5);
    for (_, segment) in outer.pieces() {
        if let PathSegment::Arc { centre, clockwise, .. } = segment {
            assert!(!clockwise && [at(0.0, 0.0), at(2.0, 0.0), at(0.0, 2.0), at(2.0, 2.0)].contains(&centre));
        }
    }
    let back = grow(&grown, -mm(0.5));
    assert_eq!(back, union(&[square(0.0, 0.0, 2.0)]));
    let smaller = grow(&union(&[square(0.0, 0.0, 2.0)]), -mm(0.5));
    assert_eq!(smaller, union(&[square(0.5, 0.5, 1.0)]));
    assert!(grow(&union(&[square(0.0, 0.0, 2.0)]), -mm(1.01)).is_empty());

    let disc = union(&[circle(at(0.0, 0.0), mm(2.0))]);
    assert_eq!(grow(&disc, mm(0.25)), union(&[circle(at(0.0, 0.0), mm(2.5))]));
    assert_eq!(grow(&disc, -mm(0.25)), union(&[circle(at(0.0, 0.0), mm(1.5))]));
    let ring = Region {
        islands: vec![Island {
            outer: circle(at(0.0, 0.0), mm(4.0)),
            holes: vec![circle(at(0.0, 0.0), mm(1.0)).reversed()],
        }],
    };
    assert_eq!(grow(&ring, mm(0.5)), union(&[circle(at(0.0, 0.0), mm(5.0))]));
    let thin = grow(&ring, -mm(0.5));
    assert_eq!(thin.islands[0].outer, circle(at(0.0, 0.0), mm(3.0)));
    assert_eq!(thin.islands[0].holes, vec![circle(at(0.0, 0.0), mm(2.0)).reversed()]);
}

#[test]
fn nanometre_gaps_do_not_become_gouges() {
    // Two plates a nanometre apart, and a plate with a notch a nanometre wide.
    let low = rectangle(Bounds { min: at(0.0, 0.0), max: at(10.0, 2.0) });
    let high =
        rectangle(Bounds { min: Point::new(mm(0.0), mm(2.0) + Length::from_nm(1)), max: at(10.0, 4.0) });
    let notch =
        rectangle(Bounds { min: at(5.0, 2.0), max: Point::new(mm(5.0) + Length::from_nm(1), mm(4.0)) });
    let plates = union(&[low, high]);
    assert_eq!(plates.islands.len(), 2);
    let cut = combine(
        &plates,
        &Region { islands: vec![Island { outer: notch, holes: vec![] }] },
        CombineRule::Difference,
    );
    let shrunk = grow(&cut, -mm(0.06));
    assert_eq!(shrunk.islands.len(), 1);
    close(area_mm2(&shrunk), 9.88 * 3.88, 1e-4);
}

#[test]
fn index_finds_islands_and_edges() {
    let mut paths = Vec::new();
    for column in 0..10_i32 {
        for row in 0..10_i32 {
            paths.push(circle(at(f64::from(column), f64::from(row)), mm(0.6)));
        }
    }
    let mut region = union(&paths);
    let frame = even_odd(&[square(-2.0, -2.0, 14.0), square(-1.0, -1.0, 12.0)]);
    region.islands.extend(frame.islands);
    let index = Index::of(&region);
    let inside = index.island_at(at(3.1, 4.1)).unwrap();
    assert!(island_contains(&region.islands[inside], at(3.0, 4.0)));
    assert_eq!(index.island_at(at(3.5, 4.5)), None);
    assert_eq!(index.island_at(at(-1.5, 4.5)), Some(100));
    let near = index.nearest(at(3.5, 4.0), mm(1.0)).unwrap();
    assert_eq!((near.distance, near.place.y), (mm(0.2), mm(4.0)));
    assert_eq!(index.nearest(at(3.5, 4.5), mm(0.4)), None);
    assert_eq!(index.edges_in(Bounds::of(at(3.5, 4.0)).grown(mm(0.25))).len(), 2);
}

#[test]
fn narrow_gaps_are_listed_once() {
    let bar = |x0: f64, y0: f64, x1: f64, y1: f64| rectangle(Bounds { min: at(x0, y0), max: at(x1, y1) });
    // Two long tracks with a bulge each, a pad next to them, and a distant one.
    let region = union(&[
        bar(0.0, 0.0, 10.0, 1.0),
        bar(0.0, 1.2, 10.0, 2.0),
        circle(at(2.0, 1.0), mm(0.3)),
        circle(at(8.0, 1.0), mm(0.2)),
        circle(at(11.0, 0.5), mm(1.5)),
        bar(20.0, 0.0, 21.0, 1.0),
    ]);
    let found = gaps(&region, mm(0.3));
    let widths: Vec<f64> = found.iter().map(|gap| gap.width.mm()).collect();
    assert_eq!(found.len(), 2, "{found:?}");
    close(widths[0], 0.05, 2e-6);
    close(widths[1], 0.25, 2e-6);
    let found = gaps(&region, mm(0.12));
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found.iter().all(|gap| gap.a != gap.b));
    close(found[1].width.mm(), 0.1, 2e-6);
}

#[test]
fn island_has_a_gap_to_itself_only_across_a_channel() {
    let bar = |x0: f64, y0: f64, x1: f64, y1: f64| rectangle(Bounds { min: at(x0, y0), max: at(x1, y1) });
    let horseshoe = union(&[bar(0.0, 0.0, 5.0, 1.0), bar(0.0, 1.2, 5.0, 2.0), bar(0.0, 0.0, 1.0, 2.0)]);
    let found = gaps(&horseshoe, mm(0.3));
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].a, found[0].b, found[0].width), (0, 0, mm(0.2)));
    // Inner corners, thin copper, round pads and holes wider than the width are no gaps.
    let corner = union(&[bar(0.0, 0.0, 5.0, 0.1), bar(0.0, 0.0, 0.1, 5.0), circle(at(0.0, 0.0), mm(0.2))]);
    assert_eq!(gaps(&corner, mm(0.3)), vec![]);
    let ring = even_odd(&[circle(at(0.0, 0.0), mm(1.0)), circle(at(0.0, 0.0), mm(0.4))]);
    assert_eq!(gaps(&ring, mm(0.3)), vec![]);
    let wedge =
        Path::through(&[at(0.0, 0.0), at(5.0, 0.0), at(5.0, 3.0), at(1.0, 0.5), at(0.0, 3.0), at(0.0, 0.0)]);
    assert_eq!(gaps(&union(&[wedge.unwrap()]), mm(0.3)), vec![]);
}

#[test]
fn placement_mirrors_rotates_and_shifts() {
    let placement = Placement { mirror: true, rotation_mdeg: 90_000, shift: at(10.0, 0.0) };
    assert_eq!(placement.point(at(1.0, 2.0)), at(8.0, -1.0));
    let region = even_odd(&[square(0.0, 0.0, 3.0), circle(at(1.0, 2.0), mm(1.0))]);
    let placed = placement.region(&region);
    close(area_mm2(&placed), area_mm2(&region), 1e-12);
    assert!(contains(&placed, placement.point(at(0.2, 0.2))));
    assert!(!contains(&placed, placement.point(at(1.0, 2.0))));
    assert_eq!(union(&[placed.islands[0].outer.clone()]).islands[0].outer, placed.islands[0].outer);
    let mut turned = region.clone();
    for _ in 0..4 {
        turned = Placement { rotation_mdeg: -QUARTER_MDEG, ..Placement::default() }.region(&turned);
    }
    assert_eq!(turned, region);
    let third = Placement { rotation_mdeg: 120_000, ..Placement::default() };
    let thrice = third.point(third.point(third.point(at(30.0, 40.0))));
    assert!(thrice.distance_mm(at(30.0, 40.0)) < 3e-6);
    assert_eq!(Placement::shifted(at(1.0, 1.0)).point(at(1.0, 1.0)), at(2.0, 2.0));
}

#[test]
fn strips_run_midway_between_facing_edges() {
    let mm = Length::from_mm;
    let boxed = |x0: f64, y0: f64, x1: f64, y1: f64| {
        rectangle(Bounds::of(Point::from_mm(x0, y0)).with(Point::from_mm(x1, y1)))
    };
    // Two boxes 0.3 apart over 4 mm, and a disc in a round hole with 0.3 clearance.
    let hole = circle(Point::from_mm(20.0, 0.0), mm(4.6));
    let plate = even_odd(&[boxed(10.0, -5.0, 30.0, 5.0), hole, circle(Point::from_mm(20.0, 0.0), mm(4.0))]);
    let pads = union(&[boxed(0.0, 0.0, 4.0, 1.0), boxed(0.0, 1.3, 4.0, 2.0)]);
    let region = combine(&plate, &pads, CombineRule::Union);
    let found = strips(&region, mm(0.25), mm(0.35));
    let length = |strip: &Strip| {
        strip.middle.iter().zip(strip.middle.iter().skip(1)).map(|(a, b)| a.0.distance_mm(b.0)).sum::<f64>()
    };
    let (straight, round): (Vec<_>, Vec<_>) = found.iter().partition(|strip| strip.middle[0].0.x < mm(9.0));
    let along = |strips: &[&Strip]| strips.iter().map(|strip| length(strip)).sum::<f64>();
    assert!((along(&straight) - 4.0).abs() < 0.15, "{}", along(&straight));
    assert!((along(&round) - 4.3 * std::f64::consts::PI).abs() < 0.3, "{}", along(&round));
    for (at, width) in found.iter().flat_map(|strip| &strip.middle) {
        assert!((width.mm() - 0.3).abs() < 1e-5, "{width:?}");
        let off =
            if at.x < mm(9.0) { at.y.mm() - 1.15 } else { at.distance_mm(Point::from_mm(20.0, 0.0)) - 2.15 };
        assert!(off.abs() < 1e-5, "{off} mm off the middle");
    }
    assert!(found.iter().all(|strip| !strip.own && strip.beside.is_some()));
    assert_eq!(strips(&region, mm(0.31), mm(0.35)), []);
    assert_eq!(strips(&region, mm(0.25), mm(0.29)), []);
}

#[test]
fn empty_region_has_a_positive_zero_area() {
    assert!(area_mm2(&Region::default()).is_sign_positive());
}

/// Inclusion and exclusion of areas: nothing is gained or lost.
#[track_caller]
fn shares_out(one: &Region, two: &Region) {
    let of = |rule| area_mm2(&combine(one, two, rule));
    let (either, both) = (of(CombineRule::Union), of(CombineRule::Intersection));
    let sums =
        [either + both - area_mm2(one) - area_mm2(two), of(CombineRule::Difference) + both - area_mm2(one)];
    assert!(sums.iter().all(|off| off.abs() < 1e-5), "{sums:?}");
}

#[test]
fn curves_meeting_near_a_corner_stay_in_position() {
    let disc = |x, y, size| circle(Point::from_mm(x, y), Length::from_mm(size));
    let block = |a, b| rectangle(Bounds::of(a).with(b));
    // Two circles and an edge in one point: a corner found on chords once moved its whole arc 0.6 µm inwards.
    let with_edge =
        union(&[disc(1.5, 5.0, 0.9375), block(Point::from_mm(1.0, 4.5), Point::from_mm(1.6875, 5.875))]);
    shares_out(&with_edge, &union(&[disc(2.0, 5.0, 1.0625)]));
    // A circle 19 nm inside a corner: the corner stays, and its edge as well.
    let round = union(&[disc(0.440912, 3.282127, 1.007086)]);
    let corner = block(Point::from_mm(0.183387, 3.714859), Point::from_mm(1.220179, 5.788443));
    shares_out(&round, &union(&[corner]));
}
