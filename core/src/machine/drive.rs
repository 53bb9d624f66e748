//! Drive of an axis: planned profiles, or the integer tables of Arendt's laboratory drill.
//!
//! ```text
//! Dynamics   state         0   1   2   3        the left half of the machine's table mirrors this
//!            period        7   4   2   1        a step every n-th interrupt
//!            enter             1   2   3        faster if the remaining distance is above this
//!            leave             2   3   5        slower if it is below this
//!
//! PhaseTable column  1  2  3  4 …               one byte per step: bits 0–3 the winding halves (5 V),
//!            byte   25 05 05 49 …               bits 5 and 6 the forcing voltage (24 V) of windings 1 and 2
//! ```

use serde::Serialize;

/// Source of a machine's step times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriveKind {
    /// Profiles in closed form.
    Planned,
    /// The interrupt-driven table of dynamics, each axis separately.
    Table,
}

/// The table of dynamics (Arendt, table 2), for one direction; the other is its mirror image.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Dynamics {
    /// States 0 … S: interrupts per step.
    pub period: Vec<u32>,
    /// States 1 … S: entered from the slower state while the remaining distance, in steps, is above this.
    pub enter: Vec<u32>,
    /// States 1 … S: left to the slower state if the remaining distance is below this.
    pub leave: Vec<u32>,
}

impl Dynamics {
    /// The table as printed in Arendt's paper: states −3 … 3.
    pub fn arendt() -> Self {
        Self { period: vec![7, 4, 2, 1], enter: vec![1, 2, 3], leave: vec![2, 3, 5] }
    }
}

/// The phase bytes of one motor, one per step.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PhaseTable {
    /// 1 … 64 columns, repeated cyclically. Bits 0 and 1: halves of winding 1; bits 2 and 3: halves of
    /// winding 2; bits 5 and 6: forcing voltage of windings 1 and 2.
    pub columns: Vec<u8>,
}

impl PhaseTable {
    /// The twelve steps of Arendt's paper, with forcing bits as printed for the forward direction.
    pub fn arendt() -> Self {
        Self { columns: vec![0x25, 0x05, 0x05, 0x49, 0x09, 0x09, 0x2A, 0x0A, 0x0A, 0x46, 0x06, 0x06] }
    }

    /// Full steps with two phases on, as shown for drives with their own translator.
    pub fn full_step() -> Self {
        Self { columns: vec![0x05, 0x09, 0x0A, 0x06] }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    Linear,
    /// Constant jerk, seven phases.
    SCurve,
    /// By length: the S-curve if it reaches the speed, else linear (Ma & You).
    Automatic,
    /// Jerk as a power of time, eleven phases.
    Power,
}

/// Motion profiles of a machine, and limits of look-ahead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionLaws {
    pub plane: Law,
    pub down: Law,
    pub up: Law,
    /// Order α of the power law, above 0, at most 2.
    pub order: f64,
    /// Share of the acceleration reserved for hold and override on paths of many pieces, 0 … 0.5.
    pub reserve: f64,
    /// Assumed deviation in a corner, which sets its speed, mm; the path itself is exact.
    pub corner_mm: f64,
}

/// Limits of Z on its way down; the axis itself has those for the way up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DownLimits {
    pub max_speed_mm_per_s: f64,
    pub max_acceleration_mm_per_s2: f64,
    pub max_jerk_mm_per_s3: f64,
}

/// Overlap of Z and XY moves (`docs/motion-profiles.md` C2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// If false, one waits for the other.
    pub on: bool,
    /// Height of the tip over the board from which XY may move, mm.
    pub clear_mm: f64,
    pub latency_ms: f64,
    /// XY must have settled this long before the tip touches the board, ms.
    pub margin_ms: f64,
    pub dwell_top_ms: f64,
}
