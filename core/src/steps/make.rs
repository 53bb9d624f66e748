//! A timeline as a step stream.
//!
//! ```text
//! steps ^          3 ┌──      the plan is the smooth line, the motor the stairs:
//!       |        2 ┌─┘        step k comes when the plan crosses k − ½,
//!       |     1 ┌──┘          so the motor is never more than half a step away
//!       |  0 ───┘
//!       +-----------------> time
//! ```
//!
//! A plan goes from whole step to whole step, so all steps are done when it ends, and the first and last come half a
//! step's time inside. Axes of one straight line share its path: step k of n is at (k − ½)/n of the length.
//!
//! Comes in: a timeline, a machine. Goes out: a [`StepStream`]. Does not know programs.

use super::fit::{Fitter, Track};
use super::stream::{Run, Segment, StepStream, TICK_HZ};
use crate::machine::{Machine, Steps};
use crate::motion::profile::{Inverse, Profile};
use crate::motion::{Move, Timeline};
use crate::remark::{Remark, Weight};

/// The most runs of a stream. A board of 100,000 holes needs about a tenth of them.
const MOST_RUNS: usize = 100_000_000;

/// The whole timeline as a stream.
pub fn stream(timeline: &Timeline, machine: &Machine) -> Result<StepStream, Remark> {
    let mut segments = Vec::with_capacity(timeline.moves.len());
    let mut maker = Maker::new(machine);
    let mut runs = 0;
    for planned in &timeline.moves {
        let segment = maker.segment(planned);
        runs += segment.runs.len();
        if runs > MOST_RUNS {
            return Err(Remark::new(Weight::Loss, "motion.stream_too_long").with("runs", MOST_RUNS));
        }
        segments.push(segment);
    }
    Ok(StepStream { start: timeline.start, segments })
}

/// One move as a segment.
pub fn segment(planned: &Move, machine: &Machine) -> Segment {
    Maker::new(machine).segment(planned)
}

/// Makes segments, one after the other.
struct Maker {
    fitter: Fitter,
    least_interval: i64,
    /// The runs of the last different moves of Z: every stroke of a board is the same few moves.
    known: [Option<Known>; 4],
    oldest: usize,
}

/// A move and its runs.
struct Known {
    way: Steps,
    lead_s: f64,
    profile: Profile,
    runs: Vec<Run>,
}

impl Maker {
    fn new(machine: &Machine) -> Self {
        let least_interval = TICK_HZ.div_ceil(u64::from(machine.max_step_hz.max(1))) as i64;
        Self { fitter: Fitter::default(), least_interval, known: [const { None }; 4], oldest: 0 }
    }

    fn segment(&mut self, planned: &Move) -> Segment {
        Segment {
            leg: planned.leg,
            mark: planned.mark,
            stage: planned.stage,
            duration_ticks: planned.duration_ticks,
            runs: self.runs(planned),
            effect: planned.effect,
            gate: planned.gate,
            end: planned.to,
        }
    }

    fn runs(&mut self, planned: &Move) -> Vec<Run> {
        let way: Steps = std::array::from_fn(|axis| planned.to[axis] - planned.from[axis]);
        let (lead_s, profile) = (planned.lead_s, planned.profile);
        let same = |known: &&Known| known.way == way && known.lead_s == lead_s && known.profile == profile;
        if let Some(known) = self.known.iter().flatten().find(same) {
            return known.runs.clone();
        }
        let mut runs = Vec::new();
        let inverse = Inverse::of(&profile);
        let lead_ticks = lead_s * TICK_HZ as f64;
        for (axis, way) in (0..).zip(way) {
            let count = way.unsigned_abs();
            let step_mm = profile.length_mm / count.max(1) as f64;
            let time_of =
                |step: u64| lead_ticks + inverse.time_at((step as f64 - 0.5) * step_mm) * TICK_HZ as f64;
            let track = Track { axis, forward: way > 0, count, least_interval: self.least_interval };
            self.fitter.fit(track, time_of, &mut runs);
        }
        let in_plane = way.iter().take(2).any(|steps| *steps != 0);
        if let Some(place) = self.known.get_mut(self.oldest).filter(|_| !in_plane) {
            *place = Some(Known { way, lead_s, profile, runs: runs.clone() });
            self.oldest = (self.oldest + 1) % self.known.len();
        }
        runs
    }
}
