//! What each message of the bridge changes.
//!
//! Comes in: a [`Tell`]. Goes out: what is shown, and answers that are due at once. Does not know how it travelled.

use super::controller::{self, Who};
use super::{
    Armed, Control, Interrupted, JobEnded, Link, LinkPhase, MachineQueue, Noted, ask, claim, ping_if_due,
    stop,
};
use crate::health::{self, Freshness};
use crate::model::{Effect, Model};
use annulus_core::control::Ending;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Value;
use annulus_core::queue::{MOST_ROWS, RowResult};
use annulus_core::wire::{Ask, OLDEST_PROTOCOL, PROTOCOL, Paired, QueueStatus, Status, Tell, auth};
use std::sync::Arc;

/// Takes one message in; one that could not be read says that the bridge is there.
pub(super) fn heard(model: &mut Model, tell: Option<Box<Tell>>) -> Vec<Effect> {
    model.link.heard_ms = model.clock.page_ms;
    let mut effects = Vec::new();
    if let Some(tell) = tell {
        model.link.freshness = Freshness::Fresh;
        effects = took(model, *tell);
    }
    effects.extend(ping_if_due(model));
    effects
}

fn took(model: &mut Model, tell: Tell) -> Vec<Effect> {
    let wall_ms = model.clock.wall_ms;
    let link = &mut model.link;
    match tell {
        Tell::Challenge { nonce, .. } => return hello(model, &nonce),
        Tell::Welcome { .. } => return welcome(model),
        Tell::Machine { settings, fingerprint, faults } => {
            link.faults = faults;
            if link.fingerprint != fingerprint || *link.settings != settings {
                link.note(wall_ms, Noted::Settings);
            }
            link.fingerprint = fingerprint;
            link.settings = Arc::new(settings);
            let by_itself = |(key, value): &(String, Value)| {
                key == "rack.change" && *value == Value::Text("magazine".to_owned())
            };
            if !link.settings.iter().any(by_itself) {
                link.magazine = None;
            }
            model.describe_machine();
        }
        Tell::Status(status) => told(model, *status),
        Tell::Control { yours, taken, viewers } => return control(model, Control { yours, taken, viewers }),
        Tell::Armed { job, stream_digest, levelled, checks } => {
            link.armed = Some(Armed { job, stream_digest, levelled, checks });
        }
        Tell::Ended { job, ending, holes_done, toolpaths_done } => {
            link.interrupted = None;
            link.note(wall_ms, Noted::Ended { ending, holes: holes_done, toolpaths: toolpaths_done });
            let by_you = ending == Ending::Stopped && stop::pressed_here(link, model.clock.page_ms);
            link.ended = Some(JobEnded { job, ending, holes_done, toolpaths_done, by_you });
        }
        offer @ Tell::Interrupted { .. } => link.interrupted = interrupted(offer),
        Tell::Timing(timing) => link.timing = Some(Arc::new(*timing)),
        Tell::QueueText { text } => link.queue.text = text,
        Tell::Queue(status) => queue(&mut link.queue, *status),
        Tell::Outputs(outputs) => link.outputs = outputs,
        Tell::Checked(report) => link.checked = Some(Arc::new(*report)),
        Tell::HeightMap(report) => link.height_map = Arc::new(*report),
        Tell::Tools(report) => link.tools = report,
        Tell::Magazine(report) => {
            let step = report.stock.change.as_ref().filter(|_| report.changes).map(|change| change.step);
            let before = link.magazine.as_ref().and_then(|before| before.stock.change.as_ref());
            if let Some(step) = step.filter(|step| before.map(|before| before.step) != Some(*step)) {
                link.note(wall_ms, Noted::Change(step));
            }
            link.magazine = Some(Arc::new(*report));
        }
        Tell::Touched { leg, height_um } => {
            let job = link.status.as_ref().and_then(|status| status.job.as_deref()).unwrap_or_default();
            Arc::make_mut(&mut link.contacts).touched(job, leg, height_um);
        }
        Tell::Controller { flavour, version, values, mill, lengths, reset_on_open, changer } => {
            let who = Who { flavour, version, values, mill, lengths, reset_on_open, changer };
            return controller::greeted(model, who);
        }
        // STOP at rest: there was nothing to stop, and that is what was wanted.
        Tell::Refused { why } if why.code == "control.nothing_to_do" => {}
        // Who has control is told by itself, also where this page asked for it because nobody seemed to have it.
        Tell::Refused { why } if why.code == "control.taken" => link.note(wall_ms, Noted::Refused(why)),
        Tell::Refused { why } => refused(link, wall_ms, why),
        Tell::Pong { stamp } => {
            stop::pong(link, stamp);
            link.delay_ms = Some(model.clock.page_ms - stamp);
        }
    }
    Vec::new()
}

/// Answers the bridge's first frame: who is speaking, with the proof.
fn hello(model: &mut Model, nonce: &str) -> Vec<Effect> {
    // A controller knows nobody else.
    let own = Paired { ok: true, session: String::new(), key: String::new() };
    let session = if model.link.controller.chosen { Some(own) } else { model.link.session.clone() };
    let Some(session) = session else { return Vec::new() };
    let hello = Ask::Hello {
        proto: PROTOCOL,
        min: OLDEST_PROTOCOL,
        app: env!("CARGO_PKG_VERSION").to_owned(),
        session: session.session,
        proof: auth::hello(&session.key, nonce),
    };
    ask(model, &hello)
}

/// Hello was accepted: a STOP that was kept goes out before anything else, patience starts anew, and control is taken if nobody
/// has it.
fn welcome(model: &mut Model) -> Vec<Effect> {
    model.link.phase = LinkPhase::Open;
    model.link.ever = true;
    model.link.attempt = 0;
    if model.link.controller.chosen {
        // Who answers now is known when it has greeted; until then what it was before says nothing.
        (model.link.status, model.link.controller.who) = (None, None);
    }
    // The other tab let go of the drill.
    model.link.refused.take_if(|why| why.code == "drill.other_tab");
    let mut effects = stop::opened(model);
    model.link.note(model.clock.wall_ms, Noted::Link { open: true });
    effects.extend(ask(model, &Ask::TakeControl { force: false }));
    effects
}

fn told(model: &mut Model, status: Status) {
    let link = &mut model.link;
    stop::status(link, status.state);
    // What was refused while an alarm stood, a press on its own button among it, is answered once that was read.
    let had_alarm = link.status.as_ref().is_some_and(|before| before.alarm.is_some());
    if had_alarm && status.alarm.is_none() {
        link.refused = None;
    }
    // A job that begins from its first hole makes all of them anew.
    let idle = link.status.as_ref().is_none_or(|before| before.job.is_none());
    if idle && status.job.is_some() && status.holes_done == 0 {
        link.contacts = Arc::default();
    }
    if link.log.is_news(&status) {
        Arc::make_mut(&mut link.log).seen(model.clock.wall_ms, &status);
    }
    if link.status.as_ref().and_then(|before| before.other_firmware) != status.other_firmware {
        link.other_firmware = status.other_firmware;
    }
    link.status = Some(Arc::new(status));
}

/// Who has control now. What this page had and did not give away it asks for again, once nobody has it.
fn control(model: &mut Model, now: Control) -> Vec<Effect> {
    let link = &mut model.link;
    let before = std::mem::replace(&mut link.control, now);
    let Control { yours, taken, .. } = now;
    if (before.yours, before.taken) != (yours, taken) {
        link.note(model.clock.wall_ms, Noted::Control { yours, taken });
        link.ousted = health::ousted(before.yours, yours, taken, link.released);
    }
    let mut held = link.claim;
    let wants = held.told(before.yours, yours, taken);
    let mut effects: Vec<Effect> = claim(link, held).into_iter().collect();
    if wants {
        effects.extend(ask(model, &Ask::TakeControl { force: false }));
    }
    effects
}

/// After hello it may be that the bridge was restarted and does not know this page any more.
fn refused(link: &mut Link, wall_ms: f64, why: Diagnostic) {
    if matches!(why.code.as_str(), "socket.session" | "socket.proof") && link.phase != LinkPhase::Open {
        link.unknown = true;
    }
    link.note(wall_ms, Noted::Refused(why.clone()));
    link.refused = Some(why);
}

/// Takes the news of the queue in: all results, or those that changed.
fn queue(queue: &mut MachineQueue, news: QueueStatus) {
    (queue.phase, queue.row, queue.why) = (news.phase, news.row.map(|row| row as usize), news.why);
    if news.whole {
        queue.results.clear();
    }
    for (row, result) in news.results {
        let row = (row as usize).min(MOST_ROWS);
        if queue.results.len() <= row {
            queue.results.resize(row + 1, RowResult::default());
        }
        queue.results[row] = result;
    }
}

/// What can be taken up.
fn interrupted(told: Tell) -> Option<Interrupted> {
    let Tell::Interrupted { job, name, next_leg, holes_done, holes_total, toolpaths_done, toolpaths_total } =
        told
    else {
        return None;
    };
    Some(Interrupted { job, name, next_leg, holes_done, holes_total, toolpaths_done, toolpaths_total })
}
