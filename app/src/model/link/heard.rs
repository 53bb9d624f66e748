//! Handles each message of the bridge.

use super::rest::rest_words;
use super::{LastJob, Link, LinkPhase, MachineQueue, Noted, ask, claim, controller, hand, ping_if_due, stop};
use crate::health::{self, Freshness};
use crate::model::{Effect, Model, machines};
use annulus_core::code;
use annulus_core::control::Ending;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Value;
use annulus_core::queue::{MOST_ROWS, RowResult};
use annulus_core::wire::{
    Ask, Control, JobEnd, OLDEST_PROTOCOL, PROTOCOL, Paired, QueueStatus, Status, Tell, auth,
};
use std::sync::Arc;

/// Handles one message; an unreadable one still proves that the bridge is alive.
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
            // Without an automatic changer an earlier magazine report is outdated.
            if !link.settings.iter().any(by_itself) {
                link.magazine = None;
            }
            return machines::described(model);
        }
        Tell::Status(status) => told(model, *status),
        Tell::Control(now) => return control(model, now),
        Tell::Armed(armed) => link.armed = Some(armed),
        Tell::Ended(end) => {
            let JobEnd { ending, holes_done: holes, toolpaths_done: toolpaths, .. } = end;
            link.interrupted = None;
            link.note(wall_ms, Noted::Ended { ending, holes, toolpaths });
            let by_you = ending == Ending::Stopped && stop::pressed_here(link, model.clock.page_ms);
            link.ended = Some(LastJob { end, by_you });
        }
        Tell::Interrupted(offer) => link.interrupted = Some(offer),
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
        Tell::Controller(who) => return controller::greeted(model, who),
        // STOP while the machine is stopped: nothing to do, so no refusal is shown.
        Tell::Refused { why } if why.code == "control.nothing_to_do" => {}
        // Only logged: the page may have asked automatically, and `Tell::Control` reports who has control.
        Tell::Refused { why } if why.code == "control.taken" => link.note(wall_ms, Noted::Refused(why)),
        Tell::Refused { why } => refused(link, wall_ms, why),
        Tell::Pong { stamp } => {
            stop::pong(link, stamp);
            link.delay_ms = Some(model.clock.page_ms - stamp);
        }
    }
    Vec::new()
}

/// Answers the bridge's challenge with the session and its proof.
fn hello(model: &mut Model, nonce: &str) -> Vec<Effect> {
    // A controller has no other clients, so an empty session is enough.
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

/// Hello was accepted. A stored STOP is sent before anything else; then the page takes control if it is free.
fn welcome(model: &mut Model) -> Vec<Effect> {
    model.link.phase = LinkPhase::Open;
    model.link.ever = true;
    model.link.attempt = 0;
    // Another controller may answer now: nothing is known of it until it has identified itself.
    model.link.controller.who = None;
    model.machines.reconnected();
    if model.link.controller.chosen {
        model.link.status = None;
    }
    // Hello accepted means that the other tab has released the drill.
    model.link.refused.take_if(|why| why.code == code!("drill.other_tab"));
    let mut effects = stop::opened(model);
    model.link.note(model.clock.wall_ms, Noted::Link { open: true });
    effects.extend(ask(model, &Ask::TakeControl { force: false }));
    effects
}

fn told(model: &mut Model, status: Status) {
    let link = &mut model.link;
    stop::status(link, status.state);
    // The user acknowledged the alarm, so refusals from before are outdated.
    let had_alarm = link.status.as_ref().is_some_and(|before| before.alarm.is_some());
    if had_alarm && status.alarm.is_none() {
        link.refused = None;
    }
    // A job that starts at its first hole drills all of them again.
    let idle = link.status.as_ref().is_none_or(|before| before.job.is_none());
    if idle && status.job.is_some() && status.holes_done == 0 {
        link.contacts = Arc::default();
    }
    let words = rest_words(&status, link.homes());
    if link.log.is_news(&status, words) {
        Arc::make_mut(&mut link.log).seen(model.clock.wall_ms, &status, words);
    }
    if link.status.as_ref().and_then(|before| before.other_firmware) != status.other_firmware {
        link.other_firmware = status.other_firmware;
    }
    link.status = Some(Arc::new(status));
    hand::follow(link);
}

/// Updates who has control. If this page lost control without releasing it, it asks again once control is
/// free.
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

/// A refusal before Hello is accepted can mean that a restarted bridge no longer knows this session.
fn refused(link: &mut Link, wall_ms: f64, why: Diagnostic) {
    if matches!(why.code.as_str(), "socket.session" | "socket.proof") && link.phase != LinkPhase::Open {
        link.unknown = true;
    }
    link.note(wall_ms, Noted::Refused(why.clone()));
    link.refused = Some(why);
}

/// Updates all results of the queue, or only the changed ones.
fn queue(queue: &mut MachineQueue, mut news: QueueStatus) {
    if news.whole {
        queue.results.clear();
    }
    for (row, result) in std::mem::take(&mut news.results) {
        let row = (row as usize).min(MOST_ROWS);
        if queue.results.len() <= row {
            queue.results.resize(row + 1, RowResult::default());
        }
        queue.results[row] = result;
    }
    queue.status = news;
}
