//! Corpus boards from files to a proved program: plans the default job of each and proves the program alone.
//! Everything is isolated if the tool fits, no net loses copper, and no loose copper is too thin to hold.

use annulus_core::board::{Board, BoardWanted, from_artwork_with};
use annulus_core::cam::toolpaths::{Means, lower_work, plan_work};
use annulus_core::cam::work::Work;
use annulus_core::cam::{HoleOrder, PlanOptions};
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Program, Stage};
use annulus_core::machine::{Machine, lab, virtual_drill};
use annulus_core::motion;
use annulus_core::pins::Pins;
use annulus_core::proof::{self, FindingKind};
use annulus_core::steps::{self, StepStream};
use annulus_core::virtual_drill::{Cause, Faults, Slip, VirtualDrill};
use annulus_core::wire;
use annulus_tests::{corpus, files_below, read_folder, root};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// Folders of the corpus.
const BOARDS: [&str; 6] = [
    "easyeda/easytrace-tht",
    "eagle/arduino-uno",
    "eagle/pcb-tools-board",
    "kicad/2013-clockblock",
    "kicad/4.0-multivibrator",
    "kicad/8.0-carte_test",
];

/// Boards whose default job leaves slivers: the number of slivers that belong to a net and are never cut, and
/// of loose ones. Clockblock has vias as wide as their drills, so a thread of copper remains around their
/// holes. Its loose sliver is the horn between the round end of a sliver's path and a groove.
const SLIVERS: [(&str, usize, usize); 1] = [("kicad/2013-clockblock", 9, 1)];

fn board(folder: &Path) -> Board {
    let artwork = read_folder(folder);
    from_artwork_with(&artwork, &artwork.default_use(), BoardWanted { copper: true, aligned: true }).0
}

/// The default job of a board's first face, or only its holes, as a program on `machine`; toolpaths at
/// `feed_um_per_s` if given.
fn program_of(board: &Board, machine: &Machine, toolpaths: bool, feed: Option<u32>) -> Program {
    let mut work = if toolpaths {
        Work::default_for(board, machine)
    } else {
        Work::drilling(board, machine, HoleOrder::Shortest)
    };
    work.setup.face = work.faces()[0];
    let options = PlanOptions::default();
    let rapid_time = |from: Point, to: Point| motion::rapid_time_s(machine, from, to);
    let means = Means { options: &options, rapid_time: &rapid_time };
    let (planned, _) = plan_work(board, &work, machine, &means, &mut |_| true).expect("a plan");
    let mut program = lower_work(&planned, &work, machine);
    for command in program.legs.iter_mut().flat_map(|leg| &mut leg.commands) {
        if let Command::Mill { feed_um_per_s, .. } | Command::MillArc { feed_um_per_s, .. } = command {
            *feed_um_per_s = feed.unwrap_or(*feed_um_per_s);
        }
    }
    program
}

/// Number of steps of a stream, and its transmitted size in bytes.
fn told(stream: &StepStream) -> (u64, u64) {
    let steps = steps::replay_stream(stream).map(|pulse| u64::from(pulse.axes.count_ones())).sum();
    (steps, steps::compact(stream).len() as u64)
}

/// Isolates corpus boards at their default feed and at a high feed, and drills them, also on the laboratory
/// drill. The stream needs at most one byte per step, with and without the toolpaths alone.
#[test]
fn streams_of_real_boards_take_at_most_a_byte_per_step() {
    let Some(corpus) = corpus() else { return };
    let (uno, clock) = ("eagle/arduino-uno", "kicad/2013-clockblock");
    let rows = [
        (uno, virtual_drill(), true, None),
        (uno, virtual_drill(), true, Some(20_000)),
        (clock, virtual_drill(), true, None),
        (clock, virtual_drill(), true, Some(20_000)),
        (uno, virtual_drill(), false, None),
        (uno, lab(), false, None),
    ];
    let mut wrong = Vec::new();
    for (name, machine, toolpaths, feed) in rows {
        let program = program_of(&board(&corpus.join(name)), &machine, toolpaths, feed);
        let timeline = motion::timeline(&program, &machine).expect("a timeline");
        let began = std::time::Instant::now();
        let mut stream = steps::stream(&timeline, &machine).expect("a stream");
        let took_ms = began.elapsed().as_millis();
        let (all, bytes) = told(&stream);
        stream.segments.retain(|segment| segment.stage == Stage::Mill);
        let (milled, milled_bytes) = told(&stream);
        let runs = stream.segments.iter().flat_map(|segment| &segment.runs);
        let (runs, pairs) = (runs.clone().count(), runs.filter(|run| run.count == 2).count());
        let each = |bytes: u64, steps: u64| bytes as f64 / steps.max(1) as f64;
        println!(
            "{name} on {}, feed {feed:?}: {:.3} bytes a step of {all}; milled {:.3} of {milled}, {runs} runs, {pairs} of 2 steps; {took_ms} ms",
            machine.name,
            each(bytes, all),
            each(milled_bytes, milled),
        );
        if bytes > all || (toolpaths && milled_bytes > milled) {
            wrong.push(name);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// Golden test: digests of program and stream for the holes of every board, and for some default jobs.
/// `ANNULUS_BLESS=1` accepts a change.
#[test]
fn corpus_programs_and_streams_have_stable_bytes() {
    let Some(corpus) = corpus() else { return };
    let machine = virtual_drill();
    let mut text = String::new();
    let mut row = |name: &str, program: &Program| {
        let timeline = motion::timeline(program, &machine).expect("a timeline");
        let stream = steps::stream(&timeline, &machine).expect("a stream");
        let key = wire::program::key(&wire::program::encode(program));
        writeln!(text, "{name} {} legs {key} {}", program.legs.len(), steps::digest(&stream)).unwrap();
    };
    for folder in folders_below(&corpus) {
        let board = board(&folder);
        if !board.holes.is_empty() {
            let name = folder.strip_prefix(&corpus).unwrap().display().to_string();
            row(&name, &program_of(&board, &machine, false, None));
        }
    }
    for name in BOARDS {
        row(&format!("{name} milled"), &program_of(&board(&corpus.join(name)), &machine, true, None));
    }
    let path = root().join("tests/data/cast/corpus.txt");
    if std::env::var_os("ANNULUS_BLESS").is_some() {
        return fs::write(path, text).unwrap();
    }
    let expected = fs::read_to_string(path).unwrap();
    let changed: Vec<&str> = text.lines().filter(|row| !expected.lines().any(|line| line == *row)).collect();
    assert!(changed.is_empty(), "{changed:#?}");
    assert_eq!(text.lines().count(), expected.lines().count());
}

/// The board folders, two levels below the corpus.
fn folders_below(corpus: &Path) -> Vec<PathBuf> {
    let parts = |file: PathBuf| {
        let mut parts = file.strip_prefix(corpus).ok()?.components();
        let family = parts.next()?.as_os_str().to_str()?.to_owned();
        let board = corpus.join(&family).join(parts.next()?);
        (!["broken", "conformance", "expected", "licenses", "synthetic", "tsplib"].contains(&family.as_str()))
            .then_some(board)
    };
    let folders: BTreeSet<PathBuf> = files_below(corpus).into_iter().filter_map(parts).collect();
    folders.into_iter().filter(|folder| folder.is_dir()).collect()
}

/// Isolation time of the Arduino Uno at 20 mm/s with corners of 5 µm: about 57,000 segments, 17.4 m, 873 s
/// without any slowdown.
#[test]
fn real_board_path_takes_1100_to_1330_s() {
    let Some(corpus) = corpus() else { return };
    let mut machine = virtual_drill();
    machine.motion.corner_mm = 0.005;
    let board = board(&corpus.join("eagle/arduino-uno"));
    let mut work = Work::default_for(&board, &machine);
    work.setup.face = work.faces()[0];
    let options = PlanOptions::default();
    let rapid_time = |from: Point, to: Point| motion::rapid_time_s(&machine, from, to);
    let means = Means { options: &options, rapid_time: &rapid_time };
    let (planned, _) = plan_work(&board, &work, &machine, &means, &mut |_| true).expect("a plan");
    let mut program = lower_work(&planned, &work, &machine);
    for command in program.legs.iter_mut().flat_map(|leg| &mut leg.commands) {
        if let Command::Mill { feed_um_per_s, .. } | Command::MillArc { feed_um_per_s, .. } = command {
            *feed_um_per_s = 20_000;
        }
    }
    let timeline = motion::timeline(&program, &machine).expect("a timeline");
    let parts = timeline.moves.iter().flat_map(|planned| &planned.parts);
    let (mut pieces, mut seconds, mut length_mm) = (0, 0.0, 0.0);
    for part in parts {
        if let motion::Motion::Path(route) = &part.motion {
            pieces += route.path.pieces.len();
            seconds += route.path.duration_s();
            length_mm += route.path.length_mm();
        }
    }
    println!("{pieces} pieces, {length_mm:.0} mm, {seconds:.0} s; {:.0} s at 20 mm/s", length_mm / 20.0);
    assert!(pieces > 45_000 && length_mm > 16_000.0, "{pieces} pieces, {length_mm} mm");
    // Joined toolpaths took 1,276 s. Earlier, with 55,000 segments, no profile within the jerk limit could be
    // below 1,156 s (docs/motion-profiles.md, D).
    assert!((1_100.0..1_330.0).contains(&seconds), "{seconds} s");
    // As transmitted, with everything between the paths: less than one byte per step.
    let stream = steps::stream(&timeline, &machine).expect("a stream");
    let made: u64 = steps::replay_stream(&stream).map(|pulse| u64::from(pulse.axes.count_ones())).sum();
    let bytes = steps::compact(&stream).len();
    println!("{made} steps in {bytes} bytes");
    assert!(made > 3_000_000 && (bytes as u64) < made, "{made} steps in {bytes} bytes");
}

#[test]
fn default_job_isolates_all_reachable_gaps() {
    let Some(corpus) = corpus() else { return };
    let machine = virtual_drill();
    let options = PlanOptions::default();
    let rapid_time = |from: Point, to: Point| motion::rapid_time_s(&machine, from, to);
    let means = Means { options: &options, rapid_time: &rapid_time };
    let mut wrong = Vec::new();
    println!("board, side: islands, contours, findings, with cures, milled m, retracts, time s");
    for name in BOARDS {
        let board = board(&corpus.join(name));
        assert!(!board.copper.is_empty(), "{name} has no copper");
        let mut work = Work::default_for(&board, &machine);
        for face in work.faces() {
            work.setup.face = face;
            let planned = plan_work(&board, &work, &machine, &means, &mut |_| true);
            let (planned, _) = planned.unwrap_or_else(|why| panic!("{name}: {why:?}"));
            let program = lower_work(&planned, &work, &machine);
            let asked =
                proof::ProofOptions { face, owned: work.bits.clone(), ..proof::ProofOptions::default() };
            let verdict = proof::prove(&planned.board, std::slice::from_ref(&program), &asked);
            let mut counts: BTreeMap<FindingKind, usize> = BTreeMap::new();
            for finding in &verdict.findings {
                *counts.entry(finding.kind).or_default() += 1;
            }
            let cures = verdict.findings.iter().filter(|finding| !finding.cures.is_empty()).count();
            let commands = program.legs.iter().flat_map(|leg| &leg.commands);
            let retracts = commands.filter(|command| matches!(command, Command::Retract { .. })).count();
            let seconds =
                motion::timeline(&program, &machine).map_or(f64::NAN, |timeline| timeline.total_s());
            println!(
                "{name}, {face:?}: {}, {}, {counts:?}, {cures}, {:.2}, {retracts}, {seconds:.0}",
                verdict.islands,
                planned.toolpaths().count(),
                planned.toolpaths_mm() / 1e3,
            );
            assert!(verdict.islands > 0, "{name} has no islands");
            let never = [
                FindingKind::Short,
                FindingKind::Break,
                FindingKind::Gone,
                FindingKind::Lost,
                FindingKind::NoBit,
                FindingKind::Shallow,
                FindingKind::Hit,
            ];
            let bad = verdict.findings.iter().filter(|finding| never.contains(&finding.kind));
            wrong.extend(bad.map(|finding| format!("{name} {face:?}: {finding:?}")));
            let slivers = verdict.findings.iter().filter(|finding| finding.kind == FindingKind::Sliver);
            let (of_nets, loose): (Vec<_>, Vec<_>) = slivers.partition(|finding| !finding.nets.is_empty());
            let (_, of_net, free) =
                SLIVERS.iter().find(|(board, ..)| *board == name).copied().unwrap_or((name, 0, 0));
            if of_nets.len() > of_net || loose.len() > free {
                wrong.push(format!("{name} {face:?}: slivers {of_nets:#?} {loose:#?}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The positions where motors lose steps because the default job's stream asks too much of them.
fn lost_by_the_motors(board: &Board, machine: &Machine) -> Vec<Slip> {
    let mut work = Work::default_for(board, machine);
    work.setup.face = work.faces()[0];
    let options = PlanOptions::default();
    let rapid_time = |from: Point, to: Point| motion::rapid_time_s(machine, from, to);
    let means = Means { options: &options, rapid_time: &rapid_time };
    let (planned, _) = plan_work(board, &work, machine, &means, &mut |_| true).expect("a plan");
    let timeline = motion::timeline(&lower_work(&planned, &work, machine), machine).expect("a timeline");
    let stream = steps::stream(&timeline, machine).expect("a stream");
    let mut twin = VirtualDrill::new(machine, 1, Faults::default(), Box::new(|_| {}));
    for pulse in steps::replay_stream(&stream) {
        twin.step(pulse.tick, pulse.axes, pulse.forward);
    }
    // The virtual drill starts at a random position, so it can also hit a limit: ignore that cause.
    let asked = |slip: &&Slip| matches!(slip.cause, Cause::TooFast | Cause::TooSteep);
    twin.slips().iter().filter(asked).copied().collect()
}

#[test]
fn default_job_stays_within_motor_limits() {
    let Some(corpus) = corpus() else { return };
    let few = ["easyeda/easytrace-tht", "kicad/4.0-multivibrator"];
    let whole = std::env::var_os("ANNULUS_LONG").is_some();
    for name in BOARDS.into_iter().filter(|name| whole || few.contains(name)) {
        let board = board(&corpus.join(name));
        for machine in [virtual_drill(), annulus_core::machine::hobby_3018()] {
            let lost = lost_by_the_motors(&board, &machine);
            assert_eq!(lost, [], "{name} on {}", machine.name);
        }
    }
}
