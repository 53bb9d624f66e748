//! Laws of planning, held over many small boards made by chance: nothing lost, nothing twice, never longer than the
//! file, the same every time. And golden prints of one small board at every station (S5, N9).

use annulus_core::board::{Board, Hole};
use annulus_core::cam::{self, Group, Order, Plan, PlanOptions};
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Program};
use annulus_core::machine::{Machine, StrokeEnd, virtual_drill};
use annulus_core::units::Length;
use annulus_core::wire::program::encode;

/// Boards in the property test.
const BOARDS: u64 = 100_000;

/// SplitMix64, so that a printed seed is all that is needed to see a failure again.
struct Chance(u64);

impl Chance {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ (z >> 31)) % bound
    }
}

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

/// A time for a hop that is no distance: the slower axis decides, and starting costs.
fn hop_time(a: Point, b: Point) -> f64 {
    let way = (a.x - b.x).abs().max((a.y - b.y).abs()).mm();
    libm::sqrt(way) * 0.1
}

fn board(chance: &mut Chance) -> Board {
    let count = 1 + chance.below(14);
    // A coarse grid now and then, so that equal places and equal ways are common.
    let grid = [1_000, 40_000][chance.below(2) as usize];
    let places = 1 + chance.below(60) * chance.below(60);
    let mut place = || (chance.below(places) as i64 * 40_000 / grid) * grid / 40;
    let rows: Vec<(i64, i64)> = (0..count).map(|_| (place(), place())).collect();
    let holes = rows.into_iter().map(|(x, y)| hole(x, y, [800, 820, 1_000][chance.below(3) as usize]));
    Board { holes: holes.collect(), ..Board::default() }
}

fn plan(board: &Board, machine: &Machine, options: &PlanOptions) -> Plan {
    cam::plan(board, machine, options, &hop_time, &mut |_| true).expect("a plan").0
}

fn way(from: Point, places: impl IntoIterator<Item = Point>, cost: impl Fn(Point, Point) -> f64) -> f64 {
    places.into_iter().fold((from, 0.0), |(here, sum), to| (to, sum + cost(here, to))).1
}

fn ring(places: &[Point]) -> f64 {
    places.last().map_or(0.0, |&last| way(last, places.iter().copied(), Point::distance_mm))
}

/// What must hold for every plan of every board.
fn holds(board: &Board, plan: &Plan, order: Order) {
    let mut seen = vec![0; board.holes.len()];
    let at = |hole: &u32| board.holes[*hole as usize].at;
    for bit in &plan.bits {
        let mut in_file = bit.holes.clone();
        in_file.sort_unstable();
        let (file, planned): (Vec<_>, Vec<_>) =
            (in_file.iter().map(at).collect(), bit.holes.iter().map(at).collect());
        match order {
            Order::File => assert_eq!(in_file, bit.holes),
            Order::Shortest => {
                assert!(ring(&planned) <= ring(&file) + 1e-9, "{} > {}", ring(&planned), ring(&file));
            }
            Order::Fastest => {
                let time = |places: Vec<Point>| way(plan.origin, places, hop_time);
                assert!(time(planned) <= time(file) + 1e-9);
            }
        }
        for hole in &bit.holes {
            seen[*hole as usize] += 1;
            let size = board.holes[*hole as usize].diameter.expect("a size");
            assert!(bit.sizes.contains(&size) && (size - bit.bit).abs() <= virtual_drill().rack_tolerance);
        }
    }
    // Once each; of holes at one place that the same bit makes, the first.
    let near = Length::from_um(1);
    let made = |hole: usize| {
        let (at, size) = (board.holes[hole].at, board.holes[hole].diameter.expect("a size"));
        plan.bits.iter().filter(|bit| (size - bit.bit).abs() <= virtual_drill().rack_tolerance).any(|bit| {
            let first = bit.holes.iter().map(|&first| first as usize).filter(|&first| first < hole);
            first
                .map(|first| board.holes[first].at)
                .any(|first| (first.x - at.x).abs() <= near && (first.y - at.y).abs() <= near)
        })
    };
    let wrong = (0..seen.len()).find(|&hole| !(seen[hole] == 1 || seen[hole] == 0 && made(hole)));
    assert_eq!(wrong, None, "of {} holes", seen.len());
    assert!(plan.bits.windows(2).all(|pair| pair[0].bit < pair[1].bit));
    match order {
        Order::Shortest => assert!(plan.travel_after_mm <= plan.travel_before_mm + 1e-9),
        Order::Fastest => assert!(plan.hop_time_after_s <= plan.hop_time_before_s + 1e-9),
        Order::File => assert!(
            (plan.travel_after_mm, plan.hop_time_after_s) == (plan.travel_before_mm, plan.hop_time_before_s)
        ),
    }
}

#[test]
fn every_plan_of_many_small_boards_holds() {
    let machine = virtual_drill();
    for seed in 0..BOARDS {
        let mut chance = Chance(seed);
        let board = board(&mut chance);
        let order = [Order::Shortest, Order::Fastest, Order::File][chance.below(3) as usize];
        let options =
            PlanOptions { order, seed, iterations: Some(chance.below(12)), ..PlanOptions::default() };
        let one = std::panic::catch_unwind(|| {
            let one = plan(&board, &machine, &options);
            holds(&board, &one, order);
            one
        });
        let one = one.unwrap_or_else(|_| panic!("seed {seed}: {options:?} {board:?}"));
        if seed % 64 == 0 {
            let bytes = |plan: &Plan| encode(&cam::lower(&board, plan, &machine));
            assert_eq!(bytes(&one), bytes(&plan(&board, &machine, &options)), "seed {seed}");
        }
    }
}

/// The least cost over all orders, by trying them.
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
fn few_holes_are_ordered_as_well_as_can_be() {
    let machine = virtual_drill();
    for seed in 0..200 {
        let mut chance = Chance(seed);
        let count = 2 + chance.below(6);
        let mut place = || chance.below(90_000) as i64;
        let holes = (0..count).map(|_| hole(place(), place(), 800)).collect();
        let board = Board { holes, ..Board::default() };
        let mut places: Vec<Point> = board.holes.iter().map(|hole| hole.at).collect();
        let options = |order| PlanOptions { order, iterations: Some(400), ..PlanOptions::default() };
        let ordered = |plan: &Plan| -> Vec<Point> {
            plan.bits[0].holes.iter().map(|hole| board.holes[*hole as usize].at).collect()
        };
        let shortest = plan(&board, &machine, &options(Order::Shortest));
        // When the way in costs more than the ring saves, the file's order stays.
        if shortest.travel_after_mm < shortest.travel_before_mm {
            let best = least(&mut places, 1, &ring);
            assert!(ring(&ordered(&shortest)) <= best + 1e-6, "seed {seed}");
        }
        let fastest = plan(&board, &machine, &options(Order::Fastest));
        let origin = fastest.origin;
        let best = least(&mut places, 0, &|places| way(origin, places.iter().copied(), hop_time));
        assert!(
            fastest.hop_time_after_s <= best + 1e-9,
            "seed {seed}: {} > {best}",
            fastest.hop_time_after_s
        );
    }
}

#[test]
fn a_stop_is_obeyed_at_every_moment() {
    let board = cam::bench::scattered_board(3_000, 5);
    for ticks in [0, 1, 3, 9] {
        for order in [Order::Shortest, Order::Fastest] {
            let mut left = ticks;
            let mut tick = |_| {
                left -= 1;
                left >= 0
            };
            let options = PlanOptions { order, ..PlanOptions::default() };
            let losses = cam::plan(&board, &virtual_drill(), &options, &hop_time, &mut tick).unwrap_err();
            assert_eq!(losses[0].code, "plan.cancelled");
            assert_eq!(left, -1, "asked again after a stop");
        }
    }
}

#[test]
fn progress_grows_to_what_was_promised() {
    let board = cam::bench::scattered_board(500, 5);
    let mut last = 0;
    let mut tick = |at: cam::Progress| {
        assert!(at.done >= last && at.done <= at.total);
        last = at.done;
        true
    };
    let options = PlanOptions { iterations: Some(2_000), ..PlanOptions::default() };
    let (plan, _) = cam::plan(&board, &virtual_drill(), &options, &hop_time, &mut tick).unwrap();
    assert_eq!(plan.iterations, 2_000);
    assert!(last > 1_500, "{last}");
}

#[test]
fn clusters_lines_and_crowds_are_no_trouble() {
    let mut chance = Chance(9);
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
        let plan = plan(&board, &virtual_drill(), &options);
        holds(&board, &plan, Order::Shortest);
        assert!(plan.travel_after_mm <= plan.travel_before_mm, "{what}");
    }
}

#[test]
fn losses_stop_a_plan_until_they_are_seen() {
    let mut board =
        Board { holes: vec![hole(0, 0, 800), hole(10, 0, 9_000), hole(20, 0, 800)], ..Board::default() };
    board.holes[2].diameter = None;
    let mut options = PlanOptions::default();
    let codes = |board: &Board, options: &PlanOptions| -> Vec<String> {
        let losses = cam::plan(board, &virtual_drill(), options, &hop_time, &mut |_| true).unwrap_err();
        losses.into_iter().map(|loss| loss.code).collect()
    };
    assert_eq!(codes(&board, &options), ["plan.no_bit", "plan.no_size"]);
    options.accept = vec!["plan.no_bit".into()];
    assert_eq!(codes(&board, &options), ["plan.no_size"]);
    options.accept.push("plan.no_size".into());
    let seen = plan(&board, &virtual_drill(), &options);
    assert_eq!((seen.bits.len(), &seen.bits[0].holes[..]), (1, &[0][..]));
    assert_eq!(cam::lower(&board, &seen, &virtual_drill()).accepted, ["plan.no_bit", "plan.no_size"]);
    board.holes.remove(0);
    assert_eq!(codes(&board, &options), ["plan.nothing_to_drill"]);
}

#[test]
fn the_loaded_bit_can_go_first() {
    let holes = [800, 1_000, 3_000].map(|size| hole(0, 0, size)).to_vec();
    let board = Board { holes, ..Board::default() };
    // loaded in µm, bits in order, remark
    let rows: [(Option<i64>, [i64; 3], Option<&str>); 5] = [
        (Some(800), [800, 1_000, 3_000], None),
        (Some(1_000), [1_000, 800, 3_000], None),
        (Some(3_010), [3_000, 800, 1_000], None),
        (Some(2_000), [800, 1_000, 3_000], Some("plan.loaded_not_used")),
        (None, [800, 1_000, 3_000], Some("plan.loaded_not_said")),
    ];
    for (loaded, bits, code) in rows {
        let loaded = loaded.map(Length::from_um);
        let options = PlanOptions { group: Group::LoadedFirst, loaded, ..PlanOptions::default() };
        let (plan, remarks) =
            cam::plan(&board, &virtual_drill(), &options, &hop_time, &mut |_| true).unwrap();
        assert_eq!(plan.bits.iter().map(|bit| bit.bit).collect::<Vec<_>>(), bits.map(Length::from_um));
        assert_eq!(remarks.first().map(|remark| remark.code.as_str()), code);
    }
}

fn small() -> (Board, Plan, Machine) {
    let rows = [(11_000, 21_000, 800), (10_000, 20_000, 1_000), (13_000, 20_000, 790), (11_000, 20_500, 800)];
    let holes = rows.iter().map(|&(x, y, size)| hole(x, y, size)).collect();
    let board = Board { name: "small".into(), holes, ..Board::default() };
    let machine = virtual_drill();
    let plan = plan(&board, &machine, &PlanOptions::default());
    (board, plan, machine)
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
fn golden_program() {
    let (board, plan, mut machine) = small();
    let program = cam::lower(&board, &plan, &machine);
    assert_eq!((program.origin, program.machine.len()), (Point::from_mm(10.0, 20.0), 64));
    let expected = "\
Prepare: spindle 0
ChangeBit(0): spindle 0, rapid 0 0, await drill 0.8, spindle 30000, dwell 1500000 µs
Hole(3): rapid 1 0.5, plunge -2.286523 at 12000 µm/s, retract 2
Hole(0): rapid 1 1, plunge -2.286523 at 12000 µm/s, retract 2
Hole(2): rapid 3 0, plunge -2.286523 at 12000 µm/s, retract 2
ChangeBit(1): spindle 0, rapid 0 0, await drill 1, spindle 30000, dwell 1500000 µs
Hole(1): rapid 0 0, plunge -2.333154 at 12000 µm/s, retract 2
Finish: spindle 0, rapid 0 0
";
    assert_eq!(print(&program), expected);
    machine.stroke_end = StrokeEnd::Sensor;
    machine.process.dwell_bottom_ms = 40.0;
    let gated = print(&cam::lower(&board, &plan, &machine));
    let stroke =
        "plunge -2.286523 at 12000 µm/s until ZBottom or 5000000 µs: Alarm, dwell 40000 µs, retract 2";
    assert!(gated.contains(stroke), "{gated}");
}
