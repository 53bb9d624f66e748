//! The virtual drill (default), the laboratory drill of Arendt's paper, a small 3018 router, and a drill with
//! six spindles.

use crate::machine::{
    AdapterWiring, Axis, Card, Converter, DownLimits, DriveKind, Dynamics, Foot, HandChange, HomeEnd, Law,
    Lengths, Machine, Magazine, MotionLaws, Output, Overlap, Parallel, Park, PhaseTable, Process, RackTool,
    Scale, StrokeEnd, ToolChange,
};
use crate::units::Length;

fn mm(value: f64) -> Length {
    Length::from_mm(value)
}

fn drills(sizes_mm: &[f64]) -> Vec<RackTool> {
    (1..).zip(sizes_mm).map(|(number, size)| RackTool::drill(number, mm(*size))).collect()
}

/// Drills from 0.3 mm to 3.2 mm, a typical set.
fn common_bits() -> Vec<RackTool> {
    drills(&[0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.5, 1.6, 1.8, 2.0, 2.2, 2.5, 3.0, 3.2])
}

/// Limits of Z on its way down: mm/s, mm/s², mm/s³.
fn down(speed: f64, acceleration: f64, jerk: f64) -> DownLimits {
    DownLimits {
        max_speed_mm_per_s: speed,
        max_acceleration_mm_per_s2: acceleration,
        max_jerk_mm_per_s3: jerk,
    }
}

/// Default name of the virtual drill. Pages translate it.
pub const VIRTUAL_NAME: &str = "Virtual drill";

/// The default machine, without hardware: a fast hobby drill, 300 × 200 mm.
pub fn virtual_drill() -> Machine {
    let axis = |max: f64| Axis {
        scale: Scale::per_mm(80.0),
        min: Length::ZERO,
        max: mm(max),
        max_speed_mm_per_s: 150.0,
        max_acceleration_mm_per_s2: 2_000.0,
        max_jerk_mm_per_s3: 80_000.0,
        home: HomeEnd::Min,
        home_speed_mm_per_s: 40.0,
        home_search: mm(max + 30.0),
        home_offset: mm(1.0),
        index: false,
        index_within: mm(4.0),
        backlash: Length::ZERO,
        phases: PhaseTable::full_step(),
    };
    Machine {
        name: VIRTUAL_NAME.to_owned(),
        description: "A fast hobby drill that exists only inside this computer.".to_owned(),
        output: Output::Virtual,
        card_address: 0x2A0,
        card: Card::default(),
        parallel: Parallel::default(),
        adapter: AdapterWiring::default(),
        converter: Converter::default(),
        x: axis(300.0),
        y: axis(200.0),
        z: Axis {
            scale: Scale::per_mm(400.0),
            min: mm(-45.0),
            max: Length::ZERO,
            max_speed_mm_per_s: 50.0,
            max_acceleration_mm_per_s2: 1_500.0,
            max_jerk_mm_per_s3: 60_000.0,
            home: HomeEnd::Max,
            home_speed_mm_per_s: 15.0,
            home_search: mm(60.0),
            ..axis(0.0)
        },
        spindles: 1,
        enabled: u8::MAX,
        own: Default::default(),
        drive: DriveKind::Planned,
        interrupt_hz: 500,
        dynamics: Dynamics::arendt(),
        max_step_hz: 50_000,
        direction_setup_us: 5,
        pulse_width_us: 2.0,
        motion: MotionLaws { down: Law::Power, ..laws() },
        down: down(50.0, 1_500.0, 60_000.0),
        overlap: Overlap { on: true, clear_mm: 0.3, latency_ms: 0.2, margin_ms: 5.0, dwell_top_ms: 0.0 },
        settle_ms: 10.0,
        stroke_end: StrokeEnd::Counted,
        longest_drilling_s: 5.0,
        rack: common_bits(),
        rack_tolerance: mm(0.05),
        tool_change: ToolChange::Manual,
        magazine: Magazine::default(),
        foot: Foot::default(),
        park: Park::default(),
        change: HandChange { lengths: Lengths::Equal, ..HandChange::default() },
        process: virtual_process(),
    }
}

/// Process parameters of the virtual drill.
fn virtual_process() -> Process {
    Process {
        safe_height: mm(2.0),
        feed_height: mm(0.3),
        board_thickness: mm(1.6),
        breakthrough: mm(0.5),
        contact_tolerance: Length::ZERO,
        touch_mm_per_s: 1.0,
        lift_at_pause: false,
        feed_mm_per_s: 12.0,
        dwell_bottom_ms: 0.0,
        spindle_rpm: 30_000,
        max_rpm: 60_000,
        spin_up_ms: 1_500.0,
        surface: mm(-30.0),
    }
}

/// Converts XY counts of the laboratory drill.
fn counts(steps: f64) -> Length {
    mm(steps * 25.4 / 120.0)
}

/// The laboratory drill (Arendt, part 2 and figure 4): printer mechanics with 120 steps per inch and 500
/// interrupts per second. The ranges are −10 … 2588 and −10 … 825 counts. The lower switch ends a plunge,
/// within 18 s. The axes follow the table of dynamics, one step per interrupt at full speed. Its highest
/// speeds allow the whole table up to 700 interrupts per second; its motors follow 580.
pub fn lab() -> Machine {
    let axis = |min: f64, max: f64| Axis {
        scale: Scale::per_inch(120.0),
        min: counts(min),
        max: counts(max),
        max_speed_mm_per_s: 150.0,
        max_acceleration_mm_per_s2: 200.0,
        max_jerk_mm_per_s3: 10_000.0,
        home: HomeEnd::Min,
        home_speed_mm_per_s: 16.0,
        home_search: counts(max - min + 100.0),
        home_offset: counts(10.0),
        index: false,
        index_within: mm(4.0),
        backlash: Length::ZERO,
        phases: PhaseTable::arendt(),
    };
    Machine {
        name: "Laboratory drill".to_owned(),
        description: "Arendt's laboratory model: two printers' mechanics and a digital I/O card.".to_owned(),
        output: Output::Virtual,
        x: axis(-10.0, 2588.0),
        y: axis(-1.0, 2588.0),
        z: Axis {
            scale: Scale::per_inch(1200.0),
            min: mm(-17.5),
            max: mm(0.25),
            max_speed_mm_per_s: 15.0,
            max_acceleration_mm_per_s2: 100.0,
            max_jerk_mm_per_s3: 5_000.0,
            home: HomeEnd::Max,
            home_speed_mm_per_s: 3.0,
            home_search: mm(25.0),
            home_offset: mm(0.25),
            index: false,
            index_within: mm(4.0),
            backlash: Length::ZERO,
            phases: PhaseTable::arendt(),
        },
        spindles: 1,
        drive: DriveKind::Table,
        interrupt_hz: 500,
        dynamics: Dynamics::arendt(),
        max_step_hz: 580,
        direction_setup_us: 100,
        pulse_width_us: 100.0,
        motion: laws(),
        down: down(15.0, 100.0, 5_000.0),
        overlap: Overlap { on: false, clear_mm: 0.5, latency_ms: 0.0, margin_ms: 0.0, dwell_top_ms: 0.0 },
        settle_ms: 20.0,
        stroke_end: StrokeEnd::Sensor,
        longest_drilling_s: 18.0,
        rack: common_bits(),
        rack_tolerance: mm(0.1),
        tool_change: ToolChange::Manual,
        process: lab_process(),
        ..virtual_drill()
    }
}

fn lab_process() -> Process {
    Process {
        feed_mm_per_s: 2.0,
        touch_mm_per_s: 2.0,
        lift_at_pause: false,
        spindle_rpm: 20_000,
        max_rpm: 30_000,
        spin_up_ms: 1_000.0,
        surface: mm(-12.0),
        ..virtual_process()
    }
}

/// A small desktop router of the 3018 class: 2 mm lead screws, 1/8 steps, linear ramps as in its usual
/// firmware. Speeds from `docs/motion-profiles.md` D: 1000 mm/min and 30 mm/s² in XY, 10 mm/s and 30 mm/s² in
/// Z, plunge at 2 mm/s.
pub fn hobby_3018() -> Machine {
    let base = virtual_drill();
    let slow = |axis: Axis, speed: f64| Axis {
        scale: Scale::per_mm(800.0),
        max_speed_mm_per_s: speed,
        max_acceleration_mm_per_s2: 30.0,
        max_jerk_mm_per_s3: 3_000.0,
        home_speed_mm_per_s: 5.0,
        ..axis
    };
    Machine {
        name: "3018 router".to_owned(),
        description: "A desktop router of the 3018 class.".to_owned(),
        x: slow(Axis { max: mm(300.0), home_search: mm(330.0), ..base.x.clone() }, 1000.0 / 60.0),
        y: slow(Axis { max: mm(180.0), home_search: mm(210.0), ..base.y.clone() }, 1000.0 / 60.0),
        z: slow(base.z.clone(), 10.0),
        max_step_hz: 25_000,
        motion: MotionLaws { plane: Law::Linear, down: Law::Linear, up: Law::Linear, ..laws() },
        down: down(10.0, 30.0, 3_000.0),
        overlap: Overlap { clear_mm: 0.2, margin_ms: 20.0, ..base.overlap },
        longest_drilling_s: 20.0,
        process: Process {
            feed_height: mm(0.2),
            feed_mm_per_s: 2.0,
            spindle_rpm: 10_000,
            max_rpm: 10_000,
            ..base.process.clone()
        },
        ..base
    }
}

/// A production drill with six spindles over one table (Leetro's article): linear motors with 1 m/s and 20
/// m/s² in XY. Drill cycles of 2 + 2.1 mm, at 400 mm/s and then at feed, with the power law on the way down.
pub fn six_spindles() -> Machine {
    let base = virtual_drill();
    let axis = |axis: Axis, max: f64| Axis {
        scale: Scale::per_mm(200.0),
        max: mm(max),
        max_speed_mm_per_s: 1_000.0,
        max_acceleration_mm_per_s2: 20_000.0,
        max_jerk_mm_per_s3: 4_000_000.0,
        home_speed_mm_per_s: 60.0,
        home_search: mm(max + 30.0),
        ..axis
    };
    Machine {
        name: "Six spindles".to_owned(),
        description: "Six spindles over one table, all drilling the same board.".to_owned(),
        x: axis(base.x.clone(), 540.0),
        y: axis(base.y.clone(), 620.0),
        z: Axis {
            max_speed_mm_per_s: 400.0,
            max_acceleration_mm_per_s2: 20_000.0,
            max_jerk_mm_per_s3: 4_000_000.0,
            home_speed_mm_per_s: 30.0,
            ..base.z.clone()
        },
        spindles: 6,
        max_step_hz: 250_000,
        direction_setup_us: 1,
        pulse_width_us: 1.0,
        settle_ms: 5.0,
        down: down(400.0, 20_000.0, 4_000_000.0),
        overlap: Overlap { on: true, clear_mm: 0.3, latency_ms: 0.2, margin_ms: 3.0, dwell_top_ms: 1.0 },
        tool_change: ToolChange::Manual,
        process: Process {
            feed_mm_per_s: 60.0,
            feed_height: mm(0.1),
            spindle_rpm: 120_000,
            max_rpm: 200_000,
            spin_up_ms: 3_000.0,
            ..base.process.clone()
        },
        ..base
    }
}

/// Motion profiles of most machines.
fn laws() -> MotionLaws {
    MotionLaws {
        plane: Law::SCurve,
        down: Law::SCurve,
        up: Law::SCurve,
        order: 0.5,
        reserve: 0.2,
        corner_mm: 0.01,
    }
}
