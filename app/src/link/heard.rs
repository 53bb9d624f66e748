//! What each message of the bridge changes.
//!
//! Comes in: a [`Tell`]. Goes out: signals set. Does not know how it travelled.

use super::browser::{self, now_ms};
use super::{Armed, Control, Ended, Freshness, Interrupted, Phase, Queue, link, noted, socket, stop};
use crate::health;
use crate::lab::log::Event;
use crate::{model, page};
use annulus_core::control::Ending;
use annulus_core::queue::{MOST_ROWS, RowResult};
use annulus_core::wire::{QueueStatus, Tell};
use leptos::prelude::*;
use std::sync::Arc;

/// Takes one message in.
pub(super) fn heard(tell: Tell) {
    let line = link();
    if line.freshness.get_untracked() != Freshness::Fresh {
        line.freshness.set(Freshness::Fresh);
    }
    match tell {
        Tell::Challenge { nonce, .. } => socket::answer_challenge(&nonce),
        Tell::Welcome { .. } => {
            line.phase.set(Phase::Open);
            line.ever.set(true);
            noted(Event::Link(true));
            socket::welcomed();
            stop::opened();
        }
        Tell::Machine { settings, fingerprint } => {
            if line.fingerprint.with_untracked(|known| *known != fingerprint)
                || line.settings.with_untracked(|known| **known != settings)
            {
                noted(Event::Settings);
            }
            line.fingerprint.set(fingerprint);
            let settings = Arc::new(settings);
            line.settings.set(settings.clone());
            page::send(model::Event::Machine { settings });
        }
        Tell::Status(status) => {
            stop::status(status.state);
            let now_ms = browser::clock_ms();
            if line.log.try_update_untracked(|log| log.seen(now_ms, &status)) == Some(true) {
                line.log.notify();
            }
            line.status.set(Some(Arc::new(*status)));
        }
        Tell::Control { yours, taken, viewers } => {
            let before = line.control.get_untracked();
            if (before.yours, before.taken) != (yours, taken) {
                noted(Event::Control { yours, taken });
                let why = health::ousted(before.yours, yours, taken, socket::released());
                line.ousted.set(why);
            }
            line.control.set(Control { yours, taken, viewers });
            socket::control_told(before.yours, yours, taken);
        }
        Tell::Armed { job, stream_digest, checks } => {
            line.armed.set(Some(Armed { job, stream_digest, checks }));
        }
        Tell::Ended { job, ending, holes_done, .. } => {
            line.interrupted.set(None);
            noted(Event::Ended(ending, holes_done));
            let by_you = ending == Ending::Stopped && stop::pressed_here();
            line.ended.set(Some(Ended { job, ending, holes_done, by_you }));
        }
        Tell::Interrupted { job, name, next_leg, holes_done, holes_total, .. } => {
            line.interrupted.set(Some(Interrupted { job, name, next_leg, holes_done, holes_total }));
        }
        Tell::Timing(timing) => line.timing.set(Some(Arc::new(*timing))),
        Tell::QueueText { text } => line.queue.update(|queue| queue.text = text),
        Tell::Queue(status) => line.queue.update(|queue| took(queue, *status)),
        Tell::Outputs(outputs) => line.outputs.set(outputs),
        // STOP at rest: there was nothing to stop, and that is what was wanted.
        Tell::Refused { why } if why.code == "control.nothing_to_do" => {}
        Tell::Refused { why } => {
            socket::refused(&why.code);
            noted(Event::Refused(why.clone()));
            line.refused.set(Some(why));
        }
        Tell::Pong { stamp } => {
            stop::pong(stamp);
            line.delay_ms.set(Some(now_ms() - stamp));
        }
    }
}

/// Takes the news of the queue in: all results, or those that changed.
fn took(queue: &mut Queue, news: QueueStatus) {
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
