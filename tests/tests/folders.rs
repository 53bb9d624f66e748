//! Folders with unclear names: which layer is copper, on which side, and what the user is asked.
//!
//! ```text
//!   copper: pads on all holes, tracks between     mask: the same pads, wider     paste: pads without holes
//! ```

use annulus_core::artwork::{Artwork, FileKind, Overrides, Role, Side, read_set};
use annulus_core::board::{Board, BoardWanted, Face, from_artwork_with};
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_tests::{data, read_folder};

mod companions;

pub(super) const HOLES: [(f64, f64); 8] = [
    (5.0, 5.0),
    (5.0, 25.0),
    (15.0, 5.0),
    (15.0, 25.0),
    (25.0, 5.0),
    (25.0, 25.0),
    (35.0, 5.0),
    (32.0, 24.0),
];
/// Pads of parts on the top, and of other parts on the bottom.
const PARTS: [[(f64, f64); 2]; 2] = [[(20.0, 10.0), (20.0, 14.0)], [(10.0, 12.0), (12.0, 12.0)]];

/// The drawing of a layer in these tests; the number is the side, 0 for the top.
#[derive(Clone, Copy)]
pub(super) enum Draws {
    Copper(usize),
    Mask(usize),
    Paste(usize),
    Silk,
    Edge,
    /// Pads on the holes, as wide as those of the copper, without tracks.
    Pads,
    Drill,
}
use Draws::{Copper, Drill, Edge, Mask, Pads, Paste, Silk};

pub(super) fn place((x, y): (f64, f64)) -> String {
    format!("X{:.0}Y{:.0}", x * 1e6, y * 1e6)
}

pub(super) fn flashes(code: u32, places: &[(f64, f64)]) -> String {
    let flashes: String = places.iter().map(|at| place(*at) + "D03*\n").collect();
    format!("D{code}*\n{flashes}")
}

pub(super) fn lines(code: u32, places: &[(f64, f64)]) -> String {
    let mut text = format!("D{code}*\n");
    for (at, corner) in places.iter().enumerate() {
        text += &format!("{}D0{}*\n", place(*corner), if at == 0 { 2 } else { 1 });
    }
    text
}

pub(super) fn text(draws: Draws) -> String {
    let body = match draws {
        Copper(side) => {
            let tracks = [[HOLES[0], HOLES[6]], [HOLES[3], HOLES[7]]];
            flashes(10, &HOLES) + &flashes(11, &PARTS[side]) + &lines(12, &tracks[side])
        }
        Mask(side) => flashes(13, &HOLES) + &flashes(14, &PARTS[side]),
        Paste(side) => flashes(15, &PARTS[side]),
        Silk => lines(16, &[(8.0, 8.0), (12.0, 8.0), (12.0, 12.0), (8.0, 8.0)]),
        Edge => lines(16, &[(0.0, 0.0), (40.0, 0.0), (40.0, 30.0), (0.0, 30.0), (0.0, 0.0)]),
        Pads => flashes(10, &HOLES),
        Drill => {
            let hits: String = HOLES.iter().map(|(x, y)| format!("X{x:.3}Y{y:.3}\n")).collect();
            return format!("M48\nMETRIC\nT1C0.800\n%\nG90\nG05\nT1\n{hits}M30\n");
        }
    };
    let apertures = "%ADD10C,2*%\n%ADD11R,1X1*%\n%ADD12C,0.5*%\n%ADD13C,2.2*%\n%ADD14R,1.2X1.2*%\n%ADD15R,0.9X0.9*%\n%ADD16C,0.15*%\n";
    format!("%FSLAX46Y46*%\n%MOMM*%\n%LPD*%\nG01*\n{apertures}{body}M02*\n")
}

pub(super) fn read(files: &[(&str, String)]) -> Artwork {
    let named: Vec<_> =
        files.iter().map(|(name, text)| ((*name).to_owned(), text.clone().into_bytes())).collect();
    read_set(&named, &Overrides::default())
}

pub(super) fn board(artwork: &Artwork) -> (Board, Vec<Diagnostic>) {
    let wanted = BoardWanted { copper: true, aligned: false };
    from_artwork_with(artwork, &artwork.default_use(), wanted)
}

/// The copper files of both sides, and the codes of errors.
pub(super) fn outcome(artwork: &Artwork) -> ([String; 2], Vec<String>) {
    let (board, mut diagnostics) = board(artwork);
    let all: Vec<usize> = (0..artwork.files.len()).collect();
    diagnostics.extend(artwork.missing(&all).cloned());
    let copper = |face: Face| {
        let copper = board.copper.iter().find(|copper| copper.face == face);
        let name = copper.map(|copper| board.sources[copper.source as usize].as_str()).unwrap_or_default();
        name.rsplit('/').next().unwrap_or_default().to_owned()
    };
    let errors = diagnostics.iter().filter(|said| said.severity == Severity::Error);
    let mut codes: Vec<String> = errors.map(|said| said.code.clone()).collect();
    codes.dedup();
    ([copper(Face::Top), copper(Face::Bottom)], codes)
}

pub(super) fn drawn(files: &[(&'static str, Draws)]) -> Vec<(&'static str, String)> {
    files.iter().map(|&(name, draws)| (name, text(draws))).collect()
}

#[test]
fn name_pairs_give_the_sides() {
    for [top, bottom, edge, drill] in [
        [
            "platine_kupfer_oben.gbr",
            "platine_kupfer_unten.gbr",
            "platine_umriss.gbr",
            "platine_bohrungen.drl",
        ],
        ["amp-Cu_F.gbr", "amp-Cu_B.gbr", "amp-Edge.gbr", "amp.drl"],
        ["plytka_gora.gbr", "plytka_dol.gbr", "plytka_obrys.gbr", "plytka.drl"],
        ["顶层.gbr", "底层.gbr", "板框.gbr", "钻孔.drl"],
        ["amp_L1.gbr", "amp_L2.gbr", "amp_edge.gbr", "amp.drl"],
        ["amp_layer_1.gbr", "amp_layer_16.gbr", "amp_edge.gbr", "amp.drl"],
        ["art001.pho", "art002.pho", "drill_outline.pho", "drl001.drl"],
        ["front.gbr", "back.gbr", "edge.gbr", "holes.drl"],
        ["amp_copperTop.gtl", "amp_copperBottom.gbl", "amp_contour.gm1", "amp_drill.txt"],
        ["carte cuivre dessus.gbr", "carte cuivre dessous.gbr", "carte contour.gbr", "carte percage.drl"],
        ["плата_верх.gbr", "плата_низ.gbr", "плата_контур.gbr", "плата.drl"],
        ["placa_cobre_superior.gbr", "placa_cobre_inferior.gbr", "placa_contorno.gbr", "placa.drl"],
        ["部品面.gbr", "半田面.gbr", "外形.gbr", "holes.drl"],
        ["amp_component.gbr", "amp_solder.gbr", "amp_edge.gbr", "amp.drl"],
        ["bottom_heater_top.gbr", "bottom_heater_bottom.gbr", "bottom_heater_edge.gbr", "bottom_heater.drl"],
        ["face_composants.gbr", "face_soudures.gbr", "contour.gbr", "percage.drl"],
        ["lato_componenti.gbr", "lato_saldature.gbr", "contorno.gbr", "fori.drl"],
        ["cara_componentes.gbr", "cara_soldadura.gbr", "borde.gbr", "taladros.drl"],
        ["amp_TCu.gbr", "amp_BCu.gbr", "amp_Outline.gbr", "amp.drl"],
        ["myboardtop.gbr", "myboardbottom.gbr", "myboardedge.gbr", "myboard.drl"],
    ] {
        let artwork = read(&drawn(&[(top, Copper(0)), (bottom, Copper(1)), (edge, Edge), (drill, Drill)]));
        assert_eq!(outcome(&artwork), ([top.to_owned(), bottom.to_owned()], vec![]), "{top}");
        assert_eq!(board(&artwork).0.outline.islands.len(), 1, "{edge}");
    }
}

#[test]
fn partial_side_information_is_combined() {
    let with = |front: &str, draws: Draws| text(draws).replacen("%LPD*%", &format!("{front}\n%LPD*%"), 1);
    let rows: [(&str, [(&str, &str); 2]); 4] = [
        ("Fritzing", [("x_copperTop.gtl", "%LNCOPPER1*%"), ("x_copperBottom.gbl", "%LNCOPPER0*%")]),
        ("X2", [("a.gbr", "%TF.FileFunction,Copper,L1*%"), ("b.gbr", "%TF.FileFunction,Copper,L2*%")]),
        (
            "X2 and names",
            [("amp_top.gbr", "%TF.FileFunction,Copper*%"), ("amp_bot.gbr", "%TF.FileFunction,Copper*%")],
        ),
        ("comments", [("a.gbr", "G04 Layer: Kupfer oben*"), ("b.gbr", "G04 Layer: Kupfer unten*")]),
    ];
    for (what, [(top, first), (bottom, second)]) in rows {
        let files = [
            (top, with(first, Copper(0))),
            (bottom, with(second, Copper(1))),
            ("edge.gbr", text(Edge)),
            ("holes.drl", text(Drill)),
        ];
        assert_eq!(outcome(&read(&files)), ([top.to_owned(), bottom.to_owned()], vec![]), "{what}");
    }
    // On a single-sided board, the bottom layer isn't the top.
    let files = [
        ("x_copperBottom.gbl", with("%LNCOPPER0*%", Copper(1))),
        ("x_contour.gm1", text(Edge)),
        ("x_drill.txt", text(Drill)),
    ];
    assert_eq!(outcome(&read(&files)), ([String::new(), "x_copperBottom.gbl".to_owned()], vec![]));
}

#[test]
fn unnamed_copper_is_used_or_questioned() {
    type Row<'r> = (&'r [(&'static str, Draws)], [&'r str; 2], &'r [&'r str]);
    let rows: [Row<'_>; 10] = [
        (&[("a.gbr", Copper(0))], ["a.gbr", ""], &["set.only_copper"]),
        (&[("kupfer.gbr", Copper(1)), ("maske_unten.gbr", Mask(1))], ["", "kupfer.gbr"], &[]),
        (&[("a.gbr", Copper(0)), ("b.gbr", Copper(1))], ["", ""], &["set.side_unknown"]),
        (
            &[
                ("a.gbr", Copper(1)),
                ("b.gbr", Copper(0)),
                ("mask_top.gbr", Mask(0)),
                ("mask_bottom.gbr", Mask(1)),
            ],
            ["b.gbr", "a.gbr"],
            &[],
        ),
        (
            &[("amp.gtl", Copper(0)), ("other.gbr", Copper(1))],
            ["amp.gtl", "other.gbr"],
            &["set.side_guessed"],
        ),
        (
            &[("amp.gtl", Copper(0)), ("amp.gbl", Copper(1)), ("z.gbr", Copper(1))],
            ["amp.gtl", "amp.gbl"],
            &["set.copper_left_out"],
        ),
        (&[("laptop.gbr", Copper(0))], ["laptop.gbr", ""], &["set.side_guessed"]),
        (&[("a.gbr", Copper(0)), ("b.gbr", Mask(0))], ["a.gbr", ""], &["set.only_copper"]),
        (&[("top_doc.gbr", Copper(0))], ["top_doc.gbr", ""], &["set.side_guessed"]),
        (&[("bottom solder.gbr", Copper(1))], ["", "bottom solder.gbr"], &["set.side_guessed"]),
    ];
    for (layers, [top, bottom], errors) in rows {
        // A comment makes the bytes of each layer different.
        let commented = |(name, text)| (name, format!("G04 {name}*\n{text}"));
        let mut files: Vec<_> = drawn(layers).into_iter().map(commented).collect();
        files.extend(drawn(&[("edge.gbr", Edge), ("amp.drl", Drill)]));
        let artwork = read(&files);
        let names: Vec<&str> = layers.iter().map(|(name, _)| *name).collect();
        assert_eq!(
            outcome(&artwork),
            ([top.to_owned(), bottom.to_owned()], errors.iter().map(|code| (*code).to_owned()).collect()),
            "{names:?}"
        );
        // Once the user has stated the roles, nothing is asked.
        let mut said = artwork;
        let mut sides = [Side::Top, Side::Bottom].into_iter();
        for (name, draws) in layers {
            let role = if matches!(draws, Copper(_)) {
                sides.next().map_or((Role::Other, None), |side| (Role::Copper, Some(side)))
            } else {
                (Role::Mask, None)
            };
            said.say_role(name, role.0, role.1);
        }
        assert_eq!(outcome(&said).1, Vec::<String>::new(), "{names:?}");
    }
}

#[test]
fn mask_named_as_copper_does_not_take_its_side() {
    let files = [("top.gbr", Mask(0)), ("layer_x.gbr", Copper(0)), ("edge.gbr", Edge), ("amp.drl", Drill)];
    let artwork = read(&drawn(&files));
    assert_eq!(outcome(&artwork), (["layer_x.gbr".to_owned(), String::new()], vec![]));
    assert_eq!(artwork.files[0].role, Role::Mask);
}

#[test]
fn inner_copper_alone_is_an_error() {
    let files = [
        ("amp.group1.gbr", Copper(0)),
        ("amp.group2.gbr", Copper(1)),
        ("edge.gbr", Edge),
        ("amp.drl", Drill),
    ];
    let (copper, errors) = outcome(&read(&drawn(&files)));
    assert_eq!(copper, [String::new(), String::new()]);
    assert_eq!(errors, ["board.inner_copper"]);
}

#[test]
fn shapes_distinguish_masks_and_paste_from_copper() {
    type Row<'r> = (&'r [(&'static str, Draws)], [&'r str; 2]);
    let rows: [Row<'_>; 6] = [
        (
            &[("a_top.gbr", Mask(0)), ("b_top.gbr", Paste(0)), ("c_top.gbr", Copper(0)), ("d_top.gbr", Silk)],
            ["c_top.gbr", ""],
        ),
        (&[("Top.gbr", Mask(0)), ("top_signal.gbr", Copper(0))], ["top_signal.gbr", ""]),
        (&[("x_top.gbr", Pads), ("y_top.gbr", Mask(0))], ["x_top.gbr", ""]),
        (
            &[
                ("TOP.art", Copper(0)),
                ("ST_TOP.art", Mask(0)),
                ("PT_TOP.art", Paste(0)),
                ("BOTTOM.art", Copper(1)),
                ("ST_BOT.art", Mask(1)),
            ],
            ["TOP.art", "BOTTOM.art"],
        ),
        (
            &[
                ("TOP LAYER.gbr", Copper(0)),
                ("TOP SOLDER LAYER.gbr", Mask(0)),
                ("TOP PASTER LAYER.gbr", Paste(0)),
            ],
            ["TOP LAYER.gbr", ""],
        ),
        (&[("amp_TOP.gbr", Copper(0)), ("amp_TOP_DOC_ASSY.gbr", Copper(0))], ["amp_TOP.gbr", ""]),
    ];
    for (layers, [top, bottom]) in rows {
        let mut files = drawn(layers);
        files.extend(drawn(&[("outline.gbr", Edge), ("amp.drl", Drill)]));
        let artwork = read(&files);
        let names: Vec<&str> = layers.iter().map(|(name, _)| *name).collect();
        assert_eq!(outcome(&artwork), ([top.to_owned(), bottom.to_owned()], vec![]), "{names:?}");
        for (file, (_, draws)) in artwork.files.iter().zip(layers) {
            let fits = match draws {
                Mask(_) => file.role == Role::Mask,
                Paste(_) => file.role == Role::Paste,
                _ => true,
            };
            assert!(fits, "{}: {:?}", file.name, file.role);
        }
    }
}

#[test]
fn companion_files_block_no_board() {
    let rows: &[(&str, &[u8])] = &[
        ("amp.APR_LIB", b"%FILE amp*%\nD10 ROUNDED 10.0 10.0 0.0 FLASH 0*\n%ADD10C,0.01*%\n"),
        ("amp.lst", b"Drill Listing\n\nTool  Size   Qty\nT01   0.032  8\n"),
        (
            "iso_cnc.nc",
            b"(FlatCAM)\nG20\nG90\nG01 F3.0\nG00 Z0.1\nM03 S1000\nG00 X0.2Y0.2\nG01 Z-0.002\nM05\n",
        ),
        ("drill.tap", b"G21\nG90\nM3 S1000\nG0 Z5\nG0 X5 Y5\nG1 Z-2 F100\nM5\nM30\n"),
        ("amp-bom.csv", b"Ref,Value\nR1,10k\nC1,100n\n"),
        ("bom.csv", b"Reference;Value;Qty\n1;100;2\n2;220;1\n"),
        (
            "gerber_job.gbrjob",
            b"G04 Gerber job file.*\n%TF.FileFunction,JobInfo*%\n%MOMM*%\n%TJ.B_ID,amp*%\nM02*\n",
        ),
        ("notes.txt", b""),
        ("README.TXT", b"<p>hello"),
        ("amp.lib", &[0, 1, 2, 200, 201, 3, 0, 0]),
        ("laser.gc", b"G21\nG90\nM4 S0\nG0X1Y1\nG1X2Y2S100F1000\nM5\n"),
    ];
    for (name, bytes) in rows {
        let mut files: Vec<_> = drawn(&[("amp.gtl", Copper(0)), ("amp.gko", Edge), ("amp.drl", Drill)])
            .into_iter()
            .map(|(name, text)| (name.to_owned(), text.into_bytes()))
            .collect();
        files.push(((*name).to_owned(), bytes.to_vec()));
        let artwork = read_set(&files, &Overrides::default());
        assert_eq!(outcome(&artwork), (["amp.gtl".to_owned(), String::new()], vec![]), "{name}");
        assert_eq!(board(&artwork).0.holes.len(), HOLES.len(), "{name}");
    }
}

#[test]
fn drill_name_without_drill_content_is_an_error() {
    for (name, kind, code) in [
        ("amp.drl", FileKind::Unknown, "drill.not_recognised"),
        ("amp-F_Cu.gbr", FileKind::Refused, "gerber.not_recognised"),
    ] {
        let artwork = read(&[(name, "G21\nG90\nM3 S1000\nG0 Z5\nG1 Z-2 F100\nM5\n".to_owned())]);
        assert_eq!((artwork.files[0].kind, outcome(&artwork).1), (kind, vec![code.to_owned()]), "{name}");
    }
}

#[test]
fn binary_drill_file_with_a_text_twin_is_no_error() {
    let mut files: Vec<_> = drawn(&[("amp.GTL", Copper(0)), ("amp-RoundHoles.TXT", Drill)])
        .into_iter()
        .map(|(name, text)| (name.to_owned(), text.into_bytes()))
        .collect();
    files.push(("amp.DRL".to_owned(), [0, 1, 2, 200, 201, 3].repeat(60)));
    assert_eq!(outcome(&read_set(&files, &Overrides::default())).1, Vec::<String>::new());
    files.retain(|(name, _)| name != "amp-RoundHoles.TXT");
    assert_eq!(outcome(&read_set(&files, &Overrides::default())).1, ["refused.binary"]);
}

#[test]
fn excluded_board_blocks_nothing() {
    let mut files = drawn(&[("a/a.gtl", Copper(0)), ("a/a.drl", Drill), ("b/b.gtl", Copper(1))]);
    files.push(("b/x.gbr", "junk".to_owned()));
    let mut artwork = read(&files);
    assert!(outcome(&artwork).1.contains(&"gerber.not_recognised".to_owned()));
    artwork.leave_out(&[2]);
    assert_eq!(outcome(&artwork), (["a.gtl".to_owned(), String::new()], vec![]));
}

#[test]
fn blind_holes_are_an_error() {
    let blind = text(Drill).replacen("METRIC", "; #@! TF.FileFunction,Plated,1,2,Blind\nMETRIC", 1);
    let artwork = read(&[("amp.gtl", text(Copper(0))), ("amp.drl", blind)]);
    assert_eq!(outcome(&artwork).1, ["drill.holes_not_through"]);
}

#[test]
fn sample_folders_give_their_boards() {
    let rows: [(&str, [&str; 2], usize, &str); 6] = [
        ("easyeda-pro-vias-twice", ["Gerber_TopLayer.GTL", ""], 6, "board"),
        ("drill-map-gerber", ["board-F_Cu.gbr", ""], 8, "board"),
        ("allegro-film-names", ["TOP.art", "BOTTOM.art"], 8, "board"),
        ("eagle-gerber-job", ["copper_top.gbr", ""], 8, "board"),
        ("own-output-in-folder", ["board-F_Cu.gbr", ""], 8, "board"),
        ("gerber-names-unknown", ["front.gbr", "back.gbr"], 8, "board"),
    ];
    for (name, [top, bottom], holes, called) in rows {
        let artwork = read_folder(&data().join("folders").join(name));
        assert_eq!(outcome(&artwork), ([top.to_owned(), bottom.to_owned()], vec![]), "{name}");
        let (board, diagnostics) = board(&artwork);
        assert_eq!(board.holes.len(), holes, "{name}");
        assert!(diagnostics.iter().all(|said| said.code != "board.two_drills"), "{name}");
        let all: Vec<usize> = (0..artwork.files.len()).collect();
        let names: Vec<String> = artwork.boards(&all).into_iter().map(|(name, _)| name).collect();
        assert_eq!(names, [called], "{name}");
    }
}
