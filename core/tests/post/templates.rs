//! Tests of the template language and the settings of a dialect.

use super::programs::{change, program, random_program, small};
use super::{one, seen};
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Leg, Mark, Program};
use annulus_core::post::{self, Block, Dialect, TemplateKind};
use annulus_core::units::Length;
use std::f64::consts::{PI, TAU};

const HEAD: &str = "schema = 1\nname = \"mine\"\nextension = \"tap\"\n";
const EMPTY_DRILL: &str = "[drill]\nstart = ''\nchange = ''\nhole = ''\npeck = ''\nend = ''\n";

fn dialect(text: &str) -> Dialect {
    Dialect::parse("mine.toml", &format!("{HEAD}{text}"))
        .unwrap_or_else(|diagnostic| panic!("{diagnostic:?}"))
}

fn written(text: &str, program: &Program) -> String {
    one(post::write_with(&dialect(text), program).unwrap_or_else(|diagnostic| panic!("{diagnostic:?}"))).text
}

fn engrave(more: &str, line: &str, arc: &str) -> String {
    format!(
        "{more}{EMPTY_DRILL}[engrave]\nstart = ''\napproach = '''\n{line}\n'''\nline = '''\n{line}\n'''\n\
         arc_cw = '''\ncw {arc}\n'''\narc_ccw = '''\nccw {arc}\n'''\nwait = ''\nspindle = ''\nleave = ''\nend = ''\n"
    )
}

fn way(commands: Vec<Command>) -> Program {
    program(vec![change(1, 30_000, 0), Leg { mark: Mark::Toolpath(0), commands }])
}

#[test]
fn template_shifts_numbers_and_line_numbers_are_applied() {
    let text = "shift_mm = [100.0, -0.5]\n[number]\ndecimals = 2\ntrailing_zeros = \"one\"\n[number.S]\ndecimals = 1\n\
        [lines]\nfirst = 5\nstep = 2\n[drill]\nstart = \"N@N@ H@H@@@ @PROGRAM@\"\n\
        change = \"N@N@ T@T@ D@D@ TR@TR@ S@S/1000@ W@W:1@ (@BIT@)\"\nhole = \"N@N@ X@X+10@ Y@Y*-1@ T@T@ F@F@ V@V@ W@W@ U@U@\"\n\
        peck = \"N@N@ Z@Z@ U@U@\"\nend = \"N@N@ X@X@\"\n";
    let mut program = small();
    program.legs.truncate(4);
    let expected = "N5 H2.0@ small-board\nN7 T1 D0.8 TR0.4 S30.0 W1.5 (drill 0.8)\nN9 X122.7 Y-8.39 T1 F720.0 V12.0 W0.1 U2.0\n\
        N11 Z-1.0 U0.5\nN13 Z-2.1 U2.0\nN15 X100.0\n";
    assert_eq!(written(text, &program), expected);
}

#[test]
fn modal_words_are_not_repeated() {
    let lines = "[comments]\nopen = \"(\"\nclose = \")\"\n[modal]\nparameters = [\"X\", \"Y\", \"Z\", \"F\"]\ngroups = [\"G1 G2 G3\"]\n";
    let text = engrave(lines, "(X1.000) G1 X@X@ Y@Y@ Z@Z@ F@F@", "G2 X@X@ Y@Y@ Z@Z@ I@I@ J@J@ F@F@");
    let (height, feed_um_per_s) = (Length::from_um(-100), 10_000);
    let at = Point::from_mm;
    let line = |x, y| Command::Mill { to: at(x, y), height, feed_um_per_s };
    let half =
        |x: f64| Command::MillArc { to: at(x, 2.0), height, center: at(2.0, 2.0), ccw: false, feed_um_per_s };
    let program = way(vec![
        Command::Rapid { to: at(1.0, 2.0) },
        Command::Plunge { to: height, feed_um_per_s, gate: None },
        line(1.0, 3.0),
        line(1.0, 2.0),
        half(3.0),
        half(1.0),
        line(1.0, 4.0),
    ]);
    let expected = "(X1.000) G1 X1.000 Y2.000 Z-0.100 F600.0\n(X1.000) Y3.000\n(X1.000) Y2.000\n\
        cw G2 X3.000 Y2.000 I1.000 J0.000\ncw X1.000 Y2.000 I-1.000 J0.000\n(X1.000) G1 Y4.000\n";
    assert_eq!(written(&text, &program), expected);
    let dropped = engrave(&lines.replace("[modal]", "dropped = true\n[modal]"), "G1 X@X@ (@JOB@)", "");
    assert!(written(&dropped, &program).starts_with("G1 X1.000\n"), "{}", written(&dropped, &program));
}

#[test]
fn modal_memory_is_cleared_by_words_with_several_numbers() {
    let text = engrave("[modal]\nparameters = [\"X\", \"Y\"]\n", "X@X@ Y@Y@ X@X@Y@Y@ G0 Y9.000 Y@Y@", "");
    let at = Point::from_mm;
    let height = Length::from_um(-100);
    let program = way(vec![
        Command::Rapid { to: at(1.0, 9.0) },
        Command::Plunge { to: height, feed_um_per_s: 1_000, gate: None },
        Command::Mill { to: at(1.0, 9.0), height, feed_um_per_s: 1_000 },
    ]);
    let line = "X1.000 Y9.000 X1.000Y9.000 G0 Y9.000";
    assert_eq!(
        written(&text, &program),
        format!("{line}\n{}\n", line.replacen("X1.000 Y9.000", "X1.000", 1))
    );
}

#[test]
fn lines_are_numbered_skipped_and_ended_as_configured() {
    let text = "[lines]\nnumbered = true\nunnumbered = [\"%\"]\nending = \"crlf\"\nskippable = [\"drill.change\"]\n\
        [drill]\nstart = \"%\\nG21\\n\\n\"\nchange = \"M0\\n@?W@G4 P@W@\"\nhole = \"\"\npeck = \"\"\nend = \"M2\\n%\"\n";
    let mut program = small();
    program.legs.truncate(3);
    assert_eq!(written(text, &program), "%\r\nN10 G21\r\n\r\n/N20 M0\r\n/N30 G4 P1.500\r\nN40 M2\r\n%\r\n");
}

#[test]
fn template_points_go_to_the_end_section() {
    let text = "[drill]\nstart = ''\nchange = ''\npeck = ''\nhole = '''\nL P[@K+1@] P[@K+2@]\n@>P[@K+1@] @X@\n@>P[@K+2@] @Z@\n'''\n\
        end = '''\n/POS\n@<\n/END @K@\n'''\n";
    let hole = |x| Leg {
        mark: Mark::Hole(0),
        commands: vec![
            Command::Rapid { to: Point::from_mm(x, 0.0) },
            Command::Plunge { to: Length::from_um(-1_000), feed_um_per_s: 1, gate: None },
            Command::Retract { to: Length::from_um(2_000) },
        ],
    };
    let expected =
        "L P[1] P[2]\nL P[3] P[4]\n/POS\nP[1] 1.000\nP[2] -1.000\nP[3] 2.000\nP[4] -1.000\n/END 4\n";
    assert_eq!(written(text, &program(vec![hole(1.0), hole(2.0)])), expected);
}

fn told(line: &str) -> Vec<f64> {
    line.split_whitespace().skip(1).map(|word| word.parse().unwrap()).collect()
}

#[test]
fn every_arc_parameter_has_its_documented_meaning() {
    // Both directions, starts at every eighth of a turn, angles below, at and above 180°.
    let all = "@X@ @Y@ @AX@ @AY@ @I@ @J@ @R@ @CR@ @P@ @CX@ @CY@ @DX@ @DY@";
    let text = engrave("[number]\ndecimals = 6\n[number.P]\ndecimals = 6\n", "", all);
    let (radius, centre) = (5.0, (3.0, -4.0));
    for ccw in [true, false] {
        for eighth in 0..8 {
            for degrees in [1.0_f64, 45.0, 90.0, 135.0, 179.0, 180.0, 181.0, 270.0, 359.0, 360.0] {
                let start = f64::from(eighth) * PI / 4.0 + 0.1;
                let end = if ccw { start + degrees.to_radians() } else { start - degrees.to_radians() };
                let on =
                    |angle: f64| (centre.0 + radius * libm::cos(angle), centre.1 + radius * libm::sin(angle));
                let (from, to) = (on(start), if degrees == 360.0 { on(start) } else { on(end) });
                let middle = on((start + end) / 2.0);
                let height = Length::from_um(-100);
                let arc = Command::MillArc {
                    to: Point::from_mm(to.0, to.1),
                    height,
                    center: Point::from_mm(centre.0, centre.1),
                    ccw,
                    feed_um_per_s: 1_000,
                };
                let start_at = Point::from_mm(from.0, from.1);
                let program = way(vec![
                    Command::Rapid { to: start_at },
                    Command::Plunge { to: height, feed_um_per_s: 1_000, gate: None },
                    arc,
                ]);
                let text = written(&text, &program);
                let line =
                    text.lines().find(|line| line.starts_with(if ccw { "ccw" } else { "cw" })).unwrap();
                let signed = if degrees > 180.0 { -radius } else { radius };
                let expected = [
                    to.0,
                    to.1,
                    middle.0,
                    middle.1,
                    centre.0 - from.0,
                    centre.1 - from.1,
                    radius,
                    signed,
                    degrees,
                    centre.0,
                    centre.1,
                    to.0 - from.0,
                    to.1 - from.1,
                ];
                for (index, (found, meant)) in told(line).iter().zip(expected).enumerate() {
                    // At exactly half a circle the sign of CR is undefined.
                    let free = index == 7 && degrees == 180.0;
                    let found = if free { found.abs() } else { *found };
                    let slack = if index == 8 { 1e-4 } else { 3e-6 };
                    assert!(
                        (found - meant).abs() < slack,
                        "{degrees}° from {eighth}/8 {ccw}, {index}: {found} {meant}"
                    );
                }
            }
        }
    }
}

/// The centre that a controller calculates from both ends and the radius.
fn centre_of(from: (f64, f64), to: (f64, f64), radius: f64, ccw: bool) -> (f64, f64) {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let chord = libm::hypot(dx, dy);
    let height = libm::sqrt((radius * radius - chord * chord / 4.0).max(0.0));
    let left = if ccw == (radius > 0.0) { height } else { -height };
    ((from.0 + to.0) / 2.0 - dy / chord * left, (from.1 + to.1) / 2.0 + dx / chord * left)
}

#[test]
fn radius_alone_defines_an_arc_when_arcs_are_split() {
    for (name, wide) in [("R", false), ("CR", true)] {
        let text = engrave("[number]\ndecimals = 4\n", "line @X@ @Y@", &format!("@X@ @Y@ @{name}@"));
        let dialect = dialect(&text);
        for seed in 0..200 {
            let mut chance = annulus_core::chance::Chance::new(seed);
            let from = Point::from_mm(12.3456, -3.2109);
            let height = Length::from_um(-100);
            let arc = super::programs::arc(&mut chance, from, height, 1_000);
            let Command::MillArc { center, ccw, to, .. } = arc else { panic!("{arc:?}") };
            let program = way(vec![
                Command::Rapid { to: from },
                Command::Plunge { to: height, feed_um_per_s: 1_000, gate: None },
                arc,
            ]);
            let text = one(post::write_with(&dialect, &program).unwrap()).text;
            let mut at = (from.x.mm(), from.y.mm());
            let whole = from.distance_mm(center);
            let mut turned = 0.0;
            for line in text.lines().filter(|line| line.starts_with(['c'])) {
                let rows = told(line);
                let (end, radius) = ((rows[0], rows[1]), rows[2]);
                assert!(wide || radius > 0.0);
                let middle = centre_of(at, end, radius, ccw);
                let angle = |at: (f64, f64)| libm::atan2(at.1 - middle.1, at.0 - middle.0);
                let turn = if ccw { angle(end) - angle(at) } else { angle(at) - angle(end) };
                let turn = if turn < 0.0 { turn + TAU } else { turn };
                turned += turn;
                assert_eq!(turn > PI, radius < 0.0, "seed {seed}: {line}");
                // Only the path matters for the cut: its midpoint must be on the true circle.
                let half = angle(at) + if ccw { turn / 2.0 } else { -turn / 2.0 };
                let point =
                    (middle.0 + radius.abs() * libm::cos(half), middle.1 + radius.abs() * libm::sin(half));
                let off = libm::hypot(point.0 - center.x.mm(), point.1 - center.y.mm()) - whole;
                assert!(off.abs() < seen::MICROMETRE, "seed {seed}: {off} {line}");
                at = end;
            }
            let expected =
                if from == to { TAU } else { annulus_core::geometry::chords::turn(from, to, center, !ccw) };
            assert!((turned - expected).abs() * whole < 0.01, "seed {seed}: {turned} {expected}");
        }
    }
}

#[test]
fn increments_do_not_accumulate_errors() {
    let text = engrave("[number]\ndecimals = 2\n[arcs]\nlines_only = true\n", "@DX@ @DY@", "");
    let mut program = random_program(3, None);
    program.legs.retain(|leg| matches!(leg.mark, Mark::Toolpath(_)));
    let mut text = text.replacen("approach = '''\n@DX@ @DY@", "approach = '''\nat @X@ @Y@", 1);
    text = text.replacen("leave = ''", "leave = 'to @X@ @Y@'", 1);
    let mut at = (0.0, 0.0);
    let mut checked = 0;
    for line in written(&text, &program).lines() {
        let rows: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        if line.starts_with("at") {
            at = (rows[0], rows[1]);
        } else if line.starts_with("to") {
            assert!((at.0 - rows[0]).abs() < 1e-9 && (at.1 - rows[1]).abs() < 1e-9, "{at:?} {line}");
            checked += 1;
        } else {
            at = (at.0 + rows[0], at.1 + rows[1]);
        }
    }
    assert!(checked > 0);
}

#[test]
fn files_are_split_as_the_postprocessor_requires() {
    let part =
        |name: &str, more: &str| format!("[{name}]\nstart = '{name} @PROGRAM@ T@T@'\nend = 'end'\n{more}");
    let drill = part("drill", "change = 'bit @T@'\nhole = 'hole'\npeck = 'peck'\n");
    let arcs = "arc_cw = 'arc'\narc_ccw = 'arc'\n";
    let mill = part("engrave", &format!("approach = 'down'\nline = 'line'\nleave = 'up'\n{arcs}"));
    let names = |files: &str| {
        let written = post::write_with(&dialect(&format!("{files}\n{drill}{mill}")), &small()).unwrap();
        written
            .into_iter()
            .map(|file| (file.name, file.text.lines().take(2).collect::<Vec<_>>().join("|")))
            .collect::<Vec<_>>()
    };
    let row = |name: &str, head: &str| (name.to_owned(), head.to_owned());
    assert_eq!(names(""), [row("small-board.tap", "drill small-board T1|bit 1")]);
    let both = [
        row("small-board-1-drill.tap", "drill small-board-1-drill T1|bit 1"),
        row("small-board-2-engrave.tap", "engrave small-board-2-engrave T2|bit 2"),
    ];
    assert_eq!(names("files = 'operation'"), both);
    let numbered = [
        row("01-drill-0.8.tap", "drill 01-drill-0.8 T1|bit 1"),
        row("02-mill-1.tap", "engrave 02-mill-1 T2|bit 2"),
    ];
    assert_eq!(names("files = 'bit'"), numbered);
    let loaded = format!("{drill}load = 'load @T@'\n");
    let written = post::write_with(&dialect(&format!("files = 'bit'\n{loaded}{mill}")), &small()).unwrap();
    let second: Vec<_> = written.iter().map(|file| file.text.lines().nth(1).unwrap()).collect();
    assert_eq!(second, ["load 1", "load 2"]);
    let short = names("files = 'bit'\n[program_name]\nlongest = 8\ncapitals = true");
    assert_eq!(short[1], row("SMAARD_2.tap", "engrave SMAARD_2 T2|bit 2"));
}

#[test]
fn missing_template_parts_are_refused() {
    let only_drill = dialect(EMPTY_DRILL);
    assert_eq!(post::write_with(&only_drill, &small()).unwrap_err().code, "post.milling");
    let text = engrave("", "", "");
    let only_mill =
        dialect(&text[text.find("[engrave]").unwrap()..].replacen("spindle", "change = ''\nspindle", 1));
    assert_eq!(post::write_with(&only_mill, &small()).unwrap_err().code, "post.no_drill_template");
    let no_peck = dialect(&text.replace("peck = ''\n", ""));
    assert_eq!(post::write_with(&no_peck, &small()).unwrap_err().code, "post.no_block");
    let thin = dialect(&text.replace("[engrave]", "[engrave]\ntool_radius_mm = 0.3"));
    assert_eq!(post::write_with(&thin, &small()).unwrap_err().code, "post.tool_radius");
    let right = dialect(&text.replace("[engrave]", "[engrave]\ntool_radius_mm = 0.5"));
    assert!(post::write_with(&right, &small()).is_ok());
    let endless = dialect(&EMPTY_DRILL.replace("hole = ''", &format!("hole = '{}'", "x".repeat(900_000))));
    let mut holes = small();
    let hole = holes.legs.swap_remove(2);
    holes.legs = vec![hole; 300];
    assert_eq!(post::write_with(&endless, &holes).unwrap_err().code, "post.too_large");
}

#[test]
fn preview_shows_every_block() {
    for (name, text) in post::shipped() {
        let dialect = Dialect::parse(name, text).unwrap();
        let samples = post::preview(&dialect).unwrap();
        let has = |part, block| samples.iter().any(|sample| (sample.part, sample.block) == (part, block));
        assert!(has(TemplateKind::Drill, Block::Peck) && has(TemplateKind::Engrave, Block::ArcCw), "{name}");
        assert!(
            has(TemplateKind::Drill, Block::Start) && has(TemplateKind::Engrave, Block::End),
            "{name}: {samples:#?}"
        );
        let whole: String = samples.iter().map(|sample| sample.text.as_str()).collect();
        assert!(!whole.is_empty() && whole.lines().count() > 20, "{name}");
    }
}

#[test]
fn manual_lists_blocks_parameters_and_targets() {
    let manual = include_str!("../../../docs/manual/postprocessor.md");
    let hint = |key: &str| annulus_core::locale::text("en", key, &[]);
    for row in post::BLOCKS {
        let meaning = hint(&format!("post.block.{}.{}", row.part.key(), row.block.key()));
        let line = manual.lines().find(|line| {
            line.starts_with(&format!("| `{}` |", row.block.key()))
                && line.ends_with(&format!("| {meaning} |"))
        });
        assert!(line.is_some(), "{}.{}: {meaning}", row.part.key(), row.block.key());
    }
    for row in post::PARAMETERS {
        let meaning = hint(&format!("post.parameter.{}", row.name));
        let line = format!("| `@{}@` | {} | {} | {meaning} |", row.name, row.unit, row.example);
        assert!(manual.contains(&line), "{line}");
    }
    for name in post::targets() {
        assert!(manual.contains(&format!("| `{name}` |")), "{name}");
    }
}
