//! The laws a timeline must keep, from its closed forms alone (N14): no axis faster, harder or jerkier than it may,
//! every move from where the one before ended, no gap in time.
//!
//! Comes in: a timeline, a machine. Goes out: what is broken, if anything. Does not know how it was planned.

use super::timeline::{Move, Timeline};
use crate::machine::{AXES, Machine, axis_name};
use crate::remark::{Remark, Weight};
use crate::units::TICK_HZ;

/// Room for rounding, as a share of the limit.
const ROUNDING: f64 = 1e-9;

/// Every broken law, at most one remark for each move.
pub fn laws(timeline: &Timeline, machine: &Machine) -> Result<(), Vec<Remark>> {
    let (mut at, mut now) = (timeline.start, 0);
    let mut broken = Vec::new();
    for (index, planned) in timeline.moves.iter().enumerate() {
        let remark =
            |code: &str| Remark::new(Weight::Loss, code).with("leg", planned.leg).with("move", index);
        if planned.from != at || planned.start_tick != now {
            broken.push(remark("motion.broken_chain"));
        } else if let Some(axis) = (0..AXES).find(|axis| too_much(timeline, machine, planned, *axis)) {
            broken.push(remark("motion.over_limit").with("axis", axis_name(axis)));
        } else if (planned.lead_s + planned.profile.duration_s()) * TICK_HZ as f64
            > planned.duration_ticks as f64
        {
            broken.push(remark("motion.too_short"));
        }
        (at, now) = (planned.to, planned.start_tick + planned.duration_ticks);
    }
    if broken.is_empty() { Ok(()) } else { Err(broken) }
}

/// Whether `axis` is asked for more than it may do. Greatest speed, acceleration and jerk of a profile are among its
/// closed forms; an axis has its share of each.
fn too_much(timeline: &Timeline, machine: &Machine, planned: &Move, axis: usize) -> bool {
    let way_mm = (planned.to[axis] - planned.from[axis]) as f64 * timeline.mm_per_step[axis];
    if way_mm == 0.0 {
        return false;
    }
    let (profile, settings) = (&planned.profile, machine.axis(axis));
    let share = way_mm.abs() / profile.length_mm;
    let over = |value: f64, limit: f64| value.is_nan() || value * share > limit * (1.0 + ROUNDING);
    over(profile.speed_mm_per_s, settings.max_speed_mm_per_s)
        || over(profile.acceleration_mm_per_s2, settings.max_acceleration_mm_per_s2)
        || over(profile.jerk_mm_per_s3, settings.max_jerk_mm_per_s3)
}
