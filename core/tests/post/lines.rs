//! Tests that every written line knows its commands, and with them its time and place, in both directions.

use super::{one, programs};
use annulus_core::job::{Command, CommandPlace, Leg, Program};
use annulus_core::machine::virtual_drill;
use annulus_core::motion;
use annulus_core::post::{self, FileSplit, Manner, OutputFile};
use annulus_core::sim::{Playback, ProgramLines};

fn written(target: &str, program: &Program) -> Result<OutputFile, String> {
    let manner = Manner { files: Some(FileSplit::Job), ..Manner::on(&virtual_drill()) };
    let files = post::write(target, program, &manner).expect("a target");
    files.map(one).map_err(|diagnostic| diagnostic.message("en"))
}

fn of_leg(program: &Program, place: CommandPlace) -> Option<(&Leg, Option<&Command>)> {
    let leg = program.legs.get(place.leg as usize)?;
    Some((leg, leg.commands.get(place.command as usize)))
}

#[test]
fn every_line_has_a_command_and_every_cut_a_line() {
    for target in post::targets() {
        for seed in 0..40 {
            let program = if seed == 0 { programs::small() } else { programs::random_program(seed, None) };
            let Ok(file) = written(target, &program) else { continue };
            assert_eq!(file.commands.len(), file.text.lines().count(), "{target}, seed {seed}");
            for (line, place) in file.text.lines().zip(&file.commands) {
                assert!(of_leg(&program, *place).is_some(), "{target}, seed {seed}: {line} is of {place:?}");
            }
            let cuts = (0..)
                .zip(&program.legs)
                .flat_map(|(leg, whole)| whole.placed(leg))
                .filter(|(_, command)| matches!(command, Command::Mill { .. } | Command::MillArc { .. }));
            // A drill file omits commands that it can't express.
            for (place, command) in cuts.filter(|_| target != "excellon") {
                assert!(
                    file.commands.contains(&place),
                    "{target}, seed {seed}: {place:?}, {command:?} has no line"
                );
            }
        }
    }
}

/// X and Y after each line, read from GRBL's words.
fn places(text: &str) -> Vec<[f64; 2]> {
    let mut at = [0.0; 2];
    let lines = text.lines().map(|line| {
        let words = line.split_whitespace().filter(|_| !line.starts_with('('));
        for word in words {
            for (axis, letter) in ["X", "Y"].into_iter().enumerate() {
                if let Some(mm) = word.strip_prefix(letter).and_then(|mm| mm.parse().ok()) {
                    at[axis] = mm;
                }
            }
        }
        at
    });
    lines.collect()
}

#[test]
fn line_and_playback_position_find_each_other() {
    let machine = virtual_drill();
    let mut seen = 0;
    for seed in 0..30 {
        let program = if seed == 0 { programs::small() } else { programs::random_program(seed, None) };
        let (Ok(file), Ok(timeline)) = (written("grbl", &program), motion::timeline(&program, &machine))
        else {
            continue;
        };
        let (playback, places) = (Playback::new(timeline), places(&file.text));
        let lines = ProgramLines::new(file.commands.clone());
        assert_eq!(lines.len(), places.len());
        let starts: Vec<f64> = (0..lines.len()).map(|line| lines.start_s(line, &playback)).collect();
        assert!(starts[0] == 0.0 && starts.is_sorted(), "seed {seed}: {starts:?}");
        for (line, start_s) in starts.iter().enumerate() {
            // A line ends when the next one begins; lines that are executed together end together.
            let last =
                (line..lines.len()).take_while(|other| lines.are_together(line, *other)).last().unwrap();
            let end_s = starts.get(last + 1).copied().unwrap_or(playback.total_s());
            if end_s - start_s < 1e-4 {
                continue;
            }
            let found = playback.at(end_s - 1e-6).unwrap().position_mm;
            let away = (found[0] - places[last][0]).abs().max((found[1] - places[last][1]).abs());
            assert!(away < 0.02, "seed {seed}, line {line}: at {found:?}, and not at {:?}", places[last]);
            let middle_s = 0.5 * (start_s + end_s);
            let back = lines.line_of(playback.command_at(middle_s).unwrap()).unwrap();
            assert!(
                lines.are_together(back, line),
                "seed {seed}: line {line} at {middle_s} s is said to be {back}"
            );
            seen += 1;
        }
    }
    assert!(seen > 300, "only {seen} lines");
}

#[test]
fn declaration_at_the_file_end_maps_to_its_command() {
    let at = |leg, command| CommandPlace { leg, command };
    // The third line declares the place of the first.
    let lines = ProgramLines::new(vec![at(1, 2), at(2, 2), at(1, 2), at(4, 0)]);
    let rows = [((0, 0), 0), ((1, 2), 0), ((1, 3), 1), ((2, 0), 1), ((3, 9), 3), ((9, 9), 3)];
    for ((leg, command), line) in rows {
        assert_eq!(lines.line_of(at(leg, command)), Some(line), "{leg} {command}");
    }
    assert!(lines.are_together(0, 2) && !lines.are_together(0, 1));
    assert_eq!(ProgramLines::default().line_of(at(0, 0)), None);
}
