//! Statistics of a job.

use crate::diagnostic::Diagnostic;
use crate::job::{Mark, Program, Stage, Switching};
use crate::machine::{AXES, Machine};
use crate::magazine;
use crate::motion::{AxisMove, Move, Timeline, each_leg};
use crate::steps::StepStream;
use crate::units::TICK_HZ;

/// Time by activity, s. The sum is the time of the job.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spent {
    /// All legs that drill holes.
    pub drill_s: f64,
    pub mill_s: f64,
    /// Vertical plunges; part of `mill_s`.
    pub plunge_s: f64,
    /// Rest of the legs that mill: travel, retracts, approaches.
    pub between_s: f64,
    /// Tool changes without waits for the user; complete changes with a magazine.
    pub change_s: f64,
    /// Before the first leg and after the last.
    pub other_s: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Time of the whole job without waits for the user, s.
    pub total_s: f64,
    pub spent: Spent,
    pub toolpaths: u32,
    pub holes: u32,
    /// Holes per minute while drilling, without tool changes; one spindle counts.
    pub holes_per_min: f64,
    /// Holes per minute if Z and XY never moved together.
    pub holes_per_min_sequential: f64,
    pub median_hole_s: f64,
    /// Longest time of a hole, s.
    pub longest_hole_s: f64,
    pub steps: [u64; AXES],
}

pub fn summary(timeline: &Timeline, stream: &StepStream, machine: &Machine) -> Summary {
    let mut holes: Vec<(u32, u64)> = Vec::new();
    let mut sequential_s = 0.0;
    for planned in timeline.moves.iter().filter(|planned| matches!(planned.mark, Mark::Hole(_))) {
        match holes.last_mut() {
            Some((leg, ticks)) if *leg == planned.leg => *ticks += planned.duration_ticks,
            _ => holes.push((planned.leg, planned.duration_ticks)),
        }
        sequential_s += alone_s(planned, machine);
    }
    let mut times: Vec<u64> = holes.into_iter().map(|(_, ticks)| ticks).collect();
    times.sort_unstable();
    let seconds = |ticks: u64| ticks as f64 / TICK_HZ as f64;
    let drilling_s = seconds(times.iter().sum());
    let per_min = |spent_s: f64| if spent_s > 0.0 { 60.0 * times.len() as f64 / spent_s } else { 0.0 };
    let middle = |index: usize| times.get(index).copied().map_or(0.0, seconds);
    let median_hole_s = 0.5 * (middle(times.len() / 2) + middle(times.len().saturating_sub(1) / 2));
    let mut steps = [0; AXES];
    for run in stream.segments.iter().flat_map(|segment| &segment.runs) {
        for axis in (0..AXES).filter(|axis| run.axes >> axis & 1 == 1) {
            steps[axis] += u64::from(run.count);
        }
    }
    let changes_s = changes_s(timeline, machine);
    let mut spent = spent(timeline);
    spent.change_s += changes_s;
    Summary {
        total_s: timeline.total_s() + changes_s,
        spent,
        toolpaths: toolpaths(timeline),
        holes: times.len() as u32,
        holes_per_min: per_min(drilling_s),
        holes_per_min_sequential: per_min(sequential_s),
        median_hole_s,
        longest_hole_s: times.last().copied().map_or(0.0, seconds),
        steps,
    }
}

/// Total time of the machine's own tool changes, s; the first from an empty spindle. Zero if the user changes
/// tools.
fn changes_s(timeline: &Timeline, machine: &Machine) -> f64 {
    let bits = timeline.moves.iter().filter_map(|planned| match planned.effect {
        Switching::AwaitBit { bit } => Some(bit),
        _ => None,
    });
    let each = magazine::changes_ticks(machine, None, bits);
    each.into_iter().sum::<u64>() as f64 / TICK_HZ as f64
}

fn spent(timeline: &Timeline) -> Spent {
    let mut spent = Spent::default();
    for planned in &timeline.moves {
        let place = match (planned.mark, planned.stage) {
            (Mark::Hole(_), _) => &mut spent.drill_s,
            (Mark::Toolpath(_), Stage::Mill | Stage::Drill) => &mut spent.mill_s,
            (Mark::Toolpath(_), _) => &mut spent.between_s,
            (Mark::ToolChange(_), _) => &mut spent.change_s,
            (Mark::Prepare | Mark::Finish, _) => &mut spent.other_s,
        };
        let takes_s = planned.duration_ticks as f64 / TICK_HZ as f64;
        *place += takes_s;
        if matches!((planned.mark, planned.stage), (Mark::Toolpath(_), Stage::Drill)) {
            spent.plunge_s += takes_s;
        }
    }
    spent
}

/// Time of each bit of a program, s, from its tool change on. Time before the first change counts for the
/// first bit.
pub fn time_by_bit_s(timeline: &Timeline) -> Vec<f64> {
    let mut times = BitTimes::default();
    times.add(&timeline.moves);
    times.seconds()
}

/// Time of a program and of each of its bits, s. Plans one leg at a time, to save memory.
pub fn times_s(program: &Program, machine: &Machine) -> Result<(f64, Vec<f64>), Diagnostic> {
    let mut times = BitTimes::default();
    each_leg(program, machine, |moves| {
        times.add(moves);
        Ok(())
    })?;
    let total: u64 = times.ticks.iter().sum();
    Ok((total as f64 / TICK_HZ as f64, times.seconds()))
}

#[derive(Default)]
struct BitTimes {
    ticks: Vec<u64>,
    bit: usize,
}

impl BitTimes {
    fn add(&mut self, moves: &[Move]) {
        for planned in moves {
            if let Mark::ToolChange(bit) = planned.mark {
                self.bit = bit as usize;
            }
            if self.ticks.len() <= self.bit {
                self.ticks.resize(self.bit + 1, 0);
            }
            if let Some(ticks) = self.ticks.get_mut(self.bit) {
                *ticks += planned.duration_ticks;
            }
        }
    }

    fn seconds(&self) -> Vec<f64> {
        self.ticks.iter().map(|ticks| *ticks as f64 / TICK_HZ as f64).collect()
    }
}

fn toolpaths(timeline: &Timeline) -> u32 {
    let moves = timeline.moves.iter().filter(|planned| matches!(planned.mark, Mark::Toolpath(_)));
    let mut legs: Vec<u32> = moves.map(|planned| planned.leg).collect();
    legs.dedup();
    u32::try_from(legs.len()).unwrap_or(u32::MAX)
}

/// Time of a move if its parts were sequential, with XY settled before the spindles go down, s.
fn alone_s(planned: &Move, machine: &Machine) -> f64 {
    let duration_s = planned.duration_ticks as f64 / TICK_HZ as f64;
    if planned.stage != Stage::NextHole {
        return duration_s;
    }
    // Spindles that move in one direction do so at one time.
    let longest_s = |stage: Stage| {
        let parts = planned.parts.iter().filter(|part| part.stage == stage);
        parts.map(AxisMove::duration_s).fold(0.0, f64::max)
    };
    let travel = planned.parts.iter().filter(|part| part.stage == Stage::Travel);
    let travel_s: f64 = travel.map(AxisMove::duration_s).sum();
    let parts_s = longest_s(Stage::Retract) + travel_s + longest_s(Stage::Drill);
    let end_s = planned.parts.iter().map(AxisMove::end_s).fold(0.0, f64::max);
    let travels = planned.parts.iter().any(|part| part.stage == Stage::Travel);
    let settle_s = if travels { machine.settle_ms * 1e-3 } else { 0.0 };
    parts_s + settle_s + (duration_s - end_s)
}
