//! Cross-checks between drill files of one folder, after all are read.
//!
//! ```text
//!   board.DRL  punched tape, rejected ◀── board.TXT  the same program as text: nothing is missing
//!   copy.drl   the same bytes ◀── board.drl  the first one is used
//!   board-NPTH.drl  holes without pads  ◀── board.drl  shifted by (x, y) onto its pads: shift these too
//! ```

use crate::artwork::companion::{base, folder, stem};
use crate::artwork::names::is_called_like_drill;
use crate::artwork::registration::FITS_SHARE;
use crate::artwork::{FileKind, FileRead};
use crate::diagnostic::Severity;
use crate::{code, note};
use std::collections::BTreeMap;

/// Shifts closer than this are equal, mm.
const SAME_MM: f64 = 0.05;

pub(in crate::artwork) fn settle(files: &mut [FileRead]) {
    tapes(files);
    shifts(files);
    copies(files);
}

/// Of drill programs with equal content, only the first is used (see [`crate::artwork::Artwork::default_use`]); the
/// others get a note.
fn copies(files: &mut [FileRead]) {
    let mut first: BTreeMap<u64, String> = BTreeMap::new();
    for file in files.iter_mut().filter(|file| file.is_program_with_holes()) {
        match first.get(&file.fingerprint) {
            Some(twin) => {
                let told = note!("set.same_drill", twin = twin).at(&file.name, 0, 0);
                file.diagnostics.push(told);
            }
            None => drop(first.insert(file.fingerprint, file.name.clone())),
        }
    }
}

/// A punched tape next to a text program of its name needs no reading: CADs write both of the same holes.
fn tapes(files: &mut [FileRead]) {
    let programs: Vec<String> =
        files.iter().filter(|file| file.is_program_with_holes()).map(|file| file.name.clone()).collect();
    for file in files.iter_mut().filter(|file| file.kind == FileKind::Refused) {
        let (of, name) = (folder(&file.name), stem(&file.name));
        let twin = programs.iter().find(|twin| folder(twin) == of && is_of(stem(twin), name));
        let is_tape = |code: &str| {
            code == "refused.eia_tape"
                || code == code!("refused.binary") && is_called_like_drill(base(&file.name))
        };
        let tape = file.diagnostics.iter_mut().find(|diagnostic| is_tape(&diagnostic.code));
        if let (Some(twin), Some(tape)) = (twin, tape) {
            tape.severity = Severity::Note;
            let told = note!("set.tape_twin", ..).at(&file.name, 0, 0);
            file.diagnostics.push(told.with("twin", base(twin)));
        }
    }
}

/// True if a drill program can be the text of the tape `name`: same name, or with a suffix for the kind of
/// holes, as in Altium.
fn is_of(program: &str, name: &str) -> bool {
    let rest = program
        .get(name.len()..)
        .filter(|_| program.get(..name.len()).is_some_and(|front| front.eq_ignore_ascii_case(name)));
    let tape = name.strip_suffix("-Plated").or(name.strip_suffix("-NonPlated"));
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['-', '_']))
        || tape.is_some_and(|tape| is_of(program, tape))
}

/// Unplated holes need no copper under them. Shift them like the other holes of their folder, if those agree.
fn shifts(files: &mut [FileRead]) {
    let shift = |file: &FileRead| Some((folder(&file.name).to_owned(), file.evidence.as_ref()?.shift_mm?));
    let known: Vec<(String, (f64, f64))> = files.iter().filter_map(shift).collect();
    for file in files.iter_mut().filter(|file| file.kind == FileKind::Drill && file.plated == Some(false)) {
        let mut beside = known.iter().filter(|(of, _)| of == folder(&file.name)).map(|(_, by)| *by);
        let (Some(by), Some(evidence)) = (beside.next(), &mut file.evidence) else { continue };
        let agree = |other: (f64, f64)| (other.0 - by.0).abs() < SAME_MM && (other.1 - by.1).abs() < SAME_MM;
        let lies_well = evidence.score.is_some_and(|score| score >= FITS_SHARE);
        if evidence.shift_mm.is_none() && !lies_well && beside.all(agree) {
            evidence.shift_mm = Some(by);
            file.diagnostics.push(note!("drill.shifted_with_others").at(&file.name, 0, 0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::artwork::{Artwork, Overrides, Source, read_set};

    fn program(second: &str, holes: &[(f64, f64)]) -> Vec<u8> {
        let hits: String = holes.iter().map(|(x, y)| format!("X{x:.3}Y{y:.3}\n")).collect();
        format!("M48\n{second}\nMETRIC,TZ\nT1C0.800\n%\nT1\n{hits}M30\n").into_bytes()
    }

    fn set(files: &[(&str, Vec<u8>)]) -> Artwork {
        let named: Vec<_> = files.iter().map(|(name, bytes)| ((*name).to_owned(), bytes.clone())).collect();
        read_set(&named, &Overrides::default())
    }

    fn codes(file: &FileRead, severity: Severity) -> Vec<&str> {
        file.diagnostics.iter().filter(|r| r.severity == severity).map(|r| r.code.as_str()).collect()
    }

    fn tape() -> Vec<u8> {
        let code = |letter: u8| match letter {
            b'X' => 0x37,
            b'Y' => 0x38,
            b'0' => 0x20,
            b'1' => 0x01,
            b'2' => 0x02,
            _ => 0x80,
        };
        "X0120Y0210\n".repeat(40).bytes().map(code).collect()
    }

    #[test]
    fn eia_tape_with_a_text_twin_is_no_error() {
        let text = program(";text", &[(1.0, 1.0), (2.0, 1.0), (3.0, 4.0)]);
        let alone = set(&[("a/board.DRL", tape())]);
        assert_eq!(codes(&alone.files[0], Severity::Error), ["refused.eia_tape"]);
        let other = set(&[("a/board.DRL", tape()), ("a/lid.TXT", text.clone())]);
        assert_eq!(codes(&other.files[0], Severity::Error), ["refused.eia_tape"]);
        let both = set(&[("a/board.DRL", tape()), ("a/board.TXT", text)]);
        assert_eq!(both.files[0].kind, FileKind::Refused);
        assert_eq!(codes(&both.files[0], Severity::Error), Vec::<&str>::new());
        assert_eq!(codes(&both.files[0], Severity::Note), ["refused.eia_tape", "set.tape_twin"]);
    }

    #[test]
    fn copied_drill_program_names_the_one_in_use() {
        let text = program(";text", &[(1.0, 1.0), (2.0, 1.0), (3.0, 4.0)]);
        let other = program(";text", &[(1.0, 1.0), (2.0, 5.0), (3.0, 4.0)]);
        let all = set(&[("a.drl", text.clone()), ("b.drl", other), ("c.drl", text)]);
        assert_eq!(all.default_use(), [0, 1]);
        let said = |at: usize| codes(&all.files[at], Severity::Note).contains(&"set.same_drill");
        assert_eq!([0, 1, 2].map(said), [false, false, true]);
        let message = all.files[2].diagnostics.last().unwrap().message("en");
        assert!(message.contains("a.drl"), "{message}");
    }

    /// Pads at irregular positions, so that only one shift fits, and their layer.
    fn pads() -> (Vec<(f64, f64)>, Vec<u8>) {
        let pads: Vec<(f64, f64)> =
            (0..60).map(|i| (f64::from(i * 7 % 31) * 1.27, f64::from(i * i % 53) * 0.83)).collect();
        let flash = |(x, y): &(f64, f64)| format!("X{:.0}Y{:.0}D03*", x * 1e6, y * 1e6);
        let flashes: String = pads.iter().map(flash).collect();
        let layer =
            format!("%FSLAX46Y46*%%MOMM*%%TF.FileFunction,Copper,L1,Top*%%ADD10C,1*%D10*{flashes}M02*");
        (pads, layer.into_bytes())
    }

    #[test]
    fn unplated_holes_off_the_copper_are_not_doubted() {
        let (pads, layer) = pads();
        // A tenth of the pads' positions: with other digits, every hole would be on a pad.
        let beside: Vec<(f64, f64)> = pads.iter().map(|(x, y)| (x / 10.0, y / 10.0)).collect();
        let hits: String =
            beside.iter().map(|(x, y)| format!("X{:05.0}Y{:05.0}\n", x * 1e3, y * 1e3)).collect();
        let text = |function: &str| {
            let head = format!("M48\n;{function}\n;FILE_FORMAT=2:3\nMETRIC,LZ\nT1C0.800\n%\nT1\n");
            (head + &hits + "M30\n").into_bytes()
        };
        for (function, doubted) in [
            ("TYPE=PLATED", true),
            ("TYPE=NON_PLATED", false),
            (" #@! TF.FileFunction,NonPlated,1,2,NPTH", false),
        ] {
            let read = set(&[("top.gbr", layer.clone()), ("board.drl", text(function))]);
            let drill = &read.files[1];
            assert_eq!(drill.plated, Some(doubted), "{function}");
            let found = codes(drill, Severity::Warning);
            assert_eq!(found.contains(&"drill.copper_disagrees"), doubted, "{function}: {found:?}");
            let evidence = drill.evidence.as_ref().unwrap();
            assert!(evidence.source <= Source::Companion, "{function}: {evidence:?}");
        }
    }

    #[test]
    fn unplated_holes_shift_only_with_the_plated_ones() {
        let (pads, layer) = pads();
        let moved: Vec<(f64, f64)> = pads.iter().map(|(x, y)| (x - 3.295, y - 20.124)).collect();
        let lone = vec![(1.0, 1.0), (2.0, 9.0), (2.5, 3.0)];
        let unplated = program(";TYPE=NON_PLATED", &lone);
        let alone = set(&[("top.gbr", layer.clone()), ("board-npth.drl", unplated.clone())]);
        assert_eq!(alone.files[1].evidence.as_ref().unwrap().shift_mm, None);
        let plated = program(";TYPE=PLATED", &moved);
        let both = set(&[("top.gbr", layer), ("board.drl", plated), ("board-npth.drl", unplated)]);
        let by = |at: usize| both.files[at].evidence.as_ref().unwrap().shift_mm;
        assert!(by(1).is_some_and(|(x, y)| (x - 3.295).abs() < 1e-3 && (y - 20.124).abs() < 1e-3));
        assert_eq!(by(2), by(1));
        assert!(codes(&both.files[2], Severity::Note).contains(&"drill.shifted_with_others"));
    }

    #[test]
    fn report_of_another_board_is_no_evidence() {
        // In inch 2.4 the positions are whole: 1.0000 × 0.5000. The report of another board states
        // millimetres 3.3 and other tools.
        let drill = |sizes: bool| {
            let head = if sizes { "M48\nINCH\nT01C0.0320\nT02C0.0400\n%\n" } else { "" };
            let hits = |n: u32, y: u32| {
                (0..n).map(|i| format!("X{:06}Y{y:06}\n", 10_000 + 700 * i)).collect::<String>()
            };
            format!("{head}T01\n{}T02\n{}M30\n", hits(9, 5_000), hits(5, 7_000)).into_bytes()
        };
        let report = |units: &str, rows: &[(u32, &str, u32)]| {
            let rows: String = rows.iter().map(|(t, size, n)| format!("T{t:02} {size} {n}\n")).collect();
            format!("Drill Station Info File\n\nData Mode : Absolute\nUnits : {units}\n\nDrills used:\n\nCode Size used\n\n{rows}")
                .into_bytes()
        };
        let own = report("1/10000 Inch", &[(1, "0.0320inch", 9), (2, "0.0400inch", 5)]);
        let foreign = report("1/1000 mm", &[(1, "0.600mm", 31), (2, "3.200mm", 4), (3, "1.000mm", 12)]);
        let read = |sizes: bool, report: Option<&Vec<u8>>| {
            let mut files = vec![("board.drd", drill(sizes))];
            files.extend(report.map(|report| ("board.dri", report.clone())));
            set(&files).files.swap_remove(0)
        };
        let another = "drill.report_of_another_board";
        for sizes in [true, false] {
            let alone = read(sizes, None);
            let beside = read(sizes, Some(&foreign));
            assert!(codes(&beside, Severity::Warning).contains(&another), "{:?}", beside.diagnostics);
            let numbers = |file: &FileRead| {
                (file.units, file.number_format, file.zeros, file.evidence.clone().map(|e| e.source))
            };
            assert_eq!(numbers(&beside), numbers(&alone), "{sizes}");
            assert_eq!(beside.drill, alone.drill, "{sizes}");
            let told = |file: &FileRead| {
                file.diagnostics
                    .iter()
                    .map(|d| d.code.clone())
                    .filter(|code| code != another)
                    .collect::<Vec<_>>()
            };
            assert_eq!(told(&beside), told(&alone), "{sizes}");
            let good = read(sizes, Some(&own));
            assert!(!codes(&good, Severity::Warning).contains(&another));
            assert_eq!(good.units, Some(crate::artwork::Units::Inch));
        }
        let good = read(false, Some(&own)).drill.unwrap().tools[0].diameter.map(|size| size.nm());
        assert_eq!(good, Some(812_800));
        // One more hole, from a later revision, doesn't make it another board.
        let later = report("1/10000 Inch", &[(1, "0.0320inch", 10), (2, "0.0400inch", 5)]);
        assert_eq!(codes(&read(true, Some(&later)), Severity::Warning), ["drill.report_counts_differ"]);
    }

    #[test]
    fn report_of_two_files_is_split_by_file() {
        let report = "Drill report for b.kicad_pcb\n\nDrill file 'b-PTH.drl' contains\n    plated through holes:\n    =====\n\
            T1  0.80mm  0.0315\"  (3 holes)  (with 1 slot)\n    T2  1.00mm  0.0394\"  (1 hole)\n\n    Total plated holes count 4\n\n\n\
            Drill file 'b-NPTH.drl' contains\n    unplated through holes:\n    =====\n    T1  3.20mm  0.1260\"  (2 holes)\n\n    Total unplated holes count 2\n";
        let file = |tools: &str, body: &str| {
            format!("M48\nFMAT,2\nMETRIC\n{tools}%\nG90\nG05\n{body}M30\n").into_bytes()
        };
        let plated =
            file("T1C0.800\nT2C1.000\n", "T1\nX1.0Y1.0\nX4.0Y1.0\nX7.0Y1.0G85X8.0Y1.0\nT2\nX9.0Y9.0\n");
        for (size, codes_found) in [("3.200", &[][..]), ("0.800", &["drill.report_sizes_differ"][..])] {
            let unplated = file(&format!("T1C{size}\n"), "T1\nX20.0Y1.0\nX24.0Y1.0\n");
            let all = set(&[
                ("b.rpt", report.as_bytes().to_vec()),
                ("b-PTH.drl", plated.clone()),
                ("b-NPTH.drl", unplated),
            ]);
            assert_eq!(
                codes(&all.files[1], Severity::Warning),
                Vec::<&str>::new(),
                "{:?}",
                all.files[1].diagnostics
            );
            assert_eq!(
                codes(&all.files[2], Severity::Warning),
                codes_found,
                "{:?}",
                all.files[2].diagnostics
            );
            let plated = |at: usize| {
                all.files[at].drill.as_ref().unwrap().tools.iter().map(|tool| tool.plated).collect::<Vec<_>>()
            };
            assert_eq!((all.files[1].plated, plated(1)), (Some(true), vec![Some(true); 2]));
            assert_eq!((all.files[2].plated, plated(2)), (Some(false), vec![Some(false)]));
        }
    }

    #[test]
    fn castellated_holes_are_not_shifted() {
        let rows: Vec<(f64, f64)> = (0..14).map(|row| (0.0, 2.0 + 1.27 * f64::from(row))).collect();
        let vias = [(8.0, 3.1), (9.3, 7.7), (6.1, 12.9), (11.7, 15.3)];
        let place = |(x, y): (f64, f64)| format!("X{:.0}Y{:.0}D03*", x * 1e6, y * 1e6);
        let pads: String = rows.iter().map(|&(x, y)| place((x + 0.6, y))).collect();
        let round: String = vias.iter().map(|&at| place(at)).collect();
        let layer = format!(
            "%FSLAX46Y46*%%MOMM*%%TF.FileFunction,Copper,L1,Top*%%ADD10R,1.2X0.8*%%ADD11C,0.8*%D10*{pads}D11*{round}M02*"
        );
        let holes: Vec<(f64, f64)> = rows.iter().chain(&vias).copied().collect();
        let drill = program(";TYPE=PLATED", &holes);
        let all = set(&[("top.gbr", layer.clone().into_bytes()), ("board.drl", drill)]);
        let told =
            |all: &Artwork| all.files[1].diagnostics.iter().any(|d| d.code == "drill.shifted_from_copper");
        assert!(!told(&all), "{:?}", all.files[1].diagnostics);
        // Not on their pads, so there is a warning.
        let moved: Vec<(f64, f64)> = holes.iter().map(|(x, y)| (x + 3.1, y + 2.2)).collect();
        assert!(told(&set(&[
            ("top.gbr", layer.into_bytes()),
            ("board.drl", program(";TYPE=PLATED", &moved))
        ])));
    }

    #[test]
    fn allegro_tools_follow_their_comments_and_parameters() {
        let small = [
            (5.0, 5.0),
            (5.0, 25.0),
            (15.0, 5.0),
            (15.0, 25.0),
            (25.0, 5.0),
            (25.0, 25.0),
            (12.0, 9.0),
            (22.0, 17.0),
            (31.0, 11.0),
            (8.0, 19.0),
        ];
        let large = [(3.0, 3.0), (37.0, 3.0), (37.0, 27.0), (3.0, 27.0)];
        let number = |value: f64| format!("{:010.0}", value * 1e5);
        let flash = |(x, y): &(f64, f64)| format!("X{}Y{}D03*", number(*x), number(*y));
        let flashes: String = small.iter().chain(&large).map(flash).collect();
        let layer =
            |more: &str| format!("%FSLAX55Y55*%%MOMM*%%ADD10C,2.0*%D10*{flashes}{more}M02*").into_bytes();
        let hits = |all: &[(f64, f64)]| {
            all.iter().map(|(x, y)| format!("X{}Y{}\n", number(*x), number(*y))).collect::<String>()
        };
        let program = format!(
            ";LEADER: 12\n;HEADER:\n;CODE  : ASCII\n;FILE  : board-1-2.drl\n\
             ;   Holesize 1. = 0.800000 Tolerance = +0.000000/-0.000000 PLATED MM Quantity = 10\n\
             ;   Holesize 2. = 3.200000 Tolerance = +0.000000/-0.000000 NON_PLATED MM Quantity = 4\n\
             %\nG90\n{}M00\n{}M30\n",
            hits(&small),
            hits(&large)
        );
        let line = "X0000500000Y0000500000D02*X0001500000D01*";
        let all = set(&[
            ("TOP.art", layer("")),
            ("BOTTOM.art", layer(line)),
            ("board-1-2.drl", program.into_bytes()),
        ]);
        let drill = all.files[2].drill.as_ref().unwrap();
        let sizes: Vec<_> =
            drill.tools.iter().map(|tool| (tool.diameter.unwrap().nm(), tool.plated)).collect();
        assert_eq!(sizes, [(800_000, Some(true)), (3_200_000, Some(false))]);
        assert_eq!(drill.counts().iter().map(|counts| counts.hits).collect::<Vec<_>>(), [10, 4]);
        assert_eq!(drill.hits[0].at, crate::geometry::Point::from_mm(5.0, 5.0));
        assert_eq!(
            codes(&all.files[2], Severity::Error),
            Vec::<&str>::new(),
            "{:?}",
            all.files[2].diagnostics
        );
        assert_eq!(all.files[2].board, all.files[0].board);
    }
}
