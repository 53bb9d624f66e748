//! The executor's own record: its final position, the reason for its end, and its last steps.
//!
//! ```text
//! {"at_ms":1795300000000,"event":"started", …}
//! {"at_ms":1795300004711,"event":"bridge_gone","position":[311,0,0,…],"steps":[[91204100,1,1],[91226400,1,1],…]}
//!                                                                       tick of 0.1 µs, axes, those of them forward
//! ```
//!
//! Nothing is written during motion: the last steps are collected in memory.

use crate::own;
use annulus_core::machine::{AXES, Steps};
use annulus_core::pass_pins_on;
use annulus_core::pins::{AxisSet, Pins};
use serde_json::json;
use std::collections::VecDeque;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{SystemTime, UNIX_EPOCH};

/// Number of steps in memory: more than any ramp down has.
const KEPT: usize = 4_096;

/// Size in bytes above which the record is started again.
const LONGEST: u64 = 4 * 1024 * 1024;

pub(super) type Why = Arc<Mutex<&'static str>>;

/// Corrections of the axes' counts since the start: homing defines zero.
pub(super) type Offsets = Arc<[AtomicI64; AXES]>;

pub(super) struct Recorded<P> {
    pins: P,
    file: File,
    counted: Steps,
    offsets: Offsets,
    steps: VecDeque<(u64, AxisSet, AxisSet)>,
    why: Why,
}

impl<P: Pins> Recorded<P> {
    pub(super) fn new(pins: P, path: &Path, offsets: Offsets, why: Why) -> io::Result<Self> {
        // A record that is too long starts again, so it cannot fill the disk.
        let long = std::fs::metadata(path).is_ok_and(|file| file.len() > LONGEST);
        let mut options = OpenOptions::new();
        let file = own::open(
            path,
            if long { options.write(true).truncate(true) } else { options.create(true).append(true) },
        )?;
        let steps = VecDeque::with_capacity(KEPT);
        let mut recorded = Self { pins, file, counted: Steps::default(), offsets, steps, why };
        recorded.write("started");
        Ok(recorded)
    }

    fn write(&mut self, event: &str) {
        let at_ms = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_millis() as u64);
        // The host may correct the position; the counted steps alone do not know that.
        let offset = |axis: usize| self.offsets[axis].load(Ordering::SeqCst);
        let position: Steps = std::array::from_fn(|axis| self.counted[axis] + offset(axis));
        let line = json!({ "at_ms": at_ms, "event": event, "position": position, "steps": self.steps });
        // A full disk must not prevent making the outputs safe.
        let _ = self.file.write_all(format!("{line}\n").as_bytes()).and_then(|()| self.file.sync_data());
    }
}

impl<P: Pins> Pins for Recorded<P> {
    pass_pins_on!(spindle, output, spindle_state, inputs, rest, due, bit, stock, ahead, attend);

    fn step(&mut self, at_tick: u64, axes: AxisSet, forward: AxisSet) {
        self.pins.step(at_tick, axes, forward);
        for (axis, place) in self.counted.iter_mut().enumerate().take(AXES) {
            if axes >> axis & 1 == 1 {
                *place += if forward >> axis & 1 == 1 { 1 } else { -1 };
            }
        }
        if self.steps.len() == KEPT {
            self.steps.pop_front();
        }
        self.steps.push_back((at_tick, axes, forward));
    }

    fn safe(&mut self) {
        self.pins.safe();
        let why = self.why.lock().map_or("unknown", |why| *why);
        self.write(why);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::pins::{Recorder, Written};

    #[test]
    fn last_record_line_has_the_position_and_last_steps() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("executor.log");
        for life in 0..2 {
            let why = Why::new(Mutex::new("finished"));
            let offsets = Offsets::default();
            let mut pins =
                Recorded::new(Recorder::default(), &path, Arc::clone(&offsets), Arc::clone(&why)).unwrap();
            for tick in 0..5_000 {
                pins.step(tick * 10, 0b101, 0b001);
            }
            *why.lock().unwrap() = "bridge_gone";
            offsets[1].store(-7, Ordering::SeqCst);
            pins.safe();
            assert_eq!(pins.pins.written.last(), Some(&Written::Safe));
            let text = std::fs::read_to_string(&path).unwrap();
            let lines: Vec<serde_json::Value> =
                text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
            assert_eq!(lines.len(), 2 * (life + 1), "appended");
            let last = lines.last().unwrap();
            assert_eq!((&last["event"], &last["position"][0]), (&"bridge_gone".into(), &5_000.into()));
            assert_eq!((&last["position"][1], &last["position"][2]), (&json!(-7), &json!(-5_000)));
            let steps = last["steps"].as_array().unwrap();
            assert_eq!((steps.len(), &steps[KEPT - 1]), (KEPT, &json!([49_990, 5, 1])));
        }
    }
}
