//! Feeds and speeds that suit the machine: limited to it in planning, and checked before a program runs on a
//! connected machine.
//!
//! ```text
//!   XY                no faster than the slower of X and Y        isolate.feed = 400: 16.7 mm/s, and a note
//!   down              no faster than Z, and than Z's limit downwards
//!   spindle           no faster than spindle.max_speed
//!   a drill           uses feed and speed of its entry in the tools, if given
//!
//! program planned for a fast drill    down 12 mm/s, 30,000 rpm
//! machine connected: a small router   drills at 2 mm/s, turns 10,000 rpm    both are reported
//! ```

use super::usual::Speeds;
use super::work::Operation;
use crate::diagnostic::Diagnostic;
use crate::job::{Bit, Command, Cutter, Mark, Program};
use crate::machine::Machine;
use crate::{code, warning};

/// A feed above this multiple of the machine's drilling feed is a mistake.
const FAST_FACTOR: f64 = 2.0;

/// Highest plunge feed of one tool, in mm/s, and highest spindle speed, in rpm.
#[derive(Clone, Copy, Debug, Default)]
struct Fastest {
    down_mm_per_s: f64,
    rpm: u32,
}

/// Problems with the speeds of `program` on `machine`: once for each tool.
pub fn judged(program: &Program, machine: &Machine) -> Vec<Diagnostic> {
    let tools = fastest(program);
    let of_bits = program.bits.iter().zip(&tools);
    of_bits.flat_map(|(bit, fastest)| of_tool(bit, *fastest, machine)).collect()
}

fn of_tool(bit: &Bit, fastest: Fastest, machine: &Machine) -> Vec<Diagnostic> {
    let process = &machine.process;
    let in_rack = machine.rack.iter().find(|tool| tool.is(bit)).map_or(0.0, |tool| tool.down_mm_per_s);
    let usual = process.feed_mm_per_s.max(in_rack);
    let mut found = Vec::new();
    if fastest.down_mm_per_s > usual * FAST_FACTOR {
        let why = warning!("job.plunge_fast", bit = bit.titled(), ..);
        let why = why.with("feed", format!("{:.1}", fastest.down_mm_per_s));
        found.push(why.with("usual", format!("{usual:.1}")));
    }
    if process.max_rpm > 0 && fastest.rpm > process.max_rpm {
        let why = warning!("job.spindle_fast", bit = bit.titled(), ..);
        found.push(why.with("rpm", fastest.rpm).with("most", process.max_rpm));
    }
    found
}

fn fastest(program: &Program) -> Vec<Fastest> {
    let mut tools = vec![Fastest::default(); program.bits.len()];
    let (mut bit, mut rpm) = (0_usize, 0);
    for leg in &program.legs {
        if let Mark::ToolChange(next) = leg.mark {
            bit = next as usize;
        }
        for command in &leg.commands {
            match command {
                Command::AwaitBit { bit: next } => bit = *next as usize,
                Command::Spindle { rpm: now } => rpm = *now,
                Command::Plunge { feed_um_per_s, .. } => {
                    if let Some(tool) = tools.get_mut(bit) {
                        tool.down_mm_per_s = tool.down_mm_per_s.max(f64::from(*feed_um_per_s) / 1e3);
                        tool.rpm = tool.rpm.max(rpm);
                    }
                }
                _ => {}
            }
        }
    }
    tools
}

/// Highest feed in XY, mm/s.
fn plane(machine: &Machine) -> f64 {
    machine.x.max_speed_mm_per_s.min(machine.y.max_speed_mm_per_s)
}

/// Highest feed down, mm/s.
fn down(machine: &Machine) -> f64 {
    machine.z.max_speed_mm_per_s.min(machine.down.max_speed_mm_per_s)
}

/// Highest speed of the spindle, rpm; `None` if the machine doesn't state it.
fn spindle(machine: &Machine) -> Option<u32> {
    Some(machine.process.max_rpm).filter(|most| *most > 0)
}

/// The speeds of the operation with `bit`. Feed and speed given for a drill in the tools take precedence over
/// the operation's. All are limited to the machine.
pub(super) fn with_bit(operation: &Operation, bit: &Bit, machine: &Machine) -> Speeds {
    let mut own = operation.speeds(machine);
    let drill = machine.rack.iter().find(|tool| bit.cutter == Cutter::Drill && tool.is(bit));
    if let Some(tool) = drill {
        if tool.down_mm_per_s > 0.0 {
            own.plunge_mm_per_s = tool.down_mm_per_s;
        }
        if tool.spindle_rpm > 0 {
            own.spindle_rpm = tool.spindle_rpm;
        }
    }
    within(own, machine)
}

fn within(speeds: Speeds, machine: &Machine) -> Speeds {
    Speeds {
        feed_mm_per_s: speeds.feed_mm_per_s.min(plane(machine)),
        plunge_mm_per_s: speeds.plunge_mm_per_s.min(down(machine)),
        spindle_rpm: spindle(machine).map_or(speeds.spindle_rpm, |most| speeds.spindle_rpm.min(most)),
    }
}

/// A note for every speed that the user set and that is limited. Default speeds are already those of the
/// machine.
pub(super) fn bounded(operation: &Operation, machine: &Machine) -> Vec<Diagnostic> {
    let note = |code: &str, wanted: String, most: String| {
        Diagnostic::note(code).with("wanted", wanted).with("most", most)
    };
    let feed = |code: &str, wanted: Option<f64>, most: f64| {
        let wanted = wanted.filter(|wanted| *wanted > most)?;
        Some(note(code, format!("{wanted:.1}"), format!("{most:.1}")))
    };
    let along = feed(code!("cam.feed_bounded"), operation.feed_mm_per_s, plane(machine))
        .filter(|_| operation.uses_bit());
    let down = feed(code!("cam.plunge_bounded"), operation.plunge_mm_per_s, down(machine));
    let turning = spindle(machine).zip(operation.spindle_rpm).filter(|(most, wanted)| wanted > most);
    let turning =
        turning.map(|(most, wanted)| note(code!("cam.speed_bounded"), wanted.to_string(), most.to_string()));
    [along, down, turning].into_iter().flatten().collect()
}
