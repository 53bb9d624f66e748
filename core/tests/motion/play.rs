//! Tests of axes with backlash: from every direction of approach the table must reach the intended
//! position.

use crate::programs::{Chance, machines, random_program};
use annulus_core::job::{Command, Mark};
use annulus_core::machine::DriveKind;
use annulus_core::motion::timeline;
use annulus_core::steps;
use annulus_core::units::Length;

/// A table moved by a motor with backlash: it follows upwards at once, and downwards after the backlash.
struct Table {
    at: i64,
    play: i64,
}

impl Table {
    fn follow(&mut self, motor: i64) {
        self.at = self.at.clamp(motor, motor + self.play);
    }
}

#[test]
fn backlash_does_not_shift_holes_from_any_direction() {
    let mut holes = 0;
    let planned = || machines().into_iter().filter(|machine| machine.drive == DriveKind::Planned);
    for seed in 0..400 {
        let mut chance = Chance::new(seed);
        for mut machine in planned() {
            for axis in [&mut machine.x, &mut machine.y] {
                axis.backlash = Length::from_um((chance.bits() % 400) as i64);
            }
            let program = random_program(&mut chance, &machine, 8);
            let stream = steps::stream(&timeline(&program, &machine).unwrap(), &machine).unwrap();
            let mut motors = stream.start;
            let play = |axis: usize| machine.axis(axis).scale.steps(machine.axis(axis).backlash);
            let mut tables = [0, 1].map(|axis| Table { at: motors[axis], play: play(axis) });
            let mut drilled = vec![None; program.legs.len()];
            for segment in &stream.segments {
                for pulse in steps::replay(segment) {
                    for (axis, motor) in motors.iter_mut().enumerate() {
                        let way = if pulse.forward >> axis & 1 == 1 { 1 } else { -1 };
                        *motor += i64::from(pulse.axes >> axis & 1) * way;
                    }
                    tables.iter_mut().zip(motors).for_each(|(table, motor)| table.follow(motor));
                    if motors[2] < 0 {
                        drilled[segment.leg as usize] = Some([tables[0].at, tables[1].at]);
                    }
                }
            }
            for (leg, found) in program.legs.iter().zip(drilled) {
                let (Mark::Hole(hole), Command::Rapid { to }) = (leg.mark, leg.commands[0]) else { continue };
                let wanted = [machine.x.scale.steps(to.x), machine.y.scale.steps(to.y)];
                assert_eq!(found, Some(wanted), "seed {seed}, hole {hole} on {}", machine.name);
                holes += 1;
            }
        }
    }
    assert_eq!(holes, 400 * planned().count() * 8);
}
