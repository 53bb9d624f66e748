//! Incomplete outlines: closed if the enclosed area is certain, else an error before any planning.

use super::{Board, BoardWanted, from_artwork, from_artwork_with};
use crate::artwork::{Overrides, read_set};
use crate::diagnostic::{Diagnostic, Severity};

/// A layer with a file function, in mm, drawn by lines of `body`.
pub(super) fn layer(function: &str, body: &str) -> Vec<u8> {
    format!("%TF.FileFunction,{function}*%\n%FSLAX46Y46*%\n%MOMM*%\n%ADD10C,1.6*%\nD10*\nG01*\n{body}M02*\n")
        .into_bytes()
}

fn mm(value: f64) -> i64 {
    (value * 1e6) as i64
}

pub(super) fn line(points: &[(f64, f64)]) -> String {
    let word = |at: usize| if at == 0 { "D02" } else { "D01" };
    let rows = points.iter().enumerate();
    rows.map(|(at, (x, y))| format!("X{}Y{}{}*\n", mm(*x), mm(*y), word(at))).collect()
}

pub(super) fn pads(places: &[(f64, f64)]) -> String {
    places.iter().map(|(x, y)| format!("X{}Y{}D03*\n", mm(*x), mm(*y))).collect()
}

fn read(outline: &str, places: &[(f64, f64)]) -> (Board, Vec<Diagnostic>) {
    let mut files = vec![("b-Edge_Cuts.gm1".to_owned(), layer("Profile,NP", outline))];
    if !places.is_empty() {
        files.push(("b-F_Cu.gtl".to_owned(), layer("Copper,L1,Top", &pads(places))));
    }
    from_artwork(&read_set(&files, &Overrides::default()), &[])
}

/// The corners are cut off, so that each side and each corner is one line.
const SIDES: [[(f64, f64); 2]; 8] = [
    [(2.0, 0.0), (28.0, 0.0)],
    [(28.0, 0.0), (30.0, 2.0)],
    [(30.0, 2.0), (30.0, 18.0)],
    [(30.0, 18.0), (28.0, 20.0)],
    [(28.0, 20.0), (2.0, 20.0)],
    [(2.0, 20.0), (0.0, 18.0)],
    [(0.0, 18.0), (0.0, 2.0)],
    [(0.0, 2.0), (2.0, 0.0)],
];

fn without(gone: &[usize]) -> String {
    let left = SIDES.iter().enumerate().filter(|(at, _)| !gone.contains(at));
    left.map(|(_, side)| line(side)).collect()
}

fn square(x: f64, y: f64) -> String {
    line(&[(x, y), (x + 2.0, y), (x + 2.0, y + 2.0), (x, y + 2.0), (x, y)])
}

#[test]
fn outline_gaps_are_closed_or_an_error() {
    let inside = [(5.0, 5.0), (15.0, 12.0), (24.0, 15.0)];
    let corner = [(5.0, 5.0), (0.9, 0.9), (15.0, 10.0)];
    let holes = square(14.0, 8.0) + &square(25.0, 8.0);
    let corners = [(1.0, 1.0), (27.0, 1.0), (27.0, 17.0), (1.0, 17.0)].map(|(x, y)| square(x, y)).concat();
    // Lines, copper, expected report and severity, and the width of the board.
    let rows = [
        (without(&[]) + &holes, &inside, None, 30.0),
        (without(&[7]) + &holes, &inside, Some((Severity::Warning, "board.outline_mended")), 30.0),
        (without(&[7]), &inside, Some((Severity::Warning, "board.outline_mended")), 30.0),
        (without(&[3, 7]) + &holes, &inside, Some((Severity::Error, "board.outline_broken")), 13.0),
        (without(&[3, 7]) + &corners, &inside, Some((Severity::Error, "board.outline_broken")), 28.0),
        (without(&[7]) + &holes, &corner, Some((Severity::Error, "board.outline_broken")), 13.0),
        (without(&[3, 7]), &inside, Some((Severity::Error, "board.outline_open")), 0.0),
        (
            without(&[]) + &line(&[(40.0, 0.0), (40.0, 20.0)]),
            &inside,
            Some((Severity::Warning, "board.outline_rest")),
            30.0,
        ),
        (
            without(&[]),
            &[(40.0, 5.0), (41.0, 5.0), (42.0, 5.0)],
            Some((Severity::Error, "board.outline_elsewhere")),
            30.0,
        ),
        (
            without(&[]),
            &[(10.0, 5.0), (41.0, 5.0), (42.0, 5.0)],
            Some((Severity::Warning, "board.outline_elsewhere")),
            30.0,
        ),
    ];
    for (row, (lines, copper, said, width)) in rows.into_iter().enumerate() {
        let (board, diagnostics) = read(&lines, copper);
        let said_of = diagnostics.iter().filter(|diagnostic| diagnostic.code != "board.outline_could_move");
        let found: Vec<_> =
            said_of.map(|diagnostic| (diagnostic.severity, diagnostic.code.as_str())).collect();
        assert_eq!(found, said.into_iter().collect::<Vec<_>>(), "row {row}");
        assert!(
            diagnostics.iter().all(|diagnostic| !diagnostic.message("en").contains(&diagnostic.code)),
            "{diagnostics:?}"
        );
        let bounds = board.outline.bounds();
        let wide = bounds.map_or(0.0, |bounds| (bounds.max.x - bounds.min.x).mm());
        assert!((wide - width).abs() < 1e-6, "row {row}: {wide}");
    }
}

#[test]
fn silkscreen_has_centre_lines_of_its_strokes() {
    let square = "G36*\nX5000000Y5000000D02*\nX6000000Y5000000D01*\nX6000000Y6000000D01*\nX5000000Y5000000D01*\nG37*\n";
    let body = line(&[(1.0, 1.0), (2.0, 1.0), (2.0, 3.0)])
        + &line(&[(4.0, 1.0), (4.0, 1.0)])
        + &pads(&[(8.0, 8.0), (9.0, 8.0)])
        + square
        + "%LPC*%\n"
        + &line(&[(1.0, 2.0), (3.0, 2.0)]);
    let files = [
        ("b-F_Cu.gtl".to_owned(), layer("Copper,L1,Top", &pads(&[(5.0, 5.0)]))),
        ("b-F_Silk.gto".to_owned(), layer("Legend,Top", &body)),
        ("b-B_Silk.gbo".to_owned(), layer("Legend,Bot", &line(&[(0.0, 0.0), (1.0, 0.0)]))),
    ];
    let artwork = read_set(&files, &Overrides::default());
    let wanted = super::BoardWanted { copper: true, aligned: false };
    let (board, _) = super::from_artwork_with(&artwork, &[], wanted);
    let [top, bottom] = board.legend.as_slice() else { panic!("{:?}", board.legend) };
    assert_eq!((top.face, bottom.face), (super::Face::Top, super::Face::Bottom));
    assert_eq!((top.strokes.len(), top.flashes, bottom.strokes.len()), (2, 2, 1));
    assert!((top.strokes[0].length_mm() - 3.0).abs() < 1e-9, "{:?}", top.strokes[0]);
    assert!((top.strokes[1].length_mm() - 2.0 - 2.0_f64.sqrt()).abs() < 1e-6, "{:?}", top.strokes[1]);
    assert_eq!(board.sources[top.source as usize], "b-F_Silk.gto");
    let twice = board.panelled(2, 1, crate::units::Length::from_mm(2.0));
    assert_eq!((twice.legend[0].strokes.len(), twice.legend[0].flashes), (4, 4));
}

pub(super) fn program(holes: &[(f64, f64)]) -> Vec<u8> {
    let hits: String = holes.iter().map(|(x, y)| format!("X{x:.3}Y{y:.3}\n")).collect();
    format!("M48\nMETRIC\nT1C0.800\n%\nT1\n{hits}M30\n").into_bytes()
}

/// A drill program of holes in inches, with this many digits after the point.
fn in_inches(holes: &[(f64, f64)], digits: usize) -> Vec<u8> {
    let hit = |(x, y): &(f64, f64)| format!("X{:.digits$}Y{:.digits$}\n", x / 25.4, y / 25.4);
    let hits: String = holes.iter().map(hit).collect();
    format!("M48\nINCH\nT1C0.0315\n%\nT1\n{hits}M30\n").into_bytes()
}

#[test]
fn drill_file_repeated_in_other_units_is_drilled_once() {
    let places = [(5.0, 5.0), (15.0, 12.0), (24.0, 15.0), (8.0, 9.0)];
    for digits in [3, 4] {
        let files = [
            ("b-Edge_Cuts.gm1", layer("Profile,NP", &without(&[]))),
            ("b-F_Cu.gtl", layer("Copper,L1,Top", &pads(&places))),
            ("b.drl", program(&places)),
            ("b-inch.drl", in_inches(&places, digits)),
        ];
        let files = files.map(|(name, bytes)| (name.to_owned(), bytes));
        let artwork = read_set(&files, &Overrides::default());
        let wanted = BoardWanted { copper: true, aligned: false };
        let (board, diagnostics) = from_artwork_with(&artwork, &artwork.default_use(), wanted);
        assert_eq!(board.holes.len(), places.len(), "{digits}: {diagnostics:?}");
        assert!(diagnostics.iter().any(|said| said.code == "board.holes_in_both"), "{diagnostics:?}");
    }
}

#[test]
fn second_file_of_a_layer_is_always_reported() {
    let places = [(5.0, 5.0), (15.0, 12.0), (24.0, 15.0), (8.0, 9.0)];
    let shifted = places.map(|(x, y)| (x + 1.27, y));
    let copper = |places: &[(f64, f64)]| layer("Copper,L1,Top", &pads(places));
    let renamed = String::from_utf8(copper(&places)).unwrap().replace("%FS", "G04 later*\n%FS").into_bytes();
    let edge = |lines: &str| layer("Profile,NP", lines);
    let far = [(40.0, 40.0), (50.0, 45.0), (44.0, 41.0), (60.0, 42.0)];
    let older = [&places[..], &[(20.0, 5.0), (20.0, 10.0)]].concat();
    let moved = [&places[..3], &[(20.0, 5.0)]].concat();
    // The second file, and the expected report.
    let rows = [
        ("new/b-F_Cu.gtl", copper(&shifted), Some((Severity::Error, "board.two_coppers"))),
        ("new/b-F_Cu.gtl", copper(&places), Some((Severity::Note, "board.same_copper"))),
        ("new/b-F_Cu.gtl", renamed, Some((Severity::Note, "board.same_copper"))),
        ("new/b-B_Cu.gbl", layer("Copper,L2,Bot", &pads(&shifted)), None),
        ("new/b-Edge_Cuts.gm1", edge(&without(&[])), Some((Severity::Note, "board.same_outline"))),
        ("new/b-Edge_Cuts.gm1", edge(&square(0.0, 0.0)), Some((Severity::Warning, "board.two_outlines"))),
        ("new/b.drl", program(&places), Some((Severity::Note, "board.same_drill"))),
        ("new/b.drl", program(&far), Some((Severity::Warning, "board.two_drills"))),
        ("c.drl", program(&places[1..]), Some((Severity::Error, "board.two_drills"))),
        ("b.drl.bak", program(&older), Some((Severity::Error, "board.two_drills"))),
        ("b_old.drl", program(&older), Some((Severity::Error, "board.two_drills"))),
        ("b (1).drl", program(&older), Some((Severity::Error, "board.two_drills"))),
        ("b-v2.txt", program(&moved), Some((Severity::Error, "board.two_drills"))),
        ("b-v2.txt", in_inches(&moved, 4), Some((Severity::Error, "board.two_drills"))),
        ("b_old.drl", in_inches(&older, 3), Some((Severity::Error, "board.two_drills"))),
        ("c.drl", in_inches(&older, 4), Some((Severity::Error, "board.two_drills"))),
        ("b-via.drl", in_inches(&places[1..], 4), None),
        ("b-via.drl", program(&places[1..]), None),
        ("c.drl", program(&far), None),
    ];
    for (row, (name, bytes, said)) in rows.into_iter().enumerate() {
        let first = [
            ("b-Edge_Cuts.gm1", edge(&without(&[]))),
            ("b-F_Cu.gtl", copper(&places)),
            ("b.drl", program(&places)),
        ];
        let all = first.into_iter().chain([(name, bytes)]);
        let files: Vec<_> = all.map(|(name, bytes)| (name.to_owned(), bytes)).collect();
        let artwork = read_set(&files, &Overrides::default());
        let wanted = BoardWanted { copper: true, aligned: false };
        let (board, diagnostics) = from_artwork_with(&artwork, &artwork.default_use(), wanted);
        let about =
            |diagnostic: &&Diagnostic| diagnostic.code.contains("two_") || diagnostic.code.contains("same_");
        let told: Vec<_> = diagnostics.iter().filter(about).collect();
        let found: Vec<_> =
            told.iter().map(|diagnostic| (diagnostic.severity, diagnostic.code.as_str())).collect();
        assert_eq!(found, said.into_iter().collect::<Vec<_>>(), "row {row} {diagnostics:?}");
        for diagnostic in told {
            let sentence = diagnostic.message("en");
            assert!(
                sentence.contains(name) && sentence.contains("b") && !sentence.contains('{'),
                "{sentence}"
            );
            assert!(!diagnostic.advice("en").contains(&diagnostic.code), "row {row}");
        }
        assert_eq!(board.sources[0], "b.drl");
        assert_eq!(board.copper[0].region.bounds().unwrap().min.x.mm(), 4.2, "row {row}");
    }
}

#[test]
fn outline_with_its_own_zero_is_aligned_on_request() {
    // Offset of the outline, positions of the copper, and the expected shift.
    let inside = [(2.0, 3.0), (15.0, 12.0), (27.0, 15.0)];
    let wide = [(2.0, 3.0), (40.0, 12.0)];
    let in_the_notch = [(1.5, 10.0), (15.0, 18.5), (28.5, 1.5)];
    let rows = [
        ((50.8, 25.4), &inside[..], Some((-51.3, -26.4))),
        ((-12.0, 0.0), &inside[..], Some((11.5, -1.0))),
        ((50.8, 25.4), &wide[..], None),
        ((0.0, 0.0), &inside[..], None),
        ((60.0, 0.0), &in_the_notch[..], Some((-60.0, 0.0))),
    ];
    for (row, ((dx, dy), places, by)) in rows.into_iter().enumerate() {
        let moved = SIDES.map(|side| side.map(|(x, y)| (x + dx, y + dy)));
        let lines: String = moved.iter().map(|side| line(side)).collect();
        let files = [
            ("b-Edge_Cuts.gm1", layer("Profile,NP", &lines)),
            ("b-F_Cu.gtl", layer("Copper,L1,Top", &pads(places))),
            ("b.drl", program(&places[..1])),
        ];
        let files = files.map(|(name, bytes)| (name.to_owned(), bytes));
        let artwork = read_set(&files, &Overrides::default());
        for aligned in [false, true] {
            let wanted = BoardWanted { copper: false, aligned };
            let (board, diagnostics) = from_artwork_with(&artwork, &artwork.default_use(), wanted);
            let told = |code: &str| diagnostics.iter().find(|diagnostic| diagnostic.code == code);
            let (could, done) = (told("board.outline_could_move"), told("board.outline_centred"));
            assert_eq!(could.is_some(), by.is_some() && !aligned, "row {row} {diagnostics:?}");
            assert_eq!(done.is_some(), by.is_some() && aligned, "row {row} {diagnostics:?}");
            let off = told("board.outline_elsewhere").is_some();
            assert_eq!(off, done.is_none() && (dx, dy) != (0.0, 0.0), "row {row} {diagnostics:?}");
            let low = board.outline.bounds().unwrap().min;
            let (x, y) = by.filter(|_| aligned).unwrap_or_default();
            assert!((low.x.mm() - dx - x).abs() < 1e-6 && (low.y.mm() - dy - y).abs() < 1e-6, "row {row}");
            for diagnostic in could.into_iter().chain(done) {
                let (x, y) = by.unwrap();
                let sentence = diagnostic.message("en");
                assert!(sentence.contains(&format!("{x:+.3}, {y:+.3} mm")), "{sentence}");
                assert!(!sentence.contains('{') && !diagnostic.advice("en").contains(&diagnostic.code));
            }
        }
    }
}

#[test]
fn holes_off_their_pads_are_always_a_warning() {
    let places: Vec<(f64, f64)> =
        (0..40).map(|i| (f64::from(i * 7 % 31) * 1.27, f64::from(i * i % 53) * 0.83)).collect();
    let moved: Vec<(f64, f64)> = places.iter().map(|(x, y)| (x + 7.62, y + 5.08)).collect();
    let files = [
        ("b-F_Cu.gtl".to_owned(), layer("Copper,L1,Top", &pads(&places))),
        ("b.drl".to_owned(), program(&moved)),
    ];
    let artwork = read_set(&files, &Overrides::default());
    for wanted in [BoardWanted::default(), BoardWanted { copper: true, aligned: false }] {
        let (_, diagnostics) = from_artwork_with(&artwork, &artwork.default_use(), wanted);
        let warnings = diagnostics.iter().filter(|diagnostic| diagnostic.code == "board.holes_shifted");
        assert_eq!(
            warnings.map(|warning| warning.severity).collect::<Vec<_>>(),
            [Severity::Warning],
            "{wanted:?}"
        );
    }
}

#[test]
fn board_without_drill_file_is_named_after_copper_or_outline() {
    let bottom = ("amp-bottom.gbr", "Copper,L2,Bot");
    let edge = ("amp-Edge_Cuts.gm1", "Profile,NP");
    let rows: [(&[(&str, &str)], &str); 4] = [
        (&[bottom], "amp"),
        (&[edge, bottom], "amp"),
        (&[("radio/bottom.gbr", "Copper,L2,Bot")], "radio"),
        (&[edge], "amp"),
    ];
    for (files, name) in rows {
        let files =
            files.iter().map(|(name, function)| ((*name).to_owned(), layer(function, &square(0.0, 0.0))));
        let files: Vec<_> = files.collect();
        let artwork = read_set(&files, &Overrides::default());
        assert_eq!(from_artwork(&artwork, &artwork.default_use()).0.name, name, "{files:?}");
    }
}

fn drill(places: &[(f64, f64)]) -> (String, Vec<u8>) {
    let hits: String = places.iter().map(|(x, y)| format!("X{x:.3}Y{y:.3}\n")).collect();
    ("drill.drl".to_owned(), format!("M48\nMETRIC\nT1C0.800\n%\nT1\n{hits}M30\n").into_bytes())
}

#[test]
fn unnamed_files_that_do_not_fit_together_are_an_error() {
    let here: Vec<(f64, f64)> =
        (0..20).map(|i| (f64::from(i * 7 % 19) * 2.0, f64::from(i * 5 % 17))).collect();
    let moved = |x: f64, y: f64| here.iter().map(|at| (at.0 * 1.3 + x, at.1 * 0.8 + y)).collect::<Vec<_>>();
    let away = moved(100.0, 50.0);
    let half = moved(30.0, 3.0);
    let copper = |name: &str, places: &[(f64, f64)]| (name.to_owned(), layer("Copper,L1,Top", &pads(places)));
    let nameless = |name: &str, places: &[(f64, f64)]| {
        let text = String::from_utf8(copper(name, places).1)
            .unwrap()
            .replace("%TF.FileFunction,Copper,L1,Top*%\n", "");
        (name.to_owned(), text.into_bytes())
    };
    let said = |files: &[(String, Vec<u8>)]| -> Vec<(Severity, String)> {
        let artwork = read_set(files, &Overrides::default());
        let (_, diagnostics) = from_artwork(&artwork, &artwork.default_use());
        let apart = diagnostics
            .into_iter()
            .filter(|told| told.code.ends_with("_apart") || told.code == "board.several");
        apart.map(|told| (told.severity, told.code)).collect()
    };
    let error = |code: &str| vec![(Severity::Error, code.to_owned())];
    let outline = ("outline.gbr".to_owned(), layer("Profile,NP", &square(0.0, 0.0)));
    for (files, wanted) in [
        (vec![nameless("top.gbr", &here), drill(&here)], vec![]),
        (vec![nameless("top.gbr", &here), nameless("bottom.gbr", &here), drill(&here[..15])], vec![]),
        (vec![nameless("top.gbr", &here), drill(&away)], error("board.holes_apart")),
        (vec![nameless("top.gbr", &here), drill(&half)], error("board.holes_apart")),
        (
            vec![nameless("top.gbr", &here), nameless("copper.gbr", &away), drill(&away)],
            error("board.copper_apart"),
        ),
        (
            vec![nameless("top.gbr", &here), nameless("bottom.gbr", &away), drill(&here)],
            error("board.copper_apart"),
        ),
        (vec![outline, drill(&away)], error("board.holes_apart")),
        // Three holes may belong to a fixture.
        (vec![nameless("top.gbr", &here), drill(&away[..3])], vec![]),
    ] {
        let names: Vec<&str> = files.iter().map(|file| file.0.as_str()).collect();
        assert_eq!(said(&files), wanted, "{names:?}");
    }
}

const PADS: [(f64, f64); 8] = [
    (5.0, 5.0),
    (5.0, 25.0),
    (15.0, 5.0),
    (15.0, 25.0),
    (25.0, 5.0),
    (25.0, 25.0),
    (35.0, 5.0),
    (35.0, 25.0),
];

pub(super) fn rect(x: f64, y: f64, width: f64, height: f64) -> String {
    line(&[(x, y), (x + width, y), (x + width, y + height), (x, y + height), (x, y)])
}

/// A circle of two half arcs around a position.
fn ring(x: f64, y: f64, radius: f64) -> String {
    let start = format!("X{}Y{}", mm(x + radius), mm(y));
    format!("G75*\nG03*\n{start}D02*\n{start}I{}J0D01*\nG01*\n", mm(-radius))
}

/// Bounds of the boards, in mm, and the number of cut-outs of each.
fn boxes(board: &Board) -> Vec<([f64; 4], usize)> {
    let of = |island: &crate::geometry::Island| {
        let bounds = crate::geometry::path_bounds(&island.outer);
        let box_mm = [bounds.min.x, bounds.min.y, bounds.max.x, bounds.max.y].map(|length| {
            let um = (length.mm() * 1000.0).round();
            um / 1000.0
        });
        (box_mm, island.holes.len())
    };
    let mut boxes: Vec<_> = board.outline.islands.iter().map(of).collect();
    boxes.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]).then(a.0[1].total_cmp(&b.0[1])));
    boxes
}

type Boxes = &'static [([f64; 4], usize)];

const WHOLE: Boxes = &[([0.0, 0.0, 40.0, 30.0], 0)];
const WITH_HOLE: Boxes = &[([0.0, 0.0, 40.0, 30.0], 1)];
const FOUR: Boxes = &[
    ([0.0, 0.0, 20.0, 15.0], 0),
    ([0.0, 15.0, 20.0, 30.0], 0),
    ([20.0, 0.0, 40.0, 15.0], 0),
    ([20.0, 15.0, 40.0, 30.0], 0),
];

/// Checks the boards of an outline layer, and the reported codes: name, lines, boards, codes.
fn check_boards(rows: &[(&str, String, Boxes, &[&str])]) {
    for (name, lines, wanted, codes) in rows {
        let (board, diagnostics) = read(lines, &PADS);
        assert_eq!(boxes(&board), *wanted, "{name}: {diagnostics:?}");
        let mut found: Vec<&str> = diagnostics.iter().map(|told| told.code.as_str()).collect();
        found.sort_unstable();
        assert_eq!(found, *codes, "{name}");
        assert!(diagnostics.iter().all(|told| !told.message("en").contains('{')), "{diagnostics:?}");
    }
}

#[test]
fn outline_loops_with_content_are_boards() {
    let board = rect(0.0, 0.0, 40.0, 30.0);
    check_boards(&[
        (
            "the frame of a number",
            board.clone() + &rect(18.0, -11.0, 4.0, 3.0),
            WHOLE,
            &["board.outline_frames"],
        ),
        (
            "dimension lines that begin at the corners",
            board.clone()
                + &line(&[(0.0, 0.0), (0.0, -6.0)])
                + &line(&[(40.0, 0.0), (40.0, -6.0)])
                + &line(&[(-1.0, -5.0), (41.0, -5.0)]),
            WHOLE,
            &["board.outline_part_empty", "board.outline_rest"],
        ),
        (
            "a sheet around the board",
            board.clone() + &rect(-20.0, -20.0, 100.0, 80.0),
            WHOLE,
            &["board.outline_frames"],
        ),
        ("a round cut-out", board.clone() + &ring(20.0, 15.0, 3.0), WITH_HOLE, &[]),
        (
            "a corner that was rounded afterwards",
            [
                line(&[(0.0, 0.0), (40.0, 0.0), (40.0, 30.0), (0.0, 30.0), (0.0, 0.0)]),
                format!("G75*\nG03*\nX0Y{}D02*\nX{}Y0I{}J0D01*\nG01*\n", mm(3.0), mm(3.0), mm(3.0)),
            ]
            .concat(),
            WHOLE,
            &["board.outline_part_empty"],
        ),
        (
            "a board in a round frame with its middle lines",
            ring(20.0, 15.0, 30.0) + &board + &line(&[(20.0, 40.0), (20.0, 50.0)]),
            WHOLE,
            &["board.outline_frames", "board.outline_rest"],
        ),
    ]);
}

#[test]
fn crossing_and_incomplete_corners_still_close_boards() {
    let board = rect(0.0, 0.0, 40.0, 30.0);
    check_boards(&[
        (
            "lines that cross at the corners",
            [
                line(&[(-2.0, 0.0), (43.0, 0.0)]),
                line(&[(40.0, -3.0), (40.0, 31.0)]),
                line(&[(42.0, 30.0), (-1.0, 30.0)]),
                line(&[(0.0, 33.0), (0.0, -2.0)]),
            ]
            .concat(),
            WHOLE,
            &["board.outline_rest"],
        ),
        (
            "ends that run past a corner, and a short chamfer",
            [
                line(&[(-0.3, 30.0), (40.0, 30.0)]),
                line(&[(40.0, 30.0), (40.0, 0.0), (0.0, 0.0), (0.0, 29.85), (0.15, 30.0)]),
            ]
            .concat(),
            WHOLE,
            &["board.outline_trimmed"],
        ),
        (
            "ends that fall short of a line that runs on",
            [
                line(&[(-0.3, 0.0), (40.3, 0.0)]),
                line(&[(40.0, 0.05), (40.0, 29.95)]),
                line(&[(40.3, 30.0), (-0.3, 30.0)]),
                line(&[(0.0, 29.95), (0.0, 0.05)]),
            ]
            .concat(),
            WHOLE,
            &["board.outline_mended", "board.outline_trimmed"],
        ),
        ("an edge drawn twice", board.clone() + &rect(0.1, 0.1, 39.8, 29.8), WHOLE, &[]),
        (
            "an edge drawn twice on one line",
            board.clone() + &line(&[(5.0, 0.0), (35.0, 0.0)]) + &board,
            WHOLE,
            &[],
        ),
        (
            "a cut-out with overshoots",
            board.clone()
                + &line(&[(9.8, 12.0), (20.2, 12.0)])
                + &line(&[(20.0, 11.8), (20.0, 18.2)])
                + &line(&[(20.3, 18.0), (9.9, 18.0)])
                + &line(&[(10.0, 18.3), (10.0, 11.7)]),
            WITH_HOLE,
            &["board.outline_trimmed"],
        ),
    ]);
}

#[test]
fn adjacent_loops_are_separate_boards() {
    let grid: String = [0.0, 15.0, 30.0].map(|y| line(&[(-0.3, y), (40.4, y)])).concat()
        + &[0.0, 20.0, 40.0].map(|x| line(&[(x, -0.2), (x, 30.3)])).concat();
    check_boards(&[
        ("four boards of one grid", grid, FOUR, &["board.outline_trimmed"]),
        (
            "four boards side by side",
            [
                rect(0.0, 0.0, 20.0, 15.0),
                rect(20.0, 0.0, 20.0, 15.0),
                rect(0.0, 15.0, 20.0, 15.0),
                rect(20.0, 15.0, 20.0, 15.0),
            ]
            .concat(),
            FOUR,
            &[],
        ),
    ]);
}

#[test]
fn line_crossed_by_tracks_divides_no_board() {
    let lines = rect(0.0, 0.0, 40.0, 30.0) + &line(&[(20.0, -2.0), (20.0, 32.0)]);
    let track = pads(&PADS) + &line(&[(5.0, 5.0), (35.0, 5.0)]);
    let files = |body: &str| {
        vec![
            ("b-Edge_Cuts.gm1".to_owned(), layer("Profile,NP", &lines)),
            ("b-F_Cu.gtl".to_owned(), layer("Copper,L1,Top", body)),
        ]
    };
    for (body, count) in [(track.as_str(), 1), (pads(&PADS).as_str(), 2)] {
        let (board, _) = from_artwork(&read_set(&files(body), &Overrides::default()), &[]);
        assert_eq!(board.outline.islands.len(), count);
    }
}

#[test]
fn slots_of_zero_length_are_round_holes() {
    for (length, slots) in [(0.0, 0), (0.06, 0), (0.061, 1), (1.0, 1)] {
        let text =
            format!("M48\nMETRIC\nT1C0.800\n%\nT1\nX2.0Y2.0G85X{:.3}Y2.0\nX9.0Y9.0\nM30\n", 2.0 + length);
        let artwork = read_set(&[("b.drl".to_owned(), text.into_bytes())], &Overrides::default());
        let (board, diagnostics) = from_artwork(&artwork, &artwork.default_use());
        assert_eq!((board.slots.len(), board.holes.len()), (slots, 2 - slots), "{length}");
        let told = diagnostics.iter().filter(|told| told.code == "board.slots_round").count();
        assert_eq!(told, 1 - slots, "{diagnostics:?}");
        if slots == 0 {
            assert_eq!(board.holes[0].line, 6, "holes are in the order of the file");
            assert!((board.holes[0].at.x.mm() - 2.0 - length / 2.0).abs() < 1e-6);
        }
    }
}
