//! What written programs really do to a board, swept dot by dot by a checker that shares nothing with the product but the
//! design: its own reader of G-code, its own raster (N8 N9 N10 S6).
//!
//! ```text
//!   board ─ usual job ─ plan ─ post ─▶ files ─ reader ─ raster ─▶ cut away ─┬─ islands still joined?   told by the proof, or wrong
//!   design ─────────────────────────────────── raster ─▶ wanted  ──────────┼─ copper lost?            told, or wrong
//!                                                                          └─ zones, tabs, bites, panels
//! ```

mod raster;
mod reader;
mod side;

use annulus_core::board::{Board, BoardWanted, Face, from_artwork_with};
use annulus_core::cam::work::{CutOut, OperationKind, Remedy, Work};
use annulus_core::geometry::{Bounds, Point, Region};
use annulus_core::machine::{Machine, virtual_drill};
use annulus_core::proof::{Cure, Finding, FindingKind};
use annulus_core::units::Length;
use annulus_tests::{corpus, read_folder, root, rounds};
use raster::Raster;
use reader::{Read, Tool};
use side::{Side, cut, design, places, planned_side, sheet};
use std::collections::{BTreeMap, BTreeSet};

/// The side of a dot, mm.
const DOT: f64 = 0.02;
/// The same where only what is wider than a tool counts.
const COARSE: f64 = 0.05;
/// Beyond the board so much is looked at, mm.
const BEYOND: f64 = 4.0;
/// Thickness of the copper, mm.
const COPPER: f64 = 0.035;
/// Larger boards are left out, mm².
const LARGEST_MM2: f64 = 12_000.0;

/// Where a finding is, mm from the work zero.
fn near(side: &Side, finding: &Finding) -> Vec<[f64; 2]> {
    let zero = side.planned.origin;
    let mm = |at: Point| [(at.x - zero.x).mm(), (at.y - zero.y).mm()];
    let ends = finding.ends.into_iter().flat_map(|(a, b)| [a, b]);
    std::iter::once(finding.at).chain(ends).map(mm).collect()
}

/// Two dots behind either side of a gap, in the copper that it lies between.
fn behind(side: &Side, finding: &Finding) -> Vec<[f64; 2]> {
    let Some((a, b)) = finding.ends else { return Vec::new() };
    let zero = side.planned.origin;
    let mm = |at: Point| [(at.x - zero.x).mm(), (at.y - zero.y).mm()];
    let (a, b) = (mm(a), mm(b));
    let length = (b[0] - a[0]).hypot(b[1] - a[1]).max(1e-9);
    let by = [(b[0] - a[0]) / length * 2.0 * DOT, (b[1] - a[1]) / length * 2.0 * DOT];
    vec![[a[0] - by[0], a[1] - by[1]], [b[0] + by[0], b[1] + by[1]]]
}

/// The net at a place, or next to it.
fn net_near(wanted: &Raster, at: [f64; 2]) -> Option<u16> {
    let steps = -4..=4_i32;
    let around = steps.clone().flat_map(|row| steps.clone().map(move |column| (row, column)));
    let mut nets: Vec<(i32, u16)> = around
        .filter_map(|(row, column)| {
            let place = [at[0] + f64::from(column) * DOT, at[1] + f64::from(row) * DOT];
            let net = wanted.dots[wanted.dot_at(place)?];
            (net != 0).then_some((row * row + column * column, net))
        })
        .collect();
    nets.sort_unstable();
    nets.first().map(|(_, net)| *net)
}

/// Nets that are told to be joined, put together: for each its group.
fn told_groups(side: &Side, wanted: &Raster) -> BTreeMap<u16, u16> {
    let mut group: BTreeMap<u16, u16> = BTreeMap::new();
    for finding in
        side.findings.iter().filter(|finding| matches!(finding.kind, FindingKind::Short | FindingKind::Gap))
    {
        let nets: BTreeSet<u16> =
            behind(side, finding).into_iter().filter_map(|at| net_near(wanted, at)).collect();
        let roots: Vec<u16> = nets.iter().map(|net| *group.entry(*net).or_insert(*net)).collect();
        let Some(&root) = roots.iter().min() else { continue };
        group.values_mut().filter(|own| roots.contains(own)).for_each(|own| *own = root);
    }
    group
}

/// What joins islands of different nets, and copper that is gone, of which the proof says nothing.
fn untold(side: &Side, face: Face) -> Vec<String> {
    let wanted = design(side, face);
    let labels = cut(side, -COPPER, DOT, |_| true).pieces_of_nothing();
    let mut joined: BTreeMap<u32, BTreeMap<u16, usize>> = BTreeMap::new();
    for (dot, (&net, &piece)) in wanted.dots.iter().zip(&labels).enumerate() {
        if net != 0 && piece != 0 {
            joined.entry(piece).or_default().entry(net).or_insert(dot);
        }
    }
    let told = told_groups(side, &wanted);
    let mut wrong = Vec::new();
    for nets in joined.values() {
        let groups: BTreeSet<u16> = nets.keys().map(|net| told.get(net).copied().unwrap_or(*net)).collect();
        if groups.len() > 1 {
            let at: Vec<_> = nets.iter().take(3).map(|(net, dot)| (net, wanted.place(*dot))).collect();
            wrong.push(format!("{} nets are joined that nobody tells: {at:?}", groups.len()));
        }
    }
    // A cone is to leave the copper of the design where it is, within two dots of its edge.
    let mut touched = cut(side, 0.0, DOT, |tool| matches!(tool, Tool::Cone { .. }));
    let told = side.findings.iter().filter(|finding| !matches!(finding.kind, FindingKind::Gap));
    for finding in told {
        for at in near(side, finding) {
            touched.stroke(at, at, finding.width.mm().abs() + 0.3, 0);
        }
    }
    let inside = wanted.eroded(2);
    let lost =
        inside.dots.iter().zip(&touched.dots).enumerate().filter(|(_, (net, cut))| **net != 0 && **cut != 0);
    let lost: Vec<usize> = lost.map(|(dot, _)| dot).collect();
    if let Some(first) = lost.first() {
        wrong.push(format!(
            "{} dots of copper are lost, the first at {:?}",
            lost.len(),
            wanted.place(*first)
        ));
    }
    wrong
}

/// The holes that no drill and no mill goes through, of those that nobody says are missing.
fn missing_holes(side: &Side, machine: &Machine) -> Vec<[f64; 2]> {
    let through = cut(side, -machine.process.board_thickness.mm(), COARSE, |_| true);
    let zero = side.planned.origin;
    let made: BTreeSet<u32> = side.planned.parts.iter().flat_map(|part| part.holes.iter().copied()).collect();
    let holes = (0_u32..).zip(&side.planned.board.holes).filter(|(index, _)| made.contains(index));
    let places = holes.map(|(_, hole)| [(hole.at.x - zero.x).mm(), (hole.at.y - zero.y).mm()]);
    places.filter(|at| through.dot_at(*at).is_none_or(|dot| through.dots[dot] == 0)).collect()
}

/// The board of the sample.
fn sample() -> Board {
    let artwork = read_folder(&root().join("www/examples"));
    from_artwork_with(&artwork, &artwork.default_use(), BoardWanted { copper: true, aligned: true }).0
}

/// The usual job of a board's first side that has copper, changed.
fn worked(board: &Board, machine: &Machine, change: impl Fn(&mut Work)) -> (Work, Face) {
    let mut work = Work::default_for(board, machine);
    let face = board.copper.first().map_or(Face::Top, |copper| copper.face);
    work.setup.face = face;
    change(&mut work);
    (work, face)
}

#[test]
fn written_programs_do_what_the_proof_says() {
    let machine = virtual_drill();
    let mut boards = vec![("the sample".to_owned(), sample())];
    let wanted = rounds(2, 21) as usize;
    let folders = corpus().map(|corpus| folders(&corpus)).unwrap_or_default();
    for folder in folders {
        if boards.len() >= wanted {
            break;
        }
        let artwork = read_folder(&folder);
        let board =
            from_artwork_with(&artwork, &artwork.default_use(), BoardWanted { copper: true, aligned: true })
                .0;
        let copper = board.copper.iter().filter_map(|copper| copper.region.bounds());
        let all = copper.chain(board.outline.bounds()).reduce(|all, next| all.with(next.min).with(next.max));
        let size = all.map(|all| (all.max.x - all.min.x).mm() * (all.max.y - all.min.y).mm());
        if size.is_some_and(|size| size < LARGEST_MM2) && !board.copper.is_empty() {
            boards.push((folder.display().to_string(), board));
        }
    }
    let mut wrong = Vec::new();
    for (name, board) in &boards {
        let (work, _) = worked(board, &machine, |_| {});
        for face in work.faces() {
            let mut work = work.clone();
            work.setup.face = face;
            let side = planned_side(board, &work, &machine);
            let mut told = untold(&side, face);
            told.extend(missing_holes(&side, &machine).iter().map(|at| format!("no hole at {at:?}")));
            println!(
                "{name}, {face:?}: {} files, {} findings, {} untold",
                side.files.len(),
                side.findings.len(),
                told.len()
            );
            wrong.extend(told.into_iter().map(|why| format!("{name}, {face:?}: {why}")));
        }
    }
    println!("{} boards swept", boards.len());
    assert!(corpus().is_none() || boards.len() == wanted, "{} of {wanted}", boards.len());
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Puts a cure for every gap that is told into the job: the gentlest, and where there is one already the last; whether there was any.
fn cured(work: &mut Work, side: &Side) -> bool {
    let joined =
        side.findings.iter().filter(|found| matches!(found.kind, FindingKind::Short | FindingKind::Gap));
    let isolates = work.operations.iter_mut().find_map(|operation| match &mut operation.action {
        OperationKind::Isolate(isolate) if operation.on && operation.face == work.setup.face => Some(isolate),
        _ => None,
    });
    let Some(isolate) = isolates else { return false };
    let mut any = false;
    for finding in joined {
        let Some((from, to)) = finding.ends else { continue };
        let again = isolate.cures.iter().any(|cure| cure.from.distance_mm(from) < 0.3);
        let cure = if again { finding.cures.last() } else { finding.cures.first() };
        let remedy = match cure {
            Some(Cure::Shallower { depth, .. }) => Remedy::Depth(*depth),
            Some(Cure::Centred { .. }) => Remedy::Centred,
            _ => continue,
        };
        isolate.cures.retain(|cure| cure.from.distance_mm(from) >= 0.3);
        isolate.cure(from, to, remedy);
        any = true;
    }
    any
}

#[test]
fn cured_programs_do_what_the_proof_says() {
    let machine = virtual_drill();
    let Some(corpus) = corpus() else { return };
    let boards = ["librepcb/demo-bldc", "horizon/usbkvm", "p-cad/zxinet", "siemens-xpedition/lasmo"];
    let (mut wrong, mut opened) = (Vec::new(), 0);
    for name in boards.iter().take(rounds(1, 4) as usize) {
        let artwork = read_folder(&corpus.join(name));
        let board =
            from_artwork_with(&artwork, &artwork.default_use(), BoardWanted { copper: true, aligned: true })
                .0;
        let (work, _) = worked(&board, &machine, |_| {});
        for face in work.faces() {
            let mut work = work.clone();
            work.setup.face = face;
            let mut side = planned_side(&board, &work, &machine);
            let joined =
                |side: &Side| side.findings.iter().filter(|found| found.kind == FindingKind::Gap).count();
            let before = joined(&side);
            for _ in 0..6 {
                if !cured(&mut work, &side) {
                    break;
                }
                side = planned_side(&board, &work, &machine);
            }
            println!("{name}, {face:?}: {before} gaps, {} after cures", joined(&side));
            opened += before.saturating_sub(joined(&side));
            wrong.extend(untold(&side, face).into_iter().map(|why| format!("{name}, {face:?}: {why}")));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(opened > 0, "cures open something");
}

/// Folders of the corpus with real boards, the small ones that come first on a push in front.
fn folders(corpus: &std::path::Path) -> Vec<std::path::PathBuf> {
    let first = [corpus.join("easyeda/easytrace-tht")];
    let makers = [
        "kicad",
        "eagle",
        "altium",
        "cam350",
        "diptrace",
        "ekf-cam",
        "fab3000",
        "freepcb",
        "fritzing",
        "geda-pcb",
        "horizon",
        "librepcb",
        "mentor-expedition",
        "mentor-veribest",
        "orcad",
        "p-cad",
        "pads",
        "pcb-rnd",
        "pcgerber",
        "proteus",
        "siemens-xpedition",
        "target3001",
        "ultiboard",
        "upverter",
        "visula",
    ];
    let below = makers.iter().flat_map(|maker| {
        let entries = std::fs::read_dir(corpus.join(maker)).into_iter().flatten().flatten();
        let mut folders: Vec<_> = entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
        folders.sort();
        folders
    });
    first.into_iter().chain(below).collect()
}

#[test]
fn the_sweep_finds_a_missing_pass_and_a_cut_too_wide() {
    // The checker itself: without the isolation all is joined, with a tip twice as wide copper is lost.
    let machine = virtual_drill();
    let board = sample();
    let (work, face) = worked(&board, &machine, |_| {});
    let mut side = planned_side(&board, &work, &machine);
    side.findings.clear();
    let whole = side.files.iter().position(|file| matches!(file.tool, Tool::Cone { .. })).unwrap();
    let pieces = std::mem::take(&mut side.files[whole].pieces);
    assert!(untold(&side, face).iter().any(|why| why.contains("joined")));
    side.files[whole] = Read { tool: Tool::Cone { tip: 0.2, slope: 0.5 }, pieces };
    assert!(untold(&side, face).iter().any(|why| why.contains("lost")));
}

#[test]
fn no_tool_enters_a_zone() {
    let machine = virtual_drill();
    let board = sample();
    let all = board.outline.bounds().unwrap();
    let middle = Point::from_mm((all.min.x + all.max.x).mm() / 2.0, (all.min.y + all.max.y).mm() / 2.0);
    let zone = Bounds::of(middle).grown(Length::from_mm(3.0));
    let (work, _) = worked(&board, &machine, |work| work.setup.exclusions = vec![zone]);
    let side = planned_side(&board, &work, &machine);
    let taken = cut(&side, 0.0, COARSE, |_| true);
    let zero = side.planned.origin;
    let mm = |at: Point| [(at.x - zero.x).mm(), (at.y - zero.y).mm()];
    let (low, high) = (mm(zone.min), mm(zone.max));
    let inside =
        |at: [f64; 2]| (0..2).all(|axis| low[axis] + COARSE < at[axis] && at[axis] < high[axis] - COARSE);
    let hit = (0..taken.dots.len()).filter(|dot| taken.dots[*dot] != 0 && inside(taken.place(*dot))).count();
    assert_eq!(hit, 0, "dots in the zone");
    assert!(taken.dots.iter().filter(|dot| **dot != 0).count() > 2_000, "something is cut");
    // Without the zone something is cut there: the zone is not empty by chance.
    let (work, _) = worked(&board, &machine, |_| {});
    let free = cut(&planned_side(&board, &work, &machine), 0.0, COARSE, |_| true);
    assert!((0..free.dots.len()).any(|dot| free.dots[dot] != 0 && inside(free.place(dot))));
}

#[test]
fn every_copy_of_a_panel_is_cut_alike() {
    let machine = virtual_drill();
    let board = sample();
    // The copies are whole dots apart.
    let all = board.outline.bounds().unwrap();
    let across = (all.max.x - all.min.x).mm();
    let gap = ((across + 3.0) / DOT).ceil() * DOT - across;
    let (work, face) = worked(&board, &machine, |work| {
        work.setup.panel.columns = 2;
        work.setup.panel.gap = Length::from_mm(gap);
    });
    let side = planned_side(&board, &work, &machine);
    assert_eq!(untold(&side, face), Vec::<String>::new());
    let pitch = (all.max.x - all.min.x + work.setup.panel.gap).mm();
    // Away from the cut-outs, whose tabs may lie elsewhere.
    let taken = cut(&side, -COPPER, DOT, |tool| !matches!(tool, Tool::Round { drill: false, .. }));
    let (width, height) = ((all.max.x - all.min.x).mm(), (all.max.y - all.min.y).mm());
    let (mut cut_away, mut different) = (0_usize, 0_usize);
    for dot in 0..taken.dots.len() {
        let [x, y] = taken.place(dot);
        if x < 0.5 || y < 0.5 || x > width - 0.5 || y > height - 0.5 {
            continue;
        }
        let twin = taken.dot_at([x + pitch, y]).expect("the other copy is in the picture");
        cut_away += usize::from(taken.dots[dot] != 0);
        different += usize::from(taken.dots[dot] != taken.dots[twin]);
    }
    // A dot at an edge falls to either side.
    assert!(cut_away > 10_000 && different * 50 < cut_away, "{different} of {cut_away}");
}

/// Whether the middle of the board and the blank around it hang together once all is cut through.
fn hangs(board: &Board, machine: &Machine, change: impl Fn(&mut CutOut)) -> (bool, Side) {
    let (work, _) = worked(board, machine, |work| {
        for operation in &mut work.operations {
            if let OperationKind::CutOut(cut_out) = &mut operation.action {
                change(cut_out);
            }
        }
    });
    let side = planned_side(board, &work, machine);
    let through = cut(&side, -machine.process.board_thickness.mm(), COARSE, |_| true);
    let labels = through.pieces_of_nothing();
    let mut body = sheet(&side, COARSE);
    let region: &Region = &side.planned.board.outline;
    let outlines: Vec<_> = region.paths().map(|path| places(path, side.planned.origin)).collect();
    body.area(&outlines, 1);
    let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
    for (&inside, &piece) in body.dots.iter().zip(&labels) {
        if inside != 0 && piece != 0 {
            *counts.entry(piece).or_default() += 1;
        }
    }
    let largest = counts.iter().max_by_key(|(_, count)| **count).map(|(piece, _)| *piece);
    // The corner of the picture is blank.
    (largest == Some(labels[0]), side)
}

#[test]
fn tabs_and_mouse_bites_hold_the_board_and_nothing_else_does() {
    let machine = virtual_drill();
    let board = sample();
    assert!(hangs(&board, &machine, |_| {}).0, "four tabs");
    assert!(!hangs(&board, &machine, |cut_out| cut_out.tabs = 0).0, "no tabs: the board comes loose");
    let (holds, side) = hangs(&board, &machine, |cut_out| cut_out.bites = true);
    assert!(holds, "mouse-bites");
    // On each of the four tabs there are holes, through the board.
    let bites = side.files.iter().filter(|file| match file.tool {
        Tool::Round { radius, drill } => drill && (radius - 0.25).abs() < 0.11,
        Tool::Cone { .. } => false,
    });
    let thickness = machine.process.board_thickness.mm();
    let deep: usize = bites
        .map(|file| {
            file.pieces.iter().filter(|piece| piece.to[2] <= -thickness && piece.from[2] > 0.0).count()
        })
        .sum();
    assert!(deep >= 8, "{deep} holes");
}
