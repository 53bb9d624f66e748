//! The running job: its progress, and which segments of its current leg the executor has.

use super::length::AskedTool;
use crate::journal::Progress;
use crate::prepare::Prepared;
use annulus_core::job::worn::{self, Wear};
use annulus_core::machine::Steps;
use annulus_core::steps::{Segment, Switching};
use std::sync::Arc;
use std::time::Duration;

pub(crate) struct Work {
    pub(crate) job: Arc<Prepared>,
    /// The job at another feed, from the next stop on.
    pub(crate) anew: Option<Arc<Prepared>>,
    /// The requested feed override, percent of the original feed.
    pub(crate) percent: u8,
    /// The first leg of this run.
    pub(crate) first: usize,
    pub(crate) leg: usize,
    /// Its segments, and how many were given.
    pub(super) segments: Vec<Segment>,
    pub(super) given: usize,
    pub(crate) holes: u32,
    pub(crate) toolpaths: u32,
    /// Start time, by the host's clock.
    pub(crate) started: Duration,
    pub(crate) bit: Option<u32>,
    pub(crate) wears: Vec<(u32, Wear)>,
    /// The tool is worn: another one is requested before the next leg.
    pub(crate) is_worn: bool,
    /// Position at which a sensor ended the drill cycle of this leg.
    pub(super) stop: Option<Steps>,
    /// A resumed job requests its tool before the first leg, unless that leg does.
    pub(super) confirm_bit: bool,
    /// The tool that the user is asked for, and where the job continues.
    pub(crate) asked: Option<AskedTool>,
    pub(super) has_asked: bool,
    /// The tool that was inserted before the leg that requests it.
    pub(super) is_in: Option<u32>,
    /// STOP was pressed, even if the job was complete: no move may follow.
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
        let (asked, has_asked, is_in) = (None, false, None);
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
            asked,
            has_asked,
            is_in,
            was_stopped,
        }
    }

    /// Sets the start time, which may be long after the request.
    pub(crate) fn begins(&mut self, now: Duration) {
        self.started = now;
    }

    pub(crate) fn unpack(&mut self) {
        (self.segments, self.given) = (self.job.stream.leg(self.leg), 0);
    }

    pub(super) fn next(&self) -> Option<&Segment> {
        self.segments.get(self.given)
    }

    pub(crate) fn is_at_start(&self) -> bool {
        self.given == 0
    }

    pub(crate) fn wear(&self) -> Wear {
        self.wears.get(self.leg).map(|(_, wear)| *wear).unwrap_or_default()
    }

    pub(crate) fn awaited(&self) -> Option<u32> {
        self.next()
            .and_then(|next| if let Switching::AwaitBit { bit } = next.effect { Some(bit) } else { None })
    }

    pub(super) fn rpm(&self) -> u32 {
        self.job.in_force(self.job.stream.range(self.leg).start + self.given).1
    }

    pub(crate) fn progress(&self) -> Progress {
        let leg = u32::try_from(self.leg).unwrap_or(u32::MAX);
        Progress { done: leg, begun: leg, holes: self.holes, toolpaths: self.toolpaths }
    }
}
