//! The table of machine settings: key, unit, range, getter and setter. File, page, manual and tests use it.
//! The locale tables hold a description of each key under `setting.<key with dots as underscores>`.

use super::field::Setting;
use super::table::SECTIONS;
use super::tools::rack_of;
use super::value::{Value, ValueKind};
use super::{CONTACT_TOLERANCE, Machine, validate};
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::locale;
use crate::units::Length;

/// True if the setting selects which hardware is driven. For safety, only the machine file changes it, never
/// a page.
pub fn is_in_file_only(key: &str) -> bool {
    setting(key).is_some_and(Setting::is_in_file_only)
}

/// True if the setting describes the wiring of an adapter. A page that drives the adapter directly, without a
/// machine file, may change it.
pub fn is_adapter_wiring(key: &str) -> bool {
    setting(key).is_some_and(Setting::is_adapter_wiring)
}

impl ValueKind {
    /// Why `value` is invalid for `key` with this `unit`, if so.
    pub fn refusal(self, key: &str, unit: &str, value: &Value) -> Option<Diagnostic> {
        let diagnostic = |what: &str| {
            let code = format!("machine.setting_{what}");
            let measure = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            let diagnostic = Diagnostic::error(&code).with("key", key).with("value", value);
            Some(diagnostic.with("unit", unit).with("measure", measure))
        };
        let inside = |number: f64, low: f64, high: f64| number.is_finite() && (low..=high).contains(&number);
        let range = |low: f64, high: f64| diagnostic("range").map(|r| r.with("low", low).with("high", high));
        match (self, value) {
            (ValueKind::Tools, rack) => rack_of(rack).err(),
            (ValueKind::Text(longest), Value::Text(text)) => {
                if text.chars().count() > longest || text.chars().any(char::is_control) {
                    return diagnostic("text").map(|r| r.with("longest", longest));
                }
                None
            }
            (ValueKind::Number(low, high), Value::Number(number)) => {
                if inside(*number, low, high) {
                    None
                } else {
                    range(low, high)
                }
            }
            (ValueKind::Whole(low, high), Value::Number(number)) => {
                if inside(*number, low, high) && libm::trunc(*number) == *number {
                    None
                } else {
                    range(low, high)
                }
            }
            (ValueKind::Choice(words), Value::Text(text)) => {
                if words.contains(&text.as_str()) {
                    return None;
                }
                diagnostic("choice").map(|r| r.with("words", words.join(", ")))
            }
            (ValueKind::Numbers(low, high), Value::Numbers(numbers)) => {
                if numbers.len() <= 64 && numbers.iter().all(|n| inside(*n, low, high)) {
                    return None;
                }
                range(low, high)
            }
            (ValueKind::Wholes(low, high), Value::Numbers(numbers)) => {
                let whole = |n: &f64| inside(*n, low, high) && libm::trunc(*n) == *n;
                if numbers.len() <= 64 && numbers.iter().all(whole) {
                    return None;
                }
                range(low, high)
            }
            (kind, Value::Text(text))
                if !matches!(kind, ValueKind::Choice(_)) && locale::has_two_marks(text) =>
            {
                diagnostic("marks")
            }
            _ => diagnostic("kind"),
        }
    }
}

pub fn settings() -> impl Iterator<Item = &'static Setting> {
    SECTIONS.iter().flat_map(|section| section.rows)
}

/// Finds a setting by its current or old key. `rack.tools` was once `rack.bits`, a list of diameters.
pub fn setting(key: &str) -> Option<&'static Setting> {
    let key = if key == "rack.bits" { "rack.tools" } else { key };
    settings().find(|setting| setting.key == key)
}

/// All values of `machine`, in table order.
pub fn read(machine: &Machine) -> Vec<(String, Value)> {
    settings().map(|setting| (setting.key.to_owned(), setting.value(machine))).collect()
}

/// The values that a page may set: all but those that choose the hardware.
pub fn without_hardware(machine: &Machine) -> Vec<(String, Value)> {
    let rows = settings().filter(|setting| !setting.is_in_file_only());
    rows.map(|setting| (setting.key.to_owned(), setting.value(machine))).collect()
}

/// The values of `machine` that differ from those of `base` and that a page may set.
pub fn differences(machine: &Machine, base: &Machine) -> Vec<(String, Value)> {
    let rows = settings().filter(|setting| !setting.is_in_file_only());
    let rows = rows.map(|setting| (setting.key, setting.value(machine), setting.value(base)));
    rows.filter(|(_, own, of_base)| own != of_base).map(|(key, own, _)| (key.to_owned(), own)).collect()
}

/// `machine` with all `changes`, or all errors. Any error rejects every change.
pub fn apply(machine: &Machine, changes: &[(String, Value)]) -> Result<Machine, Vec<Diagnostic>> {
    let mut changed = machine.clone();
    let mut refusals = Vec::new();
    for (key, value) in changes {
        match setting(key) {
            Some(setting) => refusals.extend(setting.set(&mut changed, value).err()),
            None => refusals.push(error!("machine.setting_unknown", key = key)),
        }
    }
    if !changes.iter().any(|(key, _)| key == "stroke.contact_tolerance") {
        contact_follows(machine, &mut changed);
    }
    super::change::settle(&mut changed, machine, changes);
    // Validate even after errors, to report all problems at once.
    refusals.extend(validate(&changed));
    if refusals.is_empty() { Ok(changed) } else { Err(refusals) }
}

/// Default of the contact tolerance: enabled with a wired contact sensor, disabled without one, unless the
/// user set it.
fn contact_follows(before: &Machine, changed: &mut Machine) {
    let wires = (before.has_contact_wire(), changed.has_contact_wire());
    let tolerance = &mut changed.process.contact_tolerance;
    match wires {
        (false, true) if *tolerance == Length::ZERO => *tolerance = CONTACT_TOLERANCE,
        (true, false) if *tolerance == CONTACT_TOLERANCE => *tolerance = Length::ZERO,
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::super::field::Group;
    use super::super::table::Section;
    use super::super::{presets, six_spindles, virtual_drill};
    use super::*;

    #[test]
    fn every_setting_has_name_and_help_and_survives_a_round_trip() {
        for (_, machine) in presets() {
            assert_eq!(apply(&virtual_drill(), &read(&machine)).unwrap(), machine);
        }
        for setting in settings() {
            for key in [setting.name_key(), setting.help_key()] {
                assert!(crate::locale::lookup("en", &key).is_some(), "no text {key}");
            }
        }
    }

    #[test]
    fn names_have_one_to_four_words() {
        for language in ["en", "pl", "zh"] {
            for setting in settings() {
                let name = locale::lookup(language, &setting.name_key()).unwrap_or_default();
                let words = name.split_whitespace().count();
                assert!((1..=4).contains(&words), "{language} {}: {name}", setting.key);
            }
        }
    }

    #[test]
    fn every_group_has_settings_that_are_not_folded() {
        for group in Group::ALL {
            let of_group = |section: &Section| {
                section
                    .rows
                    .iter()
                    .filter(|row| row.group(section.group) == group && !row.is_advanced())
                    .count()
            };
            assert!(SECTIONS.iter().map(of_group).sum::<usize>() > 2, "{group:?}");
        }
    }

    #[test]
    fn only_the_sections_that_a_machine_has_are_used() {
        let used = |machine: &Machine, plans: bool| {
            let names = SECTIONS.iter().filter(|section| section.is_used(machine, plans));
            names.map(|section| section.name).collect::<Vec<_>>().join(" ")
        };
        let usual = "machine x y z drive motion overlap stroke spindle rack park change";
        assert_eq!(used(&virtual_drill(), false), usual);
        let planned = "machine x y z motion stroke spindle rack park change";
        assert_eq!(used(&virtual_drill(), true), planned);
        let text = |key: &str, word: &str| (key.to_owned(), Value::Text(word.to_owned()));
        let adapter = apply(&virtual_drill(), &[text("machine.output", "adapter")]).unwrap();
        assert_eq!(used(&adapter, false), usual.replace(" x ", " adapter x "));
        let one = setting("spindle.deeper").unwrap();
        assert!(!one.is_used(&virtual_drill(), false) && one.is_used(&six_spindles(), false));
        let lengths = setting("change.lengths").unwrap();
        assert!(lengths.is_used(&virtual_drill(), false) && !lengths.is_used(&virtual_drill(), true));
    }

    #[test]
    fn wired_contact_is_checked_by_default() {
        let text = |key: &str, word: &str| (key.to_owned(), Value::Text(word.to_owned()));
        let number = |key: &str, value: f64| (key.to_owned(), Value::Number(value));
        let sensors = |contact: f64| {
            let bits = vec![0.0, -1.0, 2.0, -1.0, 4.0, -1.0, contact];
            ("card.sensors".to_owned(), Value::Numbers(bits))
        };
        let card = || text("machine.output", "card");
        let own = |value| number("stroke.contact_tolerance", value);
        let rows = [
            (vec![card(), sensors(6.0)], 0.1),
            (vec![card(), sensors(-1.0)], 0.0),
            (vec![card(), sensors(6.0), own(0.0)], 0.0),
            (vec![own(0.3), card(), sensors(6.0)], 0.3),
            (vec![text("machine.output", "virtual"), sensors(6.0)], 0.0),
        ];
        for (changes, mm) in rows {
            let machine = apply(&virtual_drill(), &changes).unwrap();
            assert_eq!(machine.process.contact_tolerance.mm(), mm, "{changes:?}");
            // A file with the whole table describes an equal machine.
            assert_eq!(apply(&virtual_drill(), &read(&machine)).unwrap(), machine);
            // Without the wire the check is off, and nothing is refused.
            let unwired = apply(&machine, &[sensors(-1.0)]);
            let refused = mm > 0.1;
            assert_eq!(unwired.is_err(), refused, "{changes:?}");
        }
        for (name, machine) in presets() {
            let shipped = machine.process.contact_tolerance == CONTACT_TOLERANCE;
            assert_eq!(shipped, machine.has_contact_wire(), "{name}");
        }
    }

    #[test]
    fn pages_never_change_the_wiring() {
        // Every output except the virtual drill has a section that only the file may change.
        let Some(ValueKind::Choice(outputs)) = setting("machine.output").map(|row| row.kind) else {
            unreachable!()
        };
        // So has the serial port of the spindle's converter.
        let outputs = outputs.iter().filter(|output| **output != "virtual").copied();
        let wired: Vec<_> = outputs.chain(["converter"]).collect();
        for section in &wired {
            let rows = SECTIONS.iter().find(|one| one.name == *section).map_or(&[][..], |one| one.rows);
            assert!(rows.len() > 3 && rows.iter().all(Setting::is_in_file_only), "{section}");
        }
        let others = SECTIONS.iter().filter(|one| !wired.contains(&one.name)).flat_map(|one| one.rows);
        let fixed: Vec<_> = others.filter(|row| row.is_in_file_only()).map(|row| row.key).collect();
        assert_eq!(fixed, ["machine.output", "machine.card_address"]);
        assert!(settings().filter(|row| row.is_in_file_only()).all(Setting::is_built_from));
        let wiring = settings().filter(|row| row.is_adapter_wiring()).map(|row| row.key);
        assert!(wiring.count() > 3 && !is_adapter_wiring("adapter.port"));
    }

    #[test]
    fn bad_value_names_its_field_and_changes_nothing() {
        let rows: [(&str, Value, &str); 17] = [
            ("x.max_speed", Value::Number(f64::NAN), "machine.setting_range"),
            ("x.max_speed", Value::Number(0.0), "machine.setting_range"),
            ("x.max_speed", Value::Text("fast".into()), "machine.setting_kind"),
            ("x.max_speed", Value::Text("1,234.5".into()), "machine.setting_marks"),
            ("x.home_end", Value::Text("left".into()), "machine.setting_choice"),
            ("x.min", Value::Number(900.0), "machine.range_inside_out"),
            ("stroke.feed", Value::Number(400.0), "machine.feed_too_fast"),
            ("motion.order", Value::Number(0.0), "machine.setting_range"),
            ("motion.down_speed", Value::Number(-1.0), "machine.setting_range"),
            ("motion.down_speed", Value::Number(4000.0), "machine.faster_than_drive"),
            ("overlap.clear", Value::Number(2.0), "machine.clear_too_high"),
            ("stroke.end", Value::Text("sensor".into()), "machine.overlap_without_count"),
            ("stroke.feed_height", Value::Number(3.0), "machine.feed_height_too_high"),
            ("drive.pulse_width", Value::Number(11.0), "machine.pulse_too_long"),
            ("drive.period", Value::Numbers(vec![7.0, 4.0]), "automaton.lengths"),
            ("x.phases", Value::Numbers(vec![5.5]), "machine.setting_range"),
            ("x.colour", Value::Number(1.0), "machine.setting_unknown"),
        ];
        for (key, value, code) in rows {
            let refusals = apply(&virtual_drill(), &[(key.to_owned(), value)]).unwrap_err();
            assert_eq!(refusals[0].code, code);
            assert!(refusals[0].message("en").contains(key), "{}", refusals[0].message("en"));
        }
    }
}
