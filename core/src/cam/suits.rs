//! Checks that the feeds and speeds of a program suit the connected machine.
//!
//! ```text
//! program planned for a fast drill    down 12 mm/s, 30,000 rpm
//! machine connected: a small router   drills at 2 mm/s, turns 10,000 rpm    both are reported
//! ```

use crate::diagnostic::Diagnostic;
use crate::job::{Bit, Command, Mark, Program};
use crate::machine::Machine;

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
        let why = Diagnostic::warning("job.plunge_fast").with("bit", bit.titled());
        let why = why.with("feed", format!("{:.1}", fastest.down_mm_per_s));
        found.push(why.with("usual", format!("{usual:.1}")));
    }
    if process.max_rpm > 0 && fastest.rpm > process.max_rpm {
        let why = Diagnostic::warning("job.spindle_fast").with("bit", bit.titled());
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
