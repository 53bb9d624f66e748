//! Finds toolpaths that occur in two programs of one side: a file was given twice.
//!
//! Feeds are ignored.

use crate::geometry::Point;
use crate::job::{Command, Leg, Mark, Program};
use std::collections::BTreeSet;

/// Number of toolpaths that also occur, with the same tool, in an earlier program.
pub(super) fn repeated(programs: &[Program]) -> u32 {
    let mut known: BTreeSet<Vec<i64>> = BTreeSet::new();
    let mut count = 0;
    for program in programs.iter().filter(|_| programs.len() > 1) {
        let mut own = Vec::new();
        let mut bit = 0;
        for leg in &program.legs {
            if let Mark::ToolChange(index) = leg.mark {
                bit = index;
            }
            let wide = program.bits.get(bit as usize).map_or(0, |bit| bit.diameter.nm());
            own.extend(matches!(leg.mark, Mark::Toolpath(_)).then(|| told(leg, program.origin, wide)));
        }
        count += own.iter().filter(|told| known.contains(*told)).count() as u32;
        known.extend(own);
    }
    count
}

/// A leg as numbers.
fn told(leg: &Leg, origin: Point, wide: i64) -> Vec<i64> {
    let mut out = vec![wide];
    let place = |at: Point| [at.x.nm() + origin.x.nm(), at.y.nm() + origin.y.nm()];
    for command in &leg.commands {
        match *command {
            Command::Rapid { to } => out.extend(place(to)),
            Command::Plunge { to, .. } | Command::Retract { to } => out.push(to.nm()),
            Command::Mill { to, height, .. } => out.extend([place(to).as_slice(), &[height.nm()]].concat()),
            Command::MillArc { to, height, center, ccw, .. } => {
                out.extend([place(to), place(center), [height.nm(), i64::from(ccw)]].concat());
            }
            Command::Spindle { .. } | Command::Dwell { .. } | Command::AwaitBit { .. } => {}
        }
    }
    out
}
