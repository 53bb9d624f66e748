//! Tests of programs in other controllers' languages: read back by readers that follow the controllers'
//! rules, then compared with the program within a micrometre. A failure prints its seed.

use annulus_core::job::Program;
use annulus_core::post::{self, Dialect, FileSplit, Helix, OutputFile};
use annulus_core::units::Length;
use seen::{Exactness, Seen, compare};

mod again;
mod excellon;
mod files;
mod firmware_lines;
mod golden;
mod klartext;
mod letters;
mod lines;
mod programs;
mod robots;
mod seen;
mod templates;

const PROGRAMS: u64 = 300;

const ISO: &[&str] = &["G0", "G1", "G2", "G3", "G4", "G17", "G21", "G90", "G91.1", "G94", "M2", "M3", "M5"];

fn read(name: &str, file: &OutputFile, safe: f64) -> Result<Vec<Seen>, String> {
    let iso = letters::Rules {
        codes: ISO,
        semicolon: false,
        pause: ('P', 1.0),
        cycle_pause: 1.0,
        longest: 255,
        feed_in_every_move: false,
        points: false,
        numbered: None,
    };
    let with = |more: &[&'static str]| -> &'static [&'static str] { [ISO, more].concat().leak() };
    let stem = file.name.split_once('.').map_or(file.name.as_str(), |(stem, _)| stem);
    match name {
        "grbl" => {
            letters::read(&file.text, safe, &letters::Rules { codes: with(&["M0"]), longest: 80, ..iso })
        }
        "linuxcnc" => {
            let codes = with(&["G40", "G43", "G49", "G64", "G80", "G82", "G98", "M6"]);
            letters::read(&file.text, safe, &letters::Rules { codes, ..iso })
        }
        "mach3" => {
            let codes = with(&["G40", "G43", "G49", "G53", "G80", "M6", "M30"]);
            letters::read(&file.text, safe, &letters::Rules { codes, ..iso })
        }
        "marlin" => {
            let codes = &["G0", "G1", "G2", "G3", "G4", "G21", "G90", "M0", "M3", "M5", "M117", "M400"];
            let rules =
                letters::Rules { codes, pause: ('S', 1.0), semicolon: true, feed_in_every_move: true, ..iso };
            letters::read(&file.text, safe, &rules)
        }
        "sinumerik" => {
            let codes = with(&["G54", "G64", "G71", "M6", "M30", "CYCLE82"]);
            let rules =
                letters::Rules { codes, pause: ('F', 1.0), semicolon: true, numbered: Some(10), ..iso };
            letters::read(&file.text, safe, &rules)
        }
        "fanuc" => {
            let codes = with(&["G28", "G40", "G43", "G49", "G54", "G80", "G82", "G91", "G98", "M6", "M30"]);
            let rules = letters::Rules {
                codes,
                pause: ('X', 1.0),
                cycle_pause: 1e-3,
                points: true,
                numbered: Some(10),
                ..iso
            };
            letters::read(&file.text, safe, &rules)
        }
        "heidenhain" => klartext::read(&file.text, safe),
        "kuka" => robots::krl(&file.text, stem),
        "abb" => robots::rapid(&file.text, stem),
        "fanuc_tp" => robots::tp(&file.text, stem),
        _ => Err(format!("no reader for {name}")),
    }
}

fn exactness(name: &str, dialect: &Dialect) -> Exactness {
    let arcs = &dialect.arcs;
    let lines = arcs.lines_only || arcs.helix == Helix::Lines || arcs.smallest_mm > 0.0;
    let chord = if lines { arcs.chord_error_mm } else { 0.0 };
    let fall_to = dialect.fall_to.map(Length::mm);
    match name {
        // One digit of mm/s, two digits of a second.
        "fanuc_tp" => Exactness { feed: 3.001, wait: 0.005_1, chord, fall_to },
        _ => Exactness { feed: 0.050_1, wait: 0.000_51, chord, fall_to },
    }
}

fn one(files: Vec<OutputFile>) -> OutputFile {
    assert_eq!(files.len(), 1);
    files.into_iter().next().unwrap()
}

fn through(name: &str, dialect: &Dialect, program: &Program) -> Result<(), String> {
    let dialect = &dialect.clone().in_files(Some(FileSplit::Job));
    let file = one(post::write_with(dialect, program).map_err(|diagnostic| diagnostic.message("en"))?);
    let seen = read(name, &file, program.safe_height.mm())?;
    compare(&seen, program, exactness(name, dialect))
}

#[test]
fn every_postprocessor_reads_back_as_its_program() {
    for (name, text) in post::shipped() {
        let slow = Dialect::parse(name, text).unwrap();
        for seed in 0..PROGRAMS {
            // In every second program the tool falls rapidly to just above the board.
            let fall_to = (seed % 2 == 1).then_some(Length::from_um(300));
            let dialect = slow.clone().falling_to(fall_to);
            let program = programs::random_program(seed, None);
            if let Err(why) = through(name, &dialect, &program) {
                panic!("{name}, seed {seed}: {why}");
            }
        }
    }
}

#[test]
fn every_postprocessor_can_write_without_arcs() {
    for (name, text) in post::shipped() {
        let dialect = Dialect::parse(name, text).unwrap().with_lines(Some(0.02));
        let dialect = dialect.in_files(Some(FileSplit::Job));
        for seed in 0..PROGRAMS / 10 {
            let program = programs::random_program(seed, None);
            let file = one(post::write_with(&dialect, &program).unwrap());
            let seen = read(name, &file, 2.0).unwrap_or_else(|why| panic!("{name}, seed {seed}: {why}"));
            assert!(!seen.iter().any(|seen| matches!(seen, Seen::Arc { .. })), "{name}, seed {seed}");
            if let Err(why) = compare(&seen, &program, exactness(name, &dialect)) {
                panic!("{name}, seed {seed}: {why}");
            }
        }
    }
}

#[test]
fn wrong_word_is_found() {
    // Faults that the readers and the comparison must find.
    let dialect = post::dialect("grbl").unwrap().unwrap().in_files(Some(FileSplit::Job));
    let program = programs::small();
    let file = one(post::write_with(&dialect, &program).unwrap());
    let rows = [
        ("G2 X25.0000", "G3 X25.0000"),
        ("I0.0000 J5.0000", "I0.0000 J5.0020"),
        ("X20.0000 Y10.0000", "X20.0003 Y10.0000"),
        ("F600.0", "F601.0"),
        ("G0 X12.700", "G1 X12.700"),
        ("M3 S24000", "M3 S2400"),
        ("put in tool 2", "put in tool 1"),
        ("G4 P0.100", "G4 P0.200"),
        ("G1 Z-2.100", "G81 Z-2.100"),
    ];
    let verdict = |text: String| {
        let seen = read("grbl", &OutputFile { text, ..file.clone() }, 2.0)?;
        compare(&seen, &program, exactness("grbl", &dialect))
    };
    assert_eq!(verdict(file.text.clone()), Ok(()));
    for (from, to) in rows {
        assert!(file.text.contains(from), "{from} in {}", file.text);
        assert!(verdict(file.text.replacen(from, to, 1)).is_err(), "{to}");
    }
}
