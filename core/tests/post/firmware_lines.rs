//! Lines that GRBL 1.1h accepts or refuses, with its answers (`tests/data/gcode/grbl-lines.tsv`): both readers of G-code do the same, or
//! refuse with a sentence what they can't follow. `bridge/tests/grbl/check.rs` asks the firmware itself.

use annulus_core::diagnostic::Diagnostic;
use annulus_core::gcode::Interpreter;
use annulus_core::grbl;
use annulus_core::post::{read_back_for, titled};
use std::collections::BTreeMap;

const ROWS: &str = include_str!("../../../tests/data/gcode/grbl-lines.tsv");
const HEAD: &str = "T1\nM3 S1000\nG0 X0 Y0 Z1\n";

/// The code of a refusal, "-" without one; checks that it has its sentence, and GRBL's number if it has a number.
fn code(refusal: Option<Diagnostic>, number: &str) -> String {
    let Some(why) = refusal else { return "-".to_owned() };
    assert!(!why.message("en").contains('{') && !why.advice("en").is_empty(), "{why:?}");
    if number != "0" && why.code.starts_with("gcode.") {
        assert_eq!(why.argument(&["number"]), Some(number), "{why:?}");
    }
    why.code
}

#[test]
fn readers_accept_what_the_firmware_accepts_or_explain() {
    let tools: BTreeMap<_, _> = (0..256).map(|number| (number, titled("end mill 1").unwrap())).collect();
    let mut wrong = Vec::new();
    for row in ROWS.lines().filter(|row| !row.starts_with('#')) {
        let [number, prove, run, lines] = row.split('\t').collect::<Vec<_>>().try_into().unwrap();
        let text = format!("{HEAD}{}\n", lines.replace('|', "\n"));
        let proved = code(read_back_for("t.nc", &text, &tools, Interpreter::Grbl).err(), number);
        let text = format!("{text}G90 G21 G0 X0 Y0 Z1\nG1 Z-1 F9\nG0 Z2\n");
        let ran = code(grbl::read("t", &[("t.nc".to_owned(), text)]).err(), number);
        if (proved.as_str(), ran.as_str()) != (prove, run.replace('+', "-").as_str()) {
            wrong.push(format!("{row}: {proved} {ran}"));
        }
        assert!(number == "0" || prove != "-" && run != "-", "{row}: the firmware refuses it");
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn carriage_return_ends_a_line_of_grbl() {
    let tools = BTreeMap::from([(1, titled("end mill 1").unwrap())]);
    let text = format!("{HEAD}G1 Z-1 F9\nX1\rY2\r\nG0 Z1\n");
    let read = read_back_for("t.nc", &text, &tools, Interpreter::Grbl).unwrap();
    assert!((annulus_core::job::milled_mm(&read.program).iter().sum::<f64>() - 3.0).abs() < 1e-9);
    let routine = grbl::read("t", &[("t.nc".to_owned(), text)]).unwrap();
    let lines: Vec<u32> =
        routine.sections.iter().flat_map(|section| &section.actions).filter_map(line).collect();
    assert_eq!(lines[lines.len() - 3..], [5, 6, 7], "each part is a line");
}

fn line(action: &grbl::RoutineAction) -> Option<u32> {
    if let grbl::RoutineAction::Go(step) = action { Some(step.line) } else { None }
}

#[test]
fn realtime_characters_are_reported() {
    let tools = BTreeMap::from([(1, titled("end mill 1").unwrap())]);
    for (comment, acts) in [
        ("(go)", false),
        ("(what?)", false),
        ("(30\u{b0})", false),
        ("(careful!)", true),
        ("; ko\u{144}", true),
        ("(a \u{2013} b)", true),
        ("(\u{fffd})", true),
        ("(\u{18})", true),
    ] {
        let text = format!("{HEAD}G1 Z-1 F9 {comment}\nX1\nG0 Z1\n");
        let read = read_back_for("t.nc", &text, &tools, Interpreter::Grbl).unwrap();
        let found = read.diagnostics.iter().any(|said| said.code == "readback.acts_at_once");
        assert_eq!(found, acts, "{comment}");
    }
}

#[test]
fn move_behind_a_message_word_is_followed() {
    let tools: BTreeMap<_, _> = [(1, titled("end mill 1").unwrap())].into();
    let read = |line: &str, of| {
        let text = format!("{HEAD}G1 Z-1 F9\n{line}\nG0 Z2\nM2\n");
        read_back_for("t.nc", &text, &tools, of).map(|back| back.program.legs).map_err(|why| why.code)
    };
    for of in [Interpreter::LinuxCnc, Interpreter::Any] {
        assert_eq!(read("M117 G1 X30", of), read("G1 X30", of));
    }
    // Words for people: Marlin shows them, LinuxCNC refuses them.
    assert_eq!(read("M117 hello there", Interpreter::Any), read("", Interpreter::Any));
    assert_eq!(read("M117 hello there", Interpreter::LinuxCnc), Err("readback.unknown_word".to_owned()));
}
