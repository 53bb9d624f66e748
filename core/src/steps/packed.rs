//! A stream as it is kept while a job is in work: in few bytes, any leg of which is had at once.
//!
//! ```text
//! bytes   leg 0 │ leg 1 │ leg 2 │ …          a board of 100,000 holes: a tenth of what its runs would take
//!               ▲ leg(1) ─▶ segments
//! ```
//!
//! Comes in: a program, a machine. Goes out: its segments, leg by leg or one after the other. The stream is never there as a
//! whole. Does not know how segments are made nor what they are for.

use super::compact::{put_segment, take_segment};
use super::make::leg_by_leg;
use super::stream::Segment;
use crate::job::{Effect, Program};
use crate::machine::{Machine, Steps};
use crate::remark::Remark;
use std::ops::Range;

/// A whole program as step times, in few bytes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Packed {
    start: Steps,
    bytes: Vec<u8>,
    legs: Vec<Place>,
    /// Segments that switch something, and what.
    effects: Vec<(usize, Effect)>,
}

/// A leg among the others.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Place {
    /// How many bytes, and how many segments, there are up to its end.
    bytes: usize,
    segments: usize,
    /// Where all axes stand at its end.
    end: Steps,
    /// How long it takes.
    ticks: u64,
}

impl Packed {
    /// The stream of `program` on `machine`: that of [`super::stream_of`].
    pub fn of(program: &Program, machine: &Machine) -> Result<Self, Remark> {
        let mut packed = Self { legs: Vec::with_capacity(program.legs.len()), ..Self::default() };
        packed.start = leg_by_leg(program, machine, |segments| packed.push(segments))?;
        // A leg before the first that moves ends where everything starts.
        let start = packed.start;
        packed.legs.iter_mut().take_while(|leg| leg.segments == 0).for_each(|leg| leg.end = start);
        packed.bytes.shrink_to_fit();
        Ok(packed)
    }

    fn push(&mut self, segments: &[Segment]) {
        let before = self.count();
        for (index, segment) in segments.iter().enumerate() {
            put_segment(segment, &mut self.bytes);
            if segment.effect != Effect::None {
                self.effects.push((before + index, segment.effect));
            }
        }
        let end = segments.last().map(|last| last.end).or(self.legs.last().map(|leg| leg.end));
        self.legs.push(Place {
            bytes: self.bytes.len(),
            segments: before + segments.len(),
            end: end.unwrap_or_default(),
            ticks: segments.iter().map(|segment| segment.duration_ticks).sum(),
        });
    }

    /// Where all axes stand before the first segment, in steps from the work zero.
    pub fn start(&self) -> Steps {
        self.start
    }

    /// How many segments there are.
    pub fn count(&self) -> usize {
        self.legs.last().map_or(0, |leg| leg.segments)
    }

    /// How many legs there are.
    pub fn legs(&self) -> usize {
        self.legs.len()
    }

    /// The segments of leg `leg`, counted from the first of the stream; none, at the end, beyond the last leg.
    pub fn range(&self, leg: usize) -> Range<usize> {
        let before = leg
            .checked_sub(1)
            .map_or(0, |before| self.legs.get(before).map_or(self.count(), |leg| leg.segments));
        before..self.legs.get(leg).map_or(before, |leg| leg.segments)
    }

    /// Where all axes stand before leg `leg`, in steps from the work zero; beyond the last, at the end.
    pub fn before(&self, leg: usize) -> Steps {
        self.legs[..leg.min(self.legs.len())].last().map_or(self.start, |before| before.end)
    }

    /// How long leg `leg` takes, in ticks.
    pub fn ticks(&self, leg: usize) -> u64 {
        self.legs.get(leg).map_or(0, |leg| leg.ticks)
    }

    /// What the segments before segment `first` switch, in order.
    pub fn effects_before(&self, first: usize) -> impl Iterator<Item = Effect> {
        self.effects.iter().take_while(move |(index, _)| *index < first).map(|(_, effect)| *effect)
    }

    /// The segments of leg `leg`; none beyond the last.
    pub fn leg(&self, leg: usize) -> Vec<Segment> {
        let Some(place) = self.legs.get(leg) else { return Vec::new() };
        let begin =
            leg.checked_sub(1).and_then(|before| self.legs.get(before)).map_or(0, |before| before.bytes);
        Segments(self.bytes.get(begin..place.bytes).unwrap_or_default()).collect()
    }

    /// All segments, one after the other.
    pub fn segments(&self) -> impl Iterator<Item = Segment> {
        Segments(&self.bytes)
    }
}

/// Segments, one after the other.
struct Segments<'a>(&'a [u8]);

impl Iterator for Segments<'_> {
    type Item = Segment;

    fn next(&mut self) -> Option<Segment> {
        if self.0.is_empty() { None } else { take_segment(&mut self.0) }
    }
}
