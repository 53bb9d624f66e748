//! Checks across several settings: inverted ranges, unreachable heights, impossible demands on drives,
//! mismatched tables.
//! The tables themselves are checked in `dynamics`, `table_speeds` and `phases`.

use super::{
    DriveKind, HomeEnd, Machine, Output, StrokeEnd, WIRED, change, dynamics, foot, magazine, park, phases,
    spindles, table_speeds,
};
use crate::diagnostic::Diagnostic;
use crate::job::Input;
use crate::units::Length;
use crate::{code, error};

/// Greatest stopping distance after the contact, in mm.
const BEHIND_CONTACT_MM: f64 = 0.1;

/// All problems across several settings.
pub fn validate(machine: &Machine) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let mut refuse = |code: &str, key: &str, value: f64, bound: f64| {
        diagnostics.push(refuse(code, key, value, bound));
    };
    for (name, axis) in [("x", &machine.x), ("y", &machine.y), ("z", &machine.z)] {
        if axis.min >= axis.max {
            refuse(code!("machine.range_inside_out"), &format!("{name}.min"), axis.min.mm(), axis.max.mm());
        }
        let travel = axis.max - axis.min;
        if axis.home_offset > travel {
            refuse(
                code!("machine.offset_beyond_travel"),
                &format!("{name}.home_offset"),
                axis.home_offset.mm(),
                travel.mm(),
            );
        }
        // The switch turns on one step outside the range.
        if travel > Length::ZERO && axis.home_search <= travel {
            let key = format!("{name}.home_search");
            refuse(code!("machine.search_too_short"), &key, axis.home_search.mm(), travel.mm());
        }
        let rate_hz = axis.max_speed_mm_per_s * axis.scale.steps_per_mm();
        // `table_speeds` checks table drives.
        if machine.drive == DriveKind::Planned && rate_hz > f64::from(machine.max_step_hz) {
            let fastest = f64::from(machine.max_step_hz) / axis.scale.steps_per_mm();
            refuse(
                code!("machine.faster_than_drive"),
                &format!("{name}.max_speed"),
                axis.max_speed_mm_per_s,
                fastest,
            );
        }
    }
    if machine.enabled & machine.installed() == 0 {
        diagnostics.push(error!("machine.no_spindle_enabled", key = "spindle.enabled"));
    }
    diagnostics.extend(homing_of_z(machine));
    diagnostics.extend(index_pulses(machine));
    diagnostics.extend(play_of_z(machine));
    diagnostics.extend(contact(machine));
    diagnostics.extend(touching(machine));
    diagnostics.extend(outputs(machine));
    diagnostics.extend(drives(machine));
    diagnostics.extend(strokes(machine));
    diagnostics.extend(spindles::validate(machine));
    diagnostics.extend(table_speeds::refusals(machine));
    diagnostics.extend(WIRED.iter().flat_map(|(_, validate)| validate(machine)));
    diagnostics.extend(foot::validate(machine));
    diagnostics.extend(magazine::validate(machine));
    diagnostics.extend(park::validate(machine));
    diagnostics.extend(change::validate(machine));
    diagnostics
}

/// Homing must move Z away from the board and end above it, because X and Y home after Z.
fn homing_of_z(machine: &Machine) -> Option<Diagnostic> {
    let (z, process) = (&machine.z, &machine.process);
    if z.home != HomeEnd::Max {
        return Some(error!("machine.homes_into_board", key = "z.home_end"));
    }
    // An unreachable safe height is reported on its own.
    let room = z.max - process.surface - process.safe_height;
    (room >= Length::ZERO && z.home_offset > room)
        .then(|| refuse(code!("machine.rests_in_board"), "z.home_offset", z.home_offset.mm(), room.mm()))
}

/// Index pulses that homing can't use: not wired, ambiguous, or outside the allowed travel.
fn index_pulses(machine: &Machine) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let room_of_z = machine.z.max - machine.process.surface - machine.process.safe_height;
    let axes = [
        ("x", &machine.x, machine.x.max - machine.x.min),
        ("y", &machine.y, machine.y.max - machine.y.min),
        ("z", &machine.z, room_of_z),
    ];
    for (name, axis, room) in axes.into_iter().filter(|(_, axis, _)| axis.index) {
        let key = format!("{name}.index");
        // The wiring of an adapter has no index pulses.
        if machine.output == Output::Adapter {
            diagnostics.push(error!("machine.index_beside_adapter", key = &key));
        }
        // With several spindles, the index pulses of their motors are ambiguous.
        if name == "z" && machine.spindles > 1 {
            let why = error!("machine.index_of_several", key = &key, ..);
            diagnostics.push(why.with("spindles", machine.spindles));
        }
        let turn = axis.index_within;
        if turn > room {
            let key = format!("{name}.index_within");
            diagnostics.push(refuse(code!("machine.index_too_far"), &key, turn.mm(), room.mm()));
        }
        // The switch may close a quarter turn before its nominal edge.
        let quarter_mm = turn.mm() / 4.0;
        if axis.home_offset.mm() < quarter_mm {
            let key = format!("{name}.home_offset");
            diagnostics.push(refuse(code!("machine.index_offset"), &key, axis.home_offset.mm(), quarter_mm));
        }
    }
    diagnostics
}

/// Only XY compensates backlash. Z always hangs or is pulled in one direction, so backlash of Z means that
/// its depth isn't controlled.
fn play_of_z(machine: &Machine) -> Option<Diagnostic> {
    let play = machine.z.backlash;
    (play > Length::ZERO).then(|| refuse(code!("machine.z_with_play"), "z.backlash", play.mm(), 0.0))
}

/// The contact check in every drill cycle needs a wired contact sensor.
fn contact(machine: &Machine) -> Option<Diagnostic> {
    let tolerance = machine.process.contact_tolerance;
    let is_there = machine.tells(Input::Contact) && machine.output != Output::Adapter;
    let wanted = tolerance > Length::ZERO && !is_there;
    wanted.then(|| refuse(code!("machine.no_contact"), "stroke.contact_tolerance", tolerance.mm(), 0.0))
}

/// Probing must stop soon enough after the contact. The slowest state of a table drive is checked with its
/// speeds.
fn touching(machine: &Machine) -> Option<Diagnostic> {
    let braking = (0..3).map(|axis| machine.braking_mm_per_s2(axis)).fold(f64::INFINITY, f64::min);
    let most = libm::floor(libm::sqrt(2.0 * braking * BEHIND_CONTACT_MM) * 100.0) / 100.0;
    let speed = machine.process.touch_mm_per_s;
    let wanted = machine.drive == DriveKind::Planned && speed > most;
    wanted.then(|| refuse(code!("machine.touch_too_fast"), "stroke.touch_speed", speed, most))
}

/// Names of outputs: a letter, then letters, digits or `_`; unique; `spindle` is reserved.
fn outputs(machine: &Machine) -> Option<Diagnostic> {
    let names = machine.output_names();
    let (key, most) = machine.output.naming();
    let good = |name: &str| {
        name.starts_with(|c: char| c.is_ascii_alphabetic())
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
            && name.len() <= 32
            && name != "spindle"
    };
    let twice = |at: usize| names[..at].contains(&names[at]);
    let bad = (0..names.len()).find(|at| !good(&names[*at]) || twice(*at) || *at >= most)?;
    let diagnostic = error!("machine.output_name", key = key, ..);
    Some(diagnostic.with("name", &names[bad]).with("most", most))
}

fn drives(machine: &Machine) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    diagnostics.extend(dynamics::check(&machine.dynamics).err().unwrap_or_default());
    for (name, axis) in [("x", &machine.x), ("y", &machine.y), ("z", &machine.z)] {
        diagnostics.extend(phases::check(&format!("{name}.phases"), &axis.phases).err().unwrap_or_default());
    }
    let period_us = 1e6 / f64::from(machine.max_step_hz);
    if 2.0 * machine.pulse_width_us > period_us {
        diagnostics.push(refuse(
            code!("machine.pulse_too_long"),
            "drive.pulse_width",
            machine.pulse_width_us,
            period_us,
        ));
    }
    let fastest = f64::from(machine.max_step_hz) / machine.z.scale.steps_per_mm();
    if machine.drive == DriveKind::Planned && machine.down.max_speed_mm_per_s > fastest {
        let asked = machine.down.max_speed_mm_per_s;
        diagnostics.push(refuse(code!("machine.faster_than_drive"), "motion.down_speed", asked, fastest));
    }
    diagnostics
}

fn strokes(machine: &Machine) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let mut refuse = |code: &str, key: &str, value: f64, bound: f64| {
        diagnostics.push(refuse(code, key, value, bound));
    };
    let (process, overlap) = (&machine.process, &machine.overlap);
    let top = process.surface + process.safe_height;
    if top > machine.z.max {
        refuse(code!("machine.safe_height_out_of_reach"), "stroke.safe_height", top.mm(), machine.z.max.mm());
    }
    let bottom = process.surface - process.board_thickness - process.breakthrough;
    if bottom < machine.z.min {
        refuse(code!("machine.stroke_out_of_reach"), "stroke.surface", bottom.mm(), machine.z.min.mm());
    }
    let fastest = machine.z.max_speed_mm_per_s.min(machine.down.max_speed_mm_per_s);
    if process.feed_mm_per_s > fastest {
        refuse(code!("machine.feed_too_fast"), "stroke.feed", process.feed_mm_per_s, fastest);
    }
    if process.spindle_rpm == 0 {
        refuse(code!("machine.spindle_stands"), "spindle.speed", 0.0, 1.0);
    }
    let safe_mm = process.safe_height.mm();
    if process.feed_height > process.safe_height {
        refuse(
            code!("machine.feed_height_too_high"),
            "stroke.feed_height",
            process.feed_height.mm(),
            safe_mm,
        );
    }
    if overlap.on && overlap.clear_mm >= safe_mm {
        refuse(code!("machine.clear_too_high"), "overlap.clear", overlap.clear_mm, safe_mm);
    }
    if overlap.on && (machine.stroke_end == StrokeEnd::Sensor || machine.drive == DriveKind::Table) {
        let key = if machine.drive == DriveKind::Table { "drive.kind" } else { "stroke.end" };
        refuse(code!("machine.overlap_without_count"), key, 1.0, 0.0);
    }
    diagnostics
}

fn refuse(code: &str, key: &str, value: f64, bound: f64) -> Diagnostic {
    Diagnostic::error(code).with("key", key).with("value", value).with("bound", bound)
}

#[cfg(test)]
mod tests {
    use super::super::{Value, apply, presets, virtual_drill};
    use super::*;

    fn number(key: &str, value: f64) -> (String, Value) {
        (key.to_owned(), Value::Number(value))
    }

    fn word(key: &str, value: &str) -> (String, Value) {
        (key.to_owned(), Value::Text(value.to_owned()))
    }

    /// Changes, and the code and field of the first error, if any.
    type Row<'a> = (&'a [(String, Value)], Option<(&'a str, &'a str)>);

    fn try_rows(machine: &Machine, rows: &[Row]) {
        for (changes, expected) in rows {
            let refusals = apply(machine, changes).err().unwrap_or_default();
            let found = refusals.first().map(|why| why.code.as_str());
            assert_eq!(found, expected.map(|(code, _)| code), "{changes:?}");
            if let (Some(why), Some((_, key))) = (refusals.first(), expected) {
                assert!(why.message("en").contains(key), "{}", why.message("en"));
            }
        }
    }

    #[test]
    fn every_preset_is_valid() {
        for (name, machine) in presets() {
            assert_eq!(validate(&machine), Vec::new(), "{name}");
        }
    }

    #[test]
    fn homing_moves_z_away_from_and_stops_above_the_board() {
        // The surface is at −30 mm and the safe height 2 mm above it: 28 mm below the top are free.
        let into = Some(("machine.homes_into_board", "z.home_end"));
        let rests = Some(("machine.rests_in_board", "z.home_offset"));
        let rows: &[Row] = &[
            (&[word("z.home_end", "min")], into),
            (&[word("z.home_end", "max")], None),
            (&[number("z.home_offset", 28.0)], None),
            (&[number("z.home_offset", 28.001)], rests),
            (&[number("z.home_offset", 44.0)], rests),
            (&[number("z.home_offset", 20.0), number("stroke.surface", -22.5)], None),
            (&[number("z.home_offset", 20.0), number("stroke.surface", -21.5)], rests),
            (&[number("z.home_offset", 20.0), number("stroke.safe_height", 11.0)], rests),
            (&[number("z.max", -10.0), number("z.home_offset", 19.0)], rests),
            (
                &[number("stroke.surface", -1.0)],
                Some(("machine.safe_height_out_of_reach", "stroke.safe_height")),
            ),
        ];
        try_rows(&virtual_drill(), rows);
    }

    #[test]
    fn spindle_speed_zero_is_refused() {
        let rows: &[Row] = &[
            (&[number("spindle.speed", 0.0)], Some(("machine.spindle_stands", "spindle.speed"))),
            (&[number("spindle.speed", 1.0)], None),
        ];
        try_rows(&virtual_drill(), rows);
    }

    #[test]
    fn at_least_one_spindle_must_be_enabled() {
        let list = |on: &[f64]| [("spindle.enabled".to_owned(), Value::Numbers(on.to_vec()))];
        let none = Some(("machine.no_spindle_enabled", "spindle.enabled"));
        let rows: &[(&[f64], _)] =
            &[(&[0.0, 1.0, 0.0, 0.0, 0.0, 0.0], None), (&[0.0; 6], none), (&[], None), (&[0.0; 5], None)];
        for (on, refusal) in rows {
            try_rows(&super::super::six_spindles(), &[(&list(on), *refusal)]);
        }
        try_rows(&virtual_drill(), &[(&list(&[0.0]), none)]);
    }

    #[test]
    fn index_pulse_homing_is_refused_if_impossible() {
        let on = |axis: &str| word(&format!("{axis}.index"), "yes");
        let x = |changes: &[(String, Value)]| [&[on("x")][..], changes].concat();
        let rows: [(Vec<_>, Option<(&str, &str)>); 7] = [
            (vec![on("x"), on("y"), on("z")], None),
            (x(&[number("x.index_within", 4.1)]), Some(("machine.index_offset", "x.home_offset"))),
            (x(&[number("x.index_within", 8.0), number("x.home_offset", 2.0)]), None),
            (
                vec![on("z"), number("z.index_within", 28.1), number("z.home_offset", 8.0)],
                Some(("machine.index_too_far", "z.index_within")),
            ),
            (x(&[word("machine.output", "adapter")]), Some(("machine.index_beside_adapter", "x.index"))),
            (x(&[word("machine.output", "card")]), Some(("machine.card_sensor_unwired", "card.sensors"))),
            (vec![on("z"), number("machine.spindles", 2.0)], Some(("machine.index_of_several", "z.index"))),
        ];
        for (changes, refusal) in rows {
            try_rows(&virtual_drill(), &[(&changes, refusal)]);
        }
    }

    #[test]
    fn backlash_is_only_for_x_and_y() {
        let rows: &[Row] = &[
            (&[number("x.backlash", 0.2), number("y.backlash", 0.2)], None),
            (&[number("z.backlash", 0.0)], None),
            (&[number("z.backlash", 0.001)], Some(("machine.z_with_play", "z.backlash"))),
        ];
        try_rows(&virtual_drill(), rows);
    }

    #[test]
    fn home_search_spans_the_whole_axis() {
        let short = |key| Some(("machine.search_too_short", key));
        let rows: &[Row] = &[
            (&[number("x.home_search", 1.0)], short("x.home_search")),
            (&[number("y.home_search", 200.0)], short("y.home_search")),
            (&[number("y.home_search", 200.1)], None),
            (&[number("z.home_search", 20.0)], short("z.home_search")),
            (&[number("x.max", 330.0)], short("x.home_search")),
            (&[number("x.max", 330.0), number("x.home_search", 331.0)], None),
        ];
        try_rows(&virtual_drill(), rows);
    }
}
