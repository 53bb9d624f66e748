//! Tests that every setting of a machine has an effect. Several values on several machines must change the
//! plan, the steps, the check, homing or the outputs, unless a reason is given.

use crate::parameters::{LOOKS, machines};
use annulus_core::machine::{self, Machine, Setting, Value, ValueKind, settings};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Settings without an effect on any aspect, and the reason.
const UNSEEN: &[(&str, &str)] = &[
    ("machine.name", "a word for people"),
    ("machine.description", "a word for people"),
    ("machine.card_address", "where the card is: the bridge opens it"),
    ("x.phases", "what the windings get: `phases`"),
    ("y.phases", "what the windings get: `phases`"),
    ("z.min", "a stroke below is refused with the machine: `validate`"),
    ("z.home_end", "Z homes upwards: the other end is refused"),
    ("z.backlash", "Z has none: every other value is refused"),
    ("z.phases", "what the windings get: `phases`"),
    ("drive.pulse_width", "how long a pulse lasts: the outputs of the bridge"),
    ("stroke.lift_at_pause", "whoever runs the job lifts: `pause` of the drill"),
    ("change.setter", "whoever runs the job measures tools: `tool_length` of the drill"),
    ("change.setter_x", "as `change.setter`"),
    ("change.setter_y", "as `change.setter`"),
    ("change.setter_depth", "as `change.setter`"),
    ("park.after_job", "whoever runs the job parks: `park` of the drill"),
];

/// Sections that assign wires, tested by `outputs` of the bridge and by `link`.
const WIRES: [&str; 4] = ["card.", "parallel.", "adapter.", "converter."];

fn others(setting: &Setting, now: &Value) -> Vec<Value> {
    let scaled = |number: f64| {
        let factors = [0.05, 0.3, 0.5, 0.9, 1.1, 1.5, 2.0].map(|factor| number * factor);
        let sums = [-30.0, -5.0, -1.0, -0.2, 0.1, 0.2, 1.0, 5.0, 30.0].map(|more| number + more);
        factors.into_iter().chain(sums)
    };
    match (setting.kind, now) {
        (ValueKind::Number(low, high), Value::Number(number)) => {
            scaled(*number).chain([low, high]).map(Value::Number).collect()
        }
        (ValueKind::Whole(low, high), Value::Number(number)) => {
            scaled(*number).map(f64::round).chain([low, high]).map(Value::Number).collect()
        }
        (ValueKind::Choice(words), _) => words.iter().map(|word| Value::Text((*word).to_owned())).collect(),
        (ValueKind::Numbers(..) | ValueKind::Wholes(..), Value::Numbers(numbers)) => {
            let longer = numbers.iter().copied().chain([1.0]).collect();
            let each = |by: f64| numbers.iter().map(|number| number + by).collect::<Vec<_>>();
            let lists = [each(1.0), each(-1.0), each(0.3), longer, vec![0.0, 1.0], vec![0.0, 0.3]];
            lists.into_iter().map(Value::Numbers).collect()
        }
        (ValueKind::Tools, _) => {
            vec![Value::Texts(vec!["T1 drill 0.8 down 3 rpm 9000".to_owned(), "T2 drill 1".to_owned()])]
        }
        (ValueKind::Text(_), _) => vec![Value::Text("other".to_owned())],
        _ => Vec::new(),
    }
}

/// All aspects; `None` if an aspect can't be computed for this machine.
fn sight(machine: &Machine) -> Vec<Option<String>> {
    LOOKS.iter().map(|look| catch_unwind(AssertUnwindSafe(|| look(machine))).ok()).collect()
}

/// Returns `true` if some value of `setting` has an effect on one of the machines in `all`.
fn acts(setting: &Setting, all: &[(Machine, Vec<Option<String>>)]) -> bool {
    all.iter().any(|(machine, before)| {
        let now = setting.value(machine);
        let changed = others(setting, &now).into_iter().filter(|value| *value != now).filter_map(|value| {
            let changes = [(setting.key.to_owned(), value)];
            machine::apply(machine, &changes).ok()
        });
        changed.into_iter().any(|changed| sight(&changed) != *before)
    })
}

#[test]
fn every_setting_has_an_effect_or_a_reason() {
    let all: Vec<_> = machines().into_iter().map(|machine| (machine.clone(), sight(&machine))).collect();
    let swept = settings().filter(|row| !WIRES.iter().any(|section| row.key.starts_with(section)));
    let is_told = |key: &str| UNSEEN.iter().any(|(told, _)| *told == key);
    let idle: Vec<&str> =
        swept.filter(|row| !is_told(row.key) && !acts(row, &all)).map(|row| row.key).collect();
    assert_eq!(idle, Vec::<&str>::new(), "settings without an effect and without a reason");
    assert!(
        UNSEEN.iter().all(|(key, _)| machine::setting(key).is_some()),
        "reasons of settings that are gone"
    );
}
