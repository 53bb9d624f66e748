//! The real effect of exported programs on a board, dot by dot, by an independent checker with its own G-code
//! reader and raster. Shares only the design data with the product.
//!
//! ```text
//!   board ─ default job ─ plan ─ post ─▶ files ─ reader ─ raster ─▶ cut away ─┬─ islands joined?
//!   design ──────────────────────────────────────────────── raster ─▶ wanted ─┼─ copper lost?
//!                                                                             └─ zones, tabs, bites, panels
//! ```
//!
//! The proof must have reported all joined islands and lost copper.

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

/// Side of a dot, mm.
const DOT: f64 = 0.02;
/// Side of a dot if only larger features than a tool matter, mm.
const COARSE: f64 = 0.05;
/// Margin around the board, mm.
const BEYOND: f64 = 4.0;
/// Thickness of the copper, mm.
const COPPER: f64 = 0.035;
/// Larger boards are skipped, mm².
const LARGEST_MM2: f64 = 12_000.0;

/// Positions of a finding, mm from the work zero.
fn near(side: &Side, finding: &Finding) -> Vec<[f64; 2]> {
    let zero = side.planned.origin;
    let mm = |at: Point| [(at.x - zero.x).mm(), (at.y - zero.y).mm()];
    let ends = finding.ends.into_iter().flat_map(|(a, b)| [a, b]);
    std::iter::once(finding.at).chain(ends).map(mm).collect()
}

/// Positions two dots beyond each end of a gap, inside the adjacent copper.
fn behind(side: &Side, finding: &Finding) -> Vec<[f64; 2]> {
    let Some((a, b)) = finding.ends else { return Vec::new() };
    let zero = side.planned.origin;
    let mm = |at: Point| [(at.x - zero.x).mm(), (at.y - zero.y).mm()];
    let (a, b) = (mm(a), mm(b));
    let length = (b[0] - a[0]).hypot(b[1] - a[1]).max(1e-9);
    let by = [(b[0] - a[0]) / length * 2.0 * DOT, (b[1] - a[1]) / length * 2.0 * DOT];
    vec![[a[0] - by[0], a[1] - by[1]], [b[0] + by[0], b[1] + by[1]]]
}

/// The net at or next to a position.
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

/// Groups of nets that the proof reports as joined: the group of each net.
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

/// Joined islands of different nets, and lost copper, that the proof doesn't report.
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
    // A V-bit must leave the design's copper intact, except within two dots of its edge.
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

/// Holes without any drilling or milling through them, except those reported as missing.
fn missing_holes(side: &Side, machine: &Machine) -> Vec<[f64; 2]> {
    let through = cut(side, -machine.process.board_thickness.mm(), COARSE, |_| true);
    let zero = side.planned.origin;
    let made: BTreeSet<u32> = side.planned.parts.iter().flat_map(|part| part.holes.iter().copied()).collect();
    let holes = (0_u32..).zip(&side.planned.board.holes).filter(|(index, _)| made.contains(index));
    let places = holes.map(|(_, hole)| [(hole.at.x - zero.x).mm(), (hole.at.y - zero.y).mm()]);
    places.filter(|at| through.dot_at(*at).is_none_or(|dot| through.dots[dot] == 0)).collect()
}

/// The sample board.
fn sample() -> Board {
    let artwork = read_folder(&root().join("www/examples"));
    from_artwork_with(&artwork, &artwork.default_use(), BoardWanted { copper: true, aligned: true }).0
}

/// The default job of the board's first copper side, with a change.
fn worked(board: &Board, machine: &Machine, change: impl Fn(&mut Work)) -> (Work, Face) {
    let mut work = Work::default_for(board, machine);
    let face = board.copper.first().map_or(Face::Top, |copper| copper.face);
    work.setup.face = face;
    change(&mut work);
    (work, face)
}

#[test]
fn written_programs_match_the_proof() {
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

/// Adds a fix for every reported gap: the mildest, or the last one if there already is one. True if there was
/// any gap.
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
fn fixed_programs_match_the_proof() {
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

/// Folders of corpus boards; the small ones that a push tests are first.
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
fn raster_check_finds_a_missing_pass_and_a_wide_cut() {
    // Tests the checker: without isolation everything is joined, with twice the tip width copper is lost.
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
fn no_tool_enters_an_exclusion_zone() {
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
    // Without the zone something is cut there, so the test above isn't trivial.
    let (work, _) = worked(&board, &machine, |_| {});
    let free = cut(&planned_side(&board, &work, &machine), 0.0, COARSE, |_| true);
    assert!((0..free.dots.len()).any(|dot| free.dots[dot] != 0 && inside(free.place(dot))));
}

#[test]
fn panel_copies_are_cut_alike() {
    let machine = virtual_drill();
    let board = sample();
    // Copies must be a whole number of dots apart.
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
    // Ignore the cut-outs, because their tabs can be in other positions.
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
    // Dots at an edge can fall on either side.
    assert!(cut_away > 10_000 && different * 50 < cut_away, "{different} of {cut_away}");
}

/// True if the middle of the board and the surrounding blank are connected after all cuts.
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
    // The corner of the raster is blank.
    (largest == Some(labels[0]), side)
}

#[test]
fn only_tabs_or_mouse_bites_hold_the_board() {
    let machine = virtual_drill();
    let board = sample();
    assert!(hangs(&board, &machine, |_| {}).0, "four tabs");
    assert!(!hangs(&board, &machine, |cut_out| cut_out.tabs = 0).0, "no tabs: the board comes loose");
    let (holds, side) = hangs(&board, &machine, |cut_out| cut_out.bites = true);
    assert!(holds, "mouse-bites");
    // Each of the four tabs has holes through the board.
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
