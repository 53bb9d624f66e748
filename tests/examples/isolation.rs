//! Compares the isolation of every corpus board, with one pass and with two, to pcb2gcode 2.5.0. Run by
//! `cargo xtask bench --isolation`; further arguments select boards by name. Prints numbers only; sets no
//! limits.
//!
//! pcb2gcode is not a package of Debian: build tag v2.5.0 of github.com/pcb2gcode/pcb2gcode with libgerbv 2.9, and name the program
//! in `ANNULUS_PCB2GCODE`. Without it the columns of pcb2gcode are left out, and a line says so. It gets the same layer, the
//! width that the bit of ours cuts, the overlap and the width that our passes isolate; the rest is [`OPTIONS`]. Travel ends at the
//! last cut of both. Layers of more than one file are left out: pcb2gcode reads one.
//!
//! Each line ends with what the toolpaths do to the copper of the board: how many mm of them cut into it, how deep, and along how
//! many mm of its edges none runs. pcb2gcode cuts into copper if a gap is narrower than the tool; Annulus leaves such a gap closed.
//!
//! Judges nothing.

use annulus_core::artwork::{Artwork, Role, Side};
use annulus_core::board::{Board, BoardWanted, Face, from_artwork_with};
use annulus_core::cam::PlanOptions;
use annulus_core::cam::toolpaths::{Means, lower_work, plan_work};
use annulus_core::cam::work::{OperationKind, Work};
use annulus_core::geometry::{Bounds, Index, Island, Path as Route, Point, Region, path_bounds};
use annulus_core::job::{Command as Word, Program};
use annulus_core::machine::{Machine, virtual_drill};
use annulus_core::units::Length;
use annulus_core::{motion, sim, steps};
use annulus_tests::{corpus, read_folder};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Options of pcb2gcode for every board.
const OPTIONS: &str = "--noconfigfile --metric --metricoutput --zero-start --zwork=-0.1 --zsafe=2 --zchange=10 \
    --mill-feed=720 --mill-vertfeed=90 --mill-speed=10000 --nog64 --ignore-warnings --software=custom";
/// Shorter segments are counted, mm.
const SHORT_MM: f64 = 0.05;
/// The distance between samples along toolpaths and edges of copper, in mm.
const SAMPLE_MM: f64 = 0.05;
/// A cut this much inside copper counts, in mm: pcb2gcode rounds arcs to lines.
const INSIDE_MM: f64 = 0.005;
/// A toolpath this near to its place beside an edge counts as there.
const THERE: Length = Length::from_um(30);
/// A board of which pcb2gcode misses a larger share of the edges is not in the sum.
const UNDONE: f64 = 0.01;

/// What toolpaths do to the copper of a board.
#[derive(Clone, Copy, Default)]
struct Copper {
    /// Length of the toolpaths that cut into copper.
    cut_mm: f64,
    deepest_mm: f64,
    /// Length of the edges of copper that have room for a toolpath and have none.
    missed_mm: f64,
}

/// The result of one program.
#[derive(Clone, Copy, Default)]
struct Found {
    retracts: usize,
    travel_mm: f64,
    milled_mm: f64,
    pieces: usize,
    short: usize,
    copper: Copper,
    /// Of the whole program, of plunging, of cutting, of travel.
    seconds: Option<[f64; 4]>,
}

fn folders(corpus: &Path) -> Vec<PathBuf> {
    let below = |folder: &Path| {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
        let mut found: Vec<PathBuf> = entries.filter(|path| path.is_dir()).collect();
        found.sort();
        found
    };
    let none = ["expected", "licenses", "tsplib", "broken", "synthetic"];
    let of = |folder: &PathBuf| folder.file_name().is_some_and(|name| none.iter().all(|none| name != *none));
    below(corpus).iter().filter(|folder| of(folder)).flat_map(|folder| below(folder)).collect()
}

/// The isolation of a side with this number of passes; also the cut width and the distance between passes,
/// mm.
fn own(board: &Board, machine: &Machine, face: Face, passes: u32) -> Option<(Found, f64, f64)> {
    let mut work = Work::default_for(board, machine);
    work.setup.face = face;
    let bits = work.bits.clone();
    let (mut width, mut overlap) = (0.0, 0.0);
    for operation in &mut work.operations {
        let bit = bits.iter().find(|bit| bit.name == operation.bit);
        match &mut operation.action {
            OperationKind::Isolate(isolate) => {
                isolate.passes = passes;
                width = bit?.width_at(operation.depth).mm();
                overlap = isolate.overlap_percent / 100.0;
            }
            _ => operation.on = false,
        }
    }
    let options = PlanOptions::default();
    let rapid_time = |from: Point, to: Point| motion::rapid_time_s(machine, from, to);
    let means = Means { options: &options, rapid_time: &rapid_time };
    let (planned, _) = plan_work(board, &work, machine, &means, &mut |_| true).ok()?;
    let program = lower_work(&planned, &work, machine);
    let words = program.legs.iter().flat_map(|leg| &leg.commands);
    let mut found = Found {
        retracts: words.filter(|word| matches!(word, Word::Retract { .. })).count(),
        travel_mm: travel_mm(&program),
        milled_mm: planned.toolpaths_mm(),
        copper: on_copper(region(&planned.board, face)?, planned.toolpaths().map(|way| &way.path), width),
        ..Found::default()
    };
    for (start, segment) in planned.toolpaths().flat_map(|way| way.path.pieces()) {
        found.pieces += 1;
        found.short += usize::from(Route { start, segments: vec![segment] }.length_mm() < SHORT_MM);
    }
    if std::env::var_os("ANNULUS_TIMES").is_some() {
        let timeline = motion::timeline(&program, machine).ok()?;
        let spent = sim::summary(&timeline, &steps::stream(&timeline, machine).ok()?, machine);
        let parts = spent.spent;
        found.seconds = Some([spent.total_s, parts.plunge_s, parts.mill_s - parts.plunge_s, parts.between_s]);
    }
    Some((found, width, width * (1.0 - overlap)))
}

/// The travel of a program as far as its last cut.
fn travel_mm(program: &Program) -> f64 {
    let (mut here, mut sum, mut until_cut) = (Point::default(), 0.0, 0.0);
    for word in program.legs.iter().flat_map(|leg| &leg.commands) {
        match *word {
            Word::Rapid { to } => {
                sum += here.distance_mm(to);
                here = to;
            }
            Word::Mill { to, .. } | Word::MillArc { to, .. } => (here, until_cut) = (to, sum),
            _ => {}
        }
    }
    until_cut
}

fn region(board: &Board, face: Face) -> Option<&Region> {
    board.copper.iter().find(|copper| copper.face == face).map(|copper| &copper.region)
}

/// Points along a path, each with the point `aside` mm to the right of it.
fn samples(path: &Route, aside: f64) -> Vec<(Point, Point)> {
    let corners = path.flattened(0.0005);
    let mut found = Vec::new();
    for (from, to) in corners.iter().zip(corners.iter().skip(1)) {
        let length = from.distance_mm(*to);
        let (dx, dy) = ((to.x - from.x).mm(), (to.y - from.y).mm());
        let count = (length / SAMPLE_MM) as usize + 1;
        for number in (0..count).filter(|_| length > 0.0) {
            let share = (number as f64 + 0.5) / count as f64;
            let (x, y) = (from.x.mm() + dx * share, from.y.mm() + dy * share);
            let beside = Point::from_mm(x + dy / length * aside, y - dx / length * aside);
            found.push((Point::from_mm(x, y), beside));
        }
    }
    found
}

/// What toolpaths of a cut of `width` do to `region`.
fn on_copper<'a>(region: &Region, paths: impl Iterator<Item = &'a Route>, width: f64) -> Copper {
    let (copper, half) = (Index::of(region), width / 2.0);
    let paths: Vec<Route> = paths.cloned().collect();
    let mut found = Copper::default();
    for path in &paths {
        let samples = samples(path, 0.0);
        let each_mm = path.length_mm() / samples.len().max(1) as f64;
        for (at, _) in samples {
            let near = copper.nearest(at, Length::from_mm(half)).map_or(half, |near| near.distance.mm());
            let inside = if copper.island_at(at).is_some() { half + near } else { half - near };
            found.deepest_mm = found.deepest_mm.max(inside);
            found.cut_mm += if inside > INSIDE_MM { each_mm } else { 0.0 };
        }
    }
    let islands = paths.iter().map(|path| Island { outer: path.clone(), holes: Vec::new() });
    let run = Index::of(&Region { islands: islands.collect() });
    let free = |at: Point| {
        let blocked = copper.nearest(at, Length::from_mm(half - 0.0005)).is_some();
        !blocked && copper.island_at(at).is_none()
    };
    for edge in region.paths() {
        let samples = samples(edge, half);
        let each_mm = edge.length_mm() / samples.len().max(1) as f64;
        let missed = samples.into_iter().filter(|(_, at)| free(*at) && run.nearest(*at, THERE).is_none());
        found.missed_mm += each_mm * missed.count() as f64;
    }
    found
}

/// The file of a side's copper; none if there are several.
fn layer(artwork: &Artwork, face: Face) -> Option<&str> {
    let side = match face {
        Face::Top => Side::Top,
        Face::Bottom => Side::Bottom,
    };
    let mut copper = artwork.files.iter().filter(|file| file.role == Role::Copper && file.side == Some(side));
    let first = copper.next()?;
    copper.next().is_none().then_some(first.name.as_str())
}

/// The same side by pcb2gcode.
fn others(
    program: &str,
    (file, region): (&str, &Region),
    (width, step): (f64, f64),
    passes: u32,
) -> Option<Found> {
    let folder = std::env::temp_dir().join(format!("annulus-isolation-{}", std::process::id()));
    std::fs::create_dir_all(&folder).ok()?;
    let written = folder.join("front.ngc");
    let _ = std::fs::remove_file(&written);
    let isolated = width + step * f64::from(passes - 1);
    let mut call = Command::new("timeout");
    call.arg("300").arg(program).args(OPTIONS.split_whitespace()).arg(format!("--front={file}"));
    call.arg(format!("--mill-diameters={width}mm")).arg(format!("--milling-overlap={}mm", width - step));
    call.arg(format!("--isolation-width={isolated}mm")).arg("--output-dir").arg(&folder);
    call.output().ok()?;
    let text = std::fs::read_to_string(&written).ok()?;
    let _ = std::fs::remove_dir_all(&folder);
    let (mut found, paths) = read(&text);
    // Its zero is the corner of its own box: lay that on the box of the copper and the passes.
    let corners = paths.iter().map(path_bounds).flat_map(|bounds| [bounds.min, bounds.max]);
    let margin = Length::from_mm(width / 2.0 + step * f64::from(passes - 1));
    let (own, all) = (Bounds::around(corners)?, region.bounds()?.grown(margin));
    let (dx, dy) = (all.min.x - own.min.x, all.min.y - own.min.y);
    let moved = |path: &Route| {
        let points: Vec<Point> = path.corners().map(|at| Point::new(at.x + dx, at.y + dy)).collect();
        Route::through(&points)
    };
    let placed: Vec<Route> = paths.iter().filter_map(moved).collect();
    found.copper = on_copper(region, placed.iter(), width);
    Some(found)
}

/// A program of lines alone: what it does, and its toolpaths.
fn read(text: &str) -> (Found, Vec<Route>) {
    let (mut found, mut paths) = (Found::default(), Vec::new());
    let mut path: Vec<Point> = Vec::new();
    let mut at = [0.0, 0.0, 1.0_f64];
    for line in text.lines() {
        let line = line.split(['(', ';']).next().unwrap_or_default();
        let mut to = at;
        let mut moves = false;
        for word in line.split_whitespace() {
            let (letter, number) = word.split_at(1);
            let axis = ["X", "Y", "Z"].iter().position(|axis| *axis == letter);
            if let (Some(axis), Ok(number)) = (axis, number.parse::<f64>()) {
                to[axis] = number;
                moves = true;
            }
        }
        if !moves {
            continue;
        }
        let (dx, dy) = (to[0] - at[0], to[1] - at[1]);
        let mm = (dx * dx + dy * dy).sqrt();
        if at[2] < 0.0 && to[2] >= 0.0 {
            found.retracts += 1;
            paths.extend(Route::through(&std::mem::take(&mut path)));
        }
        if to[2] < 0.0 {
            path.push(Point::from_mm(to[0], to[1]));
        }
        if at[2] < 0.0 && to[2] < 0.0 && mm > 0.0 {
            found.milled_mm += mm;
            found.pieces += 1;
            found.short += usize::from(mm < SHORT_MM);
        } else {
            found.travel_mm += mm;
        }
        at = to;
    }
    (found, paths)
}

fn shown(found: &Found) -> String {
    let times = found.seconds.map_or(String::new(), |[all, plunge, cut, travel]| {
        format!(" {all:.0} s: {plunge:.0} plunging {cut:.0} cutting {travel:.0} travel")
    });
    let Copper { cut_mm, deepest_mm, missed_mm } = found.copper;
    format!(
        "{:5} retracts {:6.0} mm travel {:6.0} mm milled {:6} pieces {:5} short; {cut_mm:.1} mm into copper, \
         at most {deepest_mm:.3}; {missed_mm:.1} mm of edges missed{times}",
        found.retracts, found.travel_mm, found.milled_mm, found.pieces, found.short
    )
}

fn main() {
    let Some(corpus) = corpus() else { return };
    let words: Vec<String> = std::env::args().skip(1).collect();
    let program = std::env::var("ANNULUS_PCB2GCODE").ok();
    if program.is_none() {
        println!("pcb2gcode is left out: ANNULUS_PCB2GCODE does not name it");
    }
    let machine = virtual_drill();
    let mut sums = [[0.0; 4]; 2];
    for folder in folders(&corpus) {
        let name = folder.strip_prefix(&corpus).unwrap_or(&folder).display().to_string();
        if !words.is_empty() && !words.iter().any(|word| name.contains(word)) {
            continue;
        }
        let artwork = read_folder(&folder);
        let wanted = BoardWanted { copper: true, aligned: true };
        let board = from_artwork_with(&artwork, &artwork.default_use(), wanted).0;
        for face in board.copper.iter().map(|copper| copper.face) {
            for passes in [1, 2] {
                let began = std::time::Instant::now();
                let Some((found, width, step)) = own(&board, &machine, face, passes) else { continue };
                let took = began.elapsed().as_secs_f64();
                println!("{name} {face:?}, {passes}: {} ({took:.1} s)", shown(&found));
                let file = layer(&artwork, face).filter(|_| program.is_some());
                let theirs = file.and_then(|file| {
                    others(program.as_deref()?, (file, region(&board, face)?), (width, step), passes)
                });
                let Some(theirs) = theirs else { continue };
                let share = |a: f64, b: f64| a / b.max(1e-9);
                let retracts = share(found.retracts as f64, theirs.retracts as f64);
                let travel = share(found.travel_mm, theirs.travel_mm);
                println!("    pcb2gcode: {}; ours × {retracts:.2}, × {travel:.2}", shown(&theirs));
                if theirs.copper.missed_mm > UNDONE * theirs.milled_mm {
                    println!("    not in the sum: pcb2gcode leaves copper of this board together");
                    continue;
                }
                let sum = &mut sums[passes as usize - 1];
                let all = [found.retracts as f64, theirs.retracts as f64, found.travel_mm, theirs.travel_mm];
                sum.iter_mut().zip(all).for_each(|(sum, more)| *sum += more);
            }
        }
    }
    for (passes, sum) in (1..).zip(sums) {
        if sum[1] > 0.0 {
            let (retracts, travel) = (sum[0] / sum[1], sum[2] / sum[3]);
            println!("all, {passes}: retracts × {retracts:.3}, travel × {travel:.3} of pcb2gcode");
        }
    }
}
