//! When the plane and the spindles of a drill may move, so that they move together as much as is safe.
//!
//! ```text
//! plane      ████████ hop ██████|settle|          |████ next hop
//!                                      R_k        ^ X_k+1 = clear + λ
//! spindle  ^ top                                  |
//!          |‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾\  start               | /‾‾‾‾
//!  c, 0  --+-----------------\--contact----clear--/------
//!          |                  \____bottom____/
//!          +-------------------------------------------> t
//! ```
//!
//! Comes in: times of the hops and of each spindle's stored strokes, in s. Goes out: the instants of every cycle. Does not
//! know places; the times are those of profiles computed elsewhere, and one set serves all holes of a bit.
//!
//! Maths: `docs/motion-profiles.md` C2 (release, trigger and start rules); the trigger rule is the patent's, the six spindles are
//! Leetro's.

use super::profile::Stroke;
use crate::diagnostic::Diagnostic;

/// What a spindle's stroke takes, computed once a bit. All in s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpindleTimes {
    /// T_dn: from rest on top to rest at the bottom.
    pub down_s: f64,
    /// T_up: from rest at the bottom to rest on top.
    pub up_s: f64,
    /// t_z: from the start of the way down until the tip is at the surface.
    pub contact_s: f64,
    /// t_leave: from the start of the way up until the tip is clear of the board.
    pub leave_s: f64,
    /// Rest at the bottom.
    pub dwell_bottom_s: f64,
    /// Least rest on top.
    pub dwell_top_s: f64,
    /// m: how long before the contact the plane must have settled.
    pub margin_s: f64,
}

impl SpindleTimes {
    /// Of stored strokes `down` and `up` over the same way, of which `height_mm` lie over the surface; the tip is clear
    /// `clear_mm` over it. Dwells and margin are none.
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

    /// t_air: from clear to the next contact, if the spindle only has to turn round on top.
    pub fn air_s(&self) -> f64 {
        self.up_s - self.leave_s + self.dwell_top_s + self.contact_s
    }

    /// t_board: from contact to clear.
    pub fn board_s(&self) -> f64 {
        self.down_s - self.contact_s + self.dwell_bottom_s + self.leave_s
    }
}

/// What is the same for all spindles, in s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpindleRules {
    /// Rest of the plane before a tip may touch the board.
    pub settle_s: f64,
    /// λ: how long a signal takes between plane and spindles.
    pub latency_s: f64,
}

/// The instants of one spindle in one cycle, s from the start of the job.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stroked {
    /// The signal to go down is given.
    pub trigger_s: f64,
    /// It starts down.
    pub start_s: f64,
    /// The tip is at the surface.
    pub contact_s: f64,
    /// Rest at the bottom.
    pub bottom_s: f64,
    /// It starts up.
    pub up_start_s: f64,
    /// The tip is clear of the board.
    pub clear_s: f64,
    /// Rest on top.
    pub top_s: f64,
}

/// The instants of one hole.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cycle {
    /// X_k: the plane starts.
    pub release_s: f64,
    /// The plane arrives.
    pub arrive_s: f64,
    /// R_k: it has settled.
    pub ready_s: f64,
    /// Every active spindle.
    pub spindles: Vec<Stroked>,
    /// All of them are clear.
    pub clear_s: f64,
    /// From the clear before to this one; none for the first hole.
    pub cycle_s: Option<f64>,
}

/// The instants of every hole of a job whose hops take `hops_s`, from rest on top with all spindles up.
///
/// Refused: no spindle, times that are negative or no numbers, a contact after the bottom, a clear after the top.
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

/// One spindle's stroke: triggered so that it is at the surface no earlier than `ready_s` and its margin, not before the
/// plane was released, and not before it has rested on top (C2.2, rules 3 to 5).
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

/// The time from clear to clear of one spindle, when every hop takes `hop_s` (C2.2, formula *).
pub fn cycle_s(hop_s: f64, rules: SpindleRules, times: &SpindleTimes) -> f64 {
    let latency_s = rules.latency_s;
    let by_plane = latency_s + hop_s + rules.settle_s + times.margin_s;
    let by_signal = 2.0 * latency_s + times.contact_s;
    times.air_s().max(by_plane).max(by_signal) + times.board_s()
}

/// The same job with nothing at the same time: hop, settle, down, dwell, up, dwell, again and again.
pub fn sequential_s(hops_s: &[f64], rules: SpindleRules, spindles: &[SpindleTimes]) -> f64 {
    let stroke_s = spindles.iter().fold(0.0, |longest: f64, times| {
        longest.max(times.down_s + times.dwell_bottom_s + times.up_s + times.dwell_top_s)
    });
    hops_s.iter().map(|hop_s| hop_s + rules.settle_s + stroke_s).sum()
}

fn check(hops_s: &[f64], rules: SpindleRules, spindles: &[SpindleTimes]) -> Result<(), Diagnostic> {
    let refuse = |field: &str, value: f64| {
        Err(Diagnostic::error("motion.bad_time").with("field", field).with("value", value))
    };
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
