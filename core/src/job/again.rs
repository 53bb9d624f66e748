//! Repeats a part of a program: only the legs that must be done again.
//!
//! ```text
//!   bit 1  spindle on, hole, hole*, hole   bit 2  hole, hole          * selected
//!   bit 1  spindle on, hole*
//! ```

use super::{Command, Leg, Mark, Program};

impl Program {
    /// Only the holes and toolpaths with legs that `again` selects, in order. Unused bits are not requested;
    /// the spindle speeds stay as they were.
    pub fn only(&self, again: impl Fn(usize) -> bool) -> Self {
        let mut legs: Vec<Leg> = Vec::new();
        // Tool changes and spindle speeds of skipped legs are emitted only before the next selected leg.
        let mut change: Option<&Leg> = None;
        let mut speed: Vec<Command> = Vec::new();
        for (index, leg) in self.legs.iter().enumerate() {
            match leg.mark {
                Mark::ToolChange(_) => {
                    change = Some(leg);
                    speed.clear();
                }
                Mark::Prepare | Mark::Finish => legs.push(leg.clone()),
                Mark::Hole(_) | Mark::Toolpath(_) if again(index) => {
                    legs.extend(change.take().cloned());
                    let mut commands = std::mem::take(&mut speed);
                    commands.extend(leg.commands.iter().copied());
                    legs.push(Leg { mark: leg.mark, commands });
                }
                Mark::Hole(_) | Mark::Toolpath(_) => {
                    if let Some(at) =
                        leg.commands.iter().position(|one| matches!(one, Command::Spindle { .. }))
                    {
                        let turns =
                            |one: &&Command| matches!(one, Command::Spindle { .. } | Command::Dwell { .. });
                        speed = leg.commands.iter().skip(at).take_while(turns).copied().collect();
                    }
                }
            }
        }
        Self { legs, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::units::Length;

    fn hole(number: u32, rpm: Option<u32>) -> Leg {
        let turns = rpm.map(|rpm| [Command::Spindle { rpm }, Command::Dwell { us: 5 }]);
        let there = [
            Command::Rapid { to: Point::from_mm(f64::from(number), 0.0) },
            Command::Plunge { to: Length::from_mm(-2.0), feed_um_per_s: 1, gate: None },
            Command::Retract { to: Length::from_mm(2.0) },
        ];
        Leg { mark: Mark::Hole(number), commands: turns.into_iter().flatten().chain(there).collect() }
    }

    fn change(bit: u32) -> Leg {
        Leg {
            mark: Mark::ToolChange(bit),
            commands: vec![Command::Spindle { rpm: 0 }, Command::AwaitBit { bit }],
        }
    }

    #[test]
    fn repeated_legs_have_their_tool_and_speed_only() {
        let ends = |mark| Leg { mark, commands: vec![Command::Spindle { rpm: 0 }] };
        let legs = vec![
            ends(Mark::Prepare),
            change(0),
            hole(0, Some(900)),
            hole(1, None),
            change(1),
            hole(2, Some(700)),
            hole(3, None),
            hole(4, Some(500)),
            ends(Mark::Finish),
        ];
        let program = Program::of_legs(legs);
        type Row<'a> = (&'a [usize], &'a [(Mark, Option<u32>)]);
        let (prepare, finish) = ((Mark::Prepare, Some(0)), (Mark::Finish, Some(0)));
        let rows: [Row<'_>; 4] = [
            (&[], &[prepare, finish]),
            (&[3], &[prepare, (Mark::ToolChange(0), Some(0)), (Mark::Hole(1), Some(900)), finish]),
            (&[6], &[prepare, (Mark::ToolChange(1), Some(0)), (Mark::Hole(3), Some(700)), finish]),
            (
                &[2, 3, 7],
                &[
                    prepare,
                    (Mark::ToolChange(0), Some(0)),
                    (Mark::Hole(0), Some(900)),
                    (Mark::Hole(1), None),
                    (Mark::ToolChange(1), Some(0)),
                    (Mark::Hole(4), Some(500)),
                    finish,
                ],
            ),
        ];
        for (again, expected) in rows {
            let part = program.only(|leg| again.contains(&leg));
            let speed = |leg: &Leg| {
                let mut speeds = leg.commands.iter().filter_map(|one| match one {
                    Command::Spindle { rpm } => Some(*rpm),
                    _ => None,
                });
                speeds.next_back()
            };
            let found: Vec<_> = part.legs.iter().map(|leg| (leg.mark, speed(leg))).collect();
            assert_eq!(found, expected, "{again:?}");
        }
        let all = program.only(|_| true);
        assert_eq!(all, program);
    }
}
