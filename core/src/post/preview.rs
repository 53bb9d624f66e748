//! Output of each block of a template for a small program: for the template editor.

use super::dialect::{Dialect, FileSplit};
use super::names::Block;
use super::writer::{Sample, write_traced};
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::job::{Bit, Command, Cutter, Leg, Mark, Program};
use crate::units::Length;

/// Every elementary action of a small program: two holes, one of them with two drill cycles, and a path of
/// lines, arcs and a helix. Skips parts without a template.
pub fn preview(dialect: &Dialect) -> Result<Vec<Sample>, Diagnostic> {
    let dialect = Dialect { files: FileSplit::Job, ..dialect.clone() };
    let mut legs = vec![Leg { mark: Mark::Prepare, commands: vec![Command::Spindle { rpm: 0 }] }];
    if dialect.drill.is_some() {
        legs.extend(drilling(
            dialect.drill.as_ref().is_some_and(|drill| drill.blocks.contains_key(&Block::Peck)),
        ));
    }
    if dialect.engrave.is_some() {
        legs.extend(milling());
    }
    let home = vec![Command::Spindle { rpm: 0 }, Command::Rapid { to: Point::default() }];
    legs.push(Leg { mark: Mark::Finish, commands: home });
    let bit = |um: i64, name: &str, cutter| Bit {
        diameter: Length::from_um(um),
        name: name.to_owned(),
        cutter,
        handling: Default::default(),
    };
    let program = Program {
        name: "sample".to_owned(),
        machine: String::new(),
        origin: Point::default(),
        bits: vec![bit(800, "0.8 mm", Cutter::Drill), bit(1_000, "1.0 mm", Cutter::Mill)],
        spindles: 1,
        safe_height: Length::from_um(2_000),
        legs,
        accepted: Vec::new(),
    };
    let mut any_radius = dialect.falling_to(Some(Length::from_um(300)));
    if let Some(engrave) = &mut any_radius.engrave {
        engrave.tool_radius = None;
    }
    write_traced(&any_radius, &program)
}

fn change(bit: u32) -> Leg {
    let commands = vec![
        Command::Spindle { rpm: 0 },
        Command::Rapid { to: Point::default() },
        Command::AwaitBit { bit },
        Command::Spindle { rpm: 30_000 },
        Command::Dwell { us: 1_500_000 },
    ];
    Leg { mark: Mark::ToolChange(bit), commands }
}

fn drilling(pecks: bool) -> Vec<Leg> {
    let stroke = |down: i64, up: i64| {
        let plunge = Command::Plunge { to: Length::from_um(down), feed_um_per_s: 12_000, gate: None };
        [plunge, Command::Dwell { us: 100_000 }, Command::Retract { to: Length::from_um(up) }]
    };
    let rapid = |x, y| Command::Rapid { to: Point::from_mm(x, y) };
    let single = std::iter::once(rapid(12.7, 8.89)).chain(stroke(-1_800, 2_000)).collect();
    let mut legs = vec![change(0), Leg { mark: Mark::Hole(0), commands: single }];
    if pecks {
        let strokes = stroke(-900, 500).into_iter().chain(stroke(-1_800, 2_000));
        let commands = std::iter::once(rapid(15.24, 8.89)).chain(strokes).collect();
        legs.push(Leg { mark: Mark::Hole(1), commands });
    }
    legs
}

fn milling() -> Vec<Leg> {
    let (height, feed_um_per_s) = (Length::from_um(-100), 10_000);
    let at = Point::from_mm;
    let line = |x, y| Command::Mill { to: at(x, y), height, feed_um_per_s };
    let arc =
        |to: Point, center: Point, ccw, height| Command::MillArc { to, height, center, ccw, feed_um_per_s };
    let commands = vec![
        Command::Rapid { to: at(10.0, 10.0) },
        Command::Plunge { to: height, feed_um_per_s: 5_000, gate: None },
        line(20.0, 10.0),
        arc(at(25.0, 15.0), at(20.0, 15.0), true, height),
        arc(at(30.0, 10.0), at(25.0, 10.0), false, height),
        arc(at(30.0, 10.0), at(35.0, 10.0), true, Length::from_um(-200)),
        arc(at(30.0, 10.0), at(35.0, 10.0), false, Length::from_um(-300)),
        Command::Retract { to: Length::from_um(2_000) },
    ];
    vec![change(1), Leg { mark: Mark::Toolpath(0), commands }]
}
