//! The job in work: how far it is, and what of the leg in work is given to the executor.
//!
//! Comes in: a job that was checked, the leg to begin with. Goes out: segments to come, the bit that is waited for, what is done. Does not
//! know the executor.

use crate::journal::Progress;
use crate::prepare::Prepared;
use annulus_core::job::worn::{self, Wear};
use annulus_core::machine::Steps;
use annulus_core::steps::{Segment, Switching};
use std::sync::Arc;
use std::time::Duration;

/// The job in work.
pub(crate) struct Work {
    pub(crate) job: Arc<Prepared>,
    /// The same job at other feeds, from the next rest on.
    pub(crate) anew: Option<Arc<Prepared>>,
    /// The feed override that is wanted, percent of the feed it came with.
    pub(crate) percent: u8,
    /// The leg that this run began with.
    pub(crate) first: usize,
    /// The leg in work or to come.
    pub(crate) leg: usize,
    /// Its segments, and how many of them were given.
    pub(super) segments: Vec<Segment>,
    pub(super) given: usize,
    /// Holes drilled.
    pub(crate) holes: u32,
    /// Toolpaths milled.
    pub(crate) toolpaths: u32,
    /// When it began, by the clock outside.
    pub(crate) started: Duration,
    /// Bit in the spindle.
    pub(crate) bit: Option<u32>,
    /// What each leg wears its tool by.
    pub(crate) wears: Vec<(u32, Wear)>,
    /// The life of that tool is over: another one is asked for before the leg to come.
    pub(crate) is_worn: bool,
    /// Where a sensor ended the stroke of this leg.
    pub(super) stop: Option<Steps>,
    /// A job that is taken up asks for its bit before the first leg, unless that leg does.
    pub(super) confirm_bit: bool,
    /// Somebody stopped it, even if it was done by then: nothing moves behind it.
    pub(super) was_stopped: bool,
}

impl Work {
    pub(crate) fn new(job: Arc<Prepared>, leg: usize, percent: u8) -> Self {
        let (bit, _) = job.in_force(job.stream.range(leg).start);
        let (holes, toolpaths) = job.done_before(leg);
        let segments = job.stream.leg(leg);
        let asks = segments.iter().any(|next| matches!(next.effect, Switching::AwaitBit { .. }));
        let confirm_bit = bit.is_some() && !asks;
        let (anew, started, stop, given, first) = (None, Duration::ZERO, None, 0, leg);
        let (wears, is_worn, was_stopped) = (worn::by_leg(&job.program), false, false);
        Self {
            job,
            wears,
            is_worn,
            anew,
            percent,
            first,
            leg,
            segments,
            given,
            holes,
            toolpaths,
            started,
            bit,
            stop,
            confirm_bit,
            was_stopped,
        }
    }

    /// It begins now, however long ago it was asked for.
    pub(crate) fn begins(&mut self, now: Duration) {
        self.started = now;
    }

    /// Begins with the leg: its segments as the plan in force has them.
    pub(crate) fn unpack(&mut self) {
        (self.segments, self.given) = (self.job.stream.leg(self.leg), 0);
    }

    /// The next segment of the leg.
    pub(super) fn next(&self) -> Option<&Segment> {
        self.segments.get(self.given)
    }

    /// Whether nothing of the leg was given yet.
    pub(crate) fn is_at_start(&self) -> bool {
        self.given == 0
    }

    /// What the leg wears its tool by.
    pub(crate) fn wear(&self) -> Wear {
        self.wears.get(self.leg).map(|(_, wear)| *wear).unwrap_or_default()
    }

    /// The bit that the next segment waits for.
    pub(crate) fn awaited(&self) -> Option<u32> {
        self.next()
            .and_then(|next| if let Switching::AwaitBit { bit } = next.effect { Some(bit) } else { None })
    }

    /// The spindle speed that is in force before the next segment.
    pub(super) fn rpm(&self) -> u32 {
        self.job.in_force(self.job.stream.range(self.leg).start + self.given).1
    }

    pub(crate) fn progress(&self) -> Progress {
        let leg = u32::try_from(self.leg).unwrap_or(u32::MAX);
        Progress { done: leg, begun: leg, holes: self.holes, toolpaths: self.toolpaths }
    }
}
