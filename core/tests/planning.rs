//! Tests of the laws of planning on many small random boards: no hole lost or made twice, never longer than
//! the file's order, deterministic. Golden files show one small board at every stage.

use annulus_core::board::{Board, Hole, Slot};
use annulus_core::cam::figures::{Figures, SizeRow, figures};
use annulus_core::cam::toolpaths::{BitTask, Means, Planned, lower_work, plan_work};
use annulus_core::cam::work::Work;
use annulus_core::cam::{self, BitOrder, HoleOrder, PlanOptions};
use annulus_core::chance::Chance;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Program};
use annulus_core::machine::{Machine, StrokeEnd, virtual_drill};
use annulus_core::units::Length;
use annulus_core::wire::program::encode;

const BOARDS: u64 = 100_000;

fn hole(x_um: i64, y_um: i64, size_um: i64) -> Hole {
    Hole {
        at: Point::new(Length::from_um(x_um), Length::from_um(y_um)),
        diameter: Some(Length::from_um(size_um)),
        plated: None,
        source: 0,
        tool_code: 1,
        line: 1,
    }
}

/// A duration of a rapid that is no metric distance: the slower axis decides, and starting costs time.
fn rapid_time(a: Point, b: Point) -> f64 {
    let way = (a.x - b.x).abs().max((a.y - b.y).abs()).mm();
    libm::sqrt(way) * 0.1
}

fn board(chance: &mut Chance) -> Board {
    let count = 1 + chance.below(14);
    // Sometimes a coarse grid, so that equal places and equal distances are common.
    let grid = [1_000, 40_000][chance.below(2)];
    let places = 1 + chance.below(60) * chance.below(60);
    let mut place = || (chance.below(places) as i64 * 40_000 / grid) * grid / 40;
    let rows: Vec<(i64, i64)> = (0..count).map(|_| (place(), place())).collect();
    let holes = rows.into_iter().map(|(x, y)| hole(x, y, [800, 820, 1_000][chance.below(3)]));
    Board { holes: holes.collect(), ..Board::default() }
}

/// A plan with drilling only, and its diagnostics and figures.
struct Made {
    planned: Planned,
    diagnostics: Vec<Diagnostic>,
    figures: Figures,
    program: Program,
}

/// One drill of a plan: its diameter, the hole sizes that it makes, and its holes in order.
struct Drill {
    bit: Length,
    sizes: Vec<Length>,
    holes: Vec<u32>,
}

impl Made {
    fn drills(&self) -> Vec<Drill> {
        let tasks = self.planned.parts.iter().flat_map(|part| &part.tasks);
        let sizes = |n: usize| self.figures.rows.iter().filter(move |row| row.n == n).map(|row| row.size);
        let drill = |(n, task): (usize, &BitTask)| Drill {
            bit: task.bit.diameter,
            sizes: sizes(n).collect(),
            holes: task.drill_cycles.iter().filter_map(|stroke| stroke.hole).collect(),
        };
        (1..).zip(tasks).map(drill).collect()
    }
}

fn planned(
    board: &Board,
    machine: &Machine,
    (order, options): (HoleOrder, &PlanOptions),
    progress: &mut dyn FnMut(cam::PlanningProgress) -> bool,
) -> Result<Made, Vec<Diagnostic>> {
    let work = Work::drilling(board, machine, order);
    let (planned, diagnostics) =
        plan_work(board, &work, machine, &Means { options, rapid_time: &rapid_time }, progress)?;
    let figures = figures(&planned, &rapid_time);
    let program = lower_work(&planned, &work, machine);
    Ok(Made { planned, diagnostics, figures, program })
}

fn plan(board: &Board, machine: &Machine, order: HoleOrder, options: &PlanOptions) -> Made {
    planned(board, machine, (order, options), &mut |_| true).expect("a plan")
}

fn way(from: Point, places: impl IntoIterator<Item = Point>, cost: impl Fn(Point, Point) -> f64) -> f64 {
    places.into_iter().fold((from, 0.0), |(here, sum), to| (to, sum + cost(here, to))).1
}

fn ring(places: &[Point]) -> f64 {
    places.last().map_or(0.0, |&last| way(last, places.iter().copied(), Point::distance_mm))
}

/// Cost of the route from work zero through all places and back.
fn round(zero: Point, places: &[Point], cost: impl Fn(Point, Point) -> f64) -> f64 {
    way(zero, places.iter().copied().chain([zero]), cost)
}

fn holds(board: &Board, made: &Made, order: HoleOrder) {
    let (drills, figures, zero) = (made.drills(), &made.figures, made.planned.origin);
    let mut seen = vec![0; board.holes.len()];
    let at = |hole: &u32| board.holes[*hole as usize].at;
    let (mut before, mut after) = (0.0, 0.0);
    for drill in &drills {
        let mut in_file = drill.holes.clone();
        in_file.sort_unstable();
        let (file, planned): (Vec<_>, Vec<_>) =
            (in_file.iter().map(at).collect(), drill.holes.iter().map(at).collect());
        before += round(zero, &file, Point::distance_mm);
        after += round(zero, &planned, Point::distance_mm);
        match order {
            HoleOrder::File => assert_eq!(in_file, drill.holes),
            HoleOrder::Shortest => {
                assert!(ring(&planned) <= ring(&file) + 1e-9, "{} > {}", ring(&planned), ring(&file));
            }
            HoleOrder::Fastest => {
                assert!(round(zero, &planned, rapid_time) <= round(zero, &file, rapid_time) + 1e-9);
            }
        }
        for hole in &drill.holes {
            seen[*hole as usize] += 1;
            let size = board.holes[*hole as usize].diameter.expect("a size");
            assert!(
                drill.sizes.contains(&size) && (size - drill.bit).abs() <= virtual_drill().rack_tolerance
            );
        }
    }
    // Every hole is drilled once; of coinciding holes for the same tool only the first is.
    let near = Length::from_um(1);
    let made = |hole: usize| {
        let (at, size) = (board.holes[hole].at, board.holes[hole].diameter.expect("a size"));
        drills.iter().filter(|drill| (size - drill.bit).abs() <= virtual_drill().rack_tolerance).any(
            |drill| {
                let first = drill.holes.iter().map(|&first| first as usize).filter(|&first| first < hole);
                first
                    .map(|first| board.holes[first].at)
                    .any(|first| (first.x - at.x).abs() <= near && (first.y - at.y).abs() <= near)
            },
        )
    };
    let wrong = (0..seen.len()).find(|&hole| !(seen[hole] == 1 || seen[hole] == 0 && made(hole)));
    assert_eq!(wrong, None, "of {} holes", seen.len());
    assert!(drills.windows(2).all(|pair| pair[0].bit < pair[1].bit));
    // The figures must equal the sum of the program's rapids.
    let close = |a: f64, b: f64| (a - b).abs() < 1e-6;
    assert!(close(figures.travel_before_mm, before) && close(figures.travel_after_mm, after));
    match order {
        HoleOrder::Shortest => assert!(figures.travel_after_mm <= figures.travel_before_mm + 1e-9),
        HoleOrder::Fastest => assert!(figures.hop_time_after_s <= figures.hop_time_before_s + 1e-9),
        HoleOrder::File => assert!(
            (figures.travel_after_mm, figures.hop_time_after_s)
                == (figures.travel_before_mm, figures.hop_time_before_s)
        ),
    }
}

fn rapids_mm(program: &Program) -> f64 {
    let rapids = program.legs.iter().flat_map(|leg| &leg.commands).filter_map(|command| match command {
        Command::Rapid { to } => Some(*to),
        _ => None,
    });
    way(Point::default(), rapids, Point::distance_mm)
}

#[test]
fn every_plan_of_random_small_boards_is_valid() {
    let machine = virtual_drill();
    for seed in 0..BOARDS {
        let mut chance = Chance::new(seed);
        let board = board(&mut chance);
        let order = [HoleOrder::Shortest, HoleOrder::Fastest, HoleOrder::File][chance.below(3)];
        let options =
            PlanOptions { seed, iterations: Some(chance.below(12) as u64), ..PlanOptions::default() };
        let one = std::panic::catch_unwind(|| {
            let one = plan(&board, &machine, order, &options);
            holds(&board, &one, order);
            one
        });
        let one = one.unwrap_or_else(|_| panic!("seed {seed}: {order:?} {options:?} {board:?}"));
        if seed % 64 == 0 {
            let again = plan(&board, &machine, order, &options).program;
            assert_eq!(encode(&one.program), encode(&again), "seed {seed}");
            let travel = one.figures.travel_after_mm;
            assert!((rapids_mm(&one.program) - travel).abs() < 1e-6, "seed {seed}: {travel}");
        }
    }
}

fn least(places: &mut Vec<Point>, fixed: usize, cost: &dyn Fn(&[Point]) -> f64) -> f64 {
    if fixed + 1 >= places.len() {
        return cost(places);
    }
    let mut best = f64::INFINITY;
    for other in fixed..places.len() {
        places.swap(fixed, other);
        best = best.min(least(places, fixed + 1, cost));
        places.swap(fixed, other);
    }
    best
}

#[test]
fn few_holes_are_ordered_optimally() {
    let machine = virtual_drill();
    for seed in 0..200 {
        let mut chance = Chance::new(seed);
        let count = 2 + chance.below(6);
        let mut place = || chance.below(90_000) as i64;
        let holes = (0..count).map(|_| hole(place(), place(), 800)).collect();
        let board = Board { holes, ..Board::default() };
        let mut places: Vec<Point> = board.holes.iter().map(|hole| hole.at).collect();
        let options = PlanOptions { iterations: Some(400), ..PlanOptions::default() };
        let ordered = |made: &Made| -> Vec<Point> {
            made.drills()[0].holes.iter().map(|hole| board.holes[*hole as usize].at).collect()
        };
        // If the way in and back costs more than the order saves, the file's order is used.
        let shortest = plan(&board, &machine, HoleOrder::Shortest, &options);
        if shortest.figures.travel_after_mm < shortest.figures.travel_before_mm {
            let best = least(&mut places, 1, &ring);
            assert!(ring(&ordered(&shortest)) <= best + 1e-6, "seed {seed}");
        }
        let fastest = plan(&board, &machine, HoleOrder::Fastest, &options);
        if fastest.figures.hop_time_after_s < fastest.figures.hop_time_before_s {
            let zero = fastest.planned.origin;
            let best = least(&mut places, 0, &|places| way(zero, places.iter().copied(), rapid_time));
            let found = way(zero, ordered(&fastest), rapid_time);
            assert!(found <= best + 1e-9, "seed {seed}: {found} > {best}");
        }
    }
}

#[test]
fn planning_can_be_cancelled_at_every_moment() {
    let board = cam::bench::scattered_board(3_000, 5);
    for ticks in [0, 1, 3, 9] {
        for order in [HoleOrder::Shortest, HoleOrder::Fastest] {
            let mut left = ticks;
            let mut tick = |_| {
                left -= 1;
                left >= 0
            };
            let options = PlanOptions::default();
            let stopped = planned(&board, &virtual_drill(), (order, &options), &mut tick);
            assert_eq!(stopped.err().expect("a stop")[0].code, "plan.cancelled");
            assert_eq!(left, -1, "asked again after a stop");
        }
    }
}

#[test]
fn planning_progress_grows_to_its_total() {
    let mut board = cam::bench::scattered_board(500, 5);
    board.holes[7].diameter = Some(Length::from_um(1_000));
    let (mut last, mut whole) = (0, 0);
    let mut tick = |at: cam::PlanningProgress| {
        assert!(at.done >= last && at.done <= at.total);
        (last, whole) = (at.done, at.total);
        true
    };
    let options = PlanOptions { iterations: Some(2_000), ..PlanOptions::default() };
    let made = planned(&board, &virtual_drill(), (HoleOrder::Shortest, &options), &mut tick)
        .unwrap_or_else(|_| panic!());
    assert_eq!(made.figures.iterations, 2_000);
    assert!(last > whole * 3 / 4, "{last} of {whole}");
}

#[test]
fn clusters_and_lines_of_holes_are_planned() {
    let mut chance = Chance::new(9);
    let rows: [(&str, Vec<Hole>); 4] = [
        ("one place", (0..20_000).map(|_| hole(7, 7, 800)).collect()),
        ("a line", (0..20_000).map(|i| hole(i * 10, 0, 800)).collect()),
        ("a grid", (0..20_000).map(|i| hole(i % 200 * 100, i / 200 * 100, 800)).collect()),
        (
            "a far one",
            (0..20_000)
                .map(|i| hole(chance.below(900) as i64, chance.below(900) as i64, 800 + i64::from(i == 0)))
                .chain([hole(9_000_000, 9_000_000, 800)])
                .collect(),
        ),
    ];
    for (what, holes) in rows {
        let board = Board { holes, ..Board::default() };
        let options = PlanOptions { iterations: Some(500), ..PlanOptions::default() };
        let made = plan(&board, &virtual_drill(), HoleOrder::Shortest, &options);
        holds(&board, &made, HoleOrder::Shortest);
        assert!(made.figures.travel_after_mm <= made.figures.travel_before_mm, "{what}");
    }
}

#[test]
fn plan_errors_are_reported_until_accepted() {
    // Too small for every drill and mill, without a size, and one that can be drilled.
    let mut board =
        Board { holes: vec![hole(0, 0, 800), hole(10, 0, 200), hole(20, 0, 800)], ..Board::default() };
    board.holes[2].diameter = None;
    let mut options = PlanOptions::default();
    let machine = virtual_drill();
    let codes = |board: &Board, options: &PlanOptions| -> Vec<String> {
        let diagnostics = match planned(board, &machine, (HoleOrder::Shortest, options), &mut |_| true) {
            Ok(made) => made.diagnostics,
            Err(diagnostics) => diagnostics,
        };
        diagnostics
            .into_iter()
            .filter(|r| r.is_unacknowledged(&options.accept))
            .map(|diagnostic| diagnostic.code)
            .collect()
    };
    assert_eq!(codes(&board, &options), ["cam.holes_missing", "plan.no_size"]);
    options.accept = vec!["cam.holes_missing".into()];
    assert_eq!(codes(&board, &options), ["plan.no_size"]);
    options.accept.push("plan.no_size".into());
    let seen = plan(&board, &machine, HoleOrder::Shortest, &options);
    assert_eq!((seen.drills().len(), &seen.drills()[0].holes[..]), (1, &[0][..]));
    assert_eq!(seen.program.accepted, ["cam.holes_missing", "plan.no_size"]);
    // Errors of the files that the user accepted are listed in the program, too.
    options.lost = vec!["job.a".into(), "job.b".into()];
    options.accept.push("job.b".into());
    let seen = plan(&board, &machine, HoleOrder::Shortest, &options);
    assert_eq!(seen.program.accepted, ["cam.holes_missing", "job.b", "plan.no_size"]);
    board.holes.remove(0);
    assert_eq!(codes(&board, &options), ["cam.nothing_to_do"]);
}

/// Slots and holes for which no drill exists are milled automatically, and appear in the figures.
#[test]
fn slots_and_wide_holes_are_milled() {
    let slot = |x: i64, width: Option<i64>| Slot {
        path: vec![hole(x, 0, 0).at, hole(x + 2_000, 0, 0).at],
        width: width.map(Length::from_um),
        plated: None,
        source: 0,
        tool_code: 2,
        line: 9,
    };
    let holes = vec![hole(0, 0, 800), hole(9_000, 5_000, 5_000), hole(4_000, 5_000, 5_000)];
    let mut board = Board { holes, slots: vec![slot(20_000, Some(1_000))], ..Board::default() };
    let machine = virtual_drill();
    let made = plan(&board, &machine, HoleOrder::Shortest, &PlanOptions::default());
    assert!(
        made.diagnostics.iter().all(|diagnostic| !diagnostic.is_unacknowledged(&[])),
        "{:?}",
        made.diagnostics
    );
    let told = |rows: &[SizeRow]| -> Vec<(usize, f64, String, usize, usize, bool)> {
        let row = |row: &SizeRow| {
            (row.n, row.size.mm(), row.bit.name.clone(), row.holes, row.slots, row.toolpaths > 0)
        };
        rows.iter().map(row).collect()
    };
    let rows = [
        (1, 0.8, "drill 0.8".to_owned(), 1, 0, false),
        (2, 5.0, "end mill 1.5".to_owned(), 2, 0, true),
        (3, 1.0, "end mill 0.8".to_owned(), 0, 1, true),
    ];
    assert_eq!(told(&made.figures.rows), rows);
    // Travel counts drills only.
    assert_eq!((made.figures.travel_before_mm, made.figures.travel_after_mm), (0.0, 0.0));
    // A board with slots only has its origin at the corner of their centres. A slot without a width is
    // reported.
    board.holes.clear();
    board.slots.push(slot(30_000, None));
    let made = plan(&board, &machine, HoleOrder::Shortest, &PlanOptions::default());
    let codes: Vec<_> = made.diagnostics.iter().map(|diagnostic| diagnostic.code.as_str()).collect();
    assert_eq!((made.planned.origin, codes), (Point::from_mm(20.0, 0.0), vec!["plan.slots_not_drilled"]));
}

#[test]
fn similar_sizes_share_a_drill_and_duplicates_are_dropped() {
    let rows =
        [(0, 1_020), (5_000, 800), (10_000, 780), (15_000, 1_000), (5_000, 800), (5_001, 790), (0, 800)];
    let holes = rows.iter().map(|&(x, size)| hole(x, 0, size)).collect();
    let board = Board { holes, ..Board::default() };
    let made = plan(&board, &virtual_drill(), HoleOrder::File, &PlanOptions::default());
    let um = Length::from_um;
    let drills: Vec<_> =
        made.drills().into_iter().map(|drill| (drill.bit, drill.sizes, drill.holes)).collect();
    assert_eq!(
        drills,
        [
            (um(800), vec![um(780), um(800)], vec![1, 2, 6]),
            (um(1_000), vec![um(1_000), um(1_020)], vec![0, 3])
        ]
    );
    let [note] = made.diagnostics.as_slice() else { panic!("{:?}", made.diagnostics) };
    assert_eq!(note.code, "cam.holes_twice");
    assert!(note.message("en").contains("2 holes"), "{}", note.message("en"));
}

#[test]
fn loaded_drill_can_be_first() {
    let holes = [800, 1_000, 3_000].map(|size| hole(0, 0, size)).to_vec();
    let board = Board { holes, ..Board::default() };
    // Loaded size in µm, tools in order, diagnostic.
    let rows: [(Option<i64>, [i64; 3], Option<&str>); 5] = [
        (Some(800), [800, 1_000, 3_000], None),
        (Some(1_000), [1_000, 800, 3_000], None),
        (Some(3_010), [3_000, 800, 1_000], None),
        (Some(2_000), [800, 1_000, 3_000], Some("plan.loaded_not_used")),
        (None, [800, 1_000, 3_000], Some("plan.loaded_not_said")),
    ];
    for (loaded, bits, code) in rows {
        let loaded = loaded.map(Length::from_um);
        let options = PlanOptions { group: BitOrder::LoadedFirst, loaded, ..PlanOptions::default() };
        let made = plan(&board, &virtual_drill(), HoleOrder::Shortest, &options);
        assert_eq!(
            made.drills().iter().map(|drill| drill.bit).collect::<Vec<_>>(),
            bits.map(Length::from_um)
        );
        assert_eq!(made.diagnostics.first().map(|diagnostic| diagnostic.code.as_str()), code);
    }
}

fn small(machine: &Machine) -> Program {
    let rows = [(11_000, 21_000, 800), (10_000, 20_000, 1_000), (13_000, 20_000, 790), (11_000, 20_500, 800)];
    let holes = rows.iter().map(|&(x, y, size)| hole(x, y, size)).collect();
    let board = Board { name: "small".into(), holes, ..Board::default() };
    plan(&board, machine, HoleOrder::Shortest, &PlanOptions::default()).program
}

fn print(program: &Program) -> String {
    let command = |command: &Command| match command {
        Command::Rapid { to } => format!("rapid {} {}", to.x.mm(), to.y.mm()),
        Command::Plunge { to, feed_um_per_s, gate } => {
            let gate = gate.map_or(String::new(), |g| {
                format!(" until {:?} or {} µs: {:?}", g.input, g.deadline_us, g.otherwise)
            });
            format!("plunge {} at {feed_um_per_s} µm/s{gate}", to.mm())
        }
        Command::Retract { to } => format!("retract {}", to.mm()),
        Command::Mill { .. } | Command::MillArc { .. } => format!("{command:?}"),
        Command::Dwell { us } => format!("dwell {us} µs"),
        Command::Spindle { rpm } => format!("spindle {rpm}"),
        Command::AwaitBit { bit } => format!("await {}", program.bits[*bit as usize].name),
    };
    let leg = |leg: &annulus_core::job::Leg| {
        let commands: Vec<_> = leg.commands.iter().map(command).collect();
        format!("{:?}: {}\n", leg.mark, commands.join(", "))
    };
    program.legs.iter().map(leg).collect()
}

#[test]
fn small_plan_matches_its_golden_text() {
    let mut machine = virtual_drill();
    let program = small(&machine);
    assert_eq!((program.origin, program.machine.len()), (Point::from_mm(10.0, 20.0), 64));
    assert_eq!(program.name, "small-top");
    let expected = "\
Prepare: spindle 0
ToolChange(0): spindle 0, rapid 0 0, await drill 0.8, spindle 30000, dwell 1500000 µs
Hole(0): rapid 1 1, plunge -2.286523 at 12000 µm/s, retract 2
Hole(2): rapid 3 0, plunge -2.286523 at 12000 µm/s, retract 2
Hole(3): rapid 1 0.5, plunge -2.286523 at 12000 µm/s, retract 2
ToolChange(1): spindle 0, rapid 0 0, await drill 1, spindle 30000, dwell 1500000 µs
Hole(1): rapid 0 0, plunge -2.333154 at 12000 µm/s, retract 2
Finish: spindle 0, rapid 0 0
";
    assert_eq!(print(&program), expected);
    machine.stroke_end = StrokeEnd::Sensor;
    machine.process.dwell_bottom_ms = 40.0;
    let gated = print(&small(&machine));
    let stroke =
        "plunge -2.286523 at 12000 µm/s until ZBottom or 5000000 µs: Alarm, dwell 40000 µs, retract 2";
    assert!(gated.contains(stroke), "{gated}");
}
