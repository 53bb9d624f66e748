//! Everyday input: drill files and lists of many programs, CAD side files, archives. One quirk per row.

use annulus_core::artwork::{Artwork, FileKind, FileRead, Overrides, packed, read_set};
use annulus_core::board::from_artwork;
use annulus_core::diagnostic::Severity;

pub(crate) fn set(files: &[(&str, &[u8])]) -> Artwork {
    let files: Vec<_> = files.iter().map(|(name, bytes)| ((*name).to_owned(), bytes.to_vec())).collect();
    read_set(&files, &Overrides::default())
}

/// Holes as `x,y` in mm, each with its diameter if known.
fn holes(file: &FileRead) -> String {
    let Some(drill) = &file.drill else { return String::new() };
    let rows = drill.hits.iter().map(|hit| {
        let size = drill.tools[usize::from(hit.tool)].diameter.map_or("?".to_owned(), |d| d.mm().to_string());
        format!("{},{},{size}", hit.at.x.mm(), hit.at.y.mm())
    });
    rows.collect::<Vec<_>>().join(" ")
}

pub(crate) fn width_mm(file: &FileRead) -> f64 {
    let bounds = file.drill.as_ref().and_then(|drill| drill.centre_bounds()).unwrap();
    (bounds.max.x - bounds.min.x).mm()
}

pub(crate) fn codes(file: &FileRead, least: Severity) -> Vec<&str> {
    file.diagnostics
        .iter()
        .filter(|diagnostic| diagnostic.severity >= least)
        .map(|diagnostic| diagnostic.code.as_str())
        .collect()
}

const WANT: &str = "-5.08,0,0.8 2.54,1.27,0.8 7.62,3.5,1";

#[test]
fn lists_of_many_styles_are_read() {
    for (name, text) in [
        ("tabs and decimal commas", "X\tY\tD (mm)\n-5,08\t0\t0,8\n2,54\t1,27\t0,8\n7,62\t3,5\t1,0\n"),
        (
            "quotes",
            "\"X (mm)\",\"Y (mm)\",\"Diameter\"\n\"-5.08\",\"0\",\"0.8\"\n\"2.54\",\"1.27\",\"0.8\"\n\"7.62\",\"3.5\",\"1.0\"\n",
        ),
        (
            "quotes with commas",
            "UNITS mm\n\"-5,08\",\"0,00\",\"0,8\"\n\"2,54\",\"1,27\",\"0,8\"\n\"7,62\",\"3,50\",\"1,0\"\n",
        ),
        ("a row number", "No;X;Y;D mm\n1;-5,08;0,0;0,8\n2;2,54;1,27;0,8\n3;7,62;3,5;1,0\n"),
        ("a row number unsaid", "# mm\nUNITS mm\n1 -5.08 0.0 0.8\n2 2.54 1.27 0.8\n3 7.62 3.5 1.0\n"),
        ("the size first", "UNITS mm\n0.8 -5.08 0.0\n0.8 2.54 1.27\n1.0 7.62 3.5\n"),
        ("the size first, named", "Drill;X;Y;Note mm\n0.8;-5.08;0.0;via\n0.8;2.54;1.27;via\n1.0;7.62;3.5;\n"),
    ] {
        let artwork = set(&[("holes.csv", text.as_bytes())]);
        let file = &artwork.files[0];
        assert_eq!(
            (file.kind, holes(file).as_str()),
            (FileKind::Drill, WANT),
            "{name}: {:?}",
            file.diagnostics
        );
        assert!(!file.has_error(), "{name}: {:?}", file.diagnostics);
    }
}

#[test]
fn programs_of_many_styles_are_read() {
    let head = "M48\nMETRIC\nT1C0.8\nT2C1.0\n%\n";
    let body = "T1\nX-5.08Y0\nX2.54Y1.27\nT2\nX7.62Y3.5\nM30\n";
    for (name, text) in [
        ("plain", format!("{head}{body}")),
        ("doubled tool numbers", format!("{head}{}", body.replace("T1", "T0101").replace("T2", "T0202"))),
        ("blanks behind letters", format!("{head}{}", body.replace('X', "X ").replace('Y', " Y "))),
        ("end of text behind the end", format!("{head}{body}\u{1A}")),
        ("units and cancelled cycles as in milling", format!("{head}G21\nG80\nG54\n{body}")),
        ("a zero point in a decimal file", format!("{head}G93X0Y0\n{body}")),
        ("a tool table in a comment", format!("; Tool table\n; T01 0.8mm 2x\n{head}{body}")),
        ("words of a report", format!("; DRILL REPORT, see INTEGER-PLACES\n{head}{body}")),
    ] {
        let artwork = set(&[("board.drl", text.as_bytes())]);
        let file = &artwork.files[0];
        assert_eq!(
            (file.kind, holes(file).as_str()),
            (FileKind::Drill, WANT),
            "{name}: {:?}",
            file.diagnostics
        );
        assert_eq!(codes(file, Severity::Warning), Vec::<&str>::new(), "{name}");
    }
    let pattern = format!("{head}T1\nM25\nX1.0Y1.0\nX9000.0Y1.0\nM01\nM02X8000.0Y0.0\nM08\nM30\n");
    let artwork = set(&[("board.drl", pattern.as_bytes())]);
    let file = &artwork.files[0];
    assert_eq!(file.drill.as_ref().unwrap().hits.len(), 2);
    assert!(codes(file, Severity::Error).contains(&"drill.out_of_range"), "{:?}", file.diagnostics);
}

#[test]
fn impossible_holes_and_tools_are_errors() {
    let program = |tool: &str, body: &str| format!("M48\nMETRIC\nT1C{tool}\n%\nT1\n{body}M30\n");
    let inside = "X0.1Y0.1\nX0.9Y0.1\nX0.9Y0.8\nX0.1Y0.8\n";
    for (text, code) in [
        (program("3.2", inside), "drill.holes_overlap"),
        (program("0.02", "X1.0Y1.0\nX20.0Y1.0\nX20.0Y20.0\n"), "drill.impossible_bit"),
        (program("31.0", "X1.0Y1.0\nX90.0Y1.0\nX90.0Y90.0\n"), "drill.impossible_bit"),
    ] {
        let artwork = set(&[("board.drl", text.as_bytes())]);
        assert_eq!(codes(&artwork.files[0], Severity::Error), [code], "{text}");
    }
}

#[test]
fn companion_files_give_units_and_foreign_files_are_reported() {
    let program = b"%\nT01\nX002000Y003000\nX004000Y003000\nX004000Y008000\nM30\n";
    let station = b"Generated by EAGLE CAM Processor 4.16r2\n\nDrill Station Info File: board.dri\n\n Data Mode        : Absolute\n \
                    Units            : 1/10000 Inch\n\nDrills used:\n\n Code  Size       used\n\n T01   0.0320inch     3\n\n\
                    Total number of drills: 3\n\nPlotfiles:\n\n board.drd\n";
    let artwork = set(&[("board.drd", program), ("board.dri", station)]);
    assert_eq!(holes(&artwork.files[0]), "5.08,7.62,0.8128 10.16,7.62,0.8128 10.16,20.32,0.8128");
    assert_eq!((artwork.files[1].kind, artwork.files[0].has_error()), (FileKind::Report, false));
    let log = b"Job : board\nCoordinate Format : 3V3\nZero Suppress : Leading\nUnit : MM\n*****  DRILL LIST  *****\nT01 0.8 3\n";
    let artwork =
        set(&[("board.fdr", b"%\nT01\nX5080Y7620\nX10160Y7620\nX10160Y20320\nM30\n"), ("board.fdl", log)]);
    assert_eq!(holes(&artwork.files[0]), "5.08,7.62,0.8 10.16,7.62,0.8 10.16,20.32,0.8");
    assert_eq!(artwork.files[1].kind, FileKind::Report);
    for (name, bytes, kind, code) in [
        ("top.pos", &b"Ref,Val,Package,PosX,PosY,Rot,Side\nR1,10k,0805,1.0,2.0,90,top\n"[..], FileKind::Unknown, ""),
        ("board.gpi", b"Generated by EAGLE CAM Processor\nPhotoplotter Info File: b.gpi\nUnits : 1/10000 Inch\n", FileKind::Report, ""),
        ("board.tar.gz", b"\x1F\x8B\x08\0\0\0\0\0\0\x03abcdef", FileKind::Unknown, "archive.not_opened"),
        ("board.7z", b"7z\xBC\xAF\x27\x1C\0\x04abcdef", FileKind::Unknown, "archive.not_opened"),
        (
            "notes.txt",
            b"The holes of the new board are all in here,\nand here is one:\nX1.0Y2.0\nX3.0Y2.0\nThank you.\nYours,\nme\n",
            FileKind::Unknown,
            "file.coordinates_unread",
        ),
    ] {
        let artwork = set(&[(name, bytes)]);
        let file = &artwork.files[0];
        assert_eq!(file.kind, kind, "{name}");
        assert_eq!(codes(file, Severity::Warning).first().copied().unwrap_or_default(), code, "{name}");
    }
}

#[test]
fn fritzing_header_gives_the_first_plated_tool() {
    let text = b"; NON-PLATED HOLES START AT T1\n; THROUGH (PLATED) HOLES START AT T100\nM48\nINCH\nT1C0.125984\nT100C0.038\nT101C0.02\n\
                 %\nT1\nX001000Y001000\nT100\nX002000Y001000\nT101\nX003000Y001000\nT00\nM30\n";
    let artwork = set(&[("b_drill.txt", text)]);
    let plated: Vec<_> =
        artwork.files[0].drill.as_ref().unwrap().tools.iter().map(|tool| tool.plated).collect();
    assert_eq!(plated, [Some(false), Some(true), Some(true)]);
}

#[test]
fn backslashes_in_a_zip_are_path_separators() {
    let zip =
        packed(&[("gerber/board.drl".to_owned(), b"M48\nMETRIC\nT1C0.8\n%\nT1\nX1.0Y1.0\nM30\n".to_vec())])
            .unwrap();
    // The same zip with the backslashes that some programs write.
    let turned: Vec<u8> = {
        let from = b"gerber/board.drl";
        let mut bytes = zip;
        while let Some(at) = bytes.windows(from.len()).position(|part| part == from) {
            bytes[at + 6] = b'\\';
        }
        bytes
    };
    let artwork = set(&[("board.zip", &turned)]);
    assert_eq!(artwork.files[1].name, "board.zip!/gerber/board.drl");
    assert_eq!(artwork.files[1].kind, FileKind::Drill);
}

#[test]
fn layers_in_lower_case_are_read() {
    let text = b"g04 lower*\n%fslax46y46*%\n%momm*%\n%add10c,1.6*%\nd10*\nx1000000y2000000d03*\nm02*\n";
    let artwork = set(&[("b.gtl", text)]);
    let layer = artwork.files[0].gerber.as_ref().unwrap();
    assert_eq!(layer.counts.flashes, 1, "{:?}", artwork.files[0].diagnostics);
    assert_eq!(layer.pads()[0].y.mm(), 2.0);
}

/// A layer with a pad at each position, and a program with a hole there.
pub(crate) fn board(places: &[(f64, f64)]) -> (Vec<u8>, Vec<u8>) {
    let flash = |(x, y): &(f64, f64)| format!("X{:.0}Y{:.0}D03*\n", x * 1e6, y * 1e6);
    let flashes: String = places.iter().map(flash).collect();
    let layer = format!(
        "%TF.FileFunction,Copper,L1,Top*%\n%FSLAX46Y46*%\n%MOMM*%\n%ADD10C,1.6*%\nD10*\n{flashes}M02*\n"
    );
    let hits: String = places.iter().map(|(x, y)| format!("X{x:.3}Y{y:.3}\n")).collect();
    (layer.into_bytes(), format!("M48\nMETRIC\nT1C0.8\n%\nT1\n{hits}M30\n").into_bytes())
}

#[test]
fn boards_sharing_a_folder_are_no_job_and_no_evidence() {
    let places = |step: f64| -> Vec<(f64, f64)> {
        (0..30_i32).map(|i| (f64::from(i * 7 % 31) * step, f64::from(i * i % 23) * step * 0.7)).collect()
    };
    let [amp, radio, clock] = [1.27, 1.9, 2.3].map(|step| board(&places(step)));
    let files: [(&str, &[u8]); 6] = [
        ("amp-F_Cu.gbr", &amp.0),
        ("amp.drl", &amp.1),
        ("radio-F_Cu.gbr", &radio.0),
        ("radio.drl", &radio.1),
        ("clock-F_Cu.gbr", &clock.0),
        ("clock.drl", &clock.1),
    ];
    let mut artwork = set(&files);
    let all: Vec<usize> = (0..6).collect();
    let boards = artwork.boards(&all);
    assert_eq!(
        boards.iter().map(|(name, files)| (name.as_str(), files.len())).collect::<Vec<_>>(),
        [("amp", 2), ("radio", 2), ("clock", 2)]
    );
    for at in [1, 3, 5] {
        assert_eq!(
            artwork.files[at].evidence.as_ref().unwrap().score,
            Some(1.0),
            "only its own copper is asked"
        );
    }
    let (_, diagnostics) = from_artwork(&artwork, &artwork.default_use());
    let several = diagnostics
        .iter()
        .find(|diagnostic| diagnostic.code == "board.several")
        .expect("three boards are told");
    assert_eq!(several.severity, Severity::Error);
    assert!(several.message("en").contains("amp, radio, clock"), "{}", several.message("en"));
    artwork.leave_out(&[2, 3, 4, 5]);
    let (board, diagnostics) = from_artwork(&artwork, &artwork.default_use());
    assert_eq!((board.holes.len(), diagnostics.len()), (30, 0), "{diagnostics:?}");
}

#[test]
fn holes_inside_others_are_always_errors() {
    let head = "M48\nMETRIC\nT1C0.8\nT2C3.2\n%\n";
    let row = |pitch: f64, count: i32| {
        (0..count).map(|at| format!("X{:.2}Y10.0\n", 10.0 + f64::from(at) * pitch)).collect::<String>()
    };
    let good = row(2.54, 10);
    for (name, body, code) in [
        (
            "a heap beside a row",
            format!("T1\n{good}T2\nX0.1Y0.1\nX0.9Y0.1\nX0.9Y0.8\nX0.1Y0.8\n"),
            Some("drill.holes_inside"),
        ),
        (
            "two sizes in one place",
            format!("T1\n{good}{}T2\n{}", row(2.54, 30), row(2.54, 4)),
            Some("drill.holes_inside"),
        ),
        ("one size twice in one place", format!("T1\n{good}{good}"), None),
        (
            "a slot of holes in a row",
            format!("T1\n{}X90.0Y0.0\nT2\n{}", row(2.54, 40), row(0.5, 9).replace("Y10", "Y50")),
            None,
        ),
        ("two that overlap", format!("T1\n{good}T2\nX0.1Y0.1\nX1.0Y0.1\n"), None),
    ] {
        let artwork = set(&[("b.drl", format!("{head}{body}M30\n").as_bytes())]);
        assert_eq!(codes(&artwork.files[0], Severity::Error), code.into_iter().collect::<Vec<_>>(), "{name}");
    }
}

#[test]
fn holes_are_never_dropped_silently() {
    let head = "; Tool table\nM48\nMETRIC\nT1C0.8\n%\nT1\n";
    for (name, body, count) in [
        ("slots", "X1.0Y1.0G85X2.0Y1.0\nX5.0Y1.0G85X6.0Y1.0\n", 2),
        ("routes", "G00X1.0Y1.0\nM15\nG01X5.0Y1.0\nM16\n", 1),
        ("cycles", "G81X1.0Y1.0\nG81X5.0Y1.0\n", 2),
        ("tools in every line", "T01X1.0Y1.0\nT01X5.0Y1.0\n", 2),
        ("repeats", "X1.0Y1.0\nR5X2.0\n", 6),
    ] {
        let artwork = set(&[("b.drl", format!("{head}{body}M30\n").as_bytes())]);
        let file = &artwork.files[0];
        assert_eq!(file.kind, FileKind::Drill, "{name}");
        let totals = file.drill.as_ref().unwrap().totals();
        assert_eq!(totals.hits + totals.slots + totals.routed_paths, count, "{name}: {:?}", file.diagnostics);
    }
    let tools: String = (1..60).map(|tool| format!("T{tool} 0.{tool}mm {tool}x\n")).collect();
    for (name, text) in [
        ("b.drl", format!("; Tool table\n{tools}%\nX001000Y001000\nX002000Y001000\nX003000Y009000\nM30\n")),
        (
            "e.txt",
            format!(
                "DRILL REPORT\n{}X1.0Y1.0\nX2.0Y1.0\n",
                "some words here that fill lines\n".repeat(2_200)
            ),
        ),
        ("g.txt", "notes\nfoo\nbar\nbaz\nX1.0Y2.0F100\nX3.0Y2.0F100\n".to_owned()),
        ("mount.txt", "1.0 2.0\n5.0 2.0\nhole\nhole\n7.0 8.0\n".to_owned()),
        ("mount.csv", "UNITS mm\n-5.08e0 0 0.8\n2.54 1.27 0.8\n7.62 3.5 1.0\n".to_owned()),
    ] {
        let artwork = set(&[(name, text.as_bytes())]);
        let file = &artwork.files[0];
        assert!(!codes(file, Severity::Warning).is_empty(), "{name}: {:?} {:?}", file.kind, file.diagnostics);
    }
}

#[test]
fn foreign_copper_on_a_grid_confirms_no_format() {
    let grid = |columns: i32, rows: i32| -> Vec<(f64, f64)> {
        let place = |at: i32| (f64::from(at % columns) * 2.54, f64::from(at / columns) * 2.54);
        (0..columns * rows).map(place).collect()
    };
    let (copper, _) = board(&grid(71, 40));
    let mut places = grid(8, 2);
    places.push((7.62, 7.62));
    let inch = |mm: f64| format!("{:.0}", mm / 25.4 * 1e5);
    let hits: String = places.iter().map(|(x, y)| format!("X{}Y{}\n", inch(*x), inch(*y))).collect();
    let program = format!("M48\nINCH,TZ\nT1C0.0315\n%\nT1\n{hits}M30\n");
    let artwork = set(&[("top.gtl", &copper), ("drill.drl", program.as_bytes())]);
    let told = codes(&artwork.files[1], Severity::Warning);
    assert!(told.contains(&"drill.copper_undecided"), "{told:?}");
    let outline = b"%FSLAX46Y46*%\n%MOMM*%\n%ADD10C,0.1*%\nD10*\nX-2000000Y-2000000D02*\nX20000000D01*\nY10000000D01*\n\
                    X-2000000D01*\nY-2000000D01*\nM02*\n";
    let artwork = set(&[("top.gtl", &copper), ("outline.gko", outline), ("drill.drl", program.as_bytes())]);
    assert!((width_mm(&artwork.files[2]) - 17.78).abs() < 0.01, "{:?}", artwork.files[2].evidence);
    assert!(!codes(&artwork.files[2], Severity::Warning).is_empty());
}

#[test]
fn boards_with_similar_names_are_separate() {
    let places = |step: f64, offset: i32| -> Vec<(f64, f64)> {
        let place = |i: i32| (f64::from(i * 7 % 31) * step, f64::from((i + offset) * i % 23) * step * 0.7);
        (0..30_i32).map(place).collect()
    };
    let [a, b, c] = [(1.27, 0), (1.9, 3), (2.3, 5)].map(|(step, offset)| board(&places(step, offset)));
    let bottom =
        |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap().replace("L1,Top", "L2,Bot").into_bytes();
    let below = bottom(&b.0);
    let rows: [&[(&str, &[u8])]; 3] = [
        &[
            ("acme-power-F_Cu.gbr", &a.0),
            ("acme-power.drl", &a.1),
            ("acme-logic-B_Cu.gbr", &below),
            ("acme-logic.drl", &b.1),
        ],
        &[
            ("acme-power-F_Cu.gbr", &a.0),
            ("acme-power.drl", &a.1),
            ("acme-logic-B_Cu.gbr", &below),
            ("acme-logic.drl", &b.1),
            ("acme-led.drl", &c.1),
        ],
        &[("robot_left-F_Cu.gtl", &a.0), ("robot_left.drl", &a.1), ("robot_right.drl", &b.1)],
    ];
    for row in rows {
        let artwork = set(row);
        let (_, diagnostics) = from_artwork(&artwork, &artwork.default_use());
        let several = diagnostics.iter().any(|diagnostic| diagnostic.code == "board.several");
        assert!(several, "{:?}: {diagnostics:?}", row.iter().map(|row| row.0).collect::<Vec<_>>());
    }
}

#[test]
fn parts_lists_are_no_drill_files() {
    for text in [
        "Designator,X,Y,Rotation\nR1,10.0,20.0,90\nR2,12.0,20.0,90\n",
        "ID,X (mm),Y (mm),Rot\n1,10.0,20.0,90\n2,12.0,20.0,90\n3,14.0,22.0,0\n",
        "Name;X;Y;Angle\nR1;10.0;20.0;90\nR2;12.0;20.0;90\nC1;14.0;20.0;0\n",
        "Bauteil;Wert;X;Y;Winkel;Seite\nR1;10k;10,0;20,0;90;oben\nR2;10k;12,0;20,0;90;oben\n",
    ] {
        let artwork = set(&[("b-cpl.csv", text.as_bytes())]);
        assert_eq!(artwork.files[0].kind, FileKind::Unknown, "{text}");
    }
}
