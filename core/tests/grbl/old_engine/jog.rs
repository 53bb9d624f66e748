//! A jog is sent in pieces: the controller never has much more than its stopping distance. If the connection
//! or the page fails, the jog ends soon.
//!
//! ```text
//!  start ───────── gone ─── 0.2 s of travel ─── v²/2a ──┤ end of the pieces sent: stops here by itself
//!                  └ lower bound, from answers, reports and time
//! ```

use super::asks::EnginePhase;
use super::engine::{Controller, Meaning};
use super::heard::ReportedState;
use super::lines::number;
use super::settings;
use super::timing::USUAL_BLOCKS;
use annulus_core::diagnostic::Diagnostic;

const FURTHEST_MM: f64 = 1_000.0;
const AHEAD_S: f64 = 0.2;
const PIECE_S: f64 = 0.04;
const SMALLEST_UM: i64 = 20;
/// All pieces but the last are multiples of 1/8 mm: controllers add these in single precision without error.
const EVEN_UM: i64 = 125;
/// Planner blocks that stay free: a line that waits for a block still runs after a jog cancel.
const FREE_BLOCKS: usize = 3;
const UNANSWERED: usize = 2;
const USUAL_MM_PER_S2: f64 = 100.0;
const FAST_SHARE: f64 = 0.95;
const ROUNDED_MM: f64 = 0.01;
const AXES: [char; 3] = ['X', 'Y', 'Z'];

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum JogEnd {
    #[default]
    NotYet,
    Asked,
    Stopped,
}

#[derive(Clone, Debug)]
pub(super) struct JogRun {
    axis: usize,
    back: bool,
    way_um: i64,
    sent_um: i64,
    answered_um: i64,
    unanswered_um: [i64; UNANSWERED],
    mm_per_min: f64,
    speed_mm_per_s: f64,
    mm_per_s2: f64,
    from_mm: Option<f64>,
    /// Lower bound of the travel, mm, at a time, ms; later travel is extrapolated at full speed.
    anchor: Option<(f64, u64)>,
    was_fast: bool,
    /// The machine slowed down again in mid-travel: nothing is sent until the reason is clear.
    falters: bool,
}

impl JogRun {
    fn brake_mm(&self) -> f64 {
        self.speed_mm_per_s * self.speed_mm_per_s / (2.0 * self.mm_per_s2)
    }

    fn gone_um(&self, now_ms: u64) -> i64 {
        let Some((mm, ms)) = self.anchor else { return 0 };
        let gone_mm = mm + self.speed_mm_per_s * now_ms.saturating_sub(ms) as f64 / 1e3;
        ((gone_mm * 1e3) as i64).clamp(0, self.answered_um)
    }

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

    fn is_answered(&mut self, now_ms: u64) {
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

    fn is_reported(&mut self, now_ms: u64, place_mm: Option<[f64; 3]>, mm_per_s: f64) {
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

impl Controller {
    pub(super) fn jog(&mut self, axis: u8, um: i32, mm_per_min: f64) {
        let axis = usize::from(axis);
        let is_far = libm::fabs(f64::from(um) / 1e3) > FURTHEST_MM;
        if axis >= AXES.len() || is_far || !(mm_per_min > 0.0 && mm_per_min.is_finite()) {
            return self.found(Diagnostic::error("grbl.not_now"));
        }
        let own = |first| settings::axes(&self.info.values, first).map(|values: [f64; 3]| values[axis]);
        let is_fit = |value: &f64| value.is_finite() && *value > 0.0;
        let fastest = own(110).filter(is_fit).unwrap_or(f64::INFINITY);
        self.jog = Some(JogRun {
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
        });
        self.set(EnginePhase::Jogging);
    }

    pub(super) fn jog_is_to_end(&self) -> bool {
        self.jog_end != JogEnd::NotYet
    }

    pub(super) fn feed_jog(&mut self) -> bool {
        if self.phase != EnginePhase::Jogging || self.jog_is_to_end() || self.reset_at.is_some() {
            return false;
        }
        let blocks = match usize::from(self.info.options.blocks) {
            0 => USUAL_BLOCKS,
            blocks => blocks,
        };
        // Before the first report the start position is unknown.
        let (Some(status), Some(jog)) = (&self.status, &mut self.jog) else { return false };
        if jog.sent_um == 0 {
            jog.from_mm = status.machine_mm.map(|place| place[jog.axis]);
        }
        let Some(um) = jog.next_um(self.now_ms, blocks) else { return false };
        let mm = if jog.back { -um } else { um } as f64 / 1e3;
        let text = format!("$J=G91G21{}{}F{}", AXES[jog.axis], number(mm), number(jog.mm_per_min));
        self.send(&text, Meaning::Jog);
        true
    }

    pub(super) fn jog_answered(&mut self) {
        if let Some(jog) = &mut self.jog {
            jog.is_answered(self.now_ms);
        }
    }

    /// A piece was refused, for instance at the end of travel. True if an earlier piece runs, at whose end
    /// the machine stops.
    pub(super) fn jog_refused(&mut self) -> bool {
        let jogs = self.phase == EnginePhase::Jogging;
        self.jog.take().is_some_and(|jog| jogs && jog.answered_um > 0)
    }

    pub(super) fn jog_reported(&mut self, doing: ReportedState, fresh: bool) {
        let (now_ms, Some(status), Some(jog)) = (self.now_ms, &self.status, &mut self.jog) else { return };
        match doing {
            ReportedState::Idle if fresh => {
                jog.is_reported(now_ms, status.machine_mm, 0.0);
                // From standstill it accelerates again if it continues.
                (jog.was_fast, jog.falters) = (false, false);
            }
            ReportedState::Jog if fresh => {
                let feed = status.feed_mm_per_min.map_or(f64::INFINITY, |feed| feed / 60.0);
                jog.is_reported(now_ms, status.machine_mm, feed);
            }
            ReportedState::Idle | ReportedState::Jog | ReportedState::Run => {}
            // A hold at the machine ends the jog.
            _ => self.jog = None,
        }
    }

    /// True if a stopped jog continues: all pieces sent are done, and new pieces came late. Stopping earlier
    /// means that it was ended at the machine.
    pub(super) fn jog_goes_on(&self) -> bool {
        let Some(jog) = self.jog.as_ref().filter(|jog| jog.sent_um < jog.way_um) else { return false };
        let place_mm = self.status.as_ref().and_then(|status| status.machine_mm);
        let off_mm = jog.gone_mm(place_mm).map(|gone_mm| libm::fabs(gone_mm - jog.sent_um as f64 / 1e3));
        jog.sent_um == 0 || off_mm.is_some_and(|off_mm| off_mm <= ROUNDED_MM + 1.5 * self.step_mm())
    }
}
