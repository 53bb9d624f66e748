//! Tests of drill files with routes, read back by this project's own reader.

use super::programs::{change, program, random_program, small};
use annulus_core::artwork::{DrillFile, OURS, read_drill};
use annulus_core::geometry::{Path, PathSegment, Point};
use annulus_core::job::{Command, Leg, Mark, Program};
use annulus_core::post;
use annulus_core::units::Length;

fn read(text: &str) -> DrillFile {
    let read = read_drill("out.drl", text.as_bytes());
    let told: Vec<String> = read.diagnostics.iter().map(|diagnostic| diagnostic.message("en")).collect();
    assert!(told.is_empty(), "{told:?}\n{text}");
    read.drill.unwrap_or_else(|| panic!("no drill file:\n{text}"))
}

fn in_file(program: &Program, at: Point) -> Point {
    Point::new(at.x + program.origin.x, at.y + program.origin.y)
}

fn wanted(program: &Program) -> Vec<Path> {
    let mut out = Vec::new();
    for leg in &program.legs {
        let mut path = Path::default();
        for command in &leg.commands {
            let at = |to: Point| in_file(program, to);
            match *command {
                Command::Rapid { to } => path.start = at(to),
                Command::Mill { to, .. } => path.segments.push(PathSegment::Line { to: at(to) }),
                Command::MillArc { to, center, ccw, .. } => {
                    path.segments.push(PathSegment::Arc { to: at(to), centre: at(center), clockwise: !ccw });
                }
                _ => {}
            }
        }
        if matches!(leg.mark, Mark::Toolpath(_)) {
            out.push(path);
        }
    }
    out
}

#[test]
fn first_comment_names_annulus() {
    let text = post::excellon(&small(), None).unwrap();
    assert_eq!(text.lines().find(|line| line.starts_with(';')), Some(OURS));
}

#[test]
fn excellon_routes_and_holes_read_back_equal() {
    for seed in 0..300 {
        let program = random_program(seed, Some(Length::from_um(-1_800)));
        let file = read(&post::excellon(&program, None).unwrap());
        let holes: Vec<Point> = program
            .legs
            .iter()
            .filter(|leg| matches!(leg.mark, Mark::Hole(_)))
            .filter_map(|leg| match leg.commands.first() {
                Some(Command::Rapid { to }) => Some(in_file(&program, *to)),
                _ => None,
            })
            .collect();
        assert_eq!(file.hits.iter().map(|hit| hit.at).collect::<Vec<_>>(), holes, "seed {seed}");
        let wanted = wanted(&program);
        assert_eq!(file.routes.len(), wanted.len(), "seed {seed}");
        for (route, path) in file.routes.iter().zip(&wanted) {
            let found = Path { start: route.from, segments: route.segments.clone() };
            assert_eq!((found.start, found.end()), (path.start, path.end()), "seed {seed}");
            let off = (found.length_mm() - path.length_mm()).abs();
            assert!(off < 1e-4, "seed {seed}: {off} mm: {found:?} {path:?}");
        }
    }
}

#[test]
fn excellon_corners_read_back_to_a_nanometre() {
    let program = random_program(7, Some(Length::from_nm(-1_234_567)));
    let file = read(&post::excellon(&program, Some(0.01)).unwrap());
    let mut ends = file.routes.iter().flat_map(|route| route.segments.iter().map(|segment| segment.to()));
    for path in wanted(&program) {
        for segment in &path.segments {
            assert!(ends.any(|end| end == segment.to()), "{segment:?}");
        }
    }
    assert!(
        file.routes
            .iter()
            .flat_map(|route| &route.segments)
            .all(|segment| matches!(segment, PathSegment::Line { .. }))
    );
}

fn steps(heights: &[i64]) -> Program {
    let at = Point::from_mm;
    let mut commands = vec![Command::Rapid { to: at(0.0, 0.0) }];
    for &um in heights {
        let height = Length::from_um(um);
        commands.push(Command::Plunge { to: height, feed_um_per_s: 1_000, gate: None });
        for (x, y) in [(10.0, 0.0), (10.0, 10.0), (0.0, 10.0), (0.0, 0.0)] {
            commands.push(Command::Mill { to: at(x, y), height, feed_um_per_s: 1_000 });
        }
    }
    commands.push(Command::Retract { to: Length::from_um(2_000) });
    program(vec![change(1, 30_000, 0), Leg { mark: Mark::Toolpath(0), commands }])
}

#[test]
fn depth_passes_become_one_route_and_tabs_split_it() {
    let file = read(&post::excellon(&steps(&[-600, -1_200, -1_800]), None).unwrap());
    assert_eq!((file.routes.len(), file.routes[0].segments.len()), (1, 4));
    // A tab: up at 4 mm along the first side, down again at 6 mm.
    let mut tabbed = steps(&[-1_800]);
    let (low, high) = (Length::from_um(-1_800), Length::from_um(-900));
    let mill = |x, height| Command::Mill { to: Point::from_mm(x, 0.0), height, feed_um_per_s: 1_000 };
    let tab = [mill(4.0, low), mill(4.0, high), mill(6.0, high), mill(6.0, low)];
    for leg in tabbed.legs.iter_mut().filter(|leg| matches!(leg.mark, Mark::Toolpath(_))) {
        leg.commands.splice(2..2, tab);
    }
    let file = read(&post::excellon(&tabbed, None).unwrap());
    let from: Vec<Point> = file.routes.iter().map(|route| route.from).collect();
    assert_eq!(from, [Point::from_mm(10.0, 20.0), Point::from_mm(16.0, 20.0)]);
    assert_eq!(file.routes[0].segments, [PathSegment::Line { to: Point::from_mm(14.0, 20.0) }]);
}

#[test]
fn excellon_refuses_shallow_cuts_and_v_bits() {
    let mut program = steps(&[-600]);
    let shallow = steps(&[-100]).legs;
    program.legs.extend(shallow);
    assert_eq!(post::excellon(&program, None).unwrap_err().code, "post.excellon_depth");
    let mut vee = steps(&[-100]);
    for leg in &mut vee.legs {
        if let Mark::ToolChange(bit) = &mut leg.mark {
            *bit = 2;
        }
    }
    assert_eq!(post::excellon(&vee, None).unwrap_err().code, "post.excellon_vee");
}

#[test]
fn excellon_text_is_plain() {
    let mut program = small();
    program.legs.truncate(4);
    let expected = "\
M48
;Written by Annulus
;FORMAT={-:-/ absolute / metric / decimal}
FMAT,2
METRIC
T1C0.800
T2C1.000
T3C3.000
%
G90
G05
T1
X22.700Y28.890
X25.240Y28.890
T0
M30
";
    assert_eq!(post::excellon(&program, None).unwrap(), expected);
    program.origin = Point::new(Length::from_nm(1_234_567), Length::from_nm(-8_890_001));
    let text = post::excellon(&program, None).unwrap();
    assert!(text.contains("X13.934567Y-0.000001\n"), "{text}");
}
