//! Lines that each controller refuses or accepts.

use super::*;

fn words(line: &str) -> Vec<(char, f64)> {
    let word = |word: &str| (word.chars().next().unwrap(), word[1..].parse().unwrap());
    line.split_whitespace().map(word).collect()
}

/// GRBL's error number for the last of these lines; `None` if it is accepted.
fn number(of: Interpreter, lines: &str) -> Option<u16> {
    let mut judge = Judge::new(of);
    let mut last = Ok(());
    for line in lines.split('|') {
        if last.is_err() {
            break;
        }
        last = judge.line(&words(line), line.replace(' ', "").len());
    }
    last.err().map(|why| why.number)
}

use Interpreter::{Any, Grbl, GrblHal, LinuxCnc};

/// Lines, and what GRBL 1.1, grblHAL, LinuxCNC and a controller that nobody named make of the last one: 0 is accepted. GRBL's numbers
/// are those that the firmware answers.
const ROWS: &[(&str, [u16; 4])] = &[
    ("G0 X1 Y1 I3 J4", [36, 36, 36, 36]),
    ("G1 X1 Y1 I3 J4 F100", [36, 36, 36, 36]),
    ("G1 X1 F100 R2", [36, 36, 36, 36]),
    ("G1 X1 F100 P2", [36, 36, 36, 36]),
    ("G1 X1 F100 L2", [36, 36, 36, 36]),
    ("G1 X1 F100 K2", [36, 36, 36, 36]),
    ("G1 X1 F100 Q2", [20, 36, 36, 36]),
    ("G1 X1 F100 E2", [20, 36, 36, 36]),
    ("G1 X1 F100 H2", [20, 36, 36, 0]),
    ("G1 X1 F100|I1 J1", [36, 36, 36, 36]),
    ("G2 X2 I1 F100|R5", [36; 4]),
    ("R5", [36, 36, 36, 36]),
    ("G2 X1 Y1 R2 I1 F100", [36, 36, 36, 36]),
    ("G2 X1 Y1 F100", [35, 35, 35, 35]),
    ("G2 F100", [26, 26, 35, 35]),
    ("G2 X2 K1 F100", [35; 4]),
    ("G2 Z-1 I1 F100", [32, 32, 0, 0]),
    ("G2 I1 F100", [26, 26, 0, 0]),
    ("G2 X2 I1 J0 Z-1 F100", [0, 0, 0, 0]),
    ("G3 X1 Y1 R-2 F100", [0, 0, 0, 0]),
    ("G2 X2 I1 P2 F100", [36, 0, 0, 0]),
    ("G1 X1", [22, 22, 22, 0]),
    ("G1", [22, 22, 22, 0]),
    ("G1 F100|X1", [0, 0, 0, 0]),
    ("G1 F0|X1", [22, 22, 22, 0]),
    ("G93 G1 X1 F10|X2", [22, 22, 22, 0]),
    ("G0 G1 X1 F100", [24, 24, 24, 24]),
    ("G0 G0 X1", [24, 24, 24, 24]),
    ("G90 G91", [21, 21, 21, 21]),
    ("G20 G21", [21; 4]),
    ("G17 G18", [21; 4]),
    ("G54 G55", [21; 4]),
    ("G93 G94", [21; 4]),
    ("M3 M5", [21; 4]),
    ("M3 S100 M4", [21; 4]),
    ("M0 M2", [21; 4]),
    ("M8 M9", [21; 4]),
    ("M3 M8 S100", [0; 4]),
    ("G80 G0 X1", [21, 21, 0, 0]),
    ("G80|X1", [31, 31, 31, 31]),
    ("G80|G0 X1", [0; 4]),
    ("G0 X1 X2", [25; 4]),
    ("G1 F1 F2 X1", [25; 4]),
    ("S1 S2", [25; 4]),
    ("G4", [28, 28, 28, 28]),
    ("G4 P1", [0; 4]),
    ("G4 X1", [28, 28, 31, 0]),
    ("G4 S1", [28, 28, 28, 0]),
    ("G4 P-1", [4; 4]),
    ("G10 L2 P1", [26, 26, 0, 0]),
    ("G92", [26; 4]),
    ("G28 G92 X1", [24; 4]),
    ("G28 G1 X1 F1", [24; 4]),
    ("G28 X1", [0; 4]),
    ("G38.2 F100", [26; 4]),
    ("G38.2 Z-1 F100", [0; 4]),
    ("G43.1 Z1", [0; 4]),
    ("G43.1 Z1 G1 F100", [24; 4]),
    ("G43 H1", [20, 0, 0, 0]),
    ("G41 D1", [20, 20, 0, 0]),
    ("G64 P0.01", [20, 20, 0, 0]),
    ("G61.1", [20, 20, 0, 0]),
    ("G81 X1 Z-1 R1 F100", [20, 0, 0, 0]),
    ("G90.1", [20, 20, 0, 0]),
    ("G53 G0 X1", [0; 4]),
    ("G2 X2 I1 F100|G53 X1 I1", [30; 4]),
    ("G0.5 X1", [23, 23, 23, 0]),
    ("G1.004 X1 F1", [0, 23, 23, 23]),
    ("M3.4", [23; 4]),
    ("M6 T1", [20, 0, 0, 0]),
    ("M7", [20, 0, 0, 0]),
    ("M98 P1", [20, 20, 20, 0]),
    ("M117", [20, 20, 0, 0]),
    ("T1.5", [0, 23, 23, 23]),
    ("G49.1", [0, 23, 23, 0]),
    ("G59.9", [23, 20, 20, 0]),
    ("G10 L2 X1", [0, 28, 28, 0]),
    ("T256", [38, 0, 0, 0]),
    ("T-1", [4; 4]),
    ("F-5", [4; 4]),
    ("S-5", [4; 4]),
    ("N10000001 G0 X1", [27, 27, 0, 0]),
    ("N10 G0 X1", [0; 4]),
    ("G0 A1", [20, 20, 0, 0]),
    ("G0 U1", [20, 20, 0, 0]),
    ("X5", [0, 0, 31, 0]),
    ("G1 N7 X1 F100", [0, 0, 20, 0]),
    ("G2 X2 I1 K0.5 F100", [0, 0, 36, 0]),
    ("G1 X1 F100|G94|X2", [0, 0, 22, 0]),
    ("G1 F100|G53", [0, 0, 30, 0]),
    ("G81 X1 Z-1 F100", [20, 28, 28, 0]),
    ("G81 X1 R1 F100", [20, 28, 28, 0]),
    ("G83 X1 Z-1 R1 F100", [20, 28, 28, 0]),
    ("G83 X1 Z-1 R1 Q0 F100", [20, 4, 4, 0]),
    ("G82 X1 Z-1 R1 F100", [20, 28, 28, 0]),
    ("G81 X1 Z-1 R-2 F100", [20, 33, 33, 0]),
    ("G81 X1 Z-1 R1 L0 F100", [20, 4, 4, 0]),
    ("G81 X1 Z-1 R1 F100|X2", [20, 0, 0, 0]),
    ("G91 G81 X1 Z-1 R-2 F100", [20, 0, 0, 0]),
    ("G97 S1000", [20, 20, 0, 0]),
    ("M3 M8 M48 M0 M61 Q1", [20, 0, 21, 0]),
    ("M66 P0 L1", [20, 0, 28, 0]),
    ("M66 P0 L1 Q2", [20, 0, 0, 0]),
    ("G80 G1 X1 F100", [21, 21, 0, 0]),
    ("G43.1", [37, 37, 0, 37]),
];

#[test]
fn each_controller_refuses_lines_by_its_own_rules() {
    let mut wrong = Vec::new();
    for (lines, wanted) in ROWS {
        let found = [Grbl, GrblHal, LinuxCnc, Any].map(|of| number(of, lines).unwrap_or(0));
        if found != *wanted {
            wrong.push(format!("{lines}: {found:?} for {wanted:?}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn line_too_long_for_the_buffer_is_refused() {
    let line = format!("G1 F100 X1.{}", "0".repeat(70));
    assert_eq!(line.replace(' ', "").len(), 79);
    for (extra, wanted) in [("", None), ("0", Some(11))] {
        assert_eq!(number(Grbl, &format!("{line}{extra}")), wanted);
        assert_eq!(number(GrblHal, &format!("{line}{extra}")), None);
    }
}

#[test]
fn sender_may_omit_lines_it_writes_itself() {
    let mut judge = Judge::of_sender(Grbl);
    for line in ["M6 T1", "M7", "G2 I4.5 F100", "G2 Z-1 I4.5", "G1 X1"] {
        assert_eq!(judge.line(&words(line), 9), Ok(()), "{line}");
    }
    assert_eq!(judge.line(&words("G0 X1 I1"), 9).unwrap_err().number, 36);
    assert_eq!(judge.line(&words("M6 M0"), 9), Ok(()));
}

#[test]
fn every_refusal_has_a_text() {
    for (lines, _) in ROWS {
        for of in Interpreter::KNOWN {
            let mut judge = Judge::new(of);
            for why in lines.split('|').filter_map(|line| judge.line(&words(line), 9).err()) {
                let said = why.diagnostic(of);
                assert!(!said.message("en").contains('{') && !said.advice("en").is_empty(), "{why:?}");
            }
        }
    }
}
