//! A move by jog lines, which STOP ends: a jog by the user, the way to the park position, a lift.

use super::activity::Activity;
use super::asks::realtime;
use super::context::{Context, Report};
use super::heard::ReportedState;
use super::job::Job;
use super::park::Park;
use super::pieces::Pieces;
use crate::control::Ending;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum JogEnd {
    #[default]
    NotYet,
    /// No longer wanted.
    Asked,
    /// STOP was pressed: a second STOP resets at once.
    Stopped,
}

#[derive(Debug)]
pub(super) struct Jogging {
    pub(super) job: Option<Box<Job>>,
    pub(super) way: Way,
    end: JogEnd,
}

#[derive(Clone, Debug)]
pub(super) enum Way {
    /// Only what was sent or queued.
    Sent,
    Pieces(Pieces),
    Park(Park),
}

impl Jogging {
    pub(super) fn new(job: Option<Box<Job>>, way: Way) -> Self {
        Self { job, way, end: JogEnd::NotYet }
    }

    /// The lines of the move are queued.
    pub(super) fn sent(job: Option<Box<Job>>) -> Activity {
        Activity::Jogging(Self::new(job, Way::Sent))
    }

    pub(super) fn is_to_end(&self) -> bool {
        self.end != JogEnd::NotYet
    }

    /// True while more of the jog is to be sent: it is paced by reports.
    pub(super) fn is_paced(&self) -> bool {
        matches!(self.way, Way::Pieces(_))
    }

    pub(super) fn feed(&mut self, cx: &mut Context) -> bool {
        let may = !self.is_to_end() && cx.line.reset_at.is_none();
        if let Way::Pieces(pieces) = &mut self.way { may && pieces.feed(cx) } else { false }
    }

    pub(super) fn on_answer(&mut self, now_ms: u64) {
        if let Way::Pieces(pieces) = &mut self.way {
            pieces.on_answer(now_ms);
        }
    }

    /// A line was refused, for instance at the end of travel. True if an earlier piece runs, at whose end the
    /// machine stops.
    pub(super) fn on_refusal(&mut self) -> bool {
        let runs = matches!(&self.way, Way::Pieces(pieces) if pieces.runs());
        self.drop_pieces();
        runs
    }

    pub(super) fn without_job(mut self) -> Self {
        self.drop_pieces();
        Self { job: None, ..self }
    }

    fn drop_pieces(&mut self) {
        if self.is_paced() {
            self.way = Way::Sent;
        }
    }

    pub(super) fn on_report(mut self, cx: &mut Context, report: Report) -> Activity {
        if let Way::Pieces(pieces) = &mut self.way
            && !pieces.on_report(cx, report)
        {
            self.way = Way::Sent;
        }
        let continues = matches!(&self.way, Way::Pieces(pieces) if pieces.continues(cx));
        if report.is_idle() && cx.line.is_empty() && !continues {
            return self.on_rest(cx);
        }
        if self.is_to_end() && report.doing == ReportedState::Jog {
            // The cancel was lost, or came before the move began.
            cx.write(realtime::JOG_CANCEL);
        } else if self.is_to_end() && report.doing.is_held_at_rest() {
            // A jog that a door or a button holds never ends by itself. At standstill a reset keeps the
            // position.
            self.drop_pieces();
            cx.reset();
        }
        Activity::Jogging(self)
    }

    /// The machine stopped, and nothing was sent that continues.
    fn on_rest(mut self, cx: &mut Context) -> Activity {
        // GRBL 1.1h reports Idle but reads no more lines if a jog cancel arrives just as the jog ends. A resume
        // ends that, and moves nothing: nothing is planned.
        if self.is_to_end() {
            cx.write(realtime::RESUME);
        }
        if let Way::Park(park) = &self.way
            && let Some(park) = park.next(cx, self.is_to_end())
        {
            self.way = Way::Park(park);
            return Activity::Jogging(self);
        }
        Activity::Jogging(self).rest(cx)
    }

    /// Ends the move, including pieces not yet sent.
    pub(super) fn cancel(&mut self, cx: &mut Context) {
        cx.line.queue.retain(|next| !next.text.starts_with("$J="));
        self.drop_pieces();
        self.end = JogEnd::Asked;
        cx.write(realtime::JOG_CANCEL);
    }

    /// STOP. A second one resets at once, even if the position is lost; a double click is one press.
    pub(super) fn on_stop(mut self, cx: &mut Context, before_ms: Option<u64>, is_before: bool) -> Activity {
        if self.end == JogEnd::Stopped {
            if is_before {
                cx.stopped_ms = before_ms;
            } else {
                cx.known.lose_place();
                self.drop_pieces();
                cx.reset();
            }
            return Activity::Jogging(self);
        }
        self.cancel(cx);
        if self.job.is_some() {
            // STOP in a tool change ends the job, not only the jog.
            return Activity::Jogging(self).stop(cx, Ending::Stopped);
        }
        self.end = JogEnd::Stopped;
        Activity::Jogging(self)
    }
}
