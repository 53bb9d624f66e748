//! Layers with unclear or wrong names: the drawing decides, or the user.

use super::folders::Draws::{Copper, Drill, Edge, Mask, Pads, Paste, Silk};
use super::folders::{Draws, board, drawn, outcome, read, text};
use annulus_core::artwork::{Role, Side};
use annulus_core::diagnostic::Severity;

type Layers<'r> = &'r [(&'static str, Draws)];

/// Reads layers with an outline and holes, and checks which of them are copper and which errors are reported.
fn check(layers: Layers<'_>, copper: [&str; 2], errors: &[&str]) {
    let mut files = drawn(layers);
    files.extend(drawn(&[("contour.gbr", Edge), ("amp.drl", Drill)]));
    let names: Vec<&str> = layers.iter().map(|(name, _)| *name).collect();
    let errors = errors.iter().map(|code| (*code).to_owned()).collect();
    assert_eq!(outcome(&read(&files)), (copper.map(str::to_owned), errors), "{names:?}");
}

#[test]
fn only_copper_gets_a_side_from_its_number() {
    let rows: [(Layers<'_>, [&str; 2]); 7] = [
        (
            &[
                ("amp_layer1.gbr", Mask(0)),
                ("amp_layer2.gbr", Copper(0)),
                ("amp_layer3.gbr", Copper(1)),
                ("amp_layer4.gbr", Mask(1)),
            ],
            ["amp_layer2.gbr", "amp_layer3.gbr"],
        ),
        (
            &[("psu_L1.gbr", Copper(0)), ("psu_L2.gbr", Copper(1)), ("psu_L3.gbr", Mask(1))],
            ["psu_L1.gbr", "psu_L2.gbr"],
        ),
        (
            &[("psu_L1.gbr", Copper(0)), ("psu_L2.gbr", Mask(0)), ("psu_L3.gbr", Copper(1))],
            ["psu_L1.gbr", "psu_L3.gbr"],
        ),
        (
            &[("art001.pho", Copper(0)), ("art002.pho", Copper(1)), ("art003.pho", Paste(0))],
            ["art001.pho", "art002.pho"],
        ),
        (
            &[("art001.pho", Paste(0)), ("art002.pho", Copper(0)), ("art003.pho", Copper(1))],
            ["art002.pho", "art003.pho"],
        ),
        (
            &[("layer1.gbr", Copper(0)), ("layer2.gbr", Copper(1)), ("layer3.gbr", Edge)],
            ["layer1.gbr", "layer2.gbr"],
        ),
        (
            &[
                ("layer0.gbr", Mask(0)),
                ("layer1.gbr", Copper(0)),
                ("layer2.gbr", Copper(1)),
                ("layer3.gbr", Edge),
            ],
            ["layer1.gbr", "layer2.gbr"],
        ),
    ];
    for (layers, copper) in rows {
        check(layers, copper, &[]);
    }
    // Silkscreen can look like copper of an odd shape, so the user decides.
    check(
        &[("psu_L1.gbr", Copper(0)), ("psu_L2.gbr", Copper(1)), ("psu_L3.gbr", Silk)],
        ["psu_L1.gbr", "psu_L2.gbr"],
        &["set.copper_left_out"],
    );
}

#[test]
fn numbered_outline_needs_no_other_name() {
    let files =
        [("layer1.gbr", Copper(0)), ("layer2.gbr", Copper(1)), ("layer3.gbr", Edge), ("x.drl", Drill)];
    let artwork = read(&drawn(&files));
    assert_eq!(artwork.files[2].role, Role::Outline);
    assert_eq!(outcome(&artwork), (["layer1.gbr".to_owned(), "layer2.gbr".to_owned()], vec![]));
}

#[test]
fn pads_without_tracks_are_an_error() {
    let rows: [(Layers<'_>, [&str; 2], &[&str]); 5] = [
        (
            &[("h_top.gbr", Copper(0)), ("n_bottom.gbr", Mask(1))],
            ["h_top.gbr", ""],
            &["set.drawn_as_opening"],
        ),
        (
            &[("h_top.gbr", Copper(0)), ("n_bottom.gbr", Paste(0))],
            ["h_top.gbr", ""],
            &["set.drawn_as_opening"],
        ),
        (
            &[("h_top.gbr", Mask(0)), ("n_bottom.gbr", Copper(1))],
            ["", "n_bottom.gbr"],
            &["set.drawn_as_opening"],
        ),
        (
            &[("h_top.gbr", Copper(0)), ("n_bottom.gbr", Pads)],
            ["h_top.gbr", "n_bottom.gbr"],
            &["set.pads_alone"],
        ),
        (&[("amp.gtl", Copper(0)), ("amp_bot.gbr", Pads)], ["amp.gtl", "amp_bot.gbr"], &["set.pads_alone"]),
    ];
    for (layers, copper, errors) in rows {
        check(layers, copper, errors);
    }
}

#[test]
fn chosen_role_overrides_every_guess() {
    let files = [
        ("board_bottom.gbr", Copper(0)),
        ("board_etch.gbr", Copper(1)),
        ("edge.gbr", Edge),
        ("b.drl", Drill),
    ];
    let mut artwork = read(&drawn(&files));
    artwork.say_role("board_etch.gbr", Role::Copper, Some(Side::Bottom));
    assert_eq!(outcome(&artwork), ([String::new(), "board_etch.gbr".to_owned()], vec![]));
    // Two layers that the user chose for one side are still an error.
    artwork.say_role("board_bottom.gbr", Role::Copper, Some(Side::Bottom));
    assert_eq!(outcome(&artwork).1, ["board.two_coppers"]);
}

#[test]
fn copper_with_another_name_is_an_error() {
    let with = |front: &str, draws: Draws| text(draws).replacen("%LPD*%", &format!("{front}\n%LPD*%"), 1);
    for (name, front) in [
        ("component side paste-up.gbr", ""),
        ("top_placement.gbr", ""),
        ("TopSilkscreenSideCopper.gbr", ""),
        ("x.gbr", "%LNSilkscreen Top*%"),
        ("amp_top_mask.gbr", ""),
        ("amp.gto", ""),
        ("amp.gm4", ""),
    ] {
        let files = [
            (name, with(front, Copper(0))),
            ("amp.gbl", text(Copper(1))),
            ("edge.gbr", text(Edge)),
            ("amp.drl", text(Drill)),
        ];
        let expected = ([String::new(), "amp.gbl".to_owned()], vec!["set.copper_left_out".to_owned()]);
        assert_eq!(outcome(&read(&files)), expected, "{name}");
    }
}

#[test]
fn pads_on_holes_give_no_side() {
    let holes_only =
        text(Mask(1)).lines().filter(|line| !line.starts_with("D14")).collect::<Vec<_>>().join("\n");
    let at = holes_only.find("X10000000Y12000000D03").unwrap();
    let holes_only = format!("{}M02*\n", &holes_only[..at]);
    let files = [
        ("tracks.gbr", text(Copper(1))),
        ("mask_top.gbr", holes_only),
        ("edge.gbr", text(Edge)),
        ("amp.drl", text(Drill)),
    ];
    assert_eq!(outcome(&read(&files)).1, ["set.only_copper"]);
    check(&[("tracks.gbr", Copper(1)), ("mask_bottom.gbr", Mask(1))], ["", "tracks.gbr"], &[]);
}

#[test]
fn names_of_both_sides_are_an_error() {
    let with = |front: &str| text(Copper(0)).replacen("%LPD*%", &format!("{front}\n%LPD*%"), 1);
    let rows = [
        ("amp.gtl", "%LNBottom Copper*%", true),
        ("amp.gbl", "%LNTop Copper*%", true),
        ("top.gbr", "%LNL2*%", true),
        ("amp_bottom.gbr", "%LNTop Layer*%", true),
        ("amp_top.gbr", "%TF.FileFunction,Copper,L2,Bot*%", true),
        ("amp.gtl", "%LNTop Copper*%", false),
        ("bottom.gbr", "%LNL4*%", false),
        ("top.gbr", "%LNL1*%", false),
        ("x_copperTop.gtl", "%LNCOPPER1*%", false),
        ("layer0_top.gbr", "", false),
        ("top.gbr", "%LNlayer0*%", false),
        ("bottom.gbr", "%LNlayer0*%", false),
    ];
    for (name, front, is_asked) in rows {
        let files = [(name, with(front)), ("edge.gbr", text(Edge)), ("amp.drl", text(Drill))];
        let (_, errors) = outcome(&read(&files));
        assert_eq!(errors.contains(&"set.side_disputed".to_owned()), is_asked, "{name} {front}: {errors:?}");
    }
}

#[test]
fn layers_numbered_from_zero_give_no_side_conflict() {
    let with =
        |side: usize, name: &str| text(Copper(side)).replacen("%LPD*%", &format!("%LN{name}*%\n%LPD*%"), 1);
    for [first, second] in [["layer0", "layer1"], ["L0", "L1"]] {
        let files = [
            ("top.gbr", with(0, first)),
            ("bottom.gbr", with(1, second)),
            ("edge.gbr", text(Edge)),
            ("amp.drl", text(Drill)),
        ];
        let wanted = (["top.gbr", "bottom.gbr"].map(str::to_owned), vec![]);
        assert_eq!(outcome(&read(&files)), wanted, "{first}");
    }
}

#[test]
fn silkscreen_named_copper_is_an_error_about_holes() {
    check(
        &[("h_top.gbr", Copper(0)), ("n_bottom.gbr", Silk)],
        ["h_top.gbr", "n_bottom.gbr"],
        &["set.misses_holes"],
    );
}

#[test]
fn openings_named_as_copper_by_a_cad_are_questioned() {
    for (draws, errors) in [
        (Mask(0), vec!["set.pads_alone"]),
        (Paste(0), vec!["set.pads_alone"]),
        (Pads, vec![]),
        (Copper(1), vec![]),
    ] {
        check(&[("amp.gtl", Copper(0)), ("amp.gbl", draws)], ["amp.gtl", "amp.gbl"], &errors);
    }
    check(&[("amp.gtl", Mask(1)), ("amp.gbl", Copper(1))], ["amp.gtl", "amp.gbl"], &["set.pads_alone"]);
}

#[test]
fn folders_give_the_sides_of_their_layers() {
    let files = [
        ("in/top/copper.gbr", Copper(0)),
        ("in/bottom/copper.gbr", Copper(1)),
        ("in/board/edge.gbr", Edge),
        ("in/board/amp.drl", Drill),
    ];
    let artwork = read(&drawn(&files));
    let sides: Vec<Option<Side>> = artwork.files.iter().map(|file| file.side).collect();
    assert_eq!(sides, [Some(Side::Top), Some(Side::Bottom), None, None]);
    // A folder name counts only if there are other folders.
    let alone = [("bottom/copper.gbr", Copper(0)), ("bottom/edge.gbr", Edge), ("bottom/amp.drl", Drill)];
    assert_eq!(outcome(&read(&drawn(&alone))).1, ["set.only_copper"]);
}

#[test]
fn questions_name_files_by_distinct_paths() {
    let files = [("in/a/copper.gbr", Copper(0)), ("in/b/copper.gbr", Copper(1)), ("in/a.drl", Drill)];
    let artwork = read(&drawn(&files));
    let asked = artwork.files.iter().flat_map(|file| &file.diagnostics);
    let files: Vec<&str> = asked.filter_map(|said| said.argument(&["file"])).collect();
    assert_eq!(files, ["a/copper.gbr", "b/copper.gbr"]);
}

#[test]
fn decomposed_accents_are_recognised() {
    let copper = ["Bestu\u{308}ckungsseite.gbr", "Lo\u{308}tseite.gbr"];
    check(&[(copper[1], Copper(1)), (copper[0], Copper(0))], copper, &[]);
}

#[test]
fn mirrored_copper_is_an_error() {
    let mirrored = |draws: Draws| {
        let turn = |line: &str| match line.strip_prefix('X').and_then(|line| line.split_once('Y')) {
            Some((x, rest)) => format!("X{}Y{rest}", 40_000_000 - x.parse::<i64>().unwrap()),
            None => line.to_owned(),
        };
        text(draws).lines().map(turn).collect::<Vec<_>>().join("\n")
    };
    let rows = [
        (vec![("amp.gbl", mirrored(Copper(1)))], "drill.mirrored"),
        (vec![("amp.gbl", mirrored(Copper(1))), ("amp.gtl", text(Copper(0)))], "drill.layer_mirrored"),
        (vec![("amp.gtl", mirrored(Copper(0))), ("amp.gbl", text(Copper(1)))], "drill.layer_mirrored"),
        (vec![("amp.gbl", mirrored(Copper(1))), ("amp.gtl", mirrored(Copper(0)))], "drill.mirrored"),
    ];
    for (mut files, code) in rows {
        files.extend([("amp.gko", text(Edge)), ("amp.drl", text(Drill))]);
        assert_eq!(errors_of_all(&files), [code]);
    }
}

/// The codes of all errors of files.
fn errors_of_all(files: &[(&str, String)]) -> Vec<String> {
    let artwork = read(files);
    let all = artwork.files.iter().flat_map(|file| &file.diagnostics);
    all.filter(|said| said.severity == Severity::Error).map(|said| said.code.clone()).collect()
}

#[test]
fn few_holes_off_all_pads_are_a_warning() {
    let hits = "X6.1Y5.7\nX6.6Y9.2\nX14.2Y22.1\nX28.3Y7.9\nX33.3Y26.4\nX18.8Y4.1\n";
    let drill = format!("M48\nMETRIC\nT1C0.800\n%\nG90\nG05\nT1\n{hits}M30\n");
    let files = [("amp.gtl", text(Copper(0))), ("amp.gko", text(Edge)), ("amp.drl", drill)];
    let artwork = read(&files);
    let codes: Vec<&str> = artwork.files[2].diagnostics.iter().map(|said| said.code.as_str()).collect();
    assert!(codes.contains(&"drill.beside_copper"), "{codes:?}");
}

#[test]
fn copper_named_for_holes_or_edge_is_not_lost() {
    for name in ["bottom_drill.gbr", "holes_bottom.gbr", "rework_outline.gbr", "bottom_border.gbr"] {
        check(
            &[("amp_top.gbr", Copper(0)), (name, Copper(1))],
            ["amp_top.gbr", ""],
            &["set.copper_left_out"],
        );
    }
}

#[test]
fn highest_number_is_inner_beside_a_named_bottom() {
    let errors = &[];
    let layers = [("TOP.art", Copper(0)), ("L2.art", Pads), ("L3.art", Pads), ("BOTTOM.art", Copper(1))];
    check(&layers, ["TOP.art", "BOTTOM.art"], errors);
}

#[test]
fn inner_copper_beside_one_side_is_an_error() {
    for name in ["gnd.gbr", "ground_plane.gbr"] {
        let layers = [("amp_top.gbr", Copper(0)), (name, Copper(1))];
        check(&layers, ["amp_top.gbr", ""], &["board.inner_copper"]);
    }
}

#[test]
fn errors_of_the_outline_layer_are_errors_of_the_board() {
    let cut_out = "D77*\nX10000000Y10000000D02*\nX12000000Y10000000D01*\nX12000000Y12000000D01*\nX10000000Y10000000D01*\nM02*";
    let edge = text(Edge).replace("M02*", cut_out);
    let files = [("amp.gtl", text(Copper(0))), ("amp.gko", edge), ("amp.drl", text(Drill))];
    let errors = outcome(&read(&files)).1;
    assert!(errors.iter().any(|code| code == "gerber.aperture_undefined"), "{errors:?}");
}

#[test]
fn holes_to_an_inner_layer_are_reported() {
    let drill =
        |span: &str| text(Drill).replacen("M48\n", &format!("M48\n; #@! TF.FileFunction,{span},PTH\n"), 1);
    let layers = [("amp.gtl", text(Copper(0))), ("amp.gbl", text(Copper(1))), ("amp.gko", text(Edge))];
    let spans = [("amp-1.drl", drill("Plated,1,4")), ("amp-2.drl", drill("Plated,1,2"))];
    let report = "Layer Pair : Top Layer to Bottom Layer\nASCII RoundHoles File : amp.TXT\nT1 0.8mm (31.496mil) Round 8 PTH\n\
        Layer Pair : Top Layer to Mid-Layer 1\nASCII RoundHoles File : amp.TX1\nT1 0.8mm (31.496mil) Round 8 PTH\n";
    let report = format!("NCDrill File Report For: amp.PcbDoc\n{report}");
    let pairs = [("amp.TXT", text(Drill)), ("amp.TX1", text(Drill)), ("amp.DRR", report)];
    for (drills, blind) in [(&spans[..], "amp-2.drl"), (&pairs[..], "amp.TX1")] {
        let artwork = read(&[&layers[..], drills].concat());
        let files = artwork.files.iter();
        let told =
            files.filter(|file| file.diagnostics.iter().any(|said| said.code == "drill.holes_not_through"));
        assert_eq!(told.map(|file| file.name.as_str()).collect::<Vec<_>>(), [blind]);
    }
}

#[test]
fn bottom_of_another_board_leaves_the_last_number_its_side() {
    let layers = [
        ("amp_top.gbr", Copper(0)),
        ("amp_bottom.gbr", Copper(1)),
        ("psu_L1.gbr", Copper(0)),
        ("psu_L2.gbr", Copper(1)),
    ];
    let more = [("amp_edge.gbr", Edge), ("psu_edge.gbr", Edge), ("amp.drl", Drill), ("psu.drl", Drill)];
    let artwork = read(&drawn(&[&layers[..], &more[..]].concat()));
    let side = |name: &str| artwork.files.iter().find(|file| file.name == name).and_then(|file| file.side);
    assert_eq!([side("psu_L1.gbr"), side("psu_L2.gbr")], [Some(Side::Top), Some(Side::Bottom)]);
}

#[test]
fn inner_copper_that_a_person_named_is_no_error() {
    let files =
        drawn(&[("amp_top.gbr", Copper(0)), ("gnd.gbr", Copper(1)), ("edge.gbr", Edge), ("amp.drl", Drill)]);
    let mut artwork = read(&files);
    artwork.say_role("gnd.gbr", Role::Copper, Some(Side::Inner));
    assert_eq!(outcome(&artwork), (["amp_top.gbr".to_owned(), String::new()], vec![]));
}

#[test]
fn errors_of_an_unused_outline_are_warnings() {
    let open = text(Edge)
        .replace("M02*", "D77*\nX1000000Y1000000D02*\nX2000000Y1000000D01*\nM02*")
        .replace("X0Y30000000D01*\nX0Y0D01*\n", "");
    let files =
        [("amp.gtl", text(Copper(0))), ("amp.gko", open), ("amp.gm1", text(Edge)), ("amp.drl", text(Drill))];
    let said = board(&read(&files)).1;
    assert!(said.iter().any(|said| said.code == "gerber.aperture_undefined"));
    assert!(said.iter().all(|said| said.severity != Severity::Error), "{said:?}");
}
