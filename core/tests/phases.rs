//! Tests of phase tables: bytes as in the reference in both directions, no 24 V at rest, and wrong tables
//! refused by column.

use crate::reference::vectors;
use annulus_core::chance::Chance;
use annulus_core::machine::phases::{
    Commutator, FORCING, MOST_COLUMNS, PRESETS, WINDINGS, angle, byte, check, column, preset, turn, turns,
};
use annulus_core::machine::{PhaseTable, Value as Setting, apply, virtual_drill};

fn table(columns: &[u8]) -> PhaseTable {
    PhaseTable { columns: columns.to_vec() }
}

#[test]
fn phase_bytes_match_the_reference_both_ways() {
    let file = vectors("step_automaton.json");
    let lab = PhaseTable::arendt();
    let printed: Vec<u8> = serde_json::from_value(file["phase_table"]["bytes"].clone()).unwrap();
    assert_eq!(lab.columns, printed);
    let rows = file["phases"].as_array().unwrap();
    assert!(rows.len() > 20);
    for row in rows {
        let position = row["position"].as_i64().unwrap();
        let [forward, backward] =
            ["byte", "byte_arriving_backward"].map(|key| row[key].as_u64().unwrap() as u8);
        assert_eq!(column(&lab, position), forward, "{row}");
        assert_eq!(byte(&lab, position, column(&lab, position - 1)), forward, "{row}");
        assert_eq!(byte(&lab, position, column(&lab, position + 1)), backward, "{row}");
    }
}

#[test]
fn preset_phase_tables_are_valid_and_force_at_switching() {
    for name in PRESETS {
        let table = preset(name).unwrap();
        assert_eq!(check("x.phases", &table), Ok(vec![]), "{name}");
        assert_eq!(turns(&table), 1, "{name}");
        let length = table.columns.len() as i64;
        let forces = table.columns.iter().any(|byte| byte & FORCING != 0);
        let mut chance = Chance::new(11);
        let mut motor = Commutator::new(table.clone(), 5);
        assert_eq!(motor.byte() & FORCING, 0, "nothing is forced before the first step");
        let mut angle_now = i64::from(angle(motor.byte()).unwrap());
        let begun = angle_now;
        for _ in 0..5_000 {
            let number = chance.bits();
            let (before, forward) = (motor.byte(), number >> 62 != 0);
            let byte = motor.step(forward);
            let pull = turn(angle_now, i64::from(angle(byte).unwrap()));
            assert!((0..=2).contains(&if forward { pull } else { -pull }), "{name}: {before:02X} {byte:02X}");
            angle_now += pull;
            for (halves, force) in [(0b0011, 0b010_0000), (0b1100, 0b100_0000)] {
                let switched = byte & halves != 0 && (byte ^ before) & halves != 0;
                assert_eq!(byte & force != 0, forces && switched, "{name}: {before:02X} {byte:02X}");
            }
            assert_eq!(byte & WINDINGS, column(&table, motor.steps()) & WINDINGS);
            if number >> 60 & 3 == 0 {
                let held = motor.hold();
                assert_eq!((held, motor.hold()), (byte & WINDINGS, byte & WINDINGS), "held on 5 V");
            }
        }
        // A cycle is one revolution of the current: the angle follows the steps.
        let ideal = (motor.steps() - 5) * 8 / length;
        assert!((angle_now - begun - ideal).abs() <= 2, "{name}");
    }
    assert_eq!(preset("none"), None);
    assert_eq!(column(&table(&[]), 3), 0);
}

#[test]
fn wrong_phase_tables_are_refused_with_the_column() {
    // (columns, code of the first diagnostic, part of its message)
    let rows: [(&[u8], &str, &str); 13] = [
        (&[], "phases.length", "0 columns"),
        (&[5; MOST_COLUMNS + 1], "phases.length", "65"),
        (&[0x05, 0x09, 0x1A, 0x06], "phases.unused_bit", "column 3"),
        (&[0x05, 0x0B, 0x0A, 0x06], "phases.both_halves", "column 2"),
        (&[0x05, 0x09, 0x0A, 0x0E], "phases.both_halves", "winding 2"),
        (&[0x41, 0x08, 0x02, 0x04], "phases.forcing_undriven", "winding 2"),
        (&[0x05, 0x09, 0x00, 0x06], "phases.nothing_driven", "column 3"),
        (&[0x25, 0x09, 0x0A, 0x06], "phases.forcing_missing", "column 3"),
        (&[0x25, 0x05, 0x29, 0x09, 0x2A, 0x0A, 0x06, 0x06], "phases.forcing_extra", "column 3"),
        (&[0x05, 0x05, 0x05], "phases.never_turns", "never turn"),
        (&[0x05, 0x0A, 0x09, 0x06], "phases.jump", "column 2"),
        (&[0x05, 0x09, 0x0A], "phases.jump", "column 1"),
        (&[0x05, 0x09, 0x0A, 0x09, 0x0A, 0x06], "phases.turns_back", "column 4"),
    ];
    for (columns, code, part) in rows {
        let refusals = check("y.phases", &table(columns)).expect_err(&format!("{columns:02X?} was accepted"));
        let message = refusals[0].message("en");
        assert_eq!(refusals[0].code, code, "{columns:02X?}: {message}");
        assert!(message.contains(part) && message.contains("y.phases"), "{message}");
        assert!(refusals.iter().all(|diagnostic| !diagnostic.message("en").contains('{')), "{message}");
        assert!(
            refusals
                .iter()
                .all(|diagnostic| diagnostic.advice("en") != format!("{}.advice", diagnostic.code))
        );
    }
    let mirrored: Vec<u8> = PhaseTable::full_step().columns.into_iter().rev().collect();
    let warnings = check("x.phases", &table(&mirrored)).unwrap();
    assert_eq!(warnings[0].code, "phases.backwards");
}

#[test]
fn every_wrong_bit_in_the_boost_table_is_found() {
    let lab = PhaseTable::arendt();
    for (index, bit) in (0..12).flat_map(|index| (0..8).map(move |bit| (index, bit))) {
        let mut wrong = lab.clone();
        wrong.columns[index] ^= 1 << bit;
        // A winding may be switched off one step early: the field still advances.
        let early = [(2, 2), (5, 0), (8, 3), (11, 1)].contains(&(index, bit));
        assert_eq!(check("x.phases", &wrong).is_ok(), early, "column {} bit {bit}", index + 1);
    }
}

#[test]
fn phase_tables_up_to_64_columns_are_valid() {
    for (name, times) in [("full_two", 16), ("half", 8), ("boost_12", 5), ("full_one", 1)] {
        let once = preset(name).unwrap();
        let many = table(&once.columns.repeat(times));
        assert_eq!(check("z.phases", &many), Ok(vec![]), "{name}");
        assert_eq!(turns(&many), times as i64, "{name}");
    }
    // Seven columns, some longer than others.
    let odd = table(&[0x05, 0x05, 0x09, 0x0A, 0x0A, 0x06, 0x06]);
    assert_eq!(check("z.phases", &odd), Ok(vec![]));
    assert_eq!([-8, -1, 0, 6, 7].map(|steps| column(&odd, steps)), [0x06, 0x06, 0x06, 0x06, 0x06]);
    assert_eq!([-6, 1, 8, i64::MAX - 1].map(|steps| column(&odd, steps) & FORCING), [0; 4]);
}

#[test]
fn machine_with_a_wrong_table_is_refused() {
    let change = |key: &str, numbers: &[f64]| {
        apply(&virtual_drill(), &[(key.to_owned(), Setting::Numbers(numbers.to_vec()))])
    };
    let refusals = change("z.phases", &[5.0, 10.0, 9.0, 6.0]).unwrap_err();
    assert!(refusals[0].message("en").contains("z.phases: in column 2"), "{}", refusals[0].message("en"));
    assert_eq!(change("drive.leave", &[2.0, 3.0, 9.0]).unwrap_err()[0].code, "automaton.hunts");
    assert!(change("x.phases", &[5.0, 1.0, 9.0, 8.0, 10.0, 2.0, 6.0, 4.0]).is_ok());
}
