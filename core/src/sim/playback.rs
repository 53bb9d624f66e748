//! Access to a timeline at any second, by binary search.
//!
//! ```text
//! legs   |prepare|  hole 17     |  hole 4      | …
//! moves  |  |    |   |  |   |   |   |  |   |   |
//!                      ^ t      holes complete: 0
//! ```
//!
//! Positions are planned ones; the motors are at most half a step off.

use crate::job::{CommandPlace, Mark, Stage};
use crate::motion::{AxisMove, Move, Timeline};
use crate::units::TICK_HZ;

/// A timeline with an index by time.
#[derive(Clone, Debug, PartialEq)]
pub struct Playback {
    timeline: Timeline,
    legs: Vec<LegStart>,
    drilled: Vec<DrilledHole>,
    milled: Vec<Milled>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LegStart {
    pub leg: u32,
    pub mark: Mark,
    pub start_s: f64,
    /// Bit in the spindle during the leg (index into the program's bits), if any.
    pub bit: Option<u32>,
}

/// A hole and its completion time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrilledHole {
    /// Index into the board's holes.
    pub hole: u32,
    /// Time of breakthrough.
    pub done_s: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Milled {
    /// Index into the job's toolpaths.
    pub toolpath: u32,
    /// Start of its leg.
    pub from_s: f64,
    /// End of its leg.
    pub done_s: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Tip in work coordinates: X, Y, Z.
    pub position_mm: [f64; 3],
    /// Speed along the path, mm/s.
    pub speed_mm_per_s: f64,
    pub leg: u32,
    pub mark: Mark,
    pub stage: Stage,
    /// Number of complete holes: the first ones of [`Playback::drilled`].
    pub holes_done: u32,
    /// Number of complete toolpaths: the first ones of [`Playback::milled`].
    pub toolpaths_done: u32,
    /// Bit in the spindle, if any.
    pub bit: Option<u32>,
}

/// Progress at one time, counted from one in order of execution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counted {
    Nothing,
    /// The current hole, else the last complete one.
    Hole {
        number: u32,
        total: u32,
    },
    /// The current toolpath, else the last complete one.
    Toolpath {
        number: u32,
        total: u32,
    },
    All {
        holes: u32,
        toolpaths: u32,
    },
}

fn seconds(ticks: u64) -> f64 {
    ticks as f64 / TICK_HZ as f64
}

impl Playback {
    pub fn new(timeline: Timeline) -> Self {
        let (mut legs, mut drilled) = (Vec::<LegStart>::new(), Vec::<DrilledHole>::new());
        let (mut milled, mut milled_leg) = (Vec::<Milled>::new(), None);
        let (mut bit, mut drilled_leg) = (None, None);
        for planned in &timeline.moves {
            if legs.last().is_none_or(|last| last.leg != planned.leg) {
                if let Mark::ToolChange(change) = planned.mark {
                    bit = Some(change);
                }
                let (leg, mark, start_s) = (planned.leg, planned.mark, seconds(planned.start_tick));
                legs.push(LegStart { leg, mark, start_s, bit });
            }
            if let (Some(tick), Mark::Hole(hole)) = (planned.drilled_tick(), planned.mark) {
                // In peck drilling, the last plunge completes the hole.
                if drilled_leg == Some(planned.leg) {
                    drilled.pop();
                }
                drilled_leg = Some(planned.leg);
                drilled.push(DrilledHole { hole, done_s: seconds(tick) });
            }
            if let Mark::Toolpath(toolpath) = planned.mark {
                let from_s = seconds(planned.start_tick);
                let done_s = seconds(planned.start_tick + planned.duration_ticks);
                match milled.last_mut().filter(|_| milled_leg == Some(planned.leg)) {
                    Some(last) => last.done_s = done_s,
                    None => milled.push(Milled { toolpath, from_s, done_s }),
                }
                milled_leg = Some(planned.leg);
            }
        }
        Self { timeline, legs, drilled, milled }
    }

    pub fn timeline(&self) -> &Timeline {
        &self.timeline
    }

    pub fn total_s(&self) -> f64 {
        self.timeline.total_s()
    }

    /// All legs with a duration above zero, in order.
    pub fn legs(&self) -> &[LegStart] {
        &self.legs
    }

    pub fn drilled(&self) -> &[DrilledHole] {
        &self.drilled
    }

    pub fn milled(&self) -> &[Milled] {
        &self.milled
    }

    pub fn bit_of_leg(&self, leg: u32) -> Option<u32> {
        let begun = self.legs.partition_point(|start| start.leg <= leg);
        self.legs.get(begun.checked_sub(1)?)?.bit
    }

    /// Start time of leg `leg`.
    pub fn time_of_leg(&self, leg: u32) -> Option<f64> {
        let index = self.legs.binary_search_by_key(&leg, |start| start.leg).ok()?;
        self.legs.get(index).map(|start| start.start_s)
    }

    /// Completion time of hole `hole`.
    pub fn time_of_hole(&self, hole: u32) -> Option<f64> {
        self.drilled.iter().find(|drilled| drilled.hole == hole).map(|drilled| drilled.done_s)
    }

    /// Start time of toolpath `toolpath`.
    pub fn time_of_toolpath(&self, toolpath: u32) -> Option<f64> {
        self.milled.iter().find(|milled| milled.toolpath == toolpath).map(|milled| milled.from_s)
    }

    /// The command at second `t_s`; none for an empty timeline.
    pub fn command_at(&self, t_s: f64) -> Option<CommandPlace> {
        let (planned, within_s) = self.move_at(t_s)?;
        Some(CommandPlace { leg: planned.leg, command: planned.command_at(within_s) })
    }

    /// Start time of a command, in seconds. If the command takes no time, the start of the next one, or the
    /// end.
    pub fn time_of_command(&self, place: CommandPlace) -> f64 {
        let moves = &self.timeline.moves;
        let of = |planned: &Move| CommandPlace { leg: planned.leg, command: planned.command };
        let begun = moves.partition_point(|planned| of(planned) < place);
        let next = moves.get(begun);
        // Consecutive mill commands form one move, with the index of the first.
        let inside = moves.get(begun.wrapping_sub(1)).filter(|before| before.leg == place.leg);
        let within_s = inside.and_then(|before| Some((before, before.start_of_command_s(place.command)?)));
        match within_s.filter(|_| next.is_none_or(|next| of(next) != place)) {
            Some((before, within_s)) => seconds(before.start_tick) + within_s,
            None => next.map_or(self.total_s(), |next| seconds(next.start_tick)),
        }
    }

    /// The move at second `t_s`, and the time since its start.
    fn move_at(&self, t_s: f64) -> Option<(&Move, f64)> {
        let tick = (t_s.max(0.0) * TICK_HZ as f64) as u64;
        let begun = self.timeline.moves.partition_point(|planned| planned.start_tick <= tick);
        let planned = self.timeline.moves.get(begun.saturating_sub(1))?;
        Some((planned, t_s.max(0.0) - seconds(planned.start_tick)))
    }

    /// Progress at `now`.
    pub fn counted(&self, now: &Moment) -> Counted {
        let (holes, toolpaths) = (self.drilled.len() as u32, self.milled.len() as u32);
        let (drilled, milled) = (now.holes_done, now.toolpaths_done);
        if drilled + milled > 0 && (drilled, milled) == (holes, toolpaths) {
            return Counted::All { holes, toolpaths };
        }
        let last_milled = self.milled.get((milled as usize).wrapping_sub(1)).map(|last| last.toolpath);
        let last_drilled = self.drilled.get((drilled as usize).wrapping_sub(1)).map(|last| last.hole);
        // A hole that is complete but not left yet counts as current.
        let in_work = |done: u32, is_last: bool, total: u32| if is_last { done } else { total.min(done + 1) };
        match now.mark {
            Mark::Toolpath(toolpath) => {
                let number = in_work(milled, last_milled == Some(toolpath), toolpaths);
                Counted::Toolpath { number, total: toolpaths }
            }
            Mark::Hole(hole) => {
                let number = in_work(drilled, last_drilled == Some(hole), holes);
                Counted::Hole { number, total: holes }
            }
            _ if drilled > 0 => Counted::Hole { number: drilled, total: holes },
            _ if milled > 0 => Counted::Toolpath { number: milled, total: toolpaths },
            _ => Counted::Nothing,
        }
    }

    /// The state at second `t_s`, clamped to the timeline. None for an empty timeline.
    pub fn at(&self, t_s: f64) -> Option<Moment> {
        let (planned, within_s) = self.move_at(t_s)?;
        let steps = planned.at(within_s);
        let part = planned.part_at(within_s);
        let speed = part.map_or(0.0, |part| part.speed(within_s, &self.timeline.mm_per_step));
        Some(Moment {
            position_mm: std::array::from_fn(|axis| steps[axis] * self.timeline.mm_per_step[axis]),
            speed_mm_per_s: speed,
            leg: planned.leg,
            mark: planned.mark,
            stage: stage_at(planned, part, steps[2]),
            holes_done: self.drilled.partition_point(|drilled| drilled.done_s <= t_s) as u32,
            toolpaths_done: self.milled.partition_point(|milled| milled.done_s <= t_s) as u32,
            bit: self.bit_of_leg(planned.leg),
        })
    }
}

/// Current stage. Between holes, the stage of the moving part; a plunge above the board is an approach.
fn stage_at(planned: &Move, part: Option<&AxisMove>, height: f64) -> Stage {
    match (planned.stage, part.map(|part| part.stage)) {
        (Stage::NextHole, Some(Stage::Drill)) if height > 0.0 => Stage::Approach,
        (Stage::NextHole, Some(stage)) => stage,
        (Stage::NextHole, None) => Stage::Dwell,
        (stage, _) => stage,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::job::{Command, Leg, Program};
    use crate::machine::virtual_drill;
    use crate::motion::timeline;
    use crate::units::Length;

    fn two_holes_program() -> Program {
        let hole = |index, x, y| Leg {
            mark: Mark::Hole(index),
            commands: vec![
                Command::Rapid { to: Point::from_mm(x, y) },
                Command::Plunge { to: Length::from_um(-2_100), feed_um_per_s: 12_000, gate: None },
                Command::Retract { to: Length::from_um(2_000) },
            ],
        };
        let change = vec![Command::AwaitBit { bit: 0 }, Command::Dwell { us: 500_000 }];
        Program {
            name: String::new(),
            machine: String::new(),
            origin: Point::default(),
            bits: vec![],
            spindles: u8::MAX,
            safe_height: Length::from_um(2_000),
            legs: vec![
                Leg { mark: Mark::ToolChange(0), commands: change },
                hole(7, 10.0, 5.0),
                hole(3, 20.0, 0.0),
            ],
            accepted: vec![],
        }
    }

    fn two_holes() -> Playback {
        Playback::new(timeline(&two_holes_program(), &virtual_drill()).unwrap())
    }

    #[test]
    fn sampled_moments_follow_the_plan() {
        let play = two_holes();
        let start = play.at(-1.0).unwrap();
        assert_eq!((start.position_mm, start.stage, start.bit), ([0.0, 0.0, 2.0], Stage::Dwell, Some(0)));
        let end = play.at(play.total_s() + 1.0).unwrap();
        assert_eq!((end.position_mm, end.holes_done, end.mark), ([20.0, 0.0, 2.0], 2, Mark::Hole(3)));
        let through = play.time_of_hole(7).unwrap();
        let bottom = play.at(through - 1e-6).unwrap();
        assert_eq!(
            (bottom.position_mm, bottom.stage, bottom.holes_done),
            ([10.0, 5.0, -2.1], Stage::Drill, 0)
        );
        assert_eq!(play.at(through).unwrap().holes_done, 1);
        assert_eq!(play.at(play.time_of_leg(2).unwrap() + 1e-7).unwrap().leg, 2);
        assert_eq!(play.time_of_leg(3), None);
    }

    #[test]
    fn toolpaths_are_counted_when_milled() {
        let mill = |x, height| Command::Mill { to: Point::from_mm(x, 5.0), height, feed_um_per_s: 10_000 };
        let toolpath = |index, x| Leg {
            mark: Mark::Toolpath(index),
            commands: vec![
                Command::Rapid { to: Point::from_mm(x, 5.0) },
                Command::Plunge { to: Length::from_um(-200), feed_um_per_s: 5_000, gate: None },
                mill(x + 5.0, Length::from_um(-200)),
                Command::Retract { to: Length::from_um(-100) },
                mill(x + 8.0, Length::from_um(-400)),
                Command::Retract { to: Length::from_um(2_000) },
            ],
        };
        let mut program = two_holes_program();
        program.legs.extend([toolpath(4, 10.0), toolpath(2, 30.0)]);
        let play = Playback::new(timeline(&program, &virtual_drill()).unwrap());
        let [first, second] = play.milled() else { panic!("{:?}", play.milled()) };
        assert_eq!((first.toolpath, second.toolpath, play.time_of_toolpath(2)), (4, 2, Some(second.from_s)));
        assert!(first.done_s <= second.from_s && second.done_s == play.total_s());
        let mut milled = 0;
        for part in 0..=200 {
            let t = first.from_s + (first.done_s - first.from_s) * 0.999 * f64::from(part) / 200.0;
            let now = play.at(t).unwrap();
            assert_eq!((now.mark, now.toolpaths_done, now.holes_done), (Mark::Toolpath(4), 0, 2));
            milled += u32::from(now.stage == Stage::Mill && now.position_mm[2] < 0.0);
        }
        assert!(milled > 50, "{milled} moments in the board");
        assert_eq!(play.at(first.done_s).unwrap().toolpaths_done, 1);
        assert_eq!(play.at(play.total_s()).unwrap().toolpaths_done, 2);
    }

    #[test]
    fn current_feature_is_counted_and_all_at_the_end() {
        let mill = |index: u32| Leg {
            mark: Mark::Toolpath(index),
            commands: vec![
                Command::Rapid { to: Point::from_mm(f64::from(index) * 10.0, 5.0) },
                Command::Plunge { to: Length::from_um(-200), feed_um_per_s: 5_000, gate: None },
                Command::Mill {
                    to: Point::from_mm(f64::from(index) * 10.0 + 5.0, 5.0),
                    height: Length::from_um(-200),
                    feed_um_per_s: 10_000,
                },
                Command::Retract { to: Length::from_um(2_000) },
            ],
        };
        let mut program = two_holes_program();
        let holes = std::mem::take(&mut program.legs);
        program.legs = [vec![mill(0), mill(1)], holes].concat();
        let play = Playback::new(timeline(&program, &virtual_drill()).unwrap());
        let counted = |t_s: f64| play.counted(&play.at(t_s).unwrap());
        let [first, second] = play.milled() else { panic!("{:?}", play.milled()) };
        let middle = |milled: &Milled| f64::midpoint(milled.from_s, milled.done_s);
        assert_eq!(counted(middle(first)), Counted::Toolpath { number: 1, total: 2 });
        assert_eq!(counted(middle(second)), Counted::Toolpath { number: 2, total: 2 });
        let [one, other] = play.drilled() else { panic!("{:?}", play.drilled()) };
        assert_eq!(counted(one.done_s - 0.01), Counted::Hole { number: 1, total: 2 });
        let up = Moment { mark: Mark::Hole(one.hole), holes_done: 1, ..play.at(one.done_s).unwrap() };
        assert_eq!(play.counted(&up), Counted::Hole { number: 1, total: 2 }, "it goes up again");
        assert_eq!(counted(other.done_s - 0.01), Counted::Hole { number: 2, total: 2 });
        assert_eq!(counted(play.total_s()), Counted::All { holes: 2, toolpaths: 2 });
    }

    #[test]
    fn playback_has_no_jumps() {
        let play = two_holes();
        let (dt, mut before) = (1e-3, play.at(0.0).unwrap());
        for index in 1..=(play.total_s() / dt) as u32 {
            let moment = play.at(f64::from(index) * dt).unwrap();
            for (axis, limit) in [150.0, 150.0, 50.0].into_iter().enumerate() {
                let toolpath = (moment.position_mm[axis] - before.position_mm[axis]).abs();
                assert!(
                    toolpath <= limit * dt * (1.0 + 1e-9),
                    "axis {axis} jumps {toolpath} mm at {index} ms"
                );
            }
            before = moment;
        }
    }
}
