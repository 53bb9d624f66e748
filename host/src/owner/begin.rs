//! Arms, starts and ends jobs. The start is durable in the journal before anything moves.
//!
//! ```text
//! Start ─▶ allowed? ─▶ journal ──── fsync ────▶ still allowed? ─▶ moves ─▶ queued messages
//!                         meanwhile: STOP, alarms, status, change of control; other requests queue
//! ```

use super::moves::ruler;
use super::work::Work;
use super::{Message, Owner, zero_of};
use crate::journal::{JobRecord, Record};
use crate::prepare::{Broken, Context, Prepared};
use crate::ticket::Ticket;
use annulus_core::control::{Action, Ending, Event, step};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::wire::{Ask, JobEnd, Tell};
use std::sync::Arc;
use std::sync::mpsc::Sender;

type Reply = Sender<Result<Vec<Tell>, Diagnostic>>;

/// A job whose start is being written to the journal.
pub(crate) struct Starting {
    event: Event,
    work: Work,
    record: JobRecord,
    asked: Ticket,
    reply: Reply,
    stopped: bool,
    waits: Vec<Message>,
}

/// Returns `true` if `message` must wait until the start of the job is durable.
fn waits(message: &Message) -> bool {
    match message {
        Message::Ask { ask, .. } => *ask != Ask::Stop,
        Message::Context(_) | Message::Prepared { .. } | Message::InWork(_) | Message::Anew(_) => true,
        _ => false,
    }
}

impl Owner {
    /// The drill's state, as needed to prepare a job.
    pub fn context(&self) -> Context {
        let offer = self.interrupted.as_ref().filter(|_| self.work.is_none());
        Context {
            machine: self.machine.clone(),
            zero: self.session.zero(),
            state: self.session.state,
            trust: self.session.trust,
            safe_hz: self.timing.as_ref().map(|timing| timing.safe_hz),
            spindle_answers: self.spindle_answers(),
            wear: self.wear.clone(),
            stock: self.machine.has_magazine().then(|| self.tools.stock.clone()),
            offer: offer.map(|(job, progress)| Broken {
                key: job.key.clone(),
                next_leg: progress.done,
                zero_steps: zero_of(job, &self.machine),
                levelled: job.levelled.clone(),
            }),
            surface: self.surface.clone(),
            known: self.known.clone(),
        }
    }

    pub fn arm(&mut self, prepared: Prepared) -> Result<Vec<Tell>, Diagnostic> {
        if self.context() != prepared.context {
            return Err(error!("control.changed_meanwhile"));
        }
        let tell = prepared.tell();
        let event = match prepared.refusal() {
            None => Event::Armed { job: prepared.key.clone(), digest: prepared.digest.clone() },
            Some(_) => Event::Disarmed { position_lost: false },
        };
        self.try_event(event)?;
        self.prepared = Some(Arc::new(prepared));
        self.tell(tell.clone());
        Ok(vec![tell])
    }

    /// Writes the start of the armed job to the journal, if it may start. Does not block on the disk.
    pub(crate) fn begin(&mut self, event: Event, asked: Ticket, reply: Reply) {
        match self.to_be_started(&event) {
            Ok((work, record)) => {
                let begin = Record::Begin {
                    job: Box::new(record.clone()),
                    progress: work.progress(),
                    program: work.job.bytes.clone(),
                };
                let (stopped, waits) = (false, Vec::new());
                self.starting = Some(Starting { event, work, record, asked, reply, stopped, waits });
                self.outside.record(begin);
                if !self.outside.records() {
                    self.begun(Err(error!("control.shut_down")));
                }
            }
            Err(why) => drop(reply.send(Err(why))),
        }
    }

    /// Queues `message` if the start of a job must come first.
    pub(crate) fn in_turn(&mut self, message: Message) -> Option<Message> {
        match &mut self.starting {
            Some(starting) if waits(&message) => {
                starting.waits.push(message);
                None
            }
            _ => Some(message),
        }
    }

    pub(crate) fn stop_start(&mut self) {
        if let Some(starting) = &mut self.starting {
            starting.stopped = true;
        }
    }

    fn to_be_started(&self, event: &Event) -> Result<(Work, JobRecord), Diagnostic> {
        self.may_start(event)?;
        let prepared = self.prepared.as_ref().ok_or_else(|| error!("control.not_armed"))?;
        let Event::Start { from_leg, .. } = *event else {
            return Err(error!("control.not_armed"));
        };
        let plane = [prepared.zero[0], prepared.zero[1]];
        let begun = self.interrupted.as_ref().map(|(begun, _)| zero_of(begun, &self.machine));
        if from_leg > 0 && begun.is_some_and(|zero| zero != Some(plane)) {
            return Err(error!("control.zero_moved"));
        }
        let taken_up =
            self.interrupted.as_ref().filter(|(begun, _)| from_leg > 0 && begun.key == prepared.key);
        let record = JobRecord {
            key: prepared.key.clone(),
            name: prepared.program.name.clone(),
            fingerprint: self.machine.fingerprint(),
            zero: plane,
            ruler: Some(ruler(&self.machine)),
            stream_digest: prepared.digest.clone(),
            levelled: prepared.follows.as_ref().map(|surface| surface.map.key()),
            holes_total: u32::try_from(prepared.program.hole_count()).unwrap_or(u32::MAX),
            toolpaths_total: u32::try_from(prepared.program.toolpath_count()).unwrap_or(u32::MAX),
            record_from: taken_up
                .map_or_else(|| self.outside.record_length(), |(begun, _)| begun.record_from),
        };
        Ok((Work::new(Arc::clone(prepared), from_leg as usize, self.executor.shared.feed_override()), record))
    }

    fn may_start(&self, event: &Event) -> Result<(), Diagnostic> {
        match step(&self.session, event.clone()).1.as_slice() {
            [Action::Refuse(why)] => Err(why.clone()),
            _ => Ok(()),
        }
    }

    /// The journal's answer: starts the job, unless it was stopped or may no longer start. Then it counts
    /// as interrupted before its first move, in agreement with the journal.
    pub(crate) fn begun(&mut self, written: Result<(), Diagnostic>) {
        let Some(starting) = self.starting.take() else { return };
        let Starting { event, mut work, record, asked, reply, stopped, waits } = starting;
        let still = written.clone().and_then(|()| self.tickets.check(asked)).and_then(|()| {
            if stopped { Err(error!("socket.stopped_meanwhile")) } else { self.may_start(&event) }
        });
        let record_from = record.record_from;
        if written.is_ok() {
            self.interrupted = Some((record, work.progress()));
        }
        let done = match still {
            Ok(()) => {
                self.board_begins(&work, record_from);
                work.begins(self.now());
                if work.first == 0 {
                    // A new board has another height, so the tool setter's reference is no longer valid.
                    self.known.setter_steps = None;
                }
                self.work = Some(work);
                self.try_event(event)
            }
            Err(why) => {
                self.session.offer = self.left_over();
                self.offer().into_iter().for_each(|tell| self.tell(tell));
                Err(why)
            }
        };
        let _ = reply.send(done.map(|()| Vec::new()));
        waits.into_iter().for_each(|message| self.take(message));
    }

    /// The interrupted job: its key, and the leg where it would resume.
    fn left_over(&self) -> Option<(String, u32)> {
        self.interrupted.as_ref().map(|(job, progress)| (job.key.clone(), progress.done))
    }

    pub(crate) fn end(&mut self, ending: Ending) {
        let Some(work) = self.work.take() else { return };
        self.executor.shared.set_feed_override(work.percent.min(100));
        self.board_ends(&work);
        self.change_over();
        self.prepared = None;
        self.session.armed = None;
        if ending == Ending::Done {
            self.interrupted = None;
            self.outside.record(Record::Finish);
        } else if let Some((_, progress)) = &mut self.interrupted {
            *progress = work.progress();
        }
        self.session.offer = self.left_over();
        let (holes_done, toolpaths_done) = (work.holes, work.toolpaths);
        self.tell(Tell::Ended(JobEnd { job: work.job.key.clone(), ending, holes_done, toolpaths_done }));
        if let Some(offer) = self.offer() {
            self.tell(offer);
        }
        self.parks_after(&work, ending);
    }

    pub(crate) fn forget(&mut self) -> Result<(), Diagnostic> {
        if self.work.is_some() {
            return Err(error!("control.busy"));
        }
        (self.interrupted, self.session.offer) = (None, None);
        self.outside.record(Record::Finish);
        Ok(())
    }
}
