//! How an axis is driven: by planned profiles, or by the integer tables of Arendt's laboratory drill.
//!
//! ```text
//! Dynamics   state         0   1   2   3        left half of the machine's table is the same, mirrored
//!            period        7   4   2   1        a step every n-th interrupt
//!            enter             1   2   3        faster when the remaining distance is above this
//!            leave             2   3   5        slower when it is below this
//!
//! PhaseTable column  1  2  3  4 …               one byte a step: bits 0–3 the windings' halves (5 V),
//!            byte   25 05 05 49 …               bits 5 and 6 the forcing voltage (24 V) of windings 1 and 2
//! ```
//!
//! Plain data with its units; what the tables do is in `steps`. Does not know time.

/// How the step times of a machine come about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriveKind {
    /// From profiles in closed form.
    Planned,
    /// From the interrupt-driven table of dynamics, each axis by itself.
    Table,
}

/// The table of dynamics (Arendt, table 2), stored for one direction: the other is its mirror image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Dynamics {
    /// States 0 … S: a step every so many interrupts.
    pub period: Vec<u32>,
    /// States 1 … S: entered from the slower side while the remaining distance, in steps, is above this.
    pub enter: Vec<u32>,
    /// States 1 … S: left towards the slower side when the remaining distance is below this.
    pub leave: Vec<u32>,
}

impl Dynamics {
    /// The table as printed in Arendt's paper: states −3 … 3.
    pub fn arendt() -> Self {
        Self { period: vec![7, 4, 2, 1], enter: vec![1, 2, 3], leave: vec![2, 3, 5] }
    }
}

/// The phases of one motor, one byte a column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PhaseTable {
    /// 1 … 64 columns, repeated without end. Bits 0 and 1: halves of winding 1; bits 2 and 3: halves of winding 2; bits 5
    /// and 6: forcing voltage of windings 1 and 2.
    pub columns: Vec<u8>,
}

impl PhaseTable {
    /// The twelve steps of Arendt's paper, with forcing bits as printed for running forward.
    pub fn arendt() -> Self {
        Self { columns: vec![0x25, 0x05, 0x05, 0x49, 0x09, 0x09, 0x2A, 0x0A, 0x0A, 0x46, 0x06, 0x06] }
    }

    /// Full steps with two phases on: what drives with their own translator are shown as.
    pub fn full_step() -> Self {
        Self { columns: vec![0x05, 0x09, 0x0A, 0x06] }
    }
}

/// Which profile a move is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// Constant acceleration.
    Linear,
    /// Constant jerk, seven phases.
    SCurve,
    /// By length: the S-curve where it reaches the speed, else linear (Ma & You).
    Automatic,
    /// Jerk by a power of time, eleven phases.
    Power,
}

/// The laws of motion of a machine, and what look-ahead may do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionLaws {
    /// X and Y.
    pub plane: Law,
    /// Z downwards.
    pub down: Law,
    /// Z upwards.
    pub up: Law,
    /// Order α of the power law, above 0, at most 2.
    pub order: f64,
    /// Share of the acceleration that a path of many pieces leaves unused, kept for hold and override, 0 … 0.5.
    pub reserve: f64,
    /// How far a corner may be cut in thought when its speed is chosen, mm; the path itself is exact.
    pub corner_mm: f64,
}

/// Limits of Z on its way down; those of its axis are for the way up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DownLimits {
    /// mm/s.
    pub max_speed_mm_per_s: f64,
    /// mm/s².
    pub max_acceleration_mm_per_s2: f64,
    /// mm/s³.
    pub max_jerk_mm_per_s3: f64,
}

/// How Z and the plane move together (`docs/motion-profiles.md` C2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// Whether they do. Else one waits for the other.
    pub on: bool,
    /// Height of the tip over the board from which on the plane may move, mm.
    pub clear_mm: f64,
    /// Time that a signal between plane and spindle takes, ms.
    pub latency_ms: f64,
    /// How long before the tip touches the board the plane must have settled, ms.
    pub margin_ms: f64,
    /// Least rest of the spindle at the top, ms.
    pub dwell_top_ms: f64,
}
