//! Tests of a queue's text: parsing, printing and refusals.

use crate::programs::{Chance, rounds};
use annulus_core::job::Input;
use annulus_core::machine::{Machine, lab, virtual_drill};
use annulus_core::queue::{
    Axes, MOST_ROWS, Queue, QueueRow, Standing, WORDS, WorkCommand, check, print, read, read_row,
};
use annulus_core::units::Length;

const WHOLE: &str = "\
; the paper's three
home all
* SPINDLE 20000 ; turn
KMD_GOTO_X_Y 10,5 -0.25
repeat 3
\tKMD_GOTOdXdY +12 -4   # steps
  CALL hole
END

WAIT 250
WAIT_INPUT contact off 900
OUTPUT lamp on 40
OUTPUT lamp off
SUB hole
  KMD_WIERTLO_DOL
  KMD_WIERTLO_GORA
END
";

const PRINTED: &str = "\x20 ; the paper's three
  HOME ALL
* SPINDLE 20000  ; turn
  MOVE_TO 10.5 -0.25
  REPEAT 3
    MOVE_BY 12 -4  ; steps
    CALL hole
  END

  WAIT 250
  WAIT_INPUT CONTACT OFF 900
  OUTPUT lamp ON 40
  OUTPUT lamp OFF
  SUB hole
    DRILL_DOWN
    DRILL_UP
  END
";

fn queue(text: &str) -> Queue {
    read("q", text).unwrap_or_else(|why| panic!("{why:?}\n{text}"))
}

#[test]
fn whole_queue_is_read_and_printed() {
    let whole = queue(WHOLE);
    assert_eq!(print(&whole), PRINTED);
    assert_eq!(queue(PRINTED), whole);
    assert_eq!(whole.depths(), [0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 1, 1, 0]);
    let turn = &whole.rows()[2];
    assert_eq!((turn.breakpoint, turn.note.as_deref()), (true, Some("turn")));
    let to = WorkCommand::MoveTo { x: Length::from_mm(10.5), y: Length::from_mm(-0.25) };
    assert_eq!(whole.rows()[3].command, Some(to));
    let wait = WorkCommand::WaitInput { input: Input::Contact, on: false, timeout_ms: 900 };
    assert_eq!(whole.rows()[10].command, Some(wait));
}

#[test]
fn every_refused_row_has_its_position_and_field() {
    let long = format!("CALL {}", "x".repeat(33));
    // Text, code, line, column, and field, word or found text.
    let rows: &[(&str, &str, u32, u32, &str)] = &[
        ("MOVE_BY 1 1000001", "queue.out_of_range", 1, 11, "dY"),
        ("MOVE_BY -1000001 0", "queue.out_of_range", 1, 9, "dX"),
        ("MOVE_BY 99999999999999999999 0", "queue.out_of_range", 1, 9, "dX"),
        ("MOVE_BY 1.5 0", "queue.not_whole", 1, 9, "dX"),
        ("MOVE_BY 1e3 0", "queue.not_whole", 1, 9, "dX"),
        ("MOVE_BY 1", "queue.missing", 1, 10, "dY"),
        ("MOVE_BY", "queue.missing", 1, 8, "dX"),
        ("MOVE_BY 1 2 3", "queue.surplus", 1, 13, "3"),
        ("DRILL_DOWN 5", "queue.surplus", 1, 12, "5"),
        ("MOVE_TO 0 2000.000001", "queue.out_of_range", 1, 11, "Y"),
        ("MOVE_TO 99999999999999999999 0", "queue.out_of_range", 1, 9, "X"),
        ("MOVE_TO 1,234.5 0", "queue.two_marks", 1, 9, "X"),
        ("MOVE_TO . 0", "queue.bad_number", 1, 9, "X"),
        ("MOVE_TO - 0", "queue.bad_number", 1, 9, "X"),
        ("MOVE_TO nan 0", "queue.bad_number", 1, 9, "X"),
        ("MOVE_TO ∞ 0", "queue.bad_number", 1, 9, "X"),
        ("MOVE_TO 0.0000001 0", "queue.too_fine", 1, 9, "X"),
        ("* HOME Q", "queue.not_a_choice", 1, 8, "axes"),
        ("WAIT -1", "queue.out_of_range", 1, 6, "ms"),
        ("WAIT_INPUT CONTACT UP 5", "queue.not_a_choice", 1, 20, "state"),
        ("WAIT_INPUT DOOR ON 5", "queue.not_a_choice", 1, 12, "input"),
        ("WAIT_INPUT CONTACT ON 0", "queue.out_of_range", 1, 23, "timeout"),
        ("OUTPUT 7lamp ON", "queue.bad_name", 1, 8, "name"),
        ("OUTPUT lamp ON 10001", "queue.out_of_range", 1, 16, "pulse"),
        ("SPINDLE 300001", "queue.out_of_range", 1, 9, "rpm"),
        ("REPEAT 0\nEND", "queue.out_of_range", 1, 8, "times"),
        (&long, "queue.bad_name", 1, 6, "name"),
        ("\n\n  DRIL_DOWN", "queue.unknown_word", 3, 3, "DRIL_DOWN"),
        ("KMD_WIERTLO_DOWN", "queue.unknown_word", 1, 1, "KMD_WIERTLO_DOWN"),
        ("FLY", "queue.unknown_far", 1, 1, "FLY"),
        ("; note\n*", "queue.breakpoint_alone", 2, 1, ""),
        ("WAIT 5\u{7}", "queue.control_character", 1, 7, ""),
        ("WAIT 1\nREPEAT 2\nWAIT 1", "queue.unclosed", 2, 1, "REPEAT"),
        ("SUB a\nREPEAT 2\nEND", "queue.unclosed", 1, 1, "SUB"),
        ("WAIT 1\nEND", "queue.end_alone", 2, 1, ""),
        ("REPEAT 2\nSUB a\nEND\nEND", "queue.sub_inside", 2, 1, "a"),
        ("SUB a\nEND\nSUB a\nEND", "queue.sub_twice", 3, 1, "a"),
        ("CALL a", "queue.no_such_sub", 1, 1, "a"),
        ("SUB a\nCALL a\nEND", "queue.recursion", 2, 1, "a"),
        ("SUB a\nCALL b\nEND\nSUB b\nCALL a\nEND", "queue.recursion", 2, 1, "b"),
        ("SUB c\nCALL a\nEND\nSUB a\nCALL b\nEND\nSUB b\nCALL a\nEND", "queue.recursion", 2, 1, "a"),
    ];
    for (text, code, line, column, said) in rows {
        let refusals = read("q", text).expect_err(text);
        let why = &refusals[0];
        let place = why.place.as_ref().unwrap();
        assert_eq!((why.code.as_str(), place.line, place.column), (*code, *line, *column), "{text}");
        let says = said.is_empty() || why.args.iter().any(|(_, value)| value == said);
        assert!(says, "{text}: {why:?} does not say {said}");
        for part in [why.message("en"), why.advice("en")] {
            assert!(part.contains(' ') && !part.contains('{'), "{part}");
        }
    }
    let nested = |deep: usize| format!("{}{}", "REPEAT 2\n".repeat(deep), "END\n".repeat(deep));
    assert!(read("q", &nested(8)).is_ok());
    assert_eq!(read("q", &nested(9)).unwrap_err()[0].code, "queue.too_deep");
    assert!(read("q", &"WAIT 1\n".repeat(MOST_ROWS)).is_ok());
    assert_eq!(read("q", &"WAIT 1\n".repeat(MOST_ROWS + 1)).unwrap_err()[0].code, "queue.too_many_rows");
    assert_eq!(read("q", &";".repeat(30_000)).unwrap_err()[0].code, "queue.too_long");
}

#[test]
fn mistyped_word_suggests_the_nearest_one() {
    for (typed, near) in [
        ("DRIL_DOWN", "DRILL_DOWN"),
        ("moveby", "MOVE_BY"),
        ("KMD_GOTO_XY", "MOVE_TO"),
        ("KMD_WIERTLO_DUL", "DRILL_DOWN"),
        ("SPINDEL", "SPINDLE"),
        ("OUT", "OUTPUT"),
    ] {
        let why = read_row("q", 1, typed).unwrap_err();
        let said = why.args.iter().find(|(name, _)| name == "near").map(|(_, value)| value.as_str());
        assert_eq!((why.code.as_str(), said), ("queue.unknown_word", Some(near)), "{typed}");
    }
}

#[test]
fn all_errors_of_a_text_are_reported_at_once() {
    let refusals = read("q", "FLY\nWAIT 1\nWAIT x\nMOVE_BY 1\n").unwrap_err();
    let rows: Vec<_> = refusals.iter().map(|why| why.place.as_ref().unwrap().line).collect();
    assert_eq!(rows, [1, 3, 4]);
}

pub(crate) fn one_in(chance: &mut Chance, times: u64) -> bool {
    chance.bits().is_multiple_of(times)
}

pub(crate) fn random_row(chance: &mut Chance) -> QueueRow {
    let text =
        |chance: &mut Chance, words: &[&str]| words[(chance.bits() % words.len() as u64) as usize].to_owned();
    let small = |chance: &mut Chance, most: u64| (chance.bits() % most) as u32;
    let command = match chance.bits() % 10 {
        0 => WorkCommand::MoveBy {
            dx: i64::from(small(chance, 900)) - 450,
            dy: i64::from(small(chance, 900)) - 450,
        },
        1 => WorkCommand::MoveTo {
            x: Length::from_nm((chance.bits() % 90_000_000) as i64 - 20_000_000),
            y: Length::from_um(i64::from(small(chance, 60_000))),
        },
        2 => WorkCommand::DrillDown,
        3 => WorkCommand::DrillUp,
        4 => WorkCommand::Home { axes: [Axes::All, Axes::X, Axes::Y, Axes::Z][small(chance, 4) as usize] },
        5 => WorkCommand::Wait { ms: small(chance, 30) },
        6 => WorkCommand::WaitInput {
            input: Input::ALL[small(chance, 7) as usize],
            on: one_in(chance, 2),
            timeout_ms: small(chance, 50) + 1,
        },
        7 => WorkCommand::Output {
            name: text(chance, &["lamp", "vacuum", "pump"]),
            on: one_in(chance, 2),
            pulse_ms: one_in(chance, 2).then(|| small(chance, 30) + 1),
        },
        8 => WorkCommand::Park,
        _ => WorkCommand::Spindle { rpm: small(chance, 3) * 10_000 },
    };
    let note = one_in(chance, 5).then(|| text(chance, &["", "a note", "; twice", "ząb 孔"]));
    QueueRow { breakpoint: one_in(chance, 7), command: Some(command), note }
}

#[test]
fn random_queues_are_printed_and_read_back_equal() {
    for seed in 0..rounds(3_000) {
        let mut chance = Chance::new(seed);
        let mut text = String::new();
        let mut open = 0;
        for _ in 0..chance.bits() % 30 {
            match chance.bits() % 12 {
                0 => text.push('\n'),
                1 => text.push_str("; only a note\n"),
                2 if open < 8 => {
                    text.push_str("REPEAT 2\n");
                    open += 1;
                }
                3 if open > 0 => {
                    text.push_str("END\n");
                    open -= 1;
                }
                4 => text.push_str("CALL part ; there\n"),
                _ => {
                    let row = random_row(&mut chance);
                    let (word, values) = row.command.as_ref().unwrap().split();
                    let names: Vec<&str> = word.spellings().collect();
                    let name = names[(chance.bits() % names.len() as u64) as usize];
                    let values: Vec<_> = values.iter().map(ToString::to_string).collect();
                    let note = row.note.map_or(String::new(), |note| format!(";{note}"));
                    let mark = if row.breakpoint { "*" } else { "" };
                    text.push_str(&format!("{mark}\t{name} {} {note}\n", values.join("  ")));
                }
            }
        }
        text.push_str(&"END\n".repeat(open));
        text.push_str("SUB part\nWAIT 1\nEND\n");
        let queue = read("q", &text).unwrap_or_else(|why| panic!("seed {seed}: {why:?}\n{text}"));
        let printed = print(&queue);
        assert_eq!(read("q", &printed).as_ref(), Ok(&queue), "seed {seed}\n{text}\n{printed}");
        assert_eq!(print(&read("q", &printed).unwrap()), printed, "seed {seed}");
    }
}

#[test]
fn no_text_panics() {
    let pieces: Vec<&str> = WORDS
        .iter()
        .flat_map(|word| word.spellings())
        .chain(["*", ";", "-", "9", ",", ".", " ", "\n", "孔", "\u{0}"])
        .collect();
    for seed in 0..rounds(20_000) {
        let mut chance = Chance::new(seed);
        let mut text = String::new();
        for _ in 0..chance.bits() % 12 {
            text.push_str(pieces[(chance.bits() % pieces.len() as u64) as usize]);
            if one_in(&mut chance, 2) {
                text.push(' ');
            }
        }
        match read("q", &text) {
            Ok(queue) => assert_eq!(read("q", &print(&queue)), Ok(queue), "seed {seed}: {text:?}"),
            Err(why) => assert!(!why.is_empty(), "seed {seed}"),
        }
    }
}

/// A homed machine above the middle of its range, with work zero there.
pub(crate) fn standing(machine: &Machine) -> Standing {
    let middle = |axis: usize| {
        let settings = machine.axis(axis);
        (settings.scale.steps(settings.min) + settings.scale.steps(settings.max)) / 2
    };
    let mut position = [0; 8];
    (position[0], position[1]) = (middle(0), middle(1));
    position[2] = machine.z.scale.steps(machine.z.max);
    Standing { position, zero: Some([position[0], position[1]]), homed: [true; 3], rpm: 0, foot_down: false }
}

#[test]
fn unsafe_queue_is_refused_before_motion() {
    let rows: &[(&str, &str, u32, &str)] = &[
        ("MOVE_TO 151 0", "queue.outside", 1, "X"),
        ("MOVE_TO 0 -100.5", "queue.outside", 1, "Y"),
        ("REPEAT 7\nMOVE_BY 0 1200\nEND", "queue.outside", 2, "dY"),
        ("SPINDLE 9000\nDRILL_DOWN\nMOVE_BY 1 0", "queue.tip_low", 3, "2"),
        ("SPINDLE 9000\nDRILL_DOWN\nMOVE_TO 1 0", "queue.tip_low", 3, "2"),
        ("SPINDLE 9000\nDRILL_DOWN\nHOME X", "queue.tip_low", 3, "2"),
        ("SPINDLE 9000\nREPEAT 2\nMOVE_BY 5 5\nDRILL_DOWN\nEND", "queue.tip_low", 3, "2"),
        ("DRILL_DOWN", "queue.spindle_off", 1, ""),
        ("SPINDLE 9000\nDRILL_DOWN\nSPINDLE 0", "queue.spindle_off_in_board", 3, "rpm"),
        ("SPINDLE 9000\nCALL a\nSPINDLE 0\nSUB a\nDRILL_DOWN\nEND", "queue.spindle_off_in_board", 3, "rpm"),
        ("OUTPUT pump ON", "queue.no_such_output", 1, "name"),
        ("; nothing\nSUB a\nWAIT 1\nEND", "queue.empty", 0, ""),
        ("REPEAT 10000\nREPEAT 10000\nEND\nEND", "queue.too_many_steps", 3, ""),
        (
            "REPEAT 10000\nREPEAT 10000\nREPEAT 10000\nREPEAT 10000\nWAIT 0\nEND\nEND\nEND\nEND",
            "queue.too_many_steps",
            6,
            "",
        ),
    ];
    let machine = virtual_drill();
    let names = ["lamp".to_owned()];
    for (text, code, row, said) in rows {
        let why = check(&queue(text), &machine, &names, &standing(&machine)).expect_err(text);
        let line = why.place.as_ref().map_or(0, |place| place.line);
        assert_eq!(why.code, *code, "{text}");
        assert!(*code == "queue.too_many_steps" || line == *row, "{text}: {why:?}");
        let says = said.is_empty() || why.args.iter().any(|(_, value)| value == said);
        assert!(says, "{text}: {why:?} does not say {said}");
        for part in [why.message("en"), why.advice("en")] {
            assert!(!part.contains('{'), "{part}");
        }
    }
}

#[test]
fn queue_without_homing_or_zero_is_limited() {
    let machine = lab();
    let unknown = Standing::default();
    let known = Standing { zero: None, ..standing(&machine) };
    let rows = [
        ("MOVE_BY 1 1", &unknown, Some("queue.not_homed")),
        ("HOME X", &unknown, Some("queue.not_homed")),
        ("DRILL_UP", &unknown, Some("queue.not_homed")),
        ("HOME Z\nMOVE_BY 1 1", &unknown, Some("queue.not_homed")),
        ("HOME Z\nHOME X\nHOME Y\nMOVE_BY 1 1", &unknown, None),
        ("HOME ALL\nMOVE_BY 1 1", &unknown, None),
        ("HOME ALL\nMOVE_TO 1 1", &unknown, Some("queue.no_zero")),
        ("SPINDLE 9000\nWAIT 5\nWAIT_INPUT CONTACT ON 5", &unknown, None),
        ("MOVE_TO 1 1", &known, Some("queue.no_zero")),
        ("MOVE_BY -5 5\nSPINDLE 9000\nDRILL_DOWN\nDRILL_UP\nSPINDLE 0", &known, None),
    ];
    for (text, standing, code) in rows {
        let verdict = check(&queue(text), &machine, &[], standing);
        assert_eq!(verdict.as_ref().err().map(|why| why.code.as_str()), code, "{text}");
    }
}

#[test]
fn queue_check_predicts_rows_strokes_and_range() {
    let machine = virtual_drill();
    let text =
        "SPINDLE 9000\nREPEAT 4\nMOVE_BY 80 -160\nCALL hole\nEND\nSUB hole\nDRILL_DOWN\nDRILL_UP\nEND\n";
    let from = standing(&machine);
    let done = check(&queue(text), &machine, &[], &from).unwrap();
    let [x, y] = [from.position[0], from.position[1]];
    // One separate row, REPEAT, and four times: move, call, down, up, END of the part, END of the repeat.
    assert_eq!((done.rows, done.strokes), (2 + 4 * 6, 4));
    assert_eq!(done.lowest, Some([x + 80, y - 640]));
    assert_eq!(done.highest, Some([x + 320, y - 160]));
    assert_eq!((done.end.rpm, done.end.position[0]), (9_000, x + 320));
}

#[test]
fn manual_lists_every_command_spelling() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/manual/lab.md");
    let manual = std::fs::read_to_string(path).unwrap();
    for name in WORDS.iter().flat_map(|word| word.spellings()) {
        assert!(manual.contains(&format!("`{name}`")), "{name} is not in the manual");
    }
    let example = manual.split("```text\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let machine = virtual_drill();
    let done = check(&queue(example), &machine, &[], &standing(&machine)).unwrap();
    assert_eq!(done.strokes, 4, "the manual's example runs");
}
