//! What one drill file says of another of its folder, once both are read.
//!
//! ```text
//!   board.DRL  punched tape, refused ◀── board.TXT  the same program as text: nothing is missing
//!   copy.drl   byte for byte that ◀── board.drl  the first of them makes the board
//!   board-NPTH.drl  holes in no pad  ◀── board.drl  moved by (x, y) to lie on its pads: so are they
//! ```
//!
//! Comes in: the files of a set, read. Goes out: their diagnostics and shifts, mended. Does not read anything.

use super::companion::{base, folder, stem};
use super::registration::FITS_SHARE;
use super::{FileKind, FileRead};
use crate::diagnostic::{Diagnostic, Severity};
use std::collections::BTreeMap;

/// Shifts this near to each other are one, in mm.
const SAME_MM: f64 = 0.05;

/// Lets the drill files of a set know of each other.
pub(super) fn settle(files: &mut [FileRead]) {
    tapes(files);
    shifts(files);
    copies(files);
}

/// Of drill programs with equal contents the first makes the board, as [`super::Artwork::default_use`] has it; the others say so.
fn copies(files: &mut [FileRead]) {
    let mut first: BTreeMap<u64, String> = BTreeMap::new();
    for file in files.iter_mut().filter(|file| file.is_program_with_holes()) {
        match first.get(&file.fingerprint) {
            Some(twin) => {
                let told = Diagnostic::note("set.same_drill").at(&file.name, 0, 0).with("twin", twin);
                file.diagnostics.push(told);
            }
            None => drop(first.insert(file.fingerprint, file.name.clone())),
        }
    }
}

/// A punched tape beside a drill program of its name loses nothing: CAD programs write both of one board.
fn tapes(files: &mut [FileRead]) {
    let programs: Vec<String> =
        files.iter().filter(|file| file.is_program_with_holes()).map(|file| file.name.clone()).collect();
    for file in files.iter_mut().filter(|file| file.kind == FileKind::Refused) {
        let (of, name) = (folder(&file.name), stem(&file.name));
        let twin = programs.iter().find(|twin| folder(twin) == of && stem(twin).eq_ignore_ascii_case(name));
        let tape = file.diagnostics.iter_mut().find(|diagnostic| diagnostic.code == "refused.eia_tape");
        if let (Some(twin), Some(tape)) = (twin, tape) {
            tape.severity = Severity::Note;
            let told = Diagnostic::note("set.tape_twin").at(&file.name, 0, 0);
            file.diagnostics.push(told.with("twin", base(twin)));
        }
    }
}

/// Unplated holes need not lie on copper: they are moved as the other holes of their folder are, if these agree.
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
            file.diagnostics.push(Diagnostic::note("drill.shifted_with_others").at(&file.name, 0, 0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Artwork, Overrides, Source, read_set};
    use super::*;

    /// A program of holes in two rows, in millimetres, with this on its second line.
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

    /// Words of a drill program in EIA tape code.
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
    fn a_tape_beside_its_text_is_no_error() {
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
    fn a_copy_of_a_drill_program_says_which_one_is_used() {
        let text = program(";text", &[(1.0, 1.0), (2.0, 1.0), (3.0, 4.0)]);
        let other = program(";text", &[(1.0, 1.0), (2.0, 5.0), (3.0, 4.0)]);
        let all = set(&[("a.drl", text.clone()), ("b.drl", other), ("c.drl", text)]);
        assert_eq!(all.default_use(), [0, 1]);
        let said = |at: usize| codes(&all.files[at], Severity::Note).contains(&"set.same_drill");
        assert_eq!([0, 1, 2].map(said), [false, false, true]);
        let message = all.files[2].diagnostics.last().unwrap().message("en");
        assert!(message.contains("a.drl"), "{message}");
    }

    /// Pads on a crooked grid, so that no shift but one fits, and their layer.
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
    fn unplated_holes_are_not_doubted_for_lying_beside_the_copper() {
        let (pads, layer) = pads();
        // A tenth of the pads' places: other digits would put every hole on a pad.
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
    fn unplated_holes_are_moved_with_the_plated_ones_and_never_alone() {
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
    fn a_report_of_another_board_is_no_evidence() {
        // Whole inches of 2.4: 1.0000 × 0.5000. The report of the other board says millimetres of 3.3, and tools of its own.
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
            assert_eq!(good.units, Some(super::super::Units::Inch));
        }
        let good = read(false, Some(&own)).drill.unwrap().tools[0].diameter.map(|size| size.nm());
        assert_eq!(good, Some(812_800));
        // One hole more in a later state is no other board.
        let later = report("1/10000 Inch", &[(1, "0.0320inch", 10), (2, "0.0400inch", 5)]);
        assert_eq!(codes(&read(true, Some(&later)), Severity::Warning), ["drill.report_counts_differ"]);
    }
}
