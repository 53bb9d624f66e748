//! What each message of the bridge changes.
//!
//! Comes in: a [`Tell`]. Goes out: signals set. Does not know how it travelled.

use super::browser::now_ms;
use super::{Armed, Control, Ended, Freshness, Interrupted, Phase, link, socket, stop};
use annulus_core::wire::Tell;
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
            socket::welcomed();
            stop::opened();
        }
        Tell::Machine { settings, fingerprint } => {
            line.fingerprint.set(fingerprint);
            line.settings.set(Arc::new(settings));
        }
        Tell::Status(status) => {
            stop::status(status.state);
            line.status.set(Some(Arc::new(*status)));
        }
        Tell::Control { yours, taken, viewers } => line.control.set(Control { yours, taken, viewers }),
        Tell::Armed { job, stream_digest, checks } => {
            line.armed.set(Some(Armed { job, stream_digest, checks }));
        }
        Tell::Ended { job, ending, holes_done } => {
            line.interrupted.set(None);
            line.ended.set(Some(Ended { job, ending, holes_done }));
        }
        Tell::Interrupted { job, name, next_leg, holes_done, holes_total } => {
            line.interrupted.set(Some(Interrupted { job, name, next_leg, holes_done, holes_total }));
        }
        Tell::Timing(timing) => line.timing.set(Some(Arc::new(*timing))),
        // STOP at rest: there was nothing to stop, and that is what was wanted.
        Tell::Refused { why } if why.code == "control.nothing_to_do" => {}
        Tell::Refused { why } => line.refused.set(Some(why)),
        Tell::Pong { stamp } => {
            stop::pong(stamp);
            line.delay_ms.set(Some(now_ms() - stamp));
        }
    }
}
