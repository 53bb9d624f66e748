//! Height maps. An independent sweep checks levelled programs: it moves the tip in small steps over its own
//! model of the surface.

use super::*;
use crate::chance::Chance;
use crate::geometry::Bounds;
use crate::job::{Bit, Command, Cutter, Gate, Input, Leg, Mark, Otherwise};

fn mm(value: f64) -> Length {
    Length::from_mm(value)
}

fn at(x: f64, y: f64) -> Point {
    Point::from_mm(x, y)
}

fn grid(x: f64, y: f64, spacing: f64, margin: f64) -> ProbeGrid {
    ProbeGrid::over(Bounds { min: at(0.0, 0.0), max: at(x, y) }, mm(spacing), mm(margin)).unwrap()
}

/// A map of the surface `height` over a board of `x` by `y` mm.
fn map_of(grid: ProbeGrid, height: impl Fn(f64, f64) -> f64) -> HeightMap {
    let heights =
        (0..grid.count()).map(|index| grid.nth(index)).map(|place| mm(height(place.x.mm(), place.y.mm())));
    HeightMap {
        grid,
        heights: heights.collect(),
        job: "job".to_owned(),
        zero: [mm(-40.0), mm(-30.0)],
        homed: true,
        measured_s: 0,
    }
}

fn program(commands: Vec<Command>) -> Program {
    Program {
        name: "a board".to_owned(),
        machine: String::new(),
        origin: Point::default(),
        bits: vec![Bit {
            diameter: mm(1.0),
            name: String::new(),
            cutter: Cutter::Mill,
            handling: Default::default(),
        }],
        spindles: 1,
        safe_height: mm(2.0),
        legs: vec![Leg { mark: Mark::Toolpath(0), commands }],
        accepted: Vec::new(),
    }
}

/// A path of lines, arcs, ramps and holes at random positions of a 100 × 80 mm board.
fn wild(chance: &mut Chance) -> Program {
    let feed_um_per_s = 5_000;
    let mut commands = Vec::new();
    for _ in 0..12 {
        let mut here = at(chance.between(2.0, 98.0), chance.between(2.0, 78.0));
        let depth = mm(-chance.between(0.05, 1.8));
        let entry = [Command::Rapid { to: here }, Command::Plunge { to: depth, feed_um_per_s, gate: None }];
        commands.extend(entry);
        for _ in 0..8 {
            let height = if chance.unit() < 0.3 { mm(-chance.between(0.05, 1.8)) } else { depth };
            let to = at(chance.between(2.0, 98.0), chance.between(2.0, 78.0));
            if chance.unit() < 0.5 {
                commands.push(Command::Mill { to, height, feed_um_per_s });
                here = to;
                continue;
            }
            // The centre is near enough that the circle stays on the board. Some circles are full.
            let room = (here.x.mm().min(100.0 - here.x.mm())).min(here.y.mm().min(80.0 - here.y.mm())) / 2.0;
            let radius = chance.between(0.05, room.max(0.1));
            let turn = chance.between(0.0, std::f64::consts::TAU);
            let center = at(here.x.mm() + radius * libm::cos(turn), here.y.mm() + radius * libm::sin(turn));
            let end = chance.between(0.0, std::f64::consts::TAU);
            let far = here.distance_mm(center);
            let to = match chance.unit() < 0.2 {
                true => here,
                false => at(center.x.mm() + far * libm::cos(end), center.y.mm() + far * libm::sin(end)),
            };
            commands.push(Command::MillArc { to, height, center, ccw: chance.unit() < 0.5, feed_um_per_s });
            here = to;
        }
        commands.push(Command::Retract { to: mm(2.0) });
    }
    program(commands)
}

/// Positions of the tip along a command from `from`, at the shares 0, 1/n … 1.
fn swept(command: &Command, from: [f64; 3], each: usize) -> Vec<[f64; 3]> {
    let shares = (0..=each).map(|step| step as f64 / each as f64);
    let between = |to: [f64; 3], s: f64| [0, 1, 2].map(|axis| from[axis] + (to[axis] - from[axis]) * s);
    match *command {
        Command::Rapid { to } => vec![[to.x.mm(), to.y.mm(), from[2]]],
        Command::Plunge { to, .. } | Command::Retract { to } => vec![[from[0], from[1], to.mm()]],
        Command::Mill { to, height, .. } => {
            let to = [to.x.mm(), to.y.mm(), height.mm()];
            shares.map(|share| between(to, share)).collect()
        }
        Command::MillArc { to, height, center, ccw, .. } => {
            let (to, centre) = ([to.x.mm(), to.y.mm(), height.mm()], [center.x.mm(), center.y.mm()]);
            let angle = |place: [f64; 3]| libm::atan2(place[1] - centre[1], place[0] - centre[0]);
            let mut turn = if ccw { angle(to) - angle(from) } else { angle(from) - angle(to) };
            if turn <= 0.0 || [to[0], to[1]] == [from[0], from[1]] {
                turn += std::f64::consts::TAU;
            }
            let radius = libm::hypot(from[0] - centre[0], from[1] - centre[1]);
            let place = |share: f64| {
                let angle = angle(from) + if ccw { turn * share } else { -turn * share };
                [
                    centre[0] + radius * libm::cos(angle),
                    centre[1] + radius * libm::sin(angle),
                    between(to, share)[2],
                ]
            };
            shares.map(place).collect()
        }
        _ => vec![from],
    }
}

fn leads(command: &Command) -> Option<Point> {
    match *command {
        Command::Rapid { to } | Command::Mill { to, .. } | Command::MillArc { to, .. } => Some(to),
        _ => None,
    }
}

fn surface(map: &HeightMap, x: f64, y: f64) -> f64 {
    let (columns, rows) = (usize::from(map.grid.columns), usize::from(map.grid.rows));
    let xs: Vec<f64> = (0..columns).map(|column| map.grid.place(column, 0).x.mm()).collect();
    let ys: Vec<f64> = (0..rows).map(|row| map.grid.place(0, row).y.mm()).collect();
    let cell = |lines: &[f64], at: f64| lines[1..lines.len() - 1].iter().filter(|line| **line <= at).count();
    let (column, row) = (cell(&xs, x), cell(&ys, y));
    let height = |column: usize, row: usize| map.heights[row * columns + column].mm();
    let u = (x - xs[column]) / (xs[column + 1] - xs[column]);
    let v = (y - ys[row]) / (ys[row + 1] - ys[row]);
    let below = height(column, row) * (1.0 - u) + height(column + 1, row) * u;
    let above = height(column, row + 1) * (1.0 - u) + height(column + 1, row + 1) * u;
    below * (1.0 - v) + above * v
}

/// Greatest deviation of the depth below the surface from the plan, mm.
fn worst(planned: &Program, levelled: &Program, surface: impl Fn(f64, f64) -> f64) -> f64 {
    let commands =
        |program: &Program| program.legs.iter().flat_map(|leg| leg.commands.clone()).collect::<Vec<_>>();
    let mut pieces = commands(levelled).into_iter();
    let (mut wanted_at, mut at) = ([0.0, 0.0, 2.0], [0.0, 0.0, 2.0]);
    let mut worst = 0.0_f64;
    for command in commands(planned) {
        let end = *swept(&command, wanted_at, 1).last().unwrap();
        // Every piece up to the end of the command.
        let mut own: Vec<Vec<[f64; 3]>> = Vec::new();
        loop {
            let piece = pieces.next().unwrap();
            own.push(swept(&piece, at, 16));
            at = *own.last().unwrap().last().unwrap();
            if leads(&piece) == leads(&command) {
                break;
            }
        }
        let whole: f64 = own.iter().map(|piece| way(piece)).sum();
        let (mut gone, mut before) = (0.0, own[0][0]);
        let cuts = matches!(command, Command::Mill { .. } | Command::MillArc { .. } | Command::Plunge { .. });
        for place in own.iter().flatten().filter(|_| cuts) {
            gone += libm::hypot(place[0] - before[0], place[1] - before[1]);
            before = *place;
            let share = if whole > 0.0 { gone / whole } else { 1.0 };
            let wanted = wanted_at[2] + (end[2] - wanted_at[2]) * share;
            worst = worst.max((place[2] - surface(place[0], place[1]) - wanted).abs());
        }
        wanted_at = end;
    }
    assert_eq!(pieces.next(), None);
    worst
}

fn way(places: &[[f64; 3]]) -> f64 {
    places.windows(2).map(|pair| libm::hypot(pair[1][0] - pair[0][0], pair[1][1] - pair[0][1])).sum()
}

#[test]
fn depth_follows_the_probed_surface() {
    for seed in 0..40 {
        let mut chance = Chance::new(seed);
        let grid = grid(100.0, 80.0, [8.0, 13.0, 25.0][seed as usize % 3], 3.0);
        let rough: Vec<f64> = (0..grid.count()).map(|_| chance.between(-0.3, 0.3)).collect();
        let mut map = map_of(grid, |_, _| 0.0);
        map.heights = rough.into_iter().map(mm).collect();
        let planned = wild(&mut chance);
        let levelled = level(&planned, &map, TOLERANCE).unwrap();
        let off_mm = worst(&planned, &levelled.program, |x, y| surface(&map, x, y));
        assert!(off_mm <= TOLERANCE.mm() + 0.000_5, "seed {seed}: {off_mm} mm");
        let [low, high] = map.span();
        assert!(levelled.correction.low >= low - mm(0.2) && levelled.correction.high <= high + mm(0.2));
        assert!(levelled.correction.largest() > mm(0.1), "seed {seed}");
    }
}

#[test]
fn bowed_and_tilted_boards_are_followed() {
    // 0.5 mm bow over 100 mm plus 0.4 mm tilt: four points per side are too few, eleven suffice.
    let bow = |x: f64, y: f64| {
        let (u, v) = (x / 50.0 - 1.0, y / 40.0 - 1.0);
        0.5 * (1.0 - u * u) * (1.0 - v * v) + 0.004 * x - 0.3
    };
    for (spacing, most_mm) in [(10.0, 0.013), (5.0, 0.006)] {
        let map = map_of(grid(100.0, 80.0, spacing, 2.0), bow);
        let planned = wild(&mut Chance::new(7));
        let levelled = level(&planned, &map, TOLERANCE).unwrap();
        let off_mm = worst(&planned, &levelled.program, bow);
        assert!(off_mm < most_mm, "{spacing}: {off_mm}");
        let without_mm = worst(&planned, &planned, bow);
        assert!(without_mm > 0.3, "{without_mm}");
    }
}

#[test]
fn flat_map_changes_nothing() {
    let map = map_of(grid(100.0, 80.0, 10.0, 2.0), |_, _| 0.0);
    let planned = wild(&mut Chance::new(1));
    let levelled = level(&planned, &map, TOLERANCE).unwrap();
    assert_eq!(levelled.correction, Correction::default());
    assert!(worst(&planned, &levelled.program, |_, _| 0.0) < 0.000_3);
}

#[test]
fn holes_and_gates_are_levelled_with_their_rapids() {
    let gate = Some(Gate { input: Input::Contact, deadline_us: 9, otherwise: Otherwise::GoOn });
    let hole = |x: f64, to: f64| {
        [
            Command::Rapid { to: at(x, 40.0) },
            Command::Plunge { to: mm(to), feed_um_per_s: 7, gate },
            Command::Dwell { us: 5 },
            Command::Retract { to: mm(0.5) },
            Command::Retract { to: mm(2.0) },
        ]
    };
    let planned = program([hole(10.0, -1.7), hole(90.0, -1.7)].concat());
    let map = map_of(grid(100.0, 80.0, 10.0, 0.0), |x, _| x * 0.01 - 0.5);
    let levelled = level(&planned, &map, TOLERANCE).unwrap();
    let at_x = |x: f64, h: f64| {
        [
            Command::Rapid { to: at(x, 40.0) },
            Command::Plunge { to: mm(-1.7 + h), feed_um_per_s: 7, gate },
            Command::Dwell { us: 5 },
            Command::Retract { to: mm(0.5 + h) },
            Command::Retract { to: mm(2.0) },
        ]
    };
    assert_eq!(levelled.program.legs[0].commands, [at_x(10.0, -0.4), at_x(90.0, 0.4)].concat());
    assert_eq!((levelled.correction.low, levelled.correction.high), (mm(-0.4), mm(0.4)));
    assert_eq!(levelled.correction.largest(), mm(0.4));
}

#[test]
fn line_over_a_tilt_is_split_only_at_cell_edges() {
    let line = |x: f64| Command::Mill { to: at(x, 20.0), height: mm(-0.1), feed_um_per_s: 1 };
    let planned = program(vec![
        Command::Rapid { to: at(12.0, 20.0) },
        Command::Plunge { to: mm(-0.1), feed_um_per_s: 1, gate: None },
        line(44.0),
    ]);
    let map = map_of(grid(100.0, 80.0, 10.0, 0.0), |x, _| x * 0.01);
    let levelled = level(&planned, &map, TOLERANCE).unwrap();
    let ends = levelled.program.legs[0].commands.iter().filter_map(|command| match command {
        Command::Mill { to, .. } => Some(to.x.mm()),
        _ => None,
    });
    let ends: Vec<f64> = ends.collect();
    assert_eq!(ends, [20.0, 30.0, 40.0, 44.0]);
}

#[test]
fn probe_grids_cover_a_board_or_are_refused() {
    let row = |x, y, spacing, margin| {
        ProbeGrid::over(Bounds { min: at(1.0, 2.0), max: at(1.0 + x, 2.0 + y) }, mm(spacing), mm(margin))
    };
    let rows = [
        // Width, height, spacing, margin; columns, rows, lowest point.
        (100.0, 80.0, 10.0, 2.0, 11, 9, (3.0, 4.0)),
        (20.0, 20.0, 10.0, 0.0, 3, 3, (1.0, 2.0)),
        (20.001, 20.0, 10.0, 0.0, 4, 3, (1.0, 2.0)),
        (4.0, 50.0, 10.0, 2.0, 2, 6, (2.0, 3.0)),
    ];
    for (x, y, spacing, margin, columns, count, (low_x, low_y)) in rows {
        let grid = row(x, y, spacing, margin).unwrap();
        assert_eq!((grid.columns, grid.rows, grid.low), (columns, count, at(low_x, low_y)), "{x} {y}");
        let furthest = (1..grid.lines(0)).map(|index| grid.line(0, index) - grid.line(0, index - 1)).max();
        assert!(furthest.unwrap() <= mm(spacing) + Length::from_nm(1));
    }
    for (code, grid) in [
        ("level.too_small", row(1.0, 80.0, 10.0, 2.0)),
        ("level.too_small", row(-5.0, 80.0, 10.0, 2.0)),
        ("level.bad_grid", row(100.0, 80.0, 0.5, 2.0)),
        ("level.bad_grid", row(100.0, 80.0, 10.0, -1.0)),
        ("level.too_many", row(400.0, 400.0, 5.0, 0.0)),
    ] {
        assert_eq!(grid.unwrap_err().code, code);
    }
}

#[test]
fn every_position_is_in_one_cell() {
    let map = map_of(grid(97.123_457, 33.7, 9.1, 1.3), |x, y| x * 0.003 + y * 0.002);
    for index in 0..map.grid.count() {
        assert_eq!(map.height(map.grid.nth(index)), map.heights[index]);
    }
    // Beyond the outermost points the surface is extrapolated up to the reach.
    let (edge, far) = (map.height(at(0.0, 10.0)), map.height(at(-500.0, 10.0)));
    assert!((edge.mm() - 0.02).abs() < 1e-5, "{edge:?}");
    assert_eq!(far, map.height(Point::new(map.grid.low.x - map.reach(), mm(10.0))));
    assert!(map.knows(at(0.0, 0.0)) && map.knows(at(-5.0, 0.0)) && !map.knows(at(-5.1, 0.0)));
}

#[test]
fn maps_of_other_jobs_zeros_and_positions_are_refused() {
    let map = map_of(grid(100.0, 80.0, 10.0, 2.0), |x, _| x * 0.01);
    let zero = [mm(-40.0), mm(-30.0)];
    let code = |refused: Option<Diagnostic>| refused.map(|why| why.code);
    assert_eq!(code(map.refused("job", zero, true)), None);
    assert_eq!(code(map.refused("job", [zero[0] + mm(0.009), zero[1]], true)), None);
    for (job, zero, homed, expected) in [
        ("other", zero, true, "level.other_job"),
        ("job", [zero[0] + mm(0.011), zero[1]], true, "level.other_zero"),
        ("job", zero, false, "level.other_zero"),
    ] {
        assert_eq!(code(map.refused(job, zero, homed)).as_deref(), Some(expected));
    }
    let mut damaged = map.clone();
    damaged.heights.pop();
    assert_eq!(code(damaged.refused("job", zero, true)).as_deref(), Some("level.damaged"));
    let mill = |x: f64, z: f64| {
        program(vec![
            Command::Rapid { to: at(x, 40.0) },
            Command::Plunge { to: mm(z), feed_um_per_s: 1, gate: None },
            Command::Retract { to: mm(2.0) },
        ])
    };
    assert_eq!(level(&mill(108.0, -0.1), &map, TOLERANCE).unwrap_err().code, "level.outside");
    // Above the board nothing is cut, so nothing is refused.
    assert!(level(&mill(108.0, 0.5), &map, TOLERANCE).is_ok());
    let high = map_of(grid(100.0, 80.0, 10.0, 2.0), |_, _| 1.1);
    assert_eq!(level(&mill(50.0, -0.1), &high, TOLERANCE).unwrap_err().code, "level.too_high");
    assert_eq!(level(&mill(50.0, -0.1), &damaged, TOLERANCE).unwrap_err().code, "level.damaged");
    // A job's key ignores depths and feeds; another origin is another job.
    let (one, mut other) = (mill(50.0, -0.1), mill(50.0, -0.2));
    assert_eq!(key_of(&one), key_of(&other));
    other.origin = at(1.0, 0.0);
    assert!(!same_job(&key_of(&one), &key_of(&other)));
}

#[test]
fn map_is_refused_for_another_design_but_not_for_a_part() {
    let leg = |mark, x: f64| {
        let commands = vec![
            Command::Rapid { to: at(x, 40.0) },
            Command::Plunge { to: mm(-0.1), feed_um_per_s: 1, gate: None },
            Command::Retract { to: mm(2.0) },
        ];
        Leg { mark, commands }
    };
    let of = |legs: Vec<Leg>| Program { legs, ..program(Vec::new()) };
    let drilled = |all: [f64; 2]| of((0..).zip(all).map(|(hole, x)| leg(Mark::Hole(hole), x)).collect());
    let mut map = map_of(grid(100.0, 80.0, 10.0, 2.0), |_, _| 0.0);
    map.job = key_of(&drilled([20.0, 30.0]));
    let code = |program: &Program| map.refused(&key_of(program), map.zero, map.homed).map(|why| why.code);
    assert_eq!(code(&drilled([20.0, 30.0])), None);
    assert_eq!(code(&drilled([30.0, 20.0])), None, "another tour of the same holes");
    assert_eq!(code(&drilled([20.0, 31.0])).as_deref(), Some("level.other_job"), "a hole elsewhere");
    // A job with only toolpaths may belong to this board. Two jobs with only toolpaths must have equal ones.
    let milled = |x: f64| of(vec![leg(Mark::Toolpath(0), x)]);
    assert_eq!(code(&milled(25.0)), None);
    assert!(same_job(&key_of(&milled(25.0)), &key_of(&milled(25.0))));
    assert!(!same_job(&key_of(&milled(25.0)), &key_of(&milled(26.0))));
    // Maps from older versions have no cut positions in their key.
    let (old, _) = map.job.split_at(JOB_DIGITS);
    assert!(
        same_job(old, &key_of(&drilled([20.0, 31.0])))
            && !same_job(old, &key_of(&of(Vec::new())).replace('a', "b"))
    );
}

fn surveyed(grid: ProbeGrid, mut touch: impl FnMut(usize, Point) -> f64) -> Result<Survey, Diagnostic> {
    let mut survey = Survey::new(grid);
    let mut most = grid.count() * 6;
    while let (Some(index), Some(place)) = (survey.next_index(), survey.next()) {
        survey.touch(mm(touch(index, place)))?;
        most -= 1;
        assert!(most > 0, "it never ends");
    }
    assert_eq!(survey.progress().0, survey.progress().1);
    Ok(survey)
}

#[test]
fn dust_is_probed_again_and_a_step_is_accepted() {
    let grid = grid(100.0, 80.0, 10.0, 2.0);
    let tilt = |place: Point| place.x.mm() * 0.004;
    // Dust under one touch, also in a corner.
    for dusty in [0, 8, 37, grid.count() - 1] {
        let mut touches = vec![0; grid.count()];
        let survey = surveyed(grid, |index, place| {
            touches[index] += 1;
            tilt(place) + if index == dusty && touches[index] == 1 { 0.2 } else { 0.0 }
        });
        let survey = survey.unwrap();
        let heights = survey.done().unwrap();
        for (index, height) in heights.iter().enumerate() {
            assert!((height.mm() - tilt(grid.nth(index))).abs() < 1e-6, "{dusty}: {index} {height:?}");
        }
        assert_eq!(touches[dusty], 3, "a third touch decides");
        assert!(survey.touched_again() <= 5, "{}", survey.touched_again());
    }
    // A board of two parts, one 0.3 mm higher: no point needs another touch.
    let step = |place: Point| if place.x.mm() > 45.0 { 0.3 } else { 0.0 };
    let survey = surveyed(grid, |_, place| step(place)).unwrap();
    assert_eq!((survey.touched_again(), survey.progress().0), (0, grid.count()));
    // A lone outlier is touched twice and accepted.
    let survey = surveyed(grid, |index, _| if index == 37 { 0.2 } else { 0.0 }).unwrap();
    assert_eq!((survey.done().unwrap()[37], survey.touched_again()), (mm(0.2), 1));
}

#[test]
fn unsteady_probe_point_is_refused() {
    let grid = grid(100.0, 80.0, 10.0, 2.0);
    let mut touched = 0;
    let refused = surveyed(grid, |index, _| {
        touched += usize::from(index == 20);
        if index == 20 { touched as f64 * 0.1 } else { 0.0 }
    });
    let why = refused.unwrap_err();
    assert_eq!((why.code.as_str(), touched), ("level.unsteady", 5));
    let why = surveyed(grid, |_, _| 6.0).unwrap_err();
    assert_eq!(why.code, "level.too_far");
}

#[test]
fn survey_goes_back_and_forth_by_rows() {
    let grid = grid(20.0, 20.0, 10.0, 0.0);
    let survey = Survey::new(grid);
    let order: Vec<Point> = survey.to_do().collect();
    let expected = [(0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (0, 1), (0, 2), (1, 2), (2, 2)];
    assert_eq!(order, expected.map(|(column, row)| grid.place(column, row)));
    assert_eq!((survey.progress(), survey.done()), ((0, 9), None));
}

#[test]
fn damaged_map_is_never_whole() {
    let map = map_of(grid(100.0, 80.0, 10.0, 2.0), |x, _| x * 0.001);
    let text = serde_json::to_string(&map).unwrap();
    assert_eq!(serde_json::from_str::<HeightMap>(&text).unwrap(), map);
    for (from, to) in [
        ("\"columns\":11", "\"columns\":1"),
        ("\"columns\":11", "\"columns\":65535"),
        ("\"rows\":9", "\"rows\":8"),
        ("\"margin\":2000000", "\"margin\":-1"),
        ("\"high\":{\"x\":98000000", "\"high\":{\"x\":2000000"),
        ("\"high\":{\"x\":98000000", "\"high\":{\"x\":9223372036854775807"),
        ("\"heights\":[2000,", "\"heights\":[9223372036854775807,"),
    ] {
        assert!(text.contains(from), "{from} is not in {text}");
        if let Ok(changed) = serde_json::from_str::<HeightMap>(&text.replacen(from, to, 1)) {
            assert!(!changed.is_whole(), "{to}");
        }
    }
}
