//! Compares the known data of a mill with its controller's settings: steps, speeds, accelerations, travel,
//! firmware.
//!
//! ```text
//! MillProfile ─ `$$` ─▶ a warning for each difference, and its effect on a board
//! ```
//!
//! Unknown values are not compared. The check before a job reports settings that are wrong on every mill.
//! Lengths in mm, speeds in mm/min, accelerations in mm/s².

use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::settings::{self, Values};
use annulus_core::machine::MillProfile;
use annulus_core::warning;

/// Steps per mm within this factor of the expected value: the user trimmed them by measuring.
const SAME_SCALE_FACTOR: f64 = 1.02;
/// Speeds and accelerations up to this factor above the expected value cause no warning.
const SAME_RATE_FACTOR: f64 = 1.1;
/// Travel that differs by less: the position of a switch.
const SAME_TRAVEL_MM: f64 = 10.0;
const AXES: [char; 3] = ['X', 'Y', 'Z'];

/// Differences between the `mill` and a controller of this flavour with these settings; those that spoil a
/// board come first.
pub fn unlike_mill(mill: &MillProfile, flavour: &str, values: &Values) -> Vec<Diagnostic> {
    let more = |found: f64, expected: f64| found > expected * SAME_RATE_FACTOR;
    let other_scale =
        |found: f64, expected: f64| found.max(expected) > found.min(expected) * SAME_SCALE_FACTOR;
    let other_travel = |found: f64, expected: f64| (found - expected).abs() > SAME_TRAVEL_MM;
    let axes = |first, expected, differs: &dyn Fn(f64, f64) -> bool| {
        by_axis(values, first, expected, differs).into_iter()
    };
    let scale = axes(100, mill.steps_per_mm, &other_scale).map(|row| (warning!("grbl.other_scale", ..), row));
    let rate = axes(110, mill.mm_per_min, &more).map(|row| (warning!("grbl.faster_than_machine", ..), row));
    let ramp = axes(120, mill.mm_per_s2, &more).map(|row| (warning!("grbl.steeper_than_machine", ..), row));
    let travel =
        axes(130, Some(mill.travel_mm), &other_travel).map(|row| (warning!("grbl.other_travel", ..), row));
    let all = scale.chain(rate).chain(ramp).chain(travel).map(|(why, (axis, number, found, expected))| {
        let why = why.with("axis", axis).with("number", number).with("found", found);
        why.with("expected", expected).with("machine", mill.title)
    });
    let other = mill.flavour.filter(|expected| *expected != flavour);
    let firmware = other.map(|expected| {
        let why = warning!("grbl.other_firmware", found = flavour, ..);
        why.with("expected", expected).with("machine", mill.title)
    });
    all.chain(spindle(mill, values)).chain(firmware).collect()
}

/// Axis, number of the setting, found value, expected value.
type Row = (char, u16, f64, f64);

fn by_axis(
    values: &Values,
    first: u16,
    expected: Option<[f64; 3]>,
    differs: &dyn Fn(f64, f64) -> bool,
) -> Vec<Row> {
    let (Some(found), Some(expected)) = (settings::axes(values, first), expected) else {
        return Vec::new();
    };
    let axes = (0..3_u16).zip(found).zip(expected);
    let rows = axes.map(|((axis, found), expected)| (AXES[usize::from(axis)], first + axis, found, expected));
    rows.filter(|(_, _, found, expected)| differs(*found, *expected)).collect()
}

/// Every S word scales with `$30`: another top speed gives a wrong speed throughout.
fn spindle(mill: &MillProfile, values: &Values) -> Option<Diagnostic> {
    let (found, expected) = (*values.get(&30)?, mill.rpm?);
    let same = found.max(expected) <= found.min(expected) * SAME_RATE_FACTOR;
    let why = warning!("grbl.other_rpm", found = found, expected = expected, ..);
    (!same).then(|| why.with("machine", mill.title))
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::machine::mill;

    /// A 3018-PRO with its factory settings, apart from `changes`.
    fn codes(changes: &[(u16, f64)], flavour: &str) -> Vec<String> {
        let mut values = Values::new();
        for axis in 0..3 {
            let travel = [300.0, 180.0, 45.0][usize::from(axis)];
            let all = [(100, 800.0), (110, 800.0), (120, 30.0), (130, travel)];
            values.extend(all.map(|(first, value)| (first + axis, value)));
        }
        values.insert(30, 10_000.0);
        values.extend(changes.iter().copied());
        let found = unlike_mill(mill("genmitsu-3018-pro").unwrap(), flavour, &values).into_iter();
        found.map(|why| format!("{} {}", why.code, why.argument(&["number"]).unwrap_or_default())).collect()
    }

    #[test]
    fn controller_set_up_for_another_machine_is_reported() {
        for (changes, expected) in [
            (vec![], vec![]),
            (vec![(100, 808.0)], vec![]),
            (vec![(101, 400.0)], vec!["grbl.other_scale 101"]),
            (vec![(112, 2_000.0)], vec!["grbl.faster_than_machine 112"]),
            (vec![(112, 300.0)], vec![]),
            (vec![(120, 500.0), (121, 10.0)], vec!["grbl.steeper_than_machine 120"]),
            (vec![(131, 200.0)], vec!["grbl.other_travel 131"]),
            (vec![(30, 1_000.0)], vec!["grbl.other_rpm "]),
            // The check before each job reports `$1`.
            (vec![(1, 25.0)], vec![]),
        ] {
            assert_eq!(codes(&changes, "GRBL"), expected, "{changes:?}");
        }
        assert_eq!(codes(&[], "FluidNC"), ["grbl.other_firmware "]);
        // Unknown data of a mill are not compared.
        let wide: Values = (0..3).flat_map(|axis| [(100 + axis, 1.0), (110 + axis, 9e9)]).collect();
        assert_eq!(unlike_mill(mill("genmitsu-4040-pro").unwrap(), "GRBL", &wide), []);
    }
}
