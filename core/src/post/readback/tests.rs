//! Reads written files back and compares them with their program: every shipped dialect, and foreign G-code.

use super::*;
use crate::gcode::Interpreter;
use crate::geometry::Point;
use crate::job::{Command, Cutter, Leg, Mark};
use crate::post;
use crate::units::Length;

fn tools(rows: &[(u32, &str)]) -> BTreeMap<u32, Bit> {
    rows.iter().map(|(number, title)| (*number, titled(title).unwrap())).collect()
}

fn read(text: &str, rows: &[(u32, &str)]) -> ReadBack {
    read_back("t.nc", text, &tools(rows))
        .unwrap_or_else(|why| panic!("{}: {:?}", why.message("en"), why.place))
}

type Place = (i64, i64, i64);

/// Position and depth of holes, and corners of paths, in µm.
fn done(program: &Program) -> Vec<(u32, &'static str, Vec<Place>)> {
    let um = |length: Length| libm::round(length.mm() * 1e3) as i64;
    let (mut bit, mut at, mut out) = (0, Point::default(), Vec::new());
    for leg in &program.legs {
        if let Mark::ToolChange(next) = leg.mark {
            bit = next;
        }
        let mut places = Vec::new();
        for command in &leg.commands {
            match *command {
                Command::Rapid { to } => at = to,
                Command::Plunge { to, .. } if to < Length::ZERO => places.push((um(at.x), um(at.y), um(to))),
                Command::Mill { to, height, .. } | Command::MillArc { to, height, .. } => {
                    at = to;
                    places.push((um(to.x), um(to.y), um(height)));
                }
                _ => {}
            }
        }
        match leg.mark {
            Mark::Hole(_) => out.push((bit, "hole", places)),
            Mark::Toolpath(_) => out.push((bit, "way", places)),
            _ => {}
        }
    }
    out
}

fn program() -> Program {
    let mm = Length::from_mm;
    let bit = |title: &str| titled(title).unwrap();
    let go = |x: f64, y: f64| Command::Rapid { to: Point::from_mm(x, y) };
    let down = |z: f64| Command::Plunge { to: mm(z), feed_um_per_s: 2_000, gate: None };
    let up = Command::Retract { to: mm(2.0) };
    let mill = |x: f64, y: f64, z: f64| Command::Mill {
        to: Point::from_mm(x, y),
        height: mm(z),
        feed_um_per_s: 5_000,
    };
    let arc = |x: f64, y: f64, cx: f64, cy: f64, z: f64, ccw| Command::MillArc {
        to: Point::from_mm(x, y),
        height: mm(z),
        center: Point::from_mm(cx, cy),
        ccw,
        feed_um_per_s: 5_000,
    };
    let on = |bit| Leg {
        mark: Mark::ToolChange(bit),
        commands: vec![
            Command::Spindle { rpm: 0 },
            Command::AwaitBit { bit },
            Command::Spindle { rpm: 12_000 },
        ],
    };
    let leg = |mark, commands: Vec<Command>| Leg { mark, commands };
    let way = vec![
        go(1.0, 1.0),
        down(-0.1),
        mill(5.0, 1.0, -0.1),
        arc(6.0, 2.0, 5.0, 2.0, -0.1, true),
        mill(6.0, 4.0, -0.1),
        up,
    ];
    let turn =
        vec![go(10.0, 5.0), down(0.0), arc(10.0, 5.0, 9.0, 5.0, -0.5, false), mill(12.0, 5.0, -0.5), up];
    Program {
        name: "board".to_owned(),
        machine: String::new(),
        origin: Point::default(),
        bits: vec![bit("V-bit 30°, tip 0.1"), bit("drill 0.8"), bit("end mill 1")],
        spindles: 1,
        safe_height: mm(2.0),
        legs: vec![
            on(0),
            leg(Mark::Toolpath(0), way),
            on(1),
            leg(Mark::Hole(0), vec![go(3.0, 3.0), down(-2.0), up]),
            leg(Mark::Hole(1), vec![go(-4.0, 3.5), down(-2.0), up]),
            on(2),
            leg(Mark::Toolpath(1), turn),
            leg(Mark::Finish, vec![Command::Spindle { rpm: 0 }, go(0.0, 0.0)]),
        ],
        accepted: Vec::new(),
    }
}

/// Tool, end point and length of each leg: arcs may have become lines.
fn ends(program: &Program) -> Vec<((u32, &'static str, Place), f64)> {
    let milled = crate::job::milled_mm(program);
    let legs = program.legs.iter().zip(milled);
    let cuts =
        legs.filter(|(leg, _)| matches!(leg.mark, Mark::Hole(_) | Mark::Toolpath(_))).map(|(_, mm)| mm);
    let done = done(program).into_iter().map(|(bit, word, places)| (bit, word, *places.last().unwrap()));
    done.zip(cuts).collect()
}

#[test]
fn every_shipped_dialect_reads_back_as_its_program() {
    let program = program();
    let known = tools(&[(1, "V-bit 30°, tip 0.1"), (2, "drill 0.8"), (3, "end mill 1")]);
    for (name, _) in post::shipped() {
        let files = post::write(name, &program, &post::Manner::default()).unwrap().unwrap();
        let mut found = Vec::new();
        for file in &files {
            let back = read_back(&file.name, &file.text, &known)
                .unwrap_or_else(|why| panic!("{name}: {} {:?}\n{}", why.message("en"), why.place, file.text));
            assert!(back.diagnostics.is_empty(), "{name}: {:?}", back.diagnostics);
            let first = back.program.bits.first().map(|bit| bit.cutter);
            let first = program.bits.iter().position(|bit| Some(bit.cutter) == first).unwrap() as u32;
            let ends = ends(&back.program).into_iter();
            found.extend(ends.map(|((bit, word, end), length)| ((bit + first, word, end), length)));
        }
        let wanted = ends(&program);
        assert_eq!(found.len(), wanted.len(), "{name}: {found:?}");
        for ((found, length), (wanted, exact)) in found.iter().zip(&wanted) {
            assert_eq!(found, wanted, "{name}");
            assert!((length - exact).abs() < 0.1, "{name}: {length} not {exact} mm");
        }
    }
}

#[test]
fn drill_files_read_back_their_holes() {
    let mut program = program();
    program.legs.retain(|leg| !matches!(leg.mark, Mark::Toolpath(_) | Mark::ToolChange(0 | 2)));
    let files = post::write("excellon", &program, &post::Manner::default()).unwrap().unwrap();
    let back = read_back(&files[0].name, &files[0].text, &BTreeMap::new()).unwrap();
    assert!(back.of_files);
    let holes: Vec<_> =
        done(&back.program).into_iter().map(|(_, word, places)| (word, places[0].0, places[0].1)).collect();
    assert_eq!(holes, [("hole", 3_000, 3_000), ("hole", -4_000, 3_500)]);
    assert_eq!(back.program.bits[0].diameter, Length::from_um(800));
}

#[test]
fn g_code_of_others_is_followed() {
    let vee = [(1, "V-bit 30°, tip 0.1")];
    let drill = [(1, "drill 1.0")];
    type Row<'r> = (&'r str, &'r [(u32, &'r str)], &'r [(&'r str, &'r [(i64, i64, i64)])]);
    let rows: [Row<'_>; 8] = [
        // Inches, relative, numbers without leading zeros, words without spaces, block numbers, skipped
        // blocks.
        (
            "%\nN10G20G91\nN20M3S9000\nG0X.1Y.1\nG1Z-.4F9\n/N30X.1\nZ.4\nM2\n",
            &vee,
            &[("way", &[(2_540, 2_540, -160), (5_080, 2_540, -160)])],
        ),
        // An arc by its radius, over half a circle and under it; a full circle without X and Y.
        (
            "G21 G90\nM3 S9000\nG0 X0 Y0\nG1 Z-1\nG2 X2 Y0 R1\nG3 X4 Y0 R-1.5\nG1 Y1\nG0 Z1\n",
            &vee,
            &[("way", &[(0, 0, -1_000), (2_000, 0, -1_000), (4_000, 0, -1_000), (4_000, 1_000, -1_000)])],
        ),
        (
            "M3 S1\nG0 X1 Y0\nG1 Z-1\nG2 I-1 J0\nG0 Z1",
            &vee,
            &[("way", &[(1_000, 0, -1_000), (1_000, 0, -1_000)])],
        ),
        // A mill that only moves down and up makes no hole.
        ("M3 S1\nG0 X1 Y0\nG1 Z-1\nG0 Z1", &vee, &[("way", &[(1_000, 0, -1_000)])]),
        // Cycles are modal, G80 ends them, G99 stays low, L0 only stores the numbers, relative ones repeat.
        (
            "G21 G90 M3 S1\nG0 Z5\nG99 G81 X1 Y1 Z-2 R1 F50\nX2\nG98 Y3\nG80\nG0 X9 Y9\n",
            &drill,
            &[
                ("hole", &[(1_000, 1_000, -2_000)]),
                ("hole", &[(2_000, 1_000, -2_000)]),
                ("hole", &[(2_000, 3_000, -2_000)]),
            ],
        ),
        (
            "G21 G91 M3 S1\nG83 X1 Y0 Z-3 R-9 Q1 L2\nG80\n",
            &drill,
            &[("hole", &[(1_000, 0, -2_000)]), ("hole", &[(2_000, 0, -2_000)])],
        ),
        // Absolute centres, and a return home in machine coordinates.
        (
            "G90 G90.1 M3 S1\nG0 X10 Y10\nG1 Z-1\nG3 X12 Y12 I10 J12\nG91 G28 Z0\nG90 G0 X0 Y0\n",
            &vee,
            &[("way", &[(10_000, 10_000, -1_000), (12_000, 12_000, -1_000)])],
        ),
        // A move down in G0 is reported, and followed.
        ("M3 S1\nG0 X1 Y1 Z-1\nG0 Z5", &drill, &[("way", &[(1_000, 1_000, -1_000)])]),
    ];
    for (text, known, wanted) in rows {
        let back = read(text, known);
        let found = done(&back.program);
        let found: Vec<_> = found.iter().map(|(_, word, places)| (*word, places.as_slice())).collect();
        assert_eq!(found, wanted, "{text}");
    }
    let told = read("M3 S1\nG0 X1 Y1\nG0 Z-1\nG0 Z5\n", &drill).diagnostics;
    assert_eq!(told[0].code, "readback.fast_in_board");
}

#[test]
fn lines_that_change_positions_are_refused() {
    let rows = [
        ("G21\nG0 X0 Y0\nG41 D1\nG1 X5\n", "readback.changes_place", 3),
        ("G21\nG0 X0 Y0\nG18\n", "readback.changes_place", 3),
        ("G0 X0 Y0\nG1 Z-1\nG92 X5\n", "readback.changes_place", 3),
        ("G21\nG0 X0 Y0\n#1=5\nG1 X#1\n", "readback.unknown_word", 3),
        ("G21\nG1 X#1\n", "readback.unknown_word", 2),
        ("(one line)\nG1 X#1\n", "readback.unknown", 2),
        ("", "readback.unknown", 1),
        ("G0 X0 Y0\nG1 X1 A30\n", "readback.changes_place", 2),
        ("G0 X0 Y0\nG1 Z-1\nG2 X5 Y0 I1 J0\n", "readback.no_arc", 3),
        ("G0 X0 Y0\nM98 P100\n", "readback.changes_place", 2),
        ("G0 X9000 Y0\nG0 X0\n", "readback.out_of_reach", 1),
        // Words that change the meaning of positions and zeros.
        ("G0 X0 Y0\nG10 L2 P1 X5\nG1 X1\n", "readback.changes_place", 2),
        ("G0 X0 Y0\nG10 P1 X5\nG1 X1\n", "readback.changes_place", 2),
        ("G0 X0 Y0\nG1 X5 L3\n", "gcode.unused_word", 2),
        ("G0 X0 Y0\nG5 X5 Y5 I1 J1 P1 Q1\n", "readback.changes_place", 2),
        ("G0 X0 Y0\nG6 X5\n", "readback.changes_place", 2),
        ("G54\nG0 X0 Y0\nG55\nG0 X1\n", "readback.changes_place", 3),
        ("G55 G0 X0 Y0\nG54 G0 X1\n", "readback.changes_place", 2),
        ("G0 X0 Y0\nG56\nG0 X1\n", "readback.changes_place", 2),
        ("M3 S1\nG0 X1 Y0\nG1 Z-1\nG2 I-1 J0 P2\n", "readback.changes_place", 4),
        ("M3 S1\nG0 X1 Y0\nG1 Z-1\nG3 I-1 J0 TURN=2\n", "readback.unknown_word", 4),
        ("G0 X0 Y0\nG1 Z-1\nG4 P1 Y5\n", "gcode.unused_word", 3),
        ("G0 X0 Y0 Z5\nG0 X1 Y0\nCYCLE81(2,0,0.5,R1,3)\n", "readback.unknown_word", 3),
        // The position of the reference point over the board is unknown.
        ("G0 X0 Y0 Z5\nG28 X0 Y0\nG0 X1\nG1 Z-1\n", "readback.place_unknown", 4),
        ("G0 X0 Y0 Z5\nG28\nG0 Y1\nG1 Z-1\n", "readback.place_unknown", 4),
        ("G0 X0 Y0 Z5\nG91 G30 X0\nX1 Y1\nG1 Z-16\n", "readback.place_unknown", 4),
        ("G0 X0 Y0 Z5\nG53 G0 X0 Y0\nG81 X1 Z-1 R1\n", "readback.place_unknown", 3),
        ("G0 X0 Y0 Z5\nG53 G0 Z-50\nG1 X5\n", "readback.place_unknown", 3),
        ("G0 X0 Y0 Z5\nG53 G0 X0\nCYCLE81(2,0,1,-2)\n", "readback.place_unknown", 3),
        ("G0 X0 Y0\nG1 Z-1\nG28 X0 Y0\n", "readback.changes_place", 3),
        // Lines that no controller accepts.
        ("G0 X0 Y0 Z1\nG0 X3.5 Y-4 I0.5 J0\n", "gcode.unused_word", 2),
        ("G0 X0 Y0 Z1\nG1 Z-1 F9\nG0 G1 X1\n", "gcode.axes_twice", 3),
        ("G0 X0 Y0 Z1\nM3 M5\n", "gcode.same_group", 2),
        ("G0 X0 Y0 Z1\nG90 G91 X5\n", "gcode.same_group", 2),
        ("G0 X0 Y0 Z1\nG1 X1 X2\n", "gcode.repeated_word", 2),
        ("G0 X0 Y0 Z1\nG1 Z-1\nG2 X5 Y5\n", "gcode.no_centre", 3),
        ("G0 X0 Y0 Z1\nG1 X5 E3\n", "gcode.unused_word", 2),
        ("G0 X0 Y0 Z1\nG80\nX5\n", "gcode.axes_without_motion", 3),
        ("G0 X0 Y0 Z1\nG1.04 X5\n", "readback.changes_place", 2),
        ("G0 X0 Y0 Z1\nM3.4\nG1 X5\n", "gcode.not_whole", 2),
        // More than any board needs.
        ("G0 X0 Y0\nG91 G81 X0.001 Z-2 R1 L4000000\n", "readback.too_many", 2),
    ];
    for (text, code, line) in rows {
        let why = read_back("t.nc", text, &tools(&[(1, "end mill 1")])).unwrap_err();
        assert_eq!(
            (why.code.as_str(), why.place.as_ref().map(|place| place.line)),
            (code, Some(line)),
            "{text}"
        );
        assert!(!why.message("en").contains('{'), "{}", why.message("en"));
    }
    let why = read_back("t.nc", "M3 S1\nG0 X1 Y1\nG1 Z-1\n", &BTreeMap::new()).unwrap_err();
    assert_eq!(why.code, "readback.no_tool");
    let why = read_back("t.txt", "\nhello\nworld\n", &BTreeMap::new()).unwrap_err();
    assert_eq!((why.code.as_str(), why.place.map(|place| place.line)), ("readback.unknown", Some(2)));
    read("M3 S1 G0 X1 Y1 Z5", &[]);
}

#[test]
fn headers_and_messages_name_tools() {
    let text =
        "(job: board)\n(side: bottom)\n(tool 2: end mill 0.8)\nM3 S9000\nG0 X1 Y1\nG1 Z-1\nX5\nG0 Z5\n";
    let back = read(text, &[]);
    assert_eq!(back.side.as_deref(), Some("bottom"));
    assert_eq!((back.program.bits.len(), back.program.bits[0].cutter), (1, Cutter::Mill));
    let text = "G0 Z5\nM0 Put in tool 1: V-bit 22.5°, tip 0.08\nM3 S9000\nG0 X1 Y1\nG1 Z-1\nX5\n\
        G0 Z5\n(MSG, put in tool 2: drill 1.1)\nM0\nM3 S9000\nG0 X2 Y2\nG1 Z-2\nG0 Z5\n";
    let back = read(text, &[]);
    let cutters: Vec<_> = back.program.bits.iter().map(|bit| (bit.diameter.mm(), bit.cutter)).collect();
    let vee = Cutter::Vee { tip: Length::from_um(80), angle_mdeg: 22_500 };
    assert_eq!(cutters, [(3.175, vee), (1.1, Cutter::Drill)]);
    assert_eq!(
        done(&back.program).iter().map(|row| (row.0, row.1)).collect::<Vec<_>>(),
        [(0, "way"), (1, "hole")]
    );
    // The user's tools take precedence over the file.
    let back = read(text, &[(2, "drill 0.9")]);
    assert_eq!(back.program.bits[1].diameter, Length::from_um(900));
}

fn turning(program: &Program) -> Vec<bool> {
    let (mut turns, mut out) = (false, Vec::new());
    for command in program.legs.iter().flat_map(|leg| &leg.commands) {
        match *command {
            Command::Spindle { rpm } => turns = rpm > 0,
            Command::Plunge { to, .. } if to < Length::ZERO => out.push(turns),
            _ => {}
        }
    }
    out
}

#[test]
fn spindle_turns_after_its_command_and_not_its_speed() {
    let g_code = [
        ("G0 X0 Y0\nG1 Z-1 S9000\nX5 S9000\nG0 Z5\nG1 Z-1\n", [false, false]),
        ("M3\nS9000\nG0 X0 Y0\nG1 Z-1\nG0 Z5\nM5\nG1 Z-1\n", [true, false]),
        ("M3\nG0 X0 Y0\nG1 Z-1\nG0 Z5\nM4\nG1 Z-1\n", [true, true]),
        ("S9000\nG0 X0 Y0\nG1 Z-1\nG0 Z5\nM3\nG1 Z-1\n", [false, true]),
        ("M3 S0\nG0 X0 Y0\nG1 Z-1\nG0 Z5\nS9000\nG1 Z-1\n", [false, true]),
        ("M3 S9000\nG0 X0 Y0\nG1 Z-1\nG0 Z5\nM5\nG1 Z-1 S9000\n", [true, false]),
    ];
    for (text, wanted) in g_code {
        assert_eq!(turning(&read(text, &[(1, "drill 1.0")]).program), wanted, "{text}");
    }
    let klartext = [
        ("L Z+5 R0 FMAX M3\nL Z-1 R0 F100\nL Z+5 R0 FMAX M5\nL Z-1 R0 F100\n", [true, false]),
        ("L Z-1 R0 F100 M13\nL Z+5 R0 FMAX\nL Z-1 R0 F100\n", [true, true]),
        ("M3\nTOOL CALL S5000\nL Z-1 R0 F100\nL Z+5 R0 FMAX\nM5\nL Z-1 R0 F100\n", [true, false]),
    ];
    for (text, wanted) in klartext {
        let text = format!("BEGIN PGM T MM\n{text}END PGM T MM\n");
        assert_eq!(turning(&read(&text, &[(1, "drill 1.0")]).program), wanted, "{text}");
    }
}

/// Every text is refused at the line of its statement, with its code.
#[track_caller]
fn refused(rows: &[(String, &str)]) {
    for (text, code) in rows {
        let line = if text.starts_with("MODULE") || text.starts_with("/PROG") { 4 } else { 3 };
        let why = read_back("t", text, &tools(&[(1, "end mill 1")])).map(|_| ()).expect_err(text);
        assert_eq!((why.code.as_str(), why.place.map(|place| place.line)), (*code, Some(line)), "{text}");
    }
}

/// The height of the machine's top is unknown: X and Y may move rapidly there, but no cut is allowed before Z
/// is given.
#[test]
fn klartext_and_siemens_retract_to_the_machine_top() {
    let rows = [
        (
            "BEGIN PGM T MM\nTOOL CALL 1 Z S9000\nL Z+0 R0 FMAX M91\nL X+1 Y+2 R0 FMAX\nL Z+5 R0 FMAX\nL Z-1 R0 F100\nL Z+5 R0 FMAX\n",
            None,
        ),
        (
            "BEGIN PGM T MM\nTOOL CALL 1 Z S9000\nL Z+0 R0 FMAX M91\nL X+1 Y+2 R0 F100\n",
            Some("readback.place_unknown"),
        ),
        (
            "BEGIN PGM T MM\nTOOL CALL 1 Z S9000\nL Z+0 R0 FMAX M91\nCC X+1 Y+2\nC X+1 Y+2 R0 DR+ F100\n",
            Some("readback.place_unknown"),
        ),
        ("T1\nM6\nD1\nSUPA G0 Z0 D0\nG0 X1 Y2\nD1\nG0 Z5\nG1 Z-1 F100\nG0 Z5\n", None),
        ("T1\nM6\nD1\nSUPA G0 Z0 D0\nG1 X1 Y2 F100\n", Some("readback.place_unknown")),
    ];
    for (text, code) in rows {
        let found = read_back("t", text, &tools(&[(1, "end mill 1")]));
        assert_eq!(found.err().map(|why| why.code).as_deref(), code, "{text}");
    }
}

#[test]
fn klartext_refuses_unsupported_lines() {
    let klartext = [
        ("L X+1 RL F100", "readback.changes_place"),
        ("L X+1 RR F100", "readback.changes_place"),
        ("L X+Q1 R0 FMAX", "readback.unknown_word"),
        ("L X+1,5 R0 FMAX", "readback.unknown_word"),
        ("L Z-5 R0 FMAX M91", "readback.changes_place"),
        ("L X+1 A+30 R0 FMAX", "readback.unknown_word"),
        ("CC IX+1 IY+2", "readback.changes_place"),
        ("CC", "readback.unknown_word"),
        ("CP IPA+90 Z-1 DR+", "readback.unknown_word"),
        ("C X+1 Y+1 R0", "readback.unknown_word"),
        ("TOOL CALL \"MILL\" Z S9000", "readback.unknown_word"),
        ("TOOL CALL 1 Z S9000 DL+0.2", "readback.changes_place"),
        ("CALL LBL 1", "readback.unknown_word"),
    ];
    let rows: Vec<(String, &str)> = klartext
        .iter()
        .map(|(line, code)| (format!("BEGIN PGM T MM\nCC X+0 Y+0\n{line}\nEND PGM T MM\n"), *code))
        .collect();
    refused(&rows);
}

#[test]
fn robots_refuse_unsupported_lines() {
    let krl = [
        "LIN P1",
        "LIN {X 1, Y 2}",
        "PTP HOME",
        "PTP P1",
        "PTP {A1 0, A2 0}",
        "LIN {X 1, Y 2, Z 3} C_DIS",
        "FOR I = 1 TO 3",
        "WHILE TRUE",
        "REPEAT",
        "IF A THEN",
        "GOTO L1",
        "LIN_REL {X 1}",
        "CIRC {X 1, Y 1, Z 0}, {X 2, Y 0, Z 0}, CA 180",
        "$BASE = BASE_DATA[2]",
        "OTHER()",
    ];
    let rapid = [
        "IF a THEN",
        "GOTO l1;",
        "FOR i FROM 1 TO 3 DO",
        "WHILE TRUE DO",
        "MoveL p1,quick,fine,pcb_tool\\WObj:=b;",
        "MoveL [[1,1,1],down,free,none],quick,z10,pcb_tool\\WObj:=b;",
        "MoveL [[1,1,1],down,free,none],quick,fine,pcb_tool\\WObj:=c;",
        "MoveAbsJ home,quick,fine,t;",
        "other;",
    ];
    let tp = [
        "JMP LBL[1]",
        "CALL OTHER",
        "IF R[1]=1,JMP LBL[2]",
        "L PR[1] 100mm/sec FINE",
        "L P[9] 100mm/sec FINE",
        "FOR R[2]=1 TO 3",
        "L P[1] 100mm/sec CNT50",
        "L P[1] 100mm/sec FINE Offset,PR[1]",
        "UFRAME_NUM=2",
    ];
    let mut rows: Vec<(String, &str)> = Vec::new();
    rows.extend(
        krl.map(|line| (format!("DEF T( )\n$BASE = BASE_DATA[1]\n{line}\nEND\n"), "readback.unknown_word")),
    );
    let first = "MoveL [[0,0,1],down,free,none],quick,fine,pcb_tool\\WObj:=b;";
    rows.extend(
        rapid.map(|line| {
            (format!("MODULE T\nPROC main()\n{first}\n{line}\nENDPROC\n"), "readback.unknown_word")
        }),
    );
    let points = "/POS\nP[1]{\n X = 1 mm, Y = 1 mm, Z = 1 mm\n};\n/END\n";
    rows.extend(tp.map(|line| {
        (format!("/PROG T\n/MN\n 1: UFRAME_NUM=1 ;\n 2:{line} ;\n{points}"), "readback.unknown_word")
    }));
    refused(&rows);
}

#[test]
fn controller_dialects_refuse_their_unsupported_lines() {
    let tools = tools(&[(1, "end mill 1"), (2, "end mill 1")]);
    let head = "T1\nG21 G90\nM3 S1000\nG0 X0 Y0 Z1\nG1 Z-1 F60\n";
    let rows = [
        ("G64 P0.01\n", [20, 20, 0]),
        ("G2 I1\n", [26, 26, 0]),
        ("G81 X1 Z-1 R1\n", [20, 0, 0]),
        ("G90.1\n", [20, 20, 0]),
        ("M6 T2\n", [20, 0, 0]),
        ("G1 X1 Y1\n", [0, 0, 0]),
    ];
    for (line, wanted) in rows {
        for (of, wanted) in Interpreter::KNOWN.into_iter().zip(wanted) {
            let text = format!("{head}{line}G0 Z1\nM2\n");
            let why = read_back_for("t.nc", &text, &tools, of).err();
            let number =
                why.as_ref().and_then(|why| why.argument(&["number"])).map_or(0, |n| n.parse().unwrap());
            assert_eq!(number, wanted, "{of:?}: {line}");
            assert!(why.is_none_or(|why| why.place.unwrap().line == 6), "{line}");
        }
        let any = read_back("t.nc", &format!("{head}{line}G0 Z1\nM2\n"), &tools);
        let others = any.unwrap().others.len();
        assert_eq!(others, wanted.iter().filter(|number| **number > 0).count(), "{line}");
    }
}

#[test]
fn known_positions_survive_a_reference_return() {
    let drill = [(1, "drill 1.0")];
    let rows = [
        // Z alone, both named again, and the intermediate point of G28.
        "M3\nG0 X1 Y2 Z5\nG91 G28 Z0.\nG90\nG1 Z-1\nG0 Z5\n",
        "M3\nG0 X9 Y9 Z5\nG28 X0 Y0\nG0 X1\nG0 Y2\nG1 Z-1\nG0 Z5\n",
        "M3\nG53 G0 Z0\nG0 X1 Y2\nG0 Z5\nG1 Z-1\nG0 Z5\n",
        "M3\nG0 X1 Y2 Z5\nG28 Z-1\nG0 Z5\n",
        "M3\nG54 G0 X1 Y2 Z5\nG54\nG1 Z-1\nG0 Z5\n",
    ];
    for text in rows {
        let found: Vec<_> = done(&read(text, &drill).program).into_iter().map(|row| row.2).collect();
        assert_eq!(found, [[(1_000, 2_000, -1_000)]], "{text}");
    }
    let inches = "G70 G90\nM3 S1\nG0 X1 Y0\nCYCLE81(0.2,0,0.05,-0.04)\nCYCLE82(0.2,0,0.05,,0.04)\n";
    let found: Vec<_> = done(&read(inches, &drill).program).into_iter().map(|row| row.2).collect();
    assert_eq!(found, [[(25_400, 0, -1_016)], [(25_400, 0, -1_016)]]);
}

#[test]
fn move_limit_counts_all_lines() {
    let lines = "X0.001 L10000\n".repeat(200);
    let text = format!("G0 X0 Y0\nG91 G81 X0.001 Z-2 R1\n{lines}G80\n");
    let why = read_back("t.nc", &text, &tools(&[(1, "drill 1.0")])).unwrap_err();
    assert_eq!(why.code, "readback.too_many");
    assert!(!why.message("en").contains('{'), "{}", why.message("en"));
    let text = format!("G0 X0 Y0\nG0 Z1\n{}", "M3\nM5\n".repeat(2_100_000));
    let why = read_back("t.nc", &text, &tools(&[(1, "drill 1.0")])).unwrap_err();
    assert_eq!(why.code, "readback.too_many");
}

fn sixth(of: Interpreter, line: &str) -> Result<ReadBack, Diagnostic> {
    let head = "T1\nG21 G90\nM3 S1000\nG0 X0 Y0 Z1\nG1 Z-1 F60\n";
    let tools = tools(&[(1, "end mill 1")]);
    read_back_for("t.nc", &format!("{head}{line}\nG0 Z1\nM2\n"), &tools, of)
}

#[test]
fn axis_words_on_a_dwell_or_stop_line_move() {
    use Interpreter::{Any, Grbl, LinuxCnc};
    let cut = |of: Interpreter, line: &str| {
        let done = sixth(of, line).map(|back| done(&back.program)).unwrap_or_default();
        done.iter().flat_map(|(_, _, places)| places).any(|place| place.0 == 5_000)
    };
    for line in ["G4 P0.1 X5", "G4 P0.1 G1 X5", "M0 X5", "M1 G1 X5", "M0 (look) X5"] {
        assert!([Grbl, LinuxCnc].into_iter().all(|of| cut(of, line)), "{line}");
    }
    assert!(cut(Any, "M0 X5"));
    assert!(sixth(Any, "M0 Change the bit").is_ok() && sixth(Any, "G4 X5").is_ok());
    assert_eq!(sixth(Any, "G4 P0.1 X5").unwrap_err().code, "readback.changes_place");
    assert_eq!(sixth(Any, "G4 G1 X5").unwrap_err().code, "readback.changes_place");
}

#[test]
fn lines_foreign_to_a_controller_are_refused_with_their_number() {
    use Interpreter::{Any, Grbl, GrblHal, LinuxCnc};
    // The line, the controllers that refuse it, and their codes.
    let rows: [(&str, &[(Interpreter, &str)]); 13] = [
        (
            "G1 X=5",
            &[
                (Grbl, "gcode.unknown_word"),
                (GrblHal, "gcode.unknown_word"),
                (LinuxCnc, "gcode.unknown_word"),
            ],
        ),
        (
            "%",
            &[
                (Grbl, "gcode.unknown_word"),
                (GrblHal, "readback.after_end"),
                (LinuxCnc, "gcode.unknown_word"),
            ],
        ),
        (
            "O100",
            &[(Grbl, "gcode.unknown_word"), (GrblHal, "gcode.unknown_word"), (LinuxCnc, "gcode.unused_word")],
        ),
        (
            ":100",
            &[
                (Grbl, "readback.unknown_word"),
                (GrblHal, "readback.unknown_word"),
                (LinuxCnc, "readback.unknown_word"),
            ],
        ),
        ("N10000001", &[(Grbl, "gcode.too_large"), (GrblHal, "gcode.too_large")]),
        (
            "M0 P1",
            &[(Grbl, "gcode.unused_word"), (GrblHal, "gcode.unused_word"), (LinuxCnc, "gcode.unused_word")],
        ),
        (
            "M0 M1",
            &[
                (Grbl, "gcode.same_group"),
                (GrblHal, "gcode.same_group"),
                (LinuxCnc, "gcode.same_group"),
                (Any, "gcode.same_group"),
            ],
        ),
        ("(open", &[(LinuxCnc, "gcode.unknown_word")]),
        ("((a)", &[(LinuxCnc, "gcode.unknown_word")]),
        ("G1\u{b}X5", &[(LinuxCnc, "gcode.unknown_word")]),
        ("/G1 X5", &[(GrblHal, "readback.optional_line"), (LinuxCnc, "readback.optional_line")]),
        (
            "M2\nG1 X5",
            &[(Grbl, "readback.after_end"), (GrblHal, "readback.after_end"), (Any, "readback.after_end")],
        ),
        ("G1 X 4 0", &[]),
    ];
    for (line, refusals) in rows {
        for of in [Grbl, GrblHal, LinuxCnc] {
            let wanted = refusals.iter().find(|(who, _)| *who == of).map(|(_, code)| *code);
            let why = sixth(of, line).err();
            assert_eq!(why.as_ref().map(|why| why.code.as_str()), wanted, "{of:?}: {line}");
            let at = if wanted == Some("readback.after_end") { 7 } else { 6 };
            assert!(why.is_none_or(|why| why.place.unwrap().line == at), "{line}");
        }
        for (of, code) in refusals.iter().filter(|(of, _)| *of == Any) {
            assert_eq!(sixth(*of, line).unwrap_err().code, *code, "{line}");
        }
    }
}

#[test]
fn arcs_with_too_small_a_radius_are_refused() {
    for of in Interpreter::KNOWN.into_iter().chain([Interpreter::Any]) {
        let why = sixth(of, "G2 X1 R0.1").unwrap_err();
        assert_eq!(
            (why.code.as_str(), why.argument(&["found"])),
            ("readback.no_arc_of_radius", Some("0.1")),
            "{of:?}"
        );
    }
}

#[test]
fn linuxcnc_needs_an_end_and_runs_nothing_after_it() {
    use Interpreter::LinuxCnc;
    let after = sixth(LinuxCnc, "M2\nG1 X5").unwrap();
    assert_eq!(after.diagnostics.last().map(|told| told.code.as_str()), Some("readback.after_end"));
    let tools = tools(&[(1, "end mill 1")]);
    let text = "T1\nG21 G90\nM3 S1000\nG0 X0 Y0 Z1\nG1 Z-1 F60\nG0 Z1\n";
    for (text, wanted) in [(text.to_owned(), Some("readback.no_end")), (format!("%\n{text}%\n"), None)] {
        let why = read_back_for("t.nc", &text, &tools, LinuxCnc).err();
        assert_eq!(why.map(|why| why.code), wanted.map(str::to_owned), "{text}");
    }
}

#[test]
fn spindle_without_a_speed_is_stopped_on_known_controllers() {
    let tools = tools(&[(1, "end mill 1")]);
    let text = "T1\nG21 G90\nM3\nG0 X0 Y0 Z1\nG1 Z-1 F60\nG0 Z1\nS100\nG1 Z-1\nG0 Z1\nM2\n";
    for (of, wanted) in [(Interpreter::Any, true), (Interpreter::Grbl, false), (Interpreter::LinuxCnc, false)]
    {
        let back = read_back_for("t.nc", text, &tools, of).unwrap();
        let turns = turning(&back.program);
        assert_eq!((turns.first(), turns.last()), (Some(&wanted), Some(&true)), "{of:?}: {turns:?}");
    }
}
