//! Isolation of real boards, measured by an independent checker: its own chords, distances and cut widths.
//!
//! ```text
//!   every toolpath ── edge of its cut ──▶ cuts no copper beyond the tolerance,
//!                                         no farther from copper than the passes reach, links apart
//!   every edge of copper ── half a cut outwards ──▶ a toolpath runs there
//! ```

mod chords;

use annulus_core::board::{Board, BoardWanted, Face, from_artwork_with};
use annulus_core::cam::PlanOptions;
use annulus_core::cam::toolpaths::{Means, Planned, Toolpath, lower_work, plan_work};
use annulus_core::cam::work::{OperationKind, Work};
use annulus_core::geometry::{Path, Placement, Point, Region};
use annulus_core::job::{Bit, Command, Cutter};
use annulus_core::machine::{Machine, virtual_drill};
use annulus_core::motion;
use annulus_core::units::Length;
use annulus_tests::{corpus, read_folder, root};
use chords::{Grid, Spot, apart, beside, between, chords, spaced};

/// Boards of the short test.
const BOARDS: [&str; 8] = [
    "diptrace/fd1-keyboard-panel",
    "eagle/particle-core",
    "eagle/pcb-tools-board",
    "kicad/2013-clockblock",
    "kicad/4.0-multivibrator",
    "kicad/8.0-carte_test",
    "librepcb/demo-bldc",
    "pcb-rnd/isolated-power",
];
/// More boards, for the long test.
const MORE: [&str; 17] = [
    "altium/23-x2-sample",
    "altium/limesdr-qpcie",
    "altium/protel-se-sg-if",
    "eagle/9-gyw-curriculum",
    "eagle/arduino-uno",
    "easyeda/easytrace-tht",
    "fab3000/jaseg",
    "freepcb/fcpoly",
    "fritzing/gyro-2021",
    "geda-pcb/stepper-lights",
    "horizon/usbkvm",
    "mentor-veribest/nollezappare",
    "p-cad/zxinet",
    "pcgerber/ekf-trailing",
    "siemens-xpedition/lasmo",
    "ultiboard/pihpsdr",
    "visula/ekf-l1",
];
/// Two passes may have this many times the retracts of one pass.
const MOST_RETRACTS: f64 = 1.3;
/// A cut may reach into the copper by this, mm: what the manual promises.
const TOLERANCE: f64 = 0.002;
/// Rounding of the checker's measurements, mm.
const ROUNDING: f64 = 0.000_2;
/// Distance between samples on the far edges of cuts and on the edges of copper, mm.
const LOOK: f64 = 0.05;
/// Longest piece of a toolpath that is measured at once, mm.
const PIECE: f64 = 0.2;
/// Strips of copper up to this width are milled away between the last passes, mm.
const SLIVER: f64 = 0.055;
/// The longest link across copper of no net, mm: what the manual promises.
const LINK: f64 = 1.0;
/// Tolerance for the position of a toolpath, mm.
const THERE: f64 = 0.01;

/// The width that a tool cuts at the surface, mm.
fn cut_width(bit: &Bit, way: &Toolpath) -> f64 {
    let depth = way.depths.iter().map(|depth| depth.mm()).fold(0.0, f64::max);
    let diameter = bit.diameter.mm();
    match bit.cutter {
        Cutter::Vee { tip, angle_mdeg } => {
            let half_angle = (f64::from(angle_mdeg) / 2_000.0).to_radians();
            (tip.mm() + 2.0 * depth * half_angle.tan()).min(diameter)
        }
        Cutter::Drill | Cutter::Mill => diameter,
    }
}

/// The smallest distance from the edge of a toolpath's cut to copper, and its position.
fn clearance(way: &Path, half: f64, copper: &Grid) -> (f64, Spot) {
    let reach = half + 0.01;
    let mut least = (f64::INFINITY, [0.0; 2]);
    for chord in chords(way, PIECE) {
        let own = copper.distance(chord, reach) - half;
        if own < least.0 {
            least = (own, between(chord, 0.5));
        }
    }
    // A toolpath that crosses no edge of the copper is either all inside or all outside.
    let start = [way.start.x.mm(), way.start.y.mm()];
    if copper.contains(start) { (-copper.distance_of(start, 2.0) - half, start) } else { least }
}

/// The first point at which the edge of a cut is farther than `most` from the copper, on a stretch longer than a link.
fn beyond(way: &Path, half: f64, copper: &Grid, most: f64) -> Option<Spot> {
    let mut far_mm = 0.0;
    for chord in chords(way, LOOK) {
        let Some(sides) = beside(chord, half).zip(beside(chord, -half)) else { continue };
        let far = [sides.0, sides.1].into_iter().find(|at| !copper.is_near(*at, most));
        far_mm = if far.is_some() { far_mm + apart(chord.0, chord.1) } else { 0.0 };
        if far_mm > LINK {
            return far;
        }
    }
    None
}

/// Points half a cut from an edge of the copper at which the tool has room but no toolpath runs.
fn left_out(planned: &Planned, region: &Region, copper: &Grid, run: &Grid, half: f64) -> Vec<Spot> {
    let outline = &planned.board.outline;
    let board = Grid::of(outline.paths());
    let on_board = |at: &Spot| outline.is_empty() || board.contains(*at) && !board.is_near(*at, THERE);
    let edges = region.paths().flat_map(|path| spaced(chords(path, LOOK), LOOK));
    // Copper is on the left of its edges.
    let places = edges.filter_map(|chord| beside(chord, half)).filter(on_board);
    let missed = places.filter(|at| !run.is_near(*at, THERE));
    missed.filter(|at| !copper.is_near(*at, half - 0.0005) && !copper.contains(*at)).collect()
}

/// The smallest distance between a cut's edge and copper, below 0 if copper is cut; and the faults of the
/// isolation. Passes share `overlap` of their width.
fn measured(planned: &Planned, wanted: Wanted, overlap: f64) -> (f64, Vec<String>) {
    let copper = planned.board.copper.iter().find(|copper| copper.face == wanted.face);
    let region = &copper.expect("copper").region;
    let copper = Grid::of(region.paths());
    let tasks = || planned.parts.iter().flat_map(|part| &part.tasks);
    let run = Grid::of(tasks().flat_map(|task| &task.toolpaths).map(|way| &way.path));
    let (mut least, mut widest, mut wrong) = (f64::INFINITY, 0.0_f64, Vec::new());
    let cuts = tasks().flat_map(|task| task.toolpaths.iter().map(|way| (way, cut_width(&task.bit, way))));
    for (way, width) in cuts {
        let half = width / 2.0;
        widest = widest.max(width);
        let (own, at) = clearance(&way.path, half, &copper);
        least = least.min(own);
        if own < -TOLERANCE - ROUNDING {
            wrong.push(format!("{:.4} mm of copper are cut at {at:.3?}", -own));
        }
        let more = if wanted.slivers { half + SLIVER / 2.0 } else { THERE };
        let most = width + width * (1.0 - overlap) * f64::from(wanted.passes - 1) + more;
        if let Some(at) = beyond(&way.path, half, &copper, most) {
            wrong.push(format!("a cut farther than {most:.3} mm from copper at {at:.3?}"));
        }
    }
    let missed = left_out(planned, region, &copper, &run, widest / 2.0);
    wrong.extend(missed.iter().map(|at| format!("no toolpath at {at:.3?}")));
    (least, wrong)
}

/// The isolation to plan for one side.
#[derive(Clone, Copy)]
struct Wanted {
    face: Face,
    passes: u32,
    /// Whether strips of copper between the passes are milled away.
    slivers: bool,
}

/// The planned isolation of one side, and the share of their width that passes overlap.
fn planned(board: &Board, machine: &Machine, wanted: Wanted) -> (Planned, Work, f64) {
    let mut work = Work::default_for(board, machine);
    work.setup.face = wanted.face;
    let mut overlap = 0.0;
    for operation in &mut work.operations {
        match &mut operation.action {
            OperationKind::Isolate(isolate) => {
                (isolate.passes, isolate.slivers) = (wanted.passes, wanted.slivers);
                overlap = isolate.overlap_percent / 100.0;
            }
            _ => operation.on = false,
        }
    }
    let options = PlanOptions::default();
    let rapid_time = |from: Point, to: Point| motion::rapid_time_s(machine, from, to);
    let means = Means { options: &options, rapid_time: &rapid_time };
    let planned = plan_work(board, &work, machine, &means, &mut |_| true);
    let (planned, _) = planned.unwrap_or_else(|why| panic!("{why:?}"));
    (planned, work, overlap)
}

fn retracts(planned: &Planned, work: &Work, machine: &Machine) -> usize {
    let program = lower_work(planned, work, machine);
    let commands = program.legs.iter().flat_map(|leg| &leg.commands);
    commands.filter(|command| matches!(command, Command::Retract { .. })).count()
}

fn board_of(folder: &std::path::Path) -> Board {
    let artwork = read_folder(folder);
    let wanted = BoardWanted { copper: true, aligned: true };
    from_artwork_with(&artwork, &artwork.default_use(), wanted).0
}

/// The faults of the isolation of one side, with one pass and with two.
fn faults(board: &Board, machine: &Machine, face: Face, name: &str) -> Vec<String> {
    let mut faults = Vec::new();
    let mut counts = Vec::new();
    for (passes, slivers) in [(1, true), (2, true), (2, false)] {
        let wanted = Wanted { face, passes, slivers };
        let (planned, work, overlap) = planned(board, machine, wanted);
        let (least, wrong) = measured(&planned, wanted, overlap);
        let count = retracts(&planned, &work, machine);
        let title = format!("{name} {face:?}, {passes} passes, slivers {slivers}");
        println!("{title}: {count} retracts, {least:.4} mm from the copper, {} wrong", wrong.len());
        faults.extend(wrong.into_iter().take(5).map(|why| format!("{title}: {why}")));
        counts.push(count as f64);
    }
    if counts[1] > counts[0] * MOST_RETRACTS {
        faults.push(format!("{name} {face:?}: {counts:?} retracts"));
    }
    faults
}

#[test]
fn isolation_follows_all_copper_and_cuts_none() {
    let Some(corpus) = corpus() else { return };
    let machine = virtual_drill();
    let more = std::env::var_os("ANNULUS_LONG").map_or(&[][..], |_| &MORE[..]);
    let mut wrong = Vec::new();
    for name in BOARDS.iter().chain(more) {
        let board = board_of(&corpus.join(name));
        for copper in board.copper.iter().filter(|copper| !copper.region.is_empty()) {
            wrong.extend(faults(&board, &machine, copper.face, name));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn isolation_checker_finds_planted_faults() {
    let machine = virtual_drill();
    let board = board_of(&root().join("www/examples"));
    let face = board.copper.first().expect("copper").face;
    let wanted = Wanted { face, passes: 2, slivers: true };
    let (good, _, overlap) = planned(&board, &machine, wanted);
    assert_eq!(measured(&good, wanted, overlap).1, Vec::<String>::new());
    let shifted = |ways: &mut Vec<Toolpath>, um: i64| {
        let by = Placement::shifted(Point::new(Length::from_um(um), Length::ZERO));
        ways.iter_mut().for_each(|way| way.path = by.path(&way.path));
    };
    type Change<'a> = &'a dyn Fn(&mut Vec<Toolpath>);
    let rows: [(&str, Change<'_>); 4] = [
        ("of copper are cut", &|ways| shifted(ways, 4)),
        ("of copper are cut", &|ways| {
            ways.iter_mut().for_each(|way| way.depths = vec![Length::from_um(100)]);
        }),
        ("farther than", &|ways| shifted(ways, 400_000)),
        ("no toolpath", &|ways| drop(ways.pop())),
    ];
    for (number, (expected, change)) in rows.into_iter().enumerate() {
        let mut bad = good.clone();
        bad.parts.iter_mut().flat_map(|part| &mut part.tasks).for_each(|task| change(&mut task.toolpaths));
        let (_, wrong) = measured(&bad, wanted, overlap);
        assert!(wrong.iter().any(|why| why.contains(expected)), "row {number}: {wrong:?}");
    }
}
