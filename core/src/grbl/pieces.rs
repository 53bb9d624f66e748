//! A jog is sent in pieces: the controller never has much more than its stopping distance. If the connection
//! or the page fails, the jog ends soon.
//!
//! ```text
//!  start ───────── gone ─── 0.2 s of travel ─── v²/2a ──┤ end of the pieces sent: stops here by itself
//!                  └ lower bound, from answers, reports and time
//! ```

use super::context::{Context, Report};
use super::heard::ReportedState;
use super::line::Meaning;
use super::lines::number;
use super::settings;
use super::timing::USUAL_BLOCKS;

const FURTHEST_MM: f64 = 1_000.0;
/// Travel sent ahead, beyond the stopping distance: seconds at full speed.
const AHEAD_S: f64 = 0.2;
/// Shortest piece: seconds of travel at full speed.
const PIECE_S: f64 = 0.04;
/// Shortest piece, µm: never less than a step.
const SMALLEST_UM: i64 = 20;
/// All pieces but the last are multiples of 1/8 mm: controllers add these in single precision without error.
const EVEN_UM: i64 = 125;
/// Planner blocks that stay free: a line that waits for a block still runs after a jog cancel.
const FREE_BLOCKS: usize = 3;
/// Most unanswered pieces.
const UNANSWERED: usize = 2;
const USUAL_MM_PER_S2: f64 = 100.0;
/// A reported speed of at least this share counts as full speed.
const FAST_SHARE: f64 = 0.95;
const ROUNDED_MM: f64 = 0.01;
const AXES: [char; 3] = ['X', 'Y', 'Z'];

/// A jog that is not completely sent or not finished.
#[derive(Clone, Debug)]
pub(super) struct Pieces {
    axis: usize,
    back: bool,
    /// The whole travel, µm.
    way_um: i64,
    sent_um: i64,
    answered_um: i64,
    /// Unanswered pieces, oldest first, µm.
    unanswered_um: [i64; UNANSWERED],
    mm_per_min: f64,
    speed_mm_per_s: f64,
    mm_per_s2: f64,
    /// Start position, machine coordinates, once something was sent; `None` if not reported.
    from_mm: Option<f64>,
    /// Lower bound of the travel, mm, at a time, ms; later travel is extrapolated at full speed.
    anchor: Option<(f64, u64)>,
    was_fast: bool,
    /// The machine slowed down again in mid-travel: nothing is sent until the reason is clear.
    falters: bool,
}

impl Pieces {
    fn brake_mm(&self) -> f64 {
        self.speed_mm_per_s * self.speed_mm_per_s / (2.0 * self.mm_per_s2)
    }

    /// Lower bound of the travel, µm.
    fn gone_um(&self, now_ms: u64) -> i64 {
        let Some((mm, ms)) = self.anchor else { return 0 };
        let gone_mm = mm + self.speed_mm_per_s * now_ms.saturating_sub(ms) as f64 / 1e3;
        ((gone_mm * 1e3) as i64).clamp(0, self.answered_um)
    }

    /// The next piece in µm, if one is due; `blocks` is the planner's size.
    fn next_um(&mut self, now_ms: u64, blocks: usize) -> Option<i64> {
        let left_um = self.way_um - self.sent_um;
        let ahead_mm = self.speed_mm_per_s * AHEAD_S + self.brake_mm();
        let pieces = blocks.saturating_sub(FREE_BLOCKS).max(2) as f64;
        let piece_mm = (self.speed_mm_per_s * PIECE_S).max(ahead_mm / pieces);
        let ahead_um = ((ahead_mm * 1e3) as i64).max(SMALLEST_UM);
        // If less than four multiples fit ahead, pieces have any length.
        let even_um = if ahead_um >= 4 * EVEN_UM { EVEN_UM } else { 1 };
        let piece_um = ((piece_mm * 1e3) as i64).max(SMALLEST_UM);
        // Round up, not down: the planner has room for this number of pieces only.
        let piece_um = (piece_um + even_um - 1) / even_um * even_um;
        let room_um = self.gone_um(now_ms) + ahead_um - self.sent_um;
        if left_um == 0 || self.falters || room_um < piece_um.min(left_um) {
            return None;
        }
        let um = match room_um.min(left_um) {
            um if um < left_um => um - um % even_um,
            um => um,
        };
        let free = self.unanswered_um.iter_mut().find(|piece| **piece == 0)?;
        *free = um;
        self.sent_um += um;
        Some(um)
    }

    pub(super) fn on_answer(&mut self, now_ms: u64) {
        self.answered_um += std::mem::take(&mut self.unanswered_um[0]);
        self.unanswered_um.rotate_left(1);
        // The move has started by now at the latest.
        let brake_mm = self.brake_mm();
        self.anchor.get_or_insert((-brake_mm, now_ms));
    }

    fn gone_mm(&self, place_mm: Option<[f64; 3]>) -> Option<f64> {
        let gone_mm = place_mm?[self.axis] - self.from_mm?;
        Some(if self.back { -gone_mm } else { gone_mm })
    }

    /// Reported position and speed, a moment ago.
    fn on_position(&mut self, now_ms: u64, place_mm: Option<[f64; 3]>, mm_per_s: f64) {
        let is_fast = mm_per_s >= FAST_SHARE * self.speed_mm_per_s;
        self.falters = self.was_fast && !is_fast && self.sent_um < self.way_um;
        self.was_fast |= is_fast;
        if let (Some(gone_mm), Some(_)) = (self.gone_mm(place_mm), self.anchor) {
            // Subtract the distance lost to acceleration, so that full-speed extrapolation stays a lower
            // bound.
            let lacks = (self.speed_mm_per_s - mm_per_s).clamp(0.0, self.speed_mm_per_s);
            self.anchor = Some((gone_mm - lacks * lacks / (2.0 * self.mm_per_s2), now_ms));
        }
    }
}

impl Pieces {
    /// A jog of one axis by `um`; `None` if that is too far or too odd.
    pub(super) fn start(cx: &Context, axis: u8, um: i32, mm_per_min: f64) -> Option<Self> {
        let axis = usize::from(axis);
        let is_far = libm::fabs(f64::from(um) / 1e3) > FURTHEST_MM;
        if axis >= AXES.len() || is_far || !(mm_per_min > 0.0 && mm_per_min.is_finite()) {
            return None;
        }
        let values = &cx.known.info.values;
        let own = |first| settings::axes(values, first).map(|values: [f64; 3]| values[axis]);
        let is_fit = |value: &f64| value.is_finite() && *value > 0.0;
        // The controller limits each axis to `$110` to `$112`, whatever feed is asked for.
        let fastest = own(110).filter(is_fit).unwrap_or(f64::INFINITY);
        Some(Self {
            axis,
            back: um < 0,
            way_um: i64::from(um.unsigned_abs()),
            sent_um: 0,
            answered_um: 0,
            unanswered_um: [0; UNANSWERED],
            mm_per_min,
            speed_mm_per_s: mm_per_min.min(fastest) / 60.0,
            mm_per_s2: own(120).filter(is_fit).unwrap_or(USUAL_MM_PER_S2),
            from_mm: None,
            anchor: None,
            was_fast: false,
            falters: false,
        })
    }

    pub(super) fn feed(&mut self, cx: &mut Context) -> bool {
        let blocks = match usize::from(cx.known.info.options.blocks) {
            0 => USUAL_BLOCKS,
            blocks => blocks,
        };
        // Before the first report the start position is unknown.
        let Some(status) = &cx.known.status else { return false };
        if self.sent_um == 0 {
            self.from_mm = status.machine_mm.map(|place| place[self.axis]);
        }
        let Some(um) = self.next_um(cx.now_ms, blocks) else { return false };
        let mm = if self.back { -um } else { um } as f64 / 1e3;
        // A jog line names its own modes: `$J=` neither uses nor changes those in force.
        let text = format!("$J=G91G21{}{}F{}", AXES[self.axis], number(mm), number(self.mm_per_min));
        cx.send(&text, Meaning::Jog);
        true
    }

    /// A report; false if a hold at the machine ends the jog.
    pub(super) fn on_report(&mut self, cx: &Context, report: Report) -> bool {
        let Some(status) = &cx.known.status else { return true };
        match report.doing {
            ReportedState::Idle if report.fresh => {
                self.on_position(cx.now_ms, status.machine_mm, 0.0);
                // From standstill it accelerates again if it continues.
                (self.was_fast, self.falters) = (false, false);
            }
            ReportedState::Jog if report.fresh => {
                let feed = status.feed_mm_per_min.map_or(f64::INFINITY, |feed| feed / 60.0);
                self.on_position(cx.now_ms, status.machine_mm, feed);
            }
            ReportedState::Idle | ReportedState::Jog | ReportedState::Run => {}
            _ => return false,
        }
        true
    }

    /// True if a piece was accepted: the machine moves.
    pub(super) fn runs(&self) -> bool {
        self.answered_um > 0
    }

    /// True if a stopped jog continues: all pieces sent are done, and new pieces came late. Stopping earlier
    /// means that it was ended at the machine.
    pub(super) fn continues(&self, cx: &Context) -> bool {
        if self.sent_um >= self.way_um {
            return false;
        }
        let off_mm = self
            .gone_mm(cx.known.machine_mm())
            .map(|gone_mm| libm::fabs(gone_mm - self.sent_um as f64 / 1e3));
        let near_mm = ROUNDED_MM + 1.5 * cx.known.step_mm();
        self.sent_um == 0 || off_mm.is_some_and(|off_mm| off_mm <= near_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn move_of(mm: f64, speed_mm_per_s: f64, mm_per_s2: f64) -> Pieces {
        Pieces {
            axis: 0,
            back: false,
            way_um: (mm * 1e3) as i64,
            sent_um: 0,
            answered_um: 0,
            unanswered_um: [0; UNANSWERED],
            mm_per_min: speed_mm_per_s * 60.0,
            speed_mm_per_s,
            mm_per_s2,
            from_mm: Some(-100.0),
            anchor: None,
            was_fast: false,
            falters: false,
        }
    }

    /// Speed mm/s, acceleration mm/s², planner blocks: from a typical mill to controllers with factory
    /// settings, and slow cases.
    const ROWS: [(f64, f64, usize); 7] = [
        (16.67, 500.0, 15),
        (16.67, 10.0, 15),
        (5.0, 10.0, 15),
        (5.0, 200.0, 35),
        (1.3, 500.0, 15),
        (1.0, 10.0, 15),
        (0.3, 100.0, 15),
    ];

    #[test]
    fn jog_lookahead_is_minimal_and_never_runs_dry() {
        for (v, a, blocks) in ROWS {
            let mut jog = move_of(300.0, v, a);
            let brake_mm = v * v / (2.0 * a);
            let mut fewest_s = f64::INFINITY;
            let mut ends_um = std::collections::VecDeque::new();
            for ms in 0..12_000 {
                // Simulated controller: starts 10 ms after sending, accelerates to full speed, reports every
                // 200 ms.
                let t = f64::from(u32::try_from(ms).unwrap()) / 1e3 - 0.01;
                let at_mm = if t < v / a { 0.5 * a * t.max(0.0) * t.max(0.0) } else { v * t - brake_mm };
                if jog.unanswered_um[0] > 0 && ms % 10 == 0 && ms > 0 {
                    jog.on_answer(ms);
                }
                if ms % 200 == 100 {
                    jog.on_position(ms, Some([at_mm - 100.0, 0.0, 0.0]), (a * t).min(v));
                }
                if ms % 10 == 0 && jog.next_um(ms, blocks).is_some() {
                    ends_um.push_back(jog.sent_um);
                }
                ends_um.retain(|end_um| *end_um as f64 / 1e3 > at_mm);
                assert!(ends_um.len() <= blocks - 2, "room for another: {} of {blocks}", ends_um.len());
                let has_mm = jog.sent_um as f64 / 1e3 - at_mm;
                let lag_mm = if t < v / a { brake_mm } else { 0.0 };
                assert!(has_mm <= v * AHEAD_S + brake_mm + lag_mm + 0.05, "{v} {a}: {has_mm} mm at {ms} ms");
                if t > v / a && jog.sent_um < jog.way_um {
                    fewest_s = fewest_s.min((has_mm - brake_mm) / v);
                }
            }
            // 60 ms are what the firmware prepares, plus a margin.
            assert!(fewest_s > 0.07, "{v} {a}: {fewest_s} s");
            assert!(jog.sent_um as f64 / 1e3 > (11.0 * v).min(150.0), "{v} {a}");
        }
    }

    #[test]
    fn jog_distance_is_exact_in_single_precision() {
        let mut jog = move_of(20.0, 16.67, 500.0);
        let (mut place, mut ms) = (-1.0_f32, 0);
        while jog.sent_um < jog.way_um {
            ms += 7;
            if let Some(um) = jog.next_um(ms, 15) {
                place -= number(um as f64 / 1e3).parse::<f32>().unwrap();
                jog.on_answer(ms);
            }
        }
        assert_eq!(place.to_bits(), (-21.0_f32).to_bits(), "{place}");
    }

    #[test]
    fn silent_or_stopped_controller_gets_no_more_jog_lines() {
        let mut jog = move_of(300.0, 10.0, 100.0);
        let first: i64 = (0..5_000).filter_map(|ms| jog.next_um(ms, 15)).sum();
        assert_eq!(first, 2_500, "0.2 s and the way to rest");
        jog.on_answer(5_000);
        let more: i64 = (5_000..9_000).filter_map(|ms| jog.next_um(ms, 15)).sum();
        assert_eq!(more, 1_000, "two pieces wait for their answers");
        jog.on_answer(9_000);
        jog.on_position(9_000, Some([-99.0, 0.0, 0.0]), 0.0);
        assert_eq!(jog.next_um(9_000, 15), None, "by time it would be at its end, but it stands at 1 mm");
    }
}
