//! The digest of a stream: page and bridge compare it before Start.
//!
//! The canonical encoding has fixed widths and is little-endian, with fields in this order. So 32-bit wasm
//! and 64-bit native code hash identical bytes:
//!
//! ```text
//! "annulus stream 3"  start 8 × i64  segments u64
//! segment: leg u32  mark u8 u32  stage u8  duration u64  effect u8 u32
//!          gate u8 [input u8 deadline u32 otherwise u8]
//!          end 8 × i64  runs u32
//! run:     axes u8  forward u8  interval u32  fraction u16  count u32  change i32
//! ```

use super::stream::{PARTS, Run, Segment, StepStream};
use crate::job::{Gate, Mark, Otherwise, Stage, Switching};
use crate::machine::{Steps, axis_name};
use sha2::{Digest, Sha256};
use std::borrow::Borrow;
use std::fmt::Write;

const HEADER: &[u8; 16] = b"annulus stream 3";

trait Sink {
    fn put(&mut self, bytes: &[u8]);
}

impl Sink for Sha256 {
    fn put(&mut self, bytes: &[u8]) {
        self.update(bytes);
    }
}

impl Sink for u64 {
    fn put(&mut self, bytes: &[u8]) {
        *self += bytes.len() as u64;
    }
}

/// SHA-256 of the canonical encoding, hexadecimal.
pub fn digest(stream: &StepStream) -> String {
    digest_of(&stream.start, stream.segments.len(), &stream.segments)
}

/// Like [`digest`], for a stream that is never in memory as a whole: `count` segments in order.
pub fn digest_of(start: &Steps, count: usize, segments: impl IntoIterator<Item: Borrow<Segment>>) -> String {
    let mut hash = Sha256::new();
    put_head(start, count, &mut hash);
    segments.into_iter().for_each(|segment| put_segment(segment.borrow(), &mut hash));
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

pub fn encoded_len(stream: &StepStream) -> u64 {
    let mut length = 0_u64;
    put_head(&stream.start, stream.segments.len(), &mut length);
    stream.segments.iter().for_each(|segment| put_segment(segment, &mut length));
    length
}

fn put_head(start: &Steps, count: usize, sink: &mut dyn Sink) {
    sink.put(HEADER);
    put_steps(start, sink);
    sink.put(&(count as u64).to_le_bytes());
}

fn put_steps(steps: &Steps, sink: &mut dyn Sink) {
    for step in steps {
        sink.put(&step.to_le_bytes());
    }
}

fn put_segment(segment: &Segment, sink: &mut dyn Sink) {
    sink.put(&segment.leg.to_le_bytes());
    let (tag, value) = match segment.mark {
        Mark::Prepare => (0_u8, 0),
        Mark::ToolChange(bit) => (1, bit),
        Mark::Hole(hole) => (2, hole),
        Mark::Finish => (3, 0),
        Mark::Toolpath(way) => (4, way),
    };
    sink.put(&[tag]);
    sink.put(&value.to_le_bytes());
    sink.put(&[stage_tag(segment.stage)]);
    sink.put(&segment.duration_ticks.to_le_bytes());
    let (tag, value) = match segment.effect {
        Switching::None => (0_u8, 0),
        Switching::Spindle { rpm } => (1, rpm),
        Switching::AwaitBit { bit } => (2, bit),
        Switching::Foot { down } => (3, u32::from(down)),
    };
    sink.put(&[tag]);
    sink.put(&value.to_le_bytes());
    put_gate(segment.gate, sink);
    put_steps(&segment.end, sink);
    sink.put(&(segment.runs.len() as u32).to_le_bytes());
    for run in &segment.runs {
        sink.put(&run_bytes(run));
    }
}

fn put_gate(gate: Option<Gate>, sink: &mut dyn Sink) {
    let Some(gate) = gate else { return sink.put(&[0]) };
    sink.put(&[1, gate.input as u8]);
    sink.put(&gate.deadline_us.to_le_bytes());
    sink.put(&[match gate.otherwise {
        Otherwise::Alarm => 0,
        Otherwise::GoOn => 1,
    }]);
}

const fn stage_tag(stage: Stage) -> u8 {
    match stage {
        Stage::Travel => 0,
        Stage::Approach => 1,
        Stage::Drill => 2,
        Stage::Retract => 3,
        Stage::Dwell => 4,
        Stage::AwaitBit => 5,
        Stage::Seek => 6,
        Stage::BackOff => 7,
        Stage::Locate => 8,
        Stage::Offset => 9,
        Stage::Jog => 10,
        Stage::NextHole => 11,
        Stage::Mill => 12,
        Stage::Touch => 13,
        Stage::Index => 14,
    }
}

pub const RUN_BYTES: usize = 16;

fn run_bytes(run: &Run) -> [u8; RUN_BYTES] {
    let mut bytes = [0; RUN_BYTES];
    bytes[0] = run.axes;
    bytes[1] = u8::from(run.forward);
    bytes[2..6].copy_from_slice(&run.interval.to_le_bytes());
    bytes[6..8].copy_from_slice(&run.fraction.to_le_bytes());
    bytes[8..12].copy_from_slice(&run.count.to_le_bytes());
    bytes[12..16].copy_from_slice(&run.change.to_le_bytes());
    bytes
}

/// The first `most` runs as text, each below its segment, to find where two builds differ.
pub fn trace(stream: &StepStream, most: usize) -> String {
    let mut text = String::new();
    let mut left = most;
    for (index, segment) in stream.segments.iter().enumerate() {
        if left == 0 {
            break;
        }
        let (leg, stage, ticks) = (segment.leg, segment.stage, segment.duration_ticks);
        let _ =
            writeln!(text, "segment {index} leg {leg} {stage:?} {ticks} ticks, end {:?}", &segment.end[..3]);
        for run in segment.runs.iter().take(left) {
            let sign = if run.forward { '+' } else { '-' };
            let (axes, count) = (axes_text(run.axes), run.count);
            let ticks = |parts: i64| parts as f64 / PARTS as f64;
            let (interval, change) = (ticks(run.first_parts()), ticks(i64::from(run.change)));
            let _ = writeln!(text, "  {axes} {sign}{count} interval {interval:.5} change {change:+.5}");
        }
        left -= left.min(segment.runs.len());
    }
    text
}

fn axes_text(axes: u8) -> String {
    let names = (0..crate::machine::AXES).filter(|axis| axes >> axis & 1 == 1).map(axis_name);
    names.collect::<Vec<_>>().join(" ")
}
