//! Commands as moves, one after the other.
//!
//! A place is first turned into the nearest whole step, from its absolute coordinate; the way between two places is their
//! difference, so nothing adds up (A6). Places of an axis with play are those of its motor: going down in its numbers the
//! motor stands by the play lower.
//!
//! ```text
//! wanted     0 ──▶ 10 ──▶ 4              play 1: after the turn the motor first takes the play up,
//! motor      0 ──▶ 10 ─▶ 9 ──▶ 3         then both move
//! ```
//!
//! Comes in: a program, a machine. Goes out: a [`Timeline`]. Does not know step times.

use super::drill_cycles::{Alike, DrillCycles, Hole, Low, alike, plain_hole};
use super::limits::{line, mm_per_step, steps};
use super::milling;
use super::path::PlannedPath;
use super::profile::Stroke;
use super::timeline::{AxisMove, Motion, Move, Timeline};
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::job::{Command, Gate, Leg, Mark, Program, Stage, Switching};
use crate::machine::{AXES, DriveKind, Machine, Steps};
use crate::units::{Length, TICK_HZ};

/// A move longer than this is refused: its pulses could be further apart than a run can say (429 s).
const LONGEST_MOVE_S: f64 = 400.0;

/// A move keeps still for so long before its end, so that pulses timed to 1 µs never meet those of the next move.
pub(super) const REST_TICKS: u64 = 20;

/// The whole program as a timeline.
pub fn timeline(program: &Program, machine: &Machine) -> Result<Timeline, Diagnostic> {
    timeline_from(program, machine, 0)
}

/// The same; `progress` is told how many legs are timed, and how many there are.
pub fn timeline_telling(
    program: &Program,
    machine: &Machine,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Timeline, Diagnostic> {
    timed(program, machine, 0, progress)
}

/// The program from leg `first_leg` on, as when a job is taken up again: it starts at rest where that leg starts, all
/// spindles up.
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

/// The whole program leg by leg: `take` is given the moves of each, which are forgotten afterwards. Gives where all axes stand
/// before the first.
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

/// Leg `index` by itself: from rest where it starts, all spindles up, to rest with all spindles up again. The motors of X and Y
/// that went `down` in their numbers before stand lower by the play.
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

/// A writer where leg `index` of `program` starts.
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

/// The axes of the spindles in use, from a set of them (bit 0 is Z1).
fn spindle_axes(set: u8, machine: &Machine) -> Vec<usize> {
    machine.spindle_axes().filter(|axis| set >> (axis - 2) & 1 == 1).collect()
}

/// Writes moves one after the other.
pub(super) struct Writer<'a> {
    pub(super) machine: &'a Machine,
    timeline: Timeline,
    at: Steps,
    now: u64,
    leg: u32,
    /// The command that is written, by its index in the leg.
    command: u32,
    mark: Mark,
    feed_height: Length,
    pub(super) spindles: Vec<usize>,
    /// The same, those together that stroke alike.
    groups: Vec<Alike>,
    /// The bottom of the hole that is drilled in this leg.
    hole_bottom: Option<Length>,
    settled: bool,
    /// Where X and Y were sent last, of which `at` is the nearest step.
    place: Point,
    /// The lowest that the tip was at this place, if it was in the board.
    bottom: Option<Length>,
    strokes: DrillCycles,
    /// At the bottom of a hole, on the way to the next one.
    low: Option<Low>,
    /// For every axis, whether its play is taken up towards its low end.
    turned: [bool; AXES],
    /// How fast each bit of the program is lifted at most, mm/s; and the one that is in.
    lifts_mm_per_s: Vec<f64>,
    lift_mm_per_s: f64,
    /// The presser foot holds the board in this leg.
    presses: bool,
    /// It is down.
    foot_down: bool,
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

    /// This bit is in from now on.
    fn puts_in(&mut self, bit: u32) {
        self.lift_mm_per_s = self.lifts_mm_per_s.get(bit as usize).copied().unwrap_or(f64::INFINITY);
    }

    /// What was written.
    pub(super) fn done(self) -> Timeline {
        self.timeline
    }

    /// Where it stands.
    pub(super) fn at(&self) -> Steps {
        self.at
    }

    fn leg(&mut self, index: usize, leg: &Leg, next: Option<&Leg>) -> Result<(), Diagnostic> {
        self.leg = u32::try_from(index).map_err(|_| Diagnostic::error("motion.too_many_legs"))?;
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

    /// The presser foot down onto the board, or up from it, and the time that it takes. Without one, nothing.
    pub(super) fn foot(&mut self, down: bool) {
        if self.foot_down != down && (self.presses || !down) {
            self.rest(Stage::Dwell, self.machine.foot.ticks(), Switching::Foot { down });
            self.foot_down = down;
        }
    }

    /// One hole of a chain: from the bottom of the one before, or from the top; up again where the chain ends.
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
        let goes_on =
            next.and_then(|next| plain_hole(self.machine, next)).is_some_and(|next| next.top == hole.top);
        if goes_on {
            self.low = Some(low);
            return Ok(());
        }
        self.command = index(commands.saturating_sub(1));
        self.line(Stage::Retract, self.with_z(hole.top), self.lift_mm_per_s, None)
    }

    /// Commands in order; those that mill and follow each other together.
    fn commands(&mut self, commands: &[Command]) -> Result<(), Diagnostic> {
        let mills = |command: &Command| matches!(command, Command::Mill { .. } | Command::MillArc { .. });
        let mut done = 0;
        for group in commands.chunk_by(|a, b| mills(a) && mills(b)) {
            self.command = index(done);
            done += group.len();
            match group {
                [first, ..] if mills(first) => self.mill(group)?,
                // What does not mill is a group by itself.
                others => others.iter().try_for_each(|command| self.command(*command))?,
            }
        }
        Ok(())
    }

    /// Along `commands`, all of which mill: a path, or several between which play is taken up.
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
        (self.settled, self.bottom) = (false, None);
        Ok(())
    }

    /// The motors of X and Y through the play of those that are to go the other way from now on; the axes stand.
    fn take_up(&mut self, down: [bool; 2], speed_mm_per_s: f64) -> Result<(), Diagnostic> {
        let mut to = self.at;
        for axis in (0..2).filter(|axis| down[*axis] != self.turned[*axis]) {
            let play = play_steps(self.machine, axis);
            to[axis] += if down[axis] { -play } else { play };
        }
        self.line(Stage::Mill, to, speed_mm_per_s, None)
    }

    /// Along `path`, which is where the axes go, to the steps `axes` or else to the nearest.
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
        let wait_s = f64::from(self.machine.direction_setup_us) * 1e-6
            + 1.0 / f64::from(self.machine.max_step_hz.max(1));
        let start_tick = libm::ceil(wait_s * TICK_HZ as f64) as u64 + REST_TICKS;
        let spindles = self.spindles.iter().fold(0, |set, axis| set | 1 << (axis - 2));
        let part = milling::part(self.machine, path, (self.at, to), spindles, start_tick);
        refuse_slow(self.longest_mm(std::slice::from_ref(&part)), part.end_s())?;
        let duration_ticks = libm::ceil(part.end_s() * TICK_HZ as f64) as u64 + REST_TICKS;
        let turned = self.turned;
        self.push(Move { to, duration_ticks, parts: vec![part], ..self.blank(Stage::Mill) });
        // Which way the motors went is known from the play taken up, also where they went less than a step.
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
            return Err(Diagnostic::error("motion.retract_downwards").with("to", to.mm()));
        }
        self.line(Stage::Retract, top, self.lift_mm_per_s, None)
    }

    fn plunge(&mut self, to: Length, feed_um_per_s: u32, gate: Option<Gate>) -> Result<(), Diagnostic> {
        let bottom = self.with_z(to);
        if (2..AXES).any(|axis| bottom[axis] > self.at[axis]) {
            return Err(Diagnostic::error("motion.plunge_upwards").with("to", to.mm()));
        }
        if feed_um_per_s == 0 {
            return Err(Diagnostic::error("motion.no_feed"));
        }
        if !self.settled {
            let ticks = libm::ceil(self.machine.settle_ms * 1e-3 * TICK_HZ as f64) as u64;
            self.rest(Stage::Dwell, ticks, Switching::None);
            self.settled = true;
        }
        self.foot(true);
        // Where it has been deeper already, as when it pecks, nothing is left to cut down to there.
        let uncut = self.bottom.unwrap_or(Length::ZERO) + self.feed_height;
        let above = self.with_z(uncut.max(to));
        if (2..AXES).any(|axis| above[axis] < self.at[axis]) {
            self.line(Stage::Approach, above, f64::INFINITY, None)?;
        }
        let deepest = self.bottom.map_or(to, |bottom| bottom.min(to)).min(Length::ZERO);
        // Where a sensor ends it, nobody knows how deep it got.
        self.bottom = if gate.is_some() { self.bottom } else { Some(deepest) };
        self.line(Stage::Drill, bottom, f64::from(feed_um_per_s) * 1e-3, gate)
    }

    /// The spindles in use at `height`, in a hole each as far as it goes; everything else where it is.
    fn with_z(&self, height: Length) -> Steps {
        let mut steps = self.at;
        for axis in &self.spindles {
            let own = |bottom| self.machine.own(*axis).height(height, bottom);
            steps[*axis] = self.machine.z.scale.steps(self.hole_bottom.map_or(height, own));
        }
        steps
    }

    /// Where the motors of X and Y stand when the axes are at `to`: lower by the play where they come from above.
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

    /// A time of rest. Without time and effect nothing is written.
    pub(super) fn rest(&mut self, stage: Stage, duration_ticks: u64, effect: Switching) {
        if duration_ticks > 0 || effect != Switching::None {
            self.push(Move { duration_ticks, effect, ..self.blank(stage) });
        }
    }

    /// A straight line of the motors, not faster than `speed_mm_per_s`. One that goes nowhere is not written.
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

    /// The longest way of any of `parts`.
    fn longest_mm(&self, parts: &[AxisMove]) -> f64 {
        let mm = &self.timeline.mm_per_step;
        parts.iter().map(|part| part.length_mm(mm)).fold(0.0, f64::max)
    }

    /// A move that goes nowhere and takes no time.
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

/// A count as an index of a program; there is no more of anything in a leg.
fn index(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

/// Play of `axis` in whole steps of its motor.
fn play_steps(machine: &Machine, axis: usize) -> i64 {
    let axis = machine.axis(axis);
    axis.scale.steps(axis.backlash)
}

fn refuse_slow(length_mm: f64, seconds: f64) -> Result<(), Diagnostic> {
    if seconds <= LONGEST_MOVE_S {
        return Ok(());
    }
    let diagnostic = Diagnostic::error("motion.move_too_slow").with("length", length_mm);
    Err(diagnostic.with("seconds", seconds).with("longest", LONGEST_MOVE_S))
}

/// The parts of a straight line of the motors: first the play of X and Y that turn, then all axes together. Axes driven by
/// the table go each by itself.
pub(super) fn lines(
    machine: &Machine,
    stage: Stage,
    from: Steps,
    to: Steps,
    speed_mm_per_s: f64,
    turned: [bool; AXES],
) -> Result<Vec<AxisMove>, Diagnostic> {
    if machine.drive == DriveKind::Table {
        return (0..AXES)
            .filter(|axis| from[*axis] != to[*axis])
            .map(|axis| {
                let mut alone = from;
                alone[axis] = to[axis];
                let motion = Motion::TableSteps(steps(machine, axis, to[axis] - from[axis], speed_mm_per_s)?);
                Ok(AxisMove { stage, start_tick: 0, from, to: alone, motion })
            })
            .collect();
    }
    let mut taken = from;
    for axis in 0..2 {
        let way = to[axis] - from[axis];
        if way != 0 && (way < 0) != turned[axis] {
            taken[axis] += way.signum() * play_steps(machine, axis).min(way.abs());
        }
    }
    let mut parts: Vec<AxisMove> = Vec::new();
    for (from, to) in [(from, taken), (taken, to)] {
        if from != to {
            let start_s = parts.last().map_or(0.0, AxisMove::end_s);
            let profile = line(machine, &from, &to, speed_mm_per_s)?;
            let stroke = Stroke::One(profile);
            let start_tick = start_tick(machine, start_s, &stroke, &from, &to);
            parts.push(AxisMove { stage, start_tick, from, to, motion: Motion::Line(stroke) });
        }
    }
    Ok(parts)
}

/// The tick at which a line may begin that is wanted at `wanted_s`: so that no axis steps earlier than its direction has
/// been set up, nor sooner than one pulse may follow another. An axis first steps when it is half a step along.
pub(super) fn start_tick(machine: &Machine, wanted_s: f64, stroke: &Stroke, from: &Steps, to: &Steps) -> u64 {
    let most = (0..AXES).map(|axis| (to[axis] - from[axis]).unsigned_abs()).max().unwrap_or(0);
    let first_step_s = stroke.time_at(0.5 * stroke.length_mm() / most.max(1) as f64);
    let direction_s = f64::from(machine.direction_setup_us) * 1e-6;
    let pulse_s = 1.0 / f64::from(machine.max_step_hz.max(1));
    let needed_s = direction_s.max(pulse_s) + REST_TICKS as f64 / TICK_HZ as f64;
    libm::ceil((wanted_s + (needed_s - first_step_s).max(0.0)) * TICK_HZ as f64) as u64
}
