//! Homing, and whether the controller received `$H`. The line has no checksum, and many damaged forms of `$H`
//! are also answered `ok`.
//!
//! ```text
//!  $H ─┬─ ok after some time, and no other output ─▶ report ─┬─ axes where switches leave them ─▶ trusted
//!      │                                                     └─ elsewhere, twice ─▶ reported, not trusted
//!      ├─ ok at once, or after other output ─▶ not received: reset, reported
//!      └─ no ok, and reports of Idle ─▶ not received: reset, reported
//! ```
//!
//! Position where the limit switches leave an axis: `ends`.

use super::activity::Activity;
use super::context::{Context, Report};
use super::depth::TipDepth;
use super::heard::{HeardLine, ReportedState};
use super::line::{AfterReset, Meaning};
use crate::control::{BoardHeight, Trust};
use crate::{code, error};

/// Shortest time in which homing is possible.
const QUICKEST_MS: u64 = 150;
/// Status query interval during homing: some firmwares answer at once, GRBL only at the end.
const ASK_MS: u64 = 1_000;
/// Interval after the answer, and the longest wait for the position.
const ASK_SOON_MS: u64 = 100;
const TOLD_MS: u64 = 5_000;
/// Number of reports, Idle without an answer or from elsewhere, that count as proof.
const REPORTS: u32 = 2;

/// Observations since `$H` was sent.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Homing {
    other: bool,
    rests: u32,
    answered_ms: Option<u64>,
    /// Reports from a position where no limit switch leaves the axis.
    elsewhere: u32,
}

impl Homing {
    pub(super) fn start(cx: &mut Context) -> Activity {
        cx.send("$H", Meaning::Home);
        // An earlier query may be answered only after homing: that report must not count as fresh.
        cx.line.asked_ms = None;
        Activity::Homing(Self::default())
    }

    /// Silence is normal during homing.
    pub(super) fn on_time(self, cx: &mut Context) -> Activity {
        let now_ms = cx.now_ms;
        cx.line.heard_ms = now_ms;
        let is_resetting = cx.line.reset_at.is_some();
        if self.answered_ms.is_some_and(|answered| now_ms >= answered + TOLD_MS) && !is_resetting {
            cx.error(code!("grbl.no_report"));
            return Activity::Ready;
        }
        let wait_ms = if self.answered_ms.is_some() { ASK_SOON_MS } else { ASK_MS };
        if !is_resetting && now_ms >= cx.line.last_ask_ms.max(cx.since_ms) + wait_ms {
            cx.query();
        }
        Activity::Homing(self)
    }

    /// Notices output that homing never produces.
    pub(super) fn on_line(&mut self, heard: &HeardLine) {
        // A damaged `$H` can arrive as `$X`, `$`, `$I`, `$$` or `$G`.
        self.other |= match heard {
            HeardLine::Message(text) => text.contains("Unlocked"),
            HeardLine::Other(text) => text.starts_with("[HLP"),
            HeardLine::Version { .. }
            | HeardLine::Options(_)
            | HeardLine::Setting { .. }
            | HeardLine::Modes(_) => true,
            _ => false,
        };
    }

    pub(super) fn on_report(mut self, cx: &mut Context, report: Report) -> Activity {
        if self.answered_ms.is_some() && report.doing == ReportedState::Idle {
            return if report.fresh { self.judge_place(cx) } else { Activity::Homing(self) };
        }
        let rests = matches!(report.doing, ReportedState::Idle | ReportedState::Alarm);
        self.rests = if rests { self.rests + u32::from(report.fresh) } else { 0 };
        if self.rests >= REPORTS && cx.line.reset_at.is_none() {
            reset_unheard(cx);
        }
        Activity::Homing(self)
    }

    pub(super) fn on_answer(mut self, cx: &mut Context) -> Activity {
        if self.other || cx.now_ms < cx.since_ms + QUICKEST_MS {
            reset_unheard(cx);
        } else {
            // Older reports show positions before homing.
            (cx.known.status, cx.line.asked_ms) = (None, None);
            self.answered_ms = Some(cx.now_ms);
        }
        Activity::Homing(self)
    }

    /// The machine stopped after homing: the position shows the ends of each axis, or that an axis did not
    /// look for its switch.
    fn judge_place(mut self, cx: &mut Context) -> Activity {
        let known = &mut cx.known;
        let Some(place) = known.machine_mm() else { return Activity::Homing(self) };
        let judged: [_; 3] = core::array::from_fn(|axis| known.info.ends_by(axis, place[axis]));
        let Some(axis) = (0..3).find(|axis| judged[*axis].is_none()) else {
            known.ends = judged.map(Option::flatten);
            known.trust = Trust::Trusted;
            // Homing leaves Z fully up.
            known.depth = TipDepth::default();
            return Activity::Ready;
        };
        self.elsewhere += 1;
        if self.elsewhere < REPORTS {
            return Activity::Homing(self);
        }
        let why = error!("grbl.home_elsewhere", axis = ["X", "Y", "Z"][axis], ..);
        cx.found(why.with("place", format!("{:.3}", place[axis])));
        Activity::Ready
    }
}

/// The controller did not receive `$H`.
fn reset_unheard(cx: &mut Context) {
    cx.error(code!("grbl.home_unheard"));
    cx.reset();
}

impl Activity {
    pub(super) fn home(self, cx: &mut Context) -> Self {
        if !cx.known.homes() {
            cx.error(code!("grbl.cannot_home"));
            return self;
        }
        // If the position was unknown, homing moves the coordinates, so the board height is no longer valid.
        if cx.known.trust != Trust::Trusted {
            cx.known.height = BoardHeight::Unknown;
        }
        // Homing that fails halfway leaves the axes anywhere.
        cx.known.trust = Trust::Lost;
        if cx.line.needs_reset {
            cx.line.after_reset = Some(AfterReset::Home);
            cx.reset();
            return self;
        }
        Homing::start(cx)
    }
}
