//! STOP: the first effect of its event, before anything else; shouted about when nobody answers. And Escape, which pauses first.
//!
//! Comes in: the press, answers. Goes out: `Ask::Stop` and, after 250 ms of silence, the alert. Knows no buttons.

use super::{Link, LinkEvent, LinkPhase, ask};
use crate::health::{STOP_PATIENCE_MS, StopWay};
use crate::model::{Effect, Event, Model};
use annulus_core::control::State;
use annulus_core::wire::Ask;

/// A job that ends so soon after STOP was pressed ended by it.
const BY_THIS_MS: f64 = 60_000.0;
/// A second Escape within this time stops.
const ESCAPE_TWICE_MS: f64 = 1500.0;

/// Whether STOP was pressed in this page just now.
pub(super) fn pressed_here(link: &Link, now_ms: f64) -> bool {
    link.pressed_ms.is_some_and(|pressed_ms| now_ms - pressed_ms <= BY_THIS_MS)
}

/// Stops the machine. With no link the wish is kept and goes out first on the next one; where the machine is another tab's, that one is
/// told.
pub(super) fn pressed(model: &mut Model) -> Vec<Effect> {
    model.link.pressed_ms = Some(model.clock.page_ms);
    if model.link.phase != LinkPhase::Open {
        model.link.stop = StopWay::Latched;
        model.link.stop_unconfirmed = true;
        return Vec::from_iter(model.frame.alone.then_some(Effect::StopBeside { heard: false }));
    }
    send(model)
}

/// STOP was pressed in another tab of this site: whoever has the machine stops it, and says so.
pub(super) fn beside(model: &mut Model) -> Vec<Effect> {
    if model.link.phase != LinkPhase::Open {
        return Vec::new();
    }
    let mut effects = send(model);
    effects.push(Effect::StopBeside { heard: true });
    effects
}

/// The tab that has the machine stopped it: nothing is kept for later.
pub(super) fn heard_beside(link: &mut Link) {
    if link.stop == StopWay::Latched {
        heard(link);
    }
}

fn send(model: &mut Model) -> Vec<Effect> {
    let at_ms = model.clock.page_ms;
    model.link.stop = StopWay::Sent(at_ms);
    let mut effects = ask(model, &Ask::Stop);
    effects.extend(ask(model, &Ask::Ping { stamp: at_ms }));
    let event = Box::new(Event::Link(LinkEvent::StopLooked));
    effects.push(Effect::Wake { after_ms: STOP_PATIENCE_MS as u32 + 5, event });
    effects
}

/// Shouts if it is time to.
pub(super) fn look(model: &mut Model) {
    if model.link.stop.overdue(model.clock.page_ms) {
        model.link.stop_unconfirmed = true;
    }
}

/// The link is open again: a kept STOP goes out.
pub(super) fn opened(model: &mut Model) -> Vec<Effect> {
    if model.link.stop == StopWay::Latched { send(model) } else { Vec::new() }
}

/// The link broke: a STOP that was not answered is kept.
pub(super) fn broke(link: &mut Link) {
    if matches!(link.stop, StopWay::Sent(_)) {
        link.stop = StopWay::Latched;
        link.stop_unconfirmed = true;
    }
}

/// A pong came back.
pub(super) fn pong(link: &mut Link, stamp_ms: f64) {
    if link.stop.heard_by_pong(stamp_ms) {
        heard(link);
    }
}

/// A status came in.
pub(super) fn status(link: &mut Link, state: State) {
    if link.stop.heard_by(state) {
        heard(link);
    }
}

fn heard(link: &mut Link) {
    link.stop = StopWay::Idle;
    link.stop_unconfirmed = false;
}

/// Pauses a job of ours; never resumes one.
pub(super) fn pause(model: &mut Model) -> Vec<Effect> {
    if model.link.control.yours && model.link.state() == Some(State::Running) {
        ask(model, &Ask::Pause)
    } else {
        Vec::new()
    }
}

/// Escape closes what is open by itself; here it pauses, and the second one stops.
pub(super) fn escape(model: &mut Model) -> Vec<Effect> {
    if !model.link.busy() || !model.link.control.yours {
        return Vec::new();
    }
    let now_ms = model.clock.page_ms;
    let before_ms = model.link.escaped_ms.replace(now_ms);
    if before_ms.is_some_and(|before_ms| now_ms - before_ms <= ESCAPE_TWICE_MS) {
        pressed(model)
    } else {
        pause(model)
    }
}
