//! Rules between axes, spindle, gates and legs.
//! Single pulses are examined only if XY and spindles step at one time.

use crate::code;
use crate::diagnostic::Diagnostic;
use crate::job::{Gate, Input, Mark, Otherwise, Stage, Switching};
use crate::machine::{MOST_RPM, Machine};
use crate::steps::replay;
use crate::steps::stream::{Run, Segment, rounded};
use crate::units::{Length, TICK_HZ};

/// Least height of the tip over the surface for X or Y steps, unless the safe height is lower. If XY and
/// spindles move together, the machine's setting applies.
const CLEARANCE: Length = Length::from_um(200);

pub(super) struct Heights<'a> {
    /// Before the segment, one per spindle.
    pub(super) starts: &'a [i64],
    pub(super) low_z: i64,
}

#[derive(Debug)]
pub(super) struct Interlocks {
    /// Steps from the surface to the clearance.
    clearance: i64,
    spin_up_ticks: u64,
    spindle_rpm: u32,
    /// Tick of the latest change of the spindle speed.
    spindle_since: u64,
    /// The previous plunge may have ended on the contact sensor, with the tip on the board.
    touching: bool,
    /// Travel time of the presser foot; none without a foot.
    foot_ticks: Option<u64>,
    foot_down: bool,
    foot_there: u64,
}

impl Interlocks {
    /// Starts with the spindle off.
    pub(super) fn new(machine: &Machine) -> Self {
        let overlap = machine.overlap;
        let wanted = if overlap.on { Length::from_mm(overlap.clear_mm) } else { CLEARANCE };
        let clearance = machine.z.scale.steps(wanted.min(machine.process.safe_height));
        let spin_up_ticks = libm::floor(machine.process.spin_up_ms * 1e-3 * TICK_HZ as f64) as u64;
        Self {
            clearance,
            spin_up_ticks,
            spindle_rpm: 0,
            spindle_since: 0,
            touching: false,
            foot_ticks: machine.foot.on.then(|| machine.foot.ticks()),
            foot_down: false,
            foot_there: 0,
        }
    }

    pub(super) fn spindle_runs(&self) -> bool {
        self.spindle_rpm > 0
    }

    /// Checks one segment that starts at tick `now`, and its transition to the next one.
    pub(super) fn segment(
        &mut self,
        segment: &Segment,
        heights: &Heights<'_>,
        now: u64,
        next: Option<&Segment>,
    ) -> Vec<Diagnostic> {
        let low_z = heights.low_z;
        let start_z = heights.starts.iter().copied().min().unwrap_or(0);
        let mut found = Vec::new();
        if let Switching::Spindle { rpm } = segment.effect
            && rpm != self.spindle_rpm
        {
            (self.spindle_rpm, self.spindle_since) = (rpm, now);
        }
        if let Switching::Foot { down } = segment.effect
            && down != self.foot_down
        {
            (self.foot_down, self.foot_there) = (down, now + self.foot_ticks.unwrap_or(0));
        }
        let (rpm, is_there) = (self.spindle_rpm, now >= self.foot_there);
        let mut refuse = |broken: bool, code: &str| {
            if broken {
                let diagnostic = Diagnostic::error(code).with("height_steps", low_z);
                found.push(diagnostic.with("rpm", rpm).with("most", MOST_RPM));
            }
        };
        refuse(self.spindle_rpm > MOST_RPM, code!("check.spindle_speed"));
        let awaits = matches!(segment.effect, Switching::AwaitBit { .. });
        refuse(awaits && (self.spindle_rpm > 0 || start_z < self.clearance), code!("check.await_bit"));
        let in_plane = segment.runs.iter().any(|run| run.axes & 0b11 != 0);
        let milled = segment.stage == Stage::Mill;
        let dragged =
            in_plane && !milled && low_z < self.clearance && drags(segment, heights.starts, self.clearance);
        refuse(dragged, code!("check.xy_in_board"));
        let in_board = low_z < 0;
        let drills =
            matches!(segment.stage, Stage::Approach | Stage::Drill) && matches!(segment.mark, Mark::Hole(_));
        let pressed = self.foot_down && is_there;
        refuse(self.foot_ticks.is_some() && drills && !pressed, code!("check.foot_up"));
        refuse(in_plane && (self.foot_down || !is_there), code!("check.foot_down"));
        // A bit may touch the board without turning, and rise again, because the contact sensor ends that
        // move or raises an alarm.
        let touch = |gate: Gate| gate.input == Input::Contact && gate.otherwise == Otherwise::Alarm;
        let touches = segment.gate.is_some_and(touch);
        let rises = std::mem::replace(&mut self.touching, touches) && begins_upwards(segment);
        refuse(in_board && self.spindle_rpm == 0 && !touches && !rises, code!("check.spindle_off"));
        let spun = now.saturating_sub(self.spindle_since) >= self.spin_up_ticks;
        refuse(in_board && self.spindle_rpm > 0 && !spun, code!("check.spin_up"));
        let alone = segment.runs.windows(2).all(|pair| matches!(pair, [a, b] if a.axes == b.axes));
        refuse(segment.gate.is_some() && (!alone || segment.runs.is_empty()), code!("check.gate_not_alone"));
        let ends_low = segment.end[2..].iter().take(heights.starts.len()).any(|end| *end < self.clearance);
        let last_of_leg = next.is_none_or(|next| next.leg != segment.leg);
        let lifted = next.is_some_and(begins_upwards);
        refuse(last_of_leg && ends_low && !lifted, code!("check.leg_ends_low"));
        found
    }
}

/// True if the segment moves spindles, and all of them upwards first.
fn begins_upwards(segment: &Segment) -> bool {
    let sets = segment.runs.chunk_by(|a, b| a.axes == b.axes).filter_map(|runs| runs.first());
    let mut spindles = sets.filter(|first| first.axes & !0b11 != 0).peekable();
    spindles.peek().is_some() && spindles.all(|first| first.forward)
}

/// True if XY steps while any spindle is below the clearance. The ticks at which spindles cross the clearance
/// usually decide: XY starts after they rose and ends before they go down. If not, the check replays every
/// pulse.
fn drags(segment: &Segment, starts: &[i64], clearance: i64) -> bool {
    let Some((first, last)) = plane_ticks(segment) else { return false };
    let meets = |low: Low| low.from <= last && low.until.is_none_or(|until| until > first);
    let spindles = starts.iter().enumerate();
    let mut all = spindles.flat_map(|(spindle, start)| lows(segment, spindle + 2, *start, clearance));
    all.any(meets) && drags_by_pulses(segment, starts, clearance)
}

/// Time during which a spindle is below the clearance: ticks from the start of the segment, half-open.
struct Low {
    from: i128,
    until: Option<i128>,
}

/// Ticks of the first and the last step of X and Y.
fn plane_ticks(segment: &Segment) -> Option<(i128, i128)> {
    let sets = segment.runs.chunk_by(|a, b| a.axes == b.axes).filter(|runs| runs[0].axes & 0b11 != 0);
    let ends =
        sets.map(|runs| (rounded(runs[0].parts_before(0)), runs.iter().map(|run| run.ticks()).sum::<i128>()));
    ends.reduce(|all, set| (all.0.min(set.0), all.1.max(set.1)))
}

fn lows(segment: &Segment, axis: usize, start: i64, clearance: i64) -> Vec<Low> {
    let mut lows = Vec::new();
    let (mut height, mut tick) = (start, 0);
    if height < clearance {
        lows.push(Low { from: 0, until: None });
    }
    for run in segment.runs.iter().filter(|run| run.axes >> axis & 1 == 1) {
        let count = i64::from(run.count);
        let end = height + if run.forward { count } else { -count };
        if (height < clearance) != (end < clearance) {
            let steps = if run.forward { clearance - height } else { height - clearance + 1 };
            let passes = Run { count: u32::try_from(steps).unwrap_or(u32::MAX), ..*run };
            let at = tick + passes.ticks();
            match lows.last_mut() {
                Some(low) if run.forward => low.until = Some(at),
                _ => lows.push(Low { from: at, until: None }),
            }
        }
        (height, tick) = (end, tick + run.ticks());
    }
    lows
}

/// Like [`drags`], by replaying every pulse.
fn drags_by_pulses(segment: &Segment, starts: &[i64], clearance: i64) -> bool {
    let mut heights = starts.to_vec();
    replay(segment).any(|pulse| {
        for (spindle, height) in heights.iter_mut().enumerate() {
            if pulse.axes >> (spindle + 2) & 1 == 1 {
                *height += if pulse.forward >> (spindle + 2) & 1 == 1 { 1 } else { -1 };
            }
        }
        pulse.axes & 0b11 != 0 && heights.iter().any(|height| *height < clearance)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::Chance;
    use crate::machine::Steps;

    #[test]
    fn stopped_spindle_plunges_only_if_no_contact_is_an_alarm() {
        let found = |otherwise| {
            let mut rules = Interlocks::new(&crate::machine::hobby_3018());
            let down = Run { axes: 4, forward: false, interval: 10_000, fraction: 0, count: 9, change: 0 };
            let segment = Segment {
                leg: 0,
                mark: Mark::Finish,
                stage: Stage::Drill,
                duration_ticks: 0,
                runs: vec![down],
                effect: Switching::None,
                gate: Some(Gate { input: Input::Contact, deadline_us: 1_000_000, otherwise }),
                end: Steps::default(),
            };
            let next = Segment { runs: vec![Run { forward: true, ..down }], ..segment.clone() };
            let heights = Heights { starts: &[4], low_z: -5 };
            let found = rules.segment(&segment, &heights, 0, Some(&next));
            found.into_iter().map(|diagnostic| diagnostic.code).collect::<Vec<_>>()
        };
        assert_eq!(found(Otherwise::Alarm), Vec::<String>::new());
        assert_eq!(found(Otherwise::GoOn), ["check.spindle_off"]);
    }

    #[test]
    fn drags_by_ticks_equal_drags_by_pulses() {
        let seed = 20_261_123_u64;
        println!("seed {seed}");
        let mut chance = Chance::new(seed);
        let mut next = |below: u64| chance.bits() % below;
        let mut found = [0; 2];
        for round in 0..20_000 {
            let mut runs = Vec::new();
            for axes in [1, 2, 4] {
                let mut forward = next(2) == 0;
                for _ in 0..next(4) {
                    let count = 1 + next(12) as u32;
                    let change = next(3) as i32 * 40_000 - 40_000;
                    let interval = 20 + next(if axes == 4 { 200 } else { 60 }) as u32;
                    runs.push(Run { axes, forward, interval, fraction: next(65_536) as u16, count, change });
                    forward ^= next(3) == 0;
                }
            }
            let segment = Segment {
                leg: 0,
                mark: Mark::Finish,
                stage: Stage::NextHole,
                duration_ticks: 0,
                runs,
                effect: Switching::None,
                gate: None,
                end: Steps::default(),
            };
            let (starts, clearance) = ([next(20) as i64 - 10], 3);
            let drags = drags(&segment, &starts, clearance);
            assert_eq!(drags, drags_by_pulses(&segment, &starts, clearance), "round {round}: {segment:?}");
            found[usize::from(drags)] += 1;
        }
        assert!(found.iter().all(|count| *count > 1_000), "{found:?}");
    }
}
