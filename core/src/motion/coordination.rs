//! Rules for the times at which XY and the spindles of a drill may move, with as much overlap as is safe.
//!
//! ```text
//! XY         ███████ rapid █████|settle|          |███ next rapid
//!                                      R_k        ^ X_k+1 = clear + λ
//! spindle  ^ top                                  |
//!          |‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾\  start               | /‾‾‾‾
//!  c, 0  --+-----------------\--contact----clear--/------
//!          |                  \____bottom____/
//!          +-------------------------------------------> t
//! ```
//!
//! Maths: `docs/motion-profiles.md` C2 (release, trigger and start rules). The trigger rule is from the
//! patent, the six spindles are from Leetro.

use super::profile::Stroke;
use crate::diagnostic::Diagnostic;
use crate::error;

/// Times of a spindle's stroke, computed once per bit, in s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpindleTimes {
    /// T_dn: from rest at the top to rest at the bottom.
    pub down_s: f64,
    /// T_up: from rest at the bottom to rest at the top.
    pub up_s: f64,
    /// t_z: from the start of the downward stroke to contact with the surface.
    pub contact_s: f64,
    /// t_leave: from the start of the upward stroke until the tip is clear of the board.
    pub leave_s: f64,
    pub dwell_bottom_s: f64,
    /// Least rest at the top.
    pub dwell_top_s: f64,
    /// m: XY must have settled this long before contact.
    pub margin_s: f64,
}

impl SpindleTimes {
    /// Times of the strokes `down` and `up` over one distance, with its first `height_mm` above the surface.
    /// The tip is clear at `clear_mm` over the surface. Dwells and margin are zero.
    pub fn of(down: &Stroke, up: &Stroke, height_mm: f64, clear_mm: f64) -> Self {
        let depth_mm = down.length_mm() - height_mm;
        Self {
            down_s: down.duration_s(),
            up_s: up.duration_s(),
            contact_s: down.time_at(height_mm),
            leave_s: up.time_at(depth_mm + clear_mm),
            ..Self::default()
        }
    }

    /// t_air: from clear to the next contact, if the spindle only reverses at the top.
    pub fn air_s(&self) -> f64 {
        self.up_s - self.leave_s + self.dwell_top_s + self.contact_s
    }

    /// t_board: from contact to clear.
    pub fn board_s(&self) -> f64 {
        self.down_s - self.contact_s + self.dwell_bottom_s + self.leave_s
    }
}

/// Times common to all spindles, in s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpindleRules {
    /// Rest of XY before a tip may touch the board.
    pub settle_s: f64,
    /// λ: signal delay between XY and spindles.
    pub latency_s: f64,
}

/// Events of one spindle in one cycle, s from the start of the job.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stroked {
    /// Signal to go down.
    pub trigger_s: f64,
    pub start_s: f64,
    /// The tip touches the surface.
    pub contact_s: f64,
    /// At rest at the bottom.
    pub bottom_s: f64,
    pub up_start_s: f64,
    /// The tip is clear of the board.
    pub clear_s: f64,
    pub top_s: f64,
}

/// Events of one hole.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cycle {
    /// X_k: XY starts.
    pub release_s: f64,
    pub arrive_s: f64,
    /// R_k: XY has settled.
    pub ready_s: f64,
    pub spindles: Vec<Stroked>,
    /// All spindles are clear.
    pub clear_s: f64,
    /// Time since the previous `clear_s`; none for the first hole.
    pub cycle_s: Option<f64>,
}

/// Events of every hole of a job with rapids of `hops_s`, from rest with all spindles at the top.
///
/// Refuses an empty list of spindles, negative or non-finite times, contact after the bottom, clear after the
/// top.
pub fn cycles(
    hops_s: &[f64],
    rules: SpindleRules,
    spindles: &[SpindleTimes],
) -> Result<Vec<Cycle>, Diagnostic> {
    check(hops_s, rules, spindles)?;
    let mut cycles: Vec<Cycle> = Vec::with_capacity(hops_s.len());
    for hop_s in hops_s {
        let before = cycles.last();
        let release_s = before.map_or(0.0, |before| before.clear_s + rules.latency_s);
        let arrive_s = release_s + hop_s;
        let ready_s = arrive_s + rules.settle_s;
        let stroked = |(index, times): (usize, &SpindleTimes)| {
            let top_s = before.and_then(|before| before.spindles.get(index)).map(|stroked| stroked.top_s);
            stroke(times, rules, release_s, ready_s, top_s)
        };
        let spindles: Vec<Stroked> = spindles.iter().enumerate().map(stroked).collect();
        let clear_s = spindles.iter().fold(0.0, |latest: f64, stroked| latest.max(stroked.clear_s));
        let cycle_s = before.map(|before| clear_s - before.clear_s);
        cycles.push(Cycle { release_s, arrive_s, ready_s, spindles, clear_s, cycle_s });
    }
    Ok(cycles)
}

/// One spindle's stroke. The trigger is as early as three rules allow: contact not before `ready_s` plus
/// margin, not before the release of XY, and not before the rest at the top (C2.2, rules 3 to 5).
pub fn stroke(
    times: &SpindleTimes,
    rules: SpindleRules,
    release_s: f64,
    ready_s: f64,
    top_s: Option<f64>,
) -> Stroked {
    let latency_s = rules.latency_s;
    let trigger_s = release_s.max(ready_s + times.margin_s - times.contact_s - latency_s);
    let rested_s = top_s.map_or(f64::NEG_INFINITY, |top_s| top_s + times.dwell_top_s);
    let start_s = (trigger_s + latency_s).max(rested_s);
    let bottom_s = start_s + times.down_s;
    let up_start_s = bottom_s + times.dwell_bottom_s;
    Stroked {
        trigger_s,
        start_s,
        contact_s: start_s + times.contact_s,
        bottom_s,
        up_start_s,
        clear_s: up_start_s + times.leave_s,
        top_s: up_start_s + times.up_s,
    }
}

/// Time from clear to clear of one spindle, if every rapid takes `hop_s` (C2.2, formula *).
pub fn cycle_s(hop_s: f64, rules: SpindleRules, times: &SpindleTimes) -> f64 {
    let latency_s = rules.latency_s;
    let by_plane = latency_s + hop_s + rules.settle_s + times.margin_s;
    let by_signal = 2.0 * latency_s + times.contact_s;
    times.air_s().max(by_plane).max(by_signal) + times.board_s()
}

/// Time of the job without overlap: rapid, settle, down, dwell, up, dwell, for every hole.
pub fn sequential_s(hops_s: &[f64], rules: SpindleRules, spindles: &[SpindleTimes]) -> f64 {
    let stroke_s = spindles.iter().fold(0.0, |longest: f64, times| {
        longest.max(times.down_s + times.dwell_bottom_s + times.up_s + times.dwell_top_s)
    });
    hops_s.iter().map(|hop_s| hop_s + rules.settle_s + stroke_s).sum()
}

fn check(hops_s: &[f64], rules: SpindleRules, spindles: &[SpindleTimes]) -> Result<(), Diagnostic> {
    let refuse = |field: &str, value: f64| Err(error!("motion.bad_time", field = field, value = value));
    let bad = |time: &f64| !(time.is_finite() && *time >= 0.0);
    if let Some(hop_s) = hops_s.iter().find(|hop_s| bad(hop_s)) {
        return refuse("hop", *hop_s);
    }
    let rows = [("settle", rules.settle_s), ("latency", rules.latency_s)];
    if let Some((field, value)) = rows.into_iter().find(|(_, value)| bad(value)) {
        return refuse(field, value);
    }
    if spindles.is_empty() {
        return refuse("spindles", 0.0);
    }
    for times in spindles {
        let rows = [
            ("down", times.down_s),
            ("up", times.up_s),
            ("contact", times.contact_s),
            ("leave", times.leave_s),
            ("dwell_bottom", times.dwell_bottom_s),
            ("dwell_top", times.dwell_top_s),
            ("margin", times.margin_s),
        ];
        if let Some((field, value)) = rows.into_iter().find(|(_, value)| bad(value)) {
            return refuse(field, value);
        }
        if times.contact_s > times.down_s {
            return refuse("contact", times.contact_s);
        }
        if times.leave_s > times.up_s {
            return refuse("leave", times.leave_s);
        }
    }
    Ok(())
}
