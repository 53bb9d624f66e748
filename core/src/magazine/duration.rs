//! Duration of tool changes, from the planned moves.
//!
//! A change is assumed to go from the first slot to the middle slot of the magazine, starting over the middle
//! of the table.

use super::{Change, Held, StockedTool, ToolStock};
use crate::diagnostic::Diagnostic;
use crate::job::{Bit, Cutter};
use crate::machine::{Machine, Steps};
use crate::motion::cycles;
use crate::units::{Length, TICK_HZ};

/// Duration in ticks of each change that the machine makes to insert `tools` in order. Zero if the user
/// changes tools, and for a tool already in the spindle. At the start the spindle holds `held`, or nothing.
pub fn changes_ticks<T: PartialEq>(
    machine: &Machine,
    mut held: Option<T>,
    tools: impl IntoIterator<Item = T>,
) -> Vec<u64> {
    if !machine.has_magazine() {
        return tools.into_iter().map(|_| 0).collect();
    }
    let [first, further] = [false, true].map(|has_old| change_ticks(machine, has_old).unwrap_or(0));
    let each = tools.into_iter().map(|tool| {
        let ticks = match &held {
            Some(old) if *old == tool => 0,
            Some(_) => further,
            None => first,
        };
        held = Some(tool);
        ticks
    });
    each.collect()
}

/// Seconds of one change: from an old tool to a new one if `has_old`, else from an empty spindle.
pub fn change_s(machine: &Machine, has_old: bool) -> Result<f64, Diagnostic> {
    Ok(change_ticks(machine, has_old)? as f64 / TICK_HZ as f64)
}

fn change_ticks(machine: &Machine, has_old: bool) -> Result<u64, Diagnostic> {
    let tool = |number: u32| StockedTool {
        number,
        bit: Bit {
            diameter: Length::from_um(i64::from(number) * 1_000),
            name: number.to_string(),
            cutter: Cutter::Drill,
            handling: Default::default(),
        },
    };
    let middle = machine.magazine.places() / 2;
    let mut stock = ToolStock { places: vec![None; machine.magazine.places()], ..ToolStock::default() };
    stock.places.iter_mut().skip(middle).take(1).for_each(|place| *place = Some(tool(2)));
    if middle == 0 && has_old {
        // A magazine with one slot has no room for two tools.
        stock.places.push(None);
    }
    let place = stock.way_back(Some(0));
    stock.spindle = if has_old { Held::Tool { tool: tool(1), place } } else { Held::Nothing };
    let mut at = Steps::default();
    for (axis, place) in at.iter_mut().enumerate().take(2) {
        let settings = machine.axis(axis);
        *place = settings.scale.steps(Length::from_nm((settings.min.nm() + settings.max.nm()) / 2));
    }
    let high = machine.process.surface + machine.process.safe_height;
    cycles::together(machine, 2).for_each(|axis| at[axis] = machine.z.scale.steps(high));
    let Some(mut change) = Change::new(&mut stock, &tool(2).bit, (at, [false; 2]))? else {
        return Ok(0);
    };
    let mut ticks = 0;
    while let Some(step) = change.step() {
        // Pretend that all sensors read as expected.
        let inputs = step.before().on;
        let work = change.begin(machine, &mut stock, (at, inputs))?;
        for segment in &work.segments {
            ticks += segment.duration_ticks;
            at = segment.end;
        }
        change.done(machine, &mut stock, step.after().on)?;
    }
    Ok(ticks)
}
