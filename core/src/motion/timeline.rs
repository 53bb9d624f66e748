//! A program as moves in time.
//!
//! ```text
//! leg of a hole     Travel      Dwell    Approach   Drill      Dwell   Retract
//! speed            /‾‾‾‾‾‾\             /‾‾\      _______             /‾‾‾‾\
//!              ___/        \___________/    \____/       \___________/      \__
//!                          settle           above board      bottom
//! ```
//!
//! Comes in: a program, a machine. Goes out: a [`Timeline`]: moves from rest to rest, one after the other, each a
//! straight line between whole steps. A place is first turned into the nearest whole step, from its absolute
//! coordinate; the way between two places is their difference, so nothing adds up (A6). Does not know step times.

use super::limits::{line, mm_per_step};
use super::profile::{Inverse, Profile};
use crate::geometry::Point;
use crate::job::{Command, Effect, Gate, Leg, Mark, Program, Stage};
use crate::machine::{AXES, Machine, Steps};
use crate::remark::{Remark, Weight};
use crate::units::{Length, TICK_HZ};
use serde::{Deserialize, Serialize};

/// Rapid descent ends this far over the board's surface, or at the safe height where that is lower.
const CLEARANCE: Length = Length::from_um(500);

/// A move longer than this is refused: its pulses could be further apart than a run can say (429 s).
const LONGEST_MOVE_S: f64 = 400.0;

/// A move keeps still for so long before its end, so that pulses timed to 1 µs never meet those of the next move.
const REST_TICKS: u64 = 20;

/// A straight line from rest to rest, or a time of rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Move {
    /// Index of the leg in the program.
    pub leg: u32,
    /// What the leg is for.
    pub mark: Mark,
    /// What is being done.
    pub stage: Stage,
    /// Where all axes stand before.
    pub from: Steps,
    /// Where all axes stand afterwards.
    pub to: Steps,
    /// First tick, from the start of the timeline.
    pub start_tick: u64,
    /// How long it takes, in ticks.
    pub duration_ticks: u64,
    /// Rest before the motion, so that the drives have taken a change of direction in.
    pub lead_s: f64,
    /// The motion along the straight line from `from` to `to`.
    pub profile: Profile,
    /// What is switched at its start.
    pub effect: Effect,
    /// The sensor that may end it early.
    pub gate: Option<Gate>,
}

impl Move {
    /// Share of the way done `t_s` seconds after the start of the move, 0 … 1.
    pub fn share(&self, t_s: f64) -> f64 {
        let length_mm = self.profile.length_mm;
        if length_mm <= 0.0 { 1.0 } else { self.profile.position_mm(t_s - self.lead_s) / length_mm }
    }

    /// Where the axes are `t_s` seconds after the start of the move, in steps and parts of steps.
    pub fn at(&self, t_s: f64) -> [f64; AXES] {
        let share = self.share(t_s);
        std::array::from_fn(|axis| self.from[axis] as f64 + (self.to[axis] - self.from[axis]) as f64 * share)
    }

    /// Whether any axis goes anywhere.
    pub fn moves(&self) -> bool {
        self.from != self.to
    }
}

/// Moves one after the other.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Timeline {
    /// Where all axes stand before the first move, in steps from the work zero.
    pub start: Steps,
    /// What happens, in order and without a gap.
    pub moves: Vec<Move>,
    /// Millimetres of one step, for every axis.
    pub mm_per_step: [f64; AXES],
}

impl Timeline {
    /// How long all of it takes, in ticks.
    pub fn total_ticks(&self) -> u64 {
        self.moves.last().map_or(0, |last| last.start_tick + last.duration_ticks)
    }

    /// How long all of it takes, in seconds.
    pub fn total_s(&self) -> f64 {
        self.total_ticks() as f64 / TICK_HZ as f64
    }

    /// Where all axes stand after the last move.
    pub fn end(&self) -> Steps {
        self.moves.last().map_or(self.start, |last| last.to)
    }
}

/// The whole program as a timeline.
pub fn timeline(program: &Program, machine: &Machine) -> Result<Timeline, Remark> {
    timeline_from(program, machine, 0)
}

/// The program from leg `first_leg` on, as when a job is taken up again: it starts at rest where that leg starts.
pub fn timeline_from(program: &Program, machine: &Machine, first_leg: usize) -> Result<Timeline, Remark> {
    let mut start = Steps::default();
    let at = program.start_of_leg(first_leg);
    start[0] = machine.x.scale.steps(at.x);
    start[1] = machine.y.scale.steps(at.y);
    start[2] = machine.z.scale.steps(program.safe_height);
    let mut writer = Writer::new(machine, start);
    writer.clearance = CLEARANCE.min(program.safe_height);
    for (index, leg) in program.legs.iter().enumerate().skip(first_leg) {
        let number = u32::try_from(index).map_err(|_| Remark::new(Weight::Loss, "motion.too_many_legs"))?;
        writer.leg(number, leg).map_err(|remark| remark.with("leg", index))?;
    }
    Ok(writer.done())
}

/// Writes moves one after the other.
pub(super) struct Writer<'a> {
    machine: &'a Machine,
    timeline: Timeline,
    at: Steps,
    now: u64,
    leg: u32,
    mark: Mark,
    clearance: Length,
    settled: bool,
}

impl<'a> Writer<'a> {
    /// At rest at `start`.
    pub(super) fn new(machine: &'a Machine, start: Steps) -> Self {
        Self {
            machine,
            timeline: Timeline { start, moves: Vec::new(), mm_per_step: mm_per_step(machine) },
            at: start,
            now: 0,
            leg: 0,
            mark: Mark::Prepare,
            clearance: CLEARANCE,
            settled: true,
        }
    }

    /// What was written.
    pub(super) fn done(self) -> Timeline {
        self.timeline
    }

    /// Where it stands.
    pub(super) fn at(&self) -> Steps {
        self.at
    }

    fn leg(&mut self, number: u32, leg: &Leg) -> Result<(), Remark> {
        (self.leg, self.mark) = (number, leg.mark);
        leg.commands.iter().try_for_each(|command| self.command(*command))
    }

    fn command(&mut self, command: Command) -> Result<(), Remark> {
        match command {
            Command::Rapid { to } => self.rapid(to),
            Command::Plunge { to, feed_um_per_s, gate } => self.plunge(to, feed_um_per_s, gate),
            Command::Retract { to } => self.line(Stage::Retract, self.with_z(to), f64::INFINITY, None),
            Command::Dwell { us } => {
                self.rest(Stage::Dwell, u64::from(us) * (TICK_HZ / 1_000_000), Effect::None);
                Ok(())
            }
            Command::Spindle { rpm } => {
                self.rest(Stage::Dwell, 0, Effect::Spindle(rpm));
                Ok(())
            }
            Command::AwaitBit { bit } => {
                self.rest(Stage::AwaitBit, 0, Effect::AwaitBit(bit));
                Ok(())
            }
        }
    }

    fn rapid(&mut self, to: Point) -> Result<(), Remark> {
        let mut target = self.at;
        target[0] = self.machine.x.scale.steps(to.x);
        target[1] = self.machine.y.scale.steps(to.y);
        self.settled &= target == self.at;
        self.line(Stage::Travel, target, f64::INFINITY, None)
    }

    fn plunge(&mut self, to: Length, feed_um_per_s: u32, gate: Option<Gate>) -> Result<(), Remark> {
        let bottom = self.with_z(to);
        if bottom[2] > self.at[2] {
            return Err(Remark::new(Weight::Loss, "motion.plunge_upwards").with("to", to.mm()));
        }
        if feed_um_per_s == 0 {
            return Err(Remark::new(Weight::Loss, "motion.no_feed"));
        }
        if !self.settled {
            let ticks = libm::ceil(self.machine.settle_ms * 1e-3 * TICK_HZ as f64) as u64;
            self.rest(Stage::Dwell, ticks, Effect::None);
            self.settled = true;
        }
        let above = self.with_z(self.clearance.max(to));
        if above[2] < self.at[2] {
            self.line(Stage::Approach, above, f64::INFINITY, None)?;
        }
        self.line(Stage::Drill, bottom, f64::from(feed_um_per_s) * 1e-3, gate)
    }

    fn with_z(&self, height: Length) -> Steps {
        let mut steps = self.at;
        steps[2] = self.machine.z.scale.steps(height);
        steps
    }

    /// A time of rest. Without time and effect nothing is written.
    pub(super) fn rest(&mut self, stage: Stage, duration_ticks: u64, effect: Effect) {
        if duration_ticks > 0 || effect != Effect::None {
            self.push(Move { duration_ticks, effect, ..self.blank(stage) });
        }
    }

    /// A straight line, not faster than `speed` mm/s. One that goes nowhere is not written.
    pub(super) fn line(
        &mut self,
        stage: Stage,
        to: Steps,
        speed: f64,
        gate: Option<Gate>,
    ) -> Result<(), Remark> {
        if to == self.at {
            return Ok(());
        }
        let profile = line(self.machine, &self.at, &to, speed)?;
        let duration_s = profile.duration_s();
        if duration_s > LONGEST_MOVE_S {
            let remark = Remark::new(Weight::Loss, "motion.move_too_slow").with("length", profile.length_mm);
            return Err(remark.with("seconds", duration_s).with("longest", LONGEST_MOVE_S));
        }
        let lead_s = lead_s(self.machine, &profile, &self.at, &to);
        let duration_ticks = libm::ceil((lead_s + duration_s) * TICK_HZ as f64) as u64 + REST_TICKS;
        self.push(Move { to, duration_ticks, lead_s, profile, gate, ..self.blank(stage) });
        Ok(())
    }

    /// A move that goes nowhere and takes no time.
    fn blank(&self, stage: Stage) -> Move {
        Move {
            leg: self.leg,
            mark: self.mark,
            stage,
            from: self.at,
            to: self.at,
            start_tick: self.now,
            duration_ticks: 0,
            lead_s: 0.0,
            profile: Profile::default(),
            effect: Effect::None,
            gate: None,
        }
    }

    fn push(&mut self, planned: Move) {
        self.now += planned.duration_ticks;
        self.at = planned.to;
        self.timeline.moves.push(planned);
    }
}

/// Rest needed before a move, so that no axis steps earlier than its direction has been set up, nor sooner than one
/// pulse may follow another. An axis first steps when it is half a step along.
fn lead_s(machine: &Machine, profile: &Profile, from: &Steps, to: &Steps) -> f64 {
    let most = (0..AXES).map(|axis| (to[axis] - from[axis]).unsigned_abs()).max().unwrap_or(0);
    let first_step_s = Inverse::of(profile).time_at(0.5 * profile.length_mm / most.max(1) as f64);
    let direction_s = f64::from(machine.direction_setup_us) * 1e-6;
    let pulse_s = 1.0 / f64::from(machine.max_step_hz.max(1));
    let needed_s = direction_s.max(pulse_s) + REST_TICKS as f64 / TICK_HZ as f64;
    (needed_s - first_step_s).max(0.0)
}
