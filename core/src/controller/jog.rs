//! A move by hand, sent in pieces: the board never has much more of it than it needs to come to rest, so that it does not go on for long
//! when nobody feeds it any more: a cable that slipped out, a page that hangs.
//!
//! ```text
//! begun ───────── gone ─── 0.2 s of the way ─── v²/2a ──┤ end of what was sent: there it comes to rest if nothing follows
//!                  └ at least, by answers, reports and time
//! ```
//!
//! Comes in: how far, answers, reports, time. Goes out: `$J` lines. mm, s and ms. Does not know who wants it, or for how long.

use super::asks::EnginePhase;
use super::engine::{Controller, Meaning};
use super::heard::ReportedState;
use super::lines::number;
use super::settings;
use super::timing::USUAL_BLOCKS;
use crate::diagnostic::Diagnostic;

/// Longest move by hand, mm.
const FURTHEST_MM: f64 = 1_000.0;
/// Seconds of the way that the board has at full speed, beyond what it needs to come to rest.
const AHEAD_S: f64 = 0.2;
/// A piece is at least so long: seconds of the way at full speed.
const PIECE_S: f64 = 0.04;
/// And so long, µm: none is shorter than a step.
const SMALLEST_UM: i64 = 20;
/// All but the last are so many times this, an eighth of a millimetre: that a board adds up in single precision without a rest.
const EVEN_UM: i64 = 125;
/// Blocks of the planner that stay free: a line for which there is no room is run after a jog cancel all the same.
const FREE_BLOCKS: usize = 3;
/// Pieces that wait for their answers.
const UNANSWERED: usize = 2;
/// Acceleration where nobody knows, mm/s².
const USUAL_MM_PER_S2: f64 = 100.0;
/// Full speed, as reports have it.
const FAST_SHARE: f64 = 0.95;
/// What reports round, mm.
const ROUNDED_MM: f64 = 0.01;
const AXES: [char; 3] = ['X', 'Y', 'Z'];

/// Whether a move by hand is to end before its time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum JogEnd {
    /// No.
    #[default]
    NotYet,
    /// Nobody wants it any more.
    Asked,
    /// STOP was pressed: a second one does not wait for its rest.
    Stopped,
}

/// A move by hand that is not all sent, or not at its end.
#[derive(Clone, Debug)]
pub(super) struct JogRun {
    axis: usize,
    /// Towards smaller numbers.
    back: bool,
    /// How far in all, how far was sent, how far of that was answered, µm.
    way_um: i64,
    sent_um: i64,
    answered_um: i64,
    /// Pieces that were not answered, oldest first, µm.
    unanswered_um: [i64; UNANSWERED],
    mm_per_min: f64,
    speed_mm_per_s: f64,
    mm_per_s2: f64,
    /// Where it began, machine coordinates, once something is sent and where that is told.
    from_mm: Option<f64>,
    /// At least so far it was, and when, as if it had been at full speed then: mm, ms.
    anchor: Option<(f64, u64)>,
    /// It was at full speed; it is slower than that although it has some way to go: nothing is sent before that is clear.
    was_fast: bool,
    falters: bool,
}

impl JogRun {
    /// The way that it takes to come to rest from full speed, mm.
    fn brake_mm(&self) -> f64 {
        self.speed_mm_per_s * self.speed_mm_per_s / (2.0 * self.mm_per_s2)
    }

    /// How far it has gone at least, µm.
    fn gone_um(&self, now_ms: u64) -> i64 {
        let Some((mm, ms)) = self.anchor else { return 0 };
        let gone_mm = mm + self.speed_mm_per_s * now_ms.saturating_sub(ms) as f64 / 1e3;
        ((gone_mm * 1e3) as i64).clamp(0, self.answered_um)
    }

    /// The next piece, if one is due, µm; `blocks` is what the planner holds.
    fn next_um(&mut self, now_ms: u64, blocks: usize) -> Option<i64> {
        let left_um = self.way_um - self.sent_um;
        let ahead_mm = self.speed_mm_per_s * AHEAD_S + self.brake_mm();
        let pieces = blocks.saturating_sub(FREE_BLOCKS).max(2) as f64;
        let piece_mm = (self.speed_mm_per_s * PIECE_S).max(ahead_mm / pieces);
        let ahead_um = ((ahead_mm * 1e3) as i64).max(SMALLEST_UM);
        // Where so little is ahead that there is hardly an eighth in it, they are as they come.
        let even_um = if ahead_um >= 4 * EVEN_UM { EVEN_UM } else { 1 };
        let piece_um = ((piece_mm * 1e3) as i64).max(SMALLEST_UM);
        // Not shorter for being even: the planner has room for so many.
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
        // It has begun by now at the latest.
        let brake_mm = self.brake_mm();
        self.anchor.get_or_insert((-brake_mm, now_ms));
    }

    /// How far it is from where it began, mm.
    fn gone_mm(&self, place_mm: Option<[f64; 3]>) -> Option<f64> {
        let gone_mm = place_mm?[self.axis] - self.from_mm?;
        Some(if self.back { -gone_mm } else { gone_mm })
    }

    /// It was at `place_mm` a moment ago, at most so fast.
    fn is_reported(&mut self, now_ms: u64, place_mm: Option<[f64; 3]>, mm_per_s: f64) {
        let is_fast = mm_per_s >= FAST_SHARE * self.speed_mm_per_s;
        self.falters = self.was_fast && !is_fast && self.sent_um < self.way_um;
        self.was_fast |= is_fast;
        if let (Some(gone_mm), Some(_)) = (self.gone_mm(place_mm), self.anchor) {
            // What it lacks of full speed it makes up on the way.
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

    /// Whether a move by hand is to end before its time.
    pub(super) fn jog_is_to_end(&self) -> bool {
        self.jog_end != JogEnd::NotYet
    }

    /// Puts the next piece of a move by hand into the queue, if one is due.
    pub(super) fn feed_jog(&mut self) -> bool {
        if self.phase != EnginePhase::Jogging || self.jog_is_to_end() || self.reset_at.is_some() {
            return false;
        }
        let blocks = match usize::from(self.info.options.blocks) {
            0 => USUAL_BLOCKS,
            blocks => blocks,
        };
        // Before the first report nobody knows where it begins.
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

    /// A piece was taken.
    pub(super) fn jog_answered(&mut self) {
        if let Some(jog) = &mut self.jog {
            jog.is_answered(self.now_ms);
        }
    }

    /// A piece was refused, as where the board itself knows the end of the way. Gives whether there is one before it, at whose end it
    /// comes to rest.
    pub(super) fn jog_refused(&mut self) -> bool {
        let jogs = self.phase == EnginePhase::Jogging;
        self.jog.take().is_some_and(|jog| jogs && jog.answered_um > 0)
    }

    /// A report while it moves by hand.
    pub(super) fn jog_reported(&mut self, doing: ReportedState, fresh: bool) {
        let (now_ms, Some(status), Some(jog)) = (self.now_ms, &self.status, &mut self.jog) else { return };
        match doing {
            ReportedState::Idle if fresh => {
                jog.is_reported(now_ms, status.machine_mm, 0.0);
                // From rest it begins anew, where it goes on.
                (jog.was_fast, jog.falters) = (false, false);
            }
            ReportedState::Jog if fresh => {
                let feed = status.feed_mm_per_min.map_or(f64::INFINITY, |feed| feed / 60.0);
                jog.is_reported(now_ms, status.machine_mm, feed);
            }
            ReportedState::Idle | ReportedState::Jog | ReportedState::Run => {}
            // Somebody held it at the board: that ends it.
            _ => self.jog = None,
        }
    }

    /// Whether a move by hand that rests goes on: all that was sent is done, and the rest came late. One that rests before that was ended
    /// at the board.
    pub(super) fn jog_goes_on(&self) -> bool {
        let Some(jog) = self.jog.as_ref().filter(|jog| jog.sent_um < jog.way_um) else { return false };
        let place_mm = self.status.as_ref().and_then(|status| status.machine_mm);
        let off_mm = jog.gone_mm(place_mm).map(|gone_mm| libm::fabs(gone_mm - jog.sent_um as f64 / 1e3));
        jog.sent_um == 0 || off_mm.is_some_and(|off_mm| off_mm <= ROUNDED_MM + 1.5 * self.step_mm())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn move_of(mm: f64, speed_mm_per_s: f64, mm_per_s2: f64) -> JogRun {
        JogRun {
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

    /// Speed, acceleration, blocks: from what a mill does to boards as they come out of the box, and slowly.
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
    fn the_board_never_has_more_than_it_needs_and_at_full_speed_never_less() {
        for (v, a, blocks) in ROWS {
            let mut jog = move_of(300.0, v, a);
            let brake_mm = v * v / (2.0 * a);
            let mut fewest_s = f64::INFINITY;
            let mut ends_um = std::collections::VecDeque::new();
            for ms in 0..12_000 {
                // The board: taken 10 ms after it was sent, faster until it is at full speed, reports every 200 ms.
                let t = f64::from(u32::try_from(ms).unwrap()) / 1e3 - 0.01;
                let at_mm = if t < v / a { 0.5 * a * t.max(0.0) * t.max(0.0) } else { v * t - brake_mm };
                if jog.unanswered_um[0] > 0 && ms % 10 == 0 && ms > 0 {
                    jog.is_answered(ms);
                }
                if ms % 200 == 100 {
                    jog.is_reported(ms, Some([at_mm - 100.0, 0.0, 0.0]), (a * t).min(v));
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
            // What the firmware makes ready, 60 ms, and some more.
            assert!(fewest_s > 0.07, "{v} {a}: {fewest_s} s");
            assert!(jog.sent_um as f64 / 1e3 > (11.0 * v).min(150.0), "{v} {a}");
        }
    }

    #[test]
    fn what_a_board_adds_up_in_single_precision_is_the_place_and_nothing_beside_it() {
        let mut jog = move_of(20.0, 16.67, 500.0);
        let (mut place, mut ms) = (-1.0_f32, 0);
        while jog.sent_um < jog.way_um {
            ms += 7;
            if let Some(um) = jog.next_um(ms, 15) {
                place -= number(um as f64 / 1e3).parse::<f32>().unwrap();
                jog.is_answered(ms);
            }
        }
        assert_eq!(place.to_bits(), (-21.0_f32).to_bits(), "{place}");
    }

    #[test]
    fn nothing_more_is_sent_to_a_board_that_does_not_answer_or_stands_still() {
        let mut jog = move_of(300.0, 10.0, 100.0);
        let first: i64 = (0..5_000).filter_map(|ms| jog.next_um(ms, 15)).sum();
        assert_eq!(first, 2_500, "0.2 s and the way to rest");
        jog.is_answered(5_000);
        let more: i64 = (5_000..9_000).filter_map(|ms| jog.next_um(ms, 15)).sum();
        assert_eq!(more, 1_000, "two pieces wait for their answers");
        jog.is_answered(9_000);
        jog.is_reported(9_000, Some([-99.0, 0.0, 0.0]), 0.0);
        assert_eq!(jog.next_um(9_000, 15), None, "by time it would be at its end, but it stands at 1 mm");
    }
}
