//! Tests of files that the user runs one after the other: one file per tool, names, headers, run sheet,
//! tool change height. Z must not move without a tool length.

use super::seen::{Seen, compare};
use super::{exactness, one, programs, read};
use annulus_core::geometry::{Bounds, Point};
use annulus_core::job::{AlignmentPins, Bit, Briefing, Cutter, Program, SideBriefing, ToolBriefing};
use annulus_core::machine::{Axis, Machine, hobby_3018, lab, six_spindles, virtual_drill};
use annulus_core::post::{self, Dialect, FileSplit, Manner, OutputFile};
use annulus_core::units::Length;

const NO_CHANGER: [&str; 2] = ["grbl", "marlin"];

fn tool_in_head(text: &str) -> u32 {
    let head = text.lines().find_map(|line| line.split_once("tool ").map(|(_, rest)| rest)).unwrap();
    head.split(':').next().unwrap().parse().unwrap()
}

#[test]
fn machines_without_changer_get_one_file_per_tool() {
    for name in NO_CHANGER {
        let dialect = post::dialect(name).unwrap().unwrap().in_manner(&Manner::on(&virtual_drill()));
        for seed in 0..60 {
            let program = programs::random_program(seed, None);
            let files = post::write_with(&dialect, &program).unwrap();
            let mut seen = Vec::new();
            for file in &files {
                assert!(
                    !file.text.contains("M0\n"),
                    "{name}, seed {seed}: nothing to wait for: {}",
                    file.text
                );
                assert_eq!(file.bits.len(), 1, "{name}, seed {seed}");
                let tool = tool_in_head(&file.text);
                assert_eq!(vec![tool], file.numbers);
                // The user fits the tool before the file begins.
                seen.push(Seen::Bit(tool));
                seen.extend(read(name, file, 2.0).unwrap_or_else(|why| panic!("{name}, seed {seed}: {why}")));
            }
            if let Err(why) = compare(&seen, &program, exactness(name, &dialect)) {
                panic!("{name}, seed {seed}: {why}");
            }
        }
    }
}

#[test]
fn tool_changes_in_one_file_are_high_above_the_board() {
    let rows: [(Machine, f64); 4] =
        [(virtual_drill(), 20.0), (hobby_3018(), 20.0), (lab(), 12.25), (six_spindles(), 20.0)];
    for (machine, height) in rows {
        assert_eq!(Manner::on(&machine).change_at, Some(Length::from_mm(height)), "{}", machine.name);
    }
    let manner = Manner { files: Some(FileSplit::Job), ..Manner::on(&virtual_drill()) };
    for name in post::targets().into_iter().filter(|name| *name != "excellon") {
        let file = one(post::write(name, &programs::small(), &manner).unwrap().unwrap());
        // Before each of the two tool requests, the tool is 20 mm above the board or at the reference
        // point.
        let high = |text: &str| {
            ["Z20", "Z+20", "Z 20", "G28 Z0", "G53 Z0", "SUPA G0 Z0", "M91", ",20]", "Z = 20"]
                .iter()
                .any(|word| text.contains(word))
        };
        assert!(high(&file.text), "{name}: {}", file.text);
        let seen = read(name, &file, 2.0).unwrap();
        let mut z = 2.0;
        let mut asked = 0;
        for seen in seen {
            match seen {
                Seen::Move { to, .. } | Seen::Arc { to, .. } => z = to[2],
                Seen::Bit(_) => {
                    asked += 1;
                    assert!(z >= 20.0, "{name}: tool {asked} is asked for at {z}");
                }
                _ => {}
            }
        }
        assert_eq!(asked, 2, "{name}");
    }
}

#[test]
fn z_moves_without_tool_length_are_rejected_by_the_reader() {
    let manner = Manner { files: Some(FileSplit::Job), ..Manner::on(&virtual_drill()) };
    // The output of a previous version; a reader that knows the controller's rule must refuse it.
    let rows = [
        ("fanuc", "G91 G28 Z0.\r\nN70 G90", "G0 Z2.0000\r\nN70 G90"),
        ("fanuc", "G0 G43 Z20.0000 H1", "G0 Z20.0000"),
        ("linuxcnc", "T1 M6\nG43", "T1 M6"),
        ("linuxcnc", "G94\nG43", "G94 G49"),
        ("sinumerik", "M6\nN150 D1", "M6\nN150 G90"),
        ("mach3", "M6 T1\r\nG43 H1", "M6 T1"),
        // The first move of Z before a tool length is active.
        ("mach3", "G0 G53 Z0", "G0 Z20.0"),
        ("sinumerik", "SUPA G0 Z0 D0", "G0 Z20.0"),
        ("heidenhain", "L Z+0 R0 FMAX M91", "L Z+20 R0 FMAX"),
        // X and Y move before Z after a new tool length.
        ("grbl", "M0\nG0 Z20.0000", "M0"),
        ("marlin", "M0\nG0 Z20.0000 F300", "M0"),
        ("linuxcnc", "S24000\nZ2", "S24000"),
        ("mach3", "H2\r\nG0 Z20.0", "H2"),
        ("sinumerik", "D1\nN160 G0 Z20.0", "D1\nN160 G90"),
        ("heidenhain", "S30000\n13 L Z+20 R0 FMAX", "S30000\n13 ; nothing"),
        ("kuka", "BAS(#INITMOV,0)\n", ""),
    ];
    for (name, from, to) in rows {
        let file = one(post::write(name, &programs::small(), &manner).unwrap().unwrap());
        assert!(read(name, &file, 2.0).is_ok(), "{name}: {:?}", read(name, &file, 2.0));
        let from =
            if name == "fanuc" && from.contains("N70") { numbered(&file.text) } else { from.to_owned() };
        assert!(file.text.contains(&from), "{name} has no {from:?}: {}", file.text);
        let to = if name == "fanuc" && to.contains("N70") {
            from.replace("G91 G28 Z0.", "G0 Z2.0000")
        } else {
            to.to_owned()
        };
        let text = file.text.replacen(&from, &to, 1);
        let Err(why) = read(name, &OutputFile { text, ..file }, 2.0) else { panic!("{name}: {to:?}") };
        assert!(why.contains("tool's length") || name == "kuka", "{why}");
    }
}

/// The first line that moves to the reference point, and the next one, with their line numbers.
fn numbered(text: &str) -> String {
    let lines: Vec<&str> = text.split("\r\n").collect();
    let at = lines.iter().position(|line| line.ends_with("G91 G28 Z0.")).unwrap();
    lines[at..at + 2].join("\r\n")
}

#[test]
fn every_postprocessor_writes_at_least_four_decimals() {
    for (name, text) in post::shipped() {
        assert!(Dialect::parse(name, text).unwrap().numbers.base.decimals >= 4, "{name}");
    }
}

fn bit(um: i64, cutter: Cutter) -> Bit {
    Bit { diameter: Length::from_um(um), name: "whatever".to_owned(), cutter, handling: Default::default() }
}

fn two_sides() -> (Briefing, Vec<Program>) {
    let vee = bit(3_175, Cutter::Vee { tip: Length::from_um(100), angle_mdeg: 30_000 });
    let (drill, mill) = (bit(800, Cutter::Drill), bit(800, Cutter::Mill));
    let tool = |tool: &Bit, words: &[&str], time_s| ToolBriefing {
        tool: tool.clone(),
        operations: words.iter().map(|word| (*word).to_owned()).collect(),
        time_s: Some(time_s),
    };
    let blank = Bounds { min: Point::from_mm(-4.0, -1.0), max: Point::from_mm(54.0, 41.0) };
    let side = |name: &str, tools| SideBriefing { side: name.to_owned(), blank: Some(blank), tools };
    let briefing = Briefing {
        job: "amplifier <2>".to_owned(),
        machine: "3018 router".to_owned(),
        zero: Some("board".to_owned()),
        thickness: Some(Length::from_mm(1.6)),
        pins: Some(AlignmentPins {
            diameter: Length::from_mm(3.0),
            below: Length::from_mm(6.0),
            at: vec![Point::from_mm(-4.0, 20.0), Point::from_mm(54.0, 20.0)],
        }),
        tabs: Some(0),
        flip: Some("left_right".to_owned()),
        sides: vec![
            side("bottom", vec![tool(&vee, &["isolate", "engrave"], 754.2)]),
            side("top", vec![tool(&drill, &["drill"], 30.0), tool(&mill, &["mill_holes", "cut_out"], 61.0)]),
        ],
    };
    let named = |bits: Vec<Bit>, legs: usize| {
        let mut program = programs::small();
        program.bits = bits;
        if legs == 1 {
            program.legs.drain(1..4);
            program.legs[1] = programs::change(0, 24_000, 0);
        }
        program
    };
    (briefing, vec![named(vec![vee], 1), named(vec![drill, mill], 2)])
}

#[test]
fn file_names_sort_in_running_order_and_headers_list_tools() {
    let (briefing, programs) = two_sides();
    let files: Vec<Vec<OutputFile>> = programs
        .iter()
        .enumerate()
        .map(|(side, program)| {
            post::write_for("grbl", program, &Manner::default(), &briefing, side).unwrap().unwrap()
        })
        .collect();
    let names: Vec<&str> = files.iter().flatten().map(|file| file.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "01-bottom-isolate-engrave-V30-0.1.nc",
            "02-top-drill-0.8.nc",
            "03-top-mill-holes-cut-out-mill-0.8.nc"
        ]
    );
    let head: Vec<&str> = files[1][1].text.lines().take_while(|line| line.starts_with('(')).collect();
    assert_eq!(
        head,
        [
            "(job: amplifier _2_)",
            "(side: top)",
            "(file 2 of 2 of this side)",
            "(tool 3: end mill 0.8)",
            "(zero: lower left corner of the board, Z on its surface)",
            "(blank: at least 58.0 x 42.0 mm)",
            "(from zero: X -4.0 to 54.0, Y -1.0 to 41.0)",
            "(board: 1.6 mm thick)",
            "(time: 61 s)"
        ]
    );
    assert!(files[0][0].text.contains("(tool 1: V-bit 30 deg, tip 0.1)\n"), "{}", files[0][0].text);
    assert!(files[0][0].text.contains("(time: 13 min)\n"), "{}", files[0][0].text);
    // With a tool changer each side is one file.
    let fanuc = post::write_for("fanuc", &programs[1], &Manner::default(), &briefing, 1).unwrap().unwrap();
    let fanuc = one(fanuc);
    assert!(
        fanuc.text.contains("(TOOL 2: DRILL 0.8)") && fanuc.text.contains("(PUT IN TOOL 3: END MILL 0.8)")
    );
    assert_eq!((fanuc.bits, fanuc.numbers), (vec![0, 1], vec![2, 3]));
}

/// A tool stays in its place for the whole job: on all sides, one number is one tool, and one tool has one
/// number.
#[test]
fn tool_numbers_are_shared_by_both_sides() {
    let (mut briefing, mut programs) = two_sides();
    // On the bottom, the mill of the top side is first and has another name.
    let mill = bit(800, Cutter::Mill);
    let (tools, bits) = (&mut briefing.sides[0].tools, &mut programs[0].bits);
    tools.push(ToolBriefing { tool: mill.clone(), operations: Vec::new(), time_s: None });
    bits.push(Bit { name: "another name".to_owned(), ..mill });
    programs[0].legs.insert(2, programs::change(1, 24_000, 0));
    assert_eq!((briefing.numbers(0), briefing.numbers(1)), (vec![1, 2], vec![3, 2]));
    let rows = [
        (
            "fanuc",
            ["O1001 (", "(TOOL 2: END MILL 0.8)", "T2 M6"],
            ["O1002 (", "(TOOL 2: END MILL 0.8)", "T2 M6"],
        ),
        ("mach3", ["(tool 1: V", "M6 T2", "G43 H2"], ["(tool 3: d", "M6 T3", "G43 H2"]),
        (
            "heidenhain",
            ["BEGIN", "TOOL CALL 1 Z", "TOOL CALL 2 Z"],
            ["BEGIN", "TOOL CALL 3 Z", "TOOL CALL 2 Z"],
        ),
        ("sinumerik", ["; side: bottom", "T1", "T2"], ["; side: top", "T3", "T2"]),
        ("fanuc_tp", ["!SIDE: BOTTOM", "R[1]=1", "R[1]=2"], ["!SIDE: TOP", "R[1]=3", "R[1]=2"]),
    ];
    for (name, bottom, top) in rows {
        for (side, wanted) in [bottom, top].into_iter().enumerate() {
            let files = post::write_for(name, &programs[side], &Manner::default(), &briefing, side);
            let file = one(files.unwrap().unwrap());
            for word in wanted {
                assert!(file.text.contains(word), "{name}, side {side}: no {word:?} in {}", file.text);
            }
            assert_eq!(file.numbers, briefing.numbers(side), "{name}");
        }
    }
}

#[test]
fn run_sheet_footer_explains_the_tool_changes() {
    let (briefing, programs) = two_sides();
    let rows = [
        ("grbl", None, "Before every file: put its tool in"),
        ("marlin", None, "Before every file: put its tool in"),
        ("fanuc", None, "measure its length"),
        ("linuxcnc", None, "measure its length"),
        ("heidenhain", None, "measure its length"),
        ("grbl", Some(FileSplit::Job), "The file stops for every tool"),
        ("kuka", None, "The file stops for every tool"),
    ];
    for (name, files, wanted) in rows {
        let manner = Manner { files, ..Manner::default() };
        let written: Vec<Vec<OutputFile>> = (0..2)
            .map(|side| post::write_for(name, &programs[side], &manner, &briefing, side).unwrap().unwrap())
            .collect();
        let sheet = post::run_sheet("en", &briefing, &written);
        assert!(sheet.foot.contains(wanted), "{name}: {}", sheet.foot);
        // GRBL does not allow jogs at M0: header and run sheet must say so.
        let stops = wanted.contains("stops");
        assert_eq!(sheet.foot.contains("GRBL"), stops, "{name}");
        let several = written.iter().flatten().find(|file| file.bits.len() > 1);
        let said = several.is_some_and(|file| file.text.contains("at every stop: set Z again"));
        assert_eq!(said, stops, "{name}");
    }
}

/// In a TP program a remark has at most 32 characters and a name at most 8; the sides have different names.
#[test]
fn robot_program_states_job_zero_blank_and_time() {
    let (mut briefing, mut programs) = two_sides();
    briefing.job = "a job with a name that is longer than one line has room for".to_owned();
    let mut names = Vec::new();
    for (side, word) in ["bottom", "top"].into_iter().enumerate() {
        programs[side].name = format!("usbkvm-{word}");
        let files = post::write_for("fanuc_tp", &programs[side], &Manner::default(), &briefing, side);
        let file = one(files.unwrap().unwrap());
        let remarks: Vec<&str> =
            file.text.lines().filter_map(|line| line.split_once(":  !")?.1.strip_suffix(" ;")).collect();
        assert!(remarks.iter().all(|remark| (1..=32).contains(&remark.len())), "{remarks:?}");
        let all = remarks.join(" ");
        for needed in
            ["JOB: A JOB WITH A NAME THAT IS LONGER", "ZERO: LOWER LEFT CORNER", "BLANK: AT LEAST", "TIME: "]
        {
            assert!(all.contains(needed), "{needed}: {remarks:?}");
        }
        names.push(file.name);
    }
    assert_eq!(names, ["USBKVM_B.LS", "USBKVM_T.LS"]);
}

/// Marlin needs the speed of rapid moves, which must not exceed the machine's.
#[test]
fn marlin_rapids_are_within_the_machine_speed() {
    let slow = Machine { x: Axis { max_speed_mm_per_s: 20.0, ..lab().x }, ..lab() };
    let slow = Machine { z: Axis { max_speed_mm_per_s: 2.0, ..slow.z }, ..slow };
    for (manner, over, up) in [(Manner::default(), 3_000, 300), (Manner::on(&slow), 1_200, 120)] {
        for file in post::write("marlin", &programs::small(), &manner).unwrap().unwrap() {
            let fastest = |axis: &str| {
                let rapids = file.text.lines().filter(|line| line.starts_with("G0 ") && line.contains(axis));
                rapids.filter_map(|line| line.rsplit_once('F')?.1.parse::<u32>().ok()).max()
            };
            assert_eq!((fastest("X"), fastest("Z")), (Some(over), Some(up)), "{}", file.text);
        }
    }
}

#[test]
fn run_sheet_lists_everything_in_order() {
    let (briefing, programs) = two_sides();
    let files: Vec<Vec<OutputFile>> = (0..2)
        .map(|side| {
            post::write_for("grbl", &programs[side], &Manner::default(), &briefing, side).unwrap().unwrap()
        })
        .collect();
    let sheet = post::run_sheet("en", &briefing, &files).html();
    let mut at = 0;
    for needed in [
        "amplifier &lt;2&gt;",
        "3018 router",
        "Lower left corner of the board",
        "at least 58.0 × 42.0 mm, one piece for all sides",
        "1.6 mm thick",
        "2 of 3 mm, holes 6.0 mm into the bed",
        "X -4.00 Y 20.00; X 54.00 Y 20.00",
        "none: the board comes loose with the last pass",
        "left over right",
        "15 min",
        "01-bottom-isolate-engrave-V30-0.1.nc",
        "V-bit 30°, tip 0.1",
        "Flip the board",
        "02-top-drill-0.8.nc",
        "drill 0.8",
        "03-top-mill-holes-cut-out-mill-0.8.nc",
        "end mill 0.8",
    ] {
        let found = sheet[at..].find(needed);
        assert!(found.is_some(), "{needed} behind byte {at}: {sheet}");
        at += found.unwrap();
    }
    assert!(!sheet.contains('{') || !sheet[sheet.find("<body>").unwrap()..].contains('{'), "{sheet}");
    assert!(!sheet.contains("src=") && !sheet.contains("href="), "it needs nothing else");
}

#[test]
fn long_program_names_end_with_their_last_word() {
    for (job, name) in [
        ("4.0-multivibrator.bottom", "P4_0_MULTIVIBRATOR.NC"),
        ("4_0-multivibrator_bottom", "P4_0_MULTIVIBRATO_BOTTOM"),
        ("a_word_that_is_longer_than_half", "A_WORD_THAT_IS_LONG_HALF"),
        ("x_abcdefghijklmnopqrstuvwxyz0123", "X_ABCDEFGHIJSTUVWXYZ0123"),
    ] {
        let mut program = programs::small();
        program.name = job.to_owned();
        let files = post::write("fanuc", &program, &Manner::default()).unwrap().unwrap();
        let found = files[0].name.to_ascii_uppercase();
        assert!(found.starts_with(name.trim_end_matches(".NC")), "{job}: {found}");
        assert!(found.split('.').next().unwrap().len() <= 24, "{found}");
    }
}
