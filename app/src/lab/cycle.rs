//! Plane and spindles of the machine in time, over a few holes: how fast the plane moves, how high the tip is.
//!
//! ```text
//! hop ─▶ profile ─┐
//! own stroke ─────┴▶ core: cycles ─▶ points of speed and height, times with and without overlap
//! ```
//!
//! Comes in: a machine, the length of the hop, mm. Goes out: points over ms, and times. Moves nothing.

use annulus_core::machine::{Law, Machine};
use annulus_core::motion::coordination::{Cycle, Rules, cycle_s, cycles, sequential_s};
use annulus_core::motion::profile::{Limits, Profile, Shape, choose, plan};
use annulus_core::motion::strokes;
use annulus_core::remark::Remark;

/// Holes shown.
pub const HOLES: usize = 4;

/// Points of a stroke or hop.
const POINTS: usize = 60;

/// What came of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// Speed of the plane over ms, mm/s.
    pub speed: Vec<[f64; 2]>,
    /// Height of the tip over the board's surface over ms, mm.
    pub height: Vec<[f64; 2]>,
    /// The instants of each hole.
    pub cycles: Vec<Cycle>,
    /// Height from which on the plane may move, mm.
    pub clear_mm: f64,
    /// From clear to clear with overlap, s.
    pub together_s: f64,
    /// The same when one waits for the other, s.
    pub apart_s: f64,
    /// Spindles that drill at once.
    pub spindles: u32,
}

/// Some holes in a row, `hop_mm` apart along X.
pub fn shown(machine: &Machine, hop_mm: f64) -> Result<Shown, Remark> {
    let axis = &machine.x;
    let limits = Limits {
        speed: axis.max_speed_mm_per_s,
        acceleration: axis.max_acceleration_mm_per_s2,
        jerk: axis.max_jerk_mm_per_s3,
    };
    let shape = match machine.motion.plane {
        Law::Linear => Shape::Linear,
        Law::SCurve => Shape::SCurve,
        Law::Power => Shape::Power(machine.motion.order),
        Law::Automatic => choose(hop_mm, limits)?.choice,
    };
    let hop = plan(shape, hop_mm, limits)?;
    let (times, down, up) = strokes::own(machine)?;
    let rules = Rules { settle_s: machine.settle_ms * 1e-3, latency_s: machine.overlap.latency_ms * 1e-3 };
    let spindles = vec![times; machine.spindles.max(1) as usize];
    let found = cycles(&[hop.duration_s(); HOLES], rules, &spindles)?;
    let top_mm = machine.process.safe_height.mm();
    let mut height = vec![[0.0, top_mm]];
    let mut speed = vec![[0.0, 0.0]];
    for cycle in &found {
        speed.extend(hop_points(&hop, cycle.release_s));
        let Some(stroke) = cycle.spindles.first() else { continue };
        height.extend(way(stroke.start_s, times.down_s, |t| top_mm - down.position_mm(t)));
        height.extend(way(stroke.up_start_s, times.up_s, |t| top_mm - down.length_mm() + up.position_mm(t)));
    }
    let end_ms = height.last().map_or(0.0, |point| point[0]);
    speed.push([end_ms, 0.0]);
    Ok(Shown {
        speed,
        height,
        cycles: found,
        clear_mm: machine.overlap.clear_mm,
        together_s: cycle_s(hop.duration_s(), rules, &times),
        apart_s: sequential_s(&[hop.duration_s()], rules, &spindles),
        spindles: machine.spindles.max(1),
    })
}

fn hop_points(hop: &Profile, from_s: f64) -> Vec<[f64; 2]> {
    way(from_s, hop.duration_s(), |t| hop.speed(t))
}

fn way(from_s: f64, duration_s: f64, value: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
    let point = |k: usize| {
        let t = duration_s * k as f64 / (POINTS - 1) as f64;
        [1000.0 * (from_s + t), value(t)]
    };
    (0..POINTS).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::machine::{hobby_3018, lab, six_spindles, virtual_drill};

    #[test]
    fn every_preset_drills_without_moving_the_plane_while_the_tip_is_low() {
        for machine in [virtual_drill(), lab(), hobby_3018(), six_spindles()] {
            let shown = shown(&machine, 5.0).unwrap();
            assert_eq!(shown.cycles.len(), HOLES);
            assert!(shown.together_s <= shown.apart_s + 1e-9, "{}", machine.name);
            assert!(shown.height.windows(2).all(|two| two[0][0] <= two[1][0] + 1e-6), "{}", machine.name);
            let low = shown.height.iter().filter(|point| point[1] < shown.clear_mm - 1e-6);
            for point in low {
                let moves = shown.cycles.iter().any(|cycle| {
                    let [from_ms, to_ms] = [1000.0 * cycle.release_s, 1000.0 * cycle.arrive_s];
                    point[0] > from_ms + 1e-6 && point[0] < to_ms - 1e-6
                });
                assert!(!moves, "{} at {} ms", machine.name, point[0]);
            }
        }
    }

    #[test]
    fn a_hop_that_cannot_be_is_refused() {
        assert!(shown(&virtual_drill(), f64::NAN).is_err());
        assert!(shown(&virtual_drill(), -1.0).is_err());
    }
}
