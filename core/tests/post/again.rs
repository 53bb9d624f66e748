//! Tests of written files against their program. Every shipped dialect does what the program does; every
//! single fault of a template, a tool table or a manual edit is found and classified.

use super::programs;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::geometry::Point;
use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program};
use annulus_core::machine::virtual_drill;
use annulus_core::post::{self, Dialect, Manner, OutputFile};
use annulus_core::proof;
use annulus_core::units::Length;

fn proved(dialect: Option<&Dialect>, program: &Program, files: &[OutputFile]) -> Vec<Diagnostic> {
    post::proved((dialect, true), program, files, &proof::differences)
}

fn errors(diagnostics: &[Diagnostic]) -> Vec<&str> {
    let errors = diagnostics.iter().filter(|diagnostic| diagnostic.severity == Severity::Error);
    errors.map(|diagnostic| diagnostic.code.as_str()).collect()
}

fn mm(value: f64) -> Length {
    Length::from_mm(value)
}

fn go(x: f64, y: f64) -> Command {
    Command::Rapid { to: Point::from_mm(x, y) }
}

fn down(z: f64) -> Command {
    Command::Plunge { to: mm(z), feed_um_per_s: 2_000, gate: None }
}

fn mill(x: f64, y: f64, z: f64) -> Command {
    Command::Mill { to: Point::from_mm(x, y), height: mm(z), feed_um_per_s: 5_000 }
}

fn arc(x: f64, y: f64, centre: (f64, f64), z: f64, ccw: bool) -> Command {
    let center = Point::from_mm(centre.0, centre.1);
    Command::MillArc { to: Point::from_mm(x, y), height: mm(z), center, ccw, feed_um_per_s: 5_000 }
}

/// A V-bit around a corner and around a circle with an overlap, two drilled holes, a milled helix and a
/// path after it.
fn job() -> Program {
    let bit = |diameter: f64, cutter| Bit {
        diameter: mm(diameter),
        name: "a name".to_owned(),
        cutter,
        handling: Default::default(),
    };
    let vee = Cutter::Vee { tip: Length::from_um(100), angle_mdeg: 30_000 };
    let up = Command::Retract { to: mm(2.0) };
    let on = |bit| Leg {
        mark: Mark::ToolChange(bit),
        commands: vec![
            Command::Spindle { rpm: 0 },
            Command::AwaitBit { bit },
            Command::Spindle { rpm: 12_000 },
        ],
    };
    let leg = |mark, commands: Vec<Command>| Leg { mark, commands };
    let corner =
        vec![go(1.0, 1.0), down(-0.1), mill(5.0, 1.0, -0.1), arc(6.0, 2.0, (5.0, 2.0), -0.1, true), up];
    let ring = vec![
        go(13.0, 10.0),
        down(-0.1),
        arc(13.0, 10.0, (10.0, 10.0), -0.1, true),
        arc(12.819_077, 11.026_06, (10.0, 10.0), -0.1, true),
        up,
    ];
    let helix = vec![
        go(10.0, 5.0),
        down(0.0),
        arc(10.0, 5.0, (9.0, 5.0), -0.5, false),
        mill(12.0, 5.0, -0.5),
        mill(12.0, 7.123_456, -0.5),
        up,
    ];
    Program {
        name: "board".to_owned(),
        machine: String::new(),
        origin: Point::from_mm(-20.0, 7.5),
        bits: vec![bit(3.175, vee), bit(0.8, Cutter::Drill), bit(1.0, Cutter::Mill)],
        spindles: 1,
        safe_height: mm(2.0),
        legs: vec![
            on(0),
            leg(Mark::Toolpath(0), corner),
            leg(Mark::Toolpath(1), ring),
            on(1),
            leg(
                Mark::Hole(0),
                vec![go(3.0, 3.0), down(-0.9), Command::Retract { to: mm(0.5) }, down(-2.0), up],
            ),
            leg(Mark::Hole(1), vec![go(-4.0, 3.5), down(-2.0), up]),
            on(2),
            leg(Mark::Toolpath(2), helix),
            leg(Mark::Finish, vec![Command::Spindle { rpm: 0 }, go(0.0, 0.0)]),
        ],
        accepted: Vec::new(),
    }
}

#[test]
fn every_postprocessor_reproduces_its_program() {
    let mut jobs = vec![("job".to_owned(), job()), ("small".to_owned(), programs::small())];
    jobs.extend((0..40).map(|seed| (format!("seed {seed}"), programs::random_program(seed, None))));
    let manners = [
        Manner::default(),
        Manner::on(&virtual_drill()),
        Manner { lines_only_mm: Some(0.005), ..Manner::default() },
        Manner { lines_only_mm: Some(0.05), ..Manner::default() },
    ];
    for (name, program) in &jobs {
        for (target, _) in post::shipped() {
            for manner in &manners {
                let dialect = post::dialect(target).unwrap().unwrap().in_manner(manner);
                let files = post::write_with(&dialect, program).unwrap();
                let told = proved(Some(&dialect), program, &files);
                assert!(
                    told.is_empty(),
                    "{name}, {target}: {:?}",
                    told.iter().map(|r| r.message("en")).collect::<Vec<_>>()
                );
            }
        }
    }
}

#[test]
fn drill_file_without_milling_passes_the_read_back() {
    let mut program = job();
    program.legs.remove(2);
    program.legs.remove(1);
    program.legs.remove(0);
    program.bits.remove(0);
    for leg in &mut program.legs {
        let before = |bit: &mut u32| *bit -= 1;
        if let Mark::ToolChange(bit) = &mut leg.mark {
            before(bit);
        }
        for command in &mut leg.commands {
            if let Command::AwaitBit { bit } = command {
                before(bit);
            }
        }
    }
    let files = post::write("excellon", &program, &Manner::default()).unwrap().unwrap();
    assert_eq!(errors(&proved(None, &program, &files)), Vec::<&str>::new(), "{}", files[0].text);
    let mut left_out = files.clone();
    left_out[0].text =
        left_out[0].text.lines().filter(|line| !line.contains("X-24")).map(|l| l.to_owned() + "\n").collect();
    assert_ne!(left_out, files);
    assert_eq!(errors(&proved(None, &program, &left_out)), ["written.missing"]);
}

/// Name of a fault, a function that applies it to the files, and the codes of the expected errors.
type Fault<'f> = (&'f str, &'f dyn Fn(&mut Vec<OutputFile>), &'f [&'f str]);

fn replaced(files: &mut [OutputFile], from: &str, to: &str) {
    for file in files {
        file.text = file.text.replace(from, to);
    }
}

#[test]
fn every_single_file_fault_is_found() {
    let program = job();
    let dialect = post::dialect("grbl").unwrap().unwrap().in_manner(&Manner::on(&virtual_drill()));
    let good = post::write_with(&dialect, &program).unwrap();
    assert!(proved(Some(&dialect), &program, &good).is_empty());
    let rows: [Fault<'_>; 12] = [
        ("a file is missing", &|files| drop(files.remove(1)), &["written.tool_missing"]),
        ("files of one tool twice", &|files| files.push(files[0].clone()), &[]),
        ("a wrong unit", &|files| replaced(files, "G21", "G20"), &["written.missing", "written.extra"]),
        (
            "a pass is missing",
            &|files| {
                let text = files[0].text.clone();
                files[0].text = text
                    .lines()
                    .filter(|line| !line.starts_with("G3 X6.0000"))
                    .map(|line| line.to_owned() + "\n")
                    .collect();
            },
            &["written.missing"],
        ),
        ("too deep", &|files| replaced(files, "Z-0.1000", "Z-0.1100"), &["written.extra"]),
        ("not deep enough", &|files| replaced(files, "Z-2.0000", "Z-1.9000"), &["written.missing"]),
        (
            "another tool",
            &|files| replaced(files, "tip 0.1", "tip 0.2"),
            &["written.tool_missing", "written.tool_extra"],
        ),
        (
            "tools swapped",
            &|files| {
                replaced(files, "drill 0.8", "x");
                replaced(files, "end mill 1", "drill 0.8");
                replaced(files, "x", "end mill 1");
            },
            &["written.missing", "written.extra"],
        ),
        ("it stands", &|files| replaced(files, "M3 ", "M5 "), &["written.still"]),
        ("the wrong sense", &|files| replaced(files, "G3 ", "G2 "), &["written.missing", "written.extra"]),
        (
            "a hole elsewhere",
            &|files| replaced(files, "X-4.0000", "X-4.0500"),
            &["written.missing", "written.extra"],
        ),
        ("it stays in the board", &|files| replaced(files, "G0 Z2.0000", "(x)"), &["written.extra"]),
    ];
    for (what, fault, wanted) in rows {
        let mut files = good.clone();
        fault(&mut files);
        assert!(files != good, "{what}: nothing changed");
        let told = proved(Some(&dialect), &program, &files);
        let mut kinds = errors(&told);
        kinds.dedup();
        assert_eq!(kinds, wanted, "{what}: {:?}", told.iter().map(|r| r.message("en")).collect::<Vec<_>>());
        assert!(told.iter().all(|diagnostic| !diagnostic.message("en").contains('{')), "{what}");
    }
}

#[test]
fn template_shift_is_noted_and_an_unknown_shift_is_an_error() {
    let program = job();
    let text = post::shipped().find(|(name, _)| *name == "grbl").unwrap().1;
    let says = text.replace("shift_mm = [0.0, 0.0]", "shift_mm = [0.05, 0.0]");
    let dialect = Dialect::parse("own.toml", &says).unwrap();
    let files = post::write_with(&dialect, &program).unwrap();
    let told = proved(Some(&dialect), &program, &files);
    assert_eq!((errors(&told), told[0].code.as_str()), (Vec::new(), "written.moved"));
    // The same files with a dialect whose template lacks this setting.
    let plain = Dialect::parse("own.toml", text).unwrap();
    let told = proved(Some(&plain), &program, &files);
    assert_eq!(errors(&told), ["written.shifted"]);
    assert!(told[0].message("en").contains("X 0.050 Y 0.000"), "{}", told[0].message("en"));
}

#[test]
fn template_that_drops_or_changes_a_word_is_found() {
    let program = job();
    let text = post::shipped().find(|(name, _)| *name == "grbl").unwrap().1;
    let told = |text: &str| {
        let dialect = Dialect::parse("own.toml", text).unwrap_or_else(|why| panic!("{}", why.message("en")));
        let files = post::write_with(&dialect, &program).unwrap();
        proved(Some(&dialect), &program, &files)
    };
    assert!(told(text).is_empty());
    let rows = [
        ("G1 X@X@ Y@Y@ Z@Z@ F@F@", "G1 X@X@ Z@Z@ F@F@"),
        ("G1 X@X@ Y@Y@ Z@Z@ F@F@", "G1 X@X@ Y@Y@ Z0.1 F@F@"),
        ("G1 Z@Z@ F@F@", "G1 F@F@"),
        ("G0 Z@U@", ""),
        ("G3 X@X@ Y@Y@ Z@Z@ I@I@ J@J@ F@F@", "G3 X@X@ Y@Y@ Z@Z@ I@I@ F@F@"),
        ("G0 X@X@ Y@Y@\nG0 Z@A@", "G0 X@X@\nG0 Z@A@"),
        ("M3 S@S@\n", ""),
        ("Z@Z@", "Z@Z*2@"),
        ("X@X@", "X@X+0.05@"),
    ];
    for (from, to) in rows {
        let changed = text.replace(from, to);
        assert_ne!(changed, text, "{from}");
        assert_ne!(errors(&told(&changed)), Vec::<&str>::new(), "{from} → {to}");
    }
    // The reader does not follow this word, so the result is uncertain.
    let other = told(&text.replace("G21 G17", "G21 G68 G17"));
    assert_eq!((errors(&other), other.last().unwrap().code.as_str()), (Vec::new(), "written.unread"));
}
