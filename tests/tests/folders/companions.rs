//! Files next to a board: drill layers, files of operating systems, copies, archives, saved projects,
//! programs by Annulus.

use super::Draws::{Copper, Drill, Edge, Pads};
use super::{Draws, HOLES, board, drawn, outcome, place, read, text};
use annulus_core::artwork::{Artwork, OURS, Overrides, PROJECT_HEAD, packed, read_set};
use annulus_core::diagnostic::Severity;

#[test]
fn drill_span_shorter_than_the_board_is_an_error() {
    let copper =
        |function: &str, side: usize| format!("%TF.FileFunction,{function}*%\n{}", text(Copper(side)));
    let drill = |function: &str| {
        text(Drill).replacen("METRIC", &format!("; #@! TF.FileFunction,{function}\nMETRIC"), 1)
    };
    for (function, bottom, is_short) in [
        ("Plated,1,4,PTH", "Copper,L4,Bot", false),
        ("Plated,4,1,PTH", "Copper,L4,Bot", false),
        ("Plated,2,3,PTH", "Copper,L4,Bot", true),
        ("Plated,1,2,PTH", "Copper,L4,Bot", true),
        ("NonPlated,1,2,NPTH", "Copper,L4,Bot", true),
        ("MixedPlating,1,3", "Copper,L4,Bot", true),
        ("Plated,1,2,PTH", "Copper,L2,Bot", false),
        ("Plated,1,4,PTH", "Copper,L2,Bot", false),
    ] {
        let top = ("amp.gtl", copper("Copper,L1,Top", 0));
        let bottom = ("amp.gbl", copper(bottom, 1));
        let artwork = read(&[top.clone(), bottom.clone(), ("amp.drl", drill(function))]);
        let want: &[&str] = if is_short { &["drill.holes_not_through"] } else { &[] };
        assert_eq!(outcome(&artwork).1, want, "{function}");
        // A layer with mixed plating is not recognised as a drill layer.
        let function = function.replace("MixedPlating", "Plated");
        let layer = format!("%TF.FileFunction,{function},Drill*%\n{}", text(Pads));
        let artwork = read(&[top, bottom, ("amp-drl.gbr", layer)]);
        assert_eq!(outcome(&artwork).1, want, "{function} as a layer");
    }
}

#[test]
fn holes_only_in_a_drill_layer_are_an_error() {
    let hole = |x: f64, y: f64| place((x, y)) + "D03*\n";
    let layer = |function: &str, holes: &str| {
        format!(
            "%TF.FileFunction,{function},Drill*%\n%FSLAX46Y46*%\n%MOMM*%\n%ADD10C,3.2*%\nD10*\n{holes}M02*\n"
        )
    };
    let same: String = HOLES.iter().map(|(x, y)| hole(x + 0.01, *y)).collect();
    let away: String = HOLES.iter().map(|(x, y)| hole(*x, y + 0.2)).collect();
    for (row, (function, holes, count)) in [
        ("Plated,1,2,PTH", same.clone(), None),
        ("Plated,1,2,PTH", hole(HOLES[2].0, HOLES[2].1), None),
        ("NonPlated,1,2,NPTH", hole(24.0, 12.0), Some("1")),
        ("Plated,1,2,Blind", same + &hole(24.0, 12.0) + &hole(25.0, 12.0), Some("2")),
        ("Plated,1,2,PTH", away, Some("8")),
    ]
    .into_iter()
    .enumerate()
    {
        let files = [
            ("amp.gtl", text(Copper(0))),
            ("amp-PTH.drl", text(Drill)),
            ("amp-more-drl.gbr", layer(function, &holes)),
        ];
        let artwork = read(&files);
        let said = board(&artwork).1;
        let said = said.iter().find(|said| said.code == "board.holes_in_layer_only");
        assert_eq!(said.and_then(|said| said.argument(&["count"])), count, "row {row}");
        assert!(said.is_none_or(|said| said.severity == Severity::Error), "row {row}");
    }
}

/// A board with more files next to it.
fn beside(more: &[(&str, Vec<u8>)]) -> Artwork {
    let board =
        drawn(&[("b/b.GTL", Copper(0)), ("b/b.GBL", Copper(1)), ("b/b.GKO", Edge), ("b/b.TXT", Drill)]);
    let more = more.iter().map(|(name, bytes)| ((*name).to_owned(), bytes.clone()));
    let files = board.into_iter().map(|(name, text)| (name.to_owned(), text.into_bytes())).chain(more);
    read_set(&files.collect::<Vec<_>>(), &Overrides::default())
}

/// A zip of one file that is marked as encrypted.
fn encrypted(name: &str) -> Vec<u8> {
    let mut zip = packed(&[(name.to_owned(), b"hello".to_vec())]).unwrap();
    let heads: Vec<usize> = (0..zip.len() - 4)
        .filter_map(|at| match zip.get(at..at + 4)? {
            b"PK\x03\x04" => Some(at + 6),
            b"PK\x01\x02" => Some(at + 8),
            _ => None,
        })
        .collect();
    heads.into_iter().for_each(|at| zip[at] |= 1);
    zip
}

#[test]
fn stray_files_copies_and_archives_block_no_board() {
    let double = [&[0, 5, 0x16, 7, 0, 2, 0, 0][..], &[7; 134]].concat();
    let layer = |draws: Draws| text(draws).into_bytes();
    let ours = |body: &str| {
        let head = format!("M48\n{OURS}\nFMAT,2\nMETRIC\n");
        text(Drill).replacen("M48\nMETRIC\n", &head, 1).replacen("M30\n", body, 1).into_bytes()
    };
    let project = packed(&[
        (PROJECT_HEAD.to_owned(), b"{}".to_vec()),
        ("files/b.GTL".to_owned(), layer(Pads)),
        ("files/b.TXT".to_owned(), layer(Drill)),
    ])
    .unwrap();
    for (name, bytes, want) in [
        ("b/._b.GTL", double.clone(), None),
        ("b/__MACOSX/._b.TXT", double, None),
        ("b/Thumbs.db", vec![0xD0, 0xCF, 0x11, 0xE0, 0, 1, 2], None),
        ("b/b.GTL~", layer(Copper(0)), None),
        ("b/b.GBL.bak", layer(Copper(1)), None),
        ("b/b.TXT.bak", layer(Drill), None),
        ("b/libs.zip", encrypted("sym.lib"), None),
        ("b/libs.zip", encrypted("b.GTL"), None),
        ("b/libs.zip", encrypted("b.GBS"), Some("archive.encrypted")),
        ("b/libs.zip", b"PK\x03\x04 cut".to_vec(), None),
        ("b/drill.xlsx", b"PK\x03\x04 cut".to_vec(), None),
        ("b/out/b.project", project.clone(), None),
        ("b.project", project.clone(), None),
        ("b/out/b-top.drl", ours("M30\n"), None),
        ("b/b-plan.drl", ours("G00X0.000Y0.000\nM15\nG01X40.000Y0.000\nM16\nM30\n"), None),
    ] {
        let artwork = beside(&[(name, bytes.clone())]);
        let (copper, codes) = outcome(&artwork);
        assert_eq!(copper, ["b.GTL", "b.GBL"].map(str::to_owned), "{name}");
        assert_eq!(codes, want.map(str::to_owned).into_iter().collect::<Vec<_>>(), "{name}");
        let drilled = board(&artwork).0;
        assert_eq!((drilled.holes.len(), drilled.slots.len()), (HOLES.len(), 0), "{name}");
        let all: Vec<usize> = (0..artwork.files.len()).collect();
        let said: Vec<_> = artwork.missing(&all).filter(|said| said.code.starts_with("archive.")).collect();
        assert_eq!(said.len(), usize::from(name.ends_with("zip") || name.ends_with("xlsx")), "{name}");
    }
    let alone = |name: &str, bytes: Vec<u8>| read_set(&[(name.to_owned(), bytes)], &Overrides::default());
    assert_eq!(outcome(&alone("libs.zip", encrypted("sym.lib"))).1, ["archive.encrypted"]);
    assert_eq!(outcome(&alone("libs.zip", b"PK\x03\x04 cut".to_vec())).1, ["archive.damaged"]);
    assert_eq!(board(&alone("b-plan.drl", ours("M30\n"))).0.holes.len(), HOLES.len(), "ours alone is read");
    let opened = alone("b.project", project);
    assert!(opened.files.iter().any(|file| file.gerber.is_some()), "a project alone is opened");
}
