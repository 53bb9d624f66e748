//! Helpers: a drill described by a few numbers, its file, and holes in a row.

use annulus_core::geometry::Point;
use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program};
use annulus_core::machine::{Machine, SECTIONS, Value, apply, virtual_drill};
use annulus_core::units::Length;

/// The virtual drill with other settings; each axis with its range and scale.
pub(crate) fn machine(
    changes: Vec<(&str, Value)>,
    axes: [(&str, f64, f64); 3],
    of_axis: &[(&str, Value)],
) -> Machine {
    let mut all: Vec<(String, Value)> =
        changes.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    // Tests start within programs, so tool lengths are equal; other tests cover lengths.
    all.insert(0, ("change.lengths".to_owned(), Value::Text("equal".to_owned())));
    for (axis, min, max) in axes {
        let range = [("min", Value::Number(min)), ("max", Value::Number(max))];
        let rows = range.iter().chain(of_axis);
        all.extend(rows.map(|(name, value)| (format!("{axis}.{name}"), value.clone())));
    }
    apply(&virtual_drill(), &all).unwrap()
}

pub(crate) fn file(machine: &Machine) -> String {
    let mut text = "schema = 1\n".to_owned();
    for section in SECTIONS {
        text += &format!("[{}]\n", section.name);
        for row in section.rows {
            let value = match row.value(machine) {
                Value::Number(number) => number.to_string(),
                Value::Text(words) => format!("{words:?}"),
                Value::Numbers(numbers) => format!("{numbers:?}"),
                Value::Texts(lines) => format!("{lines:?}"),
            };
            text += &format!("{} = {value}\n", row.key.split_once('.').unwrap().1);
        }
    }
    text
}

/// Holes at `at`, drilled at this feed in µm/s; the legs before the first, and the commands of the end.
pub(crate) fn holes(
    machine: &Machine,
    before: Vec<Leg>,
    (at, feed_um_per_s): (impl Iterator<Item = Point>, u32),
    end: Vec<Command>,
) -> Program {
    let process = &machine.process;
    let to = -(process.board_thickness + process.breakthrough);
    let mut legs = before;
    legs.extend((0..).zip(at).map(|(hole, at)| Leg {
        mark: Mark::Hole(hole),
        commands: vec![
            Command::Rapid { to: at },
            Command::Plunge { to, feed_um_per_s, gate: None },
            Command::Retract { to: process.safe_height },
        ],
    }));
    legs.push(Leg { mark: Mark::Finish, commands: end });
    Program {
        name: "a row of holes".into(),
        machine: machine.fingerprint(),
        origin: Point::default(),
        bits: vec![Bit {
            diameter: Length::from_um(800),
            name: "0.8 mm".into(),
            cutter: Cutter::Drill,
            handling: Default::default(),
        }],
        spindles: 1,
        safe_height: process.safe_height,
        legs,
        accepted: vec![],
    }
}

pub(crate) fn spin_up(us: u32) -> Leg {
    Leg { mark: Mark::Prepare, commands: vec![Command::Spindle { rpm: 20_000 }, Command::Dwell { us }] }
}

pub(crate) fn back() -> Vec<Command> {
    vec![Command::Spindle { rpm: 0 }, Command::Rapid { to: Point::default() }]
}
