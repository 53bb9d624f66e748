//! Machines with common STEP/DIR boards on a PC parallel port: pins, and delays of their inputs.
//!
//! ```text
//! pin         1  2  3  4  5  6  7  8  9 14 16 17       in 15 13 12 10 11
//! bit         8  0  1  2  3  4  5  6  7  9 10 11           0  1  2  3  4
//! breakout    ·  Xs Xd Ys Yd Zs Zd ·  ·  en ·  sp          c  ·  Z  X  Y
//! tb6560      Xd sp Zs Xe Ze Zd Yd ·  ·  Ys Xs Ye          ·  c  Z  X  Y
//! g540        ·  Xs Xd Ys Yd Zs Zd ·  ·  ·  cp sp          ·  c  Z  X  Y
//! s STEP   d DIR   e, en ENABLE   sp spindle   cp charge pump   c contact   X Y Z home switches, to ground
//! ```
//!
//! Boards of one name differ; these are the most common pinouts.

use super::own::hobby_3018;
use crate::machine::wiring::of_inputs;
use crate::machine::{
    Axis, CONTACT_TOLERANCE, DownLimits, HandChange, Machine, Output, Overlap, Parallel, Process, Scale,
    StepDir, UNWIRED, Wiring,
};
use crate::units::Length;

struct Board {
    name: &'static str,
    description: &'static str,
    steps_per_mm: f64,
    max_step_hz: u32,
    direction_setup_us: u32,
    start_stop_hz: u32,
    contact: i8,
    spindle: i8,
    drivers: StepDir,
}

/// A 3040 mill with 5 mm lead screws, with `board`.
fn mill_3040(board: Board) -> Machine {
    let base = hobby_3018();
    let axis = |axis: &Axis, max_mm: f64, speed_mm_per_s: f64| Axis {
        scale: Scale::per_mm(board.steps_per_mm),
        max: Length::from_mm(max_mm),
        max_speed_mm_per_s: speed_mm_per_s,
        max_acceleration_mm_per_s2: 100.0,
        max_jerk_mm_per_s3: 4_000.0,
        home_speed_mm_per_s: 5.0,
        home_search: Length::from_mm(max_mm - axis.min.mm() + 30.0),
        ..axis.clone()
    };
    let wiring = Wiring {
        spindle: board.spindle,
        sensors: of_inputs(vec![3, UNWIRED, 4, UNWIRED, 2, UNWIRED, board.contact], UNWIRED),
        sensors_low: of_inputs(vec![1; 7], 0),
        start_stop_hz: board.start_stop_hz,
        drivers: board.drivers,
        ..Parallel::default().wiring
    };
    Machine {
        name: board.name.to_owned(),
        description: board.description.to_owned(),
        output: Output::Parallel,
        change: HandChange::default(),
        parallel: Parallel { wiring, ..Parallel::default() },
        x: axis(&base.x, 300.0, 20.0),
        y: axis(&base.y, 400.0, 20.0),
        z: axis(&base.z, 0.0, 10.0),
        max_step_hz: board.max_step_hz,
        direction_setup_us: board.direction_setup_us,
        pulse_width_us: f64::from(board.max_step_hz).recip() * 0.25e6,
        down: DownLimits {
            max_speed_mm_per_s: 10.0,
            max_acceleration_mm_per_s2: 100.0,
            max_jerk_mm_per_s3: 4_000.0,
        },
        overlap: Overlap { on: false, ..base.overlap },
        process: Process {
            spindle_rpm: 12_000,
            max_rpm: 24_000,
            spin_up_ms: 4_000.0,
            contact_tolerance: CONTACT_TOLERANCE,
            ..base.process.clone()
        },
        ..base
    }
}

/// Drivers on a plain five-axis breakout board: X on pins 2 and 3, a common ENABLE on pin 14, the relay on
/// pin 17.
pub(super) fn breakout() -> Machine {
    mill_3040(Board {
        name: "Breakout board",
        description: "A 3040 mill with STEP/DIR drivers at a breakout board on the parallel port.",
        steps_per_mm: 160.0,
        max_step_hz: 25_000,
        direction_setup_us: 50,
        start_stop_hz: 400,
        contact: 0,
        spindle: 11,
        drivers: StepDir {
            steps: vec![0, 2, 4],
            directions: vec![1, 3, 5],
            enables: vec![9; 3],
            outputs_low: vec![9],
            enable_delay_ms: 200,
            ..StepDir::default()
        },
    })
}

/// A board with three TB6560 and slow optocouplers: half steps, 0.15 ms for everything.
pub(super) fn tb6560() -> Machine {
    let slow = || vec![150_000; 3];
    mill_3040(Board {
        name: "TB6560 board",
        description: "A 3040 mill with a three-axis TB6560 board on the parallel port.",
        steps_per_mm: 80.0,
        max_step_hz: 3_000,
        direction_setup_us: 500,
        start_stop_hz: 200,
        contact: 1,
        spindle: 0,
        drivers: StepDir {
            steps: vec![10, 9, 1],
            directions: vec![8, 5, 4],
            enables: vec![2, 11, 3],
            length_ns: slow(),
            space_ns: slow(),
            setup_ns: slow(),
            hold_ns: slow(),
            enable_delay_ms: 200,
            ..StepDir::default()
        },
    })
}

/// A Gecko G540: 1/10 steps, charge pump on pin 16, steps on the falling edge.
pub(super) fn g540() -> Machine {
    let all = |ns: u32| vec![ns; 3];
    mill_3040(Board {
        name: "Gecko G540",
        description: "A 3040 mill with a Gecko G540 on the parallel port.",
        steps_per_mm: 400.0,
        max_step_hz: 25_000,
        direction_setup_us: 10,
        start_stop_hz: 1_000,
        contact: 1,
        spindle: 11,
        drivers: StepDir {
            steps: vec![0, 2, 4],
            directions: vec![1, 3, 5],
            charge_pump: 10,
            outputs_low: vec![0, 2, 4],
            length_ns: all(2_000),
            space_ns: all(2_500),
            setup_ns: all(1_000),
            hold_ns: all(1_000),
            enable_delay_ms: 200,
            ..StepDir::default()
        },
    })
}
