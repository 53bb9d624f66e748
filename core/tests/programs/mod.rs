//! Random programs for the tests of motion: from a seed, and equal natively and in a browser.

pub(crate) use annulus_core::chance::Chance;
use annulus_core::geometry::Point;
use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program};
use annulus_core::machine::{Machine, Overlap, presets, virtual_drill};
use annulus_core::units::Length;

/// Number of rounds of a random test: a tenth of `long` normally, all with `cargo xtask test --long`.
#[cfg(not(target_arch = "wasm32"))]
pub(crate) fn rounds(long: u64) -> u64 {
    if std::env::var_os("ANNULUS_LONG").is_some() { long } else { long / 10 }
}

/// All presets, and the virtual drill without overlap.
pub(crate) fn machines() -> Vec<Machine> {
    presets().into_iter().map(|(_, machine)| machine).chain([one_by_one()]).collect()
}

/// The virtual drill without overlap: XY waits for the spindle.
pub(crate) fn one_by_one() -> Machine {
    let base = virtual_drill();
    let overlap = Overlap { on: false, ..base.overlap };
    Machine { name: "Virtual drill, one by one".into(), overlap, ..base }
}

pub(crate) fn random_program(chance: &mut Chance, machine: &Machine, holes: u32) -> Program {
    let process = &machine.process;
    let hole = |chance: &mut Chance, index: u32| {
        let reach = chance.scale(0.05, 100.0);
        let to = Point::from_mm(chance.between(0.0, reach), chance.between(0.0, reach));
        let bottom = Length::ZERO - process.board_thickness - process.breakthrough;
        let commands = vec![
            Command::Rapid { to },
            Command::Plunge { to: bottom, feed_um_per_s: (process.feed_mm_per_s * 1e3) as u32, gate: None },
            Command::Dwell { us: (chance.bits() % 3_000) as u32 },
            Command::Retract { to: process.safe_height },
        ];
        Leg { mark: Mark::Hole(index), commands }
    };
    let prepare = vec![
        Command::Spindle { rpm: process.spindle_rpm },
        Command::Dwell { us: (process.spin_up_ms * 1e3) as u32 },
    ];
    let finish = vec![Command::Spindle { rpm: 0 }, Command::Rapid { to: Point::default() }];
    let mut legs = vec![Leg { mark: Mark::Prepare, commands: prepare }];
    legs.extend((0..holes).map(|index| hole(chance, index)));
    legs.push(Leg { mark: Mark::Finish, commands: finish });
    Program {
        name: "random".into(),
        machine: machine.fingerprint(),
        origin: Point::default(),
        bits: vec![Bit {
            diameter: Length::from_um(800),
            name: "0.8 mm".into(),
            cutter: Cutter::Drill,
            handling: Default::default(),
        }],
        spindles: u8::MAX,
        safe_height: process.safe_height,
        legs,
        accepted: vec![],
    }
}
