//! Rules for one axis: counts, range, intervals, direction, speed, acceleration.
//!
//! ```text
//! position ^        ┌──  k+1     the motor passes k + ½ at the moment of the step,
//!          |     ┌──┘    k       so mean speeds are measured between steps, from
//!          |  ───┘               half step to half step
//!          +--------------> t
//! ```
//!
//! Steps may be 1 µs early or late; exactly that is tolerated at both ends of each stretch.
//!
//! A run after a rest starts a sweep. The verdict on a sweep depends only on its own runs, so verified sweeps
//! are cached: every hole of a bit repeats two strokes.

use super::known::{Known, Sweep};
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::job::Stage;
use crate::machine::{DriveKind, Machine};
use crate::steps::stream::{PARTS, Run, rounded};
use crate::units::TICK_HZ;

/// Tolerance of a stretch between two steps: 1 µs at both ends, and a tick of rounding.
const SLACK_TICKS: f64 = 21.0;

/// Moves are still for this long before their end. A path may end at its last step, and that step may be
/// early by this much.
const STILL_TICKS: f64 = 20.0;

/// Number of steps for a mean speed.
const SPEED_STEPS: usize = 8;

/// Latest ticks stored: a power of two above [`SPEED_STEPS`].
const RING: usize = 16;

/// Longest stretch for a mean speed that is compared with the previous one: 5 ms. Shorter, more sensitive
/// stretches are compared as well: with length, the effect of the tolerance shrinks and the allowed change of
/// speed grows.
const ACCELERATION_TICKS: u64 = TICK_HZ / 200;

const ROUNDING_SHARE: f64 = 1e-3;

/// An acceleration above any machine's, mm/s².
const MOST_MM_PER_S2: f64 = 1e9;

#[derive(Debug)]
pub(super) struct Walker {
    pub(super) at: i64,
    pub(super) lowest: i64,
    pub(super) highest: i64,
    pub(super) low_in_segment: i64,
    min: i64,
    max: i64,
    /// Tick and direction of the last step.
    last: Option<(u64, bool)>,
    least_interval: u64,
    direction_setup: u64,
    /// Ticks per step at the highest speed, and the fewest ticks for [`SPEED_STEPS`] steps.
    least_period: f64,
    least_span: u64,
    acceleration: f64,
    /// Allowed jump of speed in corners of milled paths, and in the current segment; steps per tick. The
    /// planner allows √(8·A·d), with the deviation d of the machine's settings.
    corner: f64,
    jump: f64,
    /// The current segment mills. Milled paths start and end at any position, up to half a step off the
    /// motor's.
    milled: bool,
    /// After this many ticks without a step the axis counts as at rest: it could stop and accelerate again
    /// within that time.
    rest: u64,
    known: Known,
}

impl Walker {
    pub(super) fn new(machine: &Machine, axis: usize, zero: i64, start: i64) -> Self {
        let settings = machine.axis(axis);
        let steps_per_mm = settings.scale.steps_per_mm();
        let hz = TICK_HZ as f64;
        // Only X and Y compensate backlash.
        let play = if axis < 2 { settings.scale.steps(settings.backlash) } else { 0 };
        let down = &machine.down;
        let (mut speed, mut acceleration) =
            (settings.max_speed_mm_per_s, settings.max_acceleration_mm_per_s2);
        // One limit for both directions of Z: the higher one.
        if axis >= 2 {
            speed = speed.max(down.max_speed_mm_per_s);
            acceleration = acceleration.max(down.max_acceleration_mm_per_s2);
        }
        if machine.drive == DriveKind::Table {
            // A table jumps between rates, so acceleration has no limit here. The pulse rate is still
            // checked.
            acceleration = f64::INFINITY;
        }
        let least_span = least_span(hz / (speed * steps_per_mm));
        let per_tick2 = acceleration * steps_per_mm / hz / hz;
        Self {
            at: start,
            lowest: start,
            highest: start,
            low_in_segment: start,
            // With backlash, the motor is lower by the backlash after a downward move.
            min: settings.scale.steps(settings.min).saturating_sub(zero).saturating_sub(play),
            max: settings.scale.steps(settings.max).saturating_sub(zero),
            last: None,
            least_interval: TICK_HZ.div_ceil(u64::from(machine.pulse_hz().max(1))),
            direction_setup: u64::from(machine.direction_setup_us) * (TICK_HZ / 1_000_000),
            least_period: hz / (speed * steps_per_mm),
            least_span,
            acceleration: per_tick2,
            corner: libm::sqrt(8.0 * acceleration.min(MOST_MM_PER_S2) * machine.motion.corner_mm)
                * steps_per_mm
                / hz,
            jump: 0.0,
            milled: false,
            rest: ((4.0 / libm::sqrt(per_tick2)) as u64).max(ACCELERATION_TICKS).max(least_span),
            known: Known::default(),
        }
    }

    /// Checks the runs of a segment that starts at tick `now`. Always leaves the axis at `end`.
    pub(super) fn segment(
        &mut self,
        runs: &[Run],
        now: u64,
        (duration, end, stage): (u64, i64, Stage),
    ) -> Result<(), Diagnostic> {
        self.low_in_segment = self.at;
        self.milled = stage == Stage::Mill;
        self.jump = if self.milled { self.corner } else { 0.0 };
        let verdict = self.runs(runs, now, duration).and_then(|()| {
            if self.at == end {
                return Ok(());
            }
            Err(error!("check.count", found = self.at, expected = end, ..))
        });
        if self.at != end {
            // Continue from the planned end, so that one error doesn't repeat in all later segments.
            self.at = end;
            self.low_in_segment = self.low_in_segment.min(end);
        }
        verdict
    }

    fn runs(&mut self, mut runs: &[Run], now: u64, duration: u64) -> Result<(), Diagnostic> {
        let mut tick = i128::from(now);
        let end = tick + i128::from(duration);
        while let Some((first, later)) = runs.split_first() {
            let rested = self.rests(first);
            let next = later.iter().position(|run| self.rests(run)).map_or(runs.len(), |next| next + 1);
            let (sweep, rest) = runs.split_at(next);
            tick = self.sweep(sweep, tick, rested, if rest.is_empty() { Some(end) } else { None })?;
            runs = rest;
        }
        Ok(())
    }

    fn rests(&self, run: &Run) -> bool {
        !self.milled && rounded(run.parts_before(0)) >= i128::from(self.rest)
    }

    /// Checks one sweep after tick `begin`, from a rest or the start of its segment to a rest or the end of
    /// its segment. Returns the tick of its last step.
    fn sweep(
        &mut self,
        runs: &[Run],
        begin: i128,
        rested: bool,
        segment_ends: Option<i128>,
    ) -> Result<i128, Diagnostic> {
        let Some(first) = runs.first() else { return Ok(begin) };
        let ticks: i128 = runs.iter().map(Run::ticks).sum();
        let end = begin + ticks;
        if let Some(late) = segment_ends.map(|ends| end - ends).filter(|late| *late > 0) {
            // If another rule is violated, report that first: it is the cause.
            self.walk(runs, begin, &mut Pace::new(begin as u64, rested, self.milled))?;
            return Err(error!("check.late_step", late_us = late / 10, ..));
        }
        let tail =
            segment_ends.map(|ends| ends - end).filter(|tail| self.milled || *tail < i128::from(self.rest));
        let sweep = Sweep { runs, rested, tail };
        // Milled paths don't repeat.
        let known = if self.milled { None } else { self.known.find(&sweep) };
        if let Some(way) = known {
            let (low, high) = (self.at.saturating_add(way.low), self.at.saturating_add(way.high));
            // Outside the range, walk the sweep to find the exact violation.
            if low >= self.min && high <= self.max {
                self.first_step(first, begin + rounded(first.parts_before(0)))?;
                self.passes(low, high);
                self.at += way.end;
                self.last = u64::try_from(end).ok().map(|end| (end, way.forward));
                return Ok(end);
            }
        }
        let mut pace = Pace::new(begin as u64, rested, self.milled);
        self.walk(runs, begin, &mut pace)?;
        match tail {
            Some(tail) => pace.rest((end + tail) as u64, self)?,
            None => pace.long_rest(end as u64, self)?,
        }
        if !self.milled {
            self.known.learn(&sweep);
        }
        Ok(end)
    }

    fn walk(&mut self, runs: &[Run], begin: i128, pace: &mut Pace) -> Result<(), Diagnostic> {
        runs.iter().try_fold(begin, |tick, run| self.run(run, tick, pace)).map(drop)
    }

    fn passes(&mut self, low: i64, high: i64) {
        self.lowest = self.lowest.min(low);
        self.highest = self.highest.max(high);
        self.low_in_segment = self.low_in_segment.min(low);
    }

    /// Checks one run; returns the tick of its last step.
    fn run(&mut self, run: &Run, begin: i128, pace: &mut Pace) -> Result<i128, Diagnostic> {
        if run.count == 0 {
            return Err(error!("check.empty_run", ..));
        }
        // In whole ticks, two steps are apart by at least their interval, less the fraction of a tick.
        let shortest = run.parts_before(run.count - 1).min(run.parts_before(1));
        if run.count > 1 && shortest < i128::from(self.least_interval) * i128::from(PARTS) {
            return Err(self.too_close(shortest as f64 / PARTS as f64));
        }
        self.first_step(run, begin + rounded(run.parts_before(0)))?;
        let way = i64::from(run.count) * if run.forward { 1 } else { -1 };
        let end = self.at.saturating_add(way);
        self.within_range(end)?;
        let tick = begin + run.ticks();
        let way = if run.forward { 1 } else { -1 };
        let mut step = |walker: &mut Self, at_tick: u64| {
            walker.at += way;
            pace.step(at_tick, run.forward, walker)?;
            walker.last = Some((at_tick, run.forward));
            Ok(())
        };
        match Narrow::of(run, begin) {
            Some(Narrow { begin, mut interval, change }) => {
                let mut parts = PARTS / 2;
                for _ in 0..run.count {
                    parts += interval;
                    interval += change;
                    step(self, (begin + (parts >> PARTS.trailing_zeros())) as u64)?;
                }
            }
            None => {
                let (mut parts, mut interval) = (0, run.parts_before(0));
                for _ in 0..run.count {
                    parts += interval;
                    interval += i128::from(run.change);
                    step(self, (begin + rounded(parts)) as u64)?;
                }
            }
        }
        self.passes(end, end);
        Ok(tick)
    }

    pub(super) fn within_range(&self, place: i64) -> Result<(), Diagnostic> {
        if (self.min..=self.max).contains(&place) {
            return Ok(());
        }
        Err(error!("check.range", place = place, low = self.min, high = self.max, ..))
    }

    /// Checks the first step of a run against the last step before it.
    fn first_step(&self, run: &Run, tick: i128) -> Result<(), Diagnostic> {
        let (since, turned) = match self.last {
            Some((last, forward)) => (tick - i128::from(last), forward != run.forward),
            None => (tick, true),
        };
        if self.last.is_some() && since < i128::from(self.least_interval) {
            return Err(self.too_close(since as f64));
        }
        if turned && since < i128::from(self.direction_setup) {
            let needed_us = self.direction_setup / 10;
            return Err(error!("check.direction_setup", us = since as f64 / 10.0, needed = needed_us, ..));
        }
        Ok(())
    }

    fn too_close(&self, ticks: f64) -> Diagnostic {
        error!(
            "check.interval",
            us = libm::round(ticks) / 10.0,
            least = self.least_interval as f64 / 10.0,
            ..
        )
    }
}

/// A run with numbers that fit into 64 bits throughout, as all sensible runs do.
struct Narrow {
    begin: i64,
    interval: i64,
    change: i64,
}

impl Narrow {
    fn of(run: &Run, begin: i128) -> Option<Self> {
        const ROOM: u128 = 1 << 61;
        let count = i128::from(run.count);
        let widest = run.parts_before(0).unsigned_abs().max(run.parts_before(run.count).unsigned_abs());
        let fits = widest * (count as u128 + 1) < ROOM && begin.unsigned_abs() < ROOM;
        let begin = i64::try_from(begin).ok().filter(|_| fits)?;
        Some(Self { begin, interval: run.first_parts(), change: i64::from(run.change) })
    }
}

/// Fewest whole ticks for [`SPEED_STEPS`] steps, if the shortest lasts `period` ticks.
fn least_span(period: f64) -> u64 {
    libm::ceil(SPEED_STEPS as f64 * period * (1.0 - ROUNDING_SHARE) - SLACK_TICKS) as u64
}

/// Speeds of one axis within one sweep, which starts and ends at rest.
struct Pace {
    /// Ticks of the latest steps in one direction, as a ring.
    ticks: [u64; RING],
    count: usize,
    forward: bool,
    /// Motor position from the start of the sweep, and twice the position at the moment of the last step.
    place: i64,
    twice: i64,
    /// Stretches of 5 ms, and the most sensitive stretches. In milled paths, only between the first and the
    /// last step.
    long: Stretch,
    short: Stretch,
    milled: bool,
    /// The axis rested before its first step; the first step was made.
    rested: bool,
    stepped: bool,
}

#[derive(Clone, Copy)]
struct Stretch {
    /// The previous stretch: length in ticks, mean speed in steps per tick, and whether it exists.
    length: f64,
    speed: f64,
    known: bool,
    /// Start of the current stretch: tick, and twice the position.
    since: u64,
    from_twice: i64,
    /// Best length of a stretch in ticks, at the speed of the previous one. Minimises the sum of the
    /// tolerance, speed·slack/length at both ends, and the allowed change, acceleration·length.
    telling: u64,
}

impl Pace {
    fn new(now: u64, rested: bool, milled: bool) -> Self {
        Self {
            ticks: [0; RING],
            count: 0,
            forward: true,
            place: 0,
            twice: 0,
            long: Stretch::new(now),
            short: Stretch::new(now),
            milled,
            rested,
            stepped: false,
        }
    }

    fn step(&mut self, tick: u64, forward: bool, axis: &Walker) -> Result<(), Diagnostic> {
        let before = self.place;
        self.place += if forward { 1 } else { -1 };
        // Mean speeds are measured in one direction only.
        if forward != self.forward {
            (self.forward, self.count) = (forward, 0);
        }
        self.ticks[self.count % RING] = tick;
        if self.count >= SPEED_STEPS {
            let span = tick - self.ticks[(self.count - SPEED_STEPS) % RING];
            if span < axis.least_span {
                let least = SPEED_STEPS as f64 * axis.least_period;
                let percent = libm::round(100.0 * least / (span as f64).max(1.0));
                return Err(error!("check.speed", percent = percent, ..));
            }
        }
        self.count += 1;
        let twice = before + self.place;
        self.twice = twice;
        if self.rested && !self.stepped {
            let rest = Stretch { length: axis.rest as f64, from_twice: twice, ..Stretch::new(tick) };
            (self.long, self.short, self.stepped) = (rest, rest, true);
            return Ok(());
        }
        if tick - self.long.since >= ACCELERATION_TICKS {
            self.long.end(tick, twice, axis)?;
        }
        if self.milled && !self.stepped {
            self.short = Stretch { since: tick, from_twice: twice, known: false, ..self.short };
        } else if tick - self.short.since >= self.short.telling {
            self.short.end(tick, twice, axis)?;
        }
        self.stepped = true;
        Ok(())
    }

    fn rest(&mut self, tick: u64, axis: &Walker) -> Result<(), Diagnostic> {
        if self.milled {
            return self.long.rest(tick, 2 * self.place, axis, SLACK_TICKS + STILL_TICKS);
        }
        self.long.rest(tick, 2 * self.place, axis, SLACK_TICKS)?;
        self.short.rest(tick, 2 * self.place, axis, SLACK_TICKS)
    }

    fn long_rest(&mut self, tick: u64, axis: &Walker) -> Result<(), Diagnostic> {
        for stretch in [&mut self.long, &mut self.short] {
            if tick > stretch.since {
                stretch.end(tick, self.twice, axis)?;
            }
            stretch.end(tick + axis.rest, self.twice, axis)?;
        }
        Ok(())
    }
}

impl Stretch {
    fn new(now: u64) -> Self {
        Self { length: 0.0, speed: 0.0, known: true, since: now, from_twice: 0, telling: 0 }
    }

    /// Ends a stretch at `tick`, at the start of a rest, with a tolerance of `slack` ticks.
    fn rest(&mut self, tick: u64, twice: i64, axis: &Walker, slack: f64) -> Result<(), Diagnostic> {
        self.ends(tick, twice, axis, slack)?;
        self.ends(tick, twice, axis, slack)
    }

    fn end(&mut self, tick: u64, twice: i64, axis: &Walker) -> Result<(), Diagnostic> {
        self.ends(tick, twice, axis, SLACK_TICKS)
    }

    /// Ends a stretch at `tick`, at half the position `twice`, and compares its mean speed with the previous
    /// stretch. Mean speeds of adjacent stretches differ by at most the acceleration times half their joint
    /// length.
    fn ends(&mut self, tick: u64, twice: i64, axis: &Walker, slack: f64) -> Result<(), Diagnostic> {
        let length = (tick - self.since) as f64;
        let speed = (twice - self.from_twice) as f64 * 0.5 / length.max(1.0);
        let blur = |speed: f64, length: f64| speed.abs() * slack / length.max(1.0);
        let allowed = axis.jump + 0.5 * axis.acceleration * (self.length + length) * (1.0 + ROUNDING_SHARE);
        let blurred = blur(speed, length) + blur(self.speed, self.length);
        let change = (speed - self.speed).abs();
        if self.known && change > allowed + blurred {
            return Err(error!("check.acceleration", percent = libm::round(100.0 * change / allowed), ..));
        }
        (self.length, self.speed, self.since, self.from_twice) = (length, speed, tick, twice);
        let telling = libm::sqrt(2.0 * SLACK_TICKS * speed.abs() / axis.acceleration);
        self.known = true;
        self.telling = (telling as u64).min(ACCELERATION_TICKS);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::Chance;
    use crate::check::{corner_zero, runs_of};
    use crate::geometry::Point;
    use crate::machine::{AXES, Steps, presets};
    use crate::motion::bench::holes_at;
    use crate::steps::{StepStream, stream_of};

    /// Problems by segment and axis, and the final positions: with the cache, without it, and without
    /// splitting at rests.
    fn found(stream: &StepStream, machine: &Machine) -> [(Vec<Result<(), Diagnostic>>, Steps); 3] {
        let zero = corner_zero(machine);
        [0, 1, 2].map(|how| {
            let mut walkers: [Walker; AXES] =
                std::array::from_fn(|axis| Walker::new(machine, axis, zero[axis], stream.start[axis]));
            for walker in walkers.iter_mut().filter(|_| how > 0) {
                walker.known = Known::nothing();
                walker.rest = if how == 2 { u64::MAX } else { walker.rest };
            }
            let (mut now, mut results) = (0, Vec::new());
            for segment in &stream.segments {
                for (axis, walker) in walkers.iter_mut().enumerate() {
                    let ends = (segment.duration_ticks, segment.end[axis], segment.stage);
                    results.push(walker.segment(runs_of(segment, axis).unwrap_or(&[]), now, ends));
                }
                now += segment.duration_ticks;
            }
            let ends = walkers.map(|walker| walker.at + 7 * walker.lowest + 11 * walker.highest);
            (results, ends)
        })
    }

    /// Rows of holes of every preset, and variants with a run made faster, slower or bent, or with another
    /// rest before it.
    #[test]
    fn skipping_checked_segments_changes_no_result() {
        let seed = 20_261_123_u64;
        println!("seed {seed}");
        let mut chance = Chance::new(seed);
        let mut next = |below: usize| chance.below(below);
        let rounds = if std::env::var_os("ANNULUS_LONG").is_some() { 400 } else { 40 };
        let (mut refused, mut stricter, mut tried) = (0, 0, 0);
        for (name, machine) in presets() {
            let pitch = [1.27, 2.54, 2.54, 5.08][next(4)];
            let places =
                (0..24).map(|hole| Point::from_mm(f64::from(hole % 8) * pitch, f64::from(hole / 8) * 2.54));
            let sound = stream_of(&holes_at(&machine, places), &machine).unwrap();
            for (results, _) in found(&sound, &machine) {
                let wrong: Vec<_> = results.iter().filter(|result| result.is_err()).collect();
                assert!(wrong.is_empty(), "{name}: {wrong:?}");
            }
            for round in 0..rounds {
                let mut stream = sound.clone();
                let at = next(stream.segments.len());
                let runs = &mut stream.segments[at].runs;
                if runs.is_empty() {
                    continue;
                }
                let place = next(runs.len());
                let run = &mut runs[place];
                let parts = run.first_parts() as f64;
                let (parts, bent) = match next(6) {
                    0 => (parts / 1.4, 0),
                    1 => (parts * 1.4, 0),
                    2 => (parts, 3),
                    3 => (parts, -3),
                    4 => (parts + next(200_000) as f64 * PARTS as f64, 0),
                    _ => (parts / (1.0 + next(100) as f64 * 0.02), next(3) as i32 - 1),
                };
                (run.interval, run.fraction) = ((parts as u64 >> 16) as u32, (parts as u64 & 0xFFFF) as u16);
                run.change = run.change.saturating_add(bent * 65_536);
                let [fast, plain, whole] = found(&stream, &machine);
                assert_eq!(fast, plain, "{name}, round {round}");
                let errs = |all: &[Result<(), Diagnostic>]| all.iter().filter(|one| one.is_err()).count();
                let (fast, whole) = (errs(&fast.0), errs(&whole.0));
                assert!(fast > 0 || whole == 0, "{name}, round {round}: {:?}", stream.segments[at].runs);
                tried += 1;
                refused += u32::from(fast > 0);
                stricter += u32::from(fast > 0 && whole == 0);
            }
        }
        println!("{refused} of {tried} refused, {stricter} of them only because rests part sweeps");
        assert!(refused > tried / 10 && refused < tried, "{refused} of {tried}");
    }
}
