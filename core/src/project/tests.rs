//! Job files: a written file reads back equal, and errors have their position.

use super::*;
use crate::board::Board;
use crate::cam::work::{Flip, Isolate};
use crate::chance::Chance;
use crate::geometry::Bounds;
use crate::machine::virtual_drill;

fn base() -> Work {
    Work::default_for(&Board::default(), &virtual_drill())
}

fn every_kind() -> Work {
    let mut work = base();
    work.operations =
        OperationKind::WORDS.iter().filter_map(|word| Operation::usual(word, Face::Bottom)).collect();
    work.setup.flip = Flip::TopBottom;
    work.setup.exclusions =
        vec![Bounds { min: Point::from_mm(-1.0, 2.5), max: Point::from_mm(3.0, 4.000001) }];
    let at = |x, y| Point::from_mm(x, y);
    if let Some(Operation { action: OperationKind::Isolate(isolate), name, .. }) = work.operations.first_mut()
    {
        "Oś \"górna\"\\".clone_into(name);
        let remedies =
            [Remedy::Bit(work.bits[0].name.clone()), Remedy::Depth(Length::from_um(45)), Remedy::Centred];
        let cure = |with| LocalIsolation { from: at(1.5, -2.0), to: at(1.6, -2.0), with };
        *isolate = Isolate {
            cures: remedies.map(cure).to_vec(),
            further: vec![work.bits[0].name.clone()],
            ..isolate.clone()
        };
    }
    if let Some(Operation { action: OperationKind::CutOut(cut), .. }) = work.operations.last_mut() {
        cut.tab_at = vec![at(0.0, 1.0), at(10.0, 1.0)];
    }
    work
}

#[test]
fn written_job_reads_back_unchanged() {
    let work = every_kind();
    let text = write(&work);
    let again = read("job.toml", &text, &base()).unwrap();
    assert_eq!(again, work, "{text}");
    assert_eq!(write(&again), text);
}

#[test]
fn omitted_rows_have_the_board_defaults() {
    let base = base();
    let work = read("job.toml", "schema = 1\n", &base).unwrap();
    assert_eq!(work, base);
    let text = "schema = 1\n[setup]\ncolumns = 2\n[[operation]]\nkind = \"cut_out\"\ntabs = 2\n";
    let work = read("job.toml", text, &base).unwrap();
    assert_eq!((work.setup.panel.columns, work.setup.panel.rows, work.operations.len()), (2, 1, 1));
    assert_eq!(work.bits, base.bits);
}

#[test]
fn unknown_row_suggests_the_nearest_one() {
    let rows = [
        ("schem = 1\n", "schema = 1"),
        ("schema = 1\n[[operations]]\n", "[[operation]]"),
        ("schema = 1\n[setup]\ncolums = 2\n", "columns"),
        ("schema = 1\n[[operation]]\nkind = \"isolate\"\npases = 2\n", "passes"),
        ("schema = 1\n[[bit]]\nnam = \"a\"\n", "name"),
    ];
    for (text, meant) in rows {
        let why = read("job.toml", text, &base()).unwrap_err();
        assert_eq!(why.code, "project.unknown_row", "{text}");
        let told = why.message("en");
        assert!(told.contains(&format!("The nearest is {meant}.")), "{text}: {told}");
    }
}

#[test]
fn errors_have_their_position() {
    let rows = [
        ("schema = 1\n[setup\n", "project.syntax", 2, 7),
        ("", "project.schema", 1, 1),
        ("schema = 9\n", "project.schema", 1, 1),
        ("schema = 1\ncolour = 1\n", "project.unknown_row", 2, 1),
        ("schema = 1\n[setup]\ncolums = 2\n", "project.unknown_row", 3, 1),
        ("schema = 1\n[setup]\nexclusions = [1, 2, 3]\n", "work.uneven_list", 3, 14),
        ("schema = 1\n[[operation]]\nkind = \"cut_out\"\ntab_at = [1]\n", "work.uneven_list", 4, 10),
        ("schema = 1\n[[operation]]\nkind = \"drill\"\nspeed = 0\n", "machine.setting_range", 4, 9),
        ("schema = 1\n[setup]\ncolumns = 0\n", "machine.setting_range", 3, 11),
        ("schema = 1\n[[bit]]\ndiameter = 1.0\n", "project.no_name", 2, 1),
        ("schema = 1\n[[bit]]\nname = \"a\"\nform = \"vee\"\ntip = 2.0\n", "project.tip_too_wide", 2, 1),
        ("schema = 1\n[[bit]]\nname = \"a\"\n[[bit]]\nname = \"a\"\n", "project.name_twice", 4, 1),
        ("schema = 1\n[[operation]]\nkind = \"fold\"\n", "project.unknown_kind", 3, 8),
        ("schema = 1\n[[operation]]\ntabs = 1\n", "project.unknown_kind", 2, 1),
        ("schema = 1\n[[operation]]\nkind = \"drill\"\ntabs = 1\n", "project.unknown_row", 4, 1),
        ("schema = 1\n[[operation]]\nkind = \"isolate\"\nbit = \"none\"\n", "project.no_such_bit", 2, 1),
        (
            "schema = 1\n[[operation]]\nkind = \"isolate\"\n[[operation.cure]]\nfrom = [1, 2]\n",
            "project.bad_cure",
            4,
            1,
        ),
    ];
    for (text, code, line, column) in rows {
        let why = read("job.toml", text, &base()).unwrap_err();
        let place = why.place.clone().unwrap();
        assert_eq!((why.code.as_str(), place.line, place.column), (code, line, column), "{text}");
        assert!(!why.message("en").contains(".message"), "{code} has no sentence");
    }
}

#[test]
fn truncated_or_changed_bytes_never_panic() {
    let text = write(&every_kind());
    for end in (0..text.len()).step_by(7).filter(|end| text.is_char_boundary(*end)) {
        let _ = read("cut", &text[..end], &base());
    }
    let mut chance = Chance::new(11);
    for _ in 0..500 {
        let mut bytes = text.clone().into_bytes();
        let at = chance.below(bytes.len());
        bytes[at] = chance.below(128) as u8;
        let _ = read("mutated", &String::from_utf8_lossy(&bytes), &base());
    }
}

#[test]
fn only_explicit_speeds_are_written() {
    let mut work = every_kind();
    let text = write(&work);
    assert!(text.contains("\n# plunge = \"machine\"\n") && !text.contains("\nplunge = "), "{text}");
    work.operations[1].plunge_mm_per_s = Some(1.25);
    let text = write(&work);
    assert_eq!(text.matches("\nplunge = 1.25\n").count(), 1, "{text}");
    assert_eq!(read("job.toml", &text, &base()).unwrap(), work);
}

#[test]
fn job_file_speeds_override_the_machine() {
    let rows = "feed = 12\nplunge = 12\nspeed = 30000\ntolerance = 0.05\n";
    let work = read("job", &format!("schema = 1\n[[operation]]\nkind = \"drill\"\n{rows}"), &base()).unwrap();
    let speeds = work.operations[0].speeds(&crate::machine::hobby_3018());
    assert_eq!((speeds.feed_mm_per_s, speeds.plunge_mm_per_s, speeds.spindle_rpm), (12.0, 12.0, 30_000));
    let rows =
        rows.replace("12", "\"machine\"").replace("30000", "\"machine\"").replace("0.05", "\"machine\"");
    let again =
        read("job", &format!("schema = 1\n[[operation]]\nkind = \"drill\"\n{rows}"), &base()).unwrap();
    assert_eq!(again.operations, [Operation::usual("drill", Face::Top).unwrap()]);
}
