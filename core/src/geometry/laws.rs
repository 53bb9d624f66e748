//! Laws for any board: areas add up, points keep their side, offsets keep their distance. No result depends
//! on the board's position, or on direction and start of its outlines.
//!
//! The test boards are difficult: on a grid, doubled, touching, coincident.

use super::*;
use crate::chance::Chance;

/// Boards tried for every law.
const SEEDS: std::ops::Range<u64> = 1..60;
const UM: f64 = 1e-3;

/// A coordinate within 8 mm, on a grid in mm.
fn on_grid(chance: &mut Chance, grid: f64) -> f64 {
    libm::round(chance.unit() * 8.0 / grid) * grid
}

/// The grid of a board in mm: coarse so that much coincides, or nanometres.
fn grid(seed: u64) -> f64 {
    [0.25, 0.5, 0.1, 1e-6].get(seed as usize % 4).copied().unwrap_or(0.25)
}

fn board(seed: u64, shapes: usize) -> Vec<Path> {
    let mut chance = Chance::new(seed);
    let grid = grid(seed);
    let mut paths: Vec<Path> = Vec::new();
    while paths.len() < shapes {
        let at = Point::from_mm(on_grid(&mut chance, grid), on_grid(&mut chance, grid));
        let size = Length::from_mm(0.25 + on_grid(&mut chance, grid) / 8.0);
        let other = Point::from_mm(on_grid(&mut chance, grid), on_grid(&mut chance, grid));
        match chance.below(6) {
            0 => paths.push(circle(at, size)),
            1 => paths.push(rectangle(Bounds::of(at).with(Point::new(at.x + size, at.y + size + size)))),
            2 => paths
                .extend(stroke(&Path { start: at, segments: vec![PathSegment::Line { to: other }] }, size)),
            3 => {
                let centre = Point::new(at.x + size, at.y);
                let to = Point::new(at.x + size, at.y + size);
                let bend = PathSegment::Arc { to, centre, clockwise: chance.below(2) == 0 };
                paths.extend(stroke(&Path { start: at, segments: vec![bend] }, Length::from_mm(0.25)));
            }
            4 => {
                let third = Point::new(at.x, other.y);
                let triangle = Path::through(&[at, other, third, at]);
                paths.extend(triangle.filter(|triangle| path_area_mm2(triangle).abs() > 0.01));
            }
            _ => paths.extend(paths.last().cloned()),
        }
    }
    paths
}

#[track_caller]
fn close(got: f64, wanted: f64, allowed: f64, seed: u64) {
    assert!((got - wanted).abs() <= allowed, "seed {seed}: {got} instead of {wanted}");
}

/// Tolerance of an area for rounding and for grazing curves, in mm².
fn slack(region: &Region) -> f64 {
    3e-6 * region.paths().map(Path::length_mm).sum::<f64>() + 1e-4
}

#[test]
fn areas_add_up() {
    for seed in SEEDS {
        let (a, b) = (union(&board(seed, 20)), union(&board(seed + 1_000, 20)));
        let of = |rule| area_mm2(&combine(&a, &b, rule));
        let allowed = slack(&a) + slack(&b);
        let (either, both) = (of(CombineRule::Union), of(CombineRule::Intersection));
        close(either + both, area_mm2(&a) + area_mm2(&b), allowed, seed);
        close(of(CombineRule::Difference), area_mm2(&a) - both, allowed, seed);
        close(of(CombineRule::Xor), either - both, allowed, seed);
        let again = combine(&a, &a, CombineRule::Union);
        close(area_mm2(&again), area_mm2(&a), slack(&a), seed);
        assert_eq!(again.islands.len(), a.islands.len(), "seed {seed}");
        assert!(combine(&a, &a, CombineRule::Difference).is_empty(), "seed {seed}");
        let exposures =
            [false, true, false].map(|clear| Exposure { clear, outlines: b.paths().cloned().collect() });
        close(area_mm2(&paint(&exposures)), area_mm2(&b), slack(&b), seed);
    }
}

#[test]
fn union_contains_exactly_the_points_of_its_shapes() {
    for seed in SEEDS {
        let paths = board(seed, 25);
        let region = union(&paths);
        let index = Index::of(&region);
        let mut chance = Chance::new(seed);
        for _ in 0..300 {
            let point = Point::from_mm(chance.unit() * 10.0 - 1.0, chance.unit() * 10.0 - 1.0);
            if index.nearest(point, Length::from_um(1)).is_some() {
                continue;
            }
            let inside = paths.iter().any(|path| winding(path, point) != 0);
            assert_eq!(contains(&region, point), inside, "seed {seed}: {point:?}");
            assert_eq!(index.island_at(point).is_some(), inside, "seed {seed}: {point:?}");
        }
    }
}

/// Distance of a point from a region, negative inside, in mm.
fn depth(region: &Region, index: &Index, point: Point) -> f64 {
    let edge = index.nearest(point, Length::from_mm(50.0)).map_or(50.0, |near| near.distance.mm());
    if contains(region, point) { -edge } else { edge }
}

#[test]
fn offsets_keep_their_distance() {
    for seed in SEEDS {
        let region = union(&board(seed, 16));
        let index = Index::of(&region);
        let by = [0.05, 0.3, -0.05, -0.11].get(seed as usize % 4).copied().unwrap_or(0.1);
        let grown = grow(&region, Length::from_mm(by));
        let mut chance = Chance::new(seed);
        for _ in 0..300 {
            let point = Point::from_mm(chance.unit() * 10.0 - 1.0, chance.unit() * 10.0 - 1.0);
            let depth = depth(&region, &index, point);
            if (depth - by).abs() > UM {
                assert_eq!(contains(&grown, point), depth < by, "seed {seed}: {point:?} {depth} {by}");
            }
        }
        for path in grown.paths() {
            for point in path.flattened(0.02) {
                let depth = depth(&region, &index, point);
                assert!((depth - by).abs() <= UM, "seed {seed}: {point:?} is {depth} off, not {by}");
            }
        }
        assert!(
            grown.paths().all(|path| path.is_closed() && path == &path.clone().from_its_left()),
            "seed {seed}"
        );
    }
}

#[test]
fn results_ignore_position_and_direction() {
    for seed in SEEDS {
        let paths = board(seed, 25);
        let region = union(&paths);
        let grown = grow(&region, Length::from_mm(0.1));
        let shrunk = grow(&region, Length::from_mm(-0.06));
        let same = |other: Vec<Path>, what: &str| {
            let region = [region.clone(), grown.clone(), shrunk.clone()];
            let united = union(&other);
            let others = [grow(&united, Length::from_mm(0.1)), grow(&united, Length::from_mm(-0.06))];
            for (one, two) in region.iter().zip([&united].into_iter().chain(&others)) {
                close(area_mm2(two), area_mm2(one), slack(one), seed);
                assert_eq!(two.islands.len(), one.islands.len(), "seed {seed}, {what}");
            }
        };
        let placed = |placement: Placement| paths.iter().map(|path| placement.path(path)).collect();
        same(paths.iter().map(Path::reversed).collect(), "reversed");
        same(paths.iter().rev().cloned().collect(), "last first");
        same(placed(Placement { mirror: true, ..Placement::default() }), "mirrored");
        same(placed(Placement { rotation_mdeg: QUARTER_MDEG, ..Placement::default() }), "rotated");
        same(placed(Placement::shifted(Point::from_mm(-123.456_789, 77.7))), "shifted");
        let started = |path: &Path| {
            let mut segments = path.segments.clone();
            let middle = segments.len() / 2;
            segments.rotate_left(middle);
            Path { start: path.corners().nth(middle).unwrap_or(path.start), segments }
        };
        same(paths.iter().map(started).collect(), "started elsewhere");
    }
}

/// Nearly tangent lines and arcs with slightly wrong centres, as planners and robots write them.
fn chain(chance: &mut Chance, half_mm: f64) -> Vec<Path> {
    let (mut x, mut y) = (chance.between(-5.0, 5.0), chance.between(-5.0, 5.0));
    let (mut heading, mut pieces) = (chance.between(0.0, std::f64::consts::TAU), Vec::new());
    for _ in 0..2 + chance.below(4) {
        let start = Point::from_mm(x, y);
        let length =
            if chance.below(2) == 0 { chance.between(0.002, 0.03) } else { chance.between(0.03, 0.6) };
        let segment = if chance.below(5) < 2 {
            (x, y) = (x + length * libm::cos(heading), y + length * libm::sin(heading));
            PathSegment::Line { to: Point::from_mm(x, y) }
        } else {
            let radius = half_mm * chance.between(1.06, 5.0);
            let clockwise = chance.below(2) == 0;
            let side = if clockwise { -radius } else { radius };
            let (cx, cy) = (x - side * libm::sin(heading), y + side * libm::cos(heading));
            heading += (length / radius).min(2.5) * side.signum();
            (x, y) = (cx + side * libm::sin(heading), cy - side * libm::cos(heading));
            let off = chance.between(-1e-4, 1e-4);
            PathSegment::Arc {
                to: Point::from_mm(x, y),
                centre: Point::from_mm(cx + off, cy - off),
                clockwise,
            }
        };
        pieces.push(Path { start, segments: vec![segment] });
        let bend = [0.0, 0.06, 0.06, 1.0].get(chance.below(4)).copied().unwrap_or_default();
        let back = if chance.below(4) == 0 { std::f64::consts::PI } else { 0.0 };
        heading += back + chance.between(-bend, bend);
    }
    pieces
}

#[test]
fn sweep_at_once_equals_sweep_by_pieces() {
    for seed in 0..400 {
        let mut chance = Chance::new(seed);
        let width = Length::from_mm(chance.between(0.08, 0.3));
        let pieces = chain(&mut chance, width.mm() / 2.0);
        let alone: Vec<Region> =
            pieces.iter().map(|piece| sweep(std::slice::from_ref(piece), width)).collect();
        let together = sweep(&pieces, width);
        let one_by_one =
            alone.iter().fold(Region::default(), |grown, next| combine(&grown, next, CombineRule::Union));
        let allowed = slack(&together) + 1e-4;
        close(area_mm2(&combine(&together, &one_by_one, CombineRule::Xor)), 0.0, allowed, seed);
        let length: f64 = pieces.iter().map(Path::length_mm).sum();
        let most = (length + width.mm() * std::f64::consts::FRAC_PI_4) * width.mm();
        let least = alone.iter().map(area_mm2).fold(0.0, f64::max);
        let area = area_mm2(&together);
        assert!(area <= most + allowed && area >= least - allowed, "seed {seed}: {least} ≤ {area} ≤ {most}");
    }
}
