//! Executes the user's commands; rejects those that the current activity does not allow.

use super::activity::Activity;
use super::asks::{EngineAsk, realtime};
use super::checking::Checking;
use super::context::Context;
use super::jogging::{Jogging, Way};
use super::known::Known;
use super::line::{Meaning, ZeroWanted};
use super::lines::number;
use super::park::Park;
use super::pieces::Pieces;
use super::probing::Probing;
use super::running::Running;
use super::surveying::Surveying;
use crate::control::{Ending, is_same_press};
use crate::diagnostic::Diagnostic;
use crate::{code, error, note};

impl Known {
    /// Why this command must not be executed now, with the machine at rest.
    fn forbids(&self, ask: &EngineAsk, in_job: bool) -> Option<Diagnostic> {
        use EngineAsk::{Edge, Jog, Probe, SetZero, ZeroAt};
        let sets_zero = matches!(ask, SetZero { .. } | ZeroAt { .. } | Probe { .. } | Edge { .. });
        if sets_zero && self.is_to_be_homed() {
            return Some(error!("grbl.not_homed"));
        }
        // A closed probe input: another touch could not be detected, and sideways the tip breaks. A survey
        // lifts the tip first and then checks the input.
        match ask {
            Probe { .. } | Edge { .. } if self.contact_is_closed() => {
                return Some(error!("grbl.probe_closed"));
            }
            Jog { axis: 0 | 1, .. } if self.contact_is_closed() => {
                return Some(error!("grbl.tip_touches"));
            }
            // No sideways jogs while the tip is, or may be, in the board.
            Jog { axis: 0 | 1, anyway: false, .. } => {
                let mm = format!("{:.2}", self.lift_first_mm()?);
                return Some(error!("control.tip_low", mm = mm));
            }
            _ => {}
        }
        // In a job, an offset that its tool changer needs forbids a new zero.
        let off_mm = self.offset_in_force().filter(|_| sets_zero && in_job)?;
        Some(error!("grbl.offset_in_force", mm = format!("{off_mm:.3}")))
    }
}

impl Activity {
    /// Executes the command, or reports why it is not possible now.
    pub(super) fn on_ask(self, cx: &mut Context, ask: EngineAsk) -> Self {
        if self.is_at_rest(cx)
            && let Some(why) = cx.known.forbids(&ask, self.job().is_some())
        {
            cx.found(why);
            return self;
        }
        match (ask, self) {
            (EngineAsk::Stop, activity) => activity.on_stop(cx),
            (EngineAsk::StopAfter, activity) => activity.on_stop_after(cx),
            (EngineAsk::Hold, Self::Running(running)) if running.moves() => running.hold(cx),
            (EngineAsk::Hold, Self::Surveying(mut surveying)) if surveying.may_hold() => {
                surveying.hold();
                Self::Surveying(surveying)
            }
            (EngineAsk::Resume, Self::Surveying(surveying)) if surveying.is_held() => surveying.resume(cx),
            (EngineAsk::Resume, Self::Running(running)) if running.is_held() => running.resume(cx),
            (EngineAsk::Resume, activity) if activity.is_held_at_machine(cx) => {
                // Lines got no answer during the hold: their time starts again.
                (cx.hold_reports, cx.line.rests_overdue, cx.line.moved_ms) = (0, 0, cx.now_ms);
                cx.write(realtime::RESUME);
                activity
            }
            (EngineAsk::Override { of, percent }, activity) if activity.takes_overrides(cx) => {
                let reported = cx.known.overrides().map(|all| all[of as usize]);
                if let Err(why) = cx.overrides.ask(of, percent, reported) {
                    cx.found(why);
                }
                activity
            }
            (EngineAsk::JogCancel, Self::Jogging(mut jogging)) => {
                jogging.cancel(cx);
                Self::Jogging(jogging)
            }
            (EngineAsk::Home, activity @ (Self::Ready | Self::Locked(_))) => activity.home(cx),
            (EngineAsk::Unlock, Self::Locked(locked)) => {
                locked.unlock(cx);
                Self::Locked(locked)
            }
            (EngineAsk::Start(start), Self::Ready) => Running::start(cx, &start),
            (EngineAsk::ToolBefore { section }, mut activity) => {
                if let Some(job) = activity.job_mut() {
                    job.tool_before = Some(section);
                }
                activity
            }
            (EngineAsk::ToolReady, Self::ToolChange(mut change)) => {
                change.ready_ms = Some(cx.now_ms);
                Self::ToolChange(change)
            }
            (EngineAsk::NewBit, activity) => {
                cx.known.change_tool(activity.job().is_some_and(|job| job.has_equal_tools()));
                activity
            }
            (ask, activity) if activity.is_at_rest(cx) => activity.on_ask_at_rest(cx, ask),
            (_, activity) => activity.not_now(cx),
        }
    }

    fn not_now(self, cx: &mut Context) -> Self {
        cx.error(code!("grbl.not_now"));
        self
    }

    /// Commands that a machine at rest takes, also while a job waits for its tool. The XY zero is fixed
    /// meanwhile.
    fn on_ask_at_rest(self, cx: &mut Context, ask: EngineAsk) -> Self {
        let in_job = self.job().is_some();
        match ask {
            EngineAsk::Jog { axis, um, mm_per_min, .. } => match Pieces::start(cx, axis, um, mm_per_min) {
                Some(pieces) => Self::Jogging(Jogging::new(self.into_job(), Way::Pieces(pieces))),
                None => self.not_now(cx),
            },
            EngineAsk::SetZero { axes: axes @ [x, y, _], height_mm } if !in_job || !(x || y) => {
                cx.set_zero(axes, height_mm, in_job);
                self
            }
            EngineAsk::Probe { depth_mm, mm_per_min, plate_mm, up_mm } => {
                let down = format!("G91G38.2Z-{}F{}", number(depth_mm.abs()), number(mm_per_min));
                Probing::down(cx, self.into_job(), &down, Meaning::Probe { plate_mm, up_mm })
            }
            ask if !in_job => Self::on_ask_ready(cx, ask),
            _ => self.not_now(cx),
        }
    }

    /// Commands that need a machine at rest without a job.
    fn on_ask_ready(cx: &mut Context, ask: EngineAsk) -> Self {
        let started = match ask {
            EngineAsk::Survey(start) => Surveying::start(cx, start).map(Self::Surveying),
            EngineAsk::Check { routine, written } => {
                Checking::start(cx, &routine, written).map(Self::Checking)
            }
            EngineAsk::Park { from_low_mm } => {
                let park = Park::start(cx, from_low_mm);
                park.map(|park| Self::Jogging(Jogging::new(None, Way::Park(park))))
            }
            EngineAsk::ZeroAt { place_mm } => {
                cx.drop_offsets();
                cx.write_zero(place_mm, ZeroWanted::default());
                Ok(Self::Ready)
            }
            EngineAsk::Edge { axis, reach_mm, mm_per_min, radius_mm, back_mm } if axis < 2 => {
                Ok(Probing::edge(cx, usize::from(axis), reach_mm, mm_per_min, [radius_mm, back_mm]))
            }
            EngineAsk::Set { number: setting, value } => {
                cx.send(&format!("${setting}={}", number(value)), Meaning::Written);
                // Read back, because the line has no checksum.
                cx.send("$$", Meaning::Written);
                Ok(Self::Ready)
            }
            _ => Err(error!("grbl.not_now")),
        };
        started.unwrap_or_else(|why| {
            cx.found(why);
            Self::Ready
        })
    }

    fn on_stop(self, cx: &mut Context) -> Self {
        // STOP cancels the `$X` or `$H` that was to follow a reset.
        cx.line.after_reset = None;
        let before_ms = cx.stopped_ms.replace(cx.now_ms);
        let is_before = is_same_press(before_ms, cx.now_ms);
        match self {
            Self::Jogging(jogging) => return jogging.on_stop(cx, before_ms, is_before),
            Self::Checking(mut checking) => {
                checking.leave(cx, Some(note!("grbl.check_stopped")));
                return Self::Checking(checking);
            }
            // A controller that has not sent its banner may be moving.
            Self::Identify(ref identify) if identify.is_silent() => cx.write(realtime::HOLD),
            Self::Closed | Self::Identify(_) => {}
            // A double click is one press: only a deliberate second STOP may cost the position.
            Self::Stopping(_) if is_before => cx.stopped_ms = before_ms,
            // Second STOP: reset at once, even if the position is lost.
            Self::Stopping(_) | Self::Homing(_) => {
                cx.known.lose_place();
                cx.reset();
            }
            Self::Locked(_) => cx.reset(),
            _ => return self.stop(cx, Ending::Stopped),
        }
        self
    }

    /// Ends a job that waits for a tool, or that is held, at once; the section that was held is not done.
    fn on_stop_after(mut self, cx: &mut Context) -> Self {
        match &mut self {
            Self::Running(running) if !running.is_held() => running.job.stops_after = true,
            Self::Running(_) => return self.stop(cx, Ending::Stopped),
            Self::ToolChange(_) => return self.stop(cx, Ending::StoppedAfterHole),
            _ => return self.not_now(cx),
        }
        self
    }
}
