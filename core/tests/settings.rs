//! Tests that the settings marked as irrelevant to the stream don't change it, one at a time. Thus no
//! setting is missing from the fingerprint that page and bridge compare.

use crate::programs::{machines, random_program};
use annulus_core::chance::Chance;
use annulus_core::machine::{self, Machine, Setting, Value, ValueKind};
use annulus_core::{motion, steps};

fn others(setting: &Setting, now: &Value) -> Vec<Value> {
    let number = |value: f64| Value::Number(value);
    match (setting.kind, now) {
        (ValueKind::Text(_), _) => vec![Value::Text("another".into())],
        (ValueKind::Choice(words), _) => words.iter().map(|word| Value::Text((*word).into())).collect(),
        (ValueKind::Number(low, high), Value::Number(own)) => {
            vec![number(own + 1.0), number(own - 1.0), number(0.5 * (own + low)), number(0.5 * (own + high))]
        }
        (ValueKind::Whole(low, high), Value::Number(own)) => {
            vec![number((own + 1.0).min(high)), number((own - 1.0).max(low)), number(low), number(high)]
        }
        (ValueKind::Numbers(low, high) | ValueKind::Wholes(low, high), Value::Numbers(own)) => {
            let moved = |by: f64| own.iter().map(|own| (own + by).clamp(low, high)).collect();
            let mut turned = own.clone();
            turned.rotate_left(own.len().min(1));
            vec![Value::Numbers(moved(1.0)), Value::Numbers(moved(-1.0)), Value::Numbers(turned)]
        }
        (ValueKind::Tools, _) => {
            let lines = ["T1 drill 0.8 down 3 rpm 9000 life 9 place 2", "T2 mill 1.5"];
            vec![Value::Texts(lines.map(str::to_owned).to_vec())]
        }
        _ => Vec::new(),
    }
}

/// Changes of a setting, each with the changes that it requires: a switched output is a bit and a name, a
/// converter needs a port.
fn changes(setting: &Setting, machine: &Machine) -> Vec<Vec<(String, Value)>> {
    if let Some((section, "outputs" | "output_names")) = setting.key.split_once('.') {
        let names = (format!("{section}.output_names"), Value::Text("pump light".to_owned()));
        return vec![vec![names, (format!("{section}.outputs"), Value::Numbers(vec![25.0, 26.0]))]];
    }
    if setting.key == "converter.profile" {
        let port = ("converter.port".to_owned(), Value::Text("/dev/ttyUSB0".to_owned()));
        return vec![vec![port, (setting.key.to_owned(), Value::Text("delta".to_owned()))]];
    }
    if setting.key == "spindle.enabled" {
        return vec![vec![(setting.key.to_owned(), Value::Numbers(vec![1.0, 0.0]))]];
    }
    if setting.key == "spindle.longer" {
        return vec![vec![(setting.key.to_owned(), Value::Numbers(vec![0.0, 0.3]))]];
    }
    if setting.key.ends_with(".outputs_low") {
        return vec![vec![(setting.key.to_owned(), Value::Numbers(vec![2.0]))]];
    }
    let now = setting.value(machine);
    let others = others(setting, &now).into_iter().filter(|value| *value != now);
    others.map(|value| vec![(setting.key.to_owned(), value)]).collect()
}

fn digest(machine: &Machine, program: &annulus_core::job::Program) -> Option<String> {
    let plan = motion::timeline(program, machine).ok()?;
    Some(steps::digest(&steps::stream(&plan, machine).ok()?))
}

#[test]
fn settings_marked_as_neutral_do_not_change_the_stream() {
    let mut tried = std::collections::BTreeSet::new();
    for machine in machines() {
        let program = random_program(&mut Chance::new(7), &machine, 3);
        let (print, stream) = (machine.fingerprint(), digest(&machine, &program));
        assert!(stream.is_some(), "{}", machine.name);
        for setting in machine::settings().filter(|setting| !setting.shapes_stream()) {
            for change in changes(setting, &machine) {
                let Ok(changed) = machine::apply(&machine, &change) else { continue };
                let row = format!("{}: {change:?}", machine.name);
                assert_eq!(changed.fingerprint(), print, "{row}");
                assert_eq!(digest(&changed, &program), stream, "{row}");
                tried.insert(setting.key);
            }
        }
    }
    let all: Vec<_> =
        machine::settings().filter(|setting| !setting.shapes_stream()).map(|row| row.key).collect();
    let never: Vec<_> = all.iter().filter(|key| !tried.contains(*key)).collect();
    // Every machine refuses a Z that homes at the board. Phases on the adapter need additional sensors and
    // rates; `machine::adapter` tests them.
    assert_eq!(never, [&"adapter.outputs", &"z.home_end"]);
    assert!(tried.len() > 20, "{tried:?}");
}
