//! Compact storage of a stream during a job, with random access to any leg.
//!
//! ```text
//! bytes     leg 0 │ leg 1 │ leg 2 │ …        a board of 100,000 holes: 1/50 of the size of its runs
//!                 ▲ leg(1) ─▶ segments
//! strokes   a, b, c                          spindle runs that repeat with every hole, each stored once
//! ```
//!
//! The whole stream is never in memory.

use super::compact::{put, put_segment, take, take_segment};
use super::make::leg_by_leg;
use super::stream::{Run, Segment};
use crate::diagnostic::Diagnostic;
use crate::job::{Program, Switching};
use crate::machine::{Machine, Steps};
use std::ops::Range;

/// Most stored strokes. A bit has two.
const MOST_STROKES: usize = 64;

/// Fewer runs in one direction are not worth storing as a stroke.
const SHORTEST_STROKE: usize = 8;

/// A whole program as step times, compact.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Packed {
    start: Steps,
    bytes: Vec<u8>,
    /// Spindle runs in one direction, without the first run: that sets the start time.
    strokes: Vec<Vec<Run>>,
    legs: Vec<Place>,
    effects: Vec<(usize, Switching)>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Place {
    /// Bytes, and segments, up to the end of the leg.
    bytes: usize,
    segments: usize,
    end: Steps,
    ticks: u64,
}

impl Packed {
    /// The stream of `program` on `machine`, equal to [`super::stream_of`].
    pub fn of(program: &Program, machine: &Machine) -> Result<Self, Diagnostic> {
        let mut packed = Self { legs: Vec::with_capacity(program.legs.len()), ..Self::default() };
        packed.start = leg_by_leg(program, machine, |segments| packed.push(segments))?;
        // Legs without motion at the start of the program end at the start position.
        let start = packed.start;
        packed.legs.iter_mut().take_while(|leg| leg.segments == 0).for_each(|leg| leg.end = start);
        packed.bytes.shrink_to_fit();
        Ok(packed)
    }

    fn push(&mut self, segments: &[Segment]) {
        let before = self.count();
        for (index, segment) in segments.iter().enumerate() {
            self.put(segment);
            if segment.effect != Switching::None {
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

    /// Appends a segment without its strokes, preceded by the strokes and their positions among its runs.
    fn put(&mut self, segment: &Segment) {
        let (mut runs, mut strokes) = (Vec::with_capacity(segment.runs.len()), Vec::new());
        for way in segment.runs.chunk_by(|a, b| (a.axes, a.forward) == (b.axes, b.forward)) {
            match way.split_first().and_then(|(first, stroke)| Some((*first, self.stroke(stroke)?))) {
                Some((first, stroke)) => {
                    runs.push(first);
                    strokes.push((runs.len(), stroke));
                }
                None => runs.extend_from_slice(way),
            }
        }
        put(strokes.len() as u64, &mut self.bytes);
        for (after, stroke) in strokes {
            put(after as u64, &mut self.bytes);
            put(stroke as u64, &mut self.bytes);
        }
        let Segment { leg, mark, stage, duration_ticks, effect, gate, end, .. } = *segment;
        put_segment(&Segment { leg, mark, stage, duration_ticks, runs, effect, gate, end }, &mut self.bytes);
    }

    /// Index of the stroke with these `runs`; none if they are no stroke, or if too many are stored.
    fn stroke(&mut self, runs: &[Run]) -> Option<usize> {
        if runs.len() < SHORTEST_STROKE || runs[0].axes & 0b11 != 0 {
            return None;
        }
        let known = self.strokes.iter().position(|stroke| stroke == runs);
        if known.is_none() && self.strokes.len() < MOST_STROKES {
            self.strokes.push(runs.to_vec());
            return Some(self.strokes.len() - 1);
        }
        known
    }

    /// Position of all axes before the first segment, in steps from the work zero.
    pub fn start(&self) -> Steps {
        self.start
    }

    /// Number of segments.
    pub fn count(&self) -> usize {
        self.legs.last().map_or(0, |leg| leg.segments)
    }

    pub fn legs(&self) -> usize {
        self.legs.len()
    }

    /// Indices of the segments of leg `leg`; an empty range at the end for a missing leg.
    pub fn range(&self, leg: usize) -> Range<usize> {
        let before = leg
            .checked_sub(1)
            .map_or(0, |before| self.legs.get(before).map_or(self.count(), |leg| leg.segments));
        before..self.legs.get(leg).map_or(before, |leg| leg.segments)
    }

    /// Position of all axes before leg `leg`, in steps from the work zero; the final one for a missing leg.
    pub fn before(&self, leg: usize) -> Steps {
        self.legs[..leg.min(self.legs.len())].last().map_or(self.start, |before| before.end)
    }

    pub fn ticks(&self, leg: usize) -> u64 {
        self.legs.get(leg).map_or(0, |leg| leg.ticks)
    }

    /// Switching effects of all segments before `first`, in order.
    pub fn effects_before(&self, first: usize) -> impl Iterator<Item = Switching> {
        self.effects.iter().take_while(move |(index, _)| *index < first).map(|(_, effect)| *effect)
    }

    /// The segments of leg `leg`; empty for a missing leg.
    pub fn leg(&self, leg: usize) -> Vec<Segment> {
        let Some(place) = self.legs.get(leg) else { return Vec::new() };
        let begin =
            leg.checked_sub(1).and_then(|before| self.legs.get(before)).map_or(0, |before| before.bytes);
        let bytes = self.bytes.get(begin..place.bytes).unwrap_or_default();
        Segments { bytes, strokes: &self.strokes }.collect()
    }

    pub fn segments(&self) -> impl Iterator<Item = Segment> {
        Segments { bytes: &self.bytes, strokes: &self.strokes }
    }
}

struct Segments<'a> {
    bytes: &'a [u8],
    strokes: &'a [Vec<Run>],
}

impl Segments<'_> {
    /// The next segment; none at the end of the bytes.
    fn take(&mut self) -> Option<Segment> {
        let count = take(&mut self.bytes)?;
        let mut number = || usize::try_from(take(&mut self.bytes)?).ok();
        let mut strokes = Vec::with_capacity(count as usize);
        for _ in 0..count {
            strokes.push((number()?, self.strokes.get(number()?)?));
        }
        let mut segment = take_segment(&mut self.bytes)?;
        if strokes.is_empty() {
            return Some(segment);
        }
        let all = segment.runs.len() + strokes.iter().map(|(_, stroke)| stroke.len()).sum::<usize>();
        let own = std::mem::replace(&mut segment.runs, Vec::with_capacity(all));
        let mut done = 0;
        for (after, stroke) in strokes {
            segment.runs.extend_from_slice(own.get(done..after)?);
            segment.runs.extend_from_slice(stroke);
            done = after;
        }
        segment.runs.extend_from_slice(own.get(done..)?);
        Some(segment)
    }
}

impl Iterator for Segments<'_> {
    type Item = Segment;

    fn next(&mut self) -> Option<Segment> {
        self.take()
    }
}
