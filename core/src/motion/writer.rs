//! Converts commands to moves.
//!
//! Positions are first rounded to whole steps, from absolute coordinates. Distances are differences of those,
//! so errors don't add up. Positions of an axis with backlash are motor positions: while counting down, the
//! motor is lower by the backlash.
//!
//! ```text
//! target     0 ──▶ 10 ──▶ 4              backlash 1: after the reversal the motor removes it first,
//! motor      0 ──▶ 10 ─▶ 9 ──▶ 3         then both move
//! ```

use super::drill_cycles::{Alike, DrillCycles, Hole, Low, alike, plain_hole};
use super::limits::{REST_TICKS, lines, mm_per_step, play_steps};
use super::milling;
use super::path::PlannedPath;
use super::timeline::{AxisMove, Move, Timeline};
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::geometry::Point;
use crate::job::{Command, Gate, Leg, Mark, Program, Stage, Switching};
use crate::machine::{AXES, Machine, Steps};
use crate::units::{Length, TICK_HZ};

/// Longest move in s. In longer ones, pulses could be further apart than a run can encode (429 s).
const LONGEST_MOVE_S: f64 = 400.0;

pub fn timeline(program: &Program, machine: &Machine) -> Result<Timeline, Diagnostic> {
    timeline_from(program, machine, 0)
}

/// Like [`timeline`]; `progress` gets the number of converted legs and their total.
pub fn timeline_telling(
    program: &Program,
    machine: &Machine,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Timeline, Diagnostic> {
    timed(program, machine, 0, progress)
}

/// Converts the program from leg `first_leg` on, as after a resume. Starts at rest where that leg starts,
/// with all spindles up.
pub fn timeline_from(program: &Program, machine: &Machine, first_leg: usize) -> Result<Timeline, Diagnostic> {
    timed(program, machine, first_leg, &mut |_, _| {})
}

fn timed(
    program: &Program,
    machine: &Machine,
    first_leg: usize,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Timeline, Diagnostic> {
    let mut writer = writer_at(program, machine, first_leg);
    for (index, leg) in program.legs.iter().enumerate().skip(first_leg) {
        progress(index as u64, program.legs.len() as u64);
        writer
            .leg(index, leg, program.legs.get(index + 1))
            .map_err(|diagnostic| diagnostic.with("leg", index))?;
    }
    Ok(writer.done())
}

/// Converts the program leg by leg: `take` gets the moves of each, which are dropped afterwards. Returns the
/// position of all axes before the first.
pub fn each_leg(
    program: &Program,
    machine: &Machine,
    mut take: impl FnMut(&[Move]) -> Result<(), Diagnostic>,
) -> Result<Steps, Diagnostic> {
    let mut writer = writer_at(program, machine, 0);
    for (index, leg) in program.legs.iter().enumerate() {
        writer
            .leg(index, leg, program.legs.get(index + 1))
            .map_err(|diagnostic| diagnostic.with("leg", index))?;
        take(&writer.timeline.moves)?;
        writer.timeline.moves.clear();
    }
    Ok(writer.timeline.start)
}

/// Converts only leg `index`, from rest at its start to rest, with all spindles up at both ends. `down`: X
/// and Y arrived counting down, so their motors are lower by the backlash.
pub fn leg_alone(
    program: &Program,
    machine: &Machine,
    index: usize,
    down: [bool; 2],
) -> Result<Timeline, Diagnostic> {
    let mut writer = writer_at(program, machine, index);
    for axis in (0..2).filter(|axis| down[*axis]) {
        writer.turned[axis] = true;
        writer.at[axis] -= play_steps(machine, axis);
    }
    writer.timeline.start = writer.at;
    if let Some(leg) = program.legs.get(index) {
        writer.leg(index, leg, None).map_err(|diagnostic| diagnostic.with("leg", index))?;
    }
    Ok(writer.done())
}

fn writer_at<'a>(program: &Program, machine: &'a Machine, index: usize) -> Writer<'a> {
    let mut start = Steps::default();
    let at = program.start_of_leg(index);
    start[0] = machine.x.scale.steps(at.x);
    start[1] = machine.y.scale.steps(at.y);
    for axis in machine.spindle_axes() {
        start[axis] = machine.z.scale.steps(program.safe_height);
    }
    let mut writer = Writer::new(machine, start);
    writer.place = at;
    writer.spindles = spindle_axes(program.spindles, machine);
    writer.groups = alike(machine, &writer.spindles);
    writer.lifts_mm_per_s = program.bits.iter().map(|bit| bit.handling.up_mm_per_s()).collect();
    let before = program.legs.iter().take(index).rev().flat_map(|leg| leg.commands.iter().rev());
    let mut asked = before.filter_map(|command| match command {
        Command::AwaitBit { bit } => Some(*bit),
        _ => None,
    });
    writer.puts_in(asked.next().unwrap_or(0));
    writer.feed_height = machine.process.feed_height.min(program.safe_height);
    writer
}

/// The axes of a set of spindles (bit 0 is Z1).
fn spindle_axes(set: u8, machine: &Machine) -> Vec<usize> {
    machine.spindle_axes().filter(|axis| set >> (axis - 2) & 1 == 1).collect()
}

pub(super) struct Writer<'a> {
    pub(super) machine: &'a Machine,
    timeline: Timeline,
    at: Steps,
    now: u64,
    leg: u32,
    command: u32,
    mark: Mark,
    feed_height: Length,
    pub(super) spindles: Vec<usize>,
    groups: Vec<Alike>,
    hole_bottom: Option<Length>,
    settled: bool,
    /// Last XY target; `at` is its nearest step.
    place: Point,
    /// Lowest height of the tip at this XY position, if it was in the board.
    bottom: Option<Length>,
    strokes: DrillCycles,
    /// Set at the bottom of a hole, between two holes of a chain.
    low: Option<Low>,
    /// For every axis, whether its backlash is removed towards the low end.
    turned: [bool; AXES],
    /// Highest retract speed of each bit of the program, mm/s; and of the current bit.
    lifts_mm_per_s: Vec<f64>,
    lift_mm_per_s: f64,
    /// The presser foot holds the board in this leg.
    presses: bool,
    foot_down: bool,
}

impl<'a> Writer<'a> {
    pub(super) fn new(machine: &'a Machine, start: Steps) -> Self {
        Self {
            machine,
            timeline: Timeline { start, moves: Vec::new(), mm_per_step: mm_per_step(machine) },
            at: start,
            now: 0,
            leg: 0,
            command: 0,
            mark: Mark::Prepare,
            feed_height: machine.process.feed_height,
            spindles: machine.spindle_axes().collect(),
            groups: Vec::new(),
            hole_bottom: None,
            settled: true,
            place: Point::default(),
            bottom: None,
            strokes: DrillCycles::default(),
            low: None,
            turned: [false; AXES],
            lifts_mm_per_s: Vec::new(),
            lift_mm_per_s: f64::INFINITY,
            presses: false,
            foot_down: false,
        }
    }

    /// Records that this bit is in the spindle.
    fn puts_in(&mut self, bit: u32) {
        self.lift_mm_per_s = self.lifts_mm_per_s.get(bit as usize).copied().unwrap_or(f64::INFINITY);
    }

    pub(super) fn done(self) -> Timeline {
        self.timeline
    }

    pub(super) fn at(&self) -> Steps {
        self.at
    }

    fn leg(&mut self, index: usize, leg: &Leg, next: Option<&Leg>) -> Result<(), Diagnostic> {
        self.leg = u32::try_from(index).map_err(|_| error!("motion.too_many_legs"))?;
        (self.mark, self.command, self.hole_bottom) = (leg.mark, 0, leg.bottom());
        let mills = |command: &Command| matches!(command, Command::Mill { .. } | Command::MillArc { .. });
        let is_hole = matches!(leg.mark, Mark::Hole(_)) && !leg.commands.iter().any(mills);
        self.presses = self.machine.foot.on && is_hole;
        match plain_hole(self.machine, leg) {
            Some(hole) if self.low.is_some() || self.with_z(hole.top) == self.at => {
                self.next_hole(hole, next, leg.commands.len())
            }
            _ => {
                self.commands(&leg.commands)?;
                self.foot(false);
                Ok(())
            }
        }
    }

    /// Moves the presser foot and waits for it. Nothing without a foot.
    pub(super) fn foot(&mut self, down: bool) {
        if self.foot_down != down && (self.presses || !down) {
            self.rest(Stage::Dwell, self.machine.foot.ticks(), Switching::Foot { down });
            self.foot_down = down;
        }
    }

    /// One hole of a chain, from the bottom of the previous hole or from the top; up again if the chain ends.
    fn next_hole(&mut self, hole: Hole, next: Option<&Leg>, commands: usize) -> Result<(), Diagnostic> {
        let mut to = self.at;
        to[0] = self.machine.x.scale.steps(hole.to.x);
        to[1] = self.machine.y.scale.steps(hole.to.y);
        let plane = self.play(&to);
        let stands = (self.at, plane, self.turned);
        let (to_next, low) = self.strokes.next_hole(
            self.machine,
            &self.groups,
            stands,
            hole.lifted(self.lift_mm_per_s),
            self.low.take(),
        )?;
        let duration_s = to_next.duration_ticks as f64 / TICK_HZ as f64;
        refuse_slow(self.longest_mm(&to_next.parts), duration_s)?;
        self.push(Move {
            parts: to_next.parts,
            to: to_next.to,
            duration_ticks: to_next.duration_ticks,
            ..self.blank(Stage::NextHole)
        });
        self.settled = true;
        self.place = hole.to;
        // If the next hole continues the chain, its move includes the lift.
        let goes_on =
            next.and_then(|next| plain_hole(self.machine, next)).is_some_and(|next| next.top == hole.top);
        if goes_on {
            self.low = Some(low);
            return Ok(());
        }
        self.command = index(commands.saturating_sub(1));
        self.line(Stage::Retract, self.with_z(hole.top), self.lift_mm_per_s, None)
    }

    /// Converts commands in order; consecutive mill commands form one group.
    fn commands(&mut self, commands: &[Command]) -> Result<(), Diagnostic> {
        let mills = |command: &Command| matches!(command, Command::Mill { .. } | Command::MillArc { .. });
        let mut done = 0;
        for group in commands.chunk_by(|a, b| mills(a) && mills(b)) {
            self.command = index(done);
            done += group.len();
            match group {
                [first, ..] if mills(first) => self.mill(group)?,
                // All other commands are groups of one.
                others => others.iter().try_for_each(|command| self.command(*command))?,
            }
        }
        Ok(())
    }

    /// Converts mill commands to one path, or to several with backlash removal between them.
    fn mill(&mut self, commands: &[Command]) -> Result<(), Diagnostic> {
        let pieces: Vec<_> = commands.iter().filter_map(milling::piece).collect();
        let (last, height) = match commands.last() {
            Some(Command::Mill { to, height, .. } | Command::MillArc { to, height, .. }) => (*to, *height),
            _ => return Ok(()),
        };
        let feed = pieces.first().map_or(0.0, |piece| piece.feed_mm_per_s);
        let tip = self.spindles.first().map_or(0, |axis| self.at[*axis]);
        let mm = mm_per_step(self.machine);
        let start = [self.place.x.mm(), self.place.y.mm(), tip as f64 * mm[2]];
        let down = [self.turned[0], self.turned[1]];
        let paths = milling::paths(self.machine, start, pieces, down)?;
        let (first, count) = (self.command, paths.len());
        let mut whole = self.with_z(height);
        whole[0] = self.machine.x.scale.steps(last.x);
        whole[1] = self.machine.y.scale.steps(last.y);
        for (index, (down, path)) in paths.into_iter().enumerate() {
            self.command = first.saturating_add(path.pieces.first().map_or(0, |piece| piece.source));
            self.take_up(down, feed)?;
            self.along(path, (index + 1 == count).then_some(whole))?;
        }
        self.place = last;
        // After XY motion, the next plunge must settle first, and the depth here is unknown.
        (self.settled, self.bottom) = (false, None);
        Ok(())
    }

    /// Moves the motors of X and Y through the backlash before a reversal; the axes don't move.
    fn take_up(&mut self, down: [bool; 2], speed_mm_per_s: f64) -> Result<(), Diagnostic> {
        let mut to = self.at;
        for axis in (0..2).filter(|axis| down[*axis] != self.turned[*axis]) {
            let play = play_steps(self.machine, axis);
            to[axis] += if down[axis] { -play } else { play };
        }
        self.line(Stage::Mill, to, speed_mm_per_s, None)
    }

    /// Follows `path` (in axis coordinates), to the steps `axes` or else to the nearest.
    fn along(&mut self, path: PlannedPath, axes: Option<Steps>) -> Result<(), Diagnostic> {
        let mm = mm_per_step(self.machine);
        let play: [i64; 2] =
            [0, 1].map(|axis| if self.turned[axis] { play_steps(self.machine, axis) } else { 0 });
        let end = path.end();
        let path = path.shifted([-play[0] as f64 * mm[0], -play[1] as f64 * mm[1], 0.0]);
        let nearest = |axis: usize| libm::floor(end[axis.min(2)] / mm[axis] + 0.5) as i64;
        let mut to = axes.unwrap_or_else(|| {
            let moved = |axis: &usize| *axis < 2 || self.spindles.contains(axis);
            std::array::from_fn(|axis| if moved(&axis) { nearest(axis) } else { self.at[axis] })
        });
        (to[0], to[1]) = (to[0] - play[0], to[1] - play[1]);
        // The first pulse must keep the direction set-up time and the least interval to the previous move.
        let wait_s = f64::from(self.machine.direction_setup_us) * 1e-6
            + 1.0 / f64::from(self.machine.max_step_hz.max(1));
        let start_tick = libm::ceil(wait_s * TICK_HZ as f64) as u64 + REST_TICKS;
        let spindles = self.spindles.iter().fold(0, |set, axis| set | 1 << (axis - 2));
        let part = milling::part(self.machine, path, (self.at, to), spindles, start_tick);
        refuse_slow(self.longest_mm(std::slice::from_ref(&part)), part.end_s())?;
        let duration_ticks = libm::ceil(part.end_s() * TICK_HZ as f64) as u64 + REST_TICKS;
        let turned = self.turned;
        self.push(Move { to, duration_ticks, parts: vec![part], ..self.blank(Stage::Mill) });
        // The direction of the motors follows from the removed backlash, even if they moved less than a step.
        (self.turned[0], self.turned[1]) = (turned[0], turned[1]);
        Ok(())
    }

    fn command(&mut self, command: Command) -> Result<(), Diagnostic> {
        match command {
            Command::Mill { .. } | Command::MillArc { .. } => self.mill(&[command]),
            Command::Rapid { to } => self.rapid(to),
            Command::Plunge { to, feed_um_per_s, gate } => self.plunge(to, feed_um_per_s, gate),
            Command::Retract { to } => self.retract(to),
            Command::Dwell { us } => {
                self.rest(Stage::Dwell, u64::from(us) * (TICK_HZ / 1_000_000), Switching::None);
                Ok(())
            }
            Command::Spindle { rpm } => {
                self.rest(Stage::Dwell, 0, Switching::Spindle { rpm });
                Ok(())
            }
            Command::AwaitBit { bit } => {
                self.puts_in(bit);
                self.rest(Stage::AwaitBit, 0, Switching::AwaitBit { bit });
                Ok(())
            }
        }
    }

    fn rapid(&mut self, to: Point) -> Result<(), Diagnostic> {
        let mut target = self.at;
        target[0] = self.machine.x.scale.steps(to.x);
        target[1] = self.machine.y.scale.steps(to.y);
        let before = self.at;
        // The presser foot must not drag over the board.
        if to != self.place {
            self.foot(false);
        }
        self.line(Stage::Travel, self.play(&target), f64::INFINITY, None)?;
        self.settled &= before == self.at;
        if to != self.place {
            self.bottom = None;
        }
        self.place = to;
        Ok(())
    }

    fn retract(&mut self, to: Length) -> Result<(), Diagnostic> {
        let top = self.with_z(to);
        if (2..AXES).any(|axis| top[axis] < self.at[axis]) {
            return Err(error!("motion.retract_downwards", to = to.mm(), ..));
        }
        self.line(Stage::Retract, top, self.lift_mm_per_s, None)
    }

    fn plunge(&mut self, to: Length, feed_um_per_s: u32, gate: Option<Gate>) -> Result<(), Diagnostic> {
        let bottom = self.with_z(to);
        if (2..AXES).any(|axis| bottom[axis] > self.at[axis]) {
            return Err(error!("motion.plunge_upwards", to = to.mm(), ..));
        }
        if feed_um_per_s == 0 {
            return Err(error!("motion.no_feed", ..));
        }
        if !self.settled {
            let ticks = libm::ceil(self.machine.settle_ms * 1e-3 * TICK_HZ as f64) as u64;
            self.rest(Stage::Dwell, ticks, Switching::None);
            self.settled = true;
        }
        self.foot(true);
        // Above an earlier depth at this position, as in peck drilling, nothing is left to cut.
        let uncut = self.bottom.unwrap_or(Length::ZERO) + self.feed_height;
        let above = self.with_z(uncut.max(to));
        if (2..AXES).any(|axis| above[axis] < self.at[axis]) {
            self.line(Stage::Approach, above, f64::INFINITY, None)?;
        }
        let deepest = self.bottom.map_or(to, |bottom| bottom.min(to)).min(Length::ZERO);
        // With a sensor, the depth is unknown.
        self.bottom = if gate.is_some() { self.bottom } else { Some(deepest) };
        self.line(Stage::Drill, bottom, f64::from(feed_um_per_s) * 1e-3, gate)
    }

    /// `at` with the active spindles at `height`; in a hole, each spindle limited by its own bottom.
    fn with_z(&self, height: Length) -> Steps {
        let mut steps = self.at;
        for axis in &self.spindles {
            let own = |bottom| self.machine.own(*axis).height(height, bottom);
            steps[*axis] = self.machine.z.scale.steps(self.hole_bottom.map_or(height, own));
        }
        steps
    }

    /// Motor positions of X and Y with the axes at `to`: lower by the backlash after a downward move.
    fn play(&self, to: &Steps) -> Steps {
        let mut motors = *to;
        for axis in 0..2 {
            let play = play_steps(self.machine, axis);
            let wanted_now = self.at[axis] + if self.turned[axis] { play } else { 0 };
            let down = match to[axis] - wanted_now {
                0 => self.turned[axis],
                way => way < 0,
            };
            motors[axis] = to[axis] - if down { play } else { 0 };
        }
        motors
    }

    /// Appends a rest. Without time and effect, appends nothing.
    pub(super) fn rest(&mut self, stage: Stage, duration_ticks: u64, effect: Switching) {
        if duration_ticks > 0 || effect != Switching::None {
            self.push(Move { duration_ticks, effect, ..self.blank(stage) });
        }
    }

    /// Appends a straight line of the motors, at most at `speed_mm_per_s`. Without distance, appends nothing.
    pub(super) fn line(
        &mut self,
        stage: Stage,
        to: Steps,
        speed_mm_per_s: f64,
        gate: Option<Gate>,
    ) -> Result<(), Diagnostic> {
        if to == self.at {
            return Ok(());
        }
        let parts = lines(self.machine, stage, self.at, to, speed_mm_per_s, self.turned)?;
        let end_s = parts.iter().map(AxisMove::end_s).fold(0.0, f64::max);
        refuse_slow(self.longest_mm(&parts), end_s)?;
        let duration_ticks = libm::ceil(end_s * TICK_HZ as f64) as u64 + REST_TICKS;
        self.push(Move { to, duration_ticks, parts, gate, ..self.blank(stage) });
        Ok(())
    }

    fn longest_mm(&self, parts: &[AxisMove]) -> f64 {
        let mm = &self.timeline.mm_per_step;
        parts.iter().map(|part| part.length_mm(mm)).fold(0.0, f64::max)
    }

    fn blank(&self, stage: Stage) -> Move {
        Move {
            leg: self.leg,
            command: self.command,
            mark: self.mark,
            stage,
            from: self.at,
            to: self.at,
            start_tick: self.now,
            duration_ticks: 0,
            parts: Vec::new(),
            effect: Switching::None,
            gate: None,
        }
    }

    fn push(&mut self, planned: Move) {
        for axis in 0..AXES {
            if planned.to[axis] != planned.from[axis] {
                self.turned[axis] = planned.to[axis] < planned.from[axis];
            }
        }
        self.now += planned.duration_ticks;
        self.at = planned.to;
        self.timeline.moves.push(planned);
    }
}

/// Converts a count to an index; no leg has more entries.
fn index(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

fn refuse_slow(length_mm: f64, seconds: f64) -> Result<(), Diagnostic> {
    if seconds <= LONGEST_MOVE_S {
        return Ok(());
    }
    let diagnostic = error!("motion.move_too_slow", length = length_mm, ..);
    Err(diagnostic.with("seconds", seconds).with("longest", LONGEST_MOVE_S))
}
